//! Search for concurrent plans: A* over happenings with a simple temporal network, incomplete searches for
//! good plans, and linear programs for durations that the planner chooses.
//!
//! Absent: SAT and OWL.

#![warn(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::arithmetic_side_effects
)]
#![cfg_attr(
    test,
    allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        clippy::arithmetic_side_effects
    )
)]

mod concurrent;

pub use concurrent::{ConcurrentTask, ground_concurrent, optimize_concurrent};
