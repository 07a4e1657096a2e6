//! A robot in its partition.

use std::collections::VecDeque;
use std::time::Instant;

use crate::robot::{Refused, Robot};
use crate::store::{Fault, Stored};
use crate::wire::{Decided, Progress};

/// A robot, what waits for it, and what of it is not saved.
#[derive(Default)]
pub(super) struct Slot {
    /// None while it is at work.
    pub(super) robot: Option<Box<Robot>>,
    /// The event that it is at, and the last decision that was known when it began.
    pub(super) at: Option<(u64, u64)>,
    pub(super) waiting: VecDeque<Stored>,
    /// Its last decision.
    pub(super) chain: u64,
    /// Decisions of former owners that it has not gone through.
    pub(super) before: VecDeque<(u64, Decided)>,
    /// Events and decisions since it was saved.
    pub(super) unsaved: VecDeque<(u64, u64)>,
    pub(super) since: Option<Instant>,
    /// The revision of what was saved.
    pub(super) revision: u64,
    pub(super) is_saving: bool,
    /// Why it cannot go on, if it cannot.
    pub(super) faulted: bool,
    /// When it was used last, if it is kept ready; 0 if it is not.
    pub(super) used: u64,
}

/// What was done beside.
pub(super) enum Done {
    /// An event was taken.
    Taken { robot: String, own: Box<Robot>, event: Stored, outcome: Outcome },
    /// A robot was saved, up to an event, as a revision.
    Kept { robot: String, event: u64, revision: Result<u64, Fault> },
    /// The progress was written.
    Progressed { progress: Progress, revision: Result<u64, Fault> },
}

pub(super) enum Outcome {
    /// As the decision of that sequence says.
    Decided(u64),
    Refused(Refused),
    Faulted(String),
    Fenced,
}
