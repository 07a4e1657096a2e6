//! Collects errors and warnings about a mission, without planning.

use std::time::Duration;

use pddl::ast::Problem;
use planner::Limits;

use crate::message::Message;
use crate::mission::{Mission, Planning as _, numbers};
use crate::setup::Setup;

const TIME_LIMIT: Duration = Duration::from_secs(20);

/// Returns the errors and warnings about a mission: errors first, without duplicates. Constructs that the planner does
/// not support are found by grounding, which stops after 20 seconds. If the problem cannot be filled from the knowledge
/// base, it is not grounded.
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
    messages.extend(numbers::doubts(mission));
    match mission.filled() {
        Ok((problem, more)) => {
            messages.extend(more);
            messages.extend(refused(mission, &problem));
        }
        Err(errors) => messages.extend(errors),
    }
    messages.extend(setup.positions().err().into_iter().flatten());
    messages.extend(setup.mistakes());
    messages.extend(setup.settings.doubts(mission.knowledge()));
    in_order(messages)
}

/// Returns messages about constructs that the planner does not support. Omits numbers that are too
/// large for integers (E304) and an exceeded time limit (E306), which are not faults of the
/// mission.
fn refused(mission: &Mission, problem: &Problem) -> impl Iterator<Item = Message> {
    let limits = Limits::none().with_time(TIME_LIMIT);
    let refused = mission.ground(problem, &[], &limits).err().into_iter().flatten();
    refused.filter(|message| !["E304", "E306"].contains(&message.code.as_str()))
}

/// Sorts messages: errors first, then by position in the files. Removes duplicates.
pub fn in_order(mut messages: Vec<Message>) -> Vec<Message> {
    let key = |message: &Message| {
        let place = (message.file.clone(), message.line, message.column);
        (!message.is_error(), place, message.code.clone(), message.message.clone())
    };
    messages.sort_by_cached_key(key);
    messages.dedup_by_key(|message| key(message));
    messages
}
