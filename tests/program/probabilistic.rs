//! Tests of probabilistic model checking of missions: known results, agreement with the planner, and the commands.

#![allow(clippy::print_stdout)]

use metaplan::comparison::{
    Arc, Coadaptation, MapOptions, Priority, Process, Risk, Traversal, import_map, program, published,
    published_program, shortest_routes,
};
use metaplan::mission::{Mission, Planning as _};
use metaplan::setup::Setup;
use num_rational::BigRational;
use probabilistic::check::{Answer, Exactness, Options, Outcome, check};
use probabilistic::explore::{Bounds, explore};
use probabilistic::solve::solve;
use probabilistic::{Direction, Number, Problem, property};
use serde_json::{Value, json};
use test_resources::data;

use crate::common::{headlines, metaplan, metaplan_in, root};

pub fn mission(map: &str, options: &MapOptions) -> (tempfile::TempDir, Setup) {
    let files = import_map("map", map, options).expect("a map");
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).expect("written");
    write("camara.toml", &files.manifest);
    write("camara.ttl", &files.knowledge);
    write("domain.pddl", &files.domain);
    write("problem.pddl", &files.problem);
    let setup = Setup::read(&directory.path().join("camara.toml")).expect("a mission");
    (directory, setup)
}

pub fn coadaptation(setup: &Setup) -> Coadaptation {
    let (problem, _) = setup.mission.filled().expect("filled");
    Coadaptation::new(&setup.mission, &problem, &setup.roles).expect("a process")
}

pub fn places(start: &str, goal: &str) -> MapOptions {
    let (start, goal) = (start.to_owned(), goal.to_owned());
    MapOptions { start, goal, battery: None, speeds: false, ..MapOptions::default() }
}

pub fn dark() -> Vec<(String, String)> {
    let pairs = [("l18", "l19"), ("l3", "l4"), ("l11", "l12")];
    pairs.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect()
}

fn answer(mission: &Coadaptation, risk: Risk, question: &str) -> Outcome {
    let model = program(mission, risk);
    let options = Options::default().with_exactness(Exactness::Always);
    check(&model, &property::parse(question).expect("a property"), &options).expect("an answer").outcome
}

fn fraction(answer: &Answer) -> String {
    let exact = answer.quantity().and_then(|quantity| quantity.exact.clone());
    exact.map_or_else(|| format!("{answer:?}"), |exact| exact.to_string())
}

#[test]
fn known_results_on_the_map_of_camara() {
    let Some(path) = data("real/map/map-p2cp3.json") else { return };
    let map = std::fs::read_to_string(path).expect("readable");
    // More speeds yield more configurations, but no less time or energy: slower speeds take more of both.
    for (speeds, configurations) in [(false, 6), (true, 18)] {
        known_results(&map, speeds, configurations);
    }
}

fn known_results(map: &str, speeds: bool, configurations: usize) {
    let no_risk = Risk::default();
    let places = |start: &str, goal: &str| MapOptions { speeds, ..places(start, goal) };
    let (_directory, with_dark_ways) = mission(map, &MapOptions { dark: dark(), ..places("l1", "l18") });
    let (_directory, lit) = mission(map, &places("l1", "l18"));
    assert_eq!(coadaptation(&lit).configurations.len(), configurations);
    let cases = [
        (&with_dark_ways, no_risk, "R{\"time\"}min=? [ F \"goal\" ]", "1204733/10000"),
        (&with_dark_ways, no_risk, "R{\"energy\"}min=? [ F \"goal\" ]", "5587"),
        (&lit, no_risk, "R{\"time\"}min=? [ F \"goal\" ]", "15277/200"),
        (
            &lit,
            Risk { collisions: true, failures: true, ..no_risk },
            "R{\"time\"}min=? [ F \"goal\" ]",
            "15277/200",
        ),
    ];
    for (mission, risk, question, expected) in cases {
        let Outcome::Value(value) = answer(&coadaptation(mission), risk, question) else {
            panic!("no value")
        };
        assert_eq!(fraction(&value), expected, "{question}");
    }
    if speeds {
        return; // At safe speed there are no collisions, so the front differs.
    }
    let (_directory, mut without_kinect) = mission(map, &places("l25", "l7"));
    without_kinect.mission.fail("c_kinect").expect("a component");
    let question = "multi(R{\"time\"}min=? [ F \"goal\" ], Pmax=? [ F \"safe_goal\" ])";
    let risk = Risk { collisions: true, ..no_risk };
    let Outcome::Front(front) = answer(&coadaptation(&without_kinect), risk, question) else {
        panic!("no front")
    };
    let front: Vec<_> = front.iter().map(|pair| pair.each_ref().map(fraction)).collect();
    let expected = [["525887/5000", "269230769/500000000"], ["86487/625", "1"]];
    assert_eq!(front, expected.map(|pair| pair.map(str::to_owned)));
}

