//! Statuses in edge cases: empty plans, unsolvable tasks, cycles without cost, and metrics without an
//! optimum.

use metaplan_planner::{
    Backend, Config, Engine, GroundConfig, MetricUnbounded, Proof, Status, StepSemantics, ground, optimize,
};
use pddl::{Source, read};

const DOMAIN: &str = "(define (domain d)
  (:types place)
  (:predicates (at ?p - place) (way ?a ?b - place) (on))
  (:functions (total-cost) (reward) (fuel) (length ?a ?b - place))
  (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (length ?a ?b))))
  (:action burn :parameters () :precondition (>= (fuel) 1) :effect (and (decrease (fuel) 1) (increase (reward) 1)))
  (:action flip :parameters () :precondition (not (on)) :effect (on))
  (:action flop :parameters () :precondition (on) :effect (not (on))))";

fn check(name: &str, init: &str, goal: &str, metric: &str, expected: (Status, Option<&str>, Option<usize>)) {
    let problem = format!(
        "(define (problem p) (:domain d) (:objects a b c - place)
          (:init (at a) (= (total-cost) 0) (= (reward) 0) (= (fuel) 2) {init}) (:goal {goal}) {metric})"
    );
    let (domain, problem, _) =
        read(&Source::new("domain", DOMAIN), &Source::new("problem", problem)).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    for backend in Backend::BUILT_IN {
        let semantics = [StepSemantics::Sequential, StepSemantics::ForAllStep, StepSemantics::ExistsStep];
        for semantics in semantics.into_iter().map(Some).chain([None]) {
            let backend: Backend = backend.parse().expect("a solver");
            let solution = optimize(
                &task,
                &Config::default().with_semantics(semantics).with_backend(backend),
                &mut |_| {},
            );
            let plan = solution.plan.as_ref();
            let found = (solution.status, plan.map(|p| p.cost.to_string()), plan.map(|p| p.steps.len()));
            let expected = (expected.0, expected.1.map(str::to_owned), expected.2);
            assert_eq!(found, expected, "{name}, {semantics:?}: {solution:?}");
            let claims = matches!(solution.status, Status::Optimal | Status::Unsolvable);
            assert!(!claims || solution.proof.is_some(), "{name}: a claim without a proof");
        }
    }
}

const COST: &str = "(:metric minimize (total-cost))";
const WAYS: &str = "(way a b) (= (length a b) 2) (way b c) (= (length b c) 3)";
/// A cycle between a and b that costs nothing.
const FREE: &str = "(way a b) (= (length a b) 0) (way b a) (= (length b a) 0) (way b c) (= (length b c) 3)";

#[test]
fn a_goal_that_holds_takes_no_step() {
    check("cost", WAYS, "(at a)", COST, (Status::Optimal, Some("0"), Some(0)));
    check("no metric", WAYS, "(at a)", "", (Status::Optimal, Some("0"), Some(0)));
    check("empty goal", WAYS, "(and)", COST, (Status::Optimal, Some("0"), Some(0)));
}

#[test]
fn a_goal_out_of_reach_is_proved_so() {
    let none = (Status::Unsolvable, None, None);
    check("no way back", WAYS, "(and (at a) (at b))", COST, none);
    check("no way", "(way a b) (= (length a b) 2)", "(at c)", COST, none);
    check("free cycle", "(way a b) (= (length a b) 0) (way b a) (= (length b a) 0)", "(at c)", COST, none);
    check("contradiction", WAYS, "(and (on) (not (on)))", COST, none);
}

#[test]
fn cycles_that_cost_nothing_do_no_harm() {
    check("cycle", FREE, "(at c)", COST, (Status::Optimal, Some("3"), Some(2)));
    check("toggle", FREE, "(and (at c) (on))", COST, (Status::Optimal, Some("3"), Some(3)));
    check("all free", FREE, "(at b)", COST, (Status::Optimal, Some("0"), Some(1)));
}

