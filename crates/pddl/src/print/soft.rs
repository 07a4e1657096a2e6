//! Preferences and constraints on trajectories to lists.

use num_rational::BigRational;

use crate::ast::{Condition, Constraint, Preference, Trajectory, TypedName};

use super::layout::{Doc, list, text};
use super::tree::{condition, number, timed_condition, variables};

/// Whether a constraint is printed as a preference of the goal.
pub(super) fn is_of_goal(constraint: &Constraint) -> bool {
    constraint.preference.is_some() && matches!(constraint.trajectory, Trajectory::AtEnd(_))
}

/// A condition together with preferences.
pub(super) fn with(hard: &Condition, soft: impl Iterator<Item = Doc>) -> Doc {
    let mut soft = soft.peekable();
    if soft.peek().is_none() {
        return condition(hard);
    }
    let parts = if let Condition::And(parts) = hard { &parts[..] } else { std::slice::from_ref(hard) };
    list("and", 1, parts.iter().map(condition).chain(soft))
}

/// The section of constraints, if there are any.
pub(super) fn constraints(constraints: &[&Constraint]) -> Option<Doc> {
    let all = list("and", 1, constraints.iter().map(|own| constraint(own, false))).broken();
    (!constraints.is_empty()).then(|| list(":constraints", 2, [all]))
}

/// A constraint below its quantifiers; among those of the goal, `at end` is not written.
pub(super) fn constraint(constraint: &Constraint, in_goal: bool) -> Doc {
    let body = match (&constraint.trajectory, in_goal) {
        (Trajectory::AtEnd(what), true) => condition(what),
        (other, _) => trajectory(other),
    };
    let body = match &constraint.preference {
        Some(name) => list("preference", 2, [text(name.name.as_str()), body]),
        None => body,
    };
    below(&constraint.variables, body)
}

/// A preference of an action below its quantifiers.
pub(super) fn preference(preference: &Preference, is_timed: bool) -> Doc {
    let Preference { variables, name, time, condition: what, .. } = preference;
    let body = if is_timed { timed_condition(&(*time, what.clone())) } else { condition(what) };
    below(variables, list("preference", 2, [text(name.name.as_str()), body]))
}

fn below(entries: &[TypedName], body: Doc) -> Doc {
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
        Trajectory::AtEnd(what) => list("at", 2, [text("end"), condition(what)]),
        Trajectory::Always(what) => timed("always", &[], &[what]),
        Trajectory::Sometime(what) => timed("sometime", &[], &[what]),
        Trajectory::AtMostOnce(what) => timed("at-most-once", &[], &[what]),
        Trajectory::SometimeAfter(first, second) => timed("sometime-after", &[], &[first, second]),
        Trajectory::SometimeBefore(first, second) => timed("sometime-before", &[], &[first, second]),
        Trajectory::Within(time, what) => timed("within", &[time], &[what]),
        Trajectory::AlwaysWithin(time, first, second) => timed("always-within", &[time], &[first, second]),
        Trajectory::HoldDuring(from, until, what) => timed("hold-during", &[from, until], &[what]),
        Trajectory::HoldAfter(time, what) => timed("hold-after", &[time], &[what]),
    }
}
