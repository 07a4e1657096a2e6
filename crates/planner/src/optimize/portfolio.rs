//! Portfolio of exact search, satisficing search and SAT, which take turns.
//!
//! The work of a round is twice that of the previous round, up to a limit. Each component gets a share of the work;
//! the shares of satisficing search and SAT shrink while they are unsuccessful. Work is counted in units instead of
//! time, so results without a time limit are deterministic, except with an external SAT solver: its conflicts are
//! limited by time. The plans and bounds of a component limit the others.

use std::time::Instant;

use search::bounds::Bounds;
use search::satisfice::{Satisficer, StepResult};
use search::search::{InterleavedSearch, SearchOutcome, SearchProblem, SearchTask, plan_tiebreak};
use task::number::Int;
use task::plan::ground::GroundPlan;
use task::plan::solution::{PlannerPart, Proof, Solution, Statistics, Status};
use tracing::field::Empty;
use tracing::{Span, info_span};

use crate::optimize::config::Engine;
use crate::optimize::horizon_schedule::{FirstPlanOutcome, HorizonSchedule};
use crate::optimize::optimizer_run::{Best, Run};
use crate::optimize::prover::{Prover, ProverOutcome};
use crate::optimize::sat_budget::SatBudget;
use crate::optimize::sat_confirmation::{into_solution, proved_by_bound, proved_by_search};

/// Work units of the satisficing search, for each state that A\* may store in the same round.
const RELAXATION_WORK_PER_STATE: usize = 200;
/// Maximum number of clauses of a formula for each state that A\* may store in the same round, before the budget is
/// halved.
const CLAUSES_PER_STATE: usize = 50;
const STATES_PER_CONFLICT: u64 = 4;
const MAX_BACKOFF: u32 = 3;
/// Maximum number of times that the budget of a component is doubled.
const MAX_BOOST: u32 = 3;
/// Minimum number of times that the budget for improving the best plan is doubled, unless a proof is within reach and
/// A\* may finish.
const MIN_BOOST: i32 = 2;
/// Maximum number of times that the budget for improving the best plan is doubled while a proof is within reach and
/// A\* may finish.
const NEAR_BOOST: i32 = 1;
/// Numerator and denominator of a ratio. If the cost of a plan divided by the lower bound exceeds this ratio,
/// a better plan is probably easier to find than a proof.
const NEAR_OPTIMAL_RATIO: (Int, Int) = (3, 2);
/// Number of rounds for which the lower bound is extrapolated, from the same number of rounds before. If the bound
/// will not reach the cost of the plan, a better plan is probably easier to find than a proof.
const FORECAST_ROUNDS: usize = 3;

struct Portfolio<'r, 'a> {
    run: Run<'a>,
    bounds: &'r Bounds,
    exact: Option<InterleavedSearch<'r, Int, Bounds>>,
    satisficer: Option<Satisficer<'a, Int>>,
    first: Option<HorizonSchedule>,
    prover: Option<Prover>,
    best: Option<GroundPlan>,
    lower: Int,
    /// Lowest positive operator cost, or 0. A gap of at most this cost leaves few better plans, so a proof is the
    /// likely next result.
    least_cost: Int,
    bounds_by_round: Vec<Int>,
    reason: Proof,
    /// Number of times that the clauses and conflicts of formulas are halved, at most [`MAX_BACKOFF`].
    share: u32,
    /// Number of unsuccessful turns of the satisficing search since its last plan, at most [`MAX_BACKOFF`].
    satisficer_share: u32,
    /// Binary logarithm of the factor for the budget that improves the best plan, from -[`MAX_BACKOFF`] to
    /// [`MAX_BOOST`].
    improvement_share: i32,
}

/// Result of the turn of a component: the end of planning, or `None` if the next component continues.
type Turn = Option<Ending>;

enum Ending {
    Exact(GroundPlan),
    Unsolvable,
    Proved(Proof),
    Refuted(Box<Solution>),
    Over,
}

