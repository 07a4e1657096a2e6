//! A robot of a partition, with its queue and its unsaved decisions.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::robot::{Refused, Robot};
use crate::store::{Fault, Stored};
use crate::wire::{Decided, Progress};

#[derive(Default)]
pub(super) struct Slot {
    /// State of the robot. `None` while an event is being handled.
    pub(super) robot: Option<Box<Robot>>,
    /// While an event is being handled: its sequence number, and the sequence number of the partition's last decision
    /// at the start. For a replayed event, the second number is less than that of its decision.
    pub(super) at: Option<(u64, u64)>,
    pub(super) waiting: VecDeque<Stored>,
    /// Sequence number from which events of the robot are not in the queue and have to be read again,
    /// because the queue was full.
    pub(super) behind: Option<u64>,
    /// Sequence number of the last event that was not queued since the robot's events were last read
    /// again; 0 without such an event.
    pub(super) omitted: u64,
    pub(super) is_refilling: bool,
    /// Sequence number of the robot's last decision; 0 without a decision. `None` if it is unknown.
    pub(super) chain: Option<u64>,
    /// Decisions of former owners that are not replayed yet, with their sequence numbers.
    pub(super) before: VecDeque<(u64, Decided)>,
    /// Sequence numbers of the events and their decisions since the last snapshot.
    pub(super) unsaved: VecDeque<(u64, u64)>,
    pub(super) since: Option<Instant>,
    /// Revision of the last snapshot of the robot; 0 without a snapshot.
    pub(super) revision: u64,
    pub(super) is_saving: bool,
    /// For a suspended robot, which handles no event except one that retires it: sequence numbers of its
    /// first event and decision that its snapshot does not contain.
    pub(super) suspended: Option<(u64, u64)>,
    /// `true` if the stored snapshot has [`behind`](crate::wire::Saved::behind), so that the progress need
    /// not wait for the robot.
    pub(super) is_apart: bool,
    /// Number of events that the partition had handled when the robot was last used; 0 if the robot is
    /// not loaded.
    pub(super) used: u64,
    pub(super) search: Option<Duration>,
}

impl Slot {
    /// Returns the greatest sequence numbers of events and decisions up to which the progress of the partition may
    /// advance without losing data of this robot. `None` if the robot does not limit the progress.
    pub(super) fn limits(&self) -> Option<(u64, u64)> {
        if self.is_apart {
            return None;
        }
        let first = self.unsaved.front();
        let waits = self.waiting.front().map(|event| event.sequence);
        let events = [waits, self.behind, self.at.map(|at| at.0)];
        let events =
            events.into_iter().chain([first.map(|first| first.0), self.suspended.map(|first| first.0)]);
        let replay = self.before.front().map(|(decision, _)| decision - 1);
        let decisions = [first, self.suspended.as_ref()].map(|first| first.map(|first| first.1 - 1));
        let decisions = decisions.into_iter().chain([self.at.map(|at| at.1), replay]);
        let (events, decisions) = (events.flatten().min(), decisions.flatten().min());
        Some((events.map_or(u64::MAX, |event| event - 1), decisions.unwrap_or(u64::MAX)))
    }

    /// Returns `true` if nothing has to be stored about the robot: it is retired or was never
    /// enrolled, and the progress of the partition includes its last event and decision.
    pub(super) fn is_obsolete(&self, progress: &Progress) -> bool {
        let is_idle = self.waiting.is_empty()
            && self.before.is_empty()
            && self.unsaved.is_empty()
            && self.behind.is_none()
            && self.suspended.is_none()
            && !(self.is_saving || self.is_refilling || self.is_apart);
        is_idle
            && self
                .robot
                .as_ref()
                .is_some_and(|robot| robot.mission.is_none() && robot.event <= progress.events)
            && self.chain.is_none_or(|chain| chain <= progress.decisions)
    }
}

pub(super) enum Done {
    Taken {
        robot: String,
        own: Box<Robot>,
        event: Stored,
        outcome: Outcome,
        search: Option<Duration>,
    },
    /// A snapshot of a robot, which contains all decided events up to `event`, was stored or could not be stored.
    Kept {
        robot: String,
        event: u64,
        behind: bool,
        revision: Result<u64, Fault>,
    },
    Removed {
        robot: String,
        outcome: Result<(), Fault>,
    },
    /// Events of a robot were read again: all that were omitted, or the first `MAX_PAGE` of them.
    Refilled {
        robot: String,
        events: Result<Vec<Stored>, Fault>,
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
