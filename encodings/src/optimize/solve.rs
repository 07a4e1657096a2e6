//! A first plan, improved to a cheapest one.

use std::time::Instant;

use crate::bounds::Bounds;
use crate::encode::{CostLimit, Counting, Semantics};
use crate::number::Int;
use crate::optimize::config::{Engine, Strategy};
use crate::optimize::cores::raise;
use crate::optimize::first::first_plan;
use crate::optimize::portfolio;
use crate::optimize::run::{Best, Extent, Run, Tightened};
use crate::optimize::tighten::tighten;
use crate::plan::ground::GroundPlan;
use crate::plan::solution::{Part, Proof, Solution, Status};
use crate::sat::Answer;
use crate::search::ties;
use crate::search::{Found, search};

/// Formulas with more operator variables than this are not built.
const FORMULA_LIMIT: usize = 30_000_000;
/// What is proved already, the SAT solver may spend on proving again: so many clauses and so many conflicts. Both take about five
/// milliseconds.
const CONFIRM: Allowance = Allowance { clauses: 50_000, conflicts: 60 };
/// The formula has at most this many operator variables then.
const CONFIRM_SIZE: usize = 5_000;
/// With so many operators times steps it is not even looked at which of them are left.
const CONFIRM_PRODUCT: usize = 1_500;
/// The first formula is for plans within this part of the gap between the lower bound and the best plan known; each further one
/// for twice as much of it.
const STAGES: Int = 8;
/// Formulas with at most this many operator variables are solved once more without the help of bounds.
const CONFIRM_LIMIT: usize = 400;
/// Costs from here on, as products of decimals have them once they are integers, make no formula small.
const CONFIRM_COST: Int = 1 << 64;

/// In a formula with so many clauses a conflict takes twice as long as in a small one, about.
const LARGE: usize = 50_000;

/// What the SAT solver may spend on a formula.
#[derive(Debug, Clone, Copy)]
pub(super) struct Allowance {
    pub(super) clauses: usize,
    /// In a formula that is not large.
    pub(super) conflicts: u64,
}

impl Allowance {
    /// So many conflicts: each takes longer in a large formula.
    pub(super) fn conflicts(self, clauses: usize) -> u64 {
        let factor = (clauses / LARGE).saturating_add(1);
        if self.conflicts == u64::MAX {
            return u64::MAX;
        }
        self.conflicts.checked_div(factor as u64).unwrap_or(self.conflicts)
    }

    /// As much as it takes.
    pub(super) const UNLIMITED: Self = Self { clauses: usize::MAX, conflicts: u64::MAX };
}

/// A cheapest plan where no action earns anything.
pub(super) fn solve(mut run: Run<'_>) -> Solution {
    let started = Instant::now();
    let Ok(bounds) = Bounds::new(run.context()) else {
        return run.finish(Status::Unknown, None, None, 0, None);
    };
    let Some(lower) = bounds.estimate(&run.task.initial) else {
        let reason = "no path leads to the goal in a projection of the task to one or two of its variables";
        return run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Relaxation(reason.into())));
    };
    run.statistics.search = started.elapsed();
    match (run.config.engine, run.config.horizon) {
        (Engine::Sat, _) => solve_by_formulas(run, &bounds, lower),
        (_, Some(horizon)) => solve_within(run, &bounds, lower, horizon),
        (_, None) => portfolio::solve(run, &bounds, lower),
    }
}

/// A search that knows nothing of horizons, then formulas, which do.
fn solve_within(mut run: Run<'_>, bounds: &Bounds, lower: Int, horizon: usize) -> Solution {
    let started = Instant::now();
    let found = search(run.context(), bounds);
    run.statistics.search = run.statistics.search.saturating_add(started.elapsed());
    match found {
        Found::None => run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Search)),
        Found::Optimal(plan) if plan.steps.len() <= horizon => {
            let plan = ties::choose(run.context(), bounds, plan);
            proved_by_search(run, bounds, plan, lower)
        }
        Found::Unknown(Some(plan)) if plan.steps.len() <= horizon => {
            improve(run, bounds, Best { plan, lower })
        }
        Found::Optimal(_) | Found::Unknown(_) => solve_by_formulas(run, bounds, lower),
    }
}

