//! Queries and results of a replanner.

use num_rational::BigRational;

use pddl::ast::Problem;
use pddl::validate::Advance;
use task::limits::Limits;
use task::plan::Step;

/// The remaining part of a running action, with a configuration in which it can continue. A query lists such steps as
/// alternatives, and every plan begins with one of them. They are not operators of the task.
#[derive(Debug, Clone)]
pub struct FirstStep {
    /// Functions of the action, with the designs selected for them.
    pub configuration: Vec<(String, String)>,
    /// All arguments of the action. Among equally good plans, the plan whose arguments are declared first is
    /// selected.
    pub arguments: Vec<String>,
    /// Effects of the step.
    pub change: Advance,
    /// Metric of the mission if it ended after this step. Without a metric, the duration of the
    /// step or, without durative actions, 1.
    pub metric: BigRational,
}

/// A replanning query: the current situation and preferences for the plan.
#[derive(Debug)]
pub struct Query<'a> {
    /// Problem with the current state and availability. The problem must belong to the domain of the replanner and
    /// have passed the checks.
    pub problem: &'a Problem,
    /// Alternative first steps. If there are any, every plan must begin with one of them.
    pub first: &'a [FirstStep],
    /// Metric of the mission if it ended now; 0 without a metric.
    pub metric: BigRational,
    /// Current plan: names and arguments of its actions after the first step. If the plan is still valid, its
    /// metric is an upper bound for the search.
    pub old: Option<&'a [(String, Vec<String>)]>,
    /// `true` to select, among the best plans with the fewest steps, one that keeps as many steps of `old` as
    /// possible.
    pub stay_close: bool,
    /// Time and memory limits.
    pub limits: &'a Limits,
}

/// Result of replanning.
#[derive(Debug, Clone, PartialEq)]
pub enum ReplanOutcome {
    /// A plan that is proved optimal.
    Optimal {
        /// Index of the plan's first step in `Query::first`, if that list is not empty.
        first: Option<usize>,
        /// Steps after the first step.
        steps: Vec<Step>,
        /// Metric of the whole mission.
        metric: BigRational,
    },
    /// The time limit was reached, or planning was interrupted. Contains the best plan found, which may be
    /// the current plan.
    Feasible {
        /// Index of the plan's first step in `Query::first`, if that list is not empty.
        first: Option<usize>,
        /// Steps after the first step.
        steps: Vec<Step>,
        /// Metric of the whole mission.
        metric: BigRational,
    },
    /// It is proved that there is no plan. If the query has first steps, there is no plan that begins with one of
    /// them.
    Unsolvable,
    /// The problem differs from the grounded problem in more than state and availability, or the
    /// task cannot represent one of the first steps.
    Misfit,
    /// No result: the time limit was reached or planning was interrupted before a plan was known, a search
    /// reached its limit on states or memory, or the search does not support the task.
    Unknown,
}

/// Progress of the search for a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Metric of the mission with the best known plan, if there is one.
    pub metric: Option<BigRational>,
    /// Bound on the metric of every plan: a lower bound, or an upper bound if the metric is maximised.
    pub bound: BigRational,
}
