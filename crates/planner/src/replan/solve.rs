//! Optimal replanning from a state: one search for each possible first step, then tie-breaking.
//!
//! First steps are searched in the order of their lower bounds. A first step whose lower bound exceeds the
//! best metric is skipped. Ties are broken as in planning: fewest steps, then fewest reconfigurations, then
//! the order of declaration. If the current plan should be preserved, the number of its steps that the new
//! plan contains is maximised before the reconfigurations.

use num_rational::BigRational;
use rustc_hash::FxHashSet;
use search::search::plan_tiebreak;
use search::search::{SearchOutcome, SearchProblem, search_from};
use task::context::Context;
use task::lifted::ObjectId;
use task::number::{Int, dense};
use task::plan::ground::{GroundPlan, GroundStep, replay_from};
use task::plan::{decode, resolve};
use task::task::{State, Task};

use crate::replan::query::{FirstStep, Progress, Query, ReplanOutcome};
use crate::replan::replan_cache::{AvailabilityContext, GroundBase};
use crate::replan::state_mapping::ReplanState;

struct Start {
    first: Option<usize>,
    state: State,
    designs: Vec<(ObjectId, ObjectId)>,
    /// Arguments of the first step. Object ids are in order of declaration.
    arguments: Vec<ObjectId>,
    /// Metric of the mission if it ended here, negated if it is maximised.
    own: BigRational,
}

/// Finds a best plan for a query, or the best plan known at the time limit. If a search stores more
/// than `max_states` states, the outcome is [`ReplanOutcome::Unknown`].
pub(super) fn solve(
    base: &GroundBase,
    set: &AvailabilityContext,
    situation: &ReplanState,
    query: &Query<'_>,
    max_states: usize,
    report: &mut dyn FnMut(Progress),
) -> ReplanOutcome {
    if base.task.unreachable.is_some() {
        return ReplanOutcome::Unsolvable;
    }
    let Some(prepared) = &set.prepared else { return ReplanOutcome::Unknown };
    let context = Context::new(&set.task, query.limits);
    let Some(starts) = starts(base, situation, query) else { return ReplanOutcome::Misfit };
    let scale = |cost: Int| BigRational::new(cost.into(), set.task.objective.scale.into());
    let promise = |start: Start| Some((&start.own + scale(set.bounds.estimate(&start.state)?), start));
    let mut open: Vec<(BigRational, Start)> = starts.into_iter().filter_map(promise).collect();
    open.sort_by(|left, right| left.0.cmp(&right.0).then_with(|| left.1.arguments.cmp(&right.1.arguments)));
    let old_steps: Vec<Option<GroundStep>> =
        query.old.iter().copied().flatten().map(|step| find(&set.task, step)).collect();
    let incumbent = |start: &Start| {
        Some(Candidate::new(&set.task, start, old_plan(&set.task, &start.state, query, &old_steps)?))
    };
    let incumbents: Vec<Option<Candidate>> = open.iter().map(|(_, start)| incumbent(start)).collect();
    let old_candidate =
        incumbents.iter().flatten().min_by(|left, right| left.value.cmp(&right.value)).cloned();
    let mut best: Option<(BigRational, usize)> = None;
    let mut winners: Vec<(Start, GroundPlan)> = Vec::new();
    let next = open.iter().skip(1).map(|(bound, _)| Some(bound.clone())).chain([None]);
    let next: Vec<Option<BigRational>> = next.collect();
    for (((bound, start), incumbent), next) in open.into_iter().zip(incumbents).zip(next) {
        let least = best
            .iter()
            .chain(old_candidate.iter().map(|candidate| &candidate.value))
            .map(|(value, _)| value)
            .min();
        if least.is_some_and(|least| bound > *least) {
            break;
        }
        let limit = incumbent.map_or(Int::MAX, |candidate| candidate.plan.cost);
        let signed = |value: BigRational| if set.task.objective.maximize { -value } else { value };
        let least = least.cloned();
        let mut hear = |cost: Option<&Int>, bound: &Int| {
            let cost = cost.map(|cost| &start.own + scale(*cost)).into_iter().chain(least.clone()).min();
            let bounds = [Some(&start.own + scale(*bound)), next.clone(), cost.clone()];
            if let Some(bound) = bounds.into_iter().flatten().min() {
                report(Progress { metric: cost.map(signed), bound: signed(bound) });
            }
        };
        let space = SearchProblem { context, bounds: &set.bounds, prepared, orbits: None };
        let outcome = search_from(&space, &start.state, limit, max_states, &mut hear);
        let plan = match outcome {
            SearchOutcome::Optimal(plan) => plan,
            SearchOutcome::None => continue,
            SearchOutcome::Unknown(plan) if query.limits.reached() => {
                let cut_short = plan.map(|plan| Candidate::new(&set.task, &start, plan));
                let finished =
                    winners.into_iter().map(|(start, plan)| Candidate::new(&set.task, &start, plan));
                let candidates = old_candidate.into_iter().chain(cut_short).chain(finished);
                let least = candidates.min_by(|left, right| left.value.cmp(&right.value));
                return least.map_or(ReplanOutcome::Unknown, |least| least.feasible(context));
            }
            SearchOutcome::Unknown(_) => return ReplanOutcome::Unknown,
        };
        let value = (&start.own + scale(plan.cost), plan.steps.len());
        match &best {
            Some(best_value) if value > *best_value => continue,
            Some(best_value) if value == *best_value => {}
            _ => {
                best = Some(value);
                winners.clear();
            }
        }
        winners.push((start, plan));
    }
    let Some((value, _)) = best else { return ReplanOutcome::Unsolvable };
    let metric = if set.task.objective.maximize { -value } else { value };
    let close_to =
        if query.stay_close { old_steps.into_iter().flatten().collect() } else { FxHashSet::default() };
    let (first, plan) = choose(set, query, &close_to, winners);
    ReplanOutcome::Optimal { first, steps: decode(context, &plan).steps, metric }
}

