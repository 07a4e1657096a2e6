//! Generators of small random tasks, and reference solutions by exhaustive search. Only tests use this crate.

pub mod adl;
pub mod missions;
pub mod random;

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fmt::Write as _;

use pddl::{Source, read};
use rustc_hash::FxHashMap;
use task::ground::{GroundConfig, ground};
use task::number::Int;
use task::task::{State, Task};

use self::random::Random;

/// Returns the domain and the problem of a random task: two robots with designs on a map with
/// doors, lamps and limited charge. Many actions can be parallel, and many interfere.
pub fn fleet(seed: u64) -> (String, String) {
    let mut random = Random(seed);
    let domain = "(define (domain fleet)
      (:types robot place design function)
      (:predicates (at ?r - robot ?p - place) (way ?a ?b - place) (open) (lit ?p - place) (seen ?r - robot)
        (solves ?d - design ?f - function) (drives ?r - robot ?f - function) (safe) (dark))
      (:functions (total-cost) (price ?d - design) (charge ?r - robot) (use ?d - design))
      (:derived (safe) (or (open) (exists (?p - place) (lit ?p))))
      (:action move :parameters (?r - robot ?a ?b - place ?f - function ?d - design)
        :precondition (and (at ?r ?a) (way ?a ?b) (drives ?r ?f) (solves ?d ?f) (>= (charge ?r) (use ?d)))
        :effect (and (not (at ?r ?a)) (at ?r ?b) (decrease (charge ?r) (use ?d)) (increase (total-cost) (price ?d))))
      (:action jump :parameters (?r - robot ?a ?b - place)
        :precondition (and (at ?r ?a) (open) (or (dark) (lit ?b)))
        :effect (and (not (at ?r ?a)) (at ?r ?b) (when (lit ?a) (seen ?r)) (increase (total-cost) 3)))
      (:action toggle :parameters () :precondition (not (open)) :effect (and (open) (increase (total-cost) 1)))
      (:action shut :parameters () :precondition (open) :effect (and (not (open)) (increase (total-cost) 1)))
      (:action light :parameters (?r - robot ?p - place) :precondition (at ?r ?p)
        :effect (and (lit ?p) (not (dark)) (increase (total-cost) 1)))
      (:action look :parameters (?r - robot) :precondition (safe) :effect (and (seen ?r) (increase (total-cost) 2))))";
    let mut init = String::from("(= (total-cost) 0) (dark) (drives r0 f0) (drives r1 f1)");
    for from in 0..3 {
        for to in 0..3 {
            if from != to && random.below(3) > 0 {
                let _ = write!(init, " (way p{from} p{to})");
            }
        }
    }
    for design in 0..3 {
        let _ = write!(init, " (solves d{design} f{})", random.below(2));
        let (price, energy) = (random.below(4), random.below(3));
        let _ = write!(init, " (= (price d{design}) {price}) (= (use d{design}) {energy})");
    }
    let mut goal = String::new();
    for robot in 0..2 {
        let (place, charge, target) = (random.below(3), random.below(5), random.below(3));
        let _ = write!(init, " (at r{robot} p{place}) (= (charge r{robot}) {charge})");
        let _ = write!(goal, " (at r{robot} p{target})");
        if random.below(2) == 0 {
            let _ = write!(goal, " (seen r{robot})");
        }
    }
    if random.below(2) == 0 {
        init.push_str(" (open)");
    }
    goal.push_str(["", " (not (open))", " (lit p1)", " (safe)"][random.below(4) as usize]);
    let problem = format!(
        "(define (problem p) (:domain fleet)
          (:objects r0 r1 - robot p0 p1 p2 - place d0 d1 d2 - design f0 f1 - function)
          (:init {init}) (:goal (and {goal})) (:metric minimize (total-cost)))"
    );
    (domain.to_owned(), problem)
}

