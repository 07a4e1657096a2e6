//! What to do about it: PDDL to a ground task, to CNF, to a plan that is proved optimal.
//!
//! Modules in the order of the pipeline; each turns one thing into the next:
//! Syntax tree (crate `pddl`) → `normalize` → lifted task → `ground` → ground task → `bounds`, `search` → `encode` → formula → `optimize` → plan.
//!
//! What is absent: OWL. Availability of designs arrives as facts of the problem.

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
mod error;
mod limits;
mod lists;
mod number;
mod thresholds;
mod words;

mod compile;
mod lifted;
mod normalize;
mod task;

mod ground;

mod bounds;
mod context;
mod plan;
mod satisfice;
mod search;

mod encode;
mod sat;

mod optimize;

mod alternatives;
mod concurrent;
mod configuration;
mod exact;
mod planner;
mod replan;

mod certificate;

pub mod shipped;

#[cfg(test)]
mod tests;

pub use self::certificate::{Certificate, Outputs as RefutationOutputs, certify, certify_exact, refute};
pub use alternatives::{Alternatives, Forced, alternatives};
pub use codes::CODES;
pub use concurrent::{Concurrent, ground_concurrent, optimize_concurrent};
pub use configuration::{Chosen, DesignChoice, configure};
pub use encode::Semantics;
pub use error::{Error, Errors, File, Place};
pub use exact::{ExactTask, ground_exact, optimize_exact};
pub use ground::{GroundConfig, ground};
pub use limits::Limits;
pub use optimize::{Config, Engine, Front, Point, Strategy, lexicographic, optimize, pareto};
pub use plan::solution::{Improvement, Moment, Part, Proof, Solution, Statistics, Status, Unbounded};
pub use plan::transitions::{Situation, Transition};
pub use plan::{Exact, NotANumber, Plan, Step};
pub use planner::Planner;
pub use replan::{First, Progress, Query, Replanned, Replanner};
pub use sat::{Backend, BackendError};
pub use task::Task;
#[doc(hidden)]
pub use thresholds::Thresholds;
pub use words::UnknownWord;
pub use {num_rational::BigRational, pddl};

/// The example of the README is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
