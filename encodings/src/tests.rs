//! Formulas against an oracle: for every number of steps, a formula has a plan at the oracle's cost, and none one below.

#[path = "../tests/random/adl.rs"]
pub(crate) mod adl;
#[path = "../tests/missions/mod.rs"]
pub(crate) mod missions;
#[path = "../tests/random/mod.rs"]
pub(crate) mod random;

use std::cell::OnceCell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fmt::Write as _;

use rustc_hash::FxHashMap;

use crate::bounds::Bounds;
use crate::context::Context;
use crate::encode::{CostLimit, Counting, Encoding, Plans, Semantics};
use crate::ground::{GroundConfig, ground};
use crate::limits::Limits;
use crate::number::Int;
use crate::plan::ground::replay;
use crate::sat::{Answer, Backend};
use crate::task::{State, Task};
use missions::Mission;
use pddl::{Source, read};
use random::Random;

/// Plans of so many steps are looked for at least.
const STEPS: usize = 6;

/// Longer ones, up to the step bound, only to this number.
const MOST_STEPS: usize = 16;

/// More than any plan of the small tasks below costs.
const MUCH: Int = 200;

/// Whether there is a plan with at most so many steps and at most this cost; if so, it is one.
fn is_solvable(
    task: &Task,
    bounds: &Bounds,
    steps: usize,
    limit: Int,
    semantics: Semantics,
    backend: &Backend,
) -> bool {
    let window =
        bounds.window(Context::new(task, &Limits::none()), Some(limit), Some(steps)).expect("no limit");
    let cost = CostLimit { limit, bounds, counting: Counting::Sum };
    let limits = Limits::none();
    let encoding = Encoding::new(
        Context::new(task, &limits),
        Plans { allowed: &window.allowed, cost: Some(cost), semantics, most: usize::MAX },
        &OnceCell::new(),
    )
    .expect("no limit");
    let mut solver = backend.start(&Limits::none(), u64::MAX);
    for (_, clause) in encoding.formula.clauses() {
        solver.add_clause(clause);
    }
    let answer = solver.solve(&[]);
    assert_ne!(answer, Answer::Interrupted, "{backend:?}: {:?}", solver.failure());
    if answer == Answer::Satisfiable {
        let plan = encoding.decode(solver.as_ref());
        let replayed = replay(task, &plan);
        assert!(replayed.is_some_and(|(_, cost)| cost <= limit), "{backend:?}: no plan: {plan:?}");
    }
    answer == Answer::Satisfiable
}

fn check(seed: u64, backend: &Backend) {
    let mission = Mission::random(seed);
    let (domain, problem) = (Source::new("d", mission.domain()), Source::new("p", mission.problem()));
    let (domain, problem, _) = read(&domain, &problem).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let optimum = mission.oracle().map(Int::from);
    if task.unreachable.is_some() {
        assert!(optimum.is_none(), "seed {seed}");
        return;
    }
    let (scale, offset) = (task.objective.scale, task.objective.offset);
    let bounds = Bounds::new(Context::new(&task, &Limits::none())).expect("no limit");
    let below = optimum.map_or(MUCH, |optimum| optimum * scale - offset - 1);
    let step_bound = bounds
        .window(Context::new(&task, &Limits::none()), Some(below), None)
        .expect("no limit")
        .steps
        .unwrap_or(STEPS);
    let costs = mission.oracle_by_steps(step_bound.clamp(STEPS, MOST_STEPS));
    let costs: Vec<_> = costs.into_iter().map(|cost| cost.map(Int::from)).collect();
    assert!(
        costs.iter().flatten().all(|cost| optimum.is_some_and(|optimum| optimum <= *cost)),
        "seed {seed}"
    );
    for bounds in [&bounds, &Bounds::trivial(Context::new(&task, &Limits::none())).expect("no limit")] {
        for (steps, cost) in costs.iter().enumerate() {
            let solvable = |limit| is_solvable(&task, bounds, steps, limit, Semantics::Sequential, backend);
            let context = || format!("seed {seed}, {backend:?}, {steps} steps: {mission:?}");
            match cost {
                Some(cost) => {
                    assert!(solvable(cost * scale - offset), "{}", context());
                    assert!(!solvable(cost * scale - offset - 1), "{}", context());
                }
                None => assert!(!solvable(Int::from(i32::MAX)), "{}", context()),
            }
        }
    }
}