/// Returns the exact minimum expected time to the goal; `None` if no policy reaches the goal with probability
/// 1.
fn least_time(mission: &Coadaptation, risk: Risk) -> Option<BigRational> {
    let process = Process::<BigRational>::new(mission, risk, &["time"]);
    let explored = explore(&process, &Bounds::default()).expect("explored");
    let goal = process.goals(&explored.states);
    let problem = Problem::new(&explored.mdp, Direction::Min, Some(&explored.rewards[0]), &goal);
    let solution = solve(problem, None).expect("small enough");
    (!solution.infinite.contains(0)).then(|| solution.values[0].clone())
}

/// Returns the cost of the best plan, or `None` if the planner proves that there is no plan.
fn planned(mission: &Mission) -> Option<f64> {
    let (problem, _) = mission.filled().expect("filled");
    let task = mission.ground(&problem, &[], &planner::Limits::none()).expect("ground");
    let solution = planner::optimize(&task, &planner::Config::default(), &mut |_| {});
    match solution.status {
        planner::Status::Optimal => solution.plan.map(|plan| plan.cost.to_f64()),
        planner::Status::Unsolvable => None,
        unexpected => panic!("{unexpected:?}"),
    }
}

/// Asserts that the process and the planner have the same optimum. Returns `true` if there is a plan.
fn agree(label: &str, setup: &Setup, risk: Risk) -> bool {
    let (process, plan) = (least_time(&coadaptation(setup), risk), planned(&setup.mission));
    let is_equal = match (&process, plan) {
        (Some(time), Some(cost)) => (Number::to_f64(time) - cost).abs() < 1e-9,
        (None, None) => true,
        _ => false,
    };
    assert!(is_equal, "{label}: process {process:?}, planner {plan:?}");
    plan.is_some()
}

#[derive(Debug, Default)]
struct Agreement {
    solved: usize,
    unsolvable: usize,
}

impl Agreement {
    fn count(&mut self, solved: bool) {
        *(if solved { &mut self.solved } else { &mut self.unsolvable }) += 1;
    }
}

/// Continues until `count` pairs have a plan. Returns `None` if the map is not available.
fn pairs_of_the_map(count: usize) -> Option<Agreement> {
    let map = std::fs::read_to_string(data("real/map/map-p2cp3.json")?).expect("readable");
    let (_directory, setup) = mission(&map, &MapOptions { dark: dark(), ..places("l1", "l18") });
    let names = coadaptation(&setup).places;
    let mut random = Random(7);
    let (mut agreement, mut checked_pairs) = (Agreement::default(), std::collections::BTreeSet::new());
    while agreement.solved < count {
        let (start, goal) = (random.below(names.len()), random.below(names.len()));
        if start == goal || !checked_pairs.insert((start, goal)) {
            continue;
        }
        let mut setup = setup.clone();
        setup.mission.set("robot_at", &names[start]).expect("a place");
        setup.mission.aim("robot_at", &names[goal]);
        let label = format!("{} to {}", names[start], names[goal]);
        agreement.count(agree(&label, &setup, Risk::default()));
    }
    Some(agreement)
}

struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound
    }
}

