//! Finds a cheapest plan of a task with non-negative costs, by the configured engine.

use std::time::Instant;

use search::bounds::Bounds;
use search::search::plan_tiebreak;
use search::search::{SearchOutcome, search};
use task::number::Int;
use task::plan::solution::{PlannerPart, Proof, Solution, Status};

use crate::optimize::config::Engine;
use crate::optimize::horizon_schedule::first_plan;
use crate::optimize::optimizer_run::{Best, Run};
use crate::optimize::portfolio;
use crate::optimize::prover::{Prover, ProverOutcome};
use crate::optimize::sat_budget::SatBudget;
use crate::optimize::sat_confirmation::{into_solution, proved_by_bound, proved_by_search};

pub(super) fn solve(mut run: Run<'_>) -> Solution {
    let started = Instant::now();
    let Ok(bounds) = Bounds::new(run.context()) else {
        return run.finish(Status::Unknown, None, None, 0, None);
    };
    let Some(lower) = bounds.estimate(&run.task.initial) else {
        let reason = bounds.dead_end_reason(run.task, &run.task.initial);
        return run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Relaxation(reason)));
    };
    run.statistics.search = started.elapsed();
    match (run.config.engine, run.config.horizon) {
        (Engine::Sat, _) => solve_by_formulas(run, &bounds, lower),
        (_, Some(horizon)) => solve_within(run, &bounds, lower, horizon),
        (_, None) => portfolio::solve(run, &bounds, lower),
    }
}

/// Runs heuristic search, which ignores the horizon. A plan within the horizon that is not proved optimal is
/// improved with formulas. If the plan is longer than the horizon, or a limit is reached without a plan, all
/// plans come from formulas.
fn solve_within(mut run: Run<'_>, bounds: &Bounds, lower: Int, horizon: usize) -> Solution {
    let started = Instant::now();
    let outcome = search(run.context(), bounds);
    run.statistics.search = run.statistics.search.saturating_add(started.elapsed());
    match outcome {
        SearchOutcome::None => run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Search)),
        SearchOutcome::Optimal(plan) if plan.steps.len() <= horizon => {
            let plan = plan_tiebreak::select_canonical_plan(run.context(), bounds, plan);
            proved_by_search(run, bounds, plan, lower)
        }
        SearchOutcome::Unknown(Some(plan)) if plan.steps.len() <= horizon => {
            improve(run, bounds, Best { plan, lower })
        }
        SearchOutcome::Optimal(_) | SearchOutcome::Unknown(_) => solve_by_formulas(run, bounds, lower),
    }
}

fn solve_by_formulas(mut run: Run<'_>, bounds: &Bounds, lower: Int) -> Solution {
    match first_plan(&mut run, bounds) {
        Ok(plan) => {
            run.statistics.found_by = Some(PlannerPart::Sat);
            improve(run, bounds, Best { plan, lower })
        }
        Err(solution) => *solution,
    }
}

fn improve(mut run: Run<'_>, bounds: &Bounds, mut best: Best) -> Solution {
    run.announce(&best, best.plan.steps.len());
    if best.plan.cost <= best.lower {
        return proved_by_bound(run, &best);
    }
    let mut prover = Prover::default();
    let proof = match prover.advance(&mut run, bounds, &mut best, SatBudget::UNLIMITED) {
        ProverOutcome::Proved(proof) => Some(proof),
        ProverOutcome::Paused | ProverOutcome::Over => None,
    };
    into_solution(run, &best, prover.horizon, proof)
}
