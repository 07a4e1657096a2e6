//! Solutions of the optimizer: plan, status, proof and statistics.

use std::time::Duration;

use crate::plan::ground::GroundPlan;
use crate::plan::named_plan::{Exact, Plan};
use crate::words;

/// How good the answer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// No plan of any length has a better metric: proved.
    Optimal,
    /// There is a plan; that it is optimal is not proved.
    Feasible,
    /// There is no plan of any length: proved.
    Unsolvable,
    /// There is no plan with at most as many steps as asked for: proved.
    UnsolvableWithinHorizon,
    /// A limit was reached before anything was known.
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

/// Why the status is what it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Proof {
    /// The formula for cheaper plans is unsatisfiable up to the step bound, and no longer plan is cheaper.
    Sat {
        /// No plan with more steps can be cheaper.
        step_bound: usize,
    },
    /// The cost of the plan equals a lower bound on the cost of all plans, by the cost to go in a projection, or by what each action takes and costs by itself.
    Bound,
    /// A* with an admissible estimate ended; all that it left out is dominated.
    Search,
    /// Relaxed or projected, the goal is out of reach: the reason in words.
    Relaxation(String),
}

/// A better plan was found, or a better lower bound.
#[derive(Debug, Clone)]
pub struct Improvement {
    /// The metric of the best plan so far.
    pub cost: Exact,
    /// No plan has a better metric than this.
    pub lower_bound: Exact,
    /// Steps of the formula at hand.
    pub horizon: usize,
}

impl Improvement {
    /// How far the bound is from the plan, as a part of the plan's metric: 0 if the plan is proved optimal. Infinite or not a number
    /// where that metric is 0.
    pub fn gap(&self) -> f64 {
        let (cost, bound) = (self.cost.to_f64(), self.lower_bound.to_f64());
        if self.cost == self.lower_bound { 0.0 } else { (cost - bound).abs() / cost.abs() }
    }
}

/// A metric that has no best value, or none that is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MetricUnbounded {
    /// An action that improves the metric can be repeated for ever in a state that the plan passes.
    Proved,
    /// Actions improve the metric; that they can be repeated for ever is not shown.
    Suspected,
}

words! { MetricUnbounded, "reason": Proved = "proved", Suspected = "suspected" }

/// A part of the planner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannerPart {
    /// A\* with lower bounds.
    Search,
    /// Search by relaxed plans and landmarks, for a plan soon.
    Satisficing,
    /// The SAT solver.
    Sat,
}

words! { PlannerPart, "part of the planner": Search = "search", Satisficing = "satisficing", Sat = "sat" }

/// What was known at some time of a run.
#[derive(Debug, Clone)]
pub struct Moment {
    /// Since the optimizer has begun.
    pub time: Duration,
    /// The metric of the best plan so far.
    pub cost: Option<Exact>,
    /// No plan has a better metric than this.
    pub lower_bound: Exact,
}

/// Figures of a run.
#[derive(Debug, Clone, Default)]
pub struct Statistics {
    /// Operators of the ground task.
    pub operators: usize,
    /// Variables of the largest formula.
    pub variables: usize,
    /// Clauses of that formula.
    pub clauses: usize,
    /// Clauses of that formula by family.
    pub families: Vec<(&'static str, usize)>,
    /// Clauses learnt by the SAT solver, over all formulas.
    pub conflicts: u64,
    /// Calls of the SAT solver.
    pub calls: usize,
    /// Why a SAT solver gave up, if not at a limit.
    pub failure: Option<String>,
    /// Two parts of the planner contradict each other: a fault of ours, and nothing is claimed to be proved.
    pub contradiction: Option<String>,
    /// The program by whose word alone a formula has no model, if the answer rests on that: its refutation was not checked.
    pub unchecked: Option<String>,
    /// What found the plan.
    pub found_by: Option<PlannerPart>,
    /// States whose successors were looked at, by all searches.
    pub expanded: u64,
    /// Successors that these have.
    pub generated: u64,
    /// States that were estimated: successors that were new, and not dominated.
    pub evaluated: u64,
    /// How often the search for a plan soon has begun anew, to find a better one.
    pub restarts: usize,
    /// Better plans in the order of their times, and bounds that had risen by a hundredth.
    pub history: Vec<Moment>,
    /// Time for bounds and searches.
    pub search: Duration,
    /// Time for building formulas.
    pub encode: Duration,
    /// Time in the SAT solver.
    pub solve: Duration,
}

/// The answer. Shown by `Display` it is its verdict, and the plan if there is one.
#[derive(Debug, Clone)]
pub struct Solution {
    /// How good the plan is.
    pub status: Status,
    /// The best plan.
    pub plan: Option<Plan>,
    pub ground: Option<GroundPlan>,
    /// No plan has a better metric; none if the metric is unbounded or nothing is known.
    pub lower_bound: Option<Exact>,
    /// Steps up to which all plans were considered.
    pub horizon: usize,
    /// The reason for the status.
    pub proof: Option<Proof>,
    /// Set if the metric has no best value: the plan has fewest steps, and of those the best metric.
    pub unbounded: Option<MetricUnbounded>,
    /// Figures.
    pub statistics: Statistics,
}
