//! Checks that the heuristics are admissible and consistent.

use metaplan_search::bounds::Bounds;
use rustc_hash::FxHashMap;
use task::context::Context;
use task::limits::Limits;
use task::number::Int;
use task::task::{State, Task};
use testing::adl::Generator;
use testing::missions::Mission;
use testing::random::Random;
use testing::{depot, fleet, ground_text, successors};

/// Checks that heuristic values are consistent and 0 at goal states, so that they are lower bounds.
/// Returns `true` if cost partitioning raises the value of the initial state.
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
fn heuristic_values_are_consistent_and_cost_partitionings_add_up() {
    let fleets = (0..12).filter(|seed| check_estimates(&fleet(*seed))).count();
    let depots = (0..12).filter(|seed| check_estimates(&depot(*seed))).count();
    assert!(fleets > 3 && depots > 3, "shares add up for {fleets} fleets and {depots} depots");
}

/// Returns the reachable states of a task, each with the minimum cost to a goal state; `None` if the task has more
/// than `max_states` reachable states.
fn exact_costs(task: &Task, max_states: usize) -> Option<Vec<(State, Option<Int>)>> {
    let mut index = FxHashMap::from_iter([(task.initial.clone(), 0)]);
    let mut states = vec![task.initial.clone()];
    let mut steps: Vec<(usize, usize, Int)> = Vec::new();
    let mut position = 0;
    while position < states.len() {
        for (next, cost) in successors(task, &states[position].clone()) {
            let target = *index.entry(next.clone()).or_insert(states.len());
            if target == states.len() {
                states.push(next);
            }
            steps.push((position, target, cost));
        }
        if states.len() > max_states {
            return None;
        }
        position += 1;
    }
    let mut costs: Vec<Option<Int>> = states.iter().map(|state| task.is_goal(state).then_some(0)).collect();
    // Bellman and Ford: repeat until nothing changes.
    loop {
        let mut changed = false;
        for (source, target, cost) in &steps {
            if let Some(through) = costs[*target].map(|rest| rest + cost)
                && costs[*source].is_none_or(|known| through < known)
            {
                costs[*source] = Some(through);
                changed = true;
            }
        }
        if !changed {
            return Some(states.into_iter().zip(costs).collect());
        }
    }
}

/// Compares online cost partitioning with the exact cost of every reachable state, several times, so that cost
/// partitionings are added in between. Returns the number of kept cost partitionings, and of positive estimates.
fn check_online(text: &(String, String)) -> [usize; 2] {
    let task = ground_text(text.clone());
    if task.unreachable.is_some() {
        return [0; 2];
    }
    let limits = Limits::none();
    let context = Context::new(&task, &limits);
    let bounds = Bounds::new(context).expect("no limit");
    let Some(exact) = exact_costs(&task, 3_000) else { return [0; 2] };
    let [mut kept, mut positive] = [0; 2];
    for max_work in [500, 10_000, 10_000_000] {
        let Some(mut online) = bounds.online_cost_partitioning(context, max_work).expect("no limit") else {
            continue;
        };
        for _ in 0..3 {
            for (state, cost) in &exact {
                let estimate = online.estimate(&state.values);
                let is_admissible = cost.is_none_or(|cost| estimate.is_some_and(|estimate| estimate <= cost));
                assert!(is_admissible, "{estimate:?} of {cost:?} in {state:?}: {text:?}");
                positive += usize::from(estimate.is_some_and(|estimate| estimate > 0));
            }
        }
        kept += online.partitionings();
    }
    [kept, positive]
}

/// Checks random tasks of four kinds. Returns the sums of the results of [`check_online`] for each kind.
fn check_online_all(seeds: std::ops::Range<u64>) -> [[usize; 2]; 4] {
    let mut sums = [[0; 2]; 4];
    for seed in seeds {
        let mut adl = Generator(Random(seed));
        let mission = Mission::random(seed);
        let texts =
            [(adl.domain(), adl.problem()), (mission.domain(), mission.problem()), fleet(seed), depot(seed)];
        for (text, sum) in texts.iter().zip(&mut sums) {
            let [kept, positive] = check_online(text);
            *sum = [sum[0] + kept, sum[1] + positive];
        }
    }
    sums
}

#[test]
fn online_cost_partitionings_are_admissible_in_all_reachable_states() {
    let sums = check_online_all(0..30);
    let [_, _, fleets, depots] = sums;
    let is_reached = fleets[0] > 10 && depots[0] > 10 && sums.iter().all(|[_, positive]| *positive > 10);
    assert!(is_reached, "kept cost partitionings and positive estimates for each kind of task: {sums:?}");
}

#[test]
#[ignore = "takes minutes"]
fn many_online_cost_partitionings_are_admissible_in_all_reachable_states() {
    check_online_all(30..1_000);
}

/// `a` and `b` exclude each other. Nothing costs anything, so only the pair of both shows it, among more
/// projections than are evaluated for each state.
#[test]
fn a_projection_that_proves_the_goal_unreachable_is_kept() {
    let domain = "(define (domain d) (:requirements :adl :action-costs)
      (:predicates (a) (b) (g ?i) (given ?i)) (:functions (total-cost))
      (:action set-a :parameters () :precondition (not (b)) :effect (a))
      (:action set-b :parameters () :precondition (not (a)) :effect (b))
      (:action set :parameters (?i) :precondition (given ?i) :effect (g ?i)))";
    let problem = "(define (problem p) (:domain d) (:objects i j k l m)
      (:init (given i) (given j) (given k) (given l) (given m) (= (total-cost) 0))
      (:goal (and (a) (b) (g i) (g j) (g k) (g l) (g m))) (:metric minimize (total-cost)))";
    let task = ground_text((domain.into(), problem.into()));
    assert!(task.unreachable.is_none(), "grounding detects it already");
    for compute in [Bounds::new, Bounds::of_projections] {
        let bounds = compute(Context::new(&task, &Limits::none())).expect("no limit");
        assert_eq!(bounds.estimate(&task.initial), None);
    }
}

#[test]
#[ignore = "takes minutes"]
fn many_heuristic_values_are_consistent() {
    for seed in 12..600 {
        check_estimates(&fleet(seed));
        check_estimates(&depot(seed));
        let mission = Mission::random(seed);
        check_estimates(&(mission.domain(), mission.problem()));
    }
}
