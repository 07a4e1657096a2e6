//! Tasks whose numbers have no common integer scale. Random tasks are compared with all sequences of actions,
//! executed in big rationals; other tasks have known costs. The validator executes every plan.

#![allow(clippy::format_collect)]

use std::collections::HashMap;
use std::fmt::Write as _;

use metaplan_planner::{
    Config, GroundConfig, Plan, Proof, Solution, Status, ground, ground_exact, optimize, optimize_exact,
};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use pddl::ast::{Domain, Name, Problem};
use pddl::validate::{Options, PlanStep, PlanText, validate};
use test_resources::data;
use testing::random::Random;

use crate::concurrent::parse;

fn number(decimal: &str) -> BigRational {
    let (whole, fraction) = decimal.split_once('.').unwrap_or((decimal, ""));
    let digits: BigInt = format!("{whole}{fraction}").parse().expect("digits");
    BigRational::new(digits, BigInt::from(10).pow(fraction.len() as u32))
}

fn metric(domain: &Domain, problem: &Problem, plan: &Plan) -> Option<BigRational> {
    let steps = plan.steps.iter().map(|step| PlanStep {
        action: Name::new(&step.action),
        arguments: step.arguments.iter().map(|argument| Name::new(argument)).collect(),
        start: Some(step.start.to_rational()),
        duration: (!step.duration.is_zero()).then(|| step.duration.to_rational()),
        line: 0,
    });
    let verdict = validate(domain, problem, &PlanText { steps: steps.collect() }, &Options::default());
    verdict.valid.then(|| verdict.metric.unwrap_or(verdict.total_time))
}

