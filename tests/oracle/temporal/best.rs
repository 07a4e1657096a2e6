//! The best value of all plans one after another, and a plan that has it at exact times.

use num_rational::BigRational;

use super::execute::execute;
use super::graph::{Graph, Optimum, Way};
use super::happening::{Obstacle, World};
use super::model::{Q, big, q};
use super::sequence::{Edge, Search};
use crate::judge::{Step, Truth};

/// What is true of a task, as far as so many nodes show it.
pub fn best(world: &World, cap: usize) -> Truth {
    let search = Search::new(world, cap);
    let ends: Vec<usize> = search.goals.iter().map(|(edge, _)| *edge).collect();
    let graph = Graph {
        nodes: search.nodes.len(),
        edges: search.edges.iter().map(|edge| (edge.from, edge.to, edge.cost)).collect(),
        goals: search
            .goals
            .iter()
            .map(|(edge, rest)| (search.edges[*edge].from, search.edges[*edge].cost + rest))
            .collect(),
    };
    let schedule = |(edges, goal): &Way| scheduled(&search, &[&edges[..], &[ends[*goal]]].concat());
    judged(world, graph.optimum(), search.empty, search.open, &schedule, &|plan| execute(world, plan))
}

/// A plan: instances with start and duration.
pub type Schedule = Vec<(usize, Q, Q)>;

/// What is true, given the best way in a graph of all plans but the empty one, whose value is given if it is a plan. `open` if
/// the graph has not all plans.
#[allow(clippy::type_complexity)]
pub fn judged(
    world: &World,
    optimum: Optimum,
    empty: Option<Q>,
    open: bool,
    schedule: &dyn Fn(&Way) -> Schedule,
    execute: &dyn Fn(&[(usize, Q, Q)]) -> Result<Q, Obstacle>,
) -> Truth {
    let (unbounded, plan) = match optimum {
        Optimum::Unbounded(way) => (true, schedule(&way)),
        Optimum::Best(value, way) if empty.is_none_or(|empty| value < empty) => (false, schedule(&way)),
        _ if empty.is_some() => (false, Vec::new()),
        _ => return if open { Truth::Open(None) } else { Truth::NoPlan },
    };
    let found: (BigRational, Vec<Step>) = match execute(&plan) {
        Ok(value) => (big(value), written(world, &plan)),
        // Numbers too large for the oracle leave the truth open; anything else is a fault of the oracle.
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
        (true, _) => Truth::NoBest(found.0, found.1),
        (false, false) => Truth::Best(found.0, found.1),
        (false, true) => Truth::Open(Some(found)),
    }
}

/// Times for the actions of a way.
fn scheduled(search: &Search<'_>, edges: &[usize]) -> Schedule {
    let edges: Vec<&Edge> = edges.iter().map(|edge| &search.edges[*edge]).collect();
    let steps = edges.iter().filter(|edge| edge.step.is_some()).count() as i64;
    let gap = edges.iter().filter_map(|edge| edge.step.and_then(|(_, _, _, gap)| gap)).min();
    let small = gap.map_or(q(1), |gap| gap / q(steps + 1));
    let last = search.world.events.last().map(|(time, _)| *time);
    let mut clock = q(0);
    let mut plan = Vec::new();
    for edge in edges {
        let Some((instance, duration, (infimum, strict), _)) = edge.step else { continue };
        let ended = search.nodes[edge.from].1 == search.world.events.len();
        let start = match last.filter(|_| ended) {
            Some(last) => clock.max(last + small),
            None if ended => clock,
            None if strict => infimum + small * q(plan.len() as i64 + 1),
            None => infimum,
        };
        clock = start + duration;
        plan.push((instance, start, duration));
    }
    plan
}

/// A plan by names.
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
