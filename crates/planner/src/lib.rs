//! Finds plans of PDDL tasks and proves their optimality: a portfolio of heuristic search and SAT, multiple
//! objectives, alternative plans, replanning, certificates, and the selection of designs without a plan.
//!
//! The crate does not use OWL. The problem states as facts which designs are available.

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

mod alternatives;
mod certificate;
mod configuration;
mod exact;
mod optimize;
mod planner;
mod replan;

pub use self::certificate::{
    Attempt, Certificate, NoCertificate, Outputs as RefutationOutputs, attempts, certify, certify_exact,
    refute,
};
pub use alternatives::{Alternatives, Forced, alternatives};
pub use configuration::{Assignment, DesignChoice, configure};
pub use encodings::encode::StepSemantics;
pub use encodings::sat::{Backend, BackendError};
pub use encodings::shipped;
pub use exact::{ExactTask, ground_exact, optimize_exact};
pub use optimize::{Config, Engine, Front, Point, Strategy, lexicographic, optimize, pareto};
pub use planner::Planner;
pub use replan::{FirstStep, Progress, Query, ReplanOutcome, Replanner};
pub use task::ground::{GroundConfig, ground};
pub use task::limits::Limits;
pub use task::plan::solution::{
    Improvement, MetricUnbounded, Moment, PlannerPart, Proof, Solution, Statistics, Status,
};
pub use task::plan::transitions::{TaskState, Transition};
pub use task::plan::{Exact, NotANumber, Plan, Step};
pub use task::task::Task;
#[doc(hidden)]
pub use task::thresholds::Thresholds;
pub use task::words::UnknownWord;
pub use task::{CODES, Error, Errors, File, Place};
pub use temporal::{ConcurrentTask, ground_concurrent, optimize_concurrent};
pub use {num_rational::BigRational, pddl};

/// Compiles and runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