/// Formulas for a first plan, then for cheaper ones.
fn solve_by_formulas(mut run: Run<'_>, bounds: &Bounds, lower: Int) -> Solution {
    match first_plan(&mut run, bounds) {
        Ok(plan) => {
            run.statistics.found_by = Some(Part::Sat);
            improve(run, bounds, Best { plan, lower })
        }
        Err(solution) => *solution,
    }
}

/// Improves a plan to a cheapest one by formulas.
fn improve(mut run: Run<'_>, bounds: &Bounds, mut best: Best) -> Solution {
    run.announce(&best, best.plan.steps.len());
    if best.plan.cost <= best.lower {
        return proved_by_bound(run, &best);
    }
    let mut prover = Prover::default();
    let proof = match prover.advance(&mut run, bounds, &mut best, Allowance::UNLIMITED) {
        Proving::Proved(proof) => Some(proof),
        Proving::Paused | Proving::Over => None,
    };
    conclude(run, &best, prover.horizon, proof)
}

/// A plan whose cost is a lower bound.
pub(super) fn proved_by_bound(mut run: Run<'_>, best: &Best) -> Solution {
    let proof = confirm(&mut run, &best.plan).unwrap_or(Proof::Bound);
    conclude(run, best, 0, Some(proof))
}

/// A plan that the search calls cheapest: the SAT solver says the same if that does not take long.
pub(super) fn proved_by_search(mut run: Run<'_>, bounds: &Bounds, plan: GroundPlan, lower: Int) -> Solution {
    let mut best = Best { plan, lower };
    run.announce(&best, best.plan.steps.len());
    if best.plan.cost <= lower {
        return proved_by_bound(run, &best);
    }
    let by_search = Some(Proof::Search);
    let is_large = run.task.operators.len().saturating_mul(best.plan.steps.len()) > CONFIRM_PRODUCT;
    let confirmed = run.config.confirm;
    if run.config.engine == Engine::Search || is_large && !confirmed {
        return conclude(run, &best, 0, by_search);
    }
    let allowance = if confirmed { Allowance::UNLIMITED } else { CONFIRM };
    let limit = best.plan.below();
    let Ok(extent) = run.extent(bounds, limit, &best) else {
        return conclude(run, &best, 0, by_search);
    };
    let horizon = extent.allowed.len();
    let is_small = confirmed || extent.size() <= CONFIRM_SIZE && limit < CONFIRM_COST;
    if !is_small || extent.size() > FORMULA_LIMIT {
        return conclude(run, &best, horizon, by_search);
    }
    let tightened = within(&mut run, bounds, &extent, &mut best, allowance);
    if best.plan.cost <= limit {
        run.contradicted("a formula has a cheaper plan than the one that the search calls cheapest");
    }
    // What the search has proved does not come to rest on the word of a program.
    let proof = match (tightened, extent.step_bound) {
        (Tightened::Exhausted, Some(step_bound)) if run.statistics.unchecked.is_none() => {
            Some(Proof::Sat { step_bound })
        }
        _ => by_search,
    };
    conclude(run, &best, horizon, proof)
}

/// Formulas for plans that are cheaper than the best one, the first for those within a part of the gap to the lower bound.
#[derive(Default)]
pub(super) struct Prover {
    stage: Option<Int>,
    /// Steps up to which plans were considered.
    pub(super) horizon: usize,
}

/// What formulas have come to.
pub(super) enum Proving {
    /// The best plan is a cheapest one.
    Proved(Proof),
    /// The allowance is used up.
    Paused,
    /// More would prove nothing, or a limit was reached.
    Over,
}

