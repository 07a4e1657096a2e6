//! The situation to a question for the live planner, and its answer to a plan of the loop.
//!
//! The live planner knows the mission's own domain only. What is left of an action under way is a step that comes first: its
//! configurations are tried one by one on the domain in which that action is shortened, see [`super::resume`].

use num_rational::BigRational;
use pddl::validate::advance_each;
use planner::{FirstStep, Limits, Progress, Query, ReplanOutcome, Replanner};

use crate::mapek::ask::{Ask, Outcome};
use crate::mapek::resume::{GATE, resume};
use crate::mapek::step::PlannedStep;
use crate::mapek::watch::Watch;
use crate::mission::replanner;

/// So many configurations of the action under way are tried at most.
const CONFIGURATIONS: usize = 256;

/// A planner that is kept from one plan to the next.
#[derive(Debug, Clone, Default)]
pub(super) enum Live {
    /// There is none yet.
    #[default]
    Untried,
    /// The mission is not suited.
    Unsuited,
    /// For the problem that it was made for, and for those that are like it.
    Ready(Replanner),
}

impl Live {
    /// A proved answer, or the best plan that was known when time was up; none if it has to be found without a live planner.
    pub(super) fn plan(&mut self, ask: &Ask<'_>, limits: &Limits, watch: &Watch) -> Option<Outcome> {
        let metric = ask.metric()?;
        let first = match ask.running {
            Some(_) => first_steps(ask)?,
            None => Vec::new(),
        };
        if ask.running.is_some() && first.is_empty() {
            return Some(none(Vec::new()));
        }
        let (steps, first): (Vec<PlannedStep>, Vec<FirstStep>) = first.into_iter().unzip();
        let old: Option<Vec<(String, Vec<String>)>> = ask
            .old
            .map(|plan| plan.iter().map(|step| (step.action.clone(), step.arguments.clone())).collect());
        let query = Query {
            problem: ask.problem,
            first: &first,
            metric: metric.clone(),
            old: old.as_deref(),
            stay_close: ask.stay_close,
            limits,
        };
        let mut report = |progress: Progress| {
            let cost = progress.metric.map(|own| own - &metric);
            watch.improve(cost, progress.bound - &metric);
        };
        let mut answer = self.ask(ask, &query, false, &mut report)?;
        if answer == ReplanOutcome::Misfit {
            answer = self.ask(ask, &query, true, &mut report)?;
        }
        let proved = matches!(answer, ReplanOutcome::Optimal { .. });
        match answer {
            ReplanOutcome::Optimal { first: begins, steps: rest, metric }
            | ReplanOutcome::Feasible { first: begins, steps: rest, metric } => {
                let begins = begins.and_then(|index| steps.into_iter().nth(index));
                let rest = rest.iter().map(|step| PlannedStep::new(ask.mission, step));
                let steps = begins.into_iter().chain(rest).collect();
                Some(Outcome { steps: Some(steps), cost: metric, proved, ..none(Vec::new()) })
            }
            ReplanOutcome::Unsolvable if ask.running.is_none() => {
                let Self::Ready(replanner) = self else { return None };
                Some(none(replanner.blocking(&query).unwrap_or_default()))
            }
            ReplanOutcome::Unsolvable => Some(none(Vec::new())),
            _ => None,
        }
    }

    fn ask(
        &mut self,
        ask: &Ask<'_>,
        query: &Query<'_>,
        anew: bool,
        report: &mut dyn FnMut(Progress),
    ) -> Option<ReplanOutcome> {
        if anew || matches!(self, Self::Untried) {
            let made = replanner(ask.mission, ask.problem, query.limits);
            *self = made.map_or(Self::Unsuited, Self::Ready);
        }
        match self {
            Self::Ready(replanner) => Some(replanner.plan_aloud(query, report)),
            _ => None,
        }
    }
}

/// That there is no plan.
fn none(blocking: Vec<String>) -> Outcome {
    Outcome {
        steps: None,
        cost: BigRational::default(),
        proved: true,
        because: "no plan reaches the goal".to_owned(),
        blocking,
    }
}

/// What is left of the action under way, with each configuration that it can go on with; none if those are too many, or unknown.
pub(super) fn first_steps(ask: &Ask<'_>) -> Option<Vec<(PlannedStep, FirstStep)>> {
    let running = ask.running?;
    let mut steps = vec![running.step.clone()];
    for (function, _) in &running.step.configuration {
        let designs = ask.mission.designs_of(function);
        if designs.is_empty() || steps.len() * designs.len() > CONFIGURATIONS {
            return None;
        }
        let with =
            |step: &PlannedStep| designs.iter().map(|design| step.with_design(function, design)).collect();
        steps = steps.iter().flat_map(|step| -> Vec<PlannedStep> { with(step) }).collect();
    }
    let domain = resume(ask.mission.domain(), &running.step, &running.progress);
    let plan_steps: Vec<_> = steps.iter().map(PlannedStep::to_plan_step).collect();
    let before = ask.metric()?;
    let advances = advance_each(&domain, ask.problem, &plan_steps);
    let mut first = Vec::new();
    for (mut step, change) in steps.into_iter().zip(advances) {
        let Ok(mut change) = change else { continue };
        change.added.retain(|atom| atom.predicate.name.as_str() != GATE);
        let one = BigRational::from_integer(1.into());
        let metric = if ask.problem.metric.is_some() { change.metric.clone()? } else { one };
        step.duration.clone_from(&change.duration);
        step.cost = &metric - &before;
        let (configuration, arguments) = (step.configuration.clone(), step.arguments.clone());
        first.push((step, FirstStep { configuration, arguments, change, metric }));
    }
    Some(first)
}

#[cfg(test)]
mod tests;
