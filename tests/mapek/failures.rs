//! The loop beside other ways of control where components fail that no shipped scenario lets fail: one and two at a time,
//! early and late, for ever, for a while, and again and again.
#![expect(clippy::print_stdout, reason = "the table is what the long test is for")]

use std::collections::BTreeMap;
use std::path::Path;

use metaplan::planner::Limits;
use metaplan::setup::Setup;
use metaplan::simulate::{Disturbance, Experiment, RandomFailure, Run, Simulation, Strategy};

/// A mission with components that can fail.
struct Robot {
    mission: &'static str,
    /// Components that fail together.
    failing: &'static [&'static [&'static str]],
    /// How many of these the mission can do without for good; they come first.
    spare: usize,
    /// What its simulation has beside failures: step, patience.
    pace: (f64, f64),
    lifeline: Option<&'static str>,
    /// When components fail, at the earliest, and within which time from then.
    times: [(f64, f64); 2],
    /// After how long they recover at the earliest, and within which time from then.
    recoveries: [(f64, f64); 2],
    /// The mean time to a failure, and the time to its recovery, where components fail again and again.
    random: (f64, f64),
}

const ROBOTS: [Robot; 2] = [
    Robot {
        mission: "uuv",
        failing: &[
            &["c_thruster_3"],
            &["c_thruster_3", "c_charging_port"],
            &["c_thruster_1"],
            &["c_camera"],
            &["c_sonar"],
            &["c_thruster_1", "c_thruster_3"],
            &["c_thruster_3", "c_camera"],
            &["c_thruster_3", "c_sonar"],
        ],
        spare: 2,
        pace: (0.5, 2.0),
        lifeline: Some("battery"),
        times: [(1.0, 6.0), (12.0, 8.0)],
        recoveries: [(0.5, 3.0), (10.0, 10.0)],
        random: (15.0, 3.0),
    },
    Robot {
        mission: "ugv",
        failing: &[
            &["c_kinect"],
            &["c_lidar"],
            &["c_camera"],
            &["c_kinect", "c_camera"],
            &["c_kinect", "c_flashlight"],
            &["c_lidar", "c_camera"],
            &["c_kinect", "c_lidar"],
        ],
        spare: 7,
        pace: (0.1, 0.5),
        lifeline: None,
        times: [(0.1, 1.0), (1.5, 2.0)],
        recoveries: [(0.1, 1.0), (2.0, 3.0)],
        random: (4.0, 0.8),
    },
];

/// All that may happen to a robot, with names.
fn scenarios(robot: &Robot) -> Vec<(String, Simulation)> {
    let mut all = Vec::new();
    for (failing, number) in robot.failing.iter().zip(0..) {
        let name = failing.join(" and ");
        for (time, when) in robot.times.iter().zip(["early", "late"]) {
            let back = robot.recoveries.iter().zip(["briefly", "long"]);
            let back = back.map(|(recovery, length)| (Some(*recovery), length));
            let ever = (number < robot.spare).then_some((None, "for good"));
            for (recovery, length) in back.chain(ever) {
                let events = once(failing, *time, recovery);
                all.push((format!("{name}, {when}, {length}"), simulation(robot, events, Vec::new())));
            }
        }
        let again = |component: &&str| RandomFailure {
            component: (*component).to_owned(),
            mean_time: robot.random.0,
            recovery: Some(robot.random.1),
        };
        let failures = failing.iter().map(again).collect();
        all.push((format!("{name}, again and again"), simulation(robot, Vec::new(), failures)));
    }
    all
}

/// Components that fail together, and may recover together.
fn once(failing: &[&str], time: (f64, f64), recovery: Option<(f64, f64)>) -> Vec<Disturbance> {
    let disturbance = |at: f64, within: f64| Disturbance {
        at: Some(at),
        when: None,
        within,
        fail: Vec::new(),
        recover: Vec::new(),
        set: BTreeMap::new(),
    };
    let names = || failing.iter().map(|name| (*name).to_owned()).collect();
    let mut events = vec![Disturbance { fail: names(), ..disturbance(time.0, time.1) }];
    if let Some((after, within)) = recovery {
        let back = disturbance(time.0 + time.1 + after, within);
        events.push(Disturbance { recover: names(), ..back });
    }
    events
}

fn simulation(robot: &Robot, events: Vec<Disturbance>, failures: Vec<RandomFailure>) -> Simulation {
    let mut simulation = Simulation::new(robot.pace.0, 200.0 * robot.pace.0, robot.pace.1);
    simulation.noise = 0.02;
    simulation.lifeline = robot.lifeline.map(ToOwned::to_owned);
    (simulation.events, simulation.failures) = (events, failures);
    simulation
}

/// What a scenario has come to beside one other way of control.
struct Comparison {
    strategy: Strategy,
    /// Mean cost of accomplished missions, and how many they are.
    figures: String,
    /// In how many missions the loop did better.
    better: usize,
    /// The seeds of those in which it did worse.
    worse: Vec<u64>,
}

/// Plays a scenario with all ways of control: the loop's figures, and the comparison with each other way.
fn play(setup: &Setup, settings: &Simulation, seeds: u64) -> (String, Vec<Comparison>) {
    let (mission, control) = (setup.mission.clone(), setup.settings.clone());
    let experiment = Experiment::new(mission, control, settings.clone(), setup.time_unit);
    let experiment = experiment.unwrap_or_else(|errors| panic!("{errors}"));
    let runs = |strategy: Strategy| -> Vec<Run> {
        let run = |seed| {
            let run = experiment.run(strategy, seed, &Limits::none(), &mut |_, _| {});
            run.expect("it is simulated").expect("there is no limit")
        };
        (1..=seeds).map(run).collect()
    };
    let joint = runs(Strategy::Joint);
    let others = Strategy::ALL.into_iter().filter(|&strategy| strategy != Strategy::Joint);
    let compare = |strategy: Strategy| {
        let theirs = runs(strategy);
        let pairs = || joint.iter().zip(&theirs);
        let worse = pairs().filter(|(joint, other)| other.is_better_than(joint));
        Comparison {
            strategy,
            figures: figures(&theirs),
            better: pairs().filter(|(joint, other)| joint.is_better_than(other)).count(),
            worse: worse.map(|(joint, _)| joint.seed).collect(),
        }
    };
    (figures(&joint), others.map(compare).collect())
}

fn setup(robot: &Robot) -> Setup {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{}.toml", robot.mission));
    Setup::read(&manifest).expect("the mission is read")
}

/// The mean cost of accomplished missions, and how many they are.
fn figures(runs: &[Run]) -> String {
    let done: Vec<f64> = runs.iter().filter(|run| run.accomplished).map(|run| run.cost).collect();
    if done.is_empty() {
        return "none".to_owned();
    }
    format!("{:.2} ({})", done.iter().sum::<f64>() / done.len() as f64, done.len())
}

/// Plays all scenarios of a robot with so many seeds and prints the table; for each strategy in how many missions the loop did
/// better, and in how many worse.
fn table(robot: &Robot, seeds: u64) -> BTreeMap<&'static str, (usize, usize)> {
    let setup = setup(robot);
    let mut total: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    println!("scenario: joint; others with the numbers of missions in which the loop did better and worse");
    for (name, settings) in scenarios(robot) {
        let (joint, others) = play(&setup, &settings, seeds);
        let cell = |other: &Comparison| {
            let Comparison { strategy, figures, better, worse } = other;
            let seeds = if worse.is_empty() { String::new() } else { format!(" {worse:?}") };
            format!("{} {figures} {better}:{}{seeds}", strategy.name(), worse.len())
        };
        let cells: Vec<String> = others.iter().map(cell).collect();
        println!("{name}: {joint}; {}", cells.join("; "));
        for other in &others {
            let sum = total.entry(other.strategy.name()).or_default();
            *sum = (sum.0 + other.better, sum.1 + other.worse.len());
        }
    }
    println!("{}: {total:?}", robot.mission);
    total
}

/// Nobody who does not know what will fail and recover is always better off. But where the loop is not, that has to be bad luck.
fn check(robot: &Robot) {
    for (strategy, (better, worse)) in table(robot, 30) {
        assert!(worse * 10 <= better, "{strategy}: better {better}, worse {worse}");
    }
}

#[test]
#[ignore = "takes half an hour"]
fn failures_of_the_underwater_vehicle() {
    check(&ROBOTS[0]);
}

#[test]
#[ignore = "takes half an hour"]
fn failures_of_the_ground_vehicle() {
    check(&ROBOTS[1]);
}
