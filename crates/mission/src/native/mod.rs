//! Native co-adaptation: compiles a plain domain to the explicit form, using the requirements that
//! the knowledge base has for its actions.
//!
//! A domain is plain if it declares no type of function designs. An action can correspond to an action of the
//! knowledge base by its name (`move` to `move` or `a_move`) or by a binding. It then gets a parameter for the
//! design of each function that the action requires. The action also gets conditions: the design solves the
//! function, is available, and meets the quality bounds of the action (`t:requiresQuality`). A quality bound with a
//! context, which is a predicate of the domain, applies only while this predicate holds for the action's
//! parameters, including the moment at which the action starts. Availability and bounds are conditions over all of a
//! durative action. These do not apply to the duration 0, so if it is possible, they are conditions at the start, too.
//!
//! A numeric function without parameters that is named like an estimated attribute is replaced by the sum over the
//! chosen designs, unless the attribute is measured or the function has an initial value. A function that is bound to
//! `chosen:ATTRIBUTE` is replaced in the same way. A function that is bound to `reconfigured:ATTRIBUTE` is replaced
//! by the sum over the newly chosen designs, i.e. those that replace another design of their function; the first
//! design of a function is not counted, and neither is a design without an estimation.
//!
//! As in an explicit domain, the planner chooses the designs for these parameters without grounding them into actions,
//! unless reconfiguration costs make the designs part of the state.

mod spoken;
mod walk;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use num_rational::BigRational;
use num_traits::{Signed as _, Zero as _};
use ontology::tomasys::{FunctionDesign, Individual, Quality, View};
use pddl::Signs;
use pddl::ast::{
    Action, ActionBody, Arithmetic, Assignment, Condition, ConditionTime, Declaration, Domain, Effect,
    EffectTime, Expression, Identifier, InitialElement, Name, Problem, Span, Term, TypeExpression, TypedName,
};
use pddl::visit::Node;

use crate::binding::{Bindings, add_values, atom, has_value, identifier, is_pddl_name};
use crate::message::{Errors, Message};
use walk::{mentions, walk_uncounted};

const FUNCTION: &str = "function";
const DESIGN: &str = "functiondesign";
const SOLVES: &str = "fd_solve_f";
const AVAILABLE: &str = "fd_available";
/// Predicate `(p DESIGN FUNCTION)`: the design is the one that was last chosen for the function.
const AT_WORK: &str = "fd_at_work";
/// Predicate `(p FUNCTION)`: a design has been chosen for the function.
const CONFIGURED: &str = "f_configured";

/// Additions of a knowledge base to the actions of a plain domain (see the head of this file).
#[derive(Debug, Clone)]
pub struct CoAdaptation {
    actions: BTreeMap<Name, Needs>,
    /// Maps each numeric function to the attribute whose sum over the chosen designs replaces it.
    chosen: BTreeMap<Name, String>,
    /// Maps each numeric function to the attribute whose sum over the newly chosen designs (those that
    /// replace another design of their function) replaces it.
    changed: BTreeMap<Name, String>,
}

#[derive(Debug, Clone)]
struct Needs {
    functions: Vec<Needed>,
    quality: Vec<Quality>,
    parameters: usize,
}

/// A required function, with the attributes for which at least one of its designs has an estimate.
#[derive(Debug, Clone)]
struct Needed {
    name: String,
    attributes: BTreeSet<String>,
}

