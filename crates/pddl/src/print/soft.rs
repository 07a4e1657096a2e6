//! Converts preferences and trajectory constraints to printable lists.

use num_rational::BigRational;

use crate::ast::{Condition, Constraint, Preference, Trajectory, TypedName};

use super::layout::{Doc, list, text};
use super::tree::{condition, number, timed_condition, variables};

pub(super) fn is_of_goal(constraint: &Constraint) -> bool {
    constraint.preference.is_some() && matches!(constraint.trajectory, Trajectory::AtEnd(_))
}

pub(super) fn with(hard: &Condition, soft: impl Iterator<Item = Doc>) -> Doc {
    let mut soft = soft.peekable();
    if soft.peek().is_none() {
        return condition(hard);
    }
    let parts = if let Condition::And(parts) = hard { &parts[..] } else { std::slice::from_ref(hard) };
    list("and", 1, parts.iter().map(condition).chain(soft))
}

pub(super) fn constraints(constraints: &[&Constraint]) -> Option<Doc> {
    let conjunction = list("and", 1, constraints.iter().map(|item| constraint(item, false))).broken();
    (!constraints.is_empty()).then(|| list(":constraints", 2, [conjunction]))
}

/// Converts a constraint with its quantifiers. With `in_goal`, `at end` is omitted.
pub(super) fn constraint(constraint: &Constraint, in_goal: bool) -> Doc {
    let body = match (&constraint.trajectory, in_goal) {
        (Trajectory::AtEnd(condition_at_end), true) => condition(condition_at_end),
        (other, _) => trajectory(other),
    };
    let body = match &constraint.preference {
        Some(name) => list("preference", 2, [text(name.name.as_str()), body]),
        None => body,
    };
    quantified(&constraint.variables, body)
}

pub(super) fn preference(preference: &Preference, is_timed: bool) -> Doc {
    let Preference { variables, name, time, condition: body, .. } = preference;
    let body = if is_timed { timed_condition(&(*time, body.clone())) } else { condition(body) };
    quantified(variables, list("preference", 2, [text(name.name.as_str()), body]))
}

fn quantified(entries: &[TypedName], body: Doc) -> Doc {
    if entries.is_empty() { body } else { list("forall", 2, [variables(entries), body]) }
}

fn trajectory(tree: &Trajectory) -> Doc {
    let timed = |head: &str, times: &[&BigRational], parts: &[&Condition]| {
        let times = times.iter().map(|time| number(time));
        list(head, 1, times.chain(parts.iter().map(|part| condition(part))).collect::<Vec<_>>())
    };
    match tree {
        Trajectory::And(parts) => list("and", 1, parts.iter().map(trajectory)),
        Trajectory::ForAll(entries, body) => list("forall", 2, [variables(entries), trajectory(body)]),
        Trajectory::AtEnd(body) => list("at", 2, [text("end"), condition(body)]),
        Trajectory::Always(body) => timed("always", &[], &[body]),
        Trajectory::Sometime(body) => timed("sometime", &[], &[body]),
        Trajectory::AtMostOnce(body) => timed("at-most-once", &[], &[body]),
        Trajectory::SometimeAfter(first, second) => timed("sometime-after", &[], &[first, second]),
        Trajectory::SometimeBefore(first, second) => timed("sometime-before", &[], &[first, second]),
        Trajectory::Within(time, body) => timed("within", &[time], &[body]),
        Trajectory::AlwaysWithin(time, first, second) => timed("always-within", &[time], &[first, second]),
        Trajectory::HoldDuring(from, until, body) => timed("hold-during", &[from, until], &[body]),
        Trajectory::HoldAfter(time, body) => timed("hold-after", &[time], &[body]),
    }
}
