//! The builder `Planner`: from a domain and a problem to a plan in one call.

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
use crate::optimize::{Config, Front, lexicographic, pareto};

/// Callback for improved plans and bounds.
type Report<'a> = dyn FnMut(&Improvement) -> ControlFlow<()> + 'a;

/// Plans for a domain and a problem that have passed [`pddl::check()`]; those returned by
/// [`pddl::read`] have.
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
    /// Creates a planner without limits that reports nothing.
    pub fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        let (grounding, config) = (GroundConfig::default(), Config::default());
        Self { domain, problem, grounding, config, report: Box::new(|_| ControlFlow::Continue(())) }
    }

    /// Returns the incumbent after this time, counted from now and including grounding.
    #[must_use]
    pub fn time_limit(self, time: Duration) -> Self {
        let limits = self.config.limits.clone().with_time(time);
        self.limits(limits)
    }

    /// Limits the memory of searches, by their own estimates; the default is 2 GiB.
    #[must_use]
    pub fn memory_limit(self, bytes: usize) -> Self {
        let limits = self.config.limits.clone().with_room(bytes);
        self.limits(limits)
    }

    /// Sets the limits. [`Limits::interrupt`] is a flag that another thread can set.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.grounding.limits = limits.clone();
        self.config.limits = limits;
        self
    }

    /// Sets the options of the optimizer, including its limits.
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

    /// Sets the objectives, the most important first; they replace the metric of the problem.
    /// [`pddl::read_objective`] parses them.
    #[must_use]
    pub fn objectives(mut self, objectives: impl IntoIterator<Item = Metric>) -> Self {
        self.grounding.objectives = objectives.into_iter().collect();
        self
    }

    /// Calls `report` for every better plan and bound. If it returns `Break`, planning ends with
    /// the incumbent.
    #[must_use]
    pub fn on_improvement(mut self, report: impl FnMut(&Improvement) -> ControlFlow<()> + 'a) -> Self {
        self.report = Box::new(report);
        self
    }

    /// Computes a sequential plan, optimal by the first objective, among those by the second, and
    /// so on. Numbers may have any size: a task that overflows machine integers is solved in exact
    /// rationals, which is slower.
    ///
    /// # Errors
    /// Fails with every unsupported construct and its place, or if a limit is reached before the
    /// task is ground. A plan that is not proved optimal, or no plan, is not an error: see
    /// [`Solution::status`].
    pub fn plan(mut self) -> Result<Solution, Errors> {
        match ground(self.domain, self.problem, &self.grounding) {
            Ok(task) => {
                let (config, mut hear) = (self.config.clone(), self.hear());
                Ok(lexicographic(&task, &config, &mut hear).solution)
            }
            // Exact rationals can only help if machine integers are the sole problem.
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

    /// Computes the Pareto front of two objectives, with one plan for each pair of values.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn pareto(mut self) -> Result<Front, Errors> {
        let task = ground(self.domain, self.problem, &self.grounding)?;
        let (config, mut hear) = (self.config.clone(), self.hear());
        Ok(pareto(&task, &config, &mut hear))
    }

    /// Adapter from the optimizer's reports to the callback. Sets the interrupt flag if the
    /// callback breaks.
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