/// Returns a random map in the importer's format, and its number of places. The last place may be
/// unreachable.
fn random_map(random: &mut Random) -> (String, usize) {
    let n = 3 + random.below(6);
    let mut neighbours = vec![Vec::new(); n];
    let mut time = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            if random.below(100) < 45 {
                neighbours[a].push(format!("p{b}"));
                neighbours[b].push(format!("p{a}"));
                let mut entry = json!({ "from": format!("p{a}"), "to": format!("p{b}") });
                for design in ["amcl-kinect", "amcl-lidar", "mrpt-kinect", "aruco"] {
                    entry[design] = json!({ "mean": (1 + random.below(400)) as f64 / 10.0 });
                }
                time.push(entry);
            }
        }
    }
    let nodes: Vec<Value> = neighbours
        .iter()
        .enumerate()
        .map(|(n, neighbours_of_place)| {
            let coords = json!({ "x": random.below(20), "y": random.below(20) });
            json!({ "node-id": format!("p{n}"), "coords": coords, "connected-to": neighbours_of_place })
        })
        .collect();
    (json!({ "map": nodes, "time": time }).to_string(), n)
}

/// Continues until `count` missions have a plan.
fn generated_missions(count: usize) -> Agreement {
    let mut random = Random(11);
    let mut agreement = Agreement::default();
    for number in 0.. {
        if agreement.solved == count {
            break;
        }
        let (map, n) = random_map(&mut random);
        let has_battery = number % 2 == 1;
        let options = MapOptions {
            battery: has_battery.then(|| 500 + random.below(4000) as u32),
            switch_seconds: random.below(8) as u32,
            speeds: number % 4 < 2,
            ..places("p0", &format!("p{}", n - 1))
        };
        let (directory, _) = mission(&map, &options);
        let mut manifest = std::fs::read_to_string(directory.path().join("camara.toml")).expect("readable");
        manifest = manifest.replace("battery_unit = 100", "battery_unit = 1");
        std::fs::write(directory.path().join("camara.toml"), manifest).expect("written");
        let setup = match Setup::read(&directory.path().join("camara.toml")) {
            Ok(setup) => setup,
            Err(messages) => panic!("{messages:?}"),
        };
        let (problem, _) = setup.mission.filled().expect("filled");
        if Coadaptation::new(&setup.mission, &problem, &setup.roles).is_err() {
            continue; // The map has no arc.
        }
        let risk = Risk { battery: has_battery, ..Risk::default() };
        agreement.count(agree(&format!("mission {number}"), &setup, risk));
    }
    agreement
}

#[test]
fn process_and_planner_agree_on_a_few_missions() {
    generated_missions(6);
    pairs_of_the_map(3);
}

#[test]
#[ignore = "minutes; two engines on 200 missions and 300 pairs"]
fn process_and_planner_agree_on_many_missions() {
    println!("generated missions: {:?}", generated_missions(200));
    println!("pairs of the map: {:?}", pairs_of_the_map(300));
}

