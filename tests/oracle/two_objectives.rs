//! Generator of tasks with two conflicting objectives, whose fronts have several points.
//!
//! A courier moves in a graph whose edges have a length and a danger. Some edges have a gate that needs a key, and
//! moves need fuel. The oracle is a label-correcting search over the states: place, key and fuel.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use fastrand::Rng;
use metaplan::mission::Planning as _;
use num_rational::BigRational;
use planner::{Config, Limits, Status};

use crate::certify;
use crate::judge::{Case, Mode, Tally, Truth, is_over, rational, read, setting};

/// An edge from one place to another one. Length and danger are in halves.
struct Edge {
    from: usize,
    to: usize,
    length: u32,
    danger: u32,
    has_gate: bool,
}

struct Courier {
    places: usize,
    edges: Vec<Edge>,
    key_place: usize,
    fuel: u32,
    /// Moves take time, and the first objective is the total time.
    is_timed: bool,
    /// The planner gets the objectives in the order (risk), first objective.
    is_exchanged: bool,
}

fn courier(rng: &mut Rng) -> Courier {
    let places = rng.usize(3..7);
    let is_timed = rng.u32(0..3) == 0;
    let mut edges: Vec<Edge> = Vec::new();
    for _ in 0..rng.usize(2 * places..4 * places + 4) {
        let (from, to) = (rng.usize(0..places), rng.usize(0..places));
        let least = u32::from(is_timed);
        let length = rng.u32(least..12);
        // Many short edges are dangerous, so that the objectives conflict.
        let danger = if rng.u32(0..3) == 0 { rng.u32(0..8) } else { (13 - length) * rng.u32(0..3) };
        let edge = Edge { from, to, length, danger, has_gate: rng.u32(0..4) == 0 };
        // Two edges between the same places differ in their gate.
        if from != to && edges.iter().all(|e| (e.from, e.to, e.has_gate) != (from, to, edge.has_gate)) {
            edges.push(edge);
        }
    }
    let (key_place, fuel) = (rng.usize(0..places), rng.u32(3..8));
    Courier { places, edges, key_place, fuel, is_timed, is_exchanged: rng.bool() }
}

fn half(number: u32) -> String {
    format!("{}{}", number / 2, if number % 2 == 1 { ".5" } else { "" })
}

fn text(courier: &Courier) -> (String, String) {
    let action = |name: &str, edge: &str, condition: &str| {
        let values = |function: &str| format!("({function}-{edge} ?p ?q)");
        let conditions = format!("(at ?p) ({edge} ?p ?q) (>= (fuel) 1) {condition}");
        let effects = format!("(decrease (fuel) 1) (increase (risk) {})", values("danger"));
        let parameters = ":parameters (?p ?q - place)";
        if courier.is_timed {
            let start = format!("(at start (and {conditions}))");
            format!(
                "(:durative-action {name} {parameters} :duration (= ?duration {}) :condition (and {start}) :effect
                (and (at start (not (at ?p))) (at end (at ?q)) (at end (and {effects}))))",
                values("length")
            )
        } else {
            format!(
                "(:action {name} {parameters} :precondition (and {conditions}) :effect
                (and (not (at ?p)) (at ?q) {effects} (increase (cost) {})))",
                values("length")
            )
        }
    };
    let functions = "(length-road ?p ?q - place) (length-gate ?p ?q - place) (danger-road ?p ?q - place)
        (danger-gate ?p ?q - place)";
    let domain = format!(
        "(define (domain courier) (:requirements :typing :numeric-fluents :durative-actions) (:types place)
        (:predicates (at ?p - place) (road ?p ?q - place) (gate ?p ?q - place) (key-at ?p - place) (has-key))
        (:functions (cost) (risk) (fuel) {functions})
        (:action take :parameters (?p - place) :precondition (and (at ?p) (key-at ?p)) :effect (has-key))
        {} {})",
        action("drive", "road", ""),
        action("pass", "gate", "(has-key)")
    );
    let objects: String = (0..courier.places).map(|place| format!(" p{place}")).collect();
    let mut facts = format!(
        "(at p0) (key-at p{}) (= (cost) 0) (= (risk) 0.5) (= (fuel) {})",
        courier.key_place, courier.fuel
    );
    for Edge { from, to, length, danger, has_gate } in &courier.edges {
        let edge = if *has_gate { "gate" } else { "road" };
        let (length, danger) = (half(*length), half(*danger));
        let _ = write!(
            facts,
            " ({edge} p{from} p{to}) (= (length-{edge} p{from} p{to}) {length}) (= (danger-{edge} p{from} p{to}) {danger})"
        );
    }
    let problem = format!(
        "(define (problem p) (:domain courier) (:objects{objects} - place) (:init {facts}) (:goal (at p{})))",
        courier.places - 1
    );
    (domain, problem)
}