impl CoAdaptation {
    /// Determines the additions to a domain. Returns `None` if the domain declares a type of designs, or if the
    /// knowledge base requires no function for the domain's actions.
    pub(super) fn new(
        domain: &Domain,
        problem: &Problem,
        view: &View<'_>,
        bindings: &Bindings,
    ) -> Result<Option<Self>, Errors> {
        if domain.types.iter().any(|declared| bindings.is_design(&declared.identifier.name)) {
            return Ok(None);
        }
        let designs = view.function_designs();
        let known_actions = view.actions();
        let (mut actions, mut errors) = (BTreeMap::new(), Vec::new());
        for action in &domain.actions {
            let name = &action.identifier.name;
            let mut matching = known_actions.iter().filter(|action| {
                bindings.is_action(name, &action.individual)
                    && !(action.requires.is_empty() && action.quality.is_empty())
            });
            let Some(known_action) = matching.next() else { continue };
            let iri = &known_action.individual.iri;
            let differs = |other: &&ontology::tomasys::Action| {
                (&other.requires, &other.quality) != (&known_action.requires, &known_action.quality)
                    && !view.are_same(iri, &other.individual.iri)
            };
            if let Some(other) = matching.find(differs) {
                let text = format!(
                    "the action `{name}` corresponds to both <{iri}> and <{other}>; bind it to one of them: `{name} = \
                     \"action:{iri}\"`",
                    other = other.individual.iri
                );
                errors.push(Message::error("M225", text));
            }
            let functions = known_action.requires.iter().map(|function| Needed {
                name: function.name.clone(),
                attributes: estimated(designs.iter().filter(|design| design.solves.contains(function))),
            });
            let functions: Vec<_> = functions.collect();
            if !functions.is_empty() {
                let (quality, parameters) = (known_action.quality.clone(), action.parameters.len());
                actions.insert(name.clone(), Needs { functions, quality, parameters });
            }
        }
        if actions.is_empty() && errors.is_empty() {
            return Ok(None);
        }
        let (chosen, changed) = attributes(domain, problem, view, &designs, bindings);
        let adaptation = Self { actions, chosen, changed };
        errors.extend(adaptation.errors(domain));
        errors.extend(adaptation.valued(problem));
        errors.extend(adaptation.stated(problem));
        if errors.is_empty() { Ok(Some(adaptation)) } else { Err(errors.into()) }
    }

    /// Returns errors for the functions that a sum replaces, although the problem gives them a value.
    fn valued(&self, problem: &Problem) -> Vec<Message> {
        let chosen = self.chosen.iter().map(|(function, attribute)| (function, "chosen", attribute));
        let changed = self.changed.iter().map(|(function, attribute)| (function, "reconfigured", attribute));
        let valued = chosen.chain(changed).filter(|(function, ..)| has_value(problem, function));
        let error = |(function, kind, attribute): (&Name, &str, &String)| {
            let text = format!(
                "`{function}` is bound to `{kind}:{attribute}`, but the problem gives it a value; remove the binding, \
                 or the value and all its other uses"
            );
            Message::error("M233", text)
        };
        valued.map(error).collect()
    }

    /// Returns errors for facts of the problem that state which designs meet a quality bound. The knowledge base decides.
    fn stated(&self, problem: &Problem) -> Vec<Message> {
        let predicates: BTreeSet<Name> = self.quality().into_iter().map(meets).collect();
        let stated = problem.init.iter().filter_map(|element| match element {
            InitialElement::Fact(atom) => Some(&atom.predicate.name),
            _ => None,
        });
        let stated: BTreeSet<&Name> = stated.filter(|name| predicates.contains(*name)).collect();
        let error = |name: &Name| {
            let text = format!(
                "the problem states facts of `{name}`, which co-adaptation adds to a plain domain; remove them"
            );
            Message::error("M116", text)
        };
        stated.into_iter().map(error).collect()
    }

