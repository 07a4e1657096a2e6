//! Certificates of random tasks: true claims must be accepted, and false claims must be rejected, also with changed
//! certificates.

use std::fmt::Write as _;

use certificate::{Faithful, check as check_argument, faithful, verification_conditions, witness};
use metaplan_planner::{Certificate, Config, GroundConfig, Limits, Status, certify, ground, optimize};
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use pddl::{Source, read};
use serde_json::{Value, json};
use testing::missions::Mission;
use testing::random::Random;

fn files(seed: u64) -> (Domain, Problem) {
    let mission = Mission::random(seed);
    let (domain, problem) = (mission.domain(), mission.problem());
    let (domain, problem, _) = read(&Source::new("domain", domain), &Source::new("problem", problem))
        .unwrap_or_else(|errors| panic!("seed {seed}: {errors:?}"));
    (domain, problem)
}

fn certified(seed: u64) -> (Certificate, Option<BigRational>) {
    let mission = Mission::random(seed);
    let (domain, problem) = files(seed);
    let task =
        ground(&domain, &problem, &GroundConfig::default()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    let cost = solution.plan.as_ref().map(|plan| plan.cost.to_rational());
    assert_eq!(solution.status, if cost.is_some() { Status::Optimal } else { Status::Unsolvable });
    assert_eq!(cost, mission.oracle().map(|cost| BigRational::from_integer(cost.into())), "seed {seed}");
    let certificate = certify(&task, &solution, &Limits::none());
    (certificate.unwrap_or_else(|reason| panic!("seed {seed}: {reason}")), cost)
}

/// A higher optimal cost, and unsolvability.
fn false_claims(cost: &BigRational) -> [Option<BigRational>; 2] {
    [Some(cost + BigRational::from_integer(1.into())), None]
}

fn compared((domain, problem): &(Domain, Problem), task: &str) -> Faithful {
    match witness(domain, problem, task, &|| false) {
        Ok(witness) => faithful(domain, problem, task, &witness, &|| false),
        Err(verdict) => verdict,
    }
}

fn check(seed: u64) {
    let (certificate, cost) = certified(seed);
    let Certificate { task: written, argument } = &certificate;
    let accepted = check_argument(written, argument, cost.as_ref());
    assert!(accepted.is_ok(), "seed {seed}: {accepted:?}");
    let found = compared(&files(seed), written);
    assert!(matches!(found, Faithful::Yes { .. }), "seed {seed}: {found:?}");
    for claim in cost.iter().flat_map(false_claims) {
        let accepted = check_argument(written, argument, claim.as_ref());
        assert!(accepted.is_err(), "seed {seed}: {claim:?} is accepted");
    }
}

#[test]
fn true_claims_are_accepted_and_false_claims_rejected() {
    (0..150).for_each(check);
}

/// Sleds with limited capacity, so that more supplies can help and can hurt.
fn expedition(seed: u64) -> (String, String) {
    let mut random = Random(seed);
    let domain = "(define (domain expedition) (:types sled place)
        (:predicates (at ?s - sled ?p - place) (next ?p ?q - place))
        (:functions (load ?s - sled) (capacity ?s - sled) (stock ?p - place) (total-cost))
        (:action forwards :parameters (?s - sled ?p ?q - place)
          :precondition (and (at ?s ?p) (>= (load ?s) 1) (next ?p ?q))
          :effect (and (not (at ?s ?p)) (at ?s ?q) (decrease (load ?s) 1) (increase (total-cost) 1)))
        (:action store :parameters (?s - sled ?p - place) :precondition (and (at ?s ?p) (>= (load ?s) 1))
          :effect (and (increase (stock ?p) 1) (decrease (load ?s) 1) (increase (total-cost) 1)))
        (:action retrieve :parameters (?s - sled ?p - place)
          :precondition (and (at ?s ?p) (>= (stock ?p) 1) (> (capacity ?s) (load ?s)))
          :effect (and (decrease (stock ?p) 1) (increase (load ?s) 1) (increase (total-cost) 1))))";
    let mut init = "(= (total-cost) 0) (next p0 p1) (next p1 p2)".to_owned();
    for place in 0..3 {
        let _ = write!(init, " (= (stock p{place}) {})", random.below(3));
    }
    for sled in 0..2 {
        let (capacity, load) = (1 + random.below(2), random.below(2));
        let _ = write!(init, " (at s{sled} p0) (= (capacity s{sled}) {capacity}) (= (load s{sled}) {load})");
    }
    let problem = format!(
        "(define (problem p) (:domain expedition) (:objects s0 s1 - sled p0 p1 p2 - place) (:init {init})
           (:goal (and (at s0 p{}) (at s1 p{}))) (:metric minimize (total-cost)))",
        random.below(3),
        1 + random.below(2)
    );
    (domain.to_owned(), problem)
}

