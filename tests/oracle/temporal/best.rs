//! The best value of all plans one after another, by Bellman-Ford on the graph of a task; and a plan that has it.

use num_rational::BigRational;

use super::execute::execute;
use super::happening::World;
use super::model::{Q, big, q};
use super::sequence::{Edge, Search};
use crate::judge::{Step, Truth};

/// What is true of a task, as far as so many nodes show it.
pub fn best(world: &World, cap: usize) -> Truth {
    let search = Search::new(world, cap);
    let useful = useful(&search);
    let (found, cycle) = distances(&search, &useful);
    let plan = |edges: &[usize]| -> Option<(BigRational, Vec<Step>)> {
        let steps = scheduled(&search, edges);
        let value = execute(world, &steps);
        // Numbers too large for the oracle leave the truth open; anything else is a fault of the oracle.
        match value {
            Ok(value) => Some((big(value), written(world, &steps))),
            Err(super::happening::Obstacle::TooLarge) => None,
            Err(obstacle) => {
                panic!("the oracle's own plan: {obstacle:?}: {steps:?}\n{}", world.task.problem())
            }
        }
    };
    if cycle {
        let first = shortest(&search);
        let (goal, _) =
            search.goals.iter().find(|(edge, _)| first[search.edges[*edge].from].is_some()).expect("useful");
        let mut edges = first[search.edges[*goal].from].clone().expect("found");
        edges.push(*goal);
        return plan(&edges).map_or(Truth::Open(None), |(value, plan)| Truth::NoBest(value, plan));
    }
    let mut best: Option<(Q, Vec<usize>)> = search.empty.map(|value| (value, Vec::new()));
    for (goal, rest) in &search.goals {
        let Some((distance, _)) = found[search.edges[*goal].from] else { continue };
        let value = distance + search.edges[*goal].cost + rest;
        if best.as_ref().is_none_or(|(best, _)| value < *best) {
            best = Some((value, path(&search, &found, *goal)));
        }
    }
    match (best, search.open) {
        (None, false) => Truth::NoPlan,
        (None, true) => Truth::Open(None),
        (Some((_, edges)), open) => match plan(&edges) {
            Some((value, plan)) if !open => Truth::Best(value, plan),
            found => Truth::Open(found),
        },
    }
}

/// The nodes from which a goal is reached.
fn useful(search: &Search<'_>) -> Vec<bool> {
    let mut useful = vec![false; search.nodes.len()];
    let mut into: Vec<Vec<usize>> = vec![Vec::new(); search.nodes.len()];
    search.edges.iter().for_each(|edge| into[edge.to].push(edge.from));
    let mut stack: Vec<usize> = search.goals.iter().map(|(edge, _)| search.edges[*edge].from).collect();
    while let Some(node) = stack.pop() {
        if !std::mem::replace(&mut useful[node], true) {
            stack.extend(&into[node]);
        }
    }
    useful
}

/// The least cost to each useful node, with the last edge; and whether there is a cycle of negative cost among them.
#[allow(clippy::type_complexity)]
fn distances(search: &Search<'_>, useful: &[bool]) -> (Vec<Option<(Q, Option<usize>)>>, bool) {
    let mut found: Vec<Option<(Q, Option<usize>)>> = vec![None; search.nodes.len()];
    found[0] = useful[0].then_some((q(0), None));
    for round in 0..=search.nodes.len() {
        let mut changed = false;
        for (number, edge) in search.edges.iter().enumerate().filter(|(_, edge)| useful[edge.to]) {
            let Some((distance, _)) = found[edge.from] else { continue };
            let distance = distance + edge.cost;
            if found[edge.to].is_none_or(|(old, _)| distance < old) {
                found[edge.to] = Some((distance, Some(number)));
                changed = true;
            }
        }
        if !changed {
            return (found, false);
        }
        // Where the last edges form a cycle, its cost is negative.
        if round % 8 == 7 && cyclic(search, &found) {
            break;
        }
    }
    (found, true)
}

fn cyclic(search: &Search<'_>, found: &[Option<(Q, Option<usize>)>]) -> bool {
    (0..found.len()).any(|start| {
        let mut node = start;
        for _ in 0..=found.len() {
            match found[node] {
                Some((_, Some(edge))) => node = search.edges[edge].from,
                _ => return false,
            }
        }
        true
    })
}

fn path(search: &Search<'_>, found: &[Option<(Q, Option<usize>)>], goal: usize) -> Vec<usize> {
    let mut edges = vec![goal];
    let mut node = search.edges[goal].from;
    while let Some((_, Some(edge))) = found[node] {
        edges.push(edge);
        node = search.edges[edge].from;
    }
    edges.reverse();
    edges
}

/// Some path to each node.
fn shortest(search: &Search<'_>) -> Vec<Option<Vec<usize>>> {
    let mut paths: Vec<Option<Vec<usize>>> = vec![None; search.nodes.len()];
    paths[0] = Some(Vec::new());
    // Nodes are numbered as they are found, so an edge to a new node is the first one to it.
    for (number, edge) in search.edges.iter().enumerate() {
        if let (Some(path), None) = (paths[edge.from].clone(), &paths[edge.to]) {
            paths[edge.to] = Some([&path[..], &[number]].concat());
        }
    }
    paths
}

/// Times for the actions of a path: instance, start and duration of each.
fn scheduled(search: &Search<'_>, edges: &[usize]) -> Vec<(usize, Q, Q)> {
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
