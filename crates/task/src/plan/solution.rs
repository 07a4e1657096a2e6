//! Results of the planner: plan, status, proof and statistics.

use std::time::Duration;

use crate::plan::ground::GroundPlan;
use crate::plan::named_plan::{Exact, Plan};
use crate::words;

/// Quality of the result.
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
    /// A limit was reached without a result.
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

/// Justification of the status.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Proof {
    /// The formula for cheaper plans is unsatisfiable up to the step bound, and longer plans are
    /// not cheaper.
    Sat {
        /// Number of steps above which no plan is cheaper.
        step_bound: usize,
    },
    /// The cost of the plan equals a lower bound on the cost of all plans: the goal distance in a
    /// projection, or the sum of individual minimum costs.
    Bound,
    /// A* with an admissible heuristic has terminated; all pruned nodes are dominated.
    Search,
    /// The goal is unreachable in a relaxation or projection; contains the reason.
    Relaxation(String),
}

/// A better plan or a better lower bound.
#[derive(Debug, Clone)]
pub struct Improvement {
    /// Metric of the best known plan.
    pub cost: Exact,
    /// Lower bound on the metric of every plan.
    pub lower_bound: Exact,
    /// Number of steps of the current formula.
    pub horizon: usize,
}

impl Improvement {
    /// Relative gap between the plan and the bound: 0 for an optimal plan. Infinite or not a number
    /// if the metric is 0.
    pub fn gap(&self) -> f64 {
        let (cost, bound) = (self.cost.to_f64(), self.lower_bound.to_f64());
        if self.cost == self.lower_bound { 0.0 } else { (cost - bound).abs() / cost.abs() }
    }
}

/// Reason why a metric has no best value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MetricUnbounded {
    /// An action that improves the metric can be repeated forever in a state of the plan.
    Proved,
    /// Actions improve the metric, but it is not shown that they can be repeated forever.
    Suspected,
}

words! { MetricUnbounded, "reason": Proved = "proved", Suspected = "suspected" }

/// Component of the planner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannerPart {
    /// A\* with lower bounds.
    Search,
    /// Satisficing search with relaxed plans and landmarks.
    Satisficing,
    /// SAT solver.
    Sat,
}

words! { PlannerPart, "part of the planner": Search = "search", Satisficing = "satisficing", Sat = "sat" }

/// Progress of a run at a point in time.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Time since the start of the optimiser.
    pub time: Duration,
    /// Metric of the best known plan.
    pub cost: Option<Exact>,
    /// Lower bound on the metric of every plan.
    pub lower_bound: Exact,
}

/// Statistics of a run.
#[derive(Debug, Clone, Default)]
pub struct Statistics {
    /// Number of operators of the ground task.
    pub operators: usize,
    /// Number of variables of the largest formula.
    pub variables: usize,
    /// Number of clauses of the largest formula.
    pub clauses: usize,
    /// Number of clauses of the largest formula by family.
    pub families: Vec<(&'static str, usize)>,
    /// Number of clauses that the SAT solver has learnt, over all formulas.
    pub conflicts: u64,
    /// Number of calls of the SAT solver.
    pub calls: usize,
    /// Reason why a SAT solver stopped, other than a limit.
    pub failure: Option<String>,
    /// Contradiction between two components: a fault of the planner, for which no proof is claimed.
    pub contradiction: Option<String>,
    /// Name of the program on whose unchecked result the unsatisfiability of a formula rests.
    pub unchecked: Option<String>,
    /// Component that found the plan.
    pub found_by: Option<PlannerPart>,
    /// Number of expanded states, over all searches.
    pub expanded: u64,
    /// Number of generated successors.
    pub generated: u64,
    /// Number of evaluated states: new successors that are not dominated.
    pub evaluated: u64,
    /// Number of restarts of the satisficing search.
    pub restarts: usize,
    /// Better plans in chronological order, and bounds that increased by at least one percent.
    pub history: Vec<Moment>,
    /// Time of bounds and searches.
    pub search: Duration,
    /// Time of encoding.
    pub encode: Duration,
    /// Time of the SAT solver.
    pub solve: Duration,
}

/// Result of planning. `Display` writes the verdict and the plan, if there is one.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Quality of the plan.
    pub status: Status,
    /// The best plan.
    pub plan: Option<Plan>,
    pub ground: Option<GroundPlan>,
    /// Lower bound on the metric of every plan. `None` if the metric is unbounded or no bound is
    /// known.
    pub lower_bound: Option<Exact>,
    /// Number of steps up to which all plans were considered.
    pub horizon: usize,
    /// Justification of the status.
    pub proof: Option<Proof>,
    /// Set if the metric has no best value: the plan has the fewest steps, and among those the best
    /// metric.
    pub unbounded: Option<MetricUnbounded>,
    /// Statistics of the run.
    pub statistics: Statistics,
}