fn exact(domain: &Domain, problem: &Problem, horizon: Option<usize>) -> Solution {
    let task =
        ground_exact(domain, problem, &GroundConfig::default()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let solution = optimize_exact(&task, &Config::default().with_horizon(horizon));
    if let Some(plan) = &solution.plan {
        assert_eq!(metric(domain, problem, plan), Some(plan.cost.to_rational()), "{solution:?}");
    }
    solution
}

fn too_large(domain: &Domain, problem: &Problem) -> bool {
    match ground(domain, problem, &GroundConfig::default()) {
        Ok(_) => false,
        Err(errors) => {
            assert!(errors.iter().all(|error| error.code() == "E304"), "{errors:?}");
            true
        }
    }
}

const STEPS: usize = 4;
const NUMBERS: [&str; 2] = ["x", "y"];

#[derive(Debug, Clone)]
enum Change {
    ScaleUp(String),
    ScaleDown(String),
    Increase(String),
    IncreaseBy(String, usize),
    AssignProduct([String; 3]),
}

#[derive(Debug, Clone, Copy)]
enum Comparison {
    AtLeast,
    Above,
    Below,
}

#[derive(Debug, Clone)]
struct Action {
    requires: (usize, bool),
    sets: (usize, bool),
    compares: Option<(usize, Comparison, String)>,
    changes: [Option<Change>; 2],
    /// Three factors, a divisor, and whether the result is a reward.
    cost: ([String; 3], String, bool),
}

#[derive(Debug, Clone)]
struct Model {
    initial: [String; 2],
    actions: Vec<Action>,
    goal: Option<(usize, Comparison, String)>,
}

type Moment = (u8, [BigRational; 2]);

fn decimal(random: &mut Random) -> String {
    match random.below(8) {
        0 => "0.000000000001".to_owned(),
        1 => "1000000000000000000".to_owned(),
        2 | 3 => format!("{}.{:015}", random.below(9), random.below(999_999_999_999_999)),
        4 => format!("{}.5", random.below(4)),
        _ => (1 + random.below(4)).to_string(),
    }
}

fn positive(random: &mut Random) -> String {
    let decimal = decimal(random);
    if number(&decimal).is_zero() { "0.5".to_owned() } else { decimal }
}

fn comparison(random: &mut Random) -> (usize, Comparison, String) {
    let kind = [Comparison::AtLeast, Comparison::Above, Comparison::Below][random.below(3) as usize];
    (random.below(2) as usize, kind, decimal(random))
}

impl Change {
    fn random(random: &mut Random) -> Self {
        match random.below(5) {
            0 => Self::ScaleUp(decimal(random)),
            1 => Self::ScaleDown(positive(random)),
            2 => Self::Increase(decimal(random)),
            3 => Self::IncreaseBy(decimal(random), random.below(2) as usize),
            _ => Self::AssignProduct([decimal(random), decimal(random), decimal(random)]),
        }
    }

    fn text(&self, variable: &str) -> String {
        match self {
            Self::ScaleUp(factor) => format!("(scale-up ({variable}) {factor})"),
            Self::ScaleDown(divisor) => format!("(scale-down ({variable}) {divisor})"),
            Self::Increase(more) => format!("(increase ({variable}) {more})"),
            Self::IncreaseBy(factor, other) => {
                format!("(increase ({variable}) (* {factor} ({})))", NUMBERS[*other])
            }
            Self::AssignProduct([a, b, c]) => format!("(assign ({variable}) (* {a} {b} {c}))"),
        }
    }

    fn after(&self, variable: usize, numbers: &[BigRational; 2]) -> BigRational {
        let old = &numbers[variable];
        match self {
            Self::ScaleUp(factor) => old * number(factor),
            Self::ScaleDown(divisor) => old / number(divisor),
            Self::Increase(more) => old + number(more),
            Self::IncreaseBy(factor, other) => old + number(factor) * &numbers[*other],
            Self::AssignProduct(factors) => product(factors),
        }
    }
}

fn product(factors: &[String; 3]) -> BigRational {
    factors.iter().map(|factor| number(factor)).fold(BigRational::one(), |product, factor| product * factor)
}

fn holds((variable, kind, border): &(usize, Comparison, String), numbers: &[BigRational; 2]) -> bool {
    let (value, border) = (&numbers[*variable], number(border));
    match kind {
        Comparison::AtLeast => *value >= border,
        Comparison::Above => *value > border,
        Comparison::Below => *value < border,
    }
}

fn comparison_text((variable, kind, border): &(usize, Comparison, String)) -> String {
    let sign = match kind {
        Comparison::AtLeast => ">=",
        Comparison::Above => ">",
        Comparison::Below => "<",
    };
    format!("({sign} ({}) {border})", NUMBERS[*variable])
}

fn literal((fact, positive): (usize, bool)) -> String {
    if positive { format!("(p{fact})") } else { format!("(not (p{fact}))") }
}

impl Action {
    fn random(random: &mut Random, rewards: bool) -> Self {
        let mut changes = [None, None];
        for change in &mut changes {
            *change = (random.below(2) == 0).then(|| Change::random(random));
        }
        Self {
            requires: (random.below(3) as usize, random.below(2) == 0),
            sets: (random.below(3) as usize, random.below(3) > 0),
            compares: (random.below(2) == 0).then(|| comparison(random)),
            changes,
            cost: (
                [decimal(random), decimal(random), decimal(random)],
                positive(random),
                rewards && random.below(3) == 0,
            ),
        }
    }

    fn cost(&self) -> BigRational {
        let (factors, divisor, reward) = &self.cost;
        let cost = product(factors) / number(divisor);
        if *reward { -cost } else { cost }
    }

    fn after(&self, (facts, numbers): &Moment) -> Option<Moment> {
        let (fact, positive) = self.requires;
        let compares = self.compares.as_ref().is_none_or(|compares| holds(compares, numbers));
        if (facts >> fact & 1 == 1) != positive || !compares {
            return None;
        }
        let (fact, positive) = self.sets;
        let facts = if positive { facts | 1 << fact } else { facts & !(1 << fact) };
        let change = |variable: usize| match &self.changes[variable] {
            Some(change) => change.after(variable, numbers),
            None => numbers[variable].clone(),
        };
        Some((facts, [change(0), change(1)]))
    }

    fn text(&self, index: usize) -> String {
        let compares = self.compares.as_ref().map_or_else(String::new, comparison_text);
        let changes = self.changes.iter().zip(NUMBERS);
        let changes: String =
            changes.filter_map(|(change, variable)| Some(change.as_ref()?.text(variable))).collect();
        let change = if self.cost.2 { "decrease" } else { "increase" };
        format!(
            "(:action a{index} :parameters (?i ?j - fuel) :precondition (and (left ?i) (next ?i ?j) {} {compares})
               :effect (and (not (left ?i)) (left ?j) {} {changes}
                 ({change} (total-cost) (/ (* (c{index}) (d{index}) (e{index})) (f{index})))))\n",
            literal(self.requires),
            literal(self.sets)
        )
    }
}