    fn errors(&self, domain: &Domain) -> Vec<Message> {
        let mut errors = Vec::new();
        let declared = domain.predicates.iter().chain(&domain.functions).map(|d| &d.identifier.name);
        let types = domain.types.iter().map(|declared| &declared.identifier.name);
        let used: BTreeSet<&Name> = declared.chain(types).collect();
        for own in self.predicates().into_iter().chain(self.functions()).map(|d| d.identifier.name) {
            if used.contains(&own) {
                let text = format!("the domain declares `{own}`, which co-adaptation adds to a plain domain");
                errors.push(Message::error("M116", text));
            }
        }
        for (name, needs) in &self.actions {
            for needed in needs.functions.iter().filter(|needed| !is_pddl_name(&needed.name)) {
                let text = format!("`{name}` requires `{}`, which is not a PDDL name", needed.name);
                errors.push(Message::error("M117", text));
            }
            let action = domain.actions.iter().find(|action| action.identifier.name == *name);
            for function in action.into_iter().flat_map(|action| self.not_counted(action)) {
                let text = format!(
                    "`{name}` uses `({function})` where reconfigurations cannot be counted; use it in `increase` or \
                     `decrease`, outside of `when` and `forall`, and neither in a product with such a function nor in \
                     a divisor"
                );
                errors.push(Message::error("M228", text));
            }
            for quality in &needs.quality {
                let Some(context) = &quality.context else { continue };
                let predicate = domain.predicates.iter().find(|p| p.identifier.name == Name::new(context));
                let fits = predicate.is_some_and(|predicate| {
                    predicate.parameters.iter().all(|parameter| {
                        action.is_some_and(|action| has_parameter(action, &parameter.identifier.name))
                    })
                });
                if !fits {
                    let text = format!(
                        "<{}> applies to `{name}` in the context `{context}`, which is not a predicate of the domain \
                         whose parameters have names of the action's parameters",
                        quality.individual.iri
                    );
                    errors.push(Message::error("M118", text));
                }
            }
        }
        errors
    }

    fn not_counted(&self, action: &Action) -> BTreeSet<Name> {
        let uncounted = RefCell::new(BTreeSet::new());
        let is_counted = |name: &Name| self.changed.contains_key(name);
        let see = |part: &mut Expression| {
            if let Expression::Fluent(fluent) = part
                && is_counted(&fluent.predicate.name)
            {
                uncounted.borrow_mut().insert(fluent.predicate.name.clone());
            }
        };
        match action.body.clone() {
            ActionBody::Instantaneous { mut precondition, effect } => {
                precondition.change_leaves(&mut |leaf| see(leaf));
                walk_uncounted(effect, &is_counted, &see);
            }
            ActionBody::Durative { duration, conditions, effects } => {
                for mut constraint in duration {
                    constraint.expression.change_leaves(&mut |leaf| see(leaf));
                }
                for (_, mut condition) in conditions {
                    condition.change_leaves(&mut |leaf| see(leaf));
                }
                for (_, effect) in effects {
                    walk_uncounted(effect, &is_counted, &see);
                }
            }
        }
        uncounted.into_inner()
    }

    pub(super) fn parameters(&self, action: &str) -> Option<usize> {
        self.actions.get(&Name::new(action)).map(|needs| needs.parameters)
    }

    pub(super) fn functions_of(&self, action: &str) -> Vec<&str> {
        let needs = self.actions.get(&Name::new(action));
        needs.into_iter().flat_map(|needs| &needs.functions).map(|needed| needed.name.as_str()).collect()
    }

    pub(super) fn explicit(&self, domain: &Domain) -> Domain {
        let mut explicit = domain.clone();
        for own in [FUNCTION, DESIGN] {
            let is_declared =
                explicit.types.iter().any(|declared| declared.identifier.name == Name::new(own));
            if !is_declared {
                explicit.types.push(typed(own, ""));
            }
        }
        let functions: BTreeSet<&str> = self.needed().map(|needed| needed.name.as_str()).collect();
        let declared: BTreeSet<Name> =
            domain.constants.iter().map(|constant| constant.identifier.name.clone()).collect();
        let new = functions.into_iter().filter(|name| !declared.contains(&Name::new(name)));
        explicit.constants.extend(new.map(|name| typed(name, FUNCTION)));
        explicit.predicates.extend(self.predicates());
        // These functions have no value outside of actions, because no designs are chosen there.
        let stands = |name: &Name| self.chosen.contains_key(name) || self.changed.contains_key(name);
        explicit.functions.retain(|declared| !stands(&declared.identifier.name));
        explicit.functions.extend(self.functions());
        let no_needs = Needs { functions: Vec::new(), quality: Vec::new(), parameters: 0 };
        for action in &mut explicit.actions {
            let needs = self.actions.get(&action.identifier.name);
            self.adapt(action, needs.unwrap_or(&no_needs), domain);
        }
        explicit
    }

