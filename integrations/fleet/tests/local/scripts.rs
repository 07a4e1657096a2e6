//! Scripts of robots: observations of a simulated robot, and the comparison of decisions with those of a single local
//! loop.

use std::path::Path;
use std::time::Duration;

use metaplan::mapek::{Baseline, Loop, Observation};
use metaplan::planner::Limits;
use metaplan::setup::Setup;
use metaplan::simulate::Strategy;
use metaplan_fleet::wire::Decided;
use serde_json::{Value, json};

/// Names of missions and of their scenarios.
pub(super) const SCENARIOS: [(&str, &str); 4] = [
    ("ugv", "kinect_comes_and_goes"),
    ("uuv", "battery_under_way"),
    ("ugv", "kinect_at_wp2"),
    ("uuv", "suave"),
];

fn setup(mission: &str) -> Setup {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../missions/{mission}.toml"));
    Setup::read(&path).unwrap_or_else(|errors| panic!("{errors}"))
}

/// Returns at most `most` event lines: the enrolment and the observations of a simulated robot, with their times.
pub(super) fn play((mission, scenario): (&str, &str), seed: u64, most: usize) -> Vec<String> {
    let experiment = setup(mission).experiment(scenario).unwrap_or_else(|errors| panic!("{errors}"));
    let mut events = vec![json!({"event": "enrol", "mission": mission}).to_string()];
    let mut is_first = true;
    let mut log = |observation: &Observation, _: &[_]| {
        // The first log entry is the start of the loop.
        if !std::mem::take(&mut is_first) {
            events.push(observation.to_json().to_string());
        }
    };
    let outcome = experiment.run(Strategy::Joint, seed, &Limits::none(), &mut log);
    outcome.unwrap_or_else(|errors| panic!("{errors}"));
    events.truncate(most);
    events
}

/// Checks that decisions are those of a single local loop that reacts to each event, and plans when a decision contains
/// a plan: each event has one decision, in order, and the answers are equal. If there were events during a search, the
/// plan is not compared, because it may be for the progress of an action, or for the planning problem, at its start.
/// Returns the number of compared plans that followed in decisions of their own.
pub(super) fn assert_replayed(
    robot: &str,
    mission: &str,
    events: &[String],
    decided: &[Decided],
    sequences: &[u64],
) -> usize {
    let made: Vec<u64> = decided.iter().filter(|made| !made.planned).map(|made| made.event).collect();
    assert_eq!(made, sequences, "{robot}: each event once, in order");
    let Setup { mission, settings, .. } = setup(mission);
    let initial = Loop::new(mission, settings).unwrap_or_else(|errors| panic!("{errors}"));
    let (baseline, mut control) = (Baseline::new(&initial), initial.clone());
    let mut events = events.iter();
    let (mut waiting, mut compared) = (0, 0);
    for (number, made) in decided.iter().enumerate() {
        let mut answers = Vec::new();
        if !made.planned {
            let event = events.next().expect("there are as many events");
            // The first event enrols the robot.
            if number > 0 {
                answers.extend(control.react(&Observation::parse(event), Duration::ZERO));
            }
        }
        if !made.planning {
            answers.extend(control.deliberate());
        }
        let is_own = waiting == 0 || made.planning || made.planned && waiting == 1;
        if is_own {
            let expected = control.decision(&answers).answers;
            assert_eq!(essence(&made.answers), essence(&expected), "{robot}, decision {number}");
            assert_eq!(control.has_agenda(), made.planning, "{robot}, decision {number}");
            compared += usize::from(made.planned);
        } else {
            control = initial.clone();
            let snapshot = baseline.snapshot(made.state.snapshot.clone());
            control.restore(&snapshot).expect("the snapshot fits");
        }
        waiting = if made.planning { waiting + 1 } else { 0 };
    }
    assert!(!control.has_agenda(), "{robot}: the last plan is missing");
    compared
}

/// Removes the reasons of changed designs and objectives from answers, because several derivations may be
/// valid. The reasons of other answers are compared.
pub(super) fn essence(answers: &[Value]) -> Vec<Value> {
    let mut answers = answers.to_vec();
    for answer in &mut answers {
        for list in ["designs", "objectives"] {
            let changes = answer.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten();
            for change in changes.filter_map(Value::as_object_mut) {
                change.remove("because");
            }
        }
    }
    answers
}
