//! A first plan, improved to a cheapest one.

use std::time::Instant;

use crate::bounds::Bounds;
use crate::encode::{CostLimit, Counting, Semantics};
use crate::number::Int;
use crate::optimize::config::{Engine, Strategy};
use crate::optimize::cores::raise;
use crate::optimize::first::first_plan;
use crate::optimize::run::{Best, Extent, Run, Tightened};
use crate::optimize::tighten::tighten;
use crate::plan::ground::GroundPlan;
use crate::plan::solution::{Proof, Solution, Status};
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

/// What the SAT solver may spend on a formula.
#[derive(Debug, Clone, Copy)]
pub(super) struct Allowance {
    clauses: usize,
    conflicts: u64,
}

impl Allowance {
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
    let found = match run.config.engine {
        Engine::Sat => Found::Unknown(None),
        Engine::Auto | Engine::Search => search(run.context(), &bounds),
    };
    run.statistics.search = started.elapsed();
    let within = |plan: &GroundPlan| run.config.horizon.is_none_or(|horizon| plan.steps.len() <= horizon);
    let (incumbent, exact) = match found {
        Found::None => return run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Search)),
        Found::Optimal(plan) if within(&plan) => (Some(ties::choose(run.context(), &bounds, plan)), true),
        Found::Unknown(Some(plan)) if within(&plan) => (Some(plan), false),
        Found::Optimal(_) | Found::Unknown(_) => (None, false),
    };
    let incumbent = match incumbent {
        Some(plan) => plan,
        None if run.config.engine == Engine::Search => {
            return run.finish(Status::Unknown, None, Some(lower), 0, None);
        }
        None => match first_plan(&mut run, &bounds) {
            Ok(plan) => plan,
            Err(solution) => return *solution,
        },
    };
    improve(run, &bounds, incumbent, lower, exact)
}

/// Improves a first plan to a cheapest one. `exact` says that the search has proved it cheapest already.
fn improve(mut run: Run<'_>, bounds: &Bounds, incumbent: GroundPlan, lower: Int, exact: bool) -> Solution {
    let mut best = Best { plan: incumbent, lower };
    run.announce(&best, best.plan.steps.len());
    if best.plan.cost <= lower {
        let proof = confirm(&mut run, &best.plan).unwrap_or(Proof::Bound);
        return conclude(run, &best, 0, Some(proof));
    }
    let unproved = exact.then_some(Proof::Search);
    let is_large = run.task.operators.len().saturating_mul(best.plan.steps.len()) > CONFIRM_PRODUCT;
    if run.config.engine == Engine::Search || exact && is_large && !run.config.confirm {
        return conclude(run, &best, 0, unproved);
    }
    let allowance = if exact && !run.config.confirm { CONFIRM } else { Allowance::UNLIMITED };
    let mut stage = if exact { Int::MAX } else { best.plan.cost.saturating_sub(lower) / STAGES };
    loop {
        let limit = best.plan.below().min(lower.saturating_add(stage));
        let Ok(extent) = run.extent(bounds, limit, &best) else {
            return conclude(run, &best, 0, unproved);
        };
        let horizon = extent.allowed.len();
        if extent.step_bound.is_none() && stage < Int::MAX {
            // That there is no such plan would prove nothing.
            stage = Int::MAX;
            continue;
        }
        let is_small = extent.size() <= CONFIRM_SIZE && limit < CONFIRM_COST;
        if exact && !is_small && !run.config.confirm || extent.size() > FORMULA_LIMIT {
            return conclude(run, &best, horizon, unproved);
        }
        let tightened = within(&mut run, bounds, &extent, &mut best, allowance);
        if exact && best.plan.cost <= limit {
            run.contradicted("a formula has a cheaper plan than the one that the search calls cheapest");
        }
        match (tightened, extent.step_bound) {
            (Tightened::Exhausted, Some(step_bound)) => {
                best.lower = best.plan.cost.min(limit.saturating_add(1));
                if best.lower == best.plan.cost {
                    // What the search has proved does not come to rest on the word of a program.
                    let proof = unproved.filter(|_| run.statistics.unchecked.is_some());
                    let proof = proof.unwrap_or(Proof::Sat { step_bound });
                    return conclude(run, &best, horizon, Some(proof));
                }
                run.announce(&best, horizon);
                stage = stage.saturating_mul(2).max(1);
            }
            _ => return conclude(run, &best, horizon, unproved),
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
        tighten(run, encoding, best, allowance.conflicts)
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

fn conclude(run: Run<'_>, best: &Best, horizon: usize, proof: Option<Proof>) -> Solution {
    let horizon = horizon.max(best.plan.steps.len());
    let plan = Some(&best.plan);
    match proof {
        Some(proof) => run.finish(Status::Optimal, plan, Some(best.plan.cost), horizon, Some(proof)),
        None => run.finish(Status::Feasible, plan, Some(best.lower), horizon, None),
    }
}
