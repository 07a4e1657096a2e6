//! Plans a mission: grounds it, optimises it, and executes each resulting plan with the validator.
//! Prints nothing.
//!
//! The command `metaplan plan` parses arguments, calls this module, and writes the output.

mod objectives;
mod planned;

use std::fmt;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use num_rational::BigRational;
use pddl::ast::Problem;
use planner::Task;

use crate::answers::Preparation;
use crate::knowledge::Knowledge;
use crate::message::{Errors, Message};
use crate::mission::numbers::missing_values;
use crate::mission::{Mission, Planning as _, Reading, Unconfirmed, blocking, confirm, lean};
use crate::planner::objectives::{Objectives, fault, unconfirmed};
use crate::planner::planned::Ground;
pub use crate::planner::planned::{Planned, PlannedFront};
pub use ::planner::{
    Alternatives, Backend, Config, Engine, Exact, Improvement, Limits, Plan, Point, Proof, Solution,
    Statistics, Status, Step, Strategy, alternatives, optimize, optimize_concurrent, optimize_exact,
};

type Stage<'a> = dyn FnMut(&str) + 'a;

type Report<'a> = dyn FnMut(&Improvement) -> ControlFlow<()> + 'a;

/// Plans a mission in its present situation.
///
/// ```
/// use std::path::Path;
/// use std::time::Duration;
/// use metaplan::planner::{Planner, Status};
/// use metaplan::setup::Setup;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut mission = Setup::read(Path::new("missions/ugv.toml"))?.mission;
/// mission.fail("c_kinect")?;
/// let planned = Planner::new(&mission)?.time_limit(Duration::from_secs(60)).plan()?;
/// assert_eq!(planned.solution.status, Status::Optimal);
/// for step in planned.solution.plan.iter().flat_map(|plan| &plan.steps) {
///     println!("{} {:?}", step.call(), step.configuration);
/// }
/// # Ok(())
/// # }
/// ```
pub struct Planner<'m, 'r> {
    mission: &'m Mission,
    problem: Problem,
    warnings: Vec<Message>,
    config: Config,
    minimize: Vec<String>,
    separation: Option<BigRational>,
    alternatives: Option<usize>,
    report: Box<Report<'r>>,
    stage: Box<Stage<'r>>,
}

impl<'m, 'r> Planner<'m, 'r> {
    /// Creates a planner for the mission's problem, filled with facts and values from the knowledge base. By default,
    /// the planner has no time limit and reports no improvements.
    ///
    /// # Errors
    /// Facts or values from the knowledge base do not fit the domain; M110 if the knowledge is inconsistent.
    pub fn new(mission: &'m Mission) -> Result<Self, Errors> {
        consistent(mission.knowledge())?;
        let (problem, warnings) = mission.filled()?;
        Ok(Self {
            mission,
            problem,
            warnings,
            config: Config::default(),
            minimize: Vec::new(),
            separation: None,
            alternatives: None,
            report: Box::new(|_| ControlFlow::Continue(())),
            stage: Box::new(|_| {}),
        })
    }

    /// Returns the warnings about the facts and values from the knowledge base.
    /// [`Mission::warnings`] returns the warnings about the mission's files.
    pub fn warnings(&self) -> &[Message] {
        &self.warnings
    }

    /// Sets the configuration of the optimizer, including its limits.
    #[must_use]
    pub fn config(mut self, config: Config) -> Self {
        self.config = config;
        self
    }

