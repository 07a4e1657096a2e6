//! Random tasks against an oracle: which are refused with reason, and how many are proved.

use std::time::Duration;

use metaplan_planner::{Config, GroundConfig, Limits, Solution, Status, Thresholds, ground, optimize};
use pddl::ast::{Domain, Problem};

/// Limits with which, where others have their turns at once, everything else begins at once, too.
pub fn limits(head_start: usize) -> Limits {
    let thresholds = if head_start == 1 { Thresholds::NONE } else { Thresholds::default() };
    Limits::none().with_thresholds(thresholds)
}

/// Solution of a task. Returns `None` if the planner rejects the task, for which only `reason` is admitted.
pub fn solve(domain: &Domain, problem: &Problem, reason: &str) -> Option<Solution> {
    let task = match ground(domain, problem, &GroundConfig::default()) {
        Ok(task) => task,
        Err(errors) => {
            let is_known = |error: &metaplan_planner::Error| error.to_string().contains(reason);
            assert!(errors.iter().all(is_known), "{errors:?}\n{domain:?}\n{problem:?}");
            return None;
        }
    };
    let limits = Limits::none().with_time(Duration::from_secs(2));
    Some(optimize(&task, &Config::default().with_limits(limits), &mut |_| {}))
}

/// Number of tasks that were decided.
pub struct Tally {
    seeds: u64,
    proved: u64,
    unsolvable: u64,
}

impl Tally {
    /// Reads the number of seeds from `METAPLAN_SEEDS`; the default is 300.
    pub fn new() -> Self {
        let seeds = std::env::var("METAPLAN_SEEDS").map_or(300, |text| text.parse().expect("a number"));
        Self { seeds, proved: 0, unsolvable: 0 }
    }

    pub fn seeds(&self) -> std::ops::Range<u64> {
        0..self.seeds
    }

    pub fn count(&mut self, solution: &Solution) {
        self.proved += u64::from(solution.status == Status::Optimal);
        self.unsolvable += u64::from(solution.status == Status::Unsolvable);
    }

    /// Checks that the test is meaningful: a quarter of the tasks is proved optimal, and one in
    /// `one_in` unsolvable.
    pub fn check(&self, one_in: u64) {
        let Self { seeds, proved, unsolvable } = self;
        assert!(
            proved * 4 > *seeds && unsolvable * one_in > *seeds,
            "{proved} proved, {unsolvable} unsolvable"
        );
    }
}