    /// Returns `true` if an action with designs is durative and has no number above 0 as lower bound of its duration.
    pub(super) fn may_be_instantaneous(&self, domain: &Domain) -> bool {
        let is_positive = |expression: &Expression| matches!(expression, Expression::Number(number, _) if number.is_positive());
        let mut actions =
            domain.actions.iter().filter(|action| self.actions.contains_key(&action.identifier.name));
        actions.any(|Action { body, .. }| {
            matches!(body, ActionBody::Durative { .. }) && !body.has_positive_duration(is_positive)
        })
    }

    /// Returns the explicit form `domain` with the conditions over all on designs also at the start of each action whose
    /// duration may be 0. Returns `None` if there is no such action.
    pub(super) fn with_starts(&self, domain: &Domain, problem: &Problem) -> Option<Domain> {
        let signs = Signs::new(domain, problem);
        let admits_zero = |action: &Action| {
            self.actions.contains_key(&action.identifier.name) && signs.admit_zero(&action.body)
        };
        if !domain.actions.iter().any(admits_zero) {
            return None;
        }
        let (mut extended, added) = (domain.clone(), self.added());
        for action in extended.actions.iter_mut().filter(|action| admits_zero(action)) {
            let ActionBody::Durative { conditions, effects, .. } = &mut action.body else { continue };
            let lasting = conditions.iter().filter(|(time, condition)| {
                *time == ConditionTime::OverAll
                    && condition.has_atom(|predicate| added.contains(predicate))
                    && !is_ended_context(condition, effects, domain)
            });
            let starts: Vec<_> = lasting.map(|(_, part)| (ConditionTime::AtStart, part.clone())).collect();
            conditions.extend(starts);
        }
        Some(extended)
    }

    /// For each quality bound, adds facts to the problem for the designs that meet it. A design that lacks an
    /// estimate also has the fact if no design of the required functions that it solves has an estimate of the attribute;
    /// the explicit form does not test such facts. Adds the values for changes of designs that the bindings do not add.
    pub(super) fn fill(&self, problem: &mut Problem, designs: &[FunctionDesign]) {
        self.fill_changes(problem, designs);
        for quality in self.quality() {
            for design in designs {
                let concerned = self.is_concerned(design, &quality.bounds.attribute);
                let kept = design.estimations.get(&quality.bounds.attribute).is_some_and(|value| {
                    quality.bounds.minimum.as_ref().is_none_or(|minimum| value >= minimum)
                        && quality.bounds.maximum.as_ref().is_none_or(|maximum| value <= maximum)
                });
                if (kept || !concerned) && is_pddl_name(&design.individual.name) {
                    let fact = atom(&meets(quality), &[&design.individual.name]);
                    problem.init.push(InitialElement::Fact(fact));
                }
            }
        }
    }

    /// Adds the values for changes of designs that the bindings do not add. A change to a design without an estimation
    /// has the value 0: without a value, no action could change to the design.
    fn fill_changes(&self, problem: &mut Problem, designs: &[FunctionDesign]) {
        let attributes: BTreeSet<&String> = self.changed.values().collect();
        for attribute in attributes {
            let function = self.change_of(attribute);
            let is_filled_by_binding = function == value_of(attribute);
            let concerned = designs.iter().filter(|design| self.is_concerned(design, attribute));
            let values = concerned.filter_map(|design| {
                let value = match design.estimations.get(attribute) {
                    Some(_) if is_filled_by_binding => return None,
                    Some(value) => value.clone(),
                    None => BigRational::zero(),
                };
                Some((vec![design.individual.name.clone()], value))
            });
            add_values(problem, &Name::new(&function), values.collect());
        }
    }

    /// Returns `true` if the design solves a required function of which some design has an estimation of the attribute.
    fn is_concerned(&self, design: &FunctionDesign, attribute: &str) -> bool {
        self.needed().any(|needed| {
            design.solves.iter().any(|function| function.name == needed.name)
                && needed.attributes.contains(attribute)
        })
    }

