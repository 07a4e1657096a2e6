//! Checks that the estimates of [`Bounds`] (pattern databases, cost partitionings, resources) are consistent,
//! and 0 in goal states, so that they are admissible. The tests of LM-cut are in `search_driver.rs`.

use metaplan_search::bounds::Bounds;
use task::context::Context;
use task::limits::Limits;
use testing::missions::Mission;
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

/// `a` and `b` exclude each other, and all costs are 0. Only the projection to both proves the goal unreachable.
/// There are more projections than are evaluated for each state.
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
fn a_table_of_operators_and_steps_counts_as_memory() {
    let task = ground_text(depot(0));
    let bounds = Bounds::new(Context::new(&task, &Limits::none())).expect("no limit");
    let steps = 1_000;
    let size = steps * task.operators.len();
    for (room, fits) in [(size, true), (size - 1, false)] {
        let limits = Limits::none().with_room(room);
        let window = bounds.window(Context::new(&task, &limits), None, Some(steps));
        assert_eq!(window.is_ok(), fits, "{room} bytes");
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
