//! A robot in its partition.

use std::collections::VecDeque;
use std::time::Instant;

use crate::robot::{Refused, Robot};
use crate::store::{Fault, Stored};
use crate::wire::{Decided, Progress};

/// A robot with its pending events and unsaved decisions.
#[derive(Default)]
pub(super) struct Slot {
    /// `None` while the robot is at work.
    pub(super) robot: Option<Box<Robot>>,
    /// Sequences of the current event and of the last known decision at its start.
    pub(super) at: Option<(u64, u64)>,
    pub(super) waiting: VecDeque<Stored>,
    /// Sequence of the robot's last decision.
    pub(super) chain: u64,
    /// Decisions of former owners that are not replayed yet.
    pub(super) before: VecDeque<(u64, Decided)>,
    /// Sequences of events and decisions since the last save.
    pub(super) unsaved: VecDeque<(u64, u64)>,
    pub(super) since: Option<Instant>,
    /// Revision of the saved state.
    pub(super) revision: u64,
    pub(super) is_saving: bool,
    /// `true` if the robot cannot continue.
    pub(super) faulted: bool,
    /// Time of the last use in ticks of the partition's clock; 0 if the robot is not loaded.
    pub(super) used: u64,
}

/// Result of a background job.
pub(super) enum Done {
    /// An event was handled.
    Taken { robot: String, own: Box<Robot>, event: Stored, outcome: Outcome },
    /// A robot was saved up to an event, with this revision.
    Kept { robot: String, event: u64, revision: Result<u64, Fault> },
    /// The progress was written.
    Progressed { progress: Progress, revision: Result<u64, Fault> },
}

pub(super) enum Outcome {
    /// Decided, with the sequence of the decision.
    Decided(u64),
    Refused(Refused),
    Faulted(String),
    Fenced,
}
