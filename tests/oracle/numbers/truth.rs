//! What is true of a task: the best value and a plan that has it, that there is no plan, or no best value.
//!
//! Where all states were visited: Bellman and Ford's algorithm on the part that is on a way to a goal, with a look for cycles of
//! negative cost in its tree. Otherwise, if no step can improve the metric, Dijkstra's; a plan that it ends with is best
//! although states are left.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use num_bigint::BigInt;
use num_traits::{One as _, Zero as _};

use super::explore::{Budget, Measures, Space, States, explore};
use super::ground::Ground;
use super::model::Number;
use super::step::all_hold;

/// A value of the metric and the instances of a plan that has it.
pub type Found = (Number, Vec<usize>);

/// What is known of a task.
#[derive(Debug, Clone)]
pub enum Known {
    Best(Found),
    NoPlan,
    /// The plan is one of those with fewest steps.
    NoBest(Found),
    Open(Option<Found>),
}

/// The truth, and the states that it was found by.
pub struct Explored {
    pub known: Known,
    pub space: Space,
}

/// Finds out. Nothing where the metric has no value in the initial state, or after a step.
pub fn truth(ground: &Ground, maximize: bool, budget: Budget) -> Option<Explored> {
    let measures = Measures::new(ground);
    let space = explore(ground, &measures, budget)?;
    let known = if space.complete || !measures.never_improves(0, maximize) {
        by_states(&space, maximize)
    } else {
        match dijkstra(ground, &measures, maximize, budget) {
            Some(found) => Known::Best(found),
            None => by_states(&space, maximize),
        }
    };
    Some(Explored { known, space })
}

/// What follows from the states that were visited.
fn by_states(space: &Space, maximize: bool) -> Known {
    let useful = leads_to_goal(space);
    if !useful[0] {
        return if space.complete { Known::NoPlan } else { Known::Open(None) };
    }
    let (scale, costs) = integers(space, maximize);
    match shortest(space, &costs, &useful) {
        None => {
            let fewest = fewest_steps(space).expect("a goal is reached");
            Known::NoBest(within(space, maximize, fewest).expect("a goal is reached"))
        }
        Some((cost, plan)) => {
            let cost = Number::new(if maximize { -cost } else { cost }, scale);
            let found = (&space.initial[0] + cost, plan);
            if space.complete { Known::Best(found) } else { Known::Open(Some(found)) }
        }
    }
}

/// From which states a goal can be reached.
fn leads_to_goal(space: &Space) -> Vec<bool> {
    let mut before = vec![Vec::new(); space.edges.len()];
    for (from, edges) in space.edges.iter().enumerate() {
        for edge in edges {
            before[edge.to].push(from);
        }
    }
    let mut useful = space.goals.clone();
    let mut waiting: Vec<usize> = (0..useful.len()).filter(|state| useful[*state]).collect();
    while let Some(state) = waiting.pop() {
        for from in &before[state] {
            if !std::mem::replace(&mut useful[*from], true) {
                waiting.push(*from);
            }
        }
    }
    useful
}

/// All costs over one denominator, negated if the metric is maximised.
fn integers(space: &Space, maximize: bool) -> (BigInt, Vec<Vec<BigInt>>) {
    let mut scale = BigInt::one();
    for edge in space.edges.iter().flatten() {
        // The denominator over its common divisor with the scale.
        let missing = Number::new(scale.clone(), edge.costs[0].denom().clone()).denom().clone();
        scale *= missing;
    }
    let scaled = |cost: &Number| {
        let scaled = cost.numer() * (&scale / cost.denom());
        if maximize { -scaled } else { scaled }
    };
    let costs = space.edges.iter().map(|edges| edges.iter().map(|edge| scaled(&edge.costs[0])).collect());
    let costs = costs.collect();
    (scale, costs)
}

/// The cheapest way to a goal; nothing if a cycle of negative cost is on a way to one.
fn shortest(space: &Space, costs: &[Vec<BigInt>], useful: &[bool]) -> Option<(BigInt, Vec<usize>)> {
    let mut distance: Vec<Option<BigInt>> = vec![None; useful.len()];
    let mut parent: Vec<Option<(usize, usize)>> = vec![None; useful.len()];
    distance[0] = Some(BigInt::zero());
    let mut active = vec![0];
    while !active.is_empty() {
        let mut next = Vec::new();
        let mut queued = vec![false; useful.len()];
        for from in active {
            let base = distance[from].clone().expect("an active state was reached");
            for (edge, cost) in space.edges[from].iter().zip(&costs[from]) {
                let new = &base + cost;
                if useful[edge.to] && distance[edge.to].as_ref().is_none_or(|known| new < *known) {
                    distance[edge.to] = Some(new);
                    parent[edge.to] = Some((from, edge.instance));
                    if !std::mem::replace(&mut queued[edge.to], true) {
                        next.push(edge.to);
                    }
                }
            }
        }
        if parent[0].is_some() || has_cycle(&parent) {
            return None;
        }
        active = next;
    }
    let goals = (0..useful.len()).filter(|state| space.goals[*state]);
    let (cost, goal) = goals.filter_map(|goal| Some((distance[goal].clone()?, goal))).min()?;
    Some((cost, way_to(goal, &parent)))
}

