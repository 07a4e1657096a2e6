//! Finds missing values of numeric functions, and negative durations.
//!
//! For each numeric function that an action needs, the analysis enumerates argument tuples. It omits tuples for which
//! the static facts rule out the action (three-valued evaluation of its conditions, as in grounding). Tuples with two
//! equal arguments are skipped, and the enumeration ends when its budget is spent. A mission may omit values for
//! impossible cases, so a missing value causes a warning only in three cases:
//!
//! - The function has only constants as arguments.
//! - At least three quarters of the tuples have a value.
//! - All parameters of the function occur in a static fact that holds and is part of the action's
//!   conditions, such as `(lit_aisle a b)` for `(distance a b)`. In addition, at least two thirds of the
//!   tuples have a value, or the only argument is a design.
//!
//! Functions without any value have a separate warning. Durations are computed from values that no action
//! changes.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use ::mission::{Mission, doubt_about};
use num_rational::BigRational;
use num_traits::Zero as _;
use ontology::tomasys::FunctionDesign;
use pddl::TypeHierarchy;
use pddl::ast::{
    Action, ActionBody, Arithmetic, Assignment, Comparison, Condition, Domain, Effect, Expression,
    InitialElement, Name, Problem, Term, TypeExpression,
};

use super::syntax::{
    Binding, bound_arguments, conditions, constants, effects, grounded, grows, in_expression, needed, object,
    variables_of, walk,
};

use crate::message::Message;
use crate::mission::conditions::written;
use crate::number;

const BUDGET: usize = 50_000;

/// A numeric function with arguments for which an action needs a value that is missing.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct MissingValue {
    /// The function with its arguments, such as `(distance a b)`. If the value is an estimation of
    /// a design, `(ATTRIBUTE DESIGN)`.
    pub function: String,
    /// Actions that need the value.
    pub needed_by: Vec<String>,
    /// If the value is an estimation: the design and the attribute.
    pub estimation: Option<(String, String)>,
    /// Name of the file that should contain the value.
    pub file: String,
    pub(super) symbol: String,
    pub(super) is_silent: bool,
    pub(super) is_likely: bool,
}

/// Maps each function and argument tuple without a value to whether the value is probably missing by mistake,
/// and to the actions that need the value.
type Needed = BTreeMap<(Name, Vec<Name>), (bool, BTreeSet<String>)>;

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct NegativeDuration {
    pub(super) action: String,
    pub(super) duration: String,
    pub(super) causes: Vec<String>,
    pub(super) design: Option<String>,
}

pub(super) struct Numbers<'m> {
    pub(super) mission: &'m Mission,
    pub(super) domain: &'m Domain,
    problem: Problem,
    types: TypeHierarchy,
    /// Predicates that are not static: actions or timed initial literals change them, axioms derive them, or they
    /// express the availability of designs.
    dynamic: HashSet<Name>,
    changed: HashSet<Name>,
    assigned: HashSet<Name>,
    facts: HashMap<Name, HashSet<Vec<Name>>>,
    values: HashMap<Name, HashMap<Vec<Name>, BigRational>>,
    designs: BTreeSet<String>,
    budget: Cell<usize>,
}

impl<'m> Numbers<'m> {
    pub(super) fn new(mission: &'m Mission) -> Self {
        let domain = mission.domain();
        let mut problem = mission.problem().clone();
        mission.fill(&mut problem);
        let mut facts: HashMap<Name, HashSet<Vec<Name>>> = HashMap::new();
        let mut values: HashMap<Name, HashMap<Vec<Name>, BigRational>> = HashMap::new();
        let mut dynamic: HashSet<Name> =
            domain.derived.iter().map(|axiom| axiom.head.identifier.name.clone()).collect();
        let predicates = domain.predicates.iter().map(|declared| &declared.identifier.name);
        dynamic.extend(predicates.filter(|name| mission.bindings().is_availability(name)).cloned());
        for element in &problem.init {
            match element {
                InitialElement::Fact(atom) => {
                    facts.entry(atom.predicate.name.clone()).or_default().insert(constants(atom));
                }
                InitialElement::Value(atom, value, _) => {
                    let values_of_function = values.entry(atom.predicate.name.clone()).or_default();
                    values_of_function.insert(constants(atom), value.clone());
                }
                InitialElement::Timed(_, atom, ..) => drop(dynamic.insert(atom.predicate.name.clone())),
                InitialElement::NegatedFact(_) => {}
            }
        }
        let (mut changed, mut assigned) = (HashSet::new(), HashSet::new());
        for effect in domain.actions.iter().flat_map(|action| effects(&action.body)) {
            walk(effect, &mut |effect| match effect {
                Effect::Add(atom) | Effect::Delete(atom) => drop(dynamic.insert(atom.predicate.name.clone())),
                Effect::Assign(kind, target, ..) => {
                    changed.insert(target.predicate.name.clone());
                    if *kind == Assignment::Assign {
                        assigned.insert(target.predicate.name.clone());
                    }
                }
                _ => {}
            });
        }
        let knowledge = mission.knowledge().into_iter().flat_map(|knowledge| knowledge.catalogue().designs());
        let designs = knowledge.map(|design| design.individual.name.clone()).collect();
        let (types, budget) = (TypeHierarchy::of(domain), Cell::new(BUDGET));
        Self { mission, domain, problem, types, dynamic, changed, assigned, facts, values, designs, budget }
    }