/// Runs the portfolio. `lower` is a lower bound on the cost of every plan.
pub(super) fn solve(run: Run<'_>, bounds: &Bounds, lower: Int) -> Solution {
    let started = Instant::now();
    let context = run.context();
    let Ok(prepared) = SearchTask::new(context) else {
        return run.finish(Status::Unknown, None, Some(lower), 0, None);
    };
    let space = prepared.as_ref().map(|prepared| SearchProblem { context, bounds, prepared, orbits: None });
    let exact =
        space.map(|space| InterleavedSearch::new(space, &context.task.initial).continue_without_forecast());
    let is_sat = run.config.engine != Engine::Search;
    let costs = context.task.operators.iter().map(|operator| operator.cost.minimum());
    let least_cost = costs.filter(|cost| *cost > 0).min().unwrap_or(0);
    let mut portfolio = Portfolio {
        first: is_sat.then(|| HorizonSchedule::new(&run)),
        prover: is_sat.then(Prover::default),
        run,
        bounds,
        exact,
        satisficer: None,
        best: None,
        lower,
        least_cost,
        bounds_by_round: Vec::new(),
        reason: Proof::Bound,
        share: MAX_BACKOFF,
        satisficer_share: 0,
        improvement_share: MAX_BOOST.cast_signed(),
    };
    let ending = portfolio.rounds();
    portfolio.note_search(started);
    portfolio.end(ending)
}