pub(crate) fn built_in() -> impl Iterator<Item = Backend> {
    Backend::BUILT_IN.iter().map(|name| name.parse().expect("a name"))
}

#[test]
fn formulas_have_plans_at_the_cost_of_the_oracle_and_none_below() {
    for backend in built_in() {
        (0..25).for_each(|seed| check(seed, &backend));
    }
}

#[test]
#[ignore = "takes minutes"]
fn many_formulas_have_plans_at_the_cost_of_the_oracle_and_none_below() {
    for backend in crate::sat::tests::backends() {
        (25..2_100).for_each(|seed| check(seed, &backend));
    }
}

/// Robots with designs on a map with doors and lamps, some with a battery: much can happen at once, and much interferes.
pub(crate) fn fleet(seed: u64) -> (String, String) {
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

/// Where a state leads to, and what that costs.
pub(crate) fn successors(task: &Task, state: &State) -> Vec<(State, Int)> {
    let mut all = Vec::new();
    for operator in &task.operators {
        for choice in operator.choices().filter(|choice| operator.applicable(state, choice)) {
            let next = task.successor(operator, state, &choice).expect("small numbers");
            all.push((next, operator.cost_of(&choice)));
        }
    }
    all
}

/// The least cost of a plan, by Dijkstra over all states that can be reached.
pub(crate) fn optimum(task: &Task) -> Option<Int> {
    let mut best = FxHashMap::from_iter([(task.initial.clone(), 0)]);
    let mut states = vec![task.initial.clone()];
    let mut open = BinaryHeap::from([Reverse((0, 0))]);
    while let Some(Reverse((cost, index))) = open.pop() {
        let state = states[index].clone();
        if best[&state] < cost {
            continue;
        }
        if task.is_goal(&state) {
            return Some(cost);
        }
        for (next, step) in successors(task, &state) {
            let known = best.entry(next.clone()).or_insert(Int::MAX);
            if cost + step < *known {
                *known = cost + step;
                open.push(Reverse((cost + step, states.len())));
                states.push(next);
            }
        }
    }
    None
}

/// The least cost of a plan with at most so many steps, for each number from 0.
fn costs_by_steps(task: &Task, most: usize) -> Vec<Option<Int>> {
    let mut best = FxHashMap::from_iter([(task.initial.clone(), 0)]);
    let mut improved = vec![(task.initial.clone(), 0)];
    let mut costs = Vec::new();
    for _ in 0..=most {
        let goals = best.iter().filter(|(state, _)| task.is_goal(state));
        costs.push(goals.map(|(_, cost)| *cost).min());
        let mut next = Vec::new();
        for (state, cost) in improved {
            for (after, step) in successors(task, &state) {
                let known = best.entry(after.clone()).or_insert(Int::MAX);
                if cost + step < *known {
                    *known = cost + step;
                    next.push((after, cost + step));
                }
            }
        }
        improved = next;
    }
    costs
}

/// Parcels, some of them equal, and robots that carry them, with designs some of which are equal.
pub(crate) fn depot(seed: u64) -> (String, String) {
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

pub(crate) fn ground_text((domain, problem): (String, String)) -> Task {
    let (domain, problem, _) = read(&Source::new("d", domain), &Source::new("p", problem)).expect("PDDL");
    let config = GroundConfig { solves: vec![pddl::ast::Name::new("solves")], ..GroundConfig::default() };
    ground(&domain, &problem, &config).expect("a task")
}

/// Estimates never fall by more than a step costs, and are 0 at the goal: so they are lower bounds. Returns whether the shares of
/// several projections say more of the initial state than any projection alone.
fn check_estimates(text: &(String, String)) -> bool {
    let task = ground_text(text.clone());
    if task.unreachable.is_some() {
        return false;
    }
    let (bounds, alone) = (
        Bounds::new(Context::new(&task, &Limits::none())).expect("no limit"),
        Bounds::of_projections(Context::new(&task, &Limits::none())).expect("no limit"),
    );
    let mut seen = rustc_hash::FxHashSet::from_iter([task.initial.clone()]);
    let mut open = vec![task.initial.clone()];
    while let Some(state) = open.pop() {
        let estimate = bounds.estimate(&state);
        assert!(!task.is_goal(&state) || estimate == Some(0), "{estimate:?} at a goal: {text:?}");
        for (next, step) in successors(&task, &state) {
            if let Some(after) = bounds.estimate(&next) {
                assert!(estimate.is_some_and(|estimate| estimate <= step + after), "{state:?}: {text:?}");
            }
            if seen.len() < 3_000 && seen.insert(next.clone()) {
                open.push(next);
            }
        }
    }
    bounds.estimate(&task.initial) > alone.estimate(&task.initial)
}

#[test]
fn estimates_are_consistent_and_shares_add_up() {
    let fleets = (0..12).filter(|seed| check_estimates(&fleet(*seed))).count();
    let depots = (0..12).filter(|seed| check_estimates(&depot(*seed))).count();
    assert!(fleets > 3 && depots > 3, "shares add up for {fleets} fleets and {depots} depots");
}

#[test]
#[ignore = "takes minutes"]
fn many_estimates_are_consistent() {
    for seed in 12..600 {
        check_estimates(&fleet(seed));
        check_estimates(&depot(seed));
        let mission = Mission::random(seed);
        check_estimates(&(mission.domain(), mission.problem()));
    }
}

/// What a task's formulas say in all semantics. Returns whether several operators stood at a step, and whether anything
/// was equal.
fn check_all(text: (String, String), backend: &Backend) -> (bool, bool) {
    let task = ground_text(text.clone());
    let text = text.1;
    if task.unreachable.is_some() {
        return (false, false);
    }
    let most = 4;
    let (costs, optimum) = (costs_by_steps(&task, most), optimum(&task));
    let bounds = Bounds::new(Context::new(&task, &Limits::none())).expect("no limit");
    let mut together = false;
    for bounds in [&bounds, &Bounds::trivial(Context::new(&task, &Limits::none())).expect("no limit")] {
        for (steps, cost) in costs.iter().enumerate() {
            let context = |semantics| format!("{backend:?}, {steps} steps, {semantics:?}, {cost:?}: {text}");
            for semantics in [Semantics::Sequential, Semantics::ForAllStep, Semantics::ExistsStep] {
                let solvable = |limit| is_solvable(&task, bounds, steps, limit, semantics, backend);
                if let Some(cost) = cost {
                    assert!(solvable(*cost), "{}", context(semantics));
                }
                let below = cost.unwrap_or(MUCH) - 1;
                match (semantics, optimum) {
                    (Semantics::Sequential, _) => assert!(!solvable(below), "{}", context(semantics)),
                    (_, Some(optimum)) => {
                        assert!(!solvable(optimum - 1), "{}", context(semantics));
                        together |= below >= optimum && solvable(below);
                    }
                    (_, None) => assert!(!solvable(MUCH), "{}", context(semantics)),
                }
            }
        }
    }
    let allowed = vec![vec![true; task.operators.len()]; most];
    let limits = Limits::none();
    let encoding = Encoding::new(
        Context::new(&task, &limits),
        Plans { allowed: &allowed, cost: None, semantics: Semantics::Sequential, most: usize::MAX },
        &OnceCell::new(),
    );
    let counts = encoding.expect("no limit").formula.counts();
    (together, !counts.contains(&("symmetry", 0)))
}

#[test]
fn neither_parallel_steps_nor_broken_symmetries_change_an_optimum() {
    for backend in built_in() {
        let fleets = (0..8).map(|seed| check_all(fleet(seed), &backend));
        let together = fleets.filter(|(together, _)| *together).count();
        assert!(together > 1, "{backend:?}: operators stand together in {together} tasks only");
        let depots = (0..8).map(|seed| check_all(depot(seed), &backend));
        let equal = depots.filter(|(_, equal)| *equal).count();
        assert!(equal > 3, "{backend:?}: something is equal in {equal} tasks only");
    }
}

#[test]
#[ignore = "takes minutes"]
fn neither_parallel_steps_nor_broken_symmetries_change_the_optimum_of_many() {
    for backend in built_in() {
        for seed in 8..1_100 {
            check_all(fleet(seed), &backend);
            check_all(depot(seed), &backend);
        }
    }
}
