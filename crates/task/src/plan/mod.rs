//! Plans over ground operators, plans with PDDL names, and solutions with their proofs.

pub mod ground;
mod named_plan;
pub mod reschedule;
pub mod solution;
mod text;
pub mod transitions;
mod verdict;

pub use named_plan::{Exact, NotANumber, Plan, Step};
pub use named_plan::{arguments, decode, measured, metric, resolve};
