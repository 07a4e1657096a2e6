//! Metrics over fluents with state-dependent changes: plans must be found and measured as the validator
//! measures them, and be reported as optimal only if no action may improve the metric.

use std::time::Duration;

use metaplan_planner::{
    Config, GroundConfig, Limits, Plan, Solution, Status, ground, ground_concurrent, lexicographic, optimize,
    optimize_concurrent,
};
use num_bigint::BigInt;
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};

fn text(plan: &Plan) -> String {
    let lines = plan.steps.iter().map(|step| {
        let words = [std::slice::from_ref(&step.action), &step.arguments[..]].concat().join(" ");
        format!("{}: ({words}) [{}]\n", step.start, step.duration)
    });
    lines.collect()
}

/// Checks the plan and its metric with the validator. The costs of the steps must sum to the metric
/// minus its initial value `at_first`.
fn judge((domain, problem): (&Domain, &Problem), concurrent: bool, solution: &Solution, at_first: i64) {
    let status = if concurrent { Status::Feasible } else { Status::Optimal };
    assert_eq!(solution.status, status, "{solution:?}");
    assert_eq!(
        (solution.proof.is_none(), solution.lower_bound.is_none()),
        (concurrent, concurrent),
        "{solution:?}"
    );
    let plan = solution.plan.as_ref().expect("a plan");
    let text = text(plan);
    let parsed = PlanText::parse(&Source::new("plan", text.clone())).expect("a plan");
    let options = Options::default().with_concurrent(concurrent);
    let verdict = validate(domain, problem, &parsed, &options);
    assert!(verdict.valid, "{text}{:?}", verdict.violation);
    assert_eq!(verdict.metric, Some(plan.cost.to_rational()), "{text}");
    let steps: BigRational = plan.steps.iter().map(|step| step.cost.to_rational()).sum();
    assert_eq!(steps + BigRational::from_integer(at_first.into()), plan.cost.to_rational(), "{text}");
}

const MARKET: &str = "(define (domain market) (:types good shop)
  (:predicates (sells ?s - shop ?g - good) (at ?s - shop) (road ?a - shop ?b - shop) (done ?g - good))
  (:functions (price ?s - shop ?g - good) (wanted ?g - good) (spent) (fame))
  (:action go :parameters (?a - shop ?b - shop) :precondition (and (at ?a) (road ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (increase (spent) 2)))
  (:action buy :parameters (?s - shop ?g - good) :precondition (and (at ?s) (sells ?s ?g) (> (wanted ?g) 0))
    :effect (and (increase (spent) (* (price ?s ?g) (wanted ?g))) (assign (wanted ?g) 0) (done ?g)
      (increase (fame) (wanted ?g)))))";

fn market(metric: &str) -> (Domain, Problem) {
    let problem = format!(
        "(define (problem p) (:domain market) (:objects s t - shop g h - good)
          (:init (at s) (road s t) (road t s) (sells s g) (sells t h) (= (price s g) 3) (= (price t h) 1.5)
            (= (price s h) 0) (= (price t g) 0) (= (wanted g) 4) (= (wanted h) 5) (= (spent) 1) (= (fame) 0))
          (:goal (and (done g) (done h))) (:metric {metric}))"
    );
    let (domain, problem, _) =
        read(&Source::new("domain", MARKET), &Source::new("problem", problem)).expect("PDDL");
    (domain, problem)
}

#[test]
fn plans_one_after_another_have_the_metric_of_their_end() {
    for (metric, expected) in [
        ("minimize (spent)", "22.5"),
        ("minimize (+ (* 1.9 (spent)) 7)", "49.75"),
        ("maximize (- (fame) (* 0.5 (spent)))", "-2.25"),
    ] {
        let (domain, problem) = market(metric);
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        // A purchase of h increases the fame by more than it costs.
        let may_improve = metric.contains("maximize");
        let solution = optimize(&task, &Config::default(), &mut |_| assert!(!may_improve, "{metric}"));
        let plan = solution.plan.as_ref().expect("a plan");
        // The metric is 1 initially; g costs 12, the route 2, and h 7.5.
        assert_eq!(plan.cost.to_string(), expected, "{metric}");
        let at_first = plan.cost.to_rational()
            - plan.steps.iter().map(|step| step.cost.to_rational()).sum::<BigRational>();
        let at_first_expected = match expected {
            "22.5" => BigRational::from_integer(1.into()),
            "49.75" => BigRational::new(89.into(), 10.into()),
            _ => BigRational::new((-1).into(), 2.into()),
        };
        assert_eq!(at_first, at_first_expected, "{metric}");
        let status = if may_improve { Status::Feasible } else { Status::Optimal };
        assert_eq!((solution.status, solution.lower_bound.is_none()), (status, may_improve));
        let point = lexicographic(&task, &Config::default(), &mut |_| {});
        assert_eq!(point.values[0].to_string(), expected, "{metric}");
        assert_eq!(point.solution.plan.expect("a plan").cost.to_string(), expected, "{metric}");
    }
    let (domain, problem) = market("minimize (spent)");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    judge((&domain, &problem), false, &optimize(&task, &Config::default(), &mut |_| {}), 1);
}

#[test]
fn unsolvability_is_still_proved() {
    let (domain, mut problem) = market("minimize (spent)");
    problem.init.retain(|element| !format!("{element:?}").contains("road"));
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    assert!(solution.status == Status::Unsolvable && solution.proof.is_some(), "{solution:?}");
}

#[test]
fn plans_that_overlap_have_the_metric_of_their_end() {
    let domain = "(define (domain images) (:types image)
      (:predicates (taken ?i - image) (sent ?i - image) (free))
      (:functions (size ?i - image) (data) (utility) (energy))
      (:durative-action take :parameters (?i - image) :duration (= ?duration 3) :condition (at start (free))
        :effect (and (at start (not (free))) (at end (free)) (at end (taken ?i)) (at end (increase (data) (size ?i)))
          (at end (increase (utility) 2))))
      (:durative-action send :parameters (?i - image) :duration (= ?duration 1)
        :condition (and (over all (taken ?i)) (at start (> (data) 0)))
        :effect (and (at end (increase (energy) (data))) (at start (decrease (data) (size ?i))) (at end (sent ?i)))))";
    let problem = "(define (problem p) (:domain images) (:objects i j - image)
      (:init (free) (= (size i) 4) (= (size j) 6) (= (data) 0) (= (utility) 0) (= (energy) 0))
      (:goal (and (sent i) (sent j))) (:metric METRIC))";
    for metric in [
        "minimize (energy)",
        "minimize (- (* 3 (energy)) (* 4 (utility)))",
        "maximize (- (utility) (* 0.1 (energy)))",
    ] {
        let problem = problem.replace("METRIC", metric);
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
        let separation = BigRational::new(BigInt::from(1), BigInt::from(1000));
        let task =
            ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation).expect("a task");
        // On a slow machine, the first plan takes longer.
        let mut solutions = [500, 5_000, 50_000].into_iter().map(|milliseconds| {
            let limits = Limits::none().with_time(Duration::from_millis(milliseconds));
            optimize_concurrent(&task, &limits, &mut |_| {})
        });
        let solution = solutions.find(|solution| solution.plan.is_some()).expect("a plan");
        judge((&domain, &problem), true, &solution, 0);
    }
}