/// Fallback without a search. Returns `Misfit` if the task cannot represent one of the first steps. Otherwise
/// returns the current plan after the best first step with which it is still valid, or `Unknown` if there is
/// no such step.
pub(super) fn reuse_previous_plan(
    base: &GroundBase,
    task: &Task,
    situation: &ReplanState,
    query: &Query<'_>,
) -> ReplanOutcome {
    let Some(starts) = starts(base, situation, query) else { return ReplanOutcome::Misfit };
    let old_steps: Vec<Option<GroundStep>> =
        query.old.iter().copied().flatten().map(|step| find(task, step)).collect();
    let candidates = starts.iter().filter_map(|start| {
        old_plan(task, &start.state, query, &old_steps).map(|plan| Candidate::new(task, start, plan))
    });
    let least = candidates.min_by(|left, right| left.value.cmp(&right.value));
    least.map_or(ReplanOutcome::Unknown, |least| least.feasible(Context::new(task, query.limits)))
}

/// Returns the current plan if it is valid in the given state. `old` holds its steps; an element is `None` if
/// the task does not contain the step.
fn old_plan(task: &Task, state: &State, query: &Query<'_>, old: &[Option<GroundStep>]) -> Option<GroundPlan> {
    query.old?;
    let steps: Vec<GroundStep> = old.iter().cloned().collect::<Option<_>>()?;
    let cost = replay_from(task, state, &steps)?.1;
    Some(GroundPlan { steps, cost })
}

#[derive(Clone)]
struct Candidate {
    first: Option<usize>,
    /// Metric of the mission, negated if it is maximised, and number of steps of the plan.
    value: (BigRational, usize),
    plan: GroundPlan,
}

impl Candidate {
    fn new(task: &Task, start: &Start, plan: GroundPlan) -> Self {
        let cost = BigRational::new(plan.cost.into(), task.objective.scale.into());
        Self { first: start.first, value: (&start.own + cost, plan.steps.len()), plan }
    }

    fn feasible(self, context: Context<'_>) -> ReplanOutcome {
        let metric = if context.task.objective.maximize { -self.value.0 } else { self.value.0 };
        ReplanOutcome::Feasible { first: self.first, steps: decode(context, &self.plan).steps, metric }
    }
}