    /// Returns the name of the numeric function that has the value of an attribute for a change to a design. It differs
    /// from that for a chosen design if both are used, because only a change is free without an estimation.
    fn change_of(&self, attribute: &str) -> String {
        if self.chosen.values().any(|chosen| chosen == attribute) {
            let mut name = format!("reconfigured_{attribute}");
            while self.chosen.values().any(|own| Name::new(own) == Name::new(&name)) {
                name.push('_');
            }
            value_of(&name)
        } else {
            value_of(attribute)
        }
    }

    fn needed(&self) -> impl Iterator<Item = &Needed> {
        self.actions.values().flat_map(|needs| &needs.functions)
    }

    fn quality(&self) -> Vec<&Quality> {
        let mut bounds: Vec<_> = self.actions.values().flat_map(|needs| &needs.quality).collect();
        bounds.sort_by(|a, b| a.individual.cmp(&b.individual));
        bounds.dedup();
        bounds
    }

    /// Returns the individuals that hold the quality bounds of the domain's actions. Each has a predicate.
    pub(crate) fn requirements(&self) -> BTreeSet<Individual> {
        self.quality().into_iter().map(|quality| quality.individual.clone()).collect()
    }

    /// Returns the names of the attributes of sums over designs and of quality bounds.
    pub(crate) fn attributes(&self) -> BTreeSet<String> {
        let bounded = self.quality().into_iter().map(|quality| &quality.bounds.attribute);
        self.chosen.values().chain(self.changed.values()).chain(bounded).cloned().collect()
    }

    fn predicates(&self) -> Vec<Declaration> {
        let mut predicates = vec![
            declaration(SOLVES, &[("fd", DESIGN), ("f", FUNCTION)]),
            declaration(AVAILABLE, &[("fd", DESIGN)]),
        ];
        if !self.changed.is_empty() {
            predicates.push(declaration(AT_WORK, &[("fd", DESIGN), ("f", FUNCTION)]));
            predicates.push(declaration(CONFIGURED, &[("f", FUNCTION)]));
        }
        let meets = self.quality().into_iter().map(|q| declaration(meets(q).as_str(), &[("fd", DESIGN)]));
        predicates.extend(meets);
        predicates
    }

    fn functions(&self) -> Vec<Declaration> {
        let chosen = self.chosen.values().map(|attribute| value_of(attribute));
        let changed = self.changed.values().map(|attribute| self.change_of(attribute));
        let names: BTreeSet<String> = chosen.chain(changed).collect();
        names.iter().map(|name| declaration(name, &[("fd", DESIGN)])).collect()
    }

    fn adapt(&self, action: &mut Action, needs: &Needs, domain: &Domain) {
        let designs: Vec<(Identifier, &Needed)> = needs
            .functions
            .iter()
            .enumerate()
            .map(|(position, needed)| {
                let mut name = Name::new(&format!("fd{}", position + 1));
                while has_parameter(action, &name) || has_quantified(&action.body, &name) {
                    name = Name::new(&format!("{name}_"));
                }
                action.parameters.push(typed(name.as_str(), DESIGN));
                (identifier(&name), needed)
            })
            .collect();
        let (chosen, lasting) = conditions(&designs, needs, domain);
        let rewrite = |expression: &mut Expression| self.sum(expression, &designs);
        let mut work = Vec::new();
        match &mut action.body {
            ActionBody::Instantaneous { precondition, effect } => {
                precondition.change_leaves(&mut |leaf| rewrite(leaf));
                let original = std::mem::replace(precondition, Condition::And(Vec::new()));
                *precondition =
                    Condition::And(std::iter::once(original).chain(chosen).chain(lasting).collect());
                self.changes(effect, &designs, &mut work);
                effect.change_leaves(&mut |leaf| rewrite(leaf));
                let original = std::mem::replace(effect, Effect::And(Vec::new()));
                *effect =
                    Effect::And(std::iter::once(original).chain(work).chain(self.starts(&designs)).collect());
            }
            ActionBody::Durative { duration, conditions, effects } => {
                for constraint in duration {
                    constraint.expression.change_leaves(&mut |leaf| rewrite(leaf));
                }
                for (_, condition) in &mut *conditions {
                    condition.change_leaves(&mut |leaf| rewrite(leaf));
                }
                conditions.extend(chosen.into_iter().map(|condition| (ConditionTime::AtStart, condition)));
                // A context that the action ends at its start holds then, but not in the interval after the start.
                let ended = lasting.iter().filter(|condition| is_ended_context(condition, effects, domain));
                conditions.extend(ended.map(|condition| (ConditionTime::AtStart, condition.clone())));
                conditions.extend(lasting.into_iter().map(|condition| (ConditionTime::OverAll, condition)));
                let mut additions = Vec::new();
                for (time, effect) in &mut *effects {
                    self.changes(effect, &designs, &mut work);
                    additions.extend(work.drain(..).map(|effect| (*time, effect)));
                    effect.change_leaves(&mut |leaf| rewrite(leaf));
                }
                additions.extend(self.starts(&designs).into_iter().map(|effect| (EffectTime::AtEnd, effect)));
                effects.extend(additions);
            }
        }
    }

