//! Applies timed initial literals at or before time 0.

use crate::lifted::{Arguments, Lifted, ObjectId};

/// Applies the events at or before time 0 to the initial facts, and advances the phase (the atom that states how many
/// events have occurred).
#[expect(clippy::arithmetic_side_effects, reason = "phases are objects, which are held in memory")]
pub fn begin(lifted: &mut Lifted) {
    let phases = (lifted.time.first_phase.0..).map(ObjectId);
    for (event, phase) in lifted.events.iter().take_while(|event| !event.time.is_positive()).zip(phases) {
        let before: (_, Arguments) = (lifted.time.phase, [phase].into());
        let after: (_, Arguments) = (lifted.time.phase, [ObjectId(phase.0 + 1)].into());
        let changes = event
            .changes
            .iter()
            .map(|(predicate, arguments, holds)| ((*predicate, arguments.clone()), *holds));
        for (fact, holds) in changes.chain([(before, false), (after, true)]) {
            lifted.facts.retain(|stated| *stated != fact);
            if holds {
                lifted.facts.push(fact);
            }
        }
    }
}
