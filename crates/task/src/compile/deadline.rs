//! Deadlines of trajectory constraints, checked once the times of a plan are known.

use num_rational::BigRational;
use pddl::ast::{ActionBody, Condition, Domain, Effect, Problem};

use super::simplify::{all, flag, holds, not};
use super::syntax_edits::{declare, hidden};

/// A deadline from `always-within`: in each state in which the first condition holds, or within a given time after
/// it, the second condition must hold.
#[derive(Debug, Clone)]
pub struct Deadline {
    /// Maximum time from a state with the first condition until the second condition holds.
    pub within: BigRational,
    /// `true` for a constraint, which every plan must satisfy; `false` for a preference.
    pub is_hard: bool,
    number: usize,
}

impl Deadline {
    pub(super) fn new(within: BigRational, is_hard: bool, number: usize) -> Self {
        Self { within, is_hard, number }
    }

    /// Returns the names of two auxiliary actions, one for each condition of the deadline. The condition is the
    /// precondition of its action. The actions are never part of a plan; the temporal planner only evaluates their
    /// preconditions and effects.
    pub fn actions(&self) -> [String; 2] {
        ["begins", "ends"].map(|what| format!("deadline {} {what}", self.number))
    }
}

/// Atom that the auxiliary actions add. It is never true in a state of a plan, because plans do not contain these
/// actions.
pub(super) const LOOKED_AT: &str = "a deadline was looked at";

pub(super) fn install(
    domain: &mut Domain,
    problem: &Problem,
    deadlines: Vec<(Deadline, [Condition; 2], Effect)>,
) -> Vec<Deadline> {
    if !deadlines.is_empty() {
        declare(domain, LOOKED_AT);
    }
    let mut all_of = Vec::new();
    for (deadline, conditions, noted) in deadlines {
        let effects = [vec![], vec![noted]];
        for ((name, condition), mut effects) in deadline.actions().iter().zip(conditions).zip(effects) {
            // Actions without effects would be pruned.
            effects.push(Effect::Add(flag(LOOKED_AT)));
            let precondition = all([condition, not(holds(LOOKED_AT))]);
            let body = ActionBody::Instantaneous { precondition, effect: Effect::And(effects) };
            domain.actions.push(hidden(name, body, problem.name.span));
        }
        all_of.push(deadline);
    }
    all_of
}
