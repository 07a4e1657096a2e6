//! Scripts of robots: observations of a simulated robot, and the answers that a single local loop
//! gives to each observation.

use std::path::Path;
use std::time::Duration;

use metaplan::mapek::{Loop, Observation};
use metaplan::planner::Limits;
use metaplan::setup::Setup;
use metaplan::simulate::Strategy;
use serde_json::{Value, json};

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

/// Returns at most the given number of event lines: the enrolment and the observations of a
/// simulated robot, with their times. Also returns the answers of a separate loop to each line.
pub(super) fn play(mission: &str, scenario: &str, seed: u64, most: usize) -> (Vec<String>, Vec<Vec<Value>>) {
    let own = setup(mission).experiment(scenario).unwrap_or_else(|errors| panic!("{errors}"));
    let mut events = vec![json!({"event": "enrol", "mission": mission}).to_string()];
    let mut is_first = true;
    let mut log = |observation: &Observation, _: &[_]| {
        // The first log entry is the start of the loop.
        if !std::mem::take(&mut is_first) {
            events.push(observation.to_json().to_string());
        }
    };
    own.run(Strategy::Joint, seed, &Limits::none(), &mut log).unwrap_or_else(|errors| panic!("{errors}"));
    events.truncate(most);
    let answers = alone(mission, &events);
    (events, answers)
}

/// Returns the answers of a single local loop to each event line. The first line must enrol the
/// robot.
pub(super) fn alone(mission: &str, events: &[String]) -> Vec<Vec<Value>> {
    let Setup { mission, settings, .. } = setup(mission);
    let mut control = Loop::new(mission, settings).unwrap_or_else(|errors| panic!("{errors}"));
    let start = control.start();
    let mut answers = vec![control.decision(&start).answers];
    for event in &events[1..] {
        let own = control.handle(&Observation::parse(event), Duration::ZERO);
        answers.push(control.decision(&own).answers);
    }
    answers
}

/// Removes explanations from answers, because several explanations may be valid.
pub(super) fn essence(answers: &[Value]) -> Vec<Value> {
    let mut answers = answers.to_vec();
    for answer in &mut answers {
        for list in ["designs", "objectives"] {
            let own = answer.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten();
            for object in own.filter_map(Value::as_object_mut) {
                object.remove("because");
            }
        }
    }
    answers
}