/// Returns the domain and the problem of a random task in which robots carry parcels. Some parcels
/// and some designs can be interchangeable. The cost of a step depends on the chosen design.
pub fn depot(seed: u64) -> (String, String) {
    let mut random = Random(seed);
    let domain = "(define (domain depot)
      (:types robot parcel place design function)
      (:predicates (at ?r - robot ?p - place) (lies ?o - parcel ?p - place) (holds ?r - robot ?o - parcel)
        (free ?r - robot) (solves ?d - design ?f - function) (light ?d - design))
      (:functions (total-cost) (price ?d - design))
      (:action move :parameters (?r - robot ?a ?b - place ?f - function ?d - design)
        :precondition (and (at ?r ?a) (solves ?d ?f))
        :effect (and (not (at ?r ?a)) (at ?r ?b) (increase (total-cost) (price ?d))))
      (:action pick :parameters (?r - robot ?o - parcel ?p - place)
        :precondition (and (at ?r ?p) (lies ?o ?p) (free ?r))
        :effect (and (not (lies ?o ?p)) (not (free ?r)) (holds ?r ?o) (increase (total-cost) 1)))
      (:action drop :parameters (?r - robot ?o - parcel ?p - place ?f - function ?d - design)
        :precondition (and (at ?r ?p) (holds ?r ?o) (solves ?d ?f) (light ?d))
        :effect (and (lies ?o ?p) (free ?r) (not (holds ?r ?o)) (increase (total-cost) (price ?d)))))";
    let mut init = String::from("(= (total-cost) 0)");
    let mut goal = String::new();
    for design in 0..3 {
        let _ = write!(init, " (solves d{design} f0) (= (price d{design}) {})", 1 + random.below(2));
        if random.below(2) == 0 {
            let _ = write!(init, " (light d{design})");
        }
    }
    for robot in 0..=random.below(2) {
        let _ = write!(init, " (at r{robot} p{}) (free r{robot})", random.below(2));
    }
    for parcel in 0..3 {
        let _ = write!(init, " (lies o{parcel} p{})", random.below(2));
        if random.below(3) > 0 {
            let _ = write!(goal, " (lies o{parcel} p{})", random.below(2));
        }
    }
    let problem = format!(
        "(define (problem p) (:domain depot)
          (:objects r0 r1 - robot o0 o1 o2 - parcel p0 p1 - place d0 d1 d2 - design f0 - function)
          (:init {init}) (:goal (and {goal})) (:metric minimize (total-cost)))"
    );
    (domain.to_owned(), problem)
}

/// Parses and grounds a domain and a problem in PDDL. If the domain has a predicate `solves`, it relates
/// designs to functions.
///
/// # Panics
/// Panics if the texts are not a valid task.
pub fn ground_text((domain, problem): (String, String)) -> Task {
    let (domain, problem, _) = read(&Source::new("d", domain), &Source::new("p", problem)).expect("PDDL");
    let config = GroundConfig { solves: vec![pddl::ast::Name::new("solves")], ..GroundConfig::default() };
    ground(&domain, &problem, &config).expect("a task")
}

/// Returns the successors of a state, each with the cost of the step. There is one for each operator with each
/// admitted combination of designs that is applicable, so equal states can occur several times.
///
/// # Panics
/// Panics on numeric overflow.
pub fn successors(task: &Task, state: &State) -> Vec<(State, Int)> {
    let mut successors = Vec::new();
    for operator in &task.operators {
        for choice in operator.admitted_combinations().filter(|choice| operator.applicable(state, choice)) {
            let next = task.successor(operator, state, &choice).expect("small numbers");
            successors.push((next, operator.cost_of(&choice)));
        }
    }
    successors
}

/// Returns the minimum cost of a plan, by Dijkstra's algorithm over the reachable states. `None` if there is
/// no plan. Requires costs that are not negative, and finitely many reachable states with a lower cost than
/// the cheapest plan. If there is no plan, the task must have finitely many reachable states.
pub fn optimum(task: &Task) -> Option<Int> {
    let mut best = FxHashMap::from_iter([(task.initial.clone(), 0)]);
    let mut states = vec![task.initial.clone()];
    let mut open = BinaryHeap::from([Reverse((0, 0))]);
    while let Some(Reverse((cost, index))) = open.pop() {
        let state = states[index].clone();
        // Outdated entry: the state was reached at a lower cost.
        if best[&state] < cost {
            continue;
        }
        if task.is_goal(&state) {
            return Some(cost);
        }
        for (next, step) in successors(task, &state) {
            let best_cost = best.entry(next.clone()).or_insert(Int::MAX);
            if cost + step < *best_cost {
                *best_cost = cost + step;
                open.push(Reverse((cost + step, states.len())));
                states.push(next);
            }
        }
    }
    None
}

/// Returns the minimum cost of a plan with at most n steps, for each n from 0 to `max_steps`. The entry for n
/// is `None` if there is no such plan.
pub fn costs_by_steps(task: &Task, max_steps: usize) -> Vec<Option<Int>> {
    let mut best = FxHashMap::from_iter([(task.initial.clone(), 0)]);
    // Only states with a lower cost than before need to be expanded again.
    let mut improved = vec![(task.initial.clone(), 0)];
    let mut costs = Vec::new();
    for _ in 0..=max_steps {
        let goals = best.iter().filter(|(state, _)| task.is_goal(state));
        costs.push(goals.map(|(_, cost)| *cost).min());
        let mut next = Vec::new();
        for (state, cost) in improved {
            for (after, step) in successors(task, &state) {
                let best_cost = best.entry(after.clone()).or_insert(Int::MAX);
                if cost + step < *best_cost {
                    *best_cost = cost + step;
                    next.push((after, cost + step));
                }
            }
        }
        improved = next;
    }
    costs
}
