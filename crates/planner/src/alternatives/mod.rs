//! Further cheapest plans, and the choices that all of them share.
//!
//! `graph` searches for all states that cheapest plans pass through, and the steps between them.
//! `paths` lists the plans of that graph. Where search does not apply or is disabled, `formula`
//! queries the SAT solver for one plan after the other. Equal designs or objects count as different
//! here.

mod choices;
mod formula;
mod graph;
mod paths;
#[cfg(test)]
mod tests;

use search::bounds::Bounds;
use task::context::Context;
use task::plan::ground::{GroundPlan, GroundStep, replay};
use task::plan::solution::{Solution, Status};
use task::plan::{Plan, decode};
use task::task::Task;

use crate::optimize::{Config, Engine};

use choices::{Choice, forced, shares};
use formula::by_formula;
use graph::{Graph, cheapest};
use paths::{End, Paths};

pub use choices::{Alternatives, Forced};

/// Searches for at most `most` cheapest plans other than that of an optimal solution, those with
/// the fewest steps first. At a limit, returns the plans found until then. Returns `None` if the
/// solution is not optimal.
pub fn alternatives(task: &Task, solution: &Solution, most: usize, config: &Config) -> Option<Alternatives> {
    let first = solution.ground.as_ref().filter(|_| solution.status == Status::Optimal)?;
    let context = Context::new(task, &config.limits);
    let unknown = Alternatives { plans: Vec::new(), complete: false, forced: None };
    let Ok(bounds) = Bounds::new(context) else { return Some(unknown) };
    let by_graph = if config.engine == Engine::Sat || config.horizon.is_some() {
        None
    } else {
        by_graph(context, &bounds, first, most)
    };
    by_graph.or_else(|| by_formula(context, &bounds, first, most, config)).or(Some(unknown))
}

/// Other cheapest plans by graph search. Returns `None` if the task does not suit the search.
fn by_graph(context: Context<'_>, bounds: &Bounds, first: &GroundPlan, most: usize) -> Option<Alternatives> {
    let task = context.task;
    let mut is_enough = |graph: &Graph| List::new(context, first, most, graph).0.is_full();
    let graph = cheapest(context, bounds, first.cost, &mut is_enough)?;
    let (list, end) = List::new(context, first, most, &graph);
    // Where there are waits, one action is several operators, at one place or another.
    let has_waits = task.operators.iter().any(|operator| operator.wait.is_some());
    let is_known = graph.is_complete && graph.is_exact && !has_waits;
    let forced = is_known.then(|| forced(task, &first.steps, &shared(task, &first.steps, &graph)));
    let complete = graph.is_complete && graph.is_exact && end == End::Exhausted;
    Some(Alternatives { plans: list.plans, complete, forced })
}

/// Decoded plans other than the first one. Plans that differ only in waits are one plan.
struct List {
    plans: Vec<Plan>,
    most: usize,
}

impl List {
    /// Lists the plans of a graph, and returns whether there may be others.
    fn new(context: Context<'_>, first: &GroundPlan, most: usize, graph: &Graph) -> (Self, End) {
        let mut list = Self { plans: Vec::new(), most };
        let first_plan = decode(context, first);
        let end = Paths::new(graph).each(&mut |steps| {
            // If a label represents several states, some paths need more of a resource than is available.
            if !graph.is_exact && replay(context.task, &steps).is_none_or(|(_, cost)| cost != first.cost) {
                return true;
            }
            let plan = decode(context, &GroundPlan { steps, cost: first.cost });
            let is_new = plan != first_plan && !list.plans.contains(&plan);
            if is_new && list.is_full() {
                return false;
            }
            list.plans.extend(is_new.then_some(plan));
            true
        });
        (list, end)
    }

    fn is_full(&self) -> bool {
        self.plans.len() >= self.most
    }
}

/// Choices of a plan that all cheapest plans make.
fn shared(task: &Task, first: &[GroundStep], graph: &Graph) -> Vec<Choice> {
    let layers = Paths::new(graph).layers(first.len());
    let mut choices = Choice::all(first);
    choices.retain(|choice| {
        layers[choice.step].as_ref().is_some_and(|steps| {
            steps.iter().all(|step| shares(task, &first[choice.step], step, choice.slot))
        })
    });
    choices
}
