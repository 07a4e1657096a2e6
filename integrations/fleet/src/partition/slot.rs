//! A robot of a partition, with its queue and its unsaved decisions.

use std::collections::VecDeque;
use std::time::Instant;

use crate::robot::{Refused, Robot};
use crate::store::{Fault, Stored};
use crate::wire::{Decided, Progress};

#[derive(Default)]
pub(super) struct Slot {
    /// State of the robot. `None` while an event is being handled.
    pub(super) robot: Option<Box<Robot>>,
    /// While an event is being handled: its sequence number, and the sequence number of the
    /// partition's last decision at the start. For a replayed event, this is the number before its
    /// decision.
    pub(super) at: Option<(u64, u64)>,
    pub(super) waiting: VecDeque<Stored>,
    /// Sequence number of the robot's last decision; 0 without a decision.
    pub(super) chain: u64,
    /// Decisions of former owners that are not replayed yet, with their sequence numbers.
    pub(super) before: VecDeque<(u64, Decided)>,
    /// Sequence numbers of the events and their decisions since the last snapshot. If the robot is
    /// faulted, there is at least one entry, so that the progress stays before it.
    pub(super) unsaved: VecDeque<(u64, u64)>,
    pub(super) since: Option<Instant>,
    /// Revision of the last snapshot of the robot; 0 without a snapshot.
    pub(super) revision: u64,
    pub(super) is_saving: bool,
    pub(super) faulted: bool,
    /// Number of events that the partition had handled when the robot was last used; 0 if the robot is
    /// not loaded.
    pub(super) used: u64,
}

pub(super) enum Done {
    Taken {
        robot: String,
        own: Box<Robot>,
        event: Stored,
        outcome: Outcome,
    },
    /// A snapshot of a robot, which contains all events up to `event`, was stored or could not be stored.
    Kept {
        robot: String,
        event: u64,
        revision: Result<u64, Fault>,
    },
    Progressed {
        progress: Progress,
        revision: Result<u64, Fault>,
    },
}

pub(super) enum Outcome {
    Decided(u64),
    Refused(Refused),
    Faulted(String),
    Fenced,
}
