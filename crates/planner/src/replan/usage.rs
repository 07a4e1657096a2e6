//! Usage of the symbols of a domain: read by conditions, changed by effects, or required to be available.
//!
//! The analysis is syntactic: a symbol that is read somewhere counts as read everywhere.

use rustc_hash::FxHashSet;

use pddl::ast::{Action, ActionBody, Atom, Condition, Domain, Effect, Expression, Name, Problem, Term};

/// Uses of symbols.
#[derive(Debug, Default)]
pub(super) struct Usage {
    /// Predicates that conditions of actions and effects, axioms, or quantifiers of the goal read.
    read: FxHashSet<Name>,
    /// Atoms of the goal, as keys.
    goal: FxHashSet<String>,
    /// Predicates and functions that effects or axioms change.
    changed: FxHashSet<Name>,
    /// Functions that conditions, durations and effects read.
    functions: FxHashSet<Name>,
}

impl Usage {
    pub(super) fn of(domain: &Domain, problem: &Problem) -> Self {
        let mut usage = Self::default();
        for action in &domain.actions {
            usage.action(action);
        }
        for derived in &domain.derived {
            usage.changed.insert(derived.head.identifier.name.clone());
            usage.condition(&derived.condition, false);
        }
        usage.condition(&problem.goal, true);
        usage
    }

    /// Returns `true` if effects or axioms change a predicate or function.
    pub(super) fn is_changed(&self, name: &Name) -> bool {
        self.changed.contains(name)
    }

    /// Returns `true` if a condition reads an atom.
    pub(super) fn is_read(&self, predicate: &Name, key: &str) -> bool {
        self.read.contains(predicate) || self.goal.contains(key)
    }

    /// Returns `true` if any part other than the metric reads a function.
    pub(super) fn is_function_read(&self, function: &Name) -> bool {
        self.functions.contains(function)
    }

    fn action(&mut self, action: &Action) {
        match &action.body {
            ActionBody::Instantaneous { precondition, effect } => {
                self.condition(precondition, false);
                self.effect(effect);
            }
            ActionBody::Durative { duration, conditions, effects } => {
                for constraint in duration {
                    self.expression(&constraint.expression);
                }
                for (_, condition) in conditions {
                    self.condition(condition, false);
                }
                for (_, effect) in effects {
                    self.effect(effect);
                }
            }
        }
    }

    /// Collects the symbols of a condition. If `is_ground`, only the very atoms that occur without
    /// variables count as read.
    fn condition(&mut self, condition: &Condition, is_ground: bool) {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => {
                for part in parts {
                    self.condition(part, is_ground);
                }
            }
            Condition::Not(part) => self.condition(part, is_ground),
            Condition::Imply(left, right) => {
                self.condition(left, is_ground);
                self.condition(right, is_ground);
            }
            Condition::Exists(_, part) | Condition::ForAll(_, part) => self.condition(part, false),
            Condition::Atom(atom) if is_ground => {
                self.goal.insert(key(atom));
            }
            Condition::Atom(atom) => {
                self.read.insert(atom.predicate.name.clone());
            }
            Condition::Equal(..) => {}
            Condition::Compare(_, left, right, _) => {
                self.expression(left);
                self.expression(right);
            }
        }
    }

    fn effect(&mut self, effect: &Effect) {
        match effect {
            Effect::And(parts) => parts.iter().for_each(|part| self.effect(part)),
            Effect::ForAll(_, part) => self.effect(part),
            Effect::When(condition, part) => {
                self.condition(condition, false);
                self.effect(part);
            }
            Effect::Add(atom) | Effect::Delete(atom) => {
                self.changed.insert(atom.predicate.name.clone());
            }
            Effect::Assign(_, target, value, _) => {
                self.changed.insert(target.predicate.name.clone());
                self.expression(value);
            }
        }
    }

    fn expression(&mut self, expression: &Expression) {
        match expression {
            Expression::Fluent(atom) => {
                self.functions.insert(atom.predicate.name.clone());
            }
            Expression::Operation(_, parts, _) => parts.iter().for_each(|part| self.expression(part)),
            Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => {}
        }
    }
}

/// Canonical text of an atom in lower case: `(robot_at wp1)`.
pub(super) fn key(atom: &Atom) -> String {
    let mut text = String::with_capacity(32);
    text.push('(');
    text.push_str(atom.predicate.name.as_str());
    for term in &atom.arguments {
        text.push(' ');
        text.push_str(identifier(term).as_str());
    }
    text.push(')');
    text.make_ascii_lowercase();
    text
}

