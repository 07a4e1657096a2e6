//! Native co-adaptation: a plain domain, and what the knowledge base says of its actions, to the explicit form.
//!
//! A domain is plain if it declares no type of function designs. An action of it that the knowledge base knows
//! (`move` as `move` or `a_move`, or by a binding) gets a parameter for the design of each function that it requires, and conditions:
//! the design solves the function, is available, and keeps the bounds of the action (`t:requiresQuality`), in its context if
//! it has one. A numeric function without parameters that is named like an estimated attribute stands for the sum over the chosen
//! designs; one bound to `reconfigured:ATTRIBUTE` for the sum over those that were not at work before. The parameters become
//! slots of the encoding as in the explicit form, so no design is ever ground into an action, unless what a change of designs
//! costs makes the designs part of the state.

mod spoken;
mod walk;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use num_traits::Zero as _;
use ontology::tomasys::{FunctionDesign, Quality, View};
use pddl::ast::{
    Action, ActionBody, Arithmetic, Assignment, Condition, ConditionTime, Declaration, Domain, Effect,
    EffectTime, Expression, Identifier, Name, Problem, Span, Term, TypeExpression, TypedName,
};

use crate::binding::{Bindings, atom, identifier, is_pddl_name};
use crate::message::{Errors, Message};
use walk::{mentions, walk_uncounted};

const FUNCTION: &str = "function";
const DESIGN: &str = "functiondesign";
const SOLVES: &str = "fd_solve_f";
const AVAILABLE: &str = "fd_available";
/// Of a design and its function: it was chosen last.
const AT_WORK: &str = "fd_at_work";
/// Of a function: some design of it has been chosen.
const CONFIGURED: &str = "f_configured";

/// What a knowledge base adds to the actions of a plain domain.
#[derive(Debug, Clone)]
pub struct CoAdaptation {
    /// By the name of the action in the domain.
    actions: BTreeMap<Name, Needs>,
    /// Names of attributes by the numeric function that stands for the chosen designs.
    chosen: BTreeMap<Name, String>,
    /// The same for those that a change has brought.
    changed: BTreeMap<Name, String>,
}

/// What an action needs, and how many parameters it has without that.
#[derive(Debug, Clone)]
struct Needs {
    functions: Vec<Needed>,
    quality: Vec<Quality>,
    parameters: usize,
}

/// A function, and the attributes that are estimated of its designs.
#[derive(Debug, Clone)]
struct Needed {
    name: String,
    attributes: BTreeSet<String>,
}