    /// If a leaf expression is a function bound to the chosen designs, replaces it by the sum of the function's
    /// attribute over `designs`. A function bound to the newly chosen designs becomes 0.
    fn sum(&self, expression: &mut Expression, designs: &[(Identifier, &Needed)]) {
        let Expression::Fluent(fluent) = expression else { return };
        if let Some(attribute) = self.chosen.get(&fluent.predicate.name) {
            let estimated = designs.iter().filter(|(_, needed)| needed.attributes.contains(attribute));
            let values = estimated
                .map(|(design, _)| Expression::Fluent(of_design(&value_of(attribute), design, None)));
            *expression = total(values.collect(), fluent.span);
        } else if self.changed.contains_key(&fluent.predicate.name) {
            *expression = Expression::Number(BigRational::zero(), fluent.span);
        }
    }

    /// For each `increase` or `decrease` effect whose amount contains a sum over the newly chosen designs, appends a
    /// conditional effect per design to `out`. The conditional effect applies the design's share of the sum if the
    /// design replaces another one.
    fn changes(&self, effect: &Effect, designs: &[(Identifier, &Needed)], out: &mut Vec<Effect>) {
        match effect {
            Effect::And(parts) => parts.iter().for_each(|part| self.changes(part, designs, out)),
            Effect::Assign(
                kind @ (Assignment::Increase | Assignment::Decrease),
                target,
                expression,
                span,
            ) => {
                for (design, needed) in designs {
                    let mut with = expression.clone();
                    with.change_leaves(&mut |part: &mut Expression| {
                        let Expression::Fluent(fluent) = part else { return };
                        let attribute = self.changed.get(&fluent.predicate.name);
                        if let Some(attribute) = attribute.filter(|own| needed.attributes.contains(*own)) {
                            *part = Expression::Fluent(of_design(&self.change_of(attribute), design, None));
                        }
                    });
                    let counts = mentions(expression, &|name| self.changed.contains_key(name));
                    if counts {
                        let mut without = expression.clone();
                        with.change_leaves(&mut |part| self.sum(part, designs));
                        without.change_leaves(&mut |part| self.sum(part, designs));
                        let difference =
                            Expression::Operation(Arithmetic::Subtract, vec![with, without], *span);
                        let difference = Effect::Assign(*kind, target.clone(), difference, *span);
                        out.push(Effect::When(changed(design, &needed.name), Box::new(difference)));
                    }
                }
            }
            _ => {}
        }
    }