/// Returns the values of all Pareto-optimal plans, sorted, in halves.
fn front(courier: &Courier) -> Vec<[u32; 2]> {
    let dominates = |a: &[u32; 2], b: &[u32; 2]| a[0] <= b[0] && a[1] <= b[1];
    let mut labels: BTreeMap<(usize, bool, u32), Vec<[u32; 2]>> = BTreeMap::new();
    let mut open = vec![((0, false, courier.fuel), [0, 1])];
    while let Some((state, label)) = open.pop() {
        let present = labels.entry(state).or_default();
        if present.iter().any(|old| dominates(old, &label)) {
            continue;
        }
        present.retain(|old| !dominates(&label, old));
        present.push(label);
        let (place, has_key, fuel) = state;
        if place == courier.key_place {
            open.push(((place, true, fuel), label));
        }
        for edge in courier.edges.iter().filter(|edge| edge.from == place && fuel > 0) {
            if has_key || !edge.has_gate {
                open.push(((edge.to, has_key, fuel - 1), [label[0] + edge.length, label[1] + edge.danger]));
            }
        }
    }
    let goals = labels.iter().filter(|((place, ..), _)| *place == courier.places - 1);
    let mut points: Vec<[u32; 2]> = goals.flat_map(|(_, labels)| labels).copied().collect();
    let candidates = points.clone();
    points.retain(|point| candidates.iter().all(|other| other == point || !dominates(other, point)));
    points.sort_unstable();
    points.dedup();
    points
}

fn judge_seed(seed: u64, tally: &mut Tally) {
    let mut rng = Rng::with_seed(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    let courier = courier(&mut rng);
    let (domain, problem_text) = text(&courier);
    let case = Case {
        name: format!("courier-{seed}"),
        domain,
        problem: problem_text,
        mode: Mode::Sequential,
        maximize: false,
        truth: Truth::Open(None),
        execute: Box::new(|_| Err("not executed".to_owned())),
        certify: true,
        limit: Duration::from_secs(1),
        second_limit: Duration::from_secs(1),
    };
    tally.tasks += 1;
    let (mission, problem) = read(&case.domain, &case.problem).expect("a task");
    let first = if courier.is_timed { "total-time" } else { "(cost)" };
    let mut objectives =
        [first, "(risk)"].map(|text| mission.objective(&problem, text).expect("an objective"));
    let mut expected = front(&courier);
    if courier.is_exchanged {
        objectives.reverse();
        expected = expected.iter().rev().map(|[first, second]| [*second, *first]).collect();
    }
    let limits = Limits::none().with_time(5 * case.limit);
    let task = mission.ground(&problem, &objectives, &limits).expect("a ground task");
    let computed = planner::pareto(&task, &Config::default().with_limits(limits), &mut |_| {});
    match computed.status {
        Status::Optimal => {}
        Status::Unsolvable if expected.is_empty() => return tally.count("courier: no plan"),
        Status::Unsolvable => return tally.fail(&case, "a front is wrong", "no plan"),
        _ => return tally.count("courier: limit"),
    }
    let whole = |halves: u32| BigRational::new(halves.into(), 2.into());
    let expected: Vec<Vec<BigRational>> =
        expected.iter().map(|point| point.iter().map(|value| whole(*value)).collect()).collect();
    let points: Vec<Vec<BigRational>> =
        computed.points.iter().map(|point| point.values.iter().map(rational).collect()).collect();
    if points != expected {
        return tally.fail(&case, "a front is wrong", &format!("{points:?}, not {expected:?}"));
    }
    tally.count(format!("courier: {} points", points.len()));
    let front = (&mission, &problem);
    let metrics = objectives.map(|objective| objective.metric);
    certify::check_front(&case, front, &metrics, (&computed.points, false), tally);
    // Fronts that lack a point.
    let name = case.name.clone();
    let mut case = case;
    for position in 0..points.len() {
        case.name = format!("{name}-without-{position}");
        let mut incomplete = computed.points.clone();
        incomplete.remove(position);
        certify::check_front(&case, front, &metrics, (&incomplete, true), tally);
    }
}

#[test]
fn certificates_of_fronts_are_accepted_only_for_true_fronts() {
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", 40));
    let mut tally = Tally::default();
    for seed in from..from + tasks {
        judge_seed(seed, &mut tally);
        if is_over(&tally) {
            break;
        }
    }
    tally.finish();
}
