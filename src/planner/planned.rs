//! Results of planning a mission, and their conversion to answers, certificates and pictures.

use std::collections::HashSet;
use std::path::Path;

use pddl::ast::{Action, ActionBody, Effect, EffectTime, Name, Problem};
use pddl::visit::Node;
use planner::{Alternatives, Exact, ExactTask, Front, Limits, Plan, Solution, Status, Step, Task};

use crate::answers::{Objective, ParetoAnswer, PlanAnswer, Preparation};
use crate::certificate::{self, Contents};
use crate::message::Message;
use crate::mission::numbers::MissingValue;
use crate::mission::{Blocking, Mission, Planning as _, Reading, spaced};
use crate::planner::objectives::Objectives;
use crate::report::{Positions, Seen, front_sheet, plan_picture};

/// Ground task. Tasks of sequential plans are retained for certificates.
#[derive(Debug)]
pub(super) enum Ground {
    Integers(Task),
    Exact(ExactTask),
    /// Actions overlap. The metric's fluents in `not_minimised` were not minimised.
    Concurrent {
        not_minimised: Vec<String>,
    },
}

/// Result of planning a mission.
#[derive(Debug)]
#[non_exhaustive]
pub struct Planned<'m> {
    /// The plan and its proved properties. Steps have all arguments, including designs that the
    /// knowledge base has added as parameters to a plain domain; [`Planned::written`] omits these
    /// arguments.
    pub solution: Solution,
    /// Value of the plan under each objective that replaces the problem's metric. Without such objectives, the
    /// list is empty or contains only the cost of the plan. Empty if there is no plan.
    pub values: Vec<Exact>,
    /// Further optimal plans, if requested. `None` if the plan is not proved optimal, or if operator
    /// costs are only a part of its metric.
    pub alternatives: Option<Alternatives>,
    /// If the mission is proved unsolvable: unavailable designs that prevent a plan, or the
    /// information that designs are not the reason. `None` if this is not decided within the
    /// limits. Always `None` without a knowledge base, for overlapping actions, and for numbers
    /// that are too large for integers.
    pub blocking: Option<Blocking>,
    /// If the mission is proved unsolvable: numeric functions that actions need and that have no value. If some
    /// of them are probable mistakes or have no value for any arguments, only these. Always empty for
    /// overlapping actions, and for numbers that are too large for integers.
    pub missing_values: Vec<MissingValue>,
    /// Messages about numbers that are too large for integers. If there are any, planning used only
    /// search in exact rationals.
    pub too_large: Vec<Message>,
    /// Running times of the stages before the search. The caller adds the time for reading files.
    pub preparation: Preparation,
    pub(super) mission: &'m Mission,
    pub(super) problem: Problem,
    pub(super) objectives: Objectives,
    pub(super) task: Ground,
    pub(super) reading: Reading,
    pub(super) limits: Limits,
}

/// Pareto front of two objectives for a mission.
#[derive(Debug)]
#[non_exhaustive]
pub struct PlannedFront<'m> {
    /// The front. Its plans have all arguments of the mission's domain, and are sorted from the
    /// best by the first objective to the best by the second.
    pub front: Front,
    /// Running times of the stages before the search. The caller adds the time for reading files.
    pub preparation: Preparation,
    pub(super) mission: &'m Mission,
    pub(super) problem: Problem,
    pub(super) objectives: Objectives,
    pub(super) task: Task,
    pub(super) limits: Limits,
}