#[test]
fn metrics_that_may_be_unbounded_are_reported() {
    let metric = "(:metric maximize (reward))";
    check("burning", WAYS, "(at c)", metric, (Status::Feasible, Some("0"), Some(2)));
    let problem = format!(
        "(define (problem p) (:domain d) (:objects a - place)
          (:init (at a) (= (total-cost) 0) (= (reward) 0) (= (fuel) 2)) (:goal (on)) {metric})"
    );
    // `burn` cannot be repeated forever, which the planner does not detect. `wave` can be repeated.
    let waving = DOMAIN.replace(
        "(:action flip",
        "(:action wave :parameters () :precondition () :effect (increase (reward) 1)) (:action flip",
    );
    for (domain, expected) in
        [(DOMAIN, MetricUnbounded::Suspected), (waving.as_str(), MetricUnbounded::Proved)]
    {
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem.as_str())).expect("PDDL");
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        let solution = optimize(&task, &Config::default(), &mut |_| {});
        assert_eq!((solution.status, solution.unbounded), (Status::Feasible, Some(expected)), "{solution:?}");
        assert!(solution.lower_bound.is_none(), "{solution:?}");
    }
}

#[test]
fn proofs_name_their_reason() {
    let problem = format!(
        "(define (problem p) (:domain d) (:objects a b c - place)
          (:init (at a) (= (total-cost) 0) (= (reward) 0) (= (fuel) 2) {FREE}) (:goal (at c)) {COST})"
    );
    let (domain, problem, _) =
        read(&Source::new("domain", DOMAIN), &Source::new("problem", problem)).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    // The projection to the place is exact here, so its goal distance equals the cost.
    assert_eq!(solution.proof, Some(Proof::Bound));
    let within = Config::default().with_horizon(1);
    assert_eq!(optimize(&task, &within, &mut |_| {}).status, Status::UnsolvableWithinHorizon);
}

fn reason(domain: &str, problem: &str) -> String {
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    let Some(Proof::Relaxation(reason)) = solution.proof else { panic!("{solution:?}") };
    assert_eq!(solution.status, Status::Unsolvable);
    reason
}

#[test]
fn unsolvability_has_the_reason_that_applies() {
    let problem = |init: &str, goal: &str| {
        format!(
            "(define (problem p) (:domain d) (:objects a b c - place) (:init (at a) {init}) (:goal {goal}))"
        )
    };
    // The path from a to c consumes two units of fuel.
    let domain = "(define (domain d) (:types place) (:predicates (at ?p - place) (way ?a ?b - place)) (:functions (fuel))
      (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b) (>= (fuel) 1))
        :effect (and (not (at ?a)) (at ?b) (decrease (fuel) 1))))";
    let by_fuel = reason(domain, &problem("(way a b) (way b c) (= (fuel) 1)", "(at c)"));
    assert!(by_fuel.contains("fuel") && !by_fuel.contains("no path"), "{by_fuel}");
    let by_goal = reason(domain, &problem("(way a b) (= (fuel) 1)", "(and (at a) (not (at a)))"));
    assert!(by_goal.contains("contradicts itself"), "{by_goal}");
}

#[test]
fn an_unknown_result_names_no_limit_that_was_not_reached() {
    let problem = format!(
        "(define (problem p) (:domain d) (:objects a b c - place)
          (:init (at a) (= (total-cost) 0) (= (reward) 0) (= (fuel) 2) {WAYS}) (:goal (at c)) {COST})"
    );
    let (domain, problem, _) =
        read(&Source::new("domain", DOMAIN), &Source::new("problem", problem)).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let backend = Backend::Program { command: "/no/such/solver".to_owned(), arguments: Vec::new() };
    let config = Config::default().with_engine(Engine::Sat).with_backend(backend);
    let solution = optimize(&task, &config, &mut |_| {});
    assert_eq!(solution.status, Status::Unknown);
    assert!(solution.statistics.failure.is_some() && !solution.verdict().contains("limit"), "{solution}");
}

