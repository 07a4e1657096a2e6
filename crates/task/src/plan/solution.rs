//! Results of the planner: plan, status, proof and statistics.

use std::time::Duration;

use crate::plan::ground::GroundPlan;
use crate::plan::named_plan::{Exact, Plan};
use crate::words;

/// Status of a planning result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The plan is proved optimal.
    Optimal,
    /// The plan is not proved optimal.
    Feasible,
    /// It is proved that no plan exists.
    Unsolvable,
    /// It is proved that no plan exists within the requested number of steps.
    UnsolvableWithinHorizon,
    /// No plan is returned and unsolvability is not proved, usually because a limit was reached.
    Unknown,
}

words! {
    Status, "status":
    Optimal = "optimal",
    Feasible = "feasible",
    Unsolvable = "unsolvable",
    UnsolvableWithinHorizon = "unsolvable_within_horizon",
    Unknown = "unknown",
}

/// Justification of an optimality or unsolvability claim.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Proof {
    /// The formula for plans of up to `step_bound` steps (cheaper than the known plan, if there is one) is
    /// unsatisfiable, and longer plans need not be considered.
    Sat {
        /// Upper bound on the number of steps of a plan that is cheaper than the known plan or, if there is no plan,
        /// of a shortest plan. If [`Solution::unbounded`] is set, the fewest steps of a plan.
        step_bound: usize,
    },
    /// The cost of the plan equals a lower bound on the cost of all plans, for example the goal distance in a
    /// projection.
    Bound,
    /// An exact search, for example A\* with an admissible heuristic, has terminated, or its lower bound has reached
    /// the cost of the plan. Its pruning preserves at least one optimal plan, if there is a plan.
    Search,
    /// The goal is found to be unreachable before the search, for example in a relaxation or projection of the task.
    /// The text describes the reason.
    Relaxation(String),
}

/// Progress report of the optimiser: the best known plan and the lower bound.
#[derive(Debug, Clone)]
pub struct Improvement {
    /// Metric of the best known plan.
    pub cost: Exact,
    /// Bound on the metric: no plan has a better value.
    pub lower_bound: Exact,
    /// Number of steps of the current SAT formula or of the best known plan. For a concurrent plan, the number of its
    /// happenings or, if durations are chosen, of its actions.
    pub horizon: usize,
}

impl Improvement {
    /// Returns the distance between the metric and the lower bound, divided by the absolute value of the
    /// metric. The result is 0 if both are equal, and infinite if the metric is 0 but the bound is not.
    pub fn gap(&self) -> f64 {
        let (cost, bound) = (self.cost.to_f64(), self.lower_bound.to_f64());
        if self.cost == self.lower_bound { 0.0 } else { (cost - bound).abs() / cost.abs() }
    }
}

/// Reason why a metric may have no best value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MetricUnbounded {
    /// An action that improves the metric can be repeated forever in a state of the plan.
    Proved,
    /// Actions improve the metric, but it is not shown that they can be repeated forever.
    Suspected,
}

words! { MetricUnbounded, "reason": Proved = "proved", Suspected = "suspected" }

/// Component of the planner that can find a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannerPart {
    /// Exact search, for example A\* with lower bounds.
    Search,
    /// Satisficing search, for example with relaxed plans and landmarks.
    Satisficing,
    /// SAT-based planning.
    Sat,
}

words! { PlannerPart, "part of the planner": Search = "search", Satisficing = "satisficing", Sat = "sat" }

/// Best plan and lower bound at a point in time.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Time since the start of the optimiser.
    pub time: Duration,
    /// Metric of the best known plan; `None` before a plan is found.
    pub cost: Option<Exact>,
    /// Bound on the metric: no plan has a better value.
    pub lower_bound: Exact,
}

/// Statistics of a run.
#[derive(Debug, Clone, Default)]
pub struct Statistics {
    /// Number of operators of the ground task.
    pub operators: usize,
    /// Number of variables of the largest SAT formula.
    pub variables: usize,
    /// Number of clauses of the largest SAT formula.
    pub clauses: usize,
    /// Number of clauses of the largest SAT formula for each clause family.
    pub families: Vec<(&'static str, usize)>,
    /// Number of conflicts of the SAT solver over all formulas; each conflict yields a learnt clause.
    pub conflicts: u64,
    /// Number of calls of the SAT solver.
    pub calls: usize,
    /// Reason, other than a limit, why a SAT solver stopped without a result.
    pub failure: Option<String>,
    /// Contradiction between the results of two components. This is a bug of the planner, and no proof is
    /// claimed.
    pub contradiction: Option<String>,
    /// Command line of an external program that reported a formula as unsatisfiable without a checked proof.
    pub unchecked: Option<String>,
    /// Component that found the plan, if this was recorded.
    pub found_by: Option<PlannerPart>,
    /// Number of expanded states, over all searches that report it.
    pub expanded: u64,
    /// Number of generated successors.
    pub generated: u64,
    /// Number of states for which a heuristic was evaluated.
    pub evaluated: u64,
    /// Number of restarts of incomplete searches.
    pub restarts: usize,
    /// Better plans and considerably higher lower bounds in chronological order.
    pub history: Vec<Moment>,
    /// Time spent on lower bounds and searches.
    pub search: Duration,
    /// Time spent on encoding SAT formulas.
    pub encode: Duration,
    /// Time spent in the SAT solver.
    pub solve: Duration,
}

/// Result of planning. `Display` writes the verdict and, if there is one, the plan.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Status of the result.
    pub status: Status,
    /// The best plan found, if any.
    pub plan: Option<Plan>,
    /// The best plan over ground operators. `None` without a plan, and for tasks in rationals and concurrent tasks.
    pub ground: Option<GroundPlan>,
    /// Bound on the metric: no plan has a better value. `None` if the metric may be unbounded or no bound is
    /// known.
    pub lower_bound: Option<Exact>,
    /// Number of steps up to which better plans are excluded; 0 if no such number was determined. For an optimal
    /// plan, at least its number of steps. If `unbounded` is set, the number of steps of the plan.
    pub horizon: usize,
    /// Justification of the status.
    pub proof: Option<Proof>,
    /// Set if the metric may have no best value and the plan is therefore one with the fewest steps. It has the best
    /// metric that was found among plans with this number of steps.
    pub unbounded: Option<MetricUnbounded>,
    /// Statistics of the run.
    pub statistics: Statistics,
}
