//! Creation of MAPE-K loops for the tests, and delivery of events.

use std::path::Path;
use std::time::Duration;

use metaplan::mapek::{Answer, Loop, Observation, Settings};
use metaplan::setup::Setup;

/// Creates a loop for a shipped mission. The loop accepts every report immediately, without filters, so that
/// tests can compare its beliefs with the last report.
pub fn control(name: &str) -> Loop {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{name}.toml"));
    let Setup { mission, settings, .. } = Setup::read(&manifest).expect("the mission is read");
    let settings = Settings::immediate().with_time_unit(settings.time_unit);
    Loop::new(mission, settings).expect("the mission can be planned for")
}

/// Delivers an event line 100 ms after the previous line.
pub fn feed(control: &mut Loop, line: &str) -> Vec<Answer> {
    let now = control.beliefs().now() + Duration::from_millis(100);
    control.handle(&Observation::parse(line), now)
}
