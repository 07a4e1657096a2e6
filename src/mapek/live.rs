//! Translates the believed situation to a query of the incremental planner, and the planner's answer to a plan.
//!
//! The incremental planner is built for the domain of the mission. If an action is under way, the query restricts the
//! first step to the remainder of this action. The remainder is simulated for each of its configurations in the domain
//! of [`super::resume`], in which the action is shortened.

use std::borrow::Cow;

use num_rational::BigRational;
use pddl::ast::ActionBody;
use pddl::validate::advance_each;
use planner::{FirstStep, Limits, Progress, Query, ReplanOutcome, Replanner};

use crate::mapek::ask::{Outcome, Question};
use crate::mapek::resume::{remove_internal_changes, resume};
use crate::mapek::step::PlannedStep;
use crate::mapek::watch::Watch;
use crate::mission::replanner;

const MAX_CONFIGURATIONS: usize = 256;

#[derive(Debug, Clone, Default)]
pub(super) enum Live {
    #[default]
    Untried,
    Unsuited,
    /// Planner built for one problem. Also accepts other problems, e.g. if they differ only in initial values and
    /// available designs.
    Ready(Replanner),
}

impl Live {
    /// Plans incrementally. Returns a proved outcome, or the best plan at the time limit. Returns `None` if the
    /// incremental planner has no answer; the caller then plans from scratch.
    pub(super) fn plan(
        &mut self,
        question: &Question<'_>,
        limits: &Limits,
        watch: &Watch,
    ) -> Option<Outcome> {
        let metric = question.metric()?;
        let first = match question.running {
            Some(_) => first_steps(question)?,
            None => Vec::new(),
        };
        // No configuration can execute the remainder of the action.
        if question.running.is_some() && first.is_empty() {
            return Some(none(Vec::new()));
        }
        let (steps, first): (Vec<PlannedStep>, Vec<FirstStep>) = first.into_iter().unzip();
        let old: Option<Vec<(String, Vec<String>)>> = question
            .old
            .map(|plan| plan.iter().map(|step| (step.action.clone(), step.arguments.clone())).collect());
        let query = Query {
            problem: question.problem,
            first: &first,
            metric: metric.clone(),
            old: old.as_deref(),
            stay_close: question.stay_close,
            limits,
        };
        let mut report = |progress: Progress| {
            let cost = progress.metric.map(|total| total - &metric);
            watch.improve(cost, progress.bound - &metric);
        };
        let mut answer = self.query_planner(question, &query, false, &mut report)?;
        // The planner does not fit the problem, for example after a change of the goal. The planner is rebuilt once.
        if answer == ReplanOutcome::Misfit {
            answer = self.query_planner(question, &query, true, &mut report)?;
        }
        let proved = matches!(answer, ReplanOutcome::Optimal { .. });
        match answer {
            ReplanOutcome::Optimal { first: first_step, steps: remaining, metric }
            | ReplanOutcome::Feasible { first: first_step, steps: remaining, metric } => {
                let first_step = first_step.and_then(|index| steps.into_iter().nth(index));
                let remaining = remaining.iter().map(|step| PlannedStep::new(question.mission, step));
                let steps = first_step.into_iter().chain(remaining).collect();
                Some(Outcome { steps: Some(steps), cost: metric, proved, ..none(Vec::new()) })
            }
            ReplanOutcome::Unsolvable if question.running.is_none() => {
                let Self::Ready(replanner) = self else { return None };
                Some(none(replanner.blocking(&query).unwrap_or_default()))
            }
            ReplanOutcome::Unsolvable => Some(none(Vec::new())),
            _ => None,
        }
    }

    fn query_planner(
        &mut self,
        question: &Question<'_>,
        query: &Query<'_>,
        rebuild: bool,
        report: &mut dyn FnMut(Progress),
    ) -> Option<ReplanOutcome> {
        if rebuild || matches!(self, Self::Untried) {
            let new_replanner = replanner(question.mission, question.problem, query.limits);
            *self = new_replanner.map_or(Self::Unsuited, Self::Ready);
        }
        match self {
            Self::Ready(replanner) => Some(replanner.plan_aloud(query, report)),
            _ => None,
        }
    }
}

fn none(blocking: Vec<String>) -> Outcome {
    Outcome { blocking, ..Outcome::no_plan(true, "no plan reaches the goal".to_owned()) }
}

/// Returns the remainders of the action under way with their simulated effects, one per executable configuration.
/// Returns `None` if no action is under way, if its configurations are unknown or more than [`MAX_CONFIGURATIONS`], or
/// if the metric is undefined.
pub(super) fn first_steps(question: &Question<'_>) -> Option<Vec<(PlannedStep, FirstStep)>> {
    let running = question.running?;
    let mut steps = vec![running.step.clone()];
    for (function, _) in &running.step.configuration {
        let designs = question.mission.designs_of(function);
        if designs.is_empty() || steps.len() * designs.len() > MAX_CONFIGURATIONS {
            return None;
        }
        let with =
            |step: &PlannedStep| designs.iter().map(|design| step.with_design(function, design)).collect();
        steps = steps.iter().flat_map(|step| -> Vec<PlannedStep> { with(step) }).collect();
    }
    let problem = Cow::Borrowed(question.problem);
    let (domain, problem) = resume(question.mission.domain(), problem, &running.remainder());
    let plan_steps: Vec<_> = steps.iter().map(PlannedStep::to_plan_step).collect();
    let (metric, advances) = advance_each(&domain, &problem, &plan_steps);
    let is_timed = domain.actions.iter().any(|action| matches!(action.body, ActionBody::Durative { .. }));
    let before = if question.problem.metric.is_some() { metric? } else { BigRational::default() };
    let mut first = Vec::new();
    for (mut step, change) in steps.into_iter().zip(advances) {
        let Ok(mut change) = change else { continue };
        remove_internal_changes(&mut change);
        let metric = match question.problem.metric {
            Some(_) => change.metric.clone()?,
            // Without a metric, plans are measured by the sum of durations or by their number of steps.
            None if is_timed => change.duration.clone(),
            None => BigRational::from_integer(1.into()),
        };
        step.duration.clone_from(&change.duration);
        step.cost = &metric - &before;
        let (configuration, arguments) = (step.configuration.clone(), step.arguments.clone());
        first.push((step, FirstStep { configuration, arguments, change, metric }));
    }
    Some(first)
}

#[cfg(test)]
mod tests;