    /// Sets limits of time and memory. At a limit, planning ends with the best plan found.
    /// [`Limits::interrupt`] is a flag by which another thread can end planning.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.config.limits = limits;
        self
    }

    /// Sets a time limit that starts now and includes grounding. At the limit, planning ends with
    /// the best plan found.
    #[must_use]
    pub fn time_limit(self, time: Duration) -> Self {
        let limits = self.config.limits.clone().with_time(time);
        self.limits(limits)
    }

    /// Replaces the metric of the problem by objectives, the most important first. An objective is an
    /// expression as in a metric, or the name of a numeric function. Without objectives, the metric is kept.
    #[must_use]
    pub fn minimize(mut self, objectives: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.minimize = objectives.into_iter().map(Into::into).collect();
        self
    }

    /// Sets the least time between interfering starts and ends of actions, in the domain's time
    /// unit. Actions may then overlap as in PDDL 2.1. `None` keeps actions sequential.
    #[must_use]
    pub fn concurrent(mut self, separation: impl Into<Option<BigRational>>) -> Self {
        self.separation = separation.into();
        self
    }

    /// Requests up to `most` further plans of the optimal cost, or none if `most` is `None`. Requires sequential plans,
    /// the problem's own metric, and numbers that are not too large for integers (E304).
    #[must_use]
    pub fn alternatives(mut self, most: impl Into<Option<usize>>) -> Self {
        self.alternatives = most.into();
        self
    }

    /// Sets the callback for better plans and better bounds. If the callback returns `Break`, planning ends
    /// with the best plan found. The search in exact rationals, for numbers that are too large for integers,
    /// does not call it.
    #[must_use]
    pub fn on_improvement(mut self, report: impl FnMut(&Improvement) -> ControlFlow<()> + 'r) -> Self {
        self.report = Box::new(report);
        self
    }

    /// Sets the callback that is called before the search for alternatives (see [`Planner::alternatives`]). It
    /// receives a short description of this work.
    #[must_use]
    pub fn on_stage(mut self, stage: impl FnMut(&str) + 'r) -> Self {
        self.stage = Box::new(stage);
        self
    }

    /// Computes the best plan and executes it with the validator.
    ///
    /// # Errors
    /// - Constructs that the planner does not support, with their places
    /// - Faults of the objectives
    /// - M107 if the options exclude each other
    /// - A limit that was reached before the task was ground or the plan was validated
    /// - M170, a fault of the planner
    ///
    /// It is not an error if no plan is found or optimality is not proved: see [`Solution::status`].
    pub fn plan(self) -> Result<Planned<'m>, Errors> {
        let objectives = Objectives::read(self.mission, &self.problem, &self.minimize)?;
        let several = objectives.parsed.len() > 1;
        match (&self.separation, self.alternatives) {
            (Some(_), Some(_)) => Err(apart("plans whose actions overlap have no alternatives")),
            (None, Some(_)) if !self.minimize.is_empty() => Err(apart(
                "alternatives are plans with the problem's own metric, so there can be no objectives",
            )),
            (Some(_), None) if several => {
                Err(apart("plans whose actions overlap have one objective; add several with weights"))
            }
            (Some(separation), None) => {
                let separation = separation.clone();
                self.overlapping(objectives, &separation)
            }
            (None, _) => self.sequential(objectives),
        }
    }

    /// Computes the Pareto front of two objectives: one plan for each pair of values. The validator
    /// executes each plan. Objectives set by [`Planner::minimize`] are ignored.
    ///
    /// # Errors
    /// Errors of [`Planner::plan`].
    pub fn pareto(mut self, objectives: [&str; 2]) -> Result<PlannedFront<'m>, Errors> {
        if self.separation.is_some() || self.alternatives.is_some() {
            return Err(apart("a front has neither plans whose actions overlap nor alternatives"));
        }
        let objectives = objectives.map(str::to_owned);
        let objectives = Objectives::read(self.mission, &self.problem, &objectives)?;
        let began = Instant::now();
        let task = match self.mission.ground(&self.problem, &objectives.parsed, &self.config.limits) {
            Ok(task) => task,
            Err(refused) if is_too_large(&refused) => return Err(unless_omitted(refused, &["`--pareto`"])),
            Err(refused) => return Err(refused),
        };
        let preparation = Preparation { ground: began.elapsed(), ..Preparation::default() };
        let config = self.config.clone();
        let front = planner::pareto(&task, &config, &mut self.improvement_listener());
        let reading = Reading::sequential(task.is_timed());
        for point in &front.points {
            // A plan that the validator does not accept must not be returned.
            objectives.confirm(self.mission, &self.problem, point, &reading, &config.limits)?;
        }
        let Self { mission, problem, config, .. } = self;
        let limits = config.limits;
        Ok(PlannedFront { front, preparation, mission, problem, objectives, task, limits })
    }

    fn overlapping(
        mut self,
        objectives: Objectives,
        separation: &BigRational,
    ) -> Result<Planned<'m>, Errors> {
        let began = Instant::now();
        let limits = self.config.limits.clone();
        let task = self.mission.ground_concurrent(&self.problem, &objectives.parsed, separation, &limits)?;
        let ground = began.elapsed();
        let mut solution = optimize_concurrent(&task, &limits, &mut self.improvement_listener());
        let reading = Reading::concurrent(separation);
        if let Some(plan) = solution.plan.take() {
            let mut problem = self.problem.clone();
            let objective = objectives.parsed.first();
            problem.metric = objective.map(|objective| objective.metric.clone()).or(problem.metric);
            // The removal of superfluous actions may take half of the extended time, because the validation of the
            // plan follows.
            solution.plan = Some(lean(self.mission, &problem, plan, &reading, &limits.extended().half()));
        }
        let point = valued(solution, &objectives);
        let ground_task = Ground::Concurrent { not_minimised: task.not_minimised() };
        self.planned(point, objectives, ground_task, reading, ground)
    }

    fn sequential(mut self, objectives: Objectives) -> Result<Planned<'m>, Errors> {
        let began = Instant::now();
        let config = self.config.clone();
        let task = match self.mission.ground(&self.problem, &objectives.parsed, &config.limits) {
            Ok(task) => task,
            // Rationals of any size are slower, so integers are tried first.
            Err(refused) if is_too_large(&refused) => return self.exact(objectives, refused),
            Err(refused) => return Err(refused),
        };
        let ground = began.elapsed();
        let point = planner::lexicographic(&task, &config, &mut self.improvement_listener());
        let reading = Reading::sequential(task.is_timed());
        let alternatives = match self.alternatives {
            Some(limit) if point.solution.status == Status::Optimal => {
                (self.stage)("the plan is proved optimal; searching for other equally good plans");
                self.further_plans(&task, &point.solution, limit)?
            }
            _ => None,
        };
        let mut planned = self.planned(point, objectives, Ground::Integers(task), reading, ground)?;
        planned.alternatives = alternatives;
        // The explanation needs further planning, which is only useful after a proof.
        if planned.solution.status == Status::Unsolvable {
            planned.blocking = blocking(planned.mission, &planned.problem, &config);
            planned.missing_values = missing_values(planned.mission);
        }
        Ok(planned)
    }

    /// Plans by search alone, in exact rationals. `refused` are the messages about numbers that are
    /// too large for integers, and the error if the search in rationals does not support the request.
    fn exact(self, objectives: Objectives, refused: Errors) -> Result<Planned<'m>, Errors> {
        let unsupported = [
            (objectives.parsed.len() > 1, "a second objective"),
            (self.alternatives.is_some(), "`--alternatives`"),
            (self.config.engine == Engine::Sat, "`--engine sat`"),
            (self.config.confirm, "`--confirm`"),
        ];
        let unsupported = unsupported.into_iter().filter(|(is_requested, _)| *is_requested);
        let unsupported: Vec<&str> = unsupported.map(|(_, part)| part).collect();
        if !unsupported.is_empty() {
            return Err(unless_omitted(refused, &unsupported));
        }
        let began = Instant::now();
        let task = self.mission.ground_exact(&self.problem, &objectives.parsed, &self.config.limits)?;
        let ground = began.elapsed();
        let point = valued(optimize_exact(&task, &self.config), &objectives);
        let reading = Reading::sequential(task.is_timed());
        let mut planned = self.planned(point, objectives, Ground::Exact(task), reading, ground)?;
        planned.too_large = refused.into_vec();
        Ok(planned)
    }

    /// Computes further optimal plans, and executes each of them with the validator. Plans that are
    /// not validated within the limits are omitted. Returns `None` if the solution is not optimal,
    /// or if operator costs are only a part of its metric.
    fn further_plans(
        &self,
        task: &Task,
        solution: &Solution,
        limit: usize,
    ) -> Result<Option<Alternatives>, Errors> {
        // Building the result, and validating the plans, takes time that grows with that of the search.
        let config = self.config.clone().with_limits(self.config.limits.half());
        let Some(mut found) = alternatives(task, solution, limit, &config) else {
            return Ok(None);
        };
        let reading = Reading::sequential(task.is_timed());
        let limits = &self.config.limits;
        for index in 0..found.plans.len() {
            match confirm(self.mission, &self.problem, &found.plans[index], &reading, limits) {
                Ok(()) => {}
                Err(Unconfirmed::Interrupted) => {
                    // Plans that were not validated must not be returned.
                    found.plans.truncate(index);
                    found.complete = false;
                    break;
                }
                Err(reason) => return Err(unconfirmed(reason).into()),
            }
        }
        found.plans = found.plans.into_iter().map(|plan| self.mission.written(plan)).collect();
        Ok(Some(found))
    }

    fn planned(
        self,
        point: Point,
        objectives: Objectives,
        task: Ground,
        reading: Reading,
        ground: Duration,
    ) -> Result<Planned<'m>, Errors> {
        if let Some(reason) = &point.solution.statistics.contradiction {
            return Err(fault(reason).into());
        }
        let Self { mission, problem, config, .. } = self;
        objectives.confirm(mission, &problem, &point, &reading, &config.limits)?;
        let Point { solution, values } = point;
        Ok(Planned {
            solution,
            values,
            alternatives: None,
            blocking: None,
            missing_values: Vec::new(),
            too_large: Vec::new(),
            preparation: Preparation { ground, ..Preparation::default() },
            mission,
            problem,
            objectives,
            task,
            reading,
            limits: config.limits,
        })
    }

    fn improvement_listener(&mut self) -> impl FnMut(Improvement) {
        let flag = self.config.limits.interrupt();
        let report = &mut self.report;
        move |improvement| {
            if report(&improvement).is_break() {
                flag.store(true, Ordering::Relaxed);
            }
        }
    }
}

