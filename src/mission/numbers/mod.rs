//! Detects missing and unintended numbers, which make actions and designs unusable although all
//! files are well-formed.

mod analysis;
mod syntax;
mod warnings;

use std::collections::BTreeMap;

use ::mission::Mission;

pub use analysis::MissingValue;

use crate::message::Message;
use analysis::Numbers;

/// Adds warnings about probable mistakes to a mission, after its situation has been set:
/// [`Mission::doubts`] and, if the mission has a knowledge base, [`doubts`].
pub fn note_doubts(mission: &mut Mission) {
    mission.note_doubts();
    if mission.knowledge().is_some() {
        let doubts = doubts(mission);
        mission.change_warnings(|warnings| warnings.into_iter().chain(doubts).collect());
    }
}

/// Returns warnings about numbers that are probably missing by mistake, and about negative
/// durations.
pub fn doubts(mission: &Mission) -> Vec<Message> {
    let numbers = Numbers::new(mission);
    let (missing, negative) = numbers.check();
    // Functions without any value (`is_silent`) have a separate warning (M206).
    let missing: Vec<MissingValue> =
        missing.into_iter().filter(|value| !value.is_silent && value.is_likely).collect();
    let estimations = missing.iter().filter_map(|value| Some((value, value.estimation.as_ref()?)));
    let mut doubts: Vec<Message> = estimations
        .map(|(value, (design, attribute))| numbers.no_estimation(value, design, attribute))
        .collect();
    let mut values: BTreeMap<&str, Vec<&MissingValue>> = BTreeMap::new();
    for value in missing.iter().filter(|value| value.estimation.is_none()) {
        values.entry(&value.symbol).or_default().push(value);
    }
    doubts.extend(values.values().map(|missing| numbers.no_value(missing)));
    doubts.extend(negative.iter().map(|duration| numbers.negative(duration)));
    doubts
}

/// Returns the numeric functions without a value that actions need. If some of them are probable mistakes or have no
/// value for any arguments, returns only these.
pub fn missing_values(mission: &Mission) -> Vec<MissingValue> {
    let values = Numbers::new(mission).check().0;
    let is_told = |value: &MissingValue| value.is_likely || value.is_silent;
    let is_any = values.iter().any(is_told);
    values.into_iter().filter(|value| !is_any || is_told(value)).collect()
}

/// Returns sentences with the reasons why some actions can never use a design, even if it is available: missing
/// estimations and negative durations.
pub fn against(mission: &Mission, design: &str) -> Vec<String> {
    let (missing, negative) = Numbers::new(mission).check();
    let missing = missing.iter().filter_map(|value| {
        let (of, attribute) = value.estimation.as_ref()?;
        (of == design).then(|| {
            format!("it has no estimation of {attribute}, which {} needs", value.needed_by.join(", "))
        })
    });
    let negative = negative.iter().filter(|duration| duration.design.as_deref() == Some(design));
    let negative = negative.map(|duration| {
        format!(
            "with it the duration of {} would be {}, which is negative",
            duration.action, duration.duration
        )
    });
    missing.chain(negative).collect()
}
