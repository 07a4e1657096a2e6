//! Summarises a solution in one sentence: its status and the reason for it.

use std::fmt;

use crate::plan::solution::{MetricUnbounded, Proof, Solution, Status};

impl Solution {
    /// Returns the status of the solution and its justification: a sentence without a full stop, or two lines
    /// if the metric may have no best value.
    pub fn verdict(&self) -> String {
        verdict(self)
    }
}

impl fmt::Display for Solution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.verdict())?;
        self.plan.iter().try_for_each(|plan| write!(f, "\n{plan}"))
    }
}

fn verdict(solution: &Solution) -> String {
    let horizon = solution.horizon;
    let program = solution.statistics.unchecked.as_ref();
    let proved =
        program.map_or("proved".to_owned(), |program| format!("according to `{program}`, not checked"));
    match (solution.status, &solution.proof, solution.unbounded) {
        (Status::Optimal, Some(Proof::Sat { step_bound }), _) => format!(
            "optimal, {proved}: no plan of up to {} is cheaper (unsatisfiable), and no longer plan can be cheaper",
            steps(*step_bound)
        ),
        (Status::Optimal, Some(Proof::Bound), _) => {
            "optimal, proved: the cost equals a lower bound on the cost of all plans".to_owned()
        }
        (Status::Optimal, _, _) => {
            "optimal, proved: the search left out only states that are dominated or too expensive".to_owned()
        }
        (Status::Feasible, proof, Some(unbounded)) => {
            let why = match unbounded {
                MetricUnbounded::Proved => {
                    "the metric has no best value: an action that improves it can be repeated without limit"
                }
                MetricUnbounded::Suspected => "the metric may have no best value: actions improve it",
            };
            let reading = if proof.is_some() { "proved best" } else { "best found" };
            format!(
                "{why}\nbounded reading: fewest steps first, then the metric; {reading} among plans of {horizon} steps"
            )
        }
        (Status::Feasible, _, None) if horizon == 0 => "a plan, not proved optimal".to_owned(),
        (Status::Feasible, _, None) => {
            format!("a plan, not proved optimal (plans of up to {} considered)", steps(horizon))
        }
        (Status::Unsolvable, Some(Proof::Relaxation(reason)), _) => {
            format!("no plan exists, proved: {reason}")
        }
        (Status::Unsolvable, Some(Proof::Sat { step_bound }), _) => format!(
            "no plan exists, {proved}: there is none of up to {} (unsatisfiable), and a shortest plan has no \
             more steps",
            steps(*step_bound)
        ),
        (Status::Unsolvable, _, _) => {
            "no plan exists, proved: every reachable state was visited or is dominated".to_owned()
        }
        (Status::UnsolvableWithinHorizon, _, _) => {
            format!("no plan with up to {}, {proved}; longer plans were not considered", steps(horizon))
        }
        (Status::Unknown, _, _) => {
            // A failed solver is named separately.
            let reason = match solution.statistics.failure {
                Some(_) => "no plan was found, and its absence is not proved",
                None => "a limit was reached before a plan was found",
            };
            match &solution.lower_bound {
                Some(bound) => format!("{reason}; no plan has a better metric than {bound}"),
                None if solution.statistics.failure.is_some() => reason.to_owned(),
                None => format!("{reason}; nothing is proved"),
            }
        }
    }
}

fn steps(count: usize) -> String {
    if count == 1 { "1 step".to_owned() } else { format!("{count} steps") }
}