impl fmt::Debug for Planner<'_, '_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Planner")
            .field("mission", &self.mission.name)
            .field("config", &self.config)
            .field("minimize", &self.minimize)
            .field("separation", &self.separation)
            .field("alternatives", &self.alternatives)
            .finish_non_exhaustive()
    }
}

/// Checks that the knowledge base is consistent. Anything follows from an inconsistent one.
///
/// # Errors
/// M110 for each contradiction.
pub fn consistent(knowledge: Option<&Knowledge>) -> Result<(), Errors> {
    let contradictions = knowledge.map(Knowledge::contradictions).unwrap_or_default();
    Errors::unless_empty(contradictions.iter().map(|contradiction| {
        let text = format!(
            "the knowledge is inconsistent: {}: {}",
            contradiction.violated,
            contradiction.facts.join(", ")
        );
        Message::error("M110", text)
    }))
}

/// Returns `true` if integers are too small (E304) for the numbers of the task, and this is the
/// only fault.
fn is_too_large(messages: &[Message]) -> bool {
    !messages.is_empty() && messages.iter().all(|message| message.code == "E304")
}

fn unless_omitted(refused: Errors, unsupported: &[&str]) -> Errors {
    let unsupported = unsupported.join(" and ");
    let help =
        format!("without {unsupported}, planning uses exact rationals, which hold numbers of any size");
    refused.map(|message| message.with_help(help.clone()))
}

/// Converts a solution to a point. The cost of the plan is its only value, if there is a plan and
/// an objective replaces the metric.
fn valued(solution: Solution, objectives: &Objectives) -> Point {
    let cost = solution.plan.as_ref().map(|plan| plan.cost.clone());
    Point { values: cost.into_iter().filter(|_| !objectives.parsed.is_empty()).collect(), solution }
}

fn apart(text: &str) -> Errors {
    Message::error("M107", text).into()
}