impl CoAdaptation {
    /// What the knowledge base adds to a domain; none if the domain is not plain, or has no action that it knows.
    ///
    /// # Errors
    /// Names that PDDL does not admit, contexts that the domain does not have, names that the domain uses otherwise.
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
        let known = view.actions();
        let mut actions = BTreeMap::new();
        for action in &domain.actions {
            let name = &action.identifier.name;
            let Some(known) = known.iter().find(|known| bindings.is_action(name, &known.individual)) else {
                continue;
            };
            let functions = known.requires.iter().map(|function| Needed {
                name: function.name.clone(),
                attributes: estimated(designs.iter().filter(|design| design.solves.contains(function))),
            });
            let functions: Vec<_> = functions.collect();
            if !functions.is_empty() {
                let (quality, parameters) = (known.quality.clone(), action.parameters.len());
                actions.insert(name.clone(), Needs { functions, quality, parameters });
            }
        }
        if actions.is_empty() {
            return Ok(None);
        }
        let (chosen, changed) = attributes(domain, problem, view, &designs, bindings);
        let adaptation = Self { actions, chosen, changed };
        let errors = adaptation.errors(domain);
        if errors.is_empty() { Ok(Some(adaptation)) } else { Err(errors.into()) }
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
                    "`{name}` uses `({function})` where no change of designs is counted; `increase` and `decrease` count it, outside of \
                     `when` and `forall`"
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
                        "<{}> counts for `{name}` in the context `{context}`, which is not a predicate of the domain \
                         whose parameters have names of the action's parameters",
                        quality.individual.iri
                    );
                    errors.push(Message::error("M118", text));
                }
            }
        }
        errors
    }

    /// The functions for changed designs that an action mentions in durations, conditions and effects that do not count changes.
    fn not_counted(&self, action: &Action) -> BTreeSet<Name> {
        let found = RefCell::new(BTreeSet::new());
        let see = |part: &mut Expression| {
            if let Expression::Fluent(fluent) = part
                && self.changed.contains_key(&fluent.predicate.name)
            {
                found.borrow_mut().insert(fluent.predicate.name.clone());
            }
        };
        match action.body.clone() {
            ActionBody::Instantaneous { mut precondition, effect } => {
                precondition.change_leaves(&mut |leaf| see(leaf));
                walk_uncounted(effect, &see);
            }
            ActionBody::Durative { duration, conditions, effects } => {
                for mut constraint in duration {
                    constraint.expression.change_leaves(&mut |leaf| see(leaf));
                }
                for (_, mut condition) in conditions {
                    condition.change_leaves(&mut |leaf| see(leaf));
                }
                for (_, effect) in effects {
                    walk_uncounted(effect, &see);
                }
            }
        }
        found.into_inner()
    }

    /// How many parameters an action has in the plain domain.
    pub(super) fn parameters(&self, action: &str) -> Option<usize> {
        self.actions.get(&Name::new(action)).map(|needs| needs.parameters)
    }

    /// The domain in explicit form.
    pub(super) fn explicit(&self, domain: &Domain) -> Domain {
        let mut explicit = domain.clone();
        for own in [FUNCTION, DESIGN] {
            let known = explicit.types.iter().any(|declared| declared.identifier.name == Name::new(own));
            if !known {
                explicit.types.push(typed(own, ""));
            }
        }
        let functions: BTreeSet<&str> = self.needed().map(|needed| needed.name.as_str()).collect();
        let declared: BTreeSet<Name> =
            domain.constants.iter().map(|constant| constant.identifier.name.clone()).collect();
        let new = functions.into_iter().filter(|name| !declared.contains(&Name::new(name)));
        explicit.constants.extend(new.map(|name| typed(name, FUNCTION)));
        explicit.predicates.extend(self.predicates());
        // Outside of actions there are no chosen designs that these could stand for.
        let stands = |name: &Name| self.chosen.contains_key(name) || self.changed.contains_key(name);
        explicit.functions.retain(|declared| !stands(&declared.identifier.name));
        explicit.functions.extend(self.functions());
        let none = Needs { functions: Vec::new(), quality: Vec::new(), parameters: 0 };
        for action in &mut explicit.actions {
            let needs = self.actions.get(&action.identifier.name);
            self.adapt(action, needs.unwrap_or(&none), domain);
        }
        explicit
    }

    /// Adds which designs keep which bounds. Where no design of a function has an estimation of the attribute, the bounds do not
    /// concern the function.
    pub(super) fn fill(&self, problem: &mut Problem, designs: &[FunctionDesign]) {
        for quality in self.quality() {
            for design in designs {
                let concerned = self.needed().any(|needed| {
                    design.solves.iter().any(|function| function.name == needed.name)
                        && needed.attributes.contains(&quality.bounds.attribute)
                });
                let kept = design.estimations.get(&quality.bounds.attribute).is_some_and(|value| {
                    quality.bounds.minimum.as_ref().is_none_or(|minimum| value >= minimum)
                        && quality.bounds.maximum.as_ref().is_none_or(|maximum| value <= maximum)
                });
                if (kept || !concerned) && is_pddl_name(&design.individual.name) {
                    let fact = atom(&meets(quality), &[&design.individual.name]);
                    problem.init.push(pddl::ast::InitialElement::Fact(fact));
                }
            }
        }
    }

    fn needed(&self) -> impl Iterator<Item = &Needed> {
        self.actions.values().flat_map(|needs| &needs.functions)
    }

    /// All bounds, each once.
    fn quality(&self) -> Vec<&Quality> {
        let mut all: Vec<_> = self.actions.values().flat_map(|needs| &needs.quality).collect();
        all.sort_by(|a, b| a.individual.cmp(&b.individual));
        all.dedup();
        all
    }

    fn predicates(&self) -> Vec<Declaration> {
        let mut all = vec![
            declaration(SOLVES, &[("fd", DESIGN), ("f", FUNCTION)]),
            declaration(AVAILABLE, &[("fd", DESIGN)]),
        ];
        if !self.changed.is_empty() {
            all.push(declaration(AT_WORK, &[("fd", DESIGN), ("f", FUNCTION)]));
            all.push(declaration(CONFIGURED, &[("f", FUNCTION)]));
        }
        let meets = self.quality().into_iter().map(|q| declaration(meets(q).as_str(), &[("fd", DESIGN)]));
        all.extend(meets);
        all
    }

    fn functions(&self) -> Vec<Declaration> {
        let attributes: BTreeSet<&String> = self.chosen.values().chain(self.changed.values()).collect();
        attributes.into_iter().map(|attribute| declaration(&value_of(attribute), &[("fd", DESIGN)])).collect()
    }

    /// Gives an action its designs.
    fn adapt(&self, action: &mut Action, needs: &Needs, domain: &Domain) {
        let designs: Vec<(Identifier, &Needed)> = needs
            .functions
            .iter()
            .enumerate()
            .map(|(position, needed)| {
                let mut name = Name::new(&format!("fd{}", position + 1));
                while has_parameter(action, &name) {
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
                let own = std::mem::replace(precondition, Condition::And(Vec::new()));
                *precondition = Condition::And(std::iter::once(own).chain(chosen).chain(lasting).collect());
                self.changes(effect, &designs, &mut work);
                effect.change_leaves(&mut |leaf| rewrite(leaf));
                let own = std::mem::replace(effect, Effect::And(Vec::new()));
                *effect =
                    Effect::And(std::iter::once(own).chain(work).chain(self.starts(&designs)).collect());
            }
            ActionBody::Durative { duration, conditions, effects } => {
                for constraint in duration {
                    constraint.expression.change_leaves(&mut |leaf| rewrite(leaf));
                }
                for (_, condition) in &mut *conditions {
                    condition.change_leaves(&mut |leaf| rewrite(leaf));
                }
                conditions.extend(chosen.into_iter().map(|condition| (ConditionTime::AtStart, condition)));
                conditions.extend(lasting.into_iter().map(|condition| (ConditionTime::OverAll, condition)));
                let mut more = Vec::new();
                for (time, effect) in &mut *effects {
                    self.changes(effect, &designs, &mut work);
                    more.extend(work.drain(..).map(|effect| (*time, effect)));
                    effect.change_leaves(&mut |leaf| rewrite(leaf));
                }
                more.extend(self.starts(&designs).into_iter().map(|effect| (EffectTime::AtEnd, effect)));
                effects.extend(more);
            }
        }
    }

    /// Puts the sum over the chosen designs in the place of the functions that stand for it.
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

    /// For each numeric effect that counts changes: what each changed design adds to it.
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
                            *part = Expression::Fluent(of_design(&value_of(attribute), design, None));
                        }
                    });
                    let counts = mentions(expression, &|name| self.changed.contains_key(name));
                    if counts {
                        let mut without = expression.clone();
                        with.change_leaves(&mut |part| self.sum(part, designs));
                        without.change_leaves(&mut |part| self.sum(part, designs));
                        let more = Expression::Operation(Arithmetic::Subtract, vec![with, without], *span);
                        let more = Effect::Assign(*kind, target.clone(), more, *span);
                        out.push(Effect::When(changed(design, &needed.name), Box::new(more)));
                    }
                }
            }
            _ => {}
        }
    }

    /// The designs are at work from now on, and no others for their functions.
    fn starts(&self, designs: &[(Identifier, &Needed)]) -> Vec<Effect> {
        if self.changed.is_empty() {
            return Vec::new();
        }
        let mut effects = Vec::new();
        for (design, needed) in designs {
            let other = identifier(&Name::new("other"));
            let is_other = Condition::Not(Box::new(Condition::Equal(
                Term::Variable(other.clone()),
                Term::Variable(design.clone()),
                Span::default(),
            )));
            let stops = Effect::Delete(of_design(AT_WORK, &other, Some(&needed.name)));
            let each = Effect::When(is_other, Box::new(stops));
            effects.push(Effect::ForAll(vec![typed("other", DESIGN)], Box::new(each)));
            effects.push(Effect::Add(of_design(AT_WORK, design, Some(&needed.name))));
            effects.push(Effect::Add(atom(&Name::new(CONFIGURED), &[&needed.name])));
        }
        effects
    }
}