    /// Returns the effects that record the chosen design of each function and remove the previously chosen one. Empty
    /// if no function counts reconfigurations.
    fn starts(&self, designs: &[(Identifier, &Needed)]) -> Vec<Effect> {
        if self.changed.is_empty() {
            return Vec::new();
        }
        let mut effects = Vec::new();
        for (design, needed) in designs {
            let other_design = identifier(&Name::new("other"));
            let is_other = Condition::Not(Box::new(Condition::Equal(
                Term::Variable(other_design.clone()),
                Term::Variable(design.clone()),
                Span::default(),
            )));
            let stops = Effect::Delete(of_design(AT_WORK, &other_design, Some(&needed.name)));
            let each = Effect::When(is_other, Box::new(stops));
            effects.push(Effect::ForAll(vec![typed("other", DESIGN)], Box::new(each)));
            effects.push(Effect::Add(of_design(AT_WORK, design, Some(&needed.name))));
            effects.push(Effect::Add(atom(&Name::new(CONFIGURED), &[&needed.name])));
        }
        effects
    }
}

/// Returns two lists of conditions on the designs of an action: those that must hold when the
/// action starts, and those that must hold during the action. A quality bound does not apply to a function if no design
/// of the function has an estimate of the attribute.
fn conditions(
    designs: &[(Identifier, &Needed)],
    needs: &Needs,
    domain: &Domain,
) -> (Vec<Condition>, Vec<Condition>) {
    let (mut chosen, mut lasting) = (Vec::new(), Vec::new());
    for (design, needed) in designs {
        chosen.push(Condition::Atom(of_design(SOLVES, design, Some(&needed.name))));
        lasting.push(Condition::Atom(of_design(AVAILABLE, design, None)));
        let applies = |quality: &&Quality| needed.attributes.contains(&quality.bounds.attribute);
        for quality in needs.quality.iter().filter(applies) {
            let kept = Condition::Atom(of_design(meets(quality).as_str(), design, None));
            let context = quality.context.as_ref().and_then(|context| {
                domain.predicates.iter().find(|p| p.identifier.name == Name::new(context))
            });
            lasting.push(match context {
                None => kept,
                Some(predicate) => {
                    let mut here = atom(&predicate.identifier.name, &[]);
                    let parameters = predicate.parameters.iter();
                    here.arguments =
                        parameters.map(|p| Term::Variable(identifier(&p.identifier.name))).collect();
                    Condition::Or(vec![Condition::Not(Box::new(Condition::Atom(here))), kept])
                }
            });
        }
    }
    (chosen, lasting)
}

/// Returns `true` if a condition is a quality bound with a context that the start effects of the action may end. The
/// truth of a derived predicate may depend on every effect.
fn is_ended_context(condition: &Condition, effects: &[(EffectTime, Effect)], domain: &Domain) -> bool {
    let Condition::Or(parts) = condition else { return false };
    let context = parts.iter().find_map(|part| match part {
        Condition::Not(context) => match &**context {
            Condition::Atom(context) => Some(&context.predicate.name),
            _ => None,
        },
        _ => None,
    });
    let is_derived =
        |context: &Name| domain.derived.iter().any(|axiom| axiom.head.identifier.name == *context);
    let mut starts = effects.iter().filter(|(time, _)| *time == EffectTime::AtStart);
    context.is_some_and(|context| starts.any(|(_, effect)| is_derived(context) || deletes(effect, context)))
}

fn deletes(effect: &Effect, predicate: &Name) -> bool {
    match effect {
        Effect::And(parts) => parts.iter().any(|part| deletes(part, predicate)),
        Effect::ForAll(_, inner) | Effect::When(_, inner) => deletes(inner, predicate),
        Effect::Delete(atom) => atom.predicate.name == *predicate,
        Effect::Add(_) | Effect::Assign(..) => false,
    }
}

/// Returns the condition that `function` was last configured with another design than `design`.
fn changed(design: &Identifier, function: &str) -> Condition {
    let at_work = Condition::Atom(of_design(AT_WORK, design, Some(function)));
    let configured = Condition::Atom(atom(&Name::new(CONFIGURED), &[function]));
    Condition::And(vec![configured, Condition::Not(Box::new(at_work))])
}

