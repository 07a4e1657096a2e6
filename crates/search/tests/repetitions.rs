//! Checks of the satisficing search in numeric tasks whose plans repeat operators.

use metaplan_search::satisfice::{Satisficer, StepResult};
use task::context::Context;
use task::limits::Limits;
use task::plan::ground::replay;
use task::task::Task;
use testing::missions::Mission;
use testing::{depot, fleet, ground_text, optimum};

const WORK: u64 = 10_000_000;

/// Returns the number of steps of the first plan, if any, and the number of evaluated states.
fn first_plan(task: &Task) -> (Option<usize>, u64) {
    let limits = Limits::none();
    let satisficer = Satisficer::new(Context::new(task, &limits)).expect("no limit");
    let mut satisficer = satisficer.expect("few combinations of designs");
    loop {
        match satisficer.run(None, WORK).expect("no limit") {
            StepResult::Plan(plan) => {
                let executed = replay(task, &plan.steps).map(|(_, cost)| cost);
                assert_eq!(executed, Some(plan.cost), "not a plan of this cost");
                return (Some(plan.steps.len()), satisficer.figures.evaluated);
            }
            StepResult::Unsolvable => return (None, satisficer.figures.evaluated),
            StepResult::Paused => {}
            StepResult::Ended => panic!("the search ended without a result"),
        }
    }
}

/// Workers walk one by one between farms. Driving moves no workers, because there are no cars.
fn farms(workers: usize, goal: &str) -> (String, String) {
    let domain = "(define (domain farms) (:requirements :typing :numeric-fluents) (:types farm)
      (:predicates (adj ?a ?b - farm)) (:functions (x ?a - farm) (cars))
      (:action drive :parameters (?a ?b - farm) :precondition (and (adj ?a ?b) (>= (x ?a) (* 4 (cars))))
        :effect (and (decrease (x ?a) (* 4 (cars))) (increase (x ?b) (* 4 (cars)))))
      (:action walk :parameters (?a ?b - farm) :precondition (and (adj ?a ?b) (>= (x ?a) 1))
        :effect (and (decrease (x ?a) 1) (increase (x ?b) 1))))";
    let problem = format!(
        "(define (problem p) (:domain farms) (:objects a b c - farm)
          (:init (adj a b) (adj b a) (adj b c) (adj c b) (= (cars) 0) (= (x a) {workers}) (= (x b) 0) (= (x c) 0))
          (:goal {goal}))"
    );
    (domain.into(), problem)
}

#[test]
fn long_repetitions_need_few_evaluations() {
    // The relaxed plan must not drive: without cars, driving moves nobody.
    for (goal, least) in [("(>= (x b) 600)", 600), ("(and (>= (x a) 100) (>= (x b) 500))", 500)] {
        let (steps, evaluated) = first_plan(&ground_text(farms(800, goal)));
        let steps = steps.expect("a plan");
        assert!(steps >= least, "{goal}: {steps} steps");
        assert!(evaluated < 100, "{goal}: {evaluated} evaluated states");
    }
}

#[test]
fn jumps_do_not_change_solvability() {
    let missions = (0..30).map(Mission::random).map(|mission| (mission.domain(), mission.problem()));
    let goals = [
        "(and (>= (x a) 3) (= (x b) 2) (>= (x c) 2))",
        "(= (x b) 6)",
        "(and (>= (x b) 4) (>= (x c) 4))",
        "(and (>= (x a) 3) (>= (x b) 3) (>= (x c) 3))",
        "(and (>= (x a) 5) (>= (x c) 3))",
    ];
    let farms = goals.map(|goal| farms(7, goal));
    let (mut solvable, mut unsolvable) = (0, 0);
    for text in (0..20).map(fleet).chain((0..20).map(depot)).chain(missions).chain(farms) {
        let task = ground_text(text.clone());
        if task.unreachable.is_some() {
            continue;
        }
        let is_solvable = optimum(&task).is_some();
        assert_eq!(first_plan(&task).0.is_some(), is_solvable, "{text:?}");
        *if is_solvable { &mut solvable } else { &mut unsolvable } += 1;
    }
    assert!(solvable > 20 && unsolvable > 2, "{solvable} solvable, {unsolvable} unsolvable tasks");
}