/// What must hold when the designs are chosen, and as long as they are at work.
fn conditions(
    designs: &[(Identifier, &Needed)],
    needs: &Needs,
    domain: &Domain,
) -> (Vec<Condition>, Vec<Condition>) {
    let (mut chosen, mut lasting) = (Vec::new(), Vec::new());
    for (design, needed) in designs {
        chosen.push(Condition::Atom(of_design(SOLVES, design, Some(&needed.name))));
        lasting.push(Condition::Atom(of_design(AVAILABLE, design, None)));
        for quality in &needs.quality {
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

/// Another design of the function was at work.
fn changed(design: &Identifier, function: &str) -> Condition {
    let at_work = Condition::Atom(of_design(AT_WORK, design, Some(function)));
    let configured = Condition::Atom(atom(&Name::new(CONFIGURED), &[function]));
    Condition::And(vec![configured, Condition::Not(Box::new(at_work))])
}

/// The functions of the domain that stand for the chosen designs, and for the changed ones, with their attributes.
fn attributes(
    domain: &Domain,
    problem: &Problem,
    view: &View<'_>,
    designs: &[FunctionDesign],
    bindings: &Bindings,
) -> (BTreeMap<Name, String>, BTreeMap<Name, String>) {
    let estimated = estimated(designs.iter());
    let measured: BTreeSet<String> = view.measurements().into_iter().map(|m| m.attribute).collect();
    let valued = |name: &Name| {
        problem.init.iter().any(|element| {
            matches!(element, pddl::ast::InitialElement::Value(atom, _, _) if atom.predicate.name == *name)
        })
    };
    let (mut chosen, mut changed) = (BTreeMap::new(), BTreeMap::new());
    for declared in domain.functions.iter().filter(|declared| declared.parameters.is_empty()) {
        let name = &declared.identifier.name;
        if let Some(attribute) = bindings.reconfigured(name) {
            changed.insert(name.clone(), attribute);
        } else if let Some(attribute) = bindings.chosen(name) {
            chosen.insert(name.clone(), attribute);
        } else if let Some(attribute) = estimated.iter().find(|attribute| Name::new(attribute) == *name)
            && !measured.contains(attribute)
            && !valued(name)
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

/// The predicate that says which designs keep the bounds.
fn meets(quality: &Quality) -> Name {
    Name::new(&format!("fd_meets_{}", quality.individual.name))
}

/// The numeric function of a design that is the value of an attribute; bindings know it by its prefix.
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

/// An atom of a design variable, and of a function if one is given.
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
