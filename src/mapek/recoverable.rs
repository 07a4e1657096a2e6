//! Interface between a loop and its journal: recorded decisions, and the restoration of the loop from the journal.

use std::time::Duration;

use serde_json::Value;

use crate::mapek::answer::Answer;
use crate::mapek::control::Loop;
use crate::mapek::event::Observation;
use crate::mapek::record::{Decision, Snapshot};
use crate::mapek::settings::Unrecorded;
use crate::message::Message;

/// A loop whose state can be restored from a journal. Equal observations at equal times, with the recorded plans, must
/// give equal decisions.
pub trait Recoverable {
    /// An answer of the loop.
    type Answer: From<Answer>;

    /// Returns the checksum of the initial knowledge, mission and settings and of the version of the program, which
    /// identifies the loop in a journal.
    fn digest(&self) -> String;

    /// Returns the reaction to a journal that cannot be written.
    fn unrecorded(&self) -> Unrecorded;

    /// Returns `true` if a decision is pending: the loop has not begun, or its reactions since the last deliberation
    /// have left a decision open.
    fn has_agenda(&self) -> bool;

    /// Reacts to an observation; `now` is the time since the start.
    fn react(&mut self, observation: &Observation, now: Duration) -> Vec<Self::Answer>;

    /// Makes the decisions left open by [`Recoverable::react`], or the first decision if the loop has not begun. May
    /// search for a plan.
    fn deliberate(&mut self) -> Vec<Self::Answer>;

    /// Reacts to an observation, and deliberates with the recorded `plans` instead of a search.
    fn handle_again(
        &mut self,
        observation: &Observation,
        now: Duration,
        plans: &[Value],
    ) -> Vec<Self::Answer>;

    /// Deliberates with the recorded `plans` instead of a search.
    fn deliberate_again(&mut self, plans: &[Value]) -> Vec<Self::Answer>;

    /// Returns the journal's record of a reaction or deliberation: its answers, and the plans computed for them. Is
    /// called once after each reaction or deliberation.
    fn decision(&mut self, answers: &[Self::Answer]) -> Decision;

    /// Returns the effects that still await an acknowledgement, for repetition after a restart.
    fn repeat(&self) -> Vec<Self::Answer>;

    /// Returns the number of the effect that an answer requests, or `None` if the answer requests no effect.
    fn effect(answer: &Self::Answer) -> Option<u64>;

    /// Returns a snapshot of the state. Afterwards, this loop makes the same decisions as a loop restored from the
    /// snapshot.
    fn checkpoint(&mut self) -> Snapshot;

    /// Restores the state from a snapshot of a loop with the same checksum.
    ///
    /// # Errors
    /// The snapshot is damaged or does not fit this loop.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), Message>;
}

impl Recoverable for Loop {
    type Answer = Answer;

    fn digest(&self) -> String {
        self.digest()
    }

    fn unrecorded(&self) -> Unrecorded {
        self.settings().unrecorded
    }

    fn has_agenda(&self) -> bool {
        self.has_agenda()
    }

    fn react(&mut self, observation: &Observation, now: Duration) -> Vec<Answer> {
        self.react(observation, now)
    }

    fn deliberate(&mut self) -> Vec<Answer> {
        self.deliberate()
    }

    fn handle_again(&mut self, observation: &Observation, now: Duration, plans: &[Value]) -> Vec<Answer> {
        self.handle_again(observation, now, plans)
    }

    fn deliberate_again(&mut self, plans: &[Value]) -> Vec<Answer> {
        self.deliberate_again(plans)
    }

    fn decision(&mut self, answers: &[Answer]) -> Decision {
        self.decision(answers)
    }

    fn repeat(&self) -> Vec<Answer> {
        self.repeat()
    }

    fn effect(answer: &Answer) -> Option<u64> {
        answer.effect().map(|effect| effect.number)
    }

    fn checkpoint(&mut self) -> Snapshot {
        self.snapshot()
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), Message> {
        self.restore(snapshot)
    }
}