/// The number of steps of a formula that does not depend on the bounds is the cost divided by the least cost.
#[test]
fn a_confirmation_with_too_many_steps_is_not_attempted() {
    let domain = "(define (domain d) (:predicates (p) (q)) (:functions (total-cost))
      (:action far :parameters () :effect (and (p) (increase (total-cost) 1000000000000)))
      (:action near :parameters () :effect (and (q) (increase (total-cost) 1))))";
    let problem = "(define (problem p) (:domain d) (:init (= (total-cost) 0)) (:goal (and (p) (q))) (:metric minimize (total-cost)))";
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default().with_confirmation(true), &mut |_| {});
    assert_eq!((solution.status, solution.proof), (Status::Optimal, Some(Proof::Bound)));
}

/// Simultaneous contradictory changes of a number make an action inapplicable, as in the validator.
#[test]
fn contradictory_changes_leave_an_action_inapplicable() {
    let solve = |effect: &str| {
        let domain = format!(
            "(define (domain d) (:predicates (done) (lit)) (:functions (x))
              (:action work :parameters () :effect (and (done) {effect}))
              (:action light :parameters () :effect (lit)))"
        );
        let problem = "(define (problem p) (:domain d) (:init (= (x) 2)) (:goal (done)))";
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
        let task = ground(&domain, &problem, &GroundConfig::default()).map_err(|errors| errors.len())?;
        Ok(optimize(&task, &Config::default(), &mut |_| {}).plan.map(|plan| plan.steps.len()))
    };
    assert_eq!(solve("(assign (x) 5) (increase (x) 1)"), Ok(None));
    assert_eq!(solve("(increase (x) 1) (assign (x) 3)"), Ok(None));
    assert_eq!(solve("(scale-up (x) 2) (decrease (x) 1)"), Ok(None));
    assert_eq!(solve("(assign (x) 5) (assign (x) 6)"), Ok(None));
    assert_eq!(solve("(assign (x) 5) (assign (x) 5)"), Ok(Some(1)));
    assert_eq!(solve("(increase (x) 5) (decrease (x) 6)"), Ok(Some(1)));
    assert_eq!(solve("(scale-up (x) 5) (scale-down (x) 6)"), Ok(Some(1)));
    // If the contradiction depends on the state, the truth of `lit` matters.
    assert_eq!(solve("(assign (x) 5) (when (not (lit)) (increase (x) 1))"), Ok(Some(2)));
    assert_eq!(solve("(assign (x) 5) (assign (x) (+ (x) 3))"), Err(1));
}

/// Each preference is evaluated by a hidden step at the end of the plan. The horizon counts only actions.
#[test]
fn a_horizon_does_not_count_evaluations_of_preferences() {
    let domain = "(define (domain d) (:requirements :strips :preferences) (:predicates (p) (q) (r))
      (:action a :parameters () :precondition (and) :effect (q))
      (:action b :parameters () :precondition (q) :effect (r)))";
    let solve = |goal: &str, horizon: usize, engine: Engine| {
        let problem = format!(
            "(define (problem x) (:domain d) (:init (p))
               (:goal (and {goal} (preference g (p)) (preference g (not (q))))) (:metric minimize (is-violated g)))"
        );
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        let config = Config::default().with_engine(engine).with_horizon(horizon);
        optimize(&task, &config, &mut |better| assert!(better.horizon <= 2, "{better:?}"))
    };
    for engine in [Engine::Auto, Engine::Search, Engine::Sat] {
        // The goal, the least number of actions of a plan, and the least metric.
        for (goal, least, metric) in [("(p)", 0, "0"), ("(q)", 1, "1"), ("(r)", 2, "1")] {
            for horizon in 0..4 {
                let solution = solve(goal, horizon, engine);
                let about = format!("{goal}, horizon {horizon}, {engine:?}: {solution:?}");
                let Some(plan) = &solution.plan else {
                    assert!(horizon < least, "{about}");
                    assert_eq!(solution.status, Status::UnsolvableWithinHorizon, "{about}");
                    assert_eq!(solution.horizon, horizon, "{about}");
                    continue;
                };
                assert!(horizon >= least && plan.steps.len() <= horizon, "{about}");
                assert_eq!(plan.cost.to_string(), metric, "{about}");
            }
        }
    }
}
