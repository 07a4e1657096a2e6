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

mod error;
mod exact;
mod lifted;
mod normalize;
mod number;

mod configuration;
mod ground;
mod quantity;
mod task;
mod task_number;
mod timing;

mod alternatives;
mod bounds;
mod certificate;
mod common_denominator;
mod concurrent;
mod context;
mod earliest;
mod encode;
mod ground_plan;
mod integral;
mod limits;
mod objectives;
mod optimize;
mod plan;
mod replan;
mod sat;
mod search;
mod solution;
mod successors;
mod table_map;
mod ties;
mod transitions;

#[cfg(test)]
mod tests;

pub use self::certificate::{Certificate, Outputs as RefutationOutputs, certify, certify_exact, refute};
pub use alternatives::{Alternatives, Forced, alternatives};
pub use concurrent::{Concurrent, ground_concurrent, optimize_concurrent};
pub use encode::Semantics;
pub use error::{Error, File, Place};
pub use exact::{ExactTask, ground_exact, optimize_exact};
pub use ground::{Config as GroundConfig, ground};
pub use limits::Limits;
pub use objectives::{Front, Point, lexicographic, pareto};
pub use optimize::{Config, Strategy, optimize};
pub use plan::{Exact, Plan, Step};
pub use replan::{First, Progress, Query, Replanned, Replanner};
pub use sat::{Backend, BackendError};
pub use solution::{Improvement, Proof, Solution, Statistics, Status, Unbounded};
pub use task::Task;
pub use transitions::{Situation, Transition};