/// Returns the states in which the search can start: the situation itself, or the states after the first steps
/// of the query. Returns `None` if the task cannot represent one of the first steps.
fn starts(base: &GroundBase, situation: &ReplanState, query: &Query<'_>) -> Option<Vec<Start>> {
    let sign = |metric: &BigRational| if base.task.objective.maximize { -metric } else { metric.clone() };
    if query.first.is_empty() {
        let (designs, arguments) = (Vec::new(), Vec::new());
        let (state, metric) = (situation.state.clone(), sign(&query.metric));
        return Some(vec![Start { first: None, state, designs, arguments, own: metric }]);
    }
    let start = |(index, first): (usize, &FirstStep)| {
        let pair = |(function, design): &(String, String)| {
            Some((base.layout.object(function)?, base.layout.object(design)?))
        };
        Some(Start {
            first: Some(index),
            state: base.layout.advance(&base.task, &situation.state, &first.change)?,
            designs: first.configuration.iter().map(pair).collect::<Option<_>>()?,
            arguments: first.arguments.iter().map(|name| base.layout.object(name)).collect::<Option<_>>()?,
            own: sign(&first.metric),
        })
    };
    query.first.iter().enumerate().map(start).collect()
}

/// Applies the tie-breaking rules of this file. Also returns the index in `query.first` of the step
/// that precedes the plan; `None` if the query has no first steps.
fn choose(
    set: &AvailabilityContext,
    query: &Query<'_>,
    close_to: &FxHashSet<GroundStep>,
    mut winners: Vec<(Start, GroundPlan)>,
) -> (Option<usize>, GroundPlan) {
    winners.sort_by(|left, right| left.0.arguments.cmp(&right.0.arguments));
    let context = Context::new(&set.task, query.limits);
    let mut chosen = None;
    let mut max_changes = Some((usize::MAX, usize::MAX));
    for (start, plan) in winners {
        // A later plan is selected only if it has fewer changes. `None`: the chosen plan has no changes, so no
        // plan has fewer.
        let Some(limit) = max_changes else { break };
        let beginning = plan_tiebreak::PlanPrefix { state: &start.state, designs: &start.designs, close_to };
        let (plan, changes) =
            plan_tiebreak::choose_from((context, &set.bounds, &set.ties), plan, limit, &beginning);
        max_changes = match changes {
            Some(changes) => fewer(changes),
            None => max_changes,
        };
        if chosen.is_none() || changes.is_some() {
            chosen = Some((start.first, plan));
        }
    }
    chosen.unwrap_or((None, GroundPlan { steps: Vec::new(), cost: 0 }))
}

/// Greatest pair that is lexicographically less than the given pair.
#[expect(clippy::arithmetic_side_effects, reason = "those that are 0 are told apart")]
fn fewer((departures, reconfigurations): plan_tiebreak::Changes) -> Option<plan_tiebreak::Changes> {
    match (departures, reconfigurations) {
        (0, 0) => None,
        (departures, 0) => Some((departures - 1, usize::MAX)),
        (departures, reconfigurations) => Some((departures, reconfigurations - 1)),
    }
}

fn find(task: &Task, (action, arguments): &(String, Vec<String>)) -> Option<GroundStep> {
    let same = |object: ObjectId, name: &String| task.object_names[object.index()].eq_ignore_ascii_case(name);
    for (operator, id) in task.operators.iter().zip((0..).map(task::task::OperatorId)) {
        if !task.schema_names[operator.schema as usize].eq_ignore_ascii_case(action)
            || operator.arguments.len() != arguments.len()
        {
            continue;
        }
        let mut choice = vec![0; operator.slots.len()];
        let fits = operator.arguments.iter().zip(arguments).all(|(argument, name)| match argument {
            task::task::Argument::Object(object) => same(*object, name),
            task::task::Argument::Slot(slot) => {
                let size = dense(operator.slots[*slot as usize].designs.len());
                let design = (0..size).find(|design| {
                    choice[*slot as usize] = *design;
                    same(resolve(task, operator, &choice, *argument), name)
                });
                choice[*slot as usize] = design.unwrap_or(0);
                design.is_some()
            }
        });
        if fits && operator.admits(&choice) {
            return Some(GroundStep { operator: id, choice });
        }
    }
    None
}
