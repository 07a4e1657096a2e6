//! Differential test: the incremental planner against planning from scratch, in loops with random events.

use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use planner::Limits;

use crate::mapek::ask::Question;
use crate::mapek::plan::from_scratch;
use crate::mapek::{Loop, Observation, PlannedStep, Settings, Watch};
use crate::mission::Mission;
use crate::setup::Setup;

struct World {
    name: String,
    mission: Mission,
    /// Lines of events; `{a}` is replaced by the action under way, `{x}` by a number from 0 to 1 with two decimals.
    events: Vec<String>,
}

fn shipped(name: &str) -> Mission {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{name}.toml"));
    Setup::read(&manifest).expect("the mission is read").mission
}

const ACTIONS: [&str; 6] = [
    r#"{"event":"action_progress","action":{a},"fraction":{x}}"#,
    r#"{"event":"action_progress","action":{a},"fraction":{x}}"#,
    r#"{"event":"action_succeeded","action":{a}}"#,
    r#"{"event":"action_succeeded","action":{a}}"#,
    r#"{"event":"action_failed","action":{a}}"#,
    r#"{"event":"action_cancelled","action":{a}}"#,
];

fn components(names: &[&str]) -> Vec<String> {
    let line = |name: &str, status: &str| {
        format!(r#"{{"event":"component_status","component":"{name}","status":"{status}"}}"#)
    };
    names
        .iter()
        .flat_map(|name| ["FALSE", "RECOVERED", "RECOVERED"].map(|status| line(name, status)))
        .collect()
}

fn facts(pairs: &[(&str, &str)]) -> Vec<String> {
    let line = |(name, value): &(&str, &str)| {
        format!(r#"{{"event":"fact_changed","name":"{name}","value":"{value}"}}"#)
    };
    pairs.iter().map(line).collect()
}

fn ugv(name: &str, mission: Mission, places: usize) -> World {
    let place = |number: usize| format!("wp{number}");
    let mut events = components(&["c_kinect", "c_lidar", "c_camera", "c_flashlight"]);
    events.extend(ACTIONS.map(ToOwned::to_owned));
    for number in (1..=places).step_by(places.div_ceil(9)) {
        events.extend(facts(&[("robot_at", &place(number))]));
    }
    events.extend(facts(&[
        ("battery", "100"),
        ("battery", "37.25"),
        ("battery", "9"),
        ("travel_time wp2 wp3", "3"),
    ]));
    events.push(r#"{"event":"measured","attribute":"ambient_light","value":0.9}"#.to_owned());
    events.push(r#"{"event":"measured","attribute":"ambient_light","value":0.2}"#.to_owned());
    events.push(format!(r#"{{"event":"goal_changed","goal":"(robot_at {})"}}"#, place(places / 2)));
    events.push(format!(r#"{{"event":"goal_changed","goal":"(robot_at {})"}}"#, place(places)));
    World { name: name.to_owned(), mission, events }
}

fn uuv(name: &str) -> World {
    let mut events = components(&["c_thruster_1", "c_thruster_3", "c_camera", "c_sonar", "c_charging_port"]);
    events.extend(ACTIONS.map(ToOwned::to_owned));
    events.extend(facts(&[
        ("battery", "100"),
        ("battery", "42.5"),
        ("battery", "15"),
        ("battery", "11.125"),
    ]));
    events.extend(facts(&[("pipeline_found pl1", "true"), ("pipeline_found pl1", "false")]));
    events.extend(facts(&[("pipeline_inspected pl1", "false"), ("search_area pl1", "2")]));
    events.extend(
        [1, 2, 3, 4].map(|value| {
            format!(r#"{{"event":"measured","attribute":"water_visibility","value":{value}.5}}"#)
        }),
    );
    World { name: name.to_owned(), mission: shipped(name), events }
}

const METRIC: &str = "(:metric minimize (+ (* 100 (total-time)) (battery_used)))";

fn map(width: usize, height: usize, seed: u64, metric: &str) -> World {
    let mut random = fastrand::Rng::with_seed(seed);
    let count = width * height;
    let mut text = String::from("(define (problem map) (:domain ugv) (:objects");
    for place in 1..=count {
        let _ = write!(text, " wp{place}");
    }
    text += " - waypoint) (:init (robot_at wp1) (= (battery) 100) (= (battery_used) 0)";
    for place in 1..=count {
        let right = (place % width != 0).then_some(place + 1);
        let below = (place + width <= count).then_some(place + width);
        for neighbour in right.into_iter().chain(below) {
            let kind = ["corridor", "corridor", "corridor", "dark_corridor", "corridor_with_obstacles"];
            let kind = kind[random.usize(..kind.len())];
            let time = random.u32(1..6);
            for (from, to) in [(place, neighbour), (neighbour, place)] {
                let _ = write!(text, " ({kind} wp{from} wp{to}) (= (travel_time wp{from} wp{to}) {time})");
            }
        }
    }
    let _ = write!(text, ") (:goal (robot_at wp{count})) {metric})");
    let directory = tempfile::tempdir().expect("a directory");
    std::fs::write(directory.path().join("problem.pddl"), text).expect("a problem");
    let root = env!("CARGO_MANIFEST_DIR");
    let manifest = format!(
        "name = \"map\"\n[knowledge]\nfiles = [\"{root}/ontology/kb/ugv.ttl\"]\n[planning]\n\
         domain = \"{root}/encodings/ugv/domain.pddl\"\nproblem = \"problem.pddl\"\n"
    );
    std::fs::write(directory.path().join("map.toml"), manifest).expect("a manifest");
    let mission = Setup::read(&directory.path().join("map.toml")).expect("the mission is read").mission;
    ugv(&format!("map of {count} places"), mission, count)
}

#[derive(Default)]
struct Tally {
    compared: usize,
    unanswered: usize,
    live: Duration,
    scratch: Duration,
}

impl Tally {
    fn compare(&mut self, control: &mut Loop, goes_on: bool, context: &dyn Fn() -> String) {
        let problem = control.beliefs.filled();
        let running = control.beliefs.running.as_ref().filter(|_| goes_on);
        let question = Question {
            mission: &control.beliefs.mission,
            problem: &problem,
            goal: control.beliefs.goal(),
            running,
            old: None,
            stay_close: false,
        };
        let start = Instant::now();
        let answer = control.planner.live.plan(&question, &Limits::none(), &Watch::default());
        self.live += start.elapsed();
        let start = Instant::now();
        let expected = from_scratch(&question, Limits::none(), &Watch::default());
        self.scratch += start.elapsed();
        let Some(answer) = answer else {
            self.unanswered += 1;
            return;
        };
        self.compared += 1;
        let text = |steps: &Option<Vec<PlannedStep>>| {
            steps.as_ref().map(|steps| steps.iter().map(PlannedStep::to_record).collect::<Vec<_>>())
        };
        assert_eq!(text(&answer.steps), text(&expected.steps), "{}", context());
        assert_eq!((&answer.cost, answer.proved), (&expected.cost, expected.proved), "{}", context());
    }
}

fn check(world: &World, seed: u64, count: usize) -> Tally {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut control = Loop::new(world.mission.clone(), Settings::default()).expect("a loop");
    control.start();
    let mut tally = Tally::default();
    for number in 0..count {
        let action = control.beliefs().running().map_or(0, |(action, _)| action);
        let share = format!("0.{:02}", random.u32(..100));
        let line = world.events[random.usize(..world.events.len())].replace("{a}", &action.to_string());
        let line = line.replace("{x}", &share);
        let now = control.beliefs().now() + Duration::from_millis(100);
        control.handle(&Observation::parse(&line), now);
        control.planner.computed.clear();
        let context = || format!("{}, seed {seed}, event {number}: {line}", world.name);
        tally.compare(&mut control, true, &context);
        if control.beliefs().running().is_some() {
            tally.compare(&mut control, false, &context);
        }
    }
    tally
}

fn worlds() -> Vec<World> {
    vec![
        ugv("ugv", shipped("ugv"), 9),
        ugv("ugv_plain", shipped("ugv_plain"), 9),
        uuv("uuv"),
        uuv("uuv_plain"),
    ]
}

#[test]
fn plans_equal_those_from_scratch() {
    for world in worlds() {
        let tally = check(&world, 1, 40);
        assert!(tally.compared > 40 && tally.unanswered == 0, "{}: {} left", world.name, tally.unanswered);
    }
    for metric in [METRIC, ""] {
        let tally = check(&map(6, 4, 1, metric), 1, 5);
        assert_eq!(tally.unanswered, 0);
    }
}

#[test]
#[ignore = "measures; only a release build is of interest"]
#[expect(clippy::print_stdout, reason = "times are what this test is for")]
fn plans_equal_those_from_scratch_with_times() {
    let maps = [(10, 5, 60), (10, 10, 40), (20, 10, 25)];
    let mut cases: Vec<(World, usize)> = worlds().into_iter().map(|world| (world, 600)).collect();
    cases.extend(maps.map(|(width, height, count)| (map(width, height, 7, METRIC), count)));
    for (world, count) in &cases {
        let tally = check(world, 2, *count);
        let each = |time: Duration| time.as_secs_f64() * 1e3 / (tally.compared + tally.unanswered) as f64;
        println!(
            "{}: {} plans equal, {} left to planning from scratch; mean {:.2} ms live, {:.2} ms from scratch, ratio {:.1}",
            world.name,
            tally.compared,
            tally.unanswered,
            each(tally.live),
            each(tally.scratch),
            tally.scratch.as_secs_f64() / tally.live.as_secs_f64()
        );
    }
}
