//! Computes the correct answer for a task: the best value with a plan, that there is no plan, or that there
//! is no best value.
//!
//! If the state space is complete, Bellman-Ford runs on the states from which a goal is reachable. Cycle
//! detection in the tree of parents finds cycles of negative cost. If the state space is incomplete but no
//! step can improve the metric, Dijkstra's algorithm is used: its first plan is optimal nevertheless.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use num_bigint::BigInt;
use num_traits::{One as _, Zero as _};

use super::explore::{Budget, Measures, Space, States, explore};
use super::ground::Ground;
use super::model::Number;
use super::step::all_hold;

/// Value of the metric, with the instances of a plan that attains it.
pub type ValuedPlan = (Number, Vec<usize>);

/// The correct answer for a task. `Open` means that the exploration does not determine it; the field is the
/// best plan found.
#[derive(Debug, Clone)]
pub enum Outcome {
    Best(ValuedPlan),
    NoPlan,
    /// There is no best value. The plan has the best value among the plans with the fewest steps.
    NoBest(ValuedPlan),
    Open(Option<ValuedPlan>),
}

pub struct Explored {
    pub outcome: Outcome,
    pub space: Space,
}

/// Solves a task. Returns `None` if a measure is undefined in the initial state.
pub fn truth(ground: &Ground, maximize: bool, budget: Budget) -> Option<Explored> {
    let measures = Measures::new(ground);
    let space = explore(ground, &measures, budget)?;
    let outcome = if space.complete || !measures.never_improves(0, maximize) {
        by_states(&space, maximize)
    } else {
        match dijkstra(ground, &measures, maximize, budget) {
            Some(plan) => Outcome::Best(plan),
            None => by_states(&space, maximize),
        }
    };
    Some(Explored { outcome, space })
}

fn by_states(space: &Space, maximize: bool) -> Outcome {
    let useful = leads_to_goal(space);
    if !useful[0] {
        return if space.complete { Outcome::NoPlan } else { Outcome::Open(None) };
    }
    let (scale, costs) = integers(space, maximize);
    match shortest(space, &costs, &useful) {
        None => {
            let least_steps = fewest_steps(space).expect("a goal is reached");
            Outcome::NoBest(within(space, maximize, least_steps).expect("a goal is reached"))
        }
        Some((cost, plan)) => {
            let cost = Number::new(if maximize { -cost } else { cost }, scale);
            let best = (&space.initial[0] + cost, plan);
            if space.complete { Outcome::Best(best) } else { Outcome::Open(Some(best)) }
        }
    }
}

fn leads_to_goal(space: &Space) -> Vec<bool> {
    let mut predecessors = vec![Vec::new(); space.edges.len()];
    for (from, edges) in space.edges.iter().enumerate() {
        for edge in edges {
            predecessors[edge.to].push(from);
        }
    }
    let mut useful = space.goals.clone();
    let mut open: Vec<usize> = (0..useful.len()).filter(|state| useful[*state]).collect();
    while let Some(state) = open.pop() {
        for from in &predecessors[state] {
            if !std::mem::replace(&mut useful[*from], true) {
                open.push(*from);
            }
        }
    }
    useful
}

/// Returns the common denominator and the scaled costs of all edges, which are negated if the metric is
/// maximised.
fn integers(space: &Space, maximize: bool) -> (BigInt, Vec<Vec<BigInt>>) {
    let mut scale = BigInt::one();
    for edge in space.edges.iter().flatten() {
        // Factor that the scale lacks to be a multiple of this denominator.
        let factor = Number::new(scale.clone(), edge.costs[0].denom().clone()).denom().clone();
        scale *= factor;
    }
    let scaled = |cost: &Number| {
        let scaled = cost.numer() * (&scale / cost.denom());
        if maximize { -scaled } else { scaled }
    };
    let costs = space.edges.iter().map(|edges| edges.iter().map(|edge| scaled(&edge.costs[0])).collect());
    let costs = costs.collect();
    (scale, costs)
}

/// Returns the shortest path to a goal by Bellman-Ford; `None` if a cycle of negative cost lies on a path to
/// a goal.
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
                let candidate = &base + cost;
                if useful[edge.to] && distance[edge.to].as_ref().is_none_or(|current| candidate < *current) {
                    distance[edge.to] = Some(candidate);
                    parent[edge.to] = Some((from, edge.instance));
                    if !std::mem::replace(&mut queued[edge.to], true) {
                        next.push(edge.to);
                    }
                }
            }
        }
        // A cycle among the parents, or a parent of the initial state, proves a cycle of negative cost.
        if parent[0].is_some() || has_cycle(&parent) {
            return None;
        }
        active = next;
    }
    let goals = (0..useful.len()).filter(|state| space.goals[*state]);
    let (cost, goal) = goals.filter_map(|goal| Some((distance[goal].clone()?, goal))).min()?;
    Some((cost, path_to(goal, &parent)))
}

