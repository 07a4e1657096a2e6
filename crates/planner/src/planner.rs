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

/// Hears of a better plan or a better bound.
type Report<'a> = dyn FnMut(&Improvement) -> ControlFlow<()> + 'a;

/// Plans for a domain and a problem that have passed [`pddl::check()`], as those that [`pddl::read`] returns have.
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
    /// With no limits, and silent.
    pub fn new(domain: &'a Domain, problem: &'a Problem) -> Self {
        let (grounding, config) = (GroundConfig::default(), Config::default());
        Self { domain, problem, grounding, config, report: Box::new(|_| ControlFlow::Continue(())) }
    }

    /// Gives the best plan so far after this long, counted from now, grounding included.
    #[must_use]
    pub fn time_limit(self, time: Duration) -> Self {
        let limits = self.config.limits.clone().with_time(time);
        self.limits(limits)
    }

    /// Lets searches store so many bytes, as they estimate them; 2 GiB unless said otherwise.
    #[must_use]
    pub fn memory_limit(self, bytes: usize) -> Self {
        let limits = self.config.limits.clone().with_room(bytes);
        self.limits(limits)
    }

    /// When to stop; [`Limits::interrupt`] is a flag that another thread can set.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.grounding.limits = limits.clone();
        self.config.limits = limits;
        self
    }

    /// What the optimizer is asked for, with its limits.
    #[must_use]
    pub fn config(mut self, config: Config) -> Self {
        self.grounding.limits = config.limits.clone();
        self.config = config;
        self
    }

    /// Only plans with at most this many steps count.
    #[must_use]
    pub fn horizon(mut self, steps: usize) -> Self {
        self.config.horizon = Some(steps);
        self
    }

    /// What plans are measured by, the most important first, in place of the metric of the problem; [`pddl::read_objective`]
    /// makes them.
    #[must_use]
    pub fn objectives(mut self, objectives: impl IntoIterator<Item = Metric>) -> Self {
        self.grounding.objectives = objectives.into_iter().collect();
        self
    }

    /// Hears of every better plan and better bound; planning ends with the best plan so far when it says `Break`.
    #[must_use]
    pub fn on_improvement(mut self, report: impl FnMut(&Improvement) -> ControlFlow<()> + 'a) -> Self {
        self.report = Box::new(report);
        self
    }

    /// A plan whose actions come one after the other, best by the first objective, of those best by the second, and so on. Numbers
    /// may be of any size: what does not fit into machine integers is searched for in exact rationals, which takes longer.
    ///
    /// # Errors
    /// Every construct that the planner does not handle, with its place; or that a limit was reached before the task was ground. A
    /// plan that is not proved optimal, or none, is not an error: see [`Solution::status`].
    pub fn plan(mut self) -> Result<Solution, Errors> {
        match ground(self.domain, self.problem, &self.grounding) {
            Ok(task) => {
                let (config, mut hear) = (self.config.clone(), self.hear());
                Ok(lexicographic(&task, &config, &mut hear).solution)
            }
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

    /// The plans of which no other one is better by one of two objectives and not worse by the other, one for each pair of values.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn pareto(mut self) -> Result<Front, Errors> {
        let task = ground(self.domain, self.problem, &self.grounding)?;
        let (config, mut hear) = (self.config.clone(), self.hear());
        Ok(pareto(&task, &config, &mut hear))
    }

    /// What the optimizer tells, to who listens; the flag is set when that wants to end.
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
