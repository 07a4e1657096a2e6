//! Best value of all sequential plans, with a plan at exact times that attains it.

use num_rational::BigRational;

use super::execute::execute;
use super::graph::{Graph, Optimum, Path};
use super::happening::{Obstacle, World};
use super::model::{Q, big, q};
use super::sequence::{Edge, Search};
use crate::judge::{Step, Truth};

/// Computes the best metric of sequential plans. If the search would exceed `cap` nodes, the answer is open,
/// or that there is no best value.
pub fn best(world: &World, cap: usize) -> Truth {
    let search = Search::new(world, cap);
    let ends: Vec<usize> = search.goals.iter().map(|(edge, _)| *edge).collect();
    let graph = Graph {
        nodes: search.nodes.len(),
        edges: search.edges.iter().map(|edge| (edge.from, edge.to, edge.cost)).collect(),
        goals: search
            .goals
            .iter()
            .map(|(edge, final_cost)| (search.edges[*edge].from, search.edges[*edge].cost + final_cost))
            .collect(),
    };
    let schedule = |(edges, goal): &Path| scheduled(&search, &[&edges[..], &[ends[*goal]]].concat());
    judged(world, graph.optimum(), search.empty, search.open, &schedule, &|plan| execute(world, plan))
}

/// A plan: instances of actions, each with start and duration.
pub type Schedule = Vec<(usize, Q, Q)>;

/// Converts the optimum over all non-empty plans (paths of a graph) and the empty plan to an
/// answer. `empty` is the cost of the empty plan, measured as in the graph; `None` if this plan is
/// invalid. `open` means that the graph is incomplete.
#[allow(clippy::type_complexity)]
pub fn judged(
    world: &World,
    optimum: Optimum,
    empty: Option<Q>,
    open: bool,
    schedule: &dyn Fn(&Path) -> Schedule,
    execute: &dyn Fn(&[(usize, Q, Q)]) -> Result<Q, Obstacle>,
) -> Truth {
    let (unbounded, plan) = match optimum {
        Optimum::Unbounded(path) => (true, schedule(&path)),
        Optimum::Best(value, path) if empty.is_none_or(|empty| value < empty) => (false, schedule(&path)),
        _ if empty.is_some() => (false, Vec::new()),
        _ => return if open { Truth::Open(None) } else { Truth::NoPlan },
    };
    let witness: (BigRational, Vec<Step>) = match execute(&plan) {
        Ok(value) => (big(value), written(world, &plan)),
        // An overflow in the oracle leaves the answer open. Any other obstacle is an error of the oracle.
        Err(Obstacle::TooLarge) => return Truth::Open(None),
        Err(obstacle) => {
            panic!(
                "the oracle's plan {plan:?}: {obstacle:?}\n{}\n{}",
                world.task.domain(),
                world.task.problem()
            )
        }
    };
    match (unbounded, open) {
        (true, _) => Truth::NoBest(witness.0, witness.1),
        (false, false) => Truth::Best(witness.0, witness.1),
        (false, true) => Truth::Open(Some(witness)),
    }
}

fn scheduled(search: &Search<'_>, edges: &[usize]) -> Schedule {
    let edges: Vec<&Edge> = edges.iter().map(|edge| &search.edges[*edge]).collect();
    let steps = edges.iter().filter(|edge| edge.step.is_some()).count() as i64;
    let gap = edges.iter().filter_map(|edge| edge.step.and_then(|(_, _, _, gap)| gap)).min();
    // Strict bounds are satisfied by delays that are so small that their sum fits into the smallest gap.
    let delay = gap.map_or(q(1), |gap| gap / q(steps + 1));
    let last = search.world.events.last().map(|(time, _)| *time);
    let mut clock = q(0);
    let mut plan = Vec::new();
    for edge in edges {
        let Some((instance, duration, (infimum, strict), _)) = edge.step else { continue };
        let after_last_event = search.nodes[edge.from].1 == search.world.events.len();
        let start = match last.filter(|_| after_last_event) {
            Some(last) => clock.max(last + delay),
            None if after_last_event => clock,
            None if strict => infimum + delay * q(plan.len() as i64 + 1),
            None => infimum,
        };
        clock = start + duration;
        plan.push((instance, start, duration));
    }
    plan
}

pub fn written(world: &World, steps: &[(usize, Q, Q)]) -> Vec<Step> {
    let step = |(instance, start, duration): &(usize, Q, Q)| {
        let (action, objects) = &world.instances[*instance];
        Step {
            action: world.task.actions[*action].name.clone(),
            arguments: objects.iter().map(|object| format!("o{object}")).collect(),
            start: big(*start),
            duration: big(*duration),
        }
    };
    steps.iter().map(step).collect()
}