    pub(super) fn check(&self) -> (Vec<MissingValue>, Vec<NegativeDuration>) {
        let mut missing = Needed::new();
        let mut negative = BTreeSet::new();
        if !self.domain.functions.is_empty() {
            for action in &self.domain.actions {
                self.missing(action, &mut missing);
            }
        }
        for action in &self.domain.actions {
            self.negative_durations(action, &mut negative);
        }
        let missing = missing.into_iter().map(|((function, arguments), (is_likely, actions))| MissingValue {
            is_likely,
            ..self.described(&function, &arguments, actions)
        });
        (missing.collect(), negative.into_iter().collect())
    }

    fn described(&self, function: &Name, arguments: &[Name], actions: BTreeSet<String>) -> MissingValue {
        let words: Vec<&str> = arguments.iter().map(Name::as_str).collect();
        let needed_by = actions.into_iter().collect();
        let is_silent = !self.values.contains_key(function) && !self.assigned.contains(function);
        let symbol = function.to_string();
        if let [design] = words[..]
            && self.designs.contains(design)
        {
            let attribute = self.attribute(function);
            return MissingValue {
                function: format!("({attribute} {design})"),
                needed_by,
                file: self.file_of(design),
                estimation: Some((design.to_owned(), attribute)),
                symbol,
                is_silent,
                is_likely: false,
            };
        }
        let function = std::iter::once(function.as_str()).chain(words).collect::<Vec<_>>().join(" ");
        MissingValue {
            function: format!("({function})"),
            needed_by,
            estimation: None,
            file: self.mission.problem_source().name().to_owned(),
            symbol,
            is_silent,
            is_likely: false,
        }
    }

    fn attribute(&self, function: &Name) -> String {
        let mut bound = self.mission.bindings().written().iter();
        let bound = bound.find(|(symbol, _)| Name::new(symbol) == *function);
        let attribute = bound.and_then(|(_, query)| query.strip_prefix("estimation:"));
        let attribute = attribute.unwrap_or(function.as_str());
        attribute.strip_prefix("fd_").unwrap_or(attribute).to_owned()
    }

    /// Adds to `missing` the functions that an action needs, with the argument tuples that have no value and
    /// for which the action may be possible. Omits `total-cost` and functions that actions set only by
    /// assignments.
    fn missing(&self, action: &Action, missing: &mut Needed) {
        let conditions = conditions(&action.body);
        let mut checked = HashSet::new();
        for atom in needed(action) {
            let function = &atom.predicate.name;
            let is_own =
                function.as_str().eq_ignore_ascii_case("total-cost") || !checked.insert(written(atom));
            // A function to which actions assign values may lack an initial value, unless actions
            // also increase or decrease it.
            let is_stock = || self.domain.actions.iter().any(|action| grows(action, function));
            if is_own || (self.assigned.contains(function) && !is_stock()) {
                continue;
            }
            let Some(variables) = variables_of(atom, action) else { continue };
            let names: Vec<&Name> = variables.iter().map(|(name, _)| *name).collect();
            let (mut without, mut count) = (Vec::new(), 0_usize);
            self.each(&variables, &conditions, &mut Vec::new(), &mut |binding| {
                let arguments = grounded(atom, binding);
                // A function such as the distance has no value for two equal arguments.
                let is_apart = arguments.iter().collect::<HashSet<_>>().len() == arguments.len();
                count += usize::from(is_apart);
                if is_apart && !self.values.get(function).is_some_and(|entry| entry.contains_key(&arguments))
                {
                    let is_linked =
                        conditions.iter().any(|condition| self.is_linked(condition, &names, binding));
                    without.push((arguments, is_linked));
                }
            });
            let (is_third, is_few) = (3 * without.len() <= count, 4 * without.len() <= count);
            for (arguments, is_linked) in without {
                let is_design = arguments.len() == 1 && self.designs.contains(arguments[0].as_str());
                let is_likely = names.is_empty() || is_few || is_linked && (is_third || is_design);
                let entry = missing.entry((function.clone(), arguments)).or_insert((false, BTreeSet::new()));
                entry.0 |= is_likely;
                entry.1.insert(action.identifier.name.to_string());
            }
        }
    }

