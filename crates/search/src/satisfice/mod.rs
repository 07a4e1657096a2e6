//! Satisficing search: lazy greedy best-first search, followed by weighted A\*, both guided by the FF
//! heuristic and landmarks as in LAMA \[1\].
//!
//! `delete_relaxation` builds the delete relaxation, `ff_heuristic` computes relaxed plans, `landmarks` finds
//! landmarks, and `landmark_status` tracks which landmarks a path has reached. `search` implements the search
//! with an `alternating_open_list` over the states in a `store`. `novelty` prefers states with new facts.
//! `plan_improvement` makes a plan cheaper.
//!
//! The heuristic guides the search, but proves no plan optimal. Unsolvability is reported only if a search
//! has visited all reachable states except those behind proved dead ends.
//!
//! \[1\] S. Richter, M. Westphal: The LAMA planner: guiding cost-based anytime planning with landmarks, JAIR
//! 39, 2010.

pub mod alternating_open_list;
pub mod bucket_queue;
mod delete_relaxation;
mod ff_heuristic;
mod landmark_status;
mod landmarks;
mod novelty;
mod plan_improvement;
mod search;
mod search_context;
mod segment_goal;
mod step_order;
mod store;

use task::context::Context;
use task::limits::{Interrupted, Limits};
use task::plan::ground::GroundPlan;
use task::task::number::TaskNumber;

use crate::search::{MutexPairs, SearchStatistics};

use plan_improvement::PlanImprovement;
use search::{HeuristicWeight, Outcome, Search, SearchGoal};
use search_context::{MEMORY_SHARE, SearchContext};

/// Searches that run one after another: whether operator costs are used, and the weight of the
/// heuristic.
const SEARCH_SEQUENCE: [(bool, HeuristicWeight); 6] = [
    (false, HeuristicWeight::Greedy),
    (true, HeuristicWeight::Greedy),
    (true, HeuristicWeight::Times(5)),
    (true, HeuristicWeight::Times(3)),
    (true, HeuristicWeight::Times(2)),
    (true, HeuristicWeight::Times(1)),
];

/// Result of one turn of the satisficing search.
pub enum StepResult<N> {
    /// A plan that costs less than the limit, if a limit was given.
    Plan(GroundPlan<N>),
    /// The task has no plan.
    Unsolvable,
    /// The work budget is used up, or the current search has ended without a plan below the limit. `run` can be
    /// called again.
    Paused,
    /// All searches of the sequence have ended.
    Ended,
}

/// A resumable sequence of searches for cheaper and cheaper plans.
pub struct Satisficer<'a, N> {
    known: SearchContext<'a, N>,
    limits: &'a Limits,
    phase: usize,
    search: Option<Search<N>>,
    /// Cost of the plan that the searches found last.
    cost: Option<N>,
    knows_pairs: bool,
    improvement: Option<PlanImprovement<N>>,
    pub figures: SearchStatistics,
}

