//! Queries and answers of a replanner.

use num_rational::BigRational;

use pddl::ast::Problem;
use pddl::validate::Advance;
use task::limits::Limits;
use task::plan::Step;

/// A step that a plan may begin with, whatever the operators of the task are: what is left of an action under way, with one
/// of the configurations that it can go on with.
#[derive(Debug, Clone)]
pub struct FirstStep {
    /// The function and the design chosen for it.
    pub configuration: Vec<(String, String)>,
    /// All arguments; of plans that are as good the one whose arguments are declared first is chosen.
    pub arguments: Vec<String>,
    /// What the step changes.
    pub change: Advance,
    /// The metric of the mission if it ended with the step; without a metric, 1.
    pub metric: BigRational,
}

/// What is asked for.
#[derive(Debug)]
pub struct Query<'a> {
    /// With what is available now; of the same domain, and checked.
    pub problem: &'a Problem,
    /// If there are any, plans begin with one of them.
    pub first: &'a [FirstStep],
    /// The metric of the mission if it ended now; without a metric, 0.
    pub metric: BigRational,
    /// The plan at hand: names and arguments of its actions after the first step. If it is one still, nothing dearer is looked at.
    pub old: Option<&'a [(String, Vec<String>)]>,
    /// Whether of plans that are as good one with most of these actions is chosen.
    pub stay_close: bool,
    /// When to stop.
    pub limits: &'a Limits,
}

/// What planning has come to.
#[derive(Debug, Clone, PartialEq)]
pub enum ReplanOutcome {
    /// A plan; none has a better metric: proved.
    Optimal {
        /// Which of the first steps it begins with, if there were any.
        first: Option<usize>,
        /// The steps after that.
        steps: Vec<Step>,
        /// The metric of the whole mission.
        metric: BigRational,
    },
    /// A limit came first; the best plan known so far, which may be the old one.
    Feasible {
        /// Which of the first steps it begins with, if there were any.
        first: Option<usize>,
        /// The steps after that.
        steps: Vec<Step>,
        /// The metric of the whole mission.
        metric: BigRational,
    },
    /// There is no plan of any length: proved.
    Unsolvable,
    /// The problem differs in more than state and availability.
    Misfit,
    /// A limit came before any plan.
    Unknown,
}

/// How far a search for a plan is.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// The metric of the mission with the best plan so far, if there is one.
    pub metric: Option<BigRational>,
    /// No plan gives the mission a better metric.
    pub bound: BigRational,
}
