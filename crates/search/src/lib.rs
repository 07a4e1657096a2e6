//! Heuristic search in ground tasks: admissible heuristics, A*, and satisficing search.
//!
//! Absent: PDDL, SAT, and actions that overlap in time.

#![allow(missing_docs, reason = "an interface of the workspace; names say what fields hold")]
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

pub mod bounds;
pub mod random;
pub mod satisfice;
pub mod search;