impl Model {
    fn random(seed: u64, rewards: bool) -> Self {
        let random = &mut Random(seed);
        let count = 2 + random.below(3);
        Self {
            initial: [decimal(random), decimal(random)],
            actions: (0..count).map(|_| Action::random(random, rewards)).collect(),
            goal: (random.below(2) == 0).then(|| comparison(random)),
        }
    }

    fn text(&self) -> (String, String) {
        let mut functions = String::new();
        let mut values = String::new();
        let mut actions = String::new();
        for (index, action) in self.actions.iter().enumerate() {
            let (factors, divisor, _) = &action.cost;
            for (name, value) in ["c", "d", "e", "f"].iter().zip(factors.iter().chain([divisor])) {
                let _ = write!(functions, "({name}{index})");
                let _ = write!(values, "(= ({name}{index}) {value})");
            }
            actions += &action.text(index);
        }
        let fuel = |index: usize| format!("u{index}");
        let chain: String = (0..STEPS).map(|i| format!("(next {} {})", fuel(i), fuel(i + 1))).collect();
        let objects: Vec<_> = (0..=STEPS).map(fuel).collect();
        let [x, y] = &self.initial;
        let goal = self.goal.as_ref().map_or_else(String::new, comparison_text);
        let domain = format!(
            "(define (domain d) (:requirements :typing :fluents :negative-preconditions) (:types fuel)
               (:predicates (left ?i - fuel) (next ?i ?j - fuel) (p0) (p1) (p2))
               (:functions (x) (y) (total-cost) {functions})\n{actions})"
        );
        let problem = format!(
            "(define (problem p) (:domain d) (:objects {} - fuel)
               (:init (left u0) {chain} (p1) (= (x) {x}) (= (y) {y}) (= (total-cost) 0) {values})
               (:goal (and (p0) {goal})) (:metric minimize (total-cost)))",
            objects.join(" ")
        );
        (domain, problem)
    }

    /// Minimum cost for each number of actions.
    fn oracle(&self) -> Vec<Option<BigRational>> {
        let mut layer: HashMap<Moment, BigRational> = HashMap::new();
        let [x, y] = &self.initial;
        layer.insert((0b10, [number(x), number(y)]), BigRational::zero());
        let mut best = Vec::new();
        for _ in 0..=STEPS {
            let goal = |(facts, numbers): &Moment| {
                facts & 1 == 1 && self.goal.as_ref().is_none_or(|goal| holds(goal, numbers))
            };
            best.push(layer.iter().filter(|(moment, _)| goal(moment)).map(|(_, cost)| cost.clone()).min());
            let mut next: HashMap<Moment, BigRational> = HashMap::new();
            for (moment, cost) in &layer {
                for action in &self.actions {
                    let Some(after) = action.after(moment) else { continue };
                    let cost = cost + action.cost();
                    let known = next.entry(after).or_insert_with(|| cost.clone());
                    if cost < *known {
                        *known = cost;
                    }
                }
            }
            layer = next;
        }
        best
    }
}

