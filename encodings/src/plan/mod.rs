//! Plans: over the ground task, in names, and as answers with their proof.

pub(crate) mod earliest;
pub(crate) mod ground;
mod names;
pub(crate) mod solution;
pub(crate) mod transitions;

pub use names::{Exact, Plan, Step};
pub(crate) use names::{decode, measured, metric, resolve};