impl<'a, N: TaskNumber> Satisficer<'a, N> {
    /// Prepares the searches. Returns `None` if an operator has too many combinations of designs.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn new(context: Context<'a, N>) -> Result<Option<Self>, Interrupted> {
        let Some(context_data) = SearchContext::new(context)? else { return Ok(None) };
        Ok(Some(Self {
            known: context_data,
            limits: context.limits,
            phase: 0,
            search: None,
            cost: None,
            knows_pairs: false,
            improvement: None,
            figures: SearchStatistics::default(),
        }))
    }

    /// Returns the number of searches of the sequence that have ended or were skipped.
    pub fn restarts(&self) -> usize {
        self.phase
    }

    /// Returns `true` if all searches of the sequence have ended.
    pub fn has_ended(&self) -> bool {
        self.phase >= SEARCH_SEQUENCE.len()
    }

    /// Returns `true` if `improve` was called and its search has not ended.
    pub fn can_improve(&self) -> bool {
        self.improvement.as_ref().is_some_and(|improvement| !improvement.has_ended())
    }

    /// Searches for a plan with a cost below `limit` (for any plan if `None`), with about `work` work units.
    /// Evaluating a state takes one work unit for each node and each proposition of the delete relaxation;
    /// generating a state takes a constant number.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn run(&mut self, limit: Option<&N>, work: u64) -> Result<StepResult<N>, Interrupted> {
        let Some((priced, weight)) = SEARCH_SEQUENCE.get(self.phase).copied() else {
            return Ok(StepResult::Ended);
        };
        if !self.knows_pairs && self.figures.evaluated >= self.limits.thresholds().pairs {
            self.knows_pairs = true;
            self.known.set_pairs(MutexPairs::new(self.known.task, self.limits)?);
            // The h² mutexes change the preferred operators and the operator costs, so the current search
            // restarts.
            self.search = None;
        }
        let search = match &mut self.search {
            Some(search) => search,
            vacant => {
                let prices = self.known.prices(priced);
                vacant.insert(Search::new(&mut self.known, weight, prices, SearchGoal::Task))
            }
        };
        let is_last = self.phase.saturating_add(1) == SEARCH_SEQUENCE.len();
        // Except in the last search, the limit is the cost of the plan that these searches found last, even
        // if another component knows a cheaper plan. A search may then find a worse plan than the known one,
        // but it ends early, and the next search is less greedy. Finding a plan below `limit` would take
        // long.
        let own_limit = if is_last { limit } else { self.cost.as_ref() };
        let outcome = search.run(&mut self.known, own_limit, work, self.limits, &mut self.figures);
        let is_large = search.size() > self.limits.room() / MEMORY_SHARE;
        match outcome? {
            Outcome::Plan(plan) => {
                // The next call resumes the last search, which may find a cheaper plan.
                if !is_last {
                    self.next();
                }
                self.cost = Some(plan.cost.clone());
                let is_better = limit.is_none_or(|limit| plan.cost < *limit);
                Ok(if is_better { StepResult::Plan(plan) } else { StepResult::Paused })
            }
            Outcome::Exhausted if own_limit.is_none() && !search.incomplete => Ok(StepResult::Unsolvable),
            Outcome::Exhausted => {
                self.next();
                Ok(StepResult::Paused)
            }
            Outcome::Paused => {
                if is_large {
                    self.next();
                }
                Ok(StepResult::Paused)
            }
        }
    }

    /// Searches for a plan that is cheaper than `plan`, with about `work` work units, by replacing parts of
    /// the plan. If an earlier call has received or returned a plan that is at most as expensive as `plan`, its
    /// search is resumed. Returns `None` if no cheaper plan was found. Subtracts the work done from `work`.
    ///
    /// # Errors
    /// Fails if the deadline has passed or the interrupt flag is set.
    pub fn improve(
        &mut self,
        plan: &GroundPlan<N>,
        work: &mut u64,
    ) -> Result<Option<GroundPlan<N>>, Interrupted> {
        if self.improvement.as_ref().is_none_or(|improvement| plan.cost < *improvement.cost()) {
            self.improvement = PlanImprovement::new(&self.known, plan);
        }
        let Some(improvement) = &mut self.improvement else { return Ok(None) };
        improvement.run(&mut self.known, work, self.limits, &mut self.figures)
    }

    fn next(&mut self) {
        self.phase = self.phase.saturating_add(1);
        // With uniform operator costs, the greedy search with operator costs would repeat the first search.
        let is_uniform = || {
            let costs = self.known.operator_costs();
            costs.iter().all(|cost| Some(cost) == costs.first())
        };
        if SEARCH_SEQUENCE.get(self.phase) == Some(&(true, HeuristicWeight::Greedy)) && is_uniform() {
            self.phase = self.phase.saturating_add(1);
        }
        self.search = None;
    }
}
