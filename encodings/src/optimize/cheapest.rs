//! The way to a cheapest plan that a task asks for.

use crate::optimize::bounded::bounded_reading;
use crate::optimize::config::Config;
use crate::optimize::run::Run;
use crate::optimize::solve::solve;
use crate::plan::solution::{Improvement, Proof, Solution, Status};
use crate::task::Task;

/// Finds a cheapest plan; `report` hears of every improvement.
pub fn optimize(task: &Task, config: &Config, report: &mut dyn FnMut(Improvement)) -> Solution {
    let run = Run::new(task, config, report);
    if let Some(reason) = &task.unreachable {
        return run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Relaxation(reason.clone())));
    }
    if task.operators.iter().any(|operator| operator.cost.minimum() < 0) {
        return bounded_reading(run);
    }
    solve(run)
}
