//! Proves optimality in stages. The formula of a stage covers the plans whose cost is at most a limit between the
//! lower bound and the cost of the best plan. The limit rises from stage to stage.
//!
//! Such a proof requires a step bound. Without a step bound, there is a single formula for all cheaper plans within a
//! number of steps. This formula can yield better plans, but no proof of optimality.

use std::time::Instant;

use encodings::encode::{CostEncoding, CostLimit, StepSemantics};
use search::bounds::Bounds;
use task::number::Int;
use task::plan::solution::Proof;

use crate::optimize::config::Strategy;
use crate::optimize::core_guided::raise;
use crate::optimize::linear_search::linear_search_down;
use crate::optimize::optimizer_run::{Best, FormulaScope, Run, StrategyOutcome};
use crate::optimize::sat_budget::{FORMULA_LIMIT, SatBudget};

/// The first formula covers 1/`STAGES` of the gap between the lower bound and the cost of the best
/// plan. Each further formula covers twice as much.
const STAGES: Int = 8;

#[derive(Default)]
pub(super) struct Prover {
    stage: Option<Int>,
    /// Number of steps up to which no plan is cheaper than the best known one; 0 if nothing is proved.
    pub(super) horizon: usize,
    /// Step bound of the formula that last raised the lower bound.
    pub(super) step_bound: usize,
}

pub(super) enum ProverOutcome {
    Proved(Proof),
    Paused,
    /// A limit was reached, formulas become too large, or further formulas cannot prove optimality.
    Over,
}

impl Prover {
    /// Solves formulas, each within a budget, until the best known plan is proved optimal or a
    /// budget does not suffice. Improves the best known plan and the lower bound.
    pub(super) fn advance(
        &mut self,
        run: &mut Run<'_>,
        bounds: &Bounds,
        best: &mut Best,
        allowance: SatBudget,
    ) -> ProverOutcome {
        loop {
            let steps = best.plan.steps.len();
            if run.config.limits.reached() || steps.saturating_mul(run.task.operators.len()) > FORMULA_LIMIT {
                return ProverOutcome::Over;
            }
            let gap = best.plan.cost.saturating_sub(best.lower);
            let stage = *self.stage.get_or_insert(gap / STAGES);
            let limit = best.plan.below().min(best.lower.saturating_add(stage));
            let Ok(extent) = run.extent(bounds, limit, best) else { return ProverOutcome::Over };
            let horizon = extent.allowed.len();
            if extent.step_bound.is_none() && stage < Int::MAX {
                // Without a step bound, an unsatisfiable formula does not raise the lower bound. So the limit is
                // not raised in stages: the formula admits all plans that are cheaper than the best one.
                self.stage = Some(Int::MAX);
                continue;
            }
            if extent.size() > FORMULA_LIMIT {
                return ProverOutcome::Over;
            }
            if extent.size() > allowance.clauses {
                return ProverOutcome::Paused;
            }
            let lower = best.lower;
            let outcome = within(run, bounds, &extent, best, allowance);
            if outcome == StrategyOutcome::Exhausted && extent.step_bound.is_some() {
                best.lower = best.plan.cost.min(limit.saturating_add(1));
            }
            // An interrupted core-guided search may also have raised the lower bound.
            if best.lower > lower {
                self.step_bound = extent.step_bound.unwrap_or(self.step_bound);
            }
            match (outcome, extent.step_bound) {
                (StrategyOutcome::Exhausted, Some(step_bound)) => {
                    if best.lower == best.plan.cost {
                        self.horizon = horizon;
                        return ProverOutcome::Proved(Proof::Sat { step_bound });
                    }
                    run.announce(best, horizon);
                    self.stage = Some(stage.saturating_mul(2).max(1));
                }
                (StrategyOutcome::Exhausted, None) => {
                    self.horizon = horizon;
                    return ProverOutcome::Over;
                }
                // Without a budget, a formula that cannot be decided now cannot be decided later.
                (StrategyOutcome::Interrupted, _)
                    if run.config.limits.reached() || allowance.conflicts == u64::MAX =>
                {
                    return ProverOutcome::Over;
                }
                (StrategyOutcome::Interrupted, _) => return ProverOutcome::Paused,
            }
        }
    }
}

/// Optimises the cost of plans within the scope of a formula until none is cheaper than `best`, or the budget or a
/// limit is reached.
pub(super) fn within(
    run: &mut Run<'_>,
    bounds: &Bounds,
    extent: &FormulaScope,
    best: &mut Best,
    allowance: SatBudget,
) -> StrategyOutcome {
    let is_unlimited = allowance.conflicts == u64::MAX;
    let cores = is_unlimited && extent.step_bound.is_some() && run.config.strategy == Strategy::Cores;
    let started = Instant::now();
    let counting = if cores { CostEncoding::Apart } else { CostEncoding::Sum };
    let cost = CostLimit { limit: extent.limit, bounds, counting };
    let semantics = run.semantics(StepSemantics::Sequential);
    let encoding = run.encoding(&extent.allowed, Some(cost), semantics, allowance.clauses);
    run.statistics.encode = run.statistics.encode.saturating_add(started.elapsed());
    let Some(encoding) = encoding else { return StrategyOutcome::Interrupted };
    if cores {
        raise(run, encoding, extent.limit, best)
    } else {
        let conflicts = allowance.conflicts(encoding.formula.clause_count());
        linear_search_down(run, encoding, best, conflicts)
    }
}