impl<'r, 'a: 'r> Portfolio<'r, 'a> {
    fn rounds(&mut self) -> Ending {
        // Most tasks are solved in this first turn of the exact search.
        let unit = self.run.config.head_start.max(1);
        if let Some(ending) = self.search_exactly(unit) {
            return ending;
        }
        if let Ok(satisficer) = Satisficer::new(self.run.context()) {
            self.satisficer = satisficer;
        }
        let mut stored = unit;
        for round in 0..u32::MAX {
            // The work doubles in each round, up to a factor of 2^20.
            let work = unit.saturating_mul(1_usize.checked_shl(round.min(20)).unwrap_or(1));
            stored = stored.saturating_add(work);
            self.bounds_by_round.push(self.lower);
            let turns: [fn(&mut Self, usize, usize) -> Turn; 4] = [
                Self::satisfice,
                Self::improve_best_plan,
                |portfolio, _, stored| portfolio.search_exactly(stored),
                Self::sat_turn,
            ];
            for turn in turns {
                if self.run.config.limits.reached() {
                    return Ending::Over;
                }
                if let Some(ending) = turn(self, work, stored) {
                    return ending;
                }
            }
            if self.searches_ended()
                && if self.best.is_some() { self.prover.is_none() } else { self.first.is_none() }
            {
                return Ending::Over;
            }
        }
        Ending::Over
    }

    fn search_exactly(&mut self, stored: usize) -> Turn {
        let Self { exact, run, lower, reason, best, .. } = self;
        let exact = exact.as_mut()?;
        let span = info_span!("search", expanded = Empty, generated = Empty).entered();
        let cost = best.as_ref().map(|plan| plan.cost);
        if let Some(cost) = cost {
            exact.set_upper_bound(&cost);
        }
        let before = exact.figures();
        let outcome = exact.run(stored, &mut |_, bound| {
            if *bound > *lower {
                (*lower, *reason) = (*bound, Proof::Search);
                run.note(cost, *bound);
            }
        });
        exact.figures().add_to(before, &mut run.statistics);
        record(&span, &run.statistics);
        match outcome {
            Some(SearchOutcome::Optimal(plan)) => Some(Ending::Exact(plan)),
            Some(SearchOutcome::None) if self.best.is_none() => Some(Ending::Unsolvable),
            Some(SearchOutcome::None) => Some(Ending::Over),
            Some(SearchOutcome::Unknown(plan)) => {
                self.exact = None;
                plan.and_then(|plan| self.improve(plan, PlannerPart::Search)).or_else(|| self.meets())
            }
            None => {
                let plan = exact.best_plan();
                plan.and_then(|plan| self.improve(plan, PlannerPart::Search)).or_else(|| self.meets())
            }
        }
    }

    fn satisfice(&mut self, work: usize, _: usize) -> Turn {
        let is_near = self.is_near();
        let satisficer = self.satisficer.as_mut().filter(|satisficer| !satisficer.has_ended())?;
        let span = info_span!("satisfice", expanded = Empty, generated = Empty).entered();
        let nodes = work.saturating_mul(RELAXATION_WORK_PER_STATE) as u64;
        let limit = self.best.as_ref().map(|plan| plan.cost);
        // A first plan has priority over a better plan, and a better plan over a proof, unless a proof is within
        // reach. The budget shrinks after unsuccessful turns if there is no plan, or if a proof is within reach and
        // A\* may finish: then A\* may be faster.
        let has_hope = self.exact.as_ref().is_some_and(InterleavedSearch::may_finish);
        let (twice, halved) = match limit {
            None => (MAX_BOOST.saturating_sub(self.satisficer_share).max(1), 0),
            Some(_) if !is_near => (1, 0),
            Some(_) => (0, if has_hope { self.satisficer_share } else { 0 }),
        };
        self.satisficer_share = self.satisficer_share.saturating_add(1).min(MAX_BACKOFF);
        let before = satisficer.figures;
        let advance = satisficer.run(limit.as_ref(), (nodes << twice >> halved).max(1));
        satisficer.figures.add_to(before, &mut self.run.statistics);
        record(&span, &self.run.statistics);
        match advance {
            Ok(StepResult::Plan(plan)) => {
                self.satisficer_share = 0;
                self.improve(plan, PlannerPart::Satisficing)
            }
            Ok(StepResult::Unsolvable) => Some(Ending::Unsolvable),
            Ok(StepResult::Paused) => None,
            Ok(StepResult::Ended) => {
                self.run.statistics.restarts = satisficer.restarts();
                None
            }
            Err(_) => Some(Ending::Over),
        }
    }

    /// Returns `true` if only formulas can still find a plan or prove anything.
    fn searches_ended(&self) -> bool {
        let can_improve = |satisficer: &Satisficer<'a, Int>| {
            self.best.is_some() && satisficer.can_improve() || !satisficer.has_ended()
        };
        self.exact.is_none() && !self.satisficer.as_ref().is_some_and(can_improve)
    }

    fn is_near(&self) -> bool {
        self.best.as_ref().is_some_and(|plan| {
            plan.cost.saturating_mul(NEAR_OPTIMAL_RATIO.1) <= self.lower.saturating_mul(NEAR_OPTIMAL_RATIO.0)
                && (plan.cost.saturating_sub(self.lower) <= self.least_cost
                    || bound_reaches(&self.bounds_by_round, self.lower, plan.cost))
        })
    }

    /// Replaces parts of the best plan by cheaper ones. A success raises the budget of the next turn to its
    /// maximum; a failure halves it, down to a minimum.
    fn improve_best_plan(&mut self, work: usize, _: usize) -> Turn {
        let has_hope = self.exact.as_ref().is_some_and(InterleavedSearch::may_finish);
        let (least, most) = if has_hope && self.is_near() {
            (MAX_BACKOFF.cast_signed().saturating_neg(), NEAR_BOOST)
        } else {
            (MIN_BOOST, MAX_BOOST.cast_signed())
        };
        let before = self.satisficer.as_ref()?.figures;
        let span = info_span!("improve", expanded = Empty, generated = Empty).entered();
        let share = self.improvement_share.clamp(least, most);
        let nodes = work.saturating_mul(RELAXATION_WORK_PER_STATE) as u64;
        let mut nodes = (nodes << share.max(0) >> share.min(0).unsigned_abs()).max(1);
        let (mut is_better, mut turn) = (false, None);
        while let Ok(Some(plan)) = self.satisficer.as_mut()?.improve(self.best.as_ref()?, &mut nodes) {
            is_better = true;
            turn = self.improve(plan, PlannerPart::Satisficing);
        }
        self.satisficer.as_ref()?.figures.add_to(before, &mut self.run.statistics);
        record(&span, &self.run.statistics);
        if !is_better {
            self.improvement_share = share.saturating_sub(1).max(least);
            return None;
        }
        self.improvement_share = most;
        turn
    }

    fn sat_turn(&mut self, work: usize, _: usize) -> Turn {
        let alone = self.searches_ended();
        let before = (self.lower, self.best.as_ref().map(|plan| plan.cost));
        let share = self.share;
        let allowance = SatBudget {
            clauses: CLAUSES_PER_STATE.saturating_mul(work).checked_shr(share).unwrap_or(0),
            conflicts: (work as u64 / STATES_PER_CONFLICT).checked_shr(share).unwrap_or(0).max(1),
        };
        let allowance = if alone { SatBudget::UNLIMITED } else { allowance };
        let turn = self.ask_for(allowance);
        // An unsuccessful turn halves the next budget; a successful turn doubles it. The number of halvings
        // stays between 0 and `MAX_BACKOFF`.
        let achieved = before != (self.lower, self.best.as_ref().map(|plan| plan.cost));
        self.share =
            if achieved { share.saturating_sub(1) } else { share.saturating_add(1).min(MAX_BACKOFF) };
        turn
    }

    fn ask_for(&mut self, allowance: SatBudget) -> Turn {
        match &self.best {
            None => match self.first.as_mut()?.advance(&mut self.run, self.bounds, allowance) {
                FirstPlanOutcome::Plan(plan) => self.improve(plan, PlannerPart::Sat),
                FirstPlanOutcome::Refuted(solution) => Some(Ending::Refuted(solution)),
                FirstPlanOutcome::Paused => None,
                FirstPlanOutcome::Over => {
                    self.first = None;
                    None
                }
            },
            Some(plan) => {
                let mut best = Best { plan: plan.clone(), lower: self.lower };
                let proving = self.prover.as_mut()?.advance(&mut self.run, self.bounds, &mut best, allowance);
                if best.lower > self.lower {
                    let step_bound = self.prover.as_ref().map_or(0, |prover| prover.step_bound);
                    (self.lower, self.reason) = (best.lower, Proof::Sat { step_bound });
                }
                if best.plan.cost < plan.cost {
                    self.run.statistics.found_by = Some(PlannerPart::Sat);
                    self.best = Some(best.plan);
                }
                match proving {
                    ProverOutcome::Proved(proof) => Some(Ending::Proved(proof)),
                    ProverOutcome::Paused => None,
                    ProverOutcome::Over => {
                        self.prover = None;
                        None
                    }
                }
            }
        }
    }

    fn improve(&mut self, plan: GroundPlan, part: PlannerPart) -> Turn {
        if self.best.as_ref().is_none_or(|best| plan.cost < best.cost) {
            self.run.statistics.found_by = Some(part);
            let horizon = plan.steps.len();
            let best = Best { plan, lower: self.lower };
            self.run.announce(&best, horizon);
            self.best = Some(best.plan);
        }
        self.meets()
    }

    /// Ends the run if the lower bound reaches the cost of the best known plan.
    fn meets(&self) -> Turn {
        let best = self.best.as_ref()?;
        (best.cost <= self.lower).then(|| Ending::Proved(self.reason.clone()))
    }

    fn note_search(&mut self, started: Instant) {
        let statistics = &mut self.run.statistics;
        let sat = statistics.encode.saturating_add(statistics.solve);
        let search = started.elapsed().saturating_sub(sat);
        statistics.search = statistics.search.saturating_add(search);
        if let Some(satisficer) = &self.satisficer {
            statistics.restarts = satisficer.restarts();
        }
    }

    fn end(self, ending: Ending) -> Solution {
        let Self { mut run, bounds, best, lower, .. } = self;
        match (ending, best) {
            (Ending::Exact(plan), _) => {
                run.statistics.found_by.get_or_insert(PlannerPart::Search);
                let plan = plan_tiebreak::select_canonical_plan(run.context(), bounds, plan);
                proved_by_search(run, bounds, plan, lower)
            }
            (Ending::Unsolvable, _) => run.finish(Status::Unsolvable, None, None, 0, Some(Proof::Search)),
            (Ending::Refuted(solution), _) => *solution,
            (Ending::Proved(proof), Some(plan)) => {
                let best = Best { lower: plan.cost, plan };
                match proof {
                    Proof::Bound => proved_by_bound(run, &best),
                    Proof::Search => proved_by_search(run, bounds, best.plan, lower),
                    proof => into_solution(run, &best, 0, Some(proof)),
                }
            }
            (Ending::Over, Some(plan)) => into_solution(run, &Best { plan, lower }, 0, None),
            (Ending::Over | Ending::Proved(_), None) => {
                run.finish(Status::Unknown, None, Some(lower), 0, None)
            }
        }
    }
}