fn compared(map: &str, options: &MapOptions, extra_arguments: &[&str]) -> Value {
    let (directory, _) = mission(map, options);
    let arguments = [&["compare", "camara.toml", "--format", "json"], extra_arguments].concat();
    let outcome = metaplan_in(directory.path(), &arguments, "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    outcome.json()["comparisons"][0].clone()
}

#[test]
fn plans_that_ignore_losses_have_a_price() {
    let Some(path) = data("real/map/map-p2cp3.json") else { return };
    let map = std::fs::read_to_string(path).expect("readable");
    // Start, goal, loss rate, minimum expected time, and expected time of our plan with replanning.
    let cases =
        [("l59", "l35", "0.2", 79.3925, 84.950_524_8), ("l25", "l7", "0.05", 102.467_925, 102.467_925)];
    for (start, goal, rate, best, replanning) in cases {
        let options = MapOptions {
            configuration: "amcl-kinect".to_owned(),
            collisions: false,
            failures: false,
            ..places(start, goal)
        };
        let answer = compared(&map, &options, &["--loss", &format!("c_kinect={rate}")]);
        let time = |kind: &str| {
            let candidates = answer["candidates"].as_array().expect("candidates");
            let candidate =
                candidates.iter().find(|candidate| candidate["kind"] == kind).expect("a candidate");
            candidate["time"].as_f64().expect("a time")
        };
        assert!((time("a") - best).abs() < 1e-6, "{start} {goal}: {}", time("a"));
        assert!((time("c") - replanning).abs() < 1e-6, "{start} {goal}: {}", time("c"));
        assert!(time("f") <= best + 1e-9, "{}", time("f"));
        assert!(!answer["loss"]["steps"].as_array().expect("steps").is_empty());
    }
}

#[test]
fn shipped_mission_is_compared() {
    let outcome =
        metaplan(&["compare", "missions/camara_like.toml", "--battery-unit", "500", "--format", "json"]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = &outcome.json()["comparisons"][0];
    let kinds: Vec<&str> = answer["candidates"]
        .as_array()
        .expect("candidates")
        .iter()
        .filter_map(|candidate| candidate["kind"].as_str())
        .collect();
    for kind in ["a", "b", "c", "d", "e", "f"] {
        assert!(kinds.contains(&kind), "{kind} in {kinds:?}");
    }
    assert!((answer["price_of_determinism"].as_f64().expect("a number") - 197.94).abs() < 1e-6, "{answer:#}");
}

/// Missions without a map of places also have a Markov decision process. Without uncertainty, the minimum of
/// its reward `time` is the planner's optimum.
#[test]
fn processes_of_missions_without_places_have_the_optimum_of_the_planner() {
    let cases = [
        ("missions/ugv.toml", 408.0),
        ("missions/ugv_plain.toml", 408.0),
        ("missions/uuv.toml", 28.0),
        ("missions/uuv_plain.toml", 28.0),
    ];
    for (file, expected) in cases {
        let outcome = metaplan(&["export", file, "--to", "prism"]);
        assert_eq!(outcome.status, 0, "{file}: {outcome:#?}");
        let question = "R{\"time\"}min=? [ F \"goal\" ]";
        let checked = metaplan_in(&root(), &["check", "-", question], &outcome.stdout);
        assert_eq!(checked.stdout.trim(), format!("{expected}"), "{file}: {checked:#?}");
    }
}

/// The Kinect of the ground vehicle may be lost. Policies that consider this loss are compared with plans
/// that do not, and with bounds.
#[test]
fn missions_without_places_are_compared() {
    let outcome = metaplan(&["compare", "missions/ugv.toml", "--loss", "c_kinect=0.1", "--format", "json"]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = &outcome.json()["comparisons"][0];
    let time = |kind: &str| {
        let candidates = answer["candidates"].as_array().expect("candidates");
        let candidate = candidates.iter().find(|candidate| candidate["kind"] == kind).expect("a candidate");
        candidate["penalised_time"].as_f64().expect("a time")
    };
    assert!(time("f") <= time("a") + 1e-9 && time("a") <= time("c") + 1e-9, "{answer:#}");
    let first = &answer["loss"]["steps"][0];
    assert_eq!(first["replanned"], first["solved_again"], "{answer:#}");
}

/// The change from `fd_1` to `fd_0` succeeds with probability 1/2. After a failed change the robot has `fd_1`, and the
/// plan's move with `fd_0` cannot be executed.
#[test]
fn a_failed_change_of_configuration_ends_a_plan_that_is_not_replanned() {
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).expect("written");
    write(
        "domain.pddl",
        "(define (domain robot) (:requirements :typing :equality :negative-preconditions :numeric-fluents)
           (:types waypoint functiondesign)
           (:predicates (robot_at ?at - waypoint) (configured ?fd - functiondesign)
             (fd_available ?fd - functiondesign) (suits ?fd - functiondesign ?from ?to - waypoint))
           (:functions (time ?from ?to - waypoint ?fd - functiondesign) (switch_time ?old ?new - functiondesign)
             (switch_success ?old ?new - functiondesign) (total_time))
           (:action move :parameters (?fd - functiondesign ?from ?to - waypoint)
             :precondition (and (robot_at ?from) (configured ?fd) (fd_available ?fd) (suits ?fd ?from ?to))
             :effect (and (not (robot_at ?from)) (robot_at ?to) (increase (total_time) (time ?from ?to ?fd))))
           (:action reconfigure :parameters (?old ?new - functiondesign)
             :precondition (and (configured ?old) (fd_available ?new) (not (= ?old ?new)))
             :effect (and (not (configured ?old)) (configured ?new)
               (increase (total_time) (switch_time ?old ?new)))))",
    );
    write(
        "problem.pddl",
        "(define (problem p) (:domain robot)
           (:objects p0 p1 - waypoint fd_0 fd_1 - functiondesign)
           (:init (robot_at p0) (configured fd_1) (fd_available fd_0) (fd_available fd_1) (= (total_time) 0)
             (suits fd_0 p0 p1) (= (time p0 p1 fd_0) 1) (suits fd_1 p0 p1) (= (time p0 p1 fd_1) 3)
             (= (switch_time fd_0 fd_1) 0) (= (switch_time fd_1 fd_0) 0) (= (switch_success fd_1 fd_0) 0.5))
           (:goal (robot_at p1)) (:metric minimize (total_time)))",
    );
    let outcome =
        metaplan_in(directory.path(), &["compare", "domain.pddl", "problem.pddl", "--format", "json"], "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = &outcome.json()["comparisons"][0];
    // The plan takes 1, so a failed mission costs 10. The candidates `a` and `c` repeat the change until it succeeds.
    for (kind, goal, time, penalised) in [
        ("a", 1.0, 1.0, 1.0),
        ("b", 0.5, 0.5, 5.5),
        ("c", 1.0, 1.0, 1.0),
        ("d", 0.5, 0.5, 5.5),
        ("e", 0.5, 0.5, 5.5),
    ] {
        let candidates = answer["candidates"].as_array().expect("candidates");
        let candidate = candidates.iter().find(|candidate| candidate["kind"] == kind).expect("a candidate");
        for (measure, expected) in [("goal", goal), ("time", time), ("penalised_time", penalised)] {
            let value = candidate[measure].as_f64().expect("a number");
            assert!((value - expected).abs() < 1e-9, "{kind}: {measure} {value}");
        }
    }
    for price in ["price_of_open_loop", "value_of_replanning"] {
        assert!((answer[price].as_f64().expect("a number") - 4.5).abs() < 1e-9, "{answer:#}");
    }
}

/// Every policy pays 10 for the move to `b`, which succeeds with probability 1/2, and 90 for the move to `c`, or the
/// penalty. No policy reaches `d`.
#[test]
fn the_bound_on_the_penalised_time_is_at_most_the_penalty() {
    let directory = tempfile::tempdir().expect("a directory");
    let write = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).expect("written");
    write(
        "domain.pddl",
        "(define (domain robot) (:requirements :typing :numeric-fluents)
           (:types waypoint functiondesign)
           (:predicates (robot_at ?at - waypoint) (configured ?fd - functiondesign)
             (fd_available ?fd - functiondesign) (suits ?fd - functiondesign ?from ?to - waypoint))
           (:functions (time ?from ?to - waypoint ?fd - functiondesign)
             (success ?from ?to - waypoint ?fd - functiondesign) (total_time))
           (:action move :parameters (?fd - functiondesign ?from ?to - waypoint)
             :precondition (and (robot_at ?from) (configured ?fd) (fd_available ?fd) (suits ?fd ?from ?to))
             :effect (and (not (robot_at ?from)) (robot_at ?to) (increase (total_time) (time ?from ?to ?fd)))))",
    );
    let problem = "(define (problem p) (:domain robot)
           (:objects a b c d - waypoint fd - functiondesign)
           (:init (robot_at a) (configured fd) (fd_available fd) (= (total_time) 0)
             (suits fd a b) (= (time a b fd) 10) (= (success a b fd) 0.5) (suits fd b c) (= (time b c fd) 90))
           (:goal (robot_at GOAL)) (:metric minimize (total_time)))";
    for (goal, time, open_loop) in [("c", Some(100.0), Some(57.5)), ("d", None, None)] {
        write("problem.pddl", &problem.replace("GOAL", goal));
        let arguments = ["compare", "domain.pddl", "problem.pddl", "--penalty", "5", "--format", "json"];
        let outcome = metaplan_in(directory.path(), &arguments, "");
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        let answer = outcome.json()["comparisons"][0].clone();
        let candidates = answer["candidates"].as_array().expect("candidates");
        let of = |kind: &str, measure: &str| {
            candidates.iter().find(|candidate| candidate["kind"] == kind)?[measure].as_f64()
        };
        assert_eq!(of("f", "time"), time, "{answer:#}");
        assert_eq!(of("f", "penalised_time"), Some(5.0), "{answer:#}");
        assert_eq!(of("b", "penalised_time"), open_loop, "{answer:#}");
    }
}

