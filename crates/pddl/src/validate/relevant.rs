//! The part of a problem that single actions can read: facts and values of which all objects are named by the actions.
//!
//! Execution of one action numbers and indexes the whole initial state. Where no condition or effect runs over all objects, the
//! action reads only what concerns its own arguments and the constants of the domain. In a map of a hundred arcs and eighteen
//! designs that is one value in a thousand.

use rustc_hash::FxHashSet;

use crate::ast::{
    Action, ActionBody, Atom, Condition, Domain, Effect, Expression, InitialElement, Name, Problem, Term,
};
use crate::mentioned::Mentioned;

use super::plan::PlanStep;

/// Returns the problem without facts and values that none of the steps can read, and that its metric does not mention; none where
/// that is not known.
pub(super) fn relevant(domain: &Domain, problem: &Problem, steps: &[PlanStep]) -> Option<Problem> {
    let is_plain =
        domain.derived.is_empty() && domain.constraints.is_empty() && problem.constraints.is_empty();
    let names: FxHashSet<&Name> = steps.iter().map(|step| &step.action).collect();
    let schemas = || domain.actions.iter().filter(|action| names.contains(&action.identifier.name));
    if !is_plain || schemas().any(reads_all_objects) {
        return None;
    }
    let mut metric = Vec::new();
    if let Some(own) = &problem.metric {
        fluents(&own.expression, &mut metric);
    }
    let measures: FxHashSet<&Name> = metric.iter().map(|atom| &atom.predicate.name).collect();
    if measures.iter().any(|name| name.as_str() == "is-violated") {
        return None;
    }
    let mut read = Vec::new();
    schemas().for_each(|action| fluents_of(action, &mut read));
    let mentioned = Mentioned::by_domain(domain).objects;
    let arguments = steps.iter().flat_map(|step| &step.arguments).chain(&mentioned);
    let terms = read.iter().flat_map(|atom| &atom.arguments);
    let constants = terms.map(name);
    let objects: FxHashSet<&Name> = arguments.chain(constants).collect();
    let is_named = |atom: &Atom| atom.arguments.iter().all(|term| objects.contains(name(term)));
    let is_relevant = |element: &&InitialElement| match element {
        InitialElement::Timed(..) => true,
        InitialElement::Value(atom, ..) => is_named(atom) || measures.contains(&atom.predicate.name),
        // The value before is read where a function with an object as value changes.
        InitialElement::Fact(atom) | InitialElement::NegatedFact(atom) => {
            is_named(atom) || domain.object_fluents.contains(&atom.predicate.name)
        }
    };
    Some(Problem {
        name: problem.name.clone(),
        domain: problem.domain.clone(),
        requirements: problem.requirements.clone(),
        objects: problem.objects.clone(),
        init: problem.init.iter().filter(is_relevant).cloned().collect(),
        goal: problem.goal.clone(),
        constraints: Vec::new(),
        metric: problem.metric.clone(),
    })
}

fn name(term: &Term) -> &Name {
    match term {
        Term::Constant(own) | Term::Variable(own) => &own.name,
    }
}

/// Returns `true` if a condition or an effect of the action runs over all objects, or the action has preferences.
fn reads_all_objects(action: &Action) -> bool {
    let is_quantified = match &action.body {
        ActionBody::Instantaneous { precondition, effect } => {
            is_quantified(precondition) || is_quantified_effect(effect)
        }
        ActionBody::Durative { conditions, effects, .. } => {
            conditions.iter().any(|(_, condition)| is_quantified(condition))
                || effects.iter().any(|(_, effect)| is_quantified_effect(effect))
        }
    };
    is_quantified || !action.preferences.is_empty()
}

fn is_quantified(condition: &Condition) -> bool {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => parts.iter().any(is_quantified),
        Condition::Not(body) => is_quantified(body),
        Condition::Imply(left, right) => is_quantified(left) || is_quantified(right),
        Condition::Exists(..) | Condition::ForAll(..) => true,
        Condition::Atom(_) | Condition::Equal(..) | Condition::Compare(..) => false,
    }
}

fn is_quantified_effect(effect: &Effect) -> bool {
    match effect {
        Effect::And(parts) => parts.iter().any(is_quantified_effect),
        Effect::ForAll(..) => true,
        Effect::When(condition, body) => is_quantified(condition) || is_quantified_effect(body),
        Effect::Assign(..) | Effect::Add(_) | Effect::Delete(_) => false,
    }
}

/// Adds the numeric functions that an action reads.
fn fluents_of<'a>(action: &'a Action, found: &mut Vec<&'a Atom>) {
    match &action.body {
        ActionBody::Instantaneous { precondition, effect } => {
            compared(precondition, found);
            assigned(effect, found);
        }
        ActionBody::Durative { duration, conditions, effects } => {
            for constraint in duration {
                fluents(&constraint.expression, found);
            }
            for (_, condition) in conditions {
                compared(condition, found);
            }
            for (_, effect) in effects {
                assigned(effect, found);
            }
        }
    }
}

fn compared<'a>(condition: &'a Condition, found: &mut Vec<&'a Atom>) {
    match condition {
        Condition::And(parts) | Condition::Or(parts) => parts.iter().for_each(|part| compared(part, found)),
        Condition::Not(body) | Condition::Exists(_, body) | Condition::ForAll(_, body) => {
            compared(body, found);
        }
        Condition::Imply(left, right) => {
            compared(left, found);
            compared(right, found);
        }
        Condition::Compare(_, left, right, _) => {
            fluents(left, found);
            fluents(right, found);
        }
        Condition::Atom(_) | Condition::Equal(..) => {}
    }
}

fn assigned<'a>(effect: &'a Effect, found: &mut Vec<&'a Atom>) {
    match effect {
        Effect::And(parts) => parts.iter().for_each(|part| assigned(part, found)),
        Effect::ForAll(_, body) => assigned(body, found),
        Effect::When(condition, body) => {
            compared(condition, found);
            assigned(body, found);
        }
        Effect::Assign(_, target, value, _) => {
            found.push(target);
            fluents(value, found);
        }
        Effect::Add(_) | Effect::Delete(_) => {}
    }
}

/// Adds the numeric functions in an expression.
fn fluents<'e>(expression: &'e Expression, found: &mut Vec<&'e Atom>) {
    match expression {
        Expression::Fluent(atom) => found.push(atom),
        Expression::Operation(_, parts, _) => parts.iter().for_each(|part| fluents(part, found)),
        Expression::Number(..) | Expression::Duration(_) | Expression::TotalTime(_) => {}
    }
}
