//! Deadlines of trajectory constraints, checked once the times of a plan are known.

use num_rational::BigRational;
use pddl::ast::{ActionBody, Condition, Domain, Effect, Problem};

use super::simplify::{all, flag, holds, not};
use super::syntax_edits::{declare, hidden};

/// A deadline: after each state with the first condition, the second condition must hold within a
/// time.
#[derive(Debug, Clone)]
pub struct Deadline {
    pub within: BigRational,
    /// `true` if plans must satisfy the deadline.
    pub is_hard: bool,
    number: usize,
}

impl Deadline {
    pub(super) fn new(within: BigRational, is_hard: bool, number: usize) -> Self {
        Self { within, is_hard, number }
    }

    /// Returns the names of the auxiliary actions whose preconditions are the two conditions. They
    /// are never executed. The effect of the second one records a satisfied soft deadline.
    pub fn actions(&self) -> [String; 2] {
        ["begins", "ends"].map(|what| format!("deadline {} {what}", self.number))
    }
}

/// Auxiliary atom that is never true.
pub(super) const LOOKED_AT: &str = "a deadline was looked at";

/// Adds the auxiliary actions of deadlines.
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
