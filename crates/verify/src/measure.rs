//! What a plan is measured by, as the validator has it: its metric, or else its time or its length.

use num_rational::BigRational;
use pddl::ast::Problem;
use pddl::validate::Verdict;

/// The value of a valid plan of so many steps (waits are none). Without a metric it is the time where the task is
/// `timed` (as [`crate::task::same_task`] says), and the number of steps otherwise. None if the metric has no value after the plan.
pub fn measure(problem: &Problem, verdict: &Verdict, steps: usize, timed: bool) -> Option<BigRational> {
    match (&problem.metric, &verdict.metric) {
        (_, Some(metric)) => Some(metric.clone()),
        (Some(_), None) => None,
        (None, None) if timed => Some(verdict.total_time.clone()),
        (None, None) => Some(BigRational::from_integer(steps.into())),
    }
}
