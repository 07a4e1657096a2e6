//! Inputs, outputs and states of the state machine.

use std::fmt;
use std::time::Duration;

use serde_json::Value;

use crate::perform::Call;

#[derive(Debug)]
pub(in crate::manager) enum Input {
    /// All functions are present. Contains their modes; `None` for a function that did not report its mode.
    Ready(Vec<(String, Option<String>)>),
    /// A diagnostic is pending; the driver converts it to a line.
    Diagnosed,
    Line(String),
    /// Request to start a task: the number that identifies the reply, and the name of the task.
    Request(u64, String),
    /// Request to end a task: the number that identifies the reply, and the name of the task.
    Cancel(u64, String),
    Changed(Change, Outcome),
    /// The current mode of a function, as its mode manager has answered or as its nodes show. Empty if the
    /// function is in none of its modes.
    Mode(String, String),
    /// The mode that a client has requested from a function's mode manager.
    ModeRequested(String, String),
    /// A node of a function has reported a transition or a changed parameter, so the function's mode may have
    /// changed.
    Touched(String),
    Performed(u64, Ended),
    /// Number of an action, and its completed share from 0 to 1.
    Progress(u64, f64),
    /// A function without a reply was probed: `true` if it replies.
    Probed(String, bool),
    Autopilot(String),
    /// The time of the wait with this number is over (see [`Output::Await`]).
    Overdue(u64),
    Tick,
}

/// Request to set a mode of a function, by a call of `change_mode` or by steps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::manager) struct Change {
    pub(in crate::manager) function: String,
    pub(in crate::manager) mode: String,
    /// Number of the effect of the loop that requires the change. `None` if the function is no longer needed.
    pub(in crate::manager) effect: Option<u64>,
    /// Number of the attempt, from 1. Steps have only the last attempt.
    pub(in crate::manager) attempt: u32,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::manager) enum Outcome {
    Done,
    Refused,
    /// There was no valid reply, for this reason.
    Failed(String),
    /// A step or condition has failed for this reason, and the earlier steps were undone as far as possible.
    StepFailed(String),
    /// The outcome of steps that have failed, after which the function is in none of its modes, usually because some steps
    /// were not undone.
    NoMode(Box<Outcome>),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::manager) enum Ended {
    Succeeded,
    Cancelled,
    Failed(String),
}

#[derive(Debug, Clone, PartialEq)]
pub(in crate::manager) enum Output {
    Change(Change),
    /// Request the mode of a function.
    Look(String),
    /// Check after a delay whether a function replies.
    Probe(String, Duration),
    Reply(u64, bool),
    Perform(u64, Call),
    Stop(u64),
    /// Wait for the end of an action: after the delay, report the number of the wait as overdue.
    Await(u64, Duration),
    Plan(Value),
    Event(Value),
    Warn(String),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::manager) enum State {
    WaitGraph,
    Idle,
    /// Transient state within the handling of an input.
    Plan,
    Reconfigure,
    Execute,
    Degraded,
}

impl fmt::Display for State {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::WaitGraph => "WAIT_GRAPH",
            Self::Idle => "IDLE",
            Self::Plan => "PLAN",
            Self::Reconfigure => "RECONFIGURE",
            Self::Execute => "EXECUTE",
            Self::Degraded => "DEGRADED",
        })
    }
}
