//! All that is wrong or questionable about a mission, found without planning.

use crate::message::Message;
use crate::mission::Mission;
use crate::setup::Setup;
use crate::simulate::Simulation;

/// What there is to say of a mission that could be read, errors first.
///
/// ```
/// use std::path::Path;
/// use metaplan::{lint::lint, setup::Setup};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// assert!(lint(&Setup::read(Path::new("missions/ugv.toml"))?).is_empty());
/// # Ok(())
/// # }
/// ```
pub fn lint(setup: &Setup) -> Vec<Message> {
    let mission = &setup.mission;
    let mut messages: Vec<Message> = mission.warnings().cloned().collect();
    match mission.filled() {
        Ok((_, more)) => messages.extend(more),
        Err(errors) => messages.extend(errors),
    }
    messages.extend(setup.positions().err().into_iter().flatten());
    for (name, scenario) in &setup.scenarios {
        let mut wrong = Vec::new();
        wrong.extend(scenario.apply(&mut mission.clone()).err());
        let simulation = scenario.simulation.as_ref();
        wrong.extend(simulation.into_iter().flat_map(|simulation| disturbances(mission, simulation)));
        messages.extend(wrong.iter().map(|message| setup.in_scenario(name, message)));
    }
    in_order(messages)
}

/// Messages, each once: errors first, then as they stand in files.
pub fn in_order(mut messages: Vec<Message>) -> Vec<Message> {
    let key = |message: &Message| {
        let place = (message.file.clone(), message.line, message.column);
        (!message.is_error(), place, message.code.clone(), message.message.clone())
    };
    messages.sort_by_cached_key(key);
    messages.dedup_by_key(|message| key(message));
    messages
}

/// What is wrong with what happens to a simulated robot.
fn disturbances(mission: &Mission, simulation: &Simulation) -> Vec<Message> {
    let mistake = simulation.mistake().map(|mistake| Message::error("M135", mistake));
    let mut wrong: Vec<Message> = mistake.into_iter().collect();
    let mut changed = mission.clone();
    for event in &simulation.events {
        let components = event.fail.iter().chain(&event.recover);
        wrong.extend(components.filter_map(|component| changed.fail(component).err()));
        wrong.extend(event.set.iter().filter_map(|(name, value)| changed.set(name, value).err()));
    }
    let random = simulation.failures.iter();
    wrong.extend(random.filter_map(|failure| changed.fail(&failure.component).err()));
    wrong
}
