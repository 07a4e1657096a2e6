//! Confirms results of the search with the SAT solver where that is quick.

use std::time::Instant;

use encodings::encode::{CostEncoding, CostLimit, StepSemantics};
use encodings::sat::Answer;
use search::bounds::Bounds;
use task::number::Int;
use task::plan::ground::GroundPlan;
use task::plan::solution::{Proof, Solution, Status};

use crate::optimize::config::Engine;
use crate::optimize::optimizer_run::{Best, Run, StrategyOutcome};
use crate::optimize::prover::within;
use crate::optimize::sat_budget::{FORMULA_LIMIT, SatBudget};

/// What is proved already, the SAT solver may spend on proving again: so many clauses and so many conflicts. Both take about five
/// milliseconds.
const CONFIRM_BUDGET: SatBudget = SatBudget { clauses: 50_000, conflicts: 60 };
/// The formula has at most this many operator variables then.
const CONFIRM_SIZE: usize = 5_000;
/// With so many operators times steps it is not even looked at which of them are left.
const CONFIRM_PRODUCT: usize = 1_500;
/// Formulas with at most this many operator variables are solved once more without the help of bounds.
const CONFIRM_LIMIT: usize = 400;
/// Costs from here on, as products of decimals have them once they are integers, make no formula small.
const CONFIRM_COST: Int = 1 << 64;

/// A plan whose cost is a lower bound.
pub(super) fn proved_by_bound(mut run: Run<'_>, best: &Best) -> Solution {
    let proof = confirm(&mut run, &best.plan).unwrap_or(Proof::Bound);
    into_solution(run, best, 0, Some(proof))
}

/// A plan that the search calls cheapest: the SAT solver says the same if that does not take long.
pub(super) fn proved_by_search(mut run: Run<'_>, bounds: &Bounds, plan: GroundPlan, lower: Int) -> Solution {
    let mut best = Best { plan, lower };
    run.announce(&best, best.plan.steps.len());
    // What the search itself has raised is not what it is measured by.
    let floor = bounds.estimate(&run.task.initial);
    if floor.is_some_and(|floor| best.plan.cost <= floor) {
        return proved_by_bound(run, &best);
    }
    let by_search = Some(Proof::Search);
    let is_large = run.task.operators.len().saturating_mul(best.plan.steps.len()) > CONFIRM_PRODUCT;
    let confirmed = run.config.confirm;
    if run.config.engine == Engine::Search || is_large && !confirmed {
        return into_solution(run, &best, 0, by_search);
    }
    let allowance = if confirmed { SatBudget::UNLIMITED } else { CONFIRM_BUDGET };
    let limit = best.plan.below();
    let Ok(extent) = run.extent(bounds, limit, &best) else {
        return into_solution(run, &best, 0, by_search);
    };
    let horizon = extent.allowed.len();
    let is_small = confirmed || extent.size() <= CONFIRM_SIZE && limit < CONFIRM_COST;
    if !is_small || extent.size() > FORMULA_LIMIT {
        return into_solution(run, &best, horizon, by_search);
    }
    let tightened = within(&mut run, bounds, &extent, &mut best, allowance);
    if best.plan.cost <= limit {
        run.report_internal_contradiction(
            "a formula has a cheaper plan than the one that the search calls cheapest",
        );
    }
    // What the search has proved does not come to rest on the word of a program.
    let proof = match (tightened, extent.step_bound) {
        (StrategyOutcome::Exhausted, Some(step_bound)) if run.statistics.unchecked.is_none() => {
            Some(Proof::Sat { step_bound })
        }
        _ => by_search,
    };
    into_solution(run, &best, horizon, proof)
}

/// That a plan's cost equals a lower bound is proof enough. On small tasks the SAT solver has to find the same on
/// a formula that knows nothing of bounds, with as many steps as the cheapest operator allows.
fn confirm(run: &mut Run<'_>, incumbent: &GroundPlan) -> Option<Proof> {
    let cheapest =
        run.task.operators.iter().map(|operator| operator.cost.minimum()).min().filter(|c| *c > 0)?;
    let limit = incumbent.below();
    let steps = usize::try_from(limit.checked_div(cheapest)?).ok()?;
    let is_large = steps.saturating_mul(run.task.operators.len()) > CONFIRM_LIMIT || limit >= CONFIRM_COST;
    if run.config.engine == Engine::Search || is_large && !run.config.confirm {
        return None;
    }
    let allowance = if run.config.confirm { SatBudget::UNLIMITED } else { CONFIRM_BUDGET };
    let started = Instant::now();
    let allowed = vec![vec![true; run.task.operators.len()]; steps];
    let bounds = Bounds::trivial(run.context()).ok()?;
    let cost = CostLimit { limit, bounds: &bounds, counting: CostEncoding::Sum };
    let encoding =
        run.encoding(&allowed, Some(cost), run.semantics(StepSemantics::Sequential), allowance.clauses);
    run.statistics.encode = run.statistics.encode.saturating_add(started.elapsed());
    let mut live = run.live(allowance.conflicts);
    let (answer, _) = run.call(&mut live, &encoding?, &[]);
    if answer == Answer::Satisfiable {
        run.report_internal_contradiction("a formula has a plan that is cheaper than the lower bound");
    }
    let is_confirmed = answer == Answer::Unsatisfiable && run.statistics.unchecked.is_none();
    is_confirmed.then_some(Proof::Sat { step_bound: steps })
}

/// The answer that a run comes to.
pub(super) fn into_solution(run: Run<'_>, best: &Best, horizon: usize, proof: Option<Proof>) -> Solution {
    let horizon = horizon.max(best.plan.steps.len());
    let plan = Some(&best.plan);
    match proof {
        Some(proof) => run.finish(Status::Optimal, plan, Some(best.plan.cost), horizon, Some(proof)),
        None => run.finish(Status::Feasible, plan, Some(best.lower), horizon, None),
    }
}
