//! Enumerates further cheapest plans, and finds the choices that all cheapest plans share.
//!
//! `graph` computes all states through which cheapest plans pass, and the steps between them. `paths`
//! enumerates the plans in this graph. If graph search is not applicable or disabled, `formula` queries the
//! SAT solver for one plan after another. Interchangeable designs or objects count as different.

mod choices;
mod formula;
mod graph;
mod paths;
#[cfg(test)]
mod tests;

use rustc_hash::FxHashMap;

use search::bounds::Bounds;
use task::context::Context;
use task::plan::ground::{GroundPlan, GroundStep, replay};
use task::plan::solution::{Solution, Status};
use task::plan::{Plan, decode};
use task::task::Task;

use crate::optimize::hidden_steps::{evaluations, with_evaluations};
use crate::optimize::{Config, Engine};

use choices::{Choice, forced, shares};
use formula::by_formula;
use graph::{Graph, cheapest};
use paths::{End, Paths};

pub use choices::{Alternatives, Forced};

/// Searches for at most `most` cheapest plans other than the plan of an optimal solution. Graph search lists
/// plans with fewer steps first; SAT search has no particular order. At a limit, returns the plans that were
/// found before. Further objectives of the task are ignored. Returns `None` if the solution is not optimal or has no
/// ground plan, or if operator costs are only a part of the metric.
pub fn alternatives(task: &Task, solution: &Solution, most: usize, config: &Config) -> Option<Alternatives> {
    let is_whole = task.objective.rest.is_empty();
    let first = solution.ground.as_ref().filter(|_| solution.status == Status::Optimal && is_whole)?;
    let context = Context::new(task, &config.limits);
    let unknown = Alternatives { plans: Vec::new(), complete: false, forced: None };
    let Ok(bounds) = Bounds::new(context) else { return Some(unknown) };
    let config = &with_evaluations(task, config);
    let by_graph = if config.engine == Engine::Sat || config.horizon.is_some() {
        None
    } else {
        by_graph(context, &bounds, first, most)
    };
    let mut result =
        by_graph.or_else(|| by_formula(context, &bounds, first, most, config)).unwrap_or(unknown);
    // Evaluations of preferences are not steps of the plan.
    let actions = first.steps.len().saturating_sub(evaluations(task));
    if let Some(forced) = &mut result.forced {
        forced.truncate(actions);
    }
    Some(result)
}

fn by_graph(context: Context<'_>, bounds: &Bounds, first: &GroundPlan, most: usize) -> Option<Alternatives> {
    let task = context.task;
    // Plans in the incomplete graph. At a limit, the enumeration of the final graph may list fewer.
    let mut before = Vec::new();
    let mut is_enough = |graph: &Graph| {
        let (list, _) = List::new(context, first, most, graph);
        let is_full = list.is_full();
        if list.plans.len() > before.len() {
            before = list.plans;
        }
        is_full
    };
    let graph = cheapest(context, bounds, first.cost, &mut is_enough)?;
    let (list, end) = List::new(context, first, most, &graph);
    let plans = if before.len() > list.plans.len() { before } else { list.plans };
    // If the task has waits (steps that only advance the time), several operators can represent one action, and an
    // action can have different positions in equal plans. So plans cannot be compared step by step.
    let has_waits = task.operators.iter().any(|operator| operator.wait.is_some());
    let is_known = graph.is_complete && graph.is_exact && !has_waits;
    let forced = is_known.then(|| forced(task, &first.steps, &shared(context, &first.steps, &graph)));
    let complete = graph.is_complete && graph.is_exact && end == End::Exhausted;
    Some(Alternatives { plans, complete, forced })
}

/// Decoded plans other than the first plan, at most `most`. Plans that differ only in waits are listed once.
struct List {
    plans: Vec<Plan>,
    most: usize,
}

impl List {
    fn new(context: Context<'_>, first: &GroundPlan, most: usize, graph: &Graph) -> (Self, End) {
        let mut list = Self { plans: Vec::new(), most };
        let first_plan = decode(context, first);
        // For each sequence of actions, the indices of the plans with these actions.
        let mut listed: FxHashMap<Vec<(String, Vec<String>)>, Vec<usize>> = FxHashMap::default();
        let mut pulse = context.limits.pulse();
        let end = Paths::new(graph, context.limits).each(&mut |steps| {
            if pulse.beat().is_err() {
                return false;
            }
            // If a label represents several states, a path need not be a plan: a resource may not suffice.
            if !graph.is_exact && replay(context.task, &steps).is_none_or(|(_, cost)| cost != first.cost) {
                return true;
            }
            let plan = decode(context, &GroundPlan { steps, cost: first.cost });
            let names = plan.steps.iter().map(|step| (step.action.clone(), step.arguments.clone()));
            let similar = listed.entry(names.collect()).or_default();
            if plan == first_plan || similar.iter().any(|index| list.plans[*index] == plan) {
                return true;
            }
            if list.is_full() {
                return false;
            }
            similar.push(list.plans.len());
            list.plans.push(plan);
            true
        });
        (list, end)
    }

    fn is_full(&self) -> bool {
        self.plans.len() >= self.most
    }
}

/// Returns the choices of the first plan that all cheapest plans share. The graph must be complete, and each of its
/// paths to a goal must be a plan.
fn shared(context: Context<'_>, first: &[GroundStep], graph: &Graph) -> Vec<Choice> {
    let layers = Paths::new(graph, context.limits).layers(first.len());
    let mut choices = Choice::all(first);
    choices.retain(|choice| {
        layers[choice.step].as_ref().is_some_and(|steps| {
            steps.iter().all(|step| shares(context.task, &first[choice.step], step, choice.slot))
        })
    });
    choices
}
