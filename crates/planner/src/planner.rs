//! The builder `Planner`: computes a plan for a domain and a problem in one call.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use std::time::Duration;

use pddl::ast::{Domain, Metric, Problem};
use task::error::{Error, Errors};
use task::ground::{GroundConfig, ground};
use task::limits::Limits;
use task::plan::solution::{Improvement, Solution};

use crate::exact::{ground_exact, optimize_exact};
use crate::optimize::{Config, lexicographic};

/// Planning ends if the callback returns `Break`.
type Report<'a> = dyn FnMut(&Improvement) -> ControlFlow<()> + 'a;

/// Builder that computes plans for a domain and a problem. Both must have passed [`pddl::check()`], for
/// example as results of [`pddl::read`].
///
/// ```
/// use std::time::Duration;
/// use metaplan_planner::{Planner, Status};
/// use metaplan_planner::pddl::{Source, read};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let domain = Source::new("d.pddl", "(define (domain d) (:predicates (open))
///   (:action unlock :parameters () :effect (open)))");
/// let problem = Source::new("p.pddl", "(define (problem p) (:domain d) (:init) (:goal (open)))");
/// let (domain, problem, _warnings) = read(&domain, &problem)?;
///
/// let solution = Planner::new(&domain, &problem).time_limit(Duration::from_secs(10)).plan()?;
/// assert_eq!(solution.status, Status::Optimal);
/// assert_eq!(solution.plan.as_ref().unwrap().to_string(), "(unlock)\n");
/// println!("{solution}");
/// # Ok(())
/// # }
/// ```
pub struct Planner<'a> {
    domain: &'a Domain,
    problem: &'a Problem,
    grounding: GroundConfig,
    config: Config,
    report: Box<Report<'a>>,
}

impl<'a> Planner<'a> {
    /// Creates a planner with default options, without a time limit and without a callback. The memory limit of
    /// searches is 2 GiB.
    pub fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        let (grounding, config) = (GroundConfig::default(), Config::default());
        Self { domain, problem, grounding, config, report: Box::new(|_| ControlFlow::Continue(())) }
    }

    /// Sets a time limit, counted from now and including grounding. At the limit, the best known plan is returned;
    /// if grounding is not finished, an error.
    #[must_use]
    pub fn time_limit(self, time: Duration) -> Self {
        let limits = self.config.limits.clone().with_time(time);
        self.limits(limits)
    }

    /// Limits the memory of searches in bytes, according to their own estimates. The default is 2 GiB.
    #[must_use]
    pub fn memory_limit(self, bytes: usize) -> Self {
        let limits = self.config.limits.clone().with_room(bytes);
        self.limits(limits)
    }

    /// Sets the limits of grounding and search. Another thread can interrupt planning by setting the flag
    /// [`Limits::interrupt`].
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.grounding.limits = limits.clone();
        self.config.limits = limits;
        self
    }

    /// Sets the options of the optimizer. Their limits also become the limits of grounding.
    #[must_use]
    pub fn config(mut self, config: Config) -> Self {
        self.grounding.limits = config.limits.clone();
        self.config = config;
        self
    }

    /// Limits the number of steps of a plan.
    #[must_use]
    pub fn horizon(mut self, steps: usize) -> Self {
        self.config.horizon = Some(steps);
        self
    }

    /// Sets the objectives in lexicographic order, the most important first. They replace the metric of the
    /// problem. [`pddl::read_objective`] parses objectives.
    #[must_use]
    pub fn objectives(mut self, objectives: impl IntoIterator<Item = Metric>) -> Self {
        self.grounding.objectives = objectives.into_iter().collect();
        self
    }

    /// Calls `report` for better plans, for a plan that a search proves cheapest, and if the SAT solver raises the
    /// lower bound. With several objectives, there is one search for each objective, and costs and bounds are those
    /// under its objective. If `report` returns `Break`, the flag [`Limits::interrupt`] is set, and planning ends with
    /// the best known plan. `report` is not called if the task is solved in exact rationals (see [`Planner::plan`]),
    /// if actions can reduce the cost, or if only a part of the metric is minimised.
    #[must_use]
    pub fn on_improvement(mut self, report: impl FnMut(&Improvement) -> ControlFlow<()> + 'a) -> Self {
        self.report = Box::new(report);
        self
    }

    /// Computes a sequential plan that is, within the limits, lexicographically optimal: optimal by the first
    /// objective, among these plans optimal by the second, and so on. Numbers may have any size. If they
    /// overflow machine integers, the task is solved in exact rationals, which is slower and supports only
    /// one objective.
    ///
    /// # Errors
    /// Returns unsupported constructs with their source locations (of each action schema at least the first
    /// one), or an error if a number of the metric has no initial value, a limit is reached during grounding, or
    /// a task with several objectives overflows machine integers. It is not an error if a plan is not proved
    /// optimal or no plan is found: see [`Solution::status`].
    pub fn plan(mut self) -> Result<Solution, Errors> {
        match ground(self.domain, self.problem, &self.grounding) {
            Ok(task) => {
                let (config, mut hear) = (self.config.clone(), self.hear());
                Ok(lexicographic(&task, &config, &mut hear).solution)
            }
            // Exact rationals are useful only if overflows are the sole problem.
            Err(errors) if errors.iter().all(|error| matches!(error, Error::Overflow { .. })) => {
                if self.grounding.objectives.len() > 1 {
                    return Err(errors);
                }
                let task = ground_exact(self.domain, self.problem, &self.grounding)?;
                Ok(optimize_exact(&task, &self.config))
            }
            Err(errors) => Err(errors),
        }
    }

    fn hear(&mut self) -> impl FnMut(Improvement) {
        let flag = self.config.limits.interrupt();
        let report = &mut self.report;
        move |improvement| {
            if report(&improvement).is_break() {
                flag.store(true, Ordering::Relaxed);
            }
        }
    }
}

impl fmt::Debug for Planner<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Planner")
            .field("grounding", &self.grounding)
            .field("config", &self.config)
            .finish_non_exhaustive()
    }
}