#[test]
fn certificates_hold_for_tasks_in_which_more_can_help_and_hurt() {
    let mut proved = 0;
    for seed in 0..60 {
        let (domain, problem) = expedition(seed);
        let (domain, problem, _) = read(&Source::new("domain", domain), &Source::new("problem", problem))
            .unwrap_or_else(|errors| panic!("seed {seed}: {errors:?}"));
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("small");
        let solution = optimize(&task, &Config::default(), &mut |_| {});
        let cost = solution.plan.as_ref().map(|plan| plan.cost.to_rational());
        let Ok(certificate) = certify(&task, &solution, &Limits::none()) else { continue };
        let accepted = check_argument(&certificate.task, &certificate.argument, cost.as_ref());
        assert!(accepted.is_ok(), "seed {seed}: {accepted:?}");
        for claim in cost.iter().flat_map(false_claims) {
            let accepted = check_argument(&certificate.task, &certificate.argument, claim.as_ref());
            assert!(accepted.is_err(), "seed {seed}: {claim:?} is accepted");
        }
        proved += u32::from(cost.is_some_and(|cost| cost > BigRational::from_integer(2.into())));
    }
    assert!(proved > 10, "only {proved} tasks with certificates need more than two steps");
}

fn mutate(value: &mut Value, random: &mut Random) {
    match value {
        Value::Array(elements) if !elements.is_empty() => {
            let position = random.below(elements.len() as u64) as usize;
            match random.below(12) {
                0 => drop(elements.remove(position)),
                1 => elements.push(elements[position].clone()),
                _ => mutate(&mut elements[position], random),
            }
        }
        Value::Object(fields) if !fields.is_empty() => {
            let position = random.below(fields.len() as u64) as usize;
            if let Some((_, field)) = fields.iter_mut().nth(position) {
                mutate(field, random);
            }
        }
        Value::Number(number) => {
            let old = number.as_i64().unwrap_or_default();
            *value = [json!(old + 1), json!(old - 1), json!(old + random.below(100)), json!(0), Value::Null]
                [random.below(5) as usize]
                .clone();
        }
        Value::Null => *value = json!(random.below(50)),
        Value::Bool(flag) => *flag = !*flag,
        other => *other = json!("else"),
    }
}

/// Checks that a changed argument proves no false claim, and that a changed task fails the comparison with
/// the files or proves no false claim.
fn withstands(seed: u64, mutants: usize) {
    let (certificate, cost) = certified(seed);
    let files = files(seed);
    let mut random = Random(seed);
    let argument: Value = serde_json::from_str(&certificate.argument).expect("JSON");
    let written: Value = serde_json::from_str(&certificate.task).expect("JSON");
    for number in 0..mutants {
        let mut mutant = argument.clone();
        for _ in 0..=random.below(3) {
            mutate(&mut mutant, &mut random);
        }
        for claim in cost.iter().flat_map(false_claims) {
            let accepted = check_argument(&certificate.task, &mutant.to_string(), claim.as_ref());
            assert!(accepted.is_err(), "seed {seed}, mutant {number}: {claim:?} is accepted\n{mutant}");
        }
        let mut mutant = written.clone();
        mutate(&mut mutant, &mut random);
        // A changed task that passes the comparison must not prove a false claim.
        let written = mutant.to_string();
        let stands = matches!(compared(&files, &written), Faithful::Yes { .. });
        for claim in cost.iter().flat_map(false_claims).chain([cost.clone()]) {
            let accepted = check_argument(&written, &certificate.argument, claim.as_ref()).is_ok();
            assert!(
                !(accepted && stands) || claim == cost,
                "seed {seed}, mutant {number}: {claim:?}\n{written}"
            );
        }
    }
}