#[test]
fn missions_whose_goal_holds_already_are_compared() {
    for file in ["missions/ugv.toml", "missions/ugv_plain.toml"] {
        let outcome = metaplan(&["compare", file, "--set", "robot_at=wp9", "--format", "json"]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        let candidates = &outcome.json()["comparisons"][0]["candidates"];
        let optimum = candidates.as_array().expect("candidates").iter().find(|one| one["kind"] == "f");
        assert_eq!(optimum.expect("an optimum")["penalised_time"].as_f64(), Some(0.0), "{candidates:#}");
    }
}

#[test]
fn mistakes_in_arguments_of_compare_are_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("published.json").display().to_string();
    // Published rows, further arguments, expected status and part of the message.
    let cases: [(&str, &[&str], i32, &str); 6] = [
        (r#"[{"time":"5"}]"#, &[], 3, r#"entry 1: `time` is "5", but should be a number, or null"#),
        (r#"[{"time":null},{"goal":true}]"#, &[], 3, "entry 2: `goal` is true, but should be a number"),
        (r#"[{"name":5}]"#, &[], 3, "entry 1: `name` is 5, but should be a text"),
        (r#"[{"speed":5}]"#, &[], 3, "`speed` is not a measure"),
        ("[]", &["--pairs", "0"], 2, "--pairs"),
        ("[]", &["--state-limit", "2"], 12, "missions/camara_like.toml: error[Q505]"),
    ];
    for (published, extra_arguments, status, expected) in cases {
        std::fs::write(&file, published).expect("written");
        let arguments = ["compare", "missions/camara_like.toml", "--published", &file];
        let outcome = metaplan(&[&arguments[..], extra_arguments].concat());
        assert_eq!(outcome.status, status, "{published} {extra_arguments:?}: {outcome:#?}");
        let output = format!("{}{}", outcome.stderr, headlines(&outcome.stderr));
        assert!(output.contains(expected), "{expected}: {outcome:#?}");
    }
}

/// The moves from `a` to `b_c` and from `a_b` to `c` would have the same name. Each move has its own reward.
#[test]
fn rewards_of_moves_with_similar_names_are_separate() {
    let directory = tempfile::tempdir().expect("a directory");
    let example = "missions/camara_like.toml";
    let Setup { mission, roles, .. } = Setup::read(&root().join(example)).expect("a mission");
    let (problem, _) = mission.filled().expect("filled");
    let mut mission = Coadaptation::new(&mission, &problem, &roles).expect("a process");
    let whole = |value: i64| BigRational::from_integer(value.into());
    let arc = |from: usize, time: i64| {
        let traversal = Traversal { time: whole(time), energy: whole(0), success: whole(1), hit: whole(0) };
        Arc { from, to: from + 1, by: vec![Some(traversal)] }
    };
    mission.places = ["a", "b_c", "a_b", "c"].map(str::to_owned).to_vec();
    mission.arcs = vec![arc(0, 10), arc(1, 1), arc(2, 100)];
    mission.configurations.truncate(1);
    mission.configurations[0].available = true;
    mission.switches = vec![vec![None]];
    (mission.start, mission.goal, mission.initial) = (0, 3, 0);
    (mission.battery, mission.loss) = (None, None);
    for model in [program(&mission, Risk::all(&mission)), published_program(&mission)] {
        let file = directory.path().join("model.prism");
        std::fs::write(&file, probabilistic::prism::write(&model)).expect("written");
        let question = "R{\"time\"}min=? [ F \"goal\" ]";
        let constant: &[&str] = if model.constants.is_empty() { &[] } else { &["--const", "ROUTE=0"] };
        let arguments = [&["check", file.to_str().expect("UTF-8"), question][..], constant].concat();
        let outcome = metaplan(&arguments);
        assert_eq!(outcome.stdout.trim(), "111", "{outcome:#?}");
    }
}

#[test]
fn invalid_processes_are_refused() {
    use pddl::ast::{Condition, Constraint, InitialElement, Name, Problem as Pddl, Span, Term, Trajectory};
    let Setup { mission, roles, .. } =
        Setup::read(&root().join("missions/camara_like.toml")).expect("a mission");
    let (problem, _) = mission.filled().expect("filled");
    let codes = |problem: &Pddl| match Coadaptation::new(&mission, problem, &roles) {
        Ok(_) => Vec::new(),
        Err(messages) => messages.iter().map(|message| message.code.clone()).collect::<Vec<_>>(),
    };
    assert!(codes(&problem).is_empty());
    for (symbol, value) in [
        ("time", -1_i64),
        ("energy", -5),
        ("hit", 2),
        ("success", -1),
        ("switch_time", -1),
        ("battery", -5),
        ("battery", 10_i64.pow(15)),
        ("reserve", 10_i64.pow(15)),
    ] {
        let mut changed = problem.clone();
        let element = changed.init.iter_mut().find_map(|element| match element {
            InitialElement::Value(atom, value, _) if atom.predicate.name.as_str() == symbol => Some(value),
            _ => None,
        });
        *element.unwrap_or_else(|| panic!("no {symbol}")) = BigRational::from_integer(value.into());
        assert_eq!(codes(&changed), ["M122"], "{symbol}");
    }
    let mut oversized = problem.clone();
    let fact = problem.init.iter().find_map(|element| match element {
        InitialElement::Fact(atom) if atom.predicate.name.as_str() == "fd_available" => Some(atom),
        _ => None,
    });
    let fact = fact.expect("an available design");
    for number in 0..5000 {
        let mut fact = fact.clone();
        let (Term::Constant(design) | Term::Variable(design)) = &mut fact.arguments[0];
        design.name = Name::new(&format!("fd_more_{number}"));
        oversized.init.push(InitialElement::Fact(fact));
    }
    assert_eq!(codes(&oversized), ["M127"]);
    // The process has one robot, and no further conditions of the goal.
    let with_goal = |parts: Vec<Condition>| Pddl { goal: Condition::And(parts), ..problem.clone() };
    let Condition::Atom(goal) = &problem.goal else { panic!("{:?}", problem.goal) };
    let mut photo = goal.clone();
    photo.predicate.name = Name::new("photographed");
    let [goal, photo] = [goal.clone(), photo].map(Condition::Atom);
    assert!(codes(&with_goal(vec![goal.clone()])).is_empty());
    for parts in [vec![goal.clone(), photo.clone()], vec![photo.clone(), goal], vec![photo]] {
        assert_eq!(codes(&with_goal(parts)), ["M127"]);
    }
    let mut timed = problem.clone();
    let literal =
        InitialElement::Timed(BigRational::from_integer(5.into()), fact.clone(), false, Span::default());
    timed.init.push(literal);
    assert_eq!(codes(&timed), ["M127"]);
    let constraint = Constraint {
        variables: Vec::new(),
        preference: None,
        trajectory: Trajectory::Always(Condition::And(Vec::new())),
        span: Span::default(),
    };
    assert_eq!(codes(&Pddl { constraints: vec![constraint], ..problem.clone() }), ["M127"]);
    for predicate in ["robot_at", "configured"] {
        let mut two_facts = problem.clone();
        let fact = problem.init.iter().find_map(|element| match element {
            InitialElement::Fact(atom) if atom.predicate.name.as_str() == predicate => Some(atom),
            _ => None,
        });
        let mut fact = fact.unwrap_or_else(|| panic!("no {predicate}")).clone();
        let (Term::Constant(object) | Term::Variable(object)) = &mut fact.arguments[0];
        object.name = Name::new("another");
        two_facts.init.push(InitialElement::Fact(fact));
        assert_eq!(codes(&two_facts), ["M127"], "{predicate}");
    }
}

#[test]
fn exported_published_setting_matches_its_execution() {
    let setup = Setup::read(&root().join("missions/camara_like.toml")).expect("a mission");
    let mission = coadaptation(&setup);
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("model.prism");
    let file = file.to_str().expect("UTF-8");
    let arguments =
        ["export", "missions/camara_like.toml", "--to", "prism", "--setting", "published", "-o", file];
    let outcome = metaplan(&arguments);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let value = |question: &str, route: usize| {
        let route = format!("ROUTE={route}");
        let outcome = metaplan(&["check", file, question, "--const", &route, "--format", "json"]);
        assert_eq!(outcome.status, 0, "{outcome:#?}");
        outcome.json()["value"].as_f64().expect("a value")
    };
    let routes = shortest_routes(&mission, 5);
    assert_eq!(routes.len(), 5);
    assert!(shortest_routes(&mission, 0).is_empty());
    let questions = [
        (Priority::Time, "R{\"time\"}min=? [ F \"goal\" ]"),
        (Priority::Energy, "R{\"energy\"}min=? [ F \"goal\" ]"),
        (Priority::Safety, "Pmax=? [ F \"safe_goal\" ]"),
    ];
    for (priority, question) in questions {
        let published_plan = published(&mission, priority).expect("a route");
        let number =
            routes.iter().position(|route| *route == published_plan.route).expect("one of the five") + 1;
        let believed =
            [published_plan.time, published_plan.energy, published_plan.not_collided][priority as usize];
        assert!((value(question, number) - believed).abs() < 1e-9, "{question}: {believed}");
        let values: Vec<f64> = (1..=5).map(|route| value(question, route)).collect();
        let best =
            values.iter().copied().reduce(if priority == Priority::Safety { f64::max } else { f64::min });
        assert!((value(question, 0) - best.expect("five")).abs() < 1e-9, "{question}: {values:?}");
    }
    let arguments = ["export", "missions/camara_like.toml", "--to", "jani", "--setting", "published"];
    assert_eq!(metaplan(&arguments).json()["jani-version"], 1);
}

#[test]
fn exported_model_has_the_size_of_the_process() {
    let mission = "missions/camara_like.toml";
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("model.prism");
    let file = file.to_str().expect("UTF-8");
    let outcome = metaplan(&["export", mission, "--to", "prism", "-o", file]);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let setup = Setup::read(&root().join(mission)).expect("a mission");
    let native = coadaptation(&setup);
    let risk = Risk::all(&native);
    let native = explore(&Process::<f64>::new(&native, risk, &[]), &Bounds::default()).expect("explored");
    let property = "filter(max, Pmax=? [ F \"safe_goal\" ], \"init\")";
    let checked = metaplan(&["check", file, property, "--format", "json"]);
    let statistics = &checked.json()["statistics"];
    let sizes = [native.mdp.states(), native.mdp.choice_count(), native.mdp.transition_count()];
    let exported_sizes =
        ["states", "choices", "transitions"].map(|key| statistics[key].as_u64().expect("number"));
    assert_eq!(exported_sizes, sizes.map(|size| size as u64));
    for mission in ["camara_like", "ugv", "uuv"] {
        let mission = format!("missions/{mission}.toml");
        let [prism, jani] = ["prism", "jani"].map(|form| metaplan(&["export", &mission, "--to", form]));
        let sizes = [&prism, &jani].map(|outcome| outcome.stdout.len());
        assert!(sizes[1] <= 10 * sizes[0], "{mission}: {sizes:?} bytes of PRISM and of JANI");
        assert_eq!(jani.json()["jani-version"], 1);
    }
}
