//! Applies timed initial literals at or before time 0.

use rustc_hash::FxHashSet;

use crate::lifted::{Arguments, Lifted, ObjectId, PredicateId};

/// Applies the events at or before time 0 to the initial facts, and advances the phase (the atom that states how many
/// events have occurred).
#[expect(clippy::arithmetic_side_effects, reason = "phases are objects, which are held in memory")]
pub fn begin(lifted: &mut Lifted) {
    let phases = (lifted.time.first_phase.0..).map(ObjectId);
    let mut changes: Vec<((PredicateId, Arguments), bool)> = Vec::new();
    for (event, phase) in lifted.events.iter().take_while(|event| !event.time.is_positive()).zip(phases) {
        let of_event = event.changes.iter();
        changes
            .extend(of_event.map(|(predicate, arguments, holds)| ((*predicate, arguments.clone()), *holds)));
        changes.push(((lifted.time.phase, [phase].into()), false));
        changes.push(((lifted.time.phase, [ObjectId(phase.0 + 1)].into()), true));
    }
    // The last change of a fact counts.
    let mut changed = FxHashSet::default();
    changes.reverse();
    changes.retain(|(fact, _)| changed.insert(fact.clone()));
    lifted.facts.retain(|fact| !changed.contains(fact));
    lifted.facts.extend(changes.into_iter().rev().filter(|(_, holds)| *holds).map(|(fact, _)| fact));
}
