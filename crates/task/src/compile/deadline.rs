//! Deadlines of trajectory constraints, checked once the times of a plan are known.

use num_rational::BigRational;
use pddl::ast::{ActionBody, Condition, Domain, Effect, Problem};

use super::simplify::{all, flag, holds, not};
use super::syntax_edits::{declare, hidden};

/// After each state with one condition there is, so much later at most, one with another condition.
#[derive(Debug, Clone)]
pub struct Deadline {
    pub within: BigRational,
    /// Whether plans have to keep it.
    pub is_hard: bool,
    number: usize,
}

impl Deadline {
    pub(super) fn new(within: BigRational, is_hard: bool, number: usize) -> Self {
        Self { within, is_hard, number }
    }

    /// The actions that never happen, whose conditions are the two, and the second of which notes that the deadline was kept if plans need not keep it.
    pub fn actions(&self) -> [String; 2] {
        ["begins", "ends"].map(|what| format!("deadline {} {what}", self.number))
    }
}

/// Never holds.
pub(super) const LOOKED_AT: &str = "a deadline was looked at";

/// Adds the actions of deadlines.
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
            // What changes nothing would be left out.
            effects.push(Effect::Add(flag(LOOKED_AT)));
            let precondition = all([condition, not(holds(LOOKED_AT))]);
            let body = ActionBody::Instantaneous { precondition, effect: Effect::And(effects) };
            domain.actions.push(hidden(name, body, problem.name.span));
        }
        all_of.push(deadline);
    }
    all_of
}
