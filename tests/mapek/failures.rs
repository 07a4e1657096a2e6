//! Compares the loop with other strategies under failures that no shipped scenario contains: of one and two
//! components, early and late, permanent, temporary, and repeated.
#![expect(clippy::print_stdout, reason = "the table is what the long test is for")]

use std::collections::BTreeMap;
use std::path::Path;

use metaplan::planner::Limits;
use metaplan::setup::Setup;
use metaplan::simulate::{Disturbance, Experiment, RandomFailure, Run, Simulation, Strategy};

struct Robot {
    mission: &'static str,
    failing: &'static [&'static [&'static str]],
    /// Number of leading entries of `failing` whose permanent failure the mission tolerates.
    spare: usize,
    /// Parameters of the simulation: step length and patience.
    pace: (f64, f64),
    lifeline: Option<&'static str>,
    /// Early and late failures: earliest time, and length of the interval in which the failure occurs.
    times: [(f64, f64); 2],
    /// Brief and long failures: shortest time to recovery, and length of the interval in which the recovery
    /// occurs.
    recoveries: [(f64, f64); 2],
    /// Mean time to a failure, and time to its recovery, for repeated failures.
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

fn scenarios(robot: &Robot) -> Vec<(String, Simulation)> {
    let mut scenarios = Vec::new();
    for (failing, number) in robot.failing.iter().zip(0..) {
        let name = failing.join(" and ");
        for (time, when) in robot.times.iter().zip(["early", "late"]) {
            let temporary = robot.recoveries.iter().zip(["briefly", "long"]);
            let temporary = temporary.map(|(recovery, length)| (Some(*recovery), length));
            let permanent = (number < robot.spare).then_some((None, "for good"));
            for (recovery, length) in temporary.chain(permanent) {
                let events = once(failing, *time, recovery);
                scenarios.push((format!("{name}, {when}, {length}"), simulation(robot, events, Vec::new())));
            }
        }
        let repeated_failure = |component: &&str| RandomFailure {
            component: (*component).to_owned(),
            mean_time: robot.random.0,
            recovery: Some(robot.random.1),
        };
        let failures = failing.iter().map(repeated_failure).collect();
        scenarios.push((format!("{name}, again and again"), simulation(robot, Vec::new(), failures)));
    }
    scenarios
}

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
        let recovery_event = disturbance(time.0 + time.1 + after, within);
        events.push(Disturbance { recover: names(), ..recovery_event });
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

struct Comparison {
    strategy: Strategy,
    mean_cost_and_count: String,
    better: usize,
    worse: Vec<u64>,
}

/// Returns the figures of the loop, and its comparison with each other strategy.
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
    let baselines = Strategy::ALL.into_iter().filter(|&strategy| strategy != Strategy::Joint);
    let compare = |strategy: Strategy| {
        let baseline_runs = runs(strategy);
        let pairs = || joint.iter().zip(&baseline_runs);
        let worse = pairs().filter(|(joint, baseline)| baseline.is_better_than(joint));
        Comparison {
            strategy,
            mean_cost_and_count: mean_cost_and_count(&baseline_runs),
            better: pairs().filter(|(joint, baseline)| joint.is_better_than(baseline)).count(),
            worse: worse.map(|(joint, _)| joint.seed).collect(),
        }
    };
    (mean_cost_and_count(&joint), baselines.map(compare).collect())
}

fn setup(robot: &Robot) -> Setup {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{}.toml", robot.mission));
    Setup::read(&manifest).expect("the mission is read")
}

fn mean_cost_and_count(runs: &[Run]) -> String {
    let done: Vec<f64> = runs.iter().filter(|run| run.accomplished).map(|run| run.cost).collect();
    if done.is_empty() {
        return "none".to_owned();
    }
    format!("{:.2} ({})", done.iter().sum::<f64>() / done.len() as f64, done.len())
}

/// For each other strategy, returns the numbers of missions in which the loop is better and worse.
fn table(robot: &Robot, seeds: u64) -> BTreeMap<&'static str, (usize, usize)> {
    let setup = setup(robot);
    let mut total: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    println!("scenario: joint; others with the numbers of missions in which the loop did better and worse");
    for (name, settings) in scenarios(robot) {
        let (joint, comparisons) = play(&setup, &settings, seeds);
        let cell = |comparison: &Comparison| {
            let Comparison { strategy, mean_cost_and_count, better, worse } = comparison;
            let seeds = if worse.is_empty() { String::new() } else { format!(" {worse:?}") };
            format!("{} {mean_cost_and_count} {better}:{}{seeds}", strategy.name(), worse.len())
        };
        let cells: Vec<String> = comparisons.iter().map(cell).collect();
        println!("{name}: {joint}; {}", cells.join("; "));
        for comparison in &comparisons {
            let sum = total.entry(comparison.strategy.name()).or_default();
            *sum = (sum.0 + comparison.better, sum.1 + comparison.worse.len());
        }
    }
    println!("{}: {total:?}", robot.mission);
    total
}

/// Asserts that the loop is better than each other strategy at least ten times as often as it is worse. It cannot
/// always be better, because no strategy knows future failures.
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
