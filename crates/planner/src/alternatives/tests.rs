//! Compares the alternatives and shared choices with an enumeration of all cheapest plans of small missions.

use std::collections::BTreeSet;
use std::sync::atomic::Ordering;

use search::bounds::Bounds;
use task::context::Context;
use task::ground::{GroundConfig, ground};
use task::limits::Limits;
use task::number::Int;
use task::plan::ground::{GroundPlan, GroundStep};
use task::plan::solution::Status;
use task::plan::{Plan, decode};
use task::task::{State, Task};
use testing::missions::Mission;

use super::{End, Forced, List, alternatives, cheapest};
use crate::optimize::{Config, Engine, optimize};
use pddl::{Source, read};

fn all(task: &Task, state: &State, left: Int, path: &mut Vec<GroundStep>, found: &mut Vec<Vec<GroundStep>>) {
    if left == 0 && task.is_goal(state) {
        found.push(path.clone());
    }
    for (operator, id) in task.operators.iter().zip((0..).map(task::task::OperatorId)) {
        for choice in operator.admitted_combinations().filter(|choice| operator.applicable(state, choice)) {
            let cost = operator.cost_of(&choice);
            if cost <= left {
                let next = task.successor(operator, state, &choice).expect("small numbers");
                path.push(GroundStep { operator: id, choice });
                all(task, &next, left - cost, path, found);
                path.pop();
            }
        }
    }
}

fn steps(plan: &Plan) -> Vec<String> {
    plan.steps
        .iter()
        .map(|step| format!("{} {:?} {:?}", step.action, step.arguments, step.configuration))
        .collect()
}

fn forced(first: &Plan, plans: &[Plan]) -> Vec<Forced> {
    let designs: BTreeSet<&String> =
        plans.iter().flat_map(|p| &p.steps).flat_map(|s| s.configuration.iter().map(|(_, d)| d)).collect();
    let route = |step: &task::plan::Step| {
        let plain = step.arguments.iter().filter(|argument| !designs.contains(argument));
        (step.action.clone(), plain.cloned().collect::<Vec<_>>())
    };
    let at = |position: usize, step: &task::plan::Step| {
        let in_all_plans = |same: &dyn Fn(&task::plan::Step) -> bool| {
            plans.iter().all(|plan| plan.steps.get(position).is_some_and(same))
        };
        let functions = step
            .configuration
            .iter()
            .filter(|pair| in_all_plans(&|other| other.configuration.contains(pair)));
        Forced {
            action: in_all_plans(&|other| route(other) == route(step)),
            functions: functions.map(|(function, _)| function.clone()).collect(),
        }
    };
    first.steps.iter().enumerate().map(|(position, step)| at(position, step)).collect()
}

fn check(seed: u64) -> usize {
    let mission = Mission::random(seed);
    if mission.weights.0 == 0 {
        // The metric does not weight recharging, so there are infinitely many cheapest plans.
        return 0;
    }
    let (domain, problem) = (Source::new("d", mission.domain()), Source::new("p", mission.problem()));
    let (domain, problem, _) = read(&domain, &problem).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let config = Config::default();
    let solution = optimize(&task, &config, &mut |_| {});
    if solution.status != Status::Optimal {
        assert!(alternatives(&task, &solution, 3, &config).is_none(), "seed {seed}");
        return 0;
    }
    let ground = solution.ground.as_ref().expect("a plan");
    let mut expected = Vec::new();
    all(&task, &task.initial, ground.cost, &mut Vec::new(), &mut expected);
    let plans: Vec<Plan> = expected
        .into_iter()
        .map(|steps| decode(Context::new(&task, &Limits::none()), &GroundPlan { steps, cost: ground.cost }))
        .collect();
    let first = solution.plan.as_ref().expect("a plan");
    // Both methods are tested: graph search and SAT formulas.
    for config in [config, Config::default().with_engine(Engine::Sat)] {
        let context = format!("seed {seed}, {:?}: {mission:?}", config.engine);
        let result = alternatives(&task, &solution, 1_000, &config).expect("alternatives");
        let texts: BTreeSet<_> = result.plans.iter().chain([first]).map(steps).collect();
        assert_eq!(texts, plans.iter().map(steps).collect(), "{context}");
        assert_eq!(result.plans.len() + 1, plans.len(), "a plan is listed twice: {context}");
        assert!(result.complete, "{context}");
        assert_eq!(result.forced, Some(forced(first, &plans)), "{context}");
        let fewer = alternatives(&task, &solution, 1, &config).expect("alternatives");
        assert_eq!(
            (fewer.plans.len(), &fewer.forced),
            (1.min(result.plans.len()), &result.forced),
            "{context}"
        );
        // Unlike graph search, the SAT method does not look for one more plan than requested.
        let max_complete = if config.engine == Engine::Sat { 1 } else { 2 };
        assert_eq!(fewer.complete, plans.len() <= max_complete, "{context}");
    }
    let limits = Limits::none();
    limits.interrupt().store(true, Ordering::Relaxed);
    let late = alternatives(&task, &solution, 3, &Config::default().with_limits(limits)).expect("an answer");
    assert!(!late.complete && late.forced.is_none(), "seed {seed}: what is not proved is claimed");
    plans.len()
}

#[test]
fn all_cheapest_plans_and_their_common_choices_are_found() {
    let several = (0..300).filter(|seed| check(*seed) > 1).count();
    assert!(several > 8, "only {several} missions have several cheapest plans");
}

/// The enumeration ends even if the limit is reached after the graph is complete.
#[test]
fn the_enumeration_ends_at_a_limit() {
    let domain = "(define (domain d) (:predicates (p) (q) (r)) (:action a :parameters () :effect (p))
      (:action b :parameters () :effect (q)) (:action c :parameters () :effect (r)))";
    let problem = "(define (problem p) (:domain d) (:init) (:goal (and (p) (q) (r))))";
    let (domain, problem, _) = read(&Source::new("d", domain), &Source::new("p", problem)).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    let first = solution.ground.as_ref().expect("a plan");
    let limits = Limits::none();
    let context = Context::new(&task, &limits);
    let bounds = Bounds::new(context).expect("bounds");
    let graph = cheapest(context, &bounds, first.cost, &mut |_| false).expect("a graph");
    let (list, end) = List::new(context, first, 9, &graph);
    assert_eq!((list.plans.len(), end), (5, End::Exhausted));
    limits.interrupt().store(true, Ordering::Relaxed);
    let (list, end) = List::new(context, first, 9, &graph);
    assert_eq!((list.plans.len(), end), (0, End::Stopped));
}
