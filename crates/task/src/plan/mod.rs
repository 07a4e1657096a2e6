//! Plans: over the ground task, in names, and as answers with their proof.

pub mod ground;
mod named_plan;
pub mod reschedule;
pub mod solution;
mod text;
pub mod transitions;
mod verdict;

pub use named_plan::{Exact, NotANumber, Plan, Step};
pub use named_plan::{arguments, decode, measured, metric, resolve};