#[test]
fn changed_arguments_prove_nothing_that_is_false() {
    (200..230).for_each(|seed| withstands(seed, 40));
}

/// Ambiguous tasks prove nothing: an operator that changes a number twice, a number with two coefficients in
/// an expression, and combinations of designs that do not exist.
#[test]
fn tasks_that_can_be_read_in_two_ways_are_refused() {
    let (mut twice, mut factors, mut designs) = (0, 0, 0);
    let refused = |seed: u64, task: &Value, certificate: &Certificate, cost: &BigRational| {
        let written = task.to_string();
        let found = compared(&files(seed), &written);
        assert!(matches!(found, Faithful::No(_)), "seed {seed}: {written}");
        let accepted = check_argument(&written, &certificate.argument, Some(cost));
        assert!(accepted.is_err(), "seed {seed}: {written}");
    };
    for seed in 0..20 {
        let (certificate, cost) = certified(seed);
        let Some(cost) = cost else { continue };
        let task: Value = serde_json::from_str(&certificate.task).expect("JSON");
        let operators = task["operators"].as_array().expect("operators");
        if let Some(at) = operators.iter().position(|own| own["changes"][0][1]["factors"].is_array()) {
            let mut mutant = task.clone();
            let changes = mutant["operators"][at]["changes"].as_array_mut().expect("changes");
            changes.push(json!([changes[0][0], { "quantity": { "constant": 0 } }]));
            refused(seed, &mutant, &certificate, &cost);
            twice += 1;
            let mut mutant = task.clone();
            let own = mutant["operators"][at]["changes"][0][1]["factors"].as_array_mut().expect("factors");
            own.insert(0, json!([own[0][0], -5]));
            refused(seed, &mutant, &certificate, &cost);
            factors += 1;
        }
        if operators
            .iter()
            .any(|own| !task["uses"][own["uses"].as_u64().expect("uses") as usize][0].is_null())
        {
            for combination in [json!([60_000]), json!([0, 0])] {
                let mut mutant = task.clone();
                for exclusions in mutant["exclusions"].as_array_mut().expect("exclusions") {
                    *exclusions = json!([{ "slots": [0], "combinations": [combination] }]);
                }
                refused(seed, &mutant, &certificate, &cost);
                designs += 1;
            }
        }
    }
    assert!(twice > 0 && factors > 0 && designs > 0, "{twice}, {factors}, {designs}");
}

/// An action instance that changes nothing has no operator and needs none.
#[test]
fn instances_without_effect_need_no_operator() {
    let domain = "(define (domain d) (:requirements :typing :action-costs)
      (:types design place - object) (:constants slow fast - design)
      (:predicates (at ?p - place) (mode ?d - design) (suits ?d - design))
      (:functions (total-cost))
      (:action reconfigure :parameters (?from ?to - design)
        :precondition (and (mode ?from) (suits ?to))
        :effect (and (not (mode ?from)) (mode ?to) (increase (total-cost) 1)))
      (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (mode fast))
        :effect (and (not (at ?a)) (at ?b) (increase (total-cost) 2))))";
    let problem = "(define (problem p) (:domain d) (:objects a b - place)
      (:init (at a) (mode slow) (suits slow) (suits fast) (= (total-cost) 0))
      (:goal (at b)) (:metric minimize (total-cost)))";
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("a mission");
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    let certificate = certify(&task, &solution, &Limits::none()).expect("a certificate");
    let found = compared(&(domain, problem), &certificate.task);
    // The idle instances exchange a design for itself (two instances) or move from a place to itself (two
    // instances).
    assert!(matches!(found, Faithful::Yes { instances: 8, idle: 4, .. }), "{found:?}");
}

