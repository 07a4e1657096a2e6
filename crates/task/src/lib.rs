//! Converts a PDDL task to a lifted task and further to a ground task: compilation of language features, normalization,
//! and grounding. Also contains plans.
//!
//! Modules in the order of the pipeline: syntax tree (crate `pddl`) → `compile` → `normalize` → `lifted` → `ground` →
//! `task` → `plan`.
//!
//! The crate contains neither search nor SAT nor OWL. Facts of the problem state which designs are available.

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

mod codes;
pub mod error;
pub mod words;

pub mod compile;
pub mod context;
pub mod ground;
pub mod lifted;
pub mod limits;
pub mod lists;
pub mod normalize;
pub mod number;
pub mod plan;
pub mod task;
pub mod thresholds;

pub use codes::CODES;
pub use error::{Error, Errors, File, Place};