fn path_to(mut state: usize, parent: &[Option<(usize, usize)>]) -> Vec<usize> {
    let mut plan = Vec::new();
    while let Some((from, instance)) = parent[state] {
        plan.push(instance);
        state = from;
    }
    plan.reverse();
    plan
}

fn has_cycle(parent: &[Option<(usize, usize)>]) -> bool {
    let mut colour = vec![0_usize; parent.len()];
    for start in 0..parent.len() {
        let mut state = start;
        while colour[state] == 0 {
            colour[state] = start + 1;
            match parent[state] {
                Some((from, _)) => state = from,
                None => break,
            }
        }
        if colour[state] == start + 1 && parent[state].is_some() {
            return true;
        }
    }
    false
}

/// Returns the cheapest plan by Dijkstra's algorithm; `None` if the budget is exceeded or no goal is
/// reachable. Steps must not have negative costs.
fn dijkstra(ground: &Ground, measures: &Measures<'_>, maximize: bool, budget: Budget) -> Option<ValuedPlan> {
    let mut states = States::default();
    let first = measures.initial();
    let start = measures.of(&first, 0)?.swap_remove(0);
    states.number(first);
    let mut distance = vec![Number::zero()];
    let mut parent: Vec<Option<(usize, usize)>> = vec![None];
    let mut closed = vec![false];
    let mut queue = BinaryHeap::from([Reverse((Number::zero(), 0))]);
    let mut attempts = 0;
    while let Some(Reverse((cost, current))) = queue.pop() {
        if std::mem::replace(&mut closed[current], true) {
            continue;
        }
        let state = states.by_number[current].clone();
        if all_hold(&ground.goal, &state) {
            let cost = if maximize { -cost } else { cost };
            return Some((start + cost, path_to(current, &parent)));
        }
        attempts += ground.instances.len();
        if attempts > budget.attempts || states.by_number.len() > 2 * budget.states {
            return None;
        }
        let old = measures.of(&state, 0)?;
        for (position, instance) in ground.instances.iter().enumerate() {
            let Some((after, mut costs)) = measures.step(instance, (&state, &old)) else { continue };
            let step = costs.swap_remove(0);
            let candidate = &cost + if maximize { -step } else { step };
            let (target, is_new) = states.number(after);
            if is_new {
                distance.push(candidate.clone());
                parent.push(Some((current, position)));
                closed.push(false);
            } else if !closed[target] && candidate < distance[target] {
                distance[target] = candidate.clone();
                parent[target] = Some((current, position));
            } else {
                continue;
            }
            queue.push(Reverse((candidate, target)));
        }
    }
    None
}

pub fn fewest_steps(space: &Space) -> Option<usize> {
    (0..space.goals.len()).filter(|state| space.goals[*state]).map(|state| space.depths[state]).min()
}

/// Returns the best plan with at most `steps` steps among the explored states, by dynamic programming over
/// the number of steps.
pub fn within(space: &Space, maximize: bool, steps: usize) -> Option<ValuedPlan> {
    let better = |candidate: &Number, incumbent: &Number| {
        if maximize { candidate > incumbent } else { candidate < incumbent }
    };
    let mut layers: Vec<Vec<Option<(Number, usize, usize)>>> = vec![vec![None; space.goals.len()]];
    layers[0][0] = Some((space.initial[0].clone(), 0, 0));
    for step in 0..steps {
        let mut next: Vec<Option<(Number, usize, usize)>> = vec![None; space.goals.len()];
        for (from, edges) in space.edges.iter().enumerate() {
            let Some((cost, ..)) = &layers[step][from] else { continue };
            for edge in edges {
                let candidate = cost + &edge.costs[0];
                if next[edge.to].as_ref().is_none_or(|(incumbent, ..)| better(&candidate, incumbent)) {
                    next[edge.to] = Some((candidate, from, edge.instance));
                }
            }
        }
        layers.push(next);
    }
    let mut best: Option<(Number, usize, usize)> = None;
    for (layer, costs) in layers.iter().enumerate() {
        for (state, cost) in costs.iter().enumerate().filter(|(state, _)| space.goals[*state]) {
            if let Some((cost, ..)) = cost
                && best.as_ref().is_none_or(|(incumbent, ..)| better(cost, incumbent))
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
