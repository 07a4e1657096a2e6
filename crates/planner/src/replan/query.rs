//! Queries and answers of a replanner.

use num_rational::BigRational;

use pddl::ast::Problem;
use pddl::validate::Advance;
use task::limits::Limits;
use task::plan::Step;

/// A step that a plan may begin with, independent of the task's operators: the remaining part of a
/// running action, with one of the configurations in which it can continue.
#[derive(Debug, Clone)]
pub struct FirstStep {
    /// Functions with the designs chosen for them.
    pub configuration: Vec<(String, String)>,
    /// All arguments. Among equally good plans, the one whose arguments are declared first is
    /// chosen.
    pub arguments: Vec<String>,
    /// Effects of the step.
    pub change: Advance,
    /// Metric of the mission if it ended with this step; 1 without a metric.
    pub metric: BigRational,
}

/// A replanning query.
#[derive(Debug)]
pub struct Query<'a> {
    /// Problem with the current state and availability; of the same domain, and checked.
    pub problem: &'a Problem,
    /// First steps. If there are any, plans begin with one of them.
    pub first: &'a [FirstStep],
    /// Metric of the mission if it ended now; 0 without a metric.
    pub metric: BigRational,
    /// Current plan: names and arguments of its actions after the first step. If it is still valid,
    /// more expensive plans are pruned.
    pub old: Option<&'a [(String, Vec<String>)]>,
    /// Whether, among equally good plans, one with most of these actions is chosen.
    pub stay_close: bool,
    /// Time and memory limits.
    pub limits: &'a Limits,
}

/// Result of replanning.
#[derive(Debug, Clone, PartialEq)]
pub enum ReplanOutcome {
    /// A plan that is proved optimal.
    Optimal {
        /// Index of the first step, if there were any.
        first: Option<usize>,
        /// Steps after the first step.
        steps: Vec<Step>,
        /// Metric of the whole mission.
        metric: BigRational,
    },
    /// A limit was reached; the best plan found, which may be the old one.
    Feasible {
        /// Index of the first step, if there were any.
        first: Option<usize>,
        /// Steps after the first step.
        steps: Vec<Step>,
        /// Metric of the whole mission.
        metric: BigRational,
    },
    /// Proof that there is no plan of any length.
    Unsolvable,
    /// The problem differs in more than state and availability.
    Misfit,
    /// A limit was reached before any plan was found.
    Unknown,
}

/// Progress of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Metric of the mission with the incumbent, if any.
    pub metric: Option<BigRational>,
    /// Bound on the metric of every plan.
    pub bound: BigRational,
}