/// Compares the planner with all plans of a random model. Returns whether the numbers are too large
/// for integers, and whether there is a plan.
fn check(seed: u64, rewards: bool, horizon: Option<usize>) -> (bool, bool) {
    let model = Model::random(seed, rewards);
    let (domain_text, problem_text) = model.text();
    let (domain, problem) = parse(&domain_text, &problem_text);
    let by_length = model.oracle();
    let solution = exact(&domain, &problem, horizon);
    let context =
        || format!("seed {seed}, {horizon:?}\n{domain_text}\n{problem_text}\n{solution:?}\n{by_length:?}");
    let found = solution.plan.as_ref().map(|plan| plan.cost.to_rational());
    let best = by_length.iter().flatten().min();
    let shortest = by_length.iter().position(Option::is_some);
    let within = |steps: usize| horizon.is_none_or(|horizon| steps <= horizon);
    let (status, expected) = if solution.unbounded.is_some() {
        assert!(solution.proof == Some(Proof::Search) && rewards, "{}", context());
        (Status::Feasible, shortest.and_then(|steps| by_length[steps].as_ref()))
    } else if best.is_none() {
        (Status::Unsolvable, None)
    } else if !shortest.is_some_and(within) {
        (Status::UnsolvableWithinHorizon, None)
    } else {
        let length = by_length.iter().position(|cost| cost.as_ref() == best).expect("a best plan");
        let limit = horizon.map_or(by_length.len(), |horizon| by_length.len().min(horizon + 1));
        let status = if within(length) { Status::Optimal } else { Status::Feasible };
        (status, by_length[..limit].iter().flatten().min())
    };
    assert_eq!((solution.status, found.as_ref()), (status, expected), "{}", context());
    let large = too_large(&domain, &problem);
    if !large && horizon.is_none() && !rewards {
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        let scaled = optimize(&task, &Config::default(), &mut |_| {});
        let other = scaled.plan.as_ref().map(|plan| plan.cost.to_rational());
        assert_eq!((scaled.status, other.as_ref()), (status, expected), "{}\n{scaled:?}", context());
    }
    (large, expected.is_some())
}

fn check_all(seeds: std::ops::Range<u64>) {
    let (mut large, mut solved) = (0, 0);
    let count = seeds.end - seeds.start;
    for seed in seeds {
        let (is_large, has_plan) = check(seed, false, None);
        large += u64::from(is_large);
        solved += u64::from(has_plan && is_large);
        check(seed, false, Some(1 + (seed % 3) as usize));
        check(seed, true, None);
    }
    assert!(
        large * 4 > count && solved * 20 > count,
        "{large} too large, {solved} of them solved, of {count}"
    );
}

#[test]
fn random_tasks_have_the_cost_of_all_sequences() {
    check_all(0..400);
}

#[test]
#[ignore = "takes minutes"]
fn many_random_tasks_have_the_cost_of_all_sequences() {
    check_all(1_000..20_000);
}

fn known(name: &str, domain: &str, problem: &str, expected: Option<&str>) -> Solution {
    let (domain, problem) = parse(domain, problem);
    assert!(too_large(&domain, &problem), "{name}");
    let solution = exact(&domain, &problem, None);
    let shown = solution.plan.as_ref().map(|plan| plan.cost.to_string());
    assert_eq!(shown.as_deref(), expected, "{name}: {solution:?}");
    let status = if expected.is_some() { Status::Optimal } else { Status::Unsolvable };
    assert_eq!(solution.status, status, "{name}: {solution:?}");
    solution
}

const ONE_ACTION: &str = "(define (domain d) (:requirements :fluents)
    (:predicates (done)) (:functions (total-cost) (big) (a) (b) (c) (level))";

fn problem(values: &str, goal: &str) -> String {
    format!(
        "(define (problem p) (:domain d) (:init (= (total-cost) 0) {values}) (:goal {goal})
           (:metric minimize (total-cost)))"
    )
}