impl Planned<'_> {
    /// Returns the objectives as the caller wrote them, the most important first. Empty if the
    /// problem's own metric is minimised.
    pub fn objectives(&self) -> &[String] {
        &self.objectives.texts
    }

    /// Returns the planned problem, including the facts and values from the knowledge base.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Returns `true` if a time or memory limit has been reached, or if an interruption has been
    /// requested.
    pub fn is_at_limit(&self) -> bool {
        self.limits.reached()
    }

    /// Returns, in PDDL, the numeric fluents of the metric that the search did not minimise. Actions change them by
    /// amounts that depend on the state. The search does not minimise such fluents if an action may improve the metric,
    /// if it uses only the SAT solver, or if actions overlap.
    pub fn not_minimised(&self) -> Vec<String> {
        // The solution has a lower bound if the search minimises the whole metric.
        if self.solution.lower_bound.is_some() || self.solution.status != Status::Feasible {
            return Vec::new();
        }
        let (fluents, names) = match &self.task {
            Ground::Integers(task) => (&task.objective.rest, &task.number_names),
            Ground::Exact(ExactTask(task)) => (&task.objective.rest, &task.number_names),
            Ground::Concurrent { not_minimised } => return not_minimised.clone(),
        };
        fluents.iter().map(|(fluent, _)| names[fluent.0 as usize].clone()).collect()
    }

    /// Returns `true` if the mission was planned with overlapping actions.
    pub fn overlaps(&self) -> bool {
        matches!(self.task, Ground::Concurrent { .. })
    }

    /// Returns `true` if there is no sequence of actions, but overlapping actions, which were not considered, may reach
    /// the goal: an action adds an atom at its start and deletes it at its end.
    pub fn may_need_overlap(&self) -> bool {
        let is_unsolvable = self.solution.status == Status::Unsolvable && !self.overlaps();
        is_unsolvable && self.mission.domain().actions.iter().any(adds_for_its_duration)
    }

    /// Returns the plan with the arguments as in the domain's file, i.e. without the designs that
    /// the knowledge base has added as arguments.
    pub fn written(&self) -> Option<Plan> {
        self.solution.plan.clone().map(|plan| self.mission.written(plan))
    }

    /// Returns the plan in the format of the planning competitions. Times are written wherever `validate` needs them:
    /// if actions overlap, or if one is durative, because its duration may be chosen.
    pub fn ipc_text(&self) -> Option<String> {
        let plan = self.solution.plan.as_ref()?;
        let durative = self.mission.domain().actions.iter();
        let durative = durative.filter(|action| matches!(action.body, ActionBody::Durative { .. }));
        let durative: HashSet<&Name> = durative.map(|action| &action.identifier.name).collect();
        let is_durative = |step: &Step| durative.contains(&Name::new(&step.action));
        let is_timed = self.overlaps() || plan.steps.iter().any(is_durative);
        Some(if is_timed { plan.timed_text() } else { plan.to_string() })
    }

    /// Returns the plan with the gaps between actions that PlanSys2 needs, or unchanged if gaps would make the
    /// plan invalid or a limit is reached. The arguments are as in the domain's file, see [`Planned::written`].
    pub fn spaced(&self) -> Option<Plan> {
        let plan = self.solution.plan.clone()?;
        let limits = self.limits.extended();
        Some(self.mission.written(spaced(self.mission, &self.problem, plan, &self.reading, &limits)))
    }

    /// Returns the answer in the JSON format of `metaplan plan`.
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

    /// Writes a certificate of the status and the plan to a new directory. `metaplan verify` checks
    /// it.
    ///
    /// # Errors
    /// Actions overlap, or errors of [`certificate::write()`].
    pub fn certify(&self, directory: &Path) -> Result<(), Message> {
        let task = match &self.task {
            Ground::Integers(task) => certificate::Ground::Integers(task),
            Ground::Exact(task) => certificate::Ground::Exact(task),
            Ground::Concurrent { .. } => {
                return Err(Message::error(
                    "M107",
                    "results of concurrent planning, in which actions may overlap, have no certificate",
                ));
            }
        };
        let mut problem = self.problem.clone();
        if let [objective] = &self.objectives.parsed[..] {
            problem.metric = Some(objective.metric.clone());
        }
        let plan = self.solution.plan.as_ref().map_or_else(String::new, Plan::to_string);
        let (mission, solution) = (self.mission, &self.solution);
        let contents = Contents { mission, problem: &problem, task, solution, plan: &plan };
        certificate::write(directory, &contents, &self.limits)
    }

    /// Returns a picture of the plan.
    pub fn picture(&self, positions: &Positions) -> picture::Plan {
        let context = Seen { mission: self.mission, problem: &self.problem, positions };
        plan_picture(context, &self.solution)
    }
}

fn adds_for_its_duration(action: &Action) -> bool {
    let ActionBody::Durative { effects, .. } = &action.body else { return false };
    let (mut added, mut deleted) = (HashSet::new(), HashSet::new());
    for (time, effect) in effects {
        effect.walk(&mut |node| match (time, node) {
            (EffectTime::AtStart, Node::Effect(Effect::Add(atom))) => {
                added.insert(&atom.predicate.name);
            }
            (EffectTime::AtEnd, Node::Effect(Effect::Delete(atom))) => {
                deleted.insert(&atom.predicate.name);
            }
            _ => {}
        });
    }
    !added.is_disjoint(&deleted)
}

impl PlannedFront<'_> {
    /// Returns the objectives as the caller wrote them.
    pub fn objectives(&self) -> &[String] {
        &self.objectives.texts
    }

    /// Writes a certificate that the front is complete, or that there is no plan, to a new directory. `metaplan
    /// verify` checks it.
    ///
    /// # Errors
    /// The front is not complete; both objectives depend on the total time; one of the certificates that the front
    /// needs cannot be written; or the directory cannot be written.
    pub fn certify(&self, directory: &Path) -> Result<(), Message> {
        let wrong = |reason: &str| Message::error("M120", format!("no certificate: {reason}"));
        let (mission, problem, limits) = (self.mission, &self.problem, &self.limits);
        let [first, second] = &self.objectives.parsed[..] else {
            return Err(wrong("a front has two objectives"));
        };
        let [first, second] = [&first.metric, &second.metric];
        match (self.front.status, &self.front.points[..]) {
            (Status::Unsolvable, [point]) => {
                let problem = Problem { metric: Some(first.clone()), ..problem.clone() };
                let mut task = self.task.clone();
                // A certificate is about a task with one objective.
                task.others.clear();
                for operator in &mut task.operators {
                    operator.others.clear();
                }
                let task = certificate::Ground::Integers(&task);
                let contents =
                    Contents { mission, problem: &problem, task, solution: &point.solution, plan: "" };
                certificate::write(directory, &contents, limits)
            }
            (Status::Optimal, points) => {
                let objectives = [first.clone(), second.clone()];
                certificate::write_front(directory, (mission, problem), &objectives, points, limits)
            }
            _ => Err(wrong("it is not proved that the front is complete")),
        }
    }

    /// Returns the front with the arguments of each step as in the domain's file, i.e. without the
    /// designs that the knowledge base has added as arguments.
    pub fn written(&self) -> Front {
        let mut front = self.front.clone();
        for point in &mut front.points {
            point.solution.plan = point.solution.plan.take().map(|plan| self.mission.written(plan));
        }
        front
    }

    /// Returns the answer in the JSON format of `metaplan plan --pareto`.
    pub fn answer(&self) -> ParetoAnswer {
        ParetoAnswer::new(&self.mission.name, &self.objectives.texts, &self.written(), &self.preparation)
    }

    /// Returns the data of a page about the front, with its plans.
    pub fn sheet(&self, positions: &Positions) -> picture::Sheet {
        let context = Seen { mission: self.mission, problem: &self.problem, positions };
        front_sheet(context, &self.objectives.texts, &self.front)
    }
}