/// Returns `true` if `lower` will reach `cost` within [`FORECAST_ROUNDS`] rounds, by linear extrapolation from as
/// many previous rounds. Also returns `true` if there were fewer rounds. `bounds_by_round` are the bounds at the
/// beginnings of the rounds, including the current one.
fn bound_reaches(bounds_by_round: &[Int], lower: Int, cost: Int) -> bool {
    let earlier = bounds_by_round.iter().rev().nth(FORECAST_ROUNDS);
    earlier.is_none_or(|earlier| lower.saturating_add(lower.saturating_sub(*earlier)) >= cost)
}

fn record(span: &Span, statistics: &Statistics) {
    span.record("expanded", statistics.expanded).record("generated", statistics.generated);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proof_is_within_reach_if_the_bound_rises_enough() {
        let check = |bounds: &[Int], lower, cost, expected| {
            assert_eq!(bound_reaches(bounds, lower, cost), expected, "{bounds:?} {lower} {cost}");
        };
        // After at most `FORECAST_ROUNDS` rounds there is no forecast, and the result is `true`.
        check(&[], 1, 100, true);
        check(&[1, 1, 1], 1, 100, true);
        check(&[10, 12, 14, 16], 16, 22, true);
        check(&[10, 12, 14, 16], 16, 23, false);
        check(&[0, 10, 12, 14, 16], 18, 26, true);
        check(&[0, 10, 12, 14, 16], 18, 27, false);
        check(&[20, 20, 20, 20], 20, 21, false);
        check(&[20, 20, 20, 20], 20, 20, true);
    }
}
