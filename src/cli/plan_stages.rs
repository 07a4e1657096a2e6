//! What answers about plans have in common: the status in a word, and times.

use std::time::Duration;

use encodings::Status;

/// Milliseconds spent before the optimizer runs.
#[derive(Default)]
pub(super) struct Stages {
    pub(super) read: Duration,
    pub(super) ground: Duration,
}

/// The status in a word, as JSON has it.
pub(super) fn status_word(status: Status) -> &'static str {
    match status {
        Status::Optimal => "optimal",
        Status::Feasible => "feasible",
        Status::Unsolvable => "unsolvable",
        Status::UnsolvableWithinHorizon => "unsolvable_within_horizon",
        Status::Unknown => "unknown",
    }
}

pub(super) fn milliseconds(duration: Duration) -> f64 {
    (duration.as_secs_f64() * 1e6).round() / 1e3
}
