//! Plans: over the ground task, in names, and as answers with their proof.

pub mod earliest;
pub mod ground;
mod names;
pub mod solution;
mod text;
pub mod transitions;
mod verdict;

pub use names::{Exact, NotANumber, Plan, Step};
pub use names::{arguments, decode, measured, metric, resolve};
