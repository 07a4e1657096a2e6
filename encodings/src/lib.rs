//! What to do about it: PDDL to a ground task, to CNF, to a plan that is proved optimal.
//!
//! Modules in the order of the pipeline; each turns one thing into the next:
//! `pddl` text → syntax tree → `normalize` → lifted task → `ground` → ground task → `bounds`, `search` → `encode` → formula → `optimize` → plan.
//! `validate` checks a plan against the syntax tree and shares nothing with the rest.
//!
//! What is absent: OWL. Availability of designs arrives as facts of the problem.

#![warn(clippy::cast_possible_truncation, clippy::cast_possible_wrap, clippy::cast_sign_loss)]
#![cfg_attr(
    test,
    allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, clippy::cast_sign_loss)
)]

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "positions in texts below 4 GiB"
)]
pub mod pddl;
#[expect(clippy::cast_possible_truncation, reason = "positions in lists that are held in memory")]
pub mod validate;

mod error;
mod exact;
mod lifted;
mod normalize;
mod number;

mod configuration;
mod ground;
mod quantity;
mod task;

mod alternatives;
mod bounds;
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    reason = "positions in lists that are held in memory, and DIMACS variables of formulas below a size limit"
)]
mod certificate;
#[expect(clippy::cast_possible_truncation, reason = "positions in lists that are held in memory")]
mod concurrent;
mod earliest;
mod encode;
mod limits;
mod objectives;
mod optimize;
mod plan;
mod replan;
mod sat;
mod search;
mod solution;
mod successors;
mod ties;
mod transitions;

#[cfg(test)]
mod tests;

pub use alternatives::{Alternatives, Forced, alternatives};
pub use certificate::{
    Cause as ComparisonCause, Certificate, Checked, Difference, Faithful, Fault, Inputs as RefutationInputs,
    Outputs as RefutationOutputs, StepBound, certify, certify_exact, check as check_certificate,
    check_refutation, faithful, refute, verification_conditions, witness,
};
pub use concurrent::{Concurrent, ground_concurrent, optimize_concurrent};
pub use encode::Semantics;
pub use error::{Error, File, Place};
pub use exact::{ExactTask, ground_exact, optimize_exact};
pub use ground::{Config as GroundConfig, ground};
pub use limits::Limits;
pub use objectives::{Front, Point, lexicographic, pareto};
pub use optimize::{Config, Strategy, optimize};
pub use plan::{Exact, Plan, Step};
pub use replan::{First, Query, Replanned, Replanner};
pub use sat::{Backend, BackendError};
pub use solution::{Improvement, Proof, Solution, Statistics, Status, Unbounded};
pub use task::Task;
pub use transitions::{Situation, Transition};