impl Prover {
    /// Decides formulas, each within an allowance; the plan, the lower bound and the reason for it become better on the way.
    pub(super) fn advance(
        &mut self,
        run: &mut Run<'_>,
        bounds: &Bounds,
        best: &mut Best,
        allowance: Allowance,
    ) -> Proving {
        loop {
            let steps = best.plan.steps.len();
            if run.config.limits.reached() || steps.saturating_mul(run.task.operators.len()) > FORMULA_LIMIT {
                return Proving::Over;
            }
            let gap = best.plan.cost.saturating_sub(best.lower);
            let stage = *self.stage.get_or_insert(gap / STAGES);
            let limit = best.plan.below().min(best.lower.saturating_add(stage));
            let Ok(extent) = run.extent(bounds, limit, best) else { return Proving::Over };
            self.horizon = self.horizon.max(extent.allowed.len());
            if extent.step_bound.is_none() && stage < Int::MAX {
                // That there is no such plan would prove nothing.
                self.stage = Some(Int::MAX);
                continue;
            }
            if extent.size() > FORMULA_LIMIT {
                return Proving::Over;
            }
            if extent.size() > allowance.clauses {
                return Proving::Paused;
            }
            match (within(run, bounds, &extent, best, allowance), extent.step_bound) {
                (Tightened::Exhausted, Some(step_bound)) => {
                    best.lower = best.plan.cost.min(limit.saturating_add(1));
                    if best.lower == best.plan.cost {
                        return Proving::Proved(Proof::Sat { step_bound });
                    }
                    run.announce(best, self.horizon);
                    self.stage = Some(stage.saturating_mul(2).max(1));
                }
                (Tightened::Exhausted, None) => return Proving::Over,
                (Tightened::Interrupted, _) if run.config.limits.reached() => return Proving::Over,
                (Tightened::Interrupted, _) => return Proving::Paused,
            }
        }
    }
}

/// Decides whether there is a plan that costs at most the limit of an extent, and finds a cheapest one.
pub(super) fn within(
    run: &mut Run<'_>,
    bounds: &Bounds,
    extent: &Extent,
    best: &mut Best,
    allowance: Allowance,
) -> Tightened {
    let is_unlimited = allowance.conflicts == u64::MAX;
    let cores = is_unlimited && extent.step_bound.is_some() && run.config.strategy == Strategy::Cores;
    let started = Instant::now();
    let counting = if cores { Counting::Apart } else { Counting::Sum };
    let cost = CostLimit { limit: extent.limit, bounds, counting };
    let semantics = run.semantics(Semantics::Sequential);
    let encoding = run.encoding(&extent.allowed, Some(cost), semantics, allowance.clauses);
    run.statistics.encode = run.statistics.encode.saturating_add(started.elapsed());
    let Some(encoding) = encoding else { return Tightened::Interrupted };
    if cores {
        raise(run, encoding, extent.limit, best)
    } else {
        let conflicts = allowance.conflicts(encoding.formula.len());
        tighten(run, encoding, best, conflicts)
    }
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
    let allowance = if run.config.confirm { Allowance::UNLIMITED } else { CONFIRM };
    let started = Instant::now();
    let allowed = vec![vec![true; run.task.operators.len()]; steps];
    let bounds = Bounds::trivial(run.context()).ok()?;
    let cost = CostLimit { limit, bounds: &bounds, counting: Counting::Sum };
    let encoding =
        run.encoding(&allowed, Some(cost), run.semantics(Semantics::Sequential), allowance.clauses);
    run.statistics.encode = run.statistics.encode.saturating_add(started.elapsed());
    let mut live = run.live(allowance.conflicts);
    let (answer, _) = run.call(&mut live, &encoding?, &[]);
    if answer == Answer::Satisfiable {
        run.contradicted("a formula has a plan that is cheaper than the lower bound");
    }
    let is_confirmed = answer == Answer::Unsatisfiable && run.statistics.unchecked.is_none();
    is_confirmed.then_some(Proof::Sat { step_bound: steps })
}

pub(super) fn conclude(run: Run<'_>, best: &Best, horizon: usize, proof: Option<Proof>) -> Solution {
    let horizon = horizon.max(best.plan.steps.len());
    let plan = Some(&best.plan);
    match proof {
        Some(proof) => run.finish(Status::Optimal, plan, Some(best.plan.cost), horizon, Some(proof)),
        None => run.finish(Status::Feasible, plan, Some(best.lower), horizon, None),
    }
}
