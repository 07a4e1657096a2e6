//! From a ground task to a cheapest plan, and to the reason why there is no cheaper one.
//!
//! A quick search yields a first plan. Then come formulas "a plan of at most B steps that costs at most L", where B is the step
//! bound for L: by dynamic programming over projections, no plan that costs so little has more steps. L begins near the lower bound,
//! because the formula is small there, and what is unsatisfiable raises that bound; a formula that has a plan yields a cheapest
//! one, by one of two strategies. Only then is the answer called optimal. Where no step bound exists (free cycles), the search's own
//! exhaustion may serve; otherwise the answer is a plan that is not proved optimal.

mod bounded;
mod config;
mod cores;
mod first;
mod run;
mod solve;
#[cfg(test)]
mod tests;
mod tighten;

use crate::solution::{Improvement, Proof, Solution, Status};
use crate::task::Task;
use run::Run;

pub(crate) use bounded::can_repeat_reward;
pub use config::{Config, Strategy};

/// Finds a cheapest plan; `report` hears of every improvement.
pub fn optimize(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Solution {
    let run = Run::new(task, config, report);
    if let Some(reason) = &task.unreachable {
        return run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Relaxation(reason.clone())));
    }
    if task.operators.iter().any(|operator| operator.cost.minimum() < 0) {
        return bounded::bounded_reading(run);
    }
    solve::solve(run)
}