#[test]
fn costs_may_be_of_any_size() {
    let domain = |effect: &str| {
        format!(
            "{ONE_ACTION} (:action go :parameters () :effect (and (done) (increase (total-cost) {effect}))))"
        )
    };
    let big = problem("(= (big) 18446744073709551616)", "(done)");
    known("2^128", &domain("(* (big) (big))"), &big, Some("340282366920938463463374607431768211456"));
    let factors = "(= (big) 1000000000000000000) (= (a) 0.000000000001)";
    known(
        "far apart",
        &domain("(+ (* (big) (big)) (a))"),
        &problem(factors, "(done)"),
        Some("1000000000000000000000000000000000000.000000000001"),
    );
    let factors = "(= (a) 1.234567890123457) (= (b) 2.345678901234567) (= (c) 3.456789012345679)";
    let product = number("1.234567890123457") * number("2.345678901234567") * number("3.456789012345679");
    let solution = known(
        "three factors",
        &domain("(* (a) (b) (c))"),
        &problem(factors, "(done)"),
        Some("10.010514789261832450638196765036016208971037801"),
    );
    assert_eq!(solution.plan.map(|plan| plan.cost.to_rational()), Some(product));
}

#[test]
fn effects_may_scale_by_fractions() {
    let domain = |effect: &str| {
        format!(
            "{ONE_ACTION} (:action go :parameters () :effect (and {effect} (increase (total-cost) 0.1))))"
        )
    };
    let halve = domain("(scale-up (level) 0.5)");
    known("ten halves", &halve, &problem("(= (level) 1024)", "(<= (level) 1)"), Some("1"));
    known("and one more", &halve, &problem("(= (level) 1024)", "(< (level) 1)"), Some("1.1"));
    let tenth = domain("(increase (level) (* 0.1 (level)))");
    // 1.1^7 < 2 < 1.1^8.
    known("growth", &tenth, &problem("(= (level) 1)", "(> (level) 2)"), Some("0.8"));
    // The level never becomes 0, but its digits become too many before this is proved.
    let (domain, problem) = parse(&halve, &problem("(= (level) 1024)", "(<= (level) 0)"));
    let solution = exact(&domain, &problem, None);
    assert_eq!((solution.status, solution.plan), (Status::Unknown, None));
}

#[test]
fn times_may_be_quotients_of_measured_speeds() {
    let speeds = ["1.234567890123457", "0.987654321098761", "2.345678901234563", "1.111111111111117"];
    let speeds: Vec<_> = speeds.into_iter().chain(["3.141592653589793", "2.718281828459045"]).collect();
    let mut values = String::new();
    let mut total = BigRational::zero();
    for (index, speed) in speeds.iter().enumerate() {
        let _ = write!(values, "(next w{index} w{}) (= (speed w{index}) {speed})", index + 1);
        total += number("12.345678901234567") / number(speed);
    }
    let domain = "(define (domain d) (:requirements :typing :fluents :durative-actions) (:types place)
      (:predicates (at ?w - place) (next ?a ?b - place)) (:functions (speed ?w - place) (length))
      (:durative-action move :parameters (?a ?b - place) :duration (= ?duration (/ (length) (speed ?a)))
        :condition (and (at start (at ?a)) (over all (next ?a ?b)))
        :effect (and (at start (not (at ?a))) (at end (at ?b)))))";
    let problem = format!(
        "(define (problem p) (:domain d) (:objects w0 w1 w2 w3 w4 w5 w6 - place)
           (:init (at w0) (= (length) 12.345678901234567) {values}) (:goal (at w6)) (:metric minimize (total-time)))"
    );
    let (domain, problem) = parse(domain, &problem);
    assert!(too_large(&domain, &problem));
    let solution = exact(&domain, &problem, None);
    assert_eq!(solution.status, Status::Optimal, "{solution:?}");
    let plan = solution.plan.expect("a plan");
    assert_eq!((plan.steps.len(), plan.cost.to_rational()), (6, total.clone()));
    assert_eq!(plan.makespan().to_rational(), total);
    assert!(plan.cost.to_rational().is_positive());
}

/// A random task that was once reported as unsolvable: an effect that contradicts itself had removed the
/// whole action.
#[test]
fn a_task_of_another_generator_has_its_plan() {
    let Some(directory) = data("field/soundness/random/false-noplan-dur-1065") else { return };
    let file = |name: &str| std::fs::read_to_string(directory.join(name)).expect("a file");
    known("1065", &file("d.pddl"), &file("p.pddl"), Some("0"));
}