fn way_to(mut state: usize, parent: &[Option<(usize, usize)>]) -> Vec<usize> {
    let mut plan = Vec::new();
    while let Some((from, instance)) = parent[state] {
        plan.push(instance);
        state = from;
    }
    plan.reverse();
    plan
}

/// Whether the tree of shortest ways is none.
fn has_cycle(parent: &[Option<(usize, usize)>]) -> bool {
    let mut colour = vec![0_usize; parent.len()];
    for start in 0..parent.len() {
        let mut at = start;
        while colour[at] == 0 {
            colour[at] = start + 1;
            match parent[at] {
                Some((from, _)) => at = from,
                None => break,
            }
        }
        if colour[at] == start + 1 && parent[at].is_some() {
            return true;
        }
    }
    false
}

/// The cheapest plan by Dijkstra's algorithm, if a goal is reached within the budget. No step may have a negative cost.
fn dijkstra(ground: &Ground, measures: &Measures<'_>, maximize: bool, budget: Budget) -> Option<Found> {
    let mut states = States::default();
    let first = measures.initial();
    let start = measures.of(&first, 0)?.swap_remove(0);
    states.number(first);
    let mut distance = vec![Number::zero()];
    let mut parent: Vec<Option<(usize, usize)>> = vec![None];
    let mut closed = vec![false];
    let mut queue = BinaryHeap::from([Reverse((Number::zero(), 0))]);
    let mut attempts = 0;
    while let Some(Reverse((cost, at))) = queue.pop() {
        if std::mem::replace(&mut closed[at], true) {
            continue;
        }
        let state = states.all[at].clone();
        if all_hold(&ground.goal, &state) {
            let cost = if maximize { -cost } else { cost };
            return Some((start + cost, way_to(at, &parent)));
        }
        attempts += ground.instances.len();
        if attempts > budget.attempts || states.all.len() > 2 * budget.states {
            return None;
        }
        let old = measures.of(&state, 0)?;
        for (position, instance) in ground.instances.iter().enumerate() {
            let Some((after, mut costs)) = measures.step(instance, (&state, &old)) else { continue };
            let step = costs.swap_remove(0);
            let new = &cost + if maximize { -step } else { step };
            let (to, is_new) = states.number(after);
            if is_new {
                distance.push(new.clone());
                parent.push(Some((at, position)));
                closed.push(false);
            } else if !closed[to] && new < distance[to] {
                distance[to] = new.clone();
                parent[to] = Some((at, position));
            } else {
                continue;
            }
            queue.push(Reverse((new, to)));
        }
    }
    None
}

/// The fewest steps to a goal.
pub fn fewest_steps(space: &Space) -> Option<usize> {
    (0..space.goals.len()).filter(|state| space.goals[*state]).map(|state| space.depths[state]).min()
}

/// The best plan of at most so many steps among the states that were visited.
pub fn within(space: &Space, maximize: bool, steps: usize) -> Option<Found> {
    let better = |new: &Number, old: &Number| if maximize { new > old } else { new < old };
    let mut layers: Vec<Vec<Option<(Number, usize, usize)>>> = vec![vec![None; space.goals.len()]];
    layers[0][0] = Some((space.initial[0].clone(), 0, 0));
    for step in 0..steps {
        let mut next: Vec<Option<(Number, usize, usize)>> = vec![None; space.goals.len()];
        for (from, edges) in space.edges.iter().enumerate() {
            let Some((cost, ..)) = &layers[step][from] else { continue };
            for edge in edges {
                let new = cost + &edge.costs[0];
                if next[edge.to].as_ref().is_none_or(|(old, ..)| better(&new, old)) {
                    next[edge.to] = Some((new, from, edge.instance));
                }
            }
        }
        layers.push(next);
    }
    let mut best: Option<(Number, usize, usize)> = None;
    for (layer, costs) in layers.iter().enumerate() {
        for (state, cost) in costs.iter().enumerate().filter(|(state, _)| space.goals[*state]) {
            if let Some((cost, ..)) = cost
                && best.as_ref().is_none_or(|(old, ..)| better(cost, old))
            {
                best = Some((cost.clone(), layer, state));
            }
        }
    }
    let (cost, layer, mut state) = best?;
    let mut plan = Vec::new();
    for layer in (1..=layer).rev() {
        let (_, from, instance) = layers[layer][state].as_ref().expect("a way was noted");
        plan.push(*instance);
        state = *from;
    }
    plan.reverse();
    Some((cost, plan))
}
