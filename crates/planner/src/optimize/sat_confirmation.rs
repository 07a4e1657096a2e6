//! Confirms results of the search with the SAT solver if this takes little time or is configured
//! ([`Config::confirm`](crate::Config::confirm)).

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

/// Budget for confirming a proof of another component. Both limits correspond to about five milliseconds.
const CONFIRM_BUDGET: SatBudget = SatBudget { clauses: 50_000, conflicts: 60 };
/// Number of operator variables of a formula above which confirmation is attempted only if it is configured.
const CONFIRM_SIZE: usize = 5_000;
/// Product of the numbers of operators and steps above which a result of the search is confirmed
/// only if this is configured.
const CONFIRM_PRODUCT: usize = 1_500;
/// Number of operator variables (operators × steps) above which [`confirm`] attempts a confirmation only if it is
/// configured. Its formula does not use the lower bounds of the search, so it is larger than other formulas.
const CONFIRM_LIMIT: usize = 400;
/// Cost limit from which formulas become large, so that confirmation is attempted only if it is configured. Such
/// costs arise from scaled products of decimals.
const CONFIRM_COST: Int = 1 << 64;

/// Returns the solution for a plan whose cost equals the lower bound. The SAT solver tries to confirm optimality
/// if this takes little time or is configured (see [`confirm`]). Without confirmation, the proof by the bound
/// counts.
pub(super) fn proved_by_bound(mut run: Run<'_>, best: &Best) -> Solution {
    let proof = confirm(&mut run, &best.plan).unwrap_or(Proof::Bound);
    into_solution(run, best, 0, Some(proof))
}

/// Returns the solution for a plan that a search has proved optimal. The SAT solver tries to confirm optimality if
/// the engine includes it and this takes little time or is configured. Without confirmation, the proof by search
/// counts, or the proof by the bound if the cost equals the initial lower bound.
pub(super) fn proved_by_search(mut run: Run<'_>, bounds: &Bounds, plan: GroundPlan, lower: Int) -> Solution {
    let mut best = Best { plan, lower };
    run.announce(&best, best.plan.steps.len());
    // The cost is compared with the initial lower bound, not with the bound that the search has raised.
    let floor = bounds.estimate(&run.task.initial);
    if floor.is_some_and(|floor| best.plan.cost <= floor) {
        return proved_by_bound(run, &best);
    }
    let by_search = Some(Proof::Search);
    let is_large = run.task.operators.len().saturating_mul(best.plan.steps.len()) > CONFIRM_PRODUCT;
    let must_confirm = run.config.confirm;
    if run.config.engine == Engine::Search || is_large && !must_confirm {
        return into_solution(run, &best, 0, by_search);
    }
    let allowance = if must_confirm { SatBudget::UNLIMITED } else { CONFIRM_BUDGET };
    let limit = best.plan.below();
    let Ok(extent) = run.extent(bounds, limit, &best) else {
        return into_solution(run, &best, 0, by_search);
    };
    let horizon = extent.allowed.len();
    let is_small = must_confirm || extent.size() <= CONFIRM_SIZE && limit < CONFIRM_COST;
    if !is_small || extent.size() > FORMULA_LIMIT {
        return into_solution(run, &best, 0, by_search);
    }
    let sat_outcome = within(&mut run, bounds, &extent, &mut best, allowance);
    if best.plan.cost <= limit {
        run.report_internal_contradiction(
            "a formula has a cheaper plan than the one that the search calls cheapest",
        );
    }
    // An unverified claim of an external program does not replace the proof by search.
    match (sat_outcome, extent.step_bound) {
        (StrategyOutcome::Exhausted, Some(step_bound)) if run.statistics.unchecked.is_none() => {
            into_solution(run, &best, horizon, Some(Proof::Sat { step_bound }))
        }
        _ => into_solution(run, &best, 0, by_search),
    }
}

/// Confirms with the SAT solver that a plan whose cost equals the lower bound is optimal. The formula is
/// independent of the bounds: its number of steps follows from the cheapest operator. Returns `None` if optimality
/// is not confirmed. Confirmation is not attempted if an operator costs nothing, if the engine is
/// [`Engine::Search`], if the formula would be large and confirmation is not configured, or if it would be too large.
fn confirm(run: &mut Run<'_>, incumbent: &GroundPlan) -> Option<Proof> {
    let cheapest =
        run.task.operators.iter().map(|operator| operator.cost.minimum()).min().filter(|c| *c > 0)?;
    let limit = incumbent.below();
    let steps = usize::try_from(limit.checked_div(cheapest)?).ok()?;
    let size = steps.saturating_mul(run.task.operators.len());
    let is_large = size > CONFIRM_LIMIT || limit >= CONFIRM_COST;
    if run.config.engine == Engine::Search || is_large && !run.config.confirm || size > FORMULA_LIMIT {
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

pub(super) fn into_solution(run: Run<'_>, best: &Best, horizon: usize, proof: Option<Proof>) -> Solution {
    let plan = Some(&best.plan);
    match proof {
        Some(proof) => {
            let horizon = horizon.max(best.plan.steps.len());
            run.finish(Status::Optimal, plan, Some(best.plan.cost), horizon, Some(proof))
        }
        None => run.finish(Status::Feasible, plan, Some(best.lower), horizon, None),
    }
}
