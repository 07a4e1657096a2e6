//! Any plan, with few steps.

use std::time::Instant;

use crate::bounds::Bounds;
use crate::encode::Semantics;
use crate::optimize::run::Run;
use crate::plan::ground::GroundPlan;
use crate::plan::solution::{Proof, Solution, Status};
use crate::sat::Answer;
use crate::task::Task;

/// Formulas with more operator variables than this are not built.
const FORMULA_LIMIT: usize = 30_000_000;

/// Longer and longer formulas without a cost limit.
pub(super) fn first_plan(run: &mut Run<'_>, bounds: &Bounds) -> Result<GroundPlan, Box<Solution>> {
    let most = run
        .config
        .horizon
        .unwrap_or(usize::MAX)
        .min(states(run.task).map_or(usize::MAX, |n| n.saturating_sub(1)));
    let mut horizon = 0;
    loop {
        let started = Instant::now();
        let window = bounds.window(run.context(), None, Some(horizon));
        let encoding = window.ok().and_then(|window| {
            run.encoding(&window.allowed, None, run.semantics(Semantics::ExistsStep), usize::MAX)
        });
        run.statistics.encode = run.statistics.encode.saturating_add(started.elapsed());
        let answer = encoding.map_or((Answer::Interrupted, None), |encoding| {
            let mut live = run.live(u64::MAX);
            run.call(&mut live, &encoding, &[])
        });
        match answer {
            (_, Some(plan)) => return Ok(plan),
            (Answer::Unsatisfiable, None) if horizon < most => {
                horizon = horizon.saturating_add(1).saturating_add(horizon / 4).min(most);
                if horizon.saturating_mul(run.task.operators.len()) <= FORMULA_LIMIT {
                    continue;
                }
                return Err(Box::new(run.without_plan(Status::Unknown, horizon, None)));
            }
            (Answer::Unsatisfiable, None) => {
                let bounded = states(run.task).is_some_and(|states| horizon.saturating_add(1) >= states);
                let solution = if bounded {
                    run.without_plan(Status::Unsolvable, horizon, Some(Proof::Sat { step_bound: horizon }))
                } else {
                    run.without_plan(Status::UnsolvableWithinHorizon, horizon, None)
                };
                return Err(Box::new(solution));
            }
            (Answer::Satisfiable | Answer::Interrupted, None) => {
                return Err(Box::new(run.without_plan(Status::Unknown, horizon, None)));
            }
        }
    }
}

/// How many states the task has at most, if that is few: a shortest plan visits none twice.
fn states(task: &Task) -> Option<usize> {
    if !task.initial.numbers.is_empty() {
        return None;
    }
    let sizes = task.variables[..task.basic].iter().map(|variable| variable.values.len());
    sizes.into_iter().try_fold(1_usize, usize::checked_mul)
}
