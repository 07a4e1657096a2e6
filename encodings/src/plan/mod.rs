//! Plans: over the ground task, in names, and as answers with their proof.

pub(crate) mod earliest;
pub(crate) mod ground;
mod names;
pub(crate) mod solution;
mod text;
pub(crate) mod transitions;
mod verdict;

pub use names::{Exact, NotANumber, Plan, Step};
pub(crate) use names::{arguments, decode, measured, metric, resolve};
