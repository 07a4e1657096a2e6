//! Statistics of random tasks that are compared with an oracle (how many are proved optimal or unsolvable), and
//! helpers for solving them.

use std::time::Duration;

use metaplan_planner::{Config, GroundConfig, Limits, Solution, Status, Thresholds, ground, optimize};
use pddl::ast::{Domain, Problem};

/// Returns limits for tests. With a head start of 1, all optional parts of the search are used from
/// the start.
pub fn limits(head_start: usize) -> Limits {
    let thresholds = if head_start == 1 { Thresholds::NONE } else { Thresholds::default() };
    Limits::none().with_thresholds(thresholds)
}

/// Checks with a time limit for each task. If too few tasks are decided, the machine may be slow, so the check is
/// repeated with ten times the limit.
pub fn with_enough_time(time: Duration, check: impl Fn(Duration) -> Result<(), String>) {
    let found = check(time).or_else(|_| check(time * 10));
    assert_eq!(found, Ok(()));
}

/// Solves a task. Returns `None` if the planner rejects the task; `reason` is the only admitted
/// reason. If the task is known to have a plan, there is more time for finding one.
pub fn solve(domain: &Domain, problem: &Problem, reason: &str, has_plan: bool) -> Option<Solution> {
    let task = match ground(domain, problem, &GroundConfig::default()) {
        Ok(task) => task,
        Err(errors) => {
            let is_known = |error: &metaplan_planner::Error| error.to_string().contains(reason);
            assert!(errors.iter().all(is_known), "{errors:?}\n{domain:?}\n{problem:?}");
            return None;
        }
    };
    let within = |seconds| {
        let limits = Limits::none().with_time(Duration::from_secs(seconds));
        optimize(&task, &Config::default().with_limits(limits), &mut |_| {})
    };
    let solution = within(2);
    Some(if has_plan && solution.plan.is_none() { within(60) } else { solution })
}

pub struct Tally {
    seeds: u64,
    proved: u64,
    unsolvable: u64,
}

impl Tally {
    /// The number of seeds is read from `METAPLAN_SEEDS`; the default is 300.
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

    /// More than a quarter of the tasks must be proved optimal, and more than one in `one_in` tasks
    /// unsolvable.
    pub fn check(&self, one_in: u64) {
        let Self { seeds, proved, unsolvable } = self;
        assert!(
            proved * 4 > *seeds && unsolvable * one_in > *seeds,
            "{proved} proved, {unsolvable} unsolvable"
        );
    }
}