    /// Adds the negative durations of an action to `negative`. Considers only durations that follow from values that
    /// no action changes.
    fn negative_durations(&self, action: &Action, negative: &mut BTreeSet<NegativeDuration>) {
        let ActionBody::Durative { duration, .. } = &action.body else { return };
        let conditions = conditions(&action.body);
        let is_upper =
            |operator| matches!(operator, Comparison::Equal | Comparison::LessOrEqual | Comparison::Less);
        for constraint in duration.iter().filter(|constraint| is_upper(constraint.operator)) {
            let mut fluents = Vec::new();
            in_expression(&constraint.expression, &mut fluents);
            let mut variables: Vec<(&Name, &TypeExpression)> = Vec::new();
            if !fluents.iter().all(|atom| {
                let parameters = variables_of(atom, action);
                let is_known = parameters.is_some() && !self.changed.contains(&atom.predicate.name);
                for variable in parameters.into_iter().flatten() {
                    if !variables.iter().any(|(name, _)| *name == variable.0) {
                        variables.push(variable);
                    }
                }
                is_known
            }) {
                continue;
            }
            self.each(&variables, &conditions, &mut Vec::new(), &mut |binding| {
                let value = self.value(&constraint.expression, binding);
                let Some(value) = value.filter(|value| *value < BigRational::zero()) else { return };
                let mut design = None;
                let mut causes: Vec<String> = Vec::new();
                for atom in &fluents {
                    let arguments = grounded(atom, binding);
                    let input =
                        self.values.get(&atom.predicate.name).and_then(|values| values.get(&arguments));
                    let Some(value) = input.filter(|value| **value < BigRational::zero()) else {
                        continue;
                    };
                    let of = self.described(&atom.predicate.name, &arguments, BTreeSet::new());
                    let name = match of.estimation {
                        Some((of, attribute)) => {
                            design.get_or_insert(of.clone());
                            format!("`{attribute}` of `{of}`")
                        }
                        None => format!("`{}`", of.function),
                    };
                    causes.push(format!("{name} is {}", number::decimal(value)));
                }
                // An action is reported only once for the same causes.
                let is_told = |reported: &NegativeDuration| {
                    reported.action == action.identifier.name.as_str() && reported.causes == causes
                };
                if !negative.iter().any(is_told) {
                    negative.insert(NegativeDuration {
                        action: action.identifier.name.to_string(),
                        duration: number::decimal(&value),
                        causes,
                        design: design.clone(),
                    });
                }
            });
        }
    }

