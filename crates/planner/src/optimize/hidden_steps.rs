//! Hidden steps: evaluations of preferences at the end of a plan. Searches, formulas and ground plans contain these
//! steps. Configured horizons, and the horizons and step bounds of solutions, do not count them.

use task::compile::is_satisfaction;
use task::plan::solution::{Proof, Solution};
use task::task::Task;

use crate::optimize::config::Config;

/// Returns the number of evaluations of preferences with which every plan ends.
pub(crate) fn evaluations<N>(task: &Task<N>) -> usize {
    task.schema_names.iter().filter(|name| is_satisfaction(name)).count()
}

pub(crate) fn with_evaluations<N>(task: &Task<N>, config: &Config) -> Config {
    config.clone().with_horizon(config.horizon.map(|steps| steps.saturating_add(evaluations(task))))
}

pub(crate) fn without_hidden_steps<N>(task: &Task<N>, mut solution: Solution) -> Solution {
    let evaluations = evaluations(task);
    solution.horizon = solution.horizon.saturating_sub(evaluations);
    if let Some(Proof::Sat { step_bound }) = &mut solution.proof {
        *step_bound = step_bound.saturating_sub(evaluations);
    }
    solution
}
