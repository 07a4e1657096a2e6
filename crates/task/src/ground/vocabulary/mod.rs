//! Data types that the passes of grounding exchange. No file of this module imports a pass.

pub mod atom;
pub mod axiom;
pub mod condition;
pub mod eval_error;
pub mod numbers;
pub mod operator;
pub mod partial_eval;
pub mod reached;
pub mod task;
pub mod world;