    /// Calls `visit` for each binding of the variables for which the conditions may hold, until the budget ([`BUDGET`])
    /// is spent.
    fn each<'a>(
        &self,
        variables: &[(&'a Name, &'a TypeExpression)],
        conditions: &[&Condition],
        binding: &mut Binding<'a>,
        visit: &mut dyn FnMut(&Binding<'a>),
    ) {
        if conditions.iter().any(|condition| self.truth(condition, binding) == Some(false)) {
            return;
        }
        let Some((variable, r#type)) = variables.get(binding.len()) else { return visit(binding) };
        let objects = self.domain.constants.iter().chain(&self.problem.objects);
        let mut visited = HashSet::new();
        for object in objects.filter(|object| self.types.fits(&object.r#type, r#type)) {
            let budget = self.budget.get();
            if budget == 0 {
                return;
            }
            self.budget.set(budget - 1);
            if !visited.insert(&object.identifier.name) {
                continue;
            }
            binding.push((variable, object.identifier.name.clone()));
            self.each(variables, conditions, binding, visit);
            binding.pop();
        }
    }

    /// Evaluates a condition by static facts, in three-valued logic. Returns `None` (unknown) if
    /// the value depends on facts that change, on unbound variables, on comparisons or on
    /// quantifiers.
    fn truth(&self, condition: &Condition, binding: &Binding<'_>) -> Option<bool> {
        match condition {
            Condition::And(parts) => parts
                .iter()
                .try_fold(Some(true), |all, part| match self.truth(part, binding) {
                    Some(false) => Err(()),
                    Some(true) => Ok(all),
                    None => Ok(None),
                })
                .unwrap_or(Some(false)),
            Condition::Or(parts) => parts
                .iter()
                .try_fold(Some(false), |any, part| match self.truth(part, binding) {
                    Some(true) => Err(()),
                    Some(false) => Ok(any),
                    None => Ok(None),
                })
                .unwrap_or(Some(true)),
            Condition::Not(inner) => self.truth(inner, binding).map(|holds| !holds),
            Condition::Imply(premise, conclusion) => {
                match (self.truth(premise, binding), self.truth(conclusion, binding)) {
                    (Some(false), _) | (_, Some(true)) => Some(true),
                    (Some(true), conclusion) => conclusion,
                    (None, _) => None,
                }
            }
            Condition::Atom(atom) => {
                let arguments = bound_arguments(atom, binding)
                    .filter(|_| !self.dynamic.contains(&atom.predicate.name))?;
                Some(self.facts.get(&atom.predicate.name).is_some_and(|facts| facts.contains(&arguments)))
            }
            Condition::Equal(left, right, _) => Some(object(left, binding)? == object(right, binding)?),
            Condition::Compare(..) | Condition::Exists(..) | Condition::ForAll(..) => None,
        }
    }

    /// Returns `true` if a static fact among the conjuncts or disjuncts of a condition holds and
    /// contains all these variables.
    fn is_linked(&self, condition: &Condition, variables: &[&Name], binding: &Binding<'_>) -> bool {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().any(|part| self.is_linked(part, variables, binding))
            }
            Condition::Atom(atom) if self.truth(condition, binding) == Some(true) => {
                variables.iter().all(|variable| {
                    let is_it = |term: &Term| matches!(term, Term::Variable(parameter) if parameter.name == **variable);
                    atom.arguments.iter().any(is_it)
                })
            }
            _ => false,
        }
    }

    pub(super) fn design(&self, name: &str) -> Option<&FunctionDesign> {
        let designs = self.mission.knowledge()?.catalogue().designs();
        designs.iter().find(|design| design.individual.name == name)
    }

    pub(super) fn about(&self, design: &str, code: &str, text: String) -> Message {
        match (self.mission.knowledge(), self.design(design)) {
            (Some(knowledge), Some(design)) => doubt_about(knowledge, code, &design.individual.iri, text),
            _ => Message::warning(code, text),
        }
    }

    fn file_of(&self, design: &str) -> String {
        self.about(design, "M230", String::new()).file.clone().unwrap_or_default()
    }

    fn value(&self, expression: &Expression, binding: &Binding<'_>) -> Option<BigRational> {
        match expression {
            Expression::Number(value, _) => Some(value.clone()),
            Expression::Fluent(atom) => {
                self.values.get(&atom.predicate.name)?.get(&bound_arguments(atom, binding)?).cloned()
            }
            Expression::Operation(operation, parts, _) => {
                let values: Option<Vec<BigRational>> =
                    parts.iter().map(|part| self.value(part, binding)).collect();
                let mut values = values?.into_iter();
                let first = values.next()?;
                if parts.len() == 1 {
                    return Some(if *operation == Arithmetic::Subtract { -first } else { first });
                }
                values.try_fold(first, |left, right| match operation {
                    Arithmetic::Add => Some(left + right),
                    Arithmetic::Subtract => Some(left - right),
                    Arithmetic::Multiply => Some(left * right),
                    Arithmetic::Divide => (!right.is_zero()).then(|| left / right),
                })
            }
            Expression::Duration(_) | Expression::TotalTime(_) => None,
        }
    }
}
