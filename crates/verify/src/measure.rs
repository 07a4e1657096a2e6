//! The value of a plan according to the validator: its metric if the problem has one, otherwise its
//! duration or its length.

use num_rational::BigRational;
use pddl::ast::Problem;
use pddl::validate::Verdict;

/// Returns the value of a valid plan; `steps` is its number of steps without waits. Without a
/// metric, the value is the total time if the task is `timed` (see [`crate::task::same_task`]),
/// otherwise the number of steps. Returns `None` if the metric is undefined after the plan.
pub fn measure(problem: &Problem, verdict: &Verdict, steps: usize, timed: bool) -> Option<BigRational> {
    match (&problem.metric, &verdict.metric) {
        (_, Some(metric)) => Some(metric.clone()),
        (Some(_), None) => None,
        (None, None) if timed => Some(verdict.total_time.clone()),
        (None, None) => Some(BigRational::from_integer(steps.into())),
    }
}
