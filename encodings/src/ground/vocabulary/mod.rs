//! What the passes of grounding hand to each other. No file here imports a pass.

pub(crate) mod atom;
pub(crate) mod axiom;
pub(crate) mod condition;
pub(crate) mod failure;
pub(crate) mod numbers;
pub(crate) mod operator;
pub(crate) mod reached;
pub(crate) mod residual;
pub(crate) mod task;
pub(crate) mod world;
