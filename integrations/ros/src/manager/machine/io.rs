//! What the machine hears, what it asks for, and where it is.

use std::fmt;
use std::time::Duration;

use serde_json::Value;

use crate::perform::Call;

/// What is heard.
#[derive(Debug)]
pub(in crate::manager) enum Input {
    /// The functions answer; the mode that each has, as far as it says.
    Ready(Vec<(String, Option<String>)>),
    /// Something was diagnosed that waits to be handled: the driver makes a line of it.
    Diagnosed,
    /// A line of events, as the loop reads them.
    Line(String),
    /// A task is requested; whether it is granted is answered under this number.
    Request(u64, String),
    /// A task is to end.
    Cancel(u64, String),
    /// A function has answered to a call, or has not.
    Changed(Change, Outcome),
    /// The current mode of a function, as its mode manager has answered.
    Mode(String, String),
    /// The mode that a client has requested from a function's mode manager.
    ModeRequested(String, String),
    /// Something about a function has changed that does not say its mode.
    Touched(String),
    /// An action has ended.
    Performed(u64, Ended),
    /// How much of it is done, from 0 to 1.
    Progress(u64, f64),
    /// A function that did not answer does again, or not yet.
    Probed(String, bool),
    /// The mode of the autopilot.
    Autopilot(String),
    /// Time passes.
    Tick,
}

/// A call of `change_mode`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::manager) struct Change {
    /// The function.
    pub(in crate::manager) function: String,
    /// The mode that is asked for.
    pub(in crate::manager) mode: String,
    /// The loop's effect; none where the function is not needed any more.
    pub(in crate::manager) effect: Option<u64>,
    /// From 1.
    pub(in crate::manager) attempt: u32,
}

/// What has come of a call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::manager) enum Outcome {
    /// The function has the mode.
    Done,
    /// It has said no.
    Refused,
    /// It has said nothing that is understood: why.
    Failed(String),
}

/// How an action has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::manager) enum Ended {
    Succeeded,
    Cancelled,
    Failed(String),
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::manager) enum Output {
    /// To call `change_mode`.
    Change(Change),
    /// To ask a function for its mode.
    Look(String),
    /// To ask a function, so much later, whether it answers.
    Probe(String, Duration),
    /// To answer a request.
    Reply(u64, bool),
    /// To begin an action.
    Perform(u64, Call),
    /// To end an action early.
    Stop(u64),
    /// To publish a plan.
    Plan(Value),
    /// To publish an event.
    Event(Value),
    /// To log something that is wrong.
    Warn(String),
}

/// Where the machine is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::manager) enum State {
    WaitGraph,
    Idle,
    /// It is passed within one input.
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
