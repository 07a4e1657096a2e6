//! Plans that were found, and what can be made of them.

use std::path::Path;

use pddl::ast::Problem;
use planner::{Alternatives, Exact, ExactTask, Front, Limits, Plan, Solution, Task};

use crate::answers::{Objective, ParetoAnswer, PlanAnswer, Preparation};
use crate::certificate::{self, Contents};
use crate::message::Message;
use crate::mission::numbers::MissingValue;
use crate::mission::{Blocking, Mission, Planning as _, Reading, spaced};
use crate::planner::objectives::Objectives;
use crate::report::{Positions, Seen, front_sheet, plan_picture};

/// What a mission grounds to.
#[derive(Debug)]
pub(super) enum Ground {
    /// Steps one after another, in integers.
    Integers(Task),
    /// Steps one after another, in rationals of any size.
    Exact(ExactTask),
    /// Steps that overlap.
    Concurrent,
}

/// What was found for a mission.
#[derive(Debug)]
#[non_exhaustive]
pub struct Planned<'m> {
    /// The plan and what is proved of it. Its actions have all arguments of the mission's domain, those that the knowledge base has added
    /// to a plain one included; [`Planned::written`] is without them.
    pub solution: Solution,
    /// What the plan comes to by each objective; empty if there is no plan, or if the problem's own metric counts.
    pub values: Vec<Exact>,
    /// Further plans that are as good, if they were asked for and the plan is proved optimal.
    pub alternatives: Option<Alternatives>,
    /// Which designs keep the mission from having a plan, if it is proved that there is none.
    pub blocking: Option<Blocking>,
    /// If it is proved that there is no plan: numeric functions without a value that actions need.
    pub missing_values: Vec<MissingValue>,
    /// Why it was planned by search alone, in exact numbers; empty if it was not.
    pub too_large: Vec<Message>,
    /// How long things took before the search; that of reading is the caller's to add.
    pub preparation: Preparation,
    pub(super) mission: &'m Mission,
    pub(super) problem: Problem,
    pub(super) objectives: Objectives,
    pub(super) task: Ground,
    pub(super) reading: Reading,
    pub(super) limits: Limits,
}

/// A front of two objectives for a mission.
#[derive(Debug)]
#[non_exhaustive]
pub struct PlannedFront<'m> {
    /// The plans, best by the first objective to best by the second, with all arguments of the mission's domain.
    pub front: Front,
    /// How long things took before the search; that of reading is the caller's to add.
    pub preparation: Preparation,
    pub(super) mission: &'m Mission,
    pub(super) problem: Problem,
    pub(super) objectives: Vec<String>,
}

impl Planned<'_> {
    /// The objectives as they were given, in order; none for the problem's own metric.
    pub fn objectives(&self) -> &[String] {
        &self.objectives.texts
    }

    /// The problem as it was planned for: with what the knowledge base contributes.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Whether a limit of time or memory has been reached, or an interruption has been requested.
    pub fn is_at_limit(&self) -> bool {
        self.limits.reached()
    }

    /// Whether actions of the plan may overlap.
    pub fn overlaps(&self) -> bool {
        matches!(self.task, Ground::Concurrent)
    }

    /// The plan with the arguments that the domain's file gives its actions.
    pub fn written(&self) -> Option<Plan> {
        self.solution.plan.clone().map(|plan| self.mission.written(plan))
    }

    /// The plan with gaps between actions, as PlanSys2 asks for them, and otherwise as [`Planned::written`].
    pub fn spaced(&self) -> Option<Plan> {
        let plan = self.solution.plan.clone()?;
        let limits = self.limits.extended();
        Some(self.mission.written(spaced(self.mission, &self.problem, plan, &self.reading, &limits)))
    }

    /// The answer in the JSON format of `metaplan plan`.
    pub fn answer(&self) -> PlanAnswer {
        let mut solution = self.solution.clone();
        solution.plan = self.written();
        let makespan = solution.plan.as_ref().filter(|_| self.overlaps()).map(Plan::makespan);
        PlanAnswer::new(&self.mission.name, &solution, &self.preparation)
            .with_objectives(Objective::all(&self.objectives.texts, &self.values))
            .with_alternatives(self.alternatives.as_ref())
            .with_makespan(makespan.as_ref())
            .with_blocking(self.blocking.as_ref())
            .with_missing_values(&self.missing_values)
    }

    /// Writes all that is needed to check the answer into a directory that does not exist yet; `metaplan verify` checks it.
    ///
    /// # Errors
    /// The answer has no certificate, actions overlap, or the directory cannot be written.
    pub fn certify(&self, directory: &Path) -> Result<(), Message> {
        let task = match &self.task {
            Ground::Integers(task) => certificate::Ground::Integers(task),
            Ground::Exact(task) => certificate::Ground::Exact(task),
            Ground::Concurrent => {
                return Err(Message::error("M107", "plans whose actions overlap have no certificate"));
            }
        };
        let mut problem = self.problem.clone();
        if let [metric] = &self.objectives.metrics[..] {
            problem.metric = Some(metric.clone());
        }
        let plan = self.solution.plan.as_ref().map_or_else(String::new, Plan::to_string);
        let (mission, solution) = (self.mission, &self.solution);
        let contents = Contents { mission, problem: &problem, task, solution, plan: &plan };
        certificate::write(directory, &contents, &self.limits)
    }

    /// The plan as a picture.
    pub fn picture(&self, positions: &Positions) -> picture::Plan {
        let seen = Seen { mission: self.mission, problem: &self.problem, positions };
        plan_picture(seen, &self.solution)
    }
}

impl PlannedFront<'_> {
    /// The objectives as they were given.
    pub fn objectives(&self) -> &[String] {
        &self.objectives
    }

    /// The plans with the arguments that the domain's file gives their actions.
    pub fn written(&self) -> Front {
        let mut front = self.front.clone();
        for point in &mut front.points {
            point.solution.plan = point.solution.plan.take().map(|plan| self.mission.written(plan));
        }
        front
    }

    /// The answer in the JSON format of `metaplan plan --pareto`.
    pub fn answer(&self) -> ParetoAnswer {
        ParetoAnswer::new(&self.mission.name, &self.objectives, &self.written(), &self.preparation)
    }

    /// The front as a page to look at.
    pub fn sheet(&self, positions: &Positions) -> picture::Sheet {
        let seen = Seen { mission: self.mission, problem: &self.problem, positions };
        front_sheet(seen, &self.objectives, &self.front)
    }
}
