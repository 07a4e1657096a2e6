//! Plans for a mission: what is wanted in, plans that the validator has executed out, and nothing printed.
//!
//! This is what `metaplan plan` does between reading its arguments and writing its answer.

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

/// Callback that receives a short description of the work after the best plan is proved.
type Stage<'a> = dyn FnMut(&str) + 'a;

/// Hears of a better plan or a better bound.
type Report<'a> = dyn FnMut(&Improvement) -> ControlFlow<()> + 'a;

/// Plans for a mission in its present situation.
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
    /// Fills the problem with what the mission's knowledge base contributes. There are no limits, and nobody hears of improvements.
    ///
    /// # Errors
    /// What the knowledge base contributes does not fit the domain; or M110, the knowledge contradicts itself.
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

    /// What may be other than meant in the problem as it was filled; [`Mission::warnings`] are those of its files.
    pub fn warnings(&self) -> &[Message] {
        &self.warnings
    }

    /// What the optimizer is asked for, with its limits.
    #[must_use]
    pub fn config(mut self, config: Config) -> Self {
        self.config = config;
        self
    }

    /// When to stop with the best plan so far; [`Limits::interrupt`] is a flag that another thread can set.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.config.limits = limits;
        self
    }

    /// Gives the best plan so far after this long, counted from now, grounding included.
    #[must_use]
    pub fn time_limit(self, time: Duration) -> Self {
        let limits = self.config.limits.clone().with_time(time);
        self.limits(limits)
    }

    /// What plans are measured by, the most important first, in place of the metric of the problem: expressions as in a metric, or
    /// names of functions.
    #[must_use]
    pub fn minimize(mut self, objectives: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.minimize = objectives.into_iter().map(Into::into).collect();
        self
    }

    /// Actions may overlap, as PDDL 2.1 has it; those that interfere lie `separation` apart, in the domain's time unit.
    #[must_use]
    pub fn concurrent(mut self, separation: impl Into<Option<BigRational>>) -> Self {
        self.separation = separation.into();
        self
    }

    /// Also up to so many further plans that are as good as the best one. Actions follow one another, and there is one objective.
    #[must_use]
    pub fn alternatives(mut self, most: impl Into<Option<usize>>) -> Self {
        self.alternatives = most.into();
        self
    }

    /// Hears of every better plan and better bound; planning ends with the best plan so far when it says `Break`.
    #[must_use]
    pub fn on_improvement(mut self, report: impl FnMut(&Improvement) -> ControlFlow<()> + 'r) -> Self {
        self.report = Box::new(report);
        self
    }

    /// Sets the callback for work that follows the proof of the best plan. It receives a short description.
    #[must_use]
    pub fn on_stage(mut self, stage: impl FnMut(&str) + 'r) -> Self {
        self.stage = Box::new(stage);
        self
    }

    /// The best plan, executed by the validator.
    ///
    /// # Errors
    /// Every construct that the planner does not handle, with its place; what is wrong with an objective; M107, what is wanted does not go
    /// together; that a limit was reached before the task was ground; or M170, a fault of the planner. A plan that is not proved
    /// optimal, or none, is not an error: see [`Solution::status`].
    pub fn plan(self) -> Result<Planned<'m>, Errors> {
        let objectives = Objectives::read(self.mission, &self.problem, &self.minimize)?;
        let several = objectives.metrics.len() > 1;
        match (&self.separation, self.alternatives) {
            (Some(_), Some(_)) => Err(apart("plans whose actions overlap have no alternatives")),
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

    /// The plans of which no other one is better by one of two objectives and not worse by the other, one for each pair of values; each is
    /// executed by the validator. What [`Planner::minimize`] was told does not count.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn pareto(mut self, objectives: [&str; 2]) -> Result<PlannedFront<'m>, Errors> {
        if self.separation.is_some() || self.alternatives.is_some() {
            return Err(apart("a front has neither plans whose actions overlap nor alternatives"));
        }
        let objectives = objectives.map(str::to_owned);
        let objectives = Objectives::read(self.mission, &self.problem, &objectives)?;
        let began = Instant::now();
        let task = self.mission.ground(&self.problem, &objectives.metrics, &self.config.limits)?;
        let preparation = Preparation { ground: began.elapsed(), ..Preparation::default() };
        let config = self.config.clone();
        let front = planner::pareto(&task, &config, &mut self.hear());
        let reading = Reading::sequential(task.is_timed());
        for point in &front.points {
            objectives.confirm(self.mission, &self.problem, point, &reading, &config.limits)?;
        }
        let Self { mission, problem, .. } = self;
        Ok(PlannedFront { front, preparation, mission, problem, objectives: objectives.texts })
    }

    fn overlapping(
        mut self,
        objectives: Objectives,
        separation: &BigRational,
    ) -> Result<Planned<'m>, Errors> {
        let began = Instant::now();
        let limits = self.config.limits.clone();
        let task = self.mission.ground_concurrent(&self.problem, &objectives.metrics, separation, &limits)?;
        let ground = began.elapsed();
        let mut solution = optimize_concurrent(&task, &limits, &mut self.hear());
        let reading = Reading::concurrent(separation);
        if let Some(plan) = solution.plan.take() {
            let mut problem = self.problem.clone();
            problem.metric = objectives.metrics.first().cloned().or(problem.metric);
            solution.plan = Some(lean(self.mission, &problem, plan, &reading, &limits.extended().half()));
        }
        let point = valued(solution, &objectives);
        self.planned(point, objectives, Ground::Concurrent, reading, ground)
    }

    fn sequential(mut self, objectives: Objectives) -> Result<Planned<'m>, Errors> {
        let began = Instant::now();
        let config = self.config.clone();
        let task = match self.mission.ground(&self.problem, &objectives.metrics, &config.limits) {
            Ok(task) => task,
            Err(refused) if is_too_large(&refused) && self.alternatives.is_none() => {
                return self.exact(objectives, refused);
            }
            Err(refused) => return Err(refused),
        };
        let ground = began.elapsed();
        let point = planner::lexicographic(&task, &config, &mut self.hear());
        let reading = Reading::sequential(task.is_timed());
        let others = match self.alternatives {
            Some(most) => {
                (self.stage)("the plan is proved; other plans that are as good are looked for");
                self.others(&task, &point.solution, most)?
            }
            None => None,
        };
        let mut planned = self.planned(point, objectives, Ground::Integers(task), reading, ground)?;
        planned.alternatives = others;
        if planned.solution.status == Status::Unsolvable {
            planned.blocking = blocking(planned.mission, &planned.problem, &config);
            planned.missing_values = missing_values(planned.mission);
        }
        Ok(planned)
    }

    /// By search alone, in exact rationals.
    fn exact(self, objectives: Objectives, refused: Errors) -> Result<Planned<'m>, Errors> {
        if objectives.metrics.len() > 1 {
            return Err(refused);
        }
        let began = Instant::now();
        let task = self.mission.ground_exact(&self.problem, &objectives.metrics, &self.config.limits)?;
        let ground = began.elapsed();
        let point = valued(optimize_exact(&task, &self.config), &objectives);
        let reading = Reading::sequential(task.is_timed());
        let mut planned = self.planned(point, objectives, Ground::Exact(task), reading, ground)?;
        planned.too_large = refused.into_vec();
        Ok(planned)
    }

    /// Further plans; each is executed by the validator as the first one is.
    fn others(&self, task: &Task, solution: &Solution, most: usize) -> Result<Option<Alternatives>, Errors> {
        let Some(mut found) = alternatives(task, solution, most, &self.config) else {
            return Ok(None);
        };
        let reading = Reading::sequential(task.is_timed());
        let limits = &self.config.limits;
        for index in 0..found.plans.len() {
            match confirm(self.mission, &self.problem, &found.plans[index], &reading, limits) {
                Ok(()) => {}
                Err(Unconfirmed::Interrupted) => {
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

    /// An answer, once the validator has executed its plan.
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

/// Refuses knowledge that contradicts itself: anything follows from it.
///
/// # Errors
/// M110, each contradiction.
pub fn consistent(knowledge: Option<&Knowledge>) -> Result<(), Errors> {
    let contradictions = knowledge.map(Knowledge::contradictions).unwrap_or_default();
    Errors::unless_empty(contradictions.iter().map(|found| {
        let text = format!("the knowledge is inconsistent: {}: {}", found.violated, found.facts.join(", "));
        Message::error("M110", text)
    }))
}

/// Whether numbers that are too large are all that is wrong with a task.
fn is_too_large(messages: &[Message]) -> bool {
    !messages.is_empty() && messages.iter().all(|message| message.code == "E304")
}

/// A solution by the only objective, if there is one.
fn valued(solution: Solution, objectives: &Objectives) -> Point {
    let cost = solution.plan.as_ref().map(|plan| plan.cost.clone());
    Point { values: cost.into_iter().filter(|_| !objectives.metrics.is_empty()).collect(), solution }
}

/// What does not go together.
fn apart(text: &str) -> Errors {
    Message::error("M107", text).into()
}