/// Returns the numeric functions that are sums over the chosen designs, and those that are sums over the newly chosen
/// designs, each with its attribute.
fn attributes(
    domain: &Domain,
    problem: &Problem,
    view: &View<'_>,
    designs: &[FunctionDesign],
    bindings: &Bindings,
) -> (BTreeMap<Name, String>, BTreeMap<Name, String>) {
    let estimated = estimated(designs.iter());
    let measured: BTreeSet<String> = view.measurements().into_iter().map(|m| m.attribute).collect();
    let (mut chosen, mut changed) = (BTreeMap::new(), BTreeMap::new());
    for declared in domain.functions.iter().filter(|declared| declared.parameters.is_empty()) {
        let name = &declared.identifier.name;
        if let Some(attribute) = bindings.reconfigured(name) {
            changed.insert(name.clone(), attribute);
        } else if let Some(attribute) = bindings.chosen(name) {
            chosen.insert(name.clone(), attribute);
        } else if let Some(attribute) = estimated.iter().find(|attribute| Name::new(attribute) == *name)
            && !measured.contains(attribute)
            && !has_value(problem, name)
        {
            chosen.insert(name.clone(), attribute.clone());
        }
    }
    (chosen, changed)
}

fn estimated<'a>(designs: impl Iterator<Item = &'a FunctionDesign>) -> BTreeSet<String> {
    designs.flat_map(|design| design.estimations.keys().cloned()).collect()
}

fn has_parameter(action: &Action, name: &Name) -> bool {
    action.parameters.iter().any(|parameter| parameter.identifier.name == *name)
}

/// Returns `true` if a quantifier of an action binds a variable of this name.
fn has_quantified(body: &ActionBody, name: &Name) -> bool {
    let mut is_bound = false;
    body.walk(&mut |node| {
        if let Node::Condition(Condition::Exists(variables, _) | Condition::ForAll(variables, _))
        | Node::Effect(Effect::ForAll(variables, _)) = node
        {
            is_bound |= variables.iter().any(|variable| variable.identifier.name == *name);
        }
    });
    is_bound
}

/// Returns the name of the predicate of the designs that meet a quality bound. Characters that PDDL does not allow, for
/// example in the IRI of an anonymous bound, are replaced by their hexadecimal codes between dots.
fn meets(quality: &Quality) -> Name {
    let name = &quality.individual.name;
    // Only a replaced name begins with a dot, and its dots are replaced, so that different names remain different.
    if is_pddl_name(name) && !name.starts_with('.') {
        return Name::new(&format!("fd_meets_{name}"));
    }
    let mut replaced = String::from("fd_meets_.");
    for c in name.chars() {
        if c.is_ascii_alphanumeric() || "-_".contains(c) {
            replaced.push(c);
        } else {
            let _ = write!(replaced, ".{:x}.", u32::from(c));
        }
    }
    Name::new(&replaced)
}

/// Returns the name of the numeric function that has the value of an attribute for a design.
/// Bindings recognise the function by its prefix.
fn value_of(attribute: &str) -> String {
    format!("fd_{attribute}")
}

fn typed(name: &str, r#type: &str) -> TypedName {
    let alternatives = (!r#type.is_empty()).then(|| identifier(&Name::new(r#type)));
    let r#type = TypeExpression { alternatives: alternatives.into_iter().collect() };
    TypedName { identifier: identifier(&Name::new(name)), r#type }
}

fn declaration(name: &str, parameters: &[(&str, &str)]) -> Declaration {
    let parameters = parameters.iter().map(|(name, r#type)| typed(name, r#type)).collect();
    Declaration { identifier: identifier(&Name::new(name)), parameters }
}

fn of_design(symbol: &str, design: &Identifier, function: Option<&str>) -> pddl::ast::Atom {
    let mut atom = atom(&Name::new(symbol), function.as_slice());
    atom.arguments.insert(0, Term::Variable(design.clone()));
    atom
}

fn total(mut parts: Vec<Expression>, span: Span) -> Expression {
    match parts.len() {
        0 => Expression::Number(BigRational::zero(), span),
        1 => parts.remove(0),
        _ => Expression::Operation(Arithmetic::Add, parts, span),
    }
}