fn answers(solver: &str, certificate: &Certificate, claim: Option<&BigRational>) -> Vec<String> {
    let conditions = verification_conditions(&certificate.task, &certificate.argument, claim);
    let conditions = conditions.expect("documents").expect("no derived variables");
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("argument.smt2");
    std::fs::write(&file, conditions).expect("a file");
    let output = std::process::Command::new(solver).arg(&file).output().expect("the solver runs");
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

/// The environment variable `METAPLAN_SMT` must name an SMT solver that reads SMT-LIB 2, such as Z3 (`python3
/// -m venv z3; z3/bin/pip install z3-solver`, then `METAPLAN_SMT=z3/bin/z3`).
#[test]
#[ignore = "needs an SMT solver"]
fn an_smt_solver_accepts_true_claims_and_rejects_false_claims() {
    let Ok(solver) = std::env::var("METAPLAN_SMT") else { panic!("METAPLAN_SMT names no solver") };
    for seed in 0..100 {
        let (certificate, cost) = certified(seed);
        let found = answers(&solver, &certificate, cost.as_ref());
        assert!(found.len() >= 2 && found.iter().all(|answer| answer == "unsat"), "seed {seed}: {found:?}");
        for claim in cost.iter().flat_map(false_claims) {
            let found = answers(&solver, &certificate, claim.as_ref());
            assert!(found.iter().any(|answer| answer == "sat"), "seed {seed}, {claim:?}: {found:?}");
        }
    }
}

#[test]
#[ignore = "minutes"]
fn many_changed_arguments_prove_nothing_that_is_false() {
    (1_000..2_000).for_each(|seed| withstands(seed, 100));
}

/// Whether plans are measured by time follows from the domain: a witness may contain atoms that no plan reaches, such as
/// those with which two actions enable each other.
#[test]
fn the_measure_of_plans_does_not_depend_on_the_witness() {
    let domain = "(define (domain d) (:requirements :durative-actions) (:predicates (p) (q) (r) (s))
      (:durative-action never :parameters () :duration (= ?duration 1)
        :condition (at start (q)) :effect (at end (r)))
      (:action first :parameters () :precondition (s) :effect (q))
      (:action second :parameters () :precondition (q) :effect (s))
      (:action do :parameters () :effect (p)))";
    let problem = "(define (problem x) (:domain d) (:init) (:goal (p)))";
    let files = read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let files = (files.0, files.1);
    let task = ground(&files.0, &files.1, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    assert_eq!(solution.plan.as_ref().map(|plan| plan.cost.to_string()), Some("0".into()));
    let certificate = certify(&task, &solution, &Limits::none()).expect("a certificate");
    let honest = witness(&files.0, &files.1, &certificate.task, &|| false).expect("a witness");
    let answer = faithful(&files.0, &files.1, &certificate.task, &honest, &|| false);
    assert!(matches!(answer, Faithful::Yes { timed: true, .. }), "{answer:?}");
    let mut larger: Value = serde_json::from_str(&honest).expect("JSON");
    let atoms = larger["atoms"].as_array_mut().expect("a list");
    atoms.extend(["(q)", "(r)", "(s)"].map(Value::from));
    for witness in [honest, larger.to_string()] {
        let answer = faithful(&files.0, &files.1, &certificate.task, &witness, &|| false);
        assert!(!matches!(answer, Faithful::Yes { timed: false, .. }), "{answer:?}\n{witness}");
    }
}
