//! What to do about it: PDDL to a ground task, to CNF, to a plan that is proved optimal.
//!
//! Modules in the order of the pipeline; each turns one thing into the next:
//! `pddl` text → syntax tree → `normalize` → lifted task → `ground` → ground task → `bounds`, `search` → `encode` → formula → `optimize` → plan.
//! `validate` checks a plan against the syntax tree and shares nothing with the rest.
//!
//! What is absent: OWL. Availability of designs arrives as facts of the problem.

pub mod pddl;
pub mod validate;

mod error;
mod lifted;
mod normalize;
mod number;

mod configuration;
mod ground;
mod quantity;
mod task;

mod alternatives;
mod bounds;
mod certificate;
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
    Certificate, Checked, Faithful, Fault, Inputs as RefutationInputs, Outputs as RefutationOutputs,
    StepBound, certify, check as check_certificate, check_refutation, describes, faithful, refute,
    verification_conditions,
};
pub use concurrent::{Concurrent, ground_concurrent, optimize_concurrent};
pub use encode::Semantics;
pub use error::{Error, File, Place};
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