/// Name of a variable or constant.
pub(super) fn identifier(term: &Term) -> &Name {
    match term {
        Term::Variable(identifier) | Term::Constant(identifier) => &identifier.name,
    }
}

/// Per action: indices of the parameters that must be available, each with the index of the
/// predicate that states it. Returns `None` if a predicate is used in another way, because then
/// more availability need not mean more operators.
#[expect(clippy::arithmetic_side_effects, reason = "occurrences in a text in memory")]
pub(super) fn requirements(domain: &Domain, predicates: &[Name]) -> Option<Vec<Vec<(usize, usize)>>> {
    let mut requirements = Vec::new();
    let mut mentions = 0;
    for action in &domain.actions {
        let mut parameters = Vec::new();
        let conditions: Vec<&Condition> = match &action.body {
            ActionBody::Instantaneous { precondition, .. } => vec![precondition],
            ActionBody::Durative { conditions, .. } => conditions.iter().map(|(_, part)| part).collect(),
        };
        for atom in conditions.into_iter().flat_map(conjuncts) {
            let Some(predicate) = predicates.iter().position(|name| *name == atom.predicate.name) else {
                continue;
            };
            let [Term::Variable(variable)] = atom.arguments.as_slice() else { return None };
            let is_variable = |parameter: &pddl::ast::TypedName| parameter.identifier.name == variable.name;
            parameters.push((action.parameters.iter().position(is_variable)?, predicate));
            mentions += 1;
        }
        requirements.push(parameters);
    }
    let total: usize = predicates.iter().map(|predicate| occurrences(domain, predicate)).sum();
    (total == mentions).then_some(requirements)
}

/// Atoms of a conjunction.
fn conjuncts(condition: &Condition) -> Vec<&Atom> {
    match condition {
        Condition::And(parts) => parts.iter().flat_map(conjuncts).collect(),
        Condition::Atom(atom) => vec![atom],
        _ => Vec::new(),
    }
}

/// Number of occurrences of a predicate in conditions and effects of a domain.
#[expect(clippy::arithmetic_side_effects, reason = "occurrences in a text in memory")]
fn occurrences(domain: &Domain, predicate: &Name) -> usize {
    let bodies = domain.actions.iter().map(|action| match &action.body {
        ActionBody::Instantaneous { precondition, effect } => {
            in_condition(precondition, predicate) + in_effect(effect, predicate)
        }
        ActionBody::Durative { conditions, effects, .. } => {
            let conditions = conditions.iter().map(|(_, part)| in_condition(part, predicate));
            conditions.chain(effects.iter().map(|(_, part)| in_effect(part, predicate))).sum()
        }
    });
    let derived = domain.derived.iter().map(|derived| {
        usize::from(derived.head.identifier.name == *predicate) + in_condition(&derived.condition, predicate)
    });
    bodies.chain(derived).sum()
}

/// Number of occurrences of a predicate in a condition.
#[expect(clippy::arithmetic_side_effects, reason = "occurrences in a text in memory")]
pub(super) fn in_condition(condition: &Condition, predicate: &Name) -> usize {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().map(|part| in_condition(part, predicate)).sum()
        }
        Condition::Not(part) | Condition::Exists(_, part) | Condition::ForAll(_, part) => {
            in_condition(part, predicate)
        }
        Condition::Imply(left, right) => in_condition(left, predicate) + in_condition(right, predicate),
        Condition::Atom(atom) => usize::from(atom.predicate.name == *predicate),
        Condition::Equal(..) | Condition::Compare(..) => 0,
    }
}

#[expect(clippy::arithmetic_side_effects, reason = "occurrences in a text in memory")]
fn in_effect(effect: &Effect, predicate: &Name) -> usize {
    match effect {
        Effect::And(parts) => parts.iter().map(|part| in_effect(part, predicate)).sum(),
        Effect::ForAll(_, part) => in_effect(part, predicate),
        Effect::When(condition, part) => in_condition(condition, predicate) + in_effect(part, predicate),
        Effect::Add(atom) | Effect::Delete(atom) => usize::from(atom.predicate.name == *predicate),
        Effect::Assign(..) => 0,
    }
}
