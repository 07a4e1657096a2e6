//! Ground task to formula: is there a plan of at most `horizon` steps that costs at most `limit`?
//!
//! An encoding over finite-domain variables with explanatory frame axioms [1], sequential or with several operators at a
//! step. Steps that a plan does not need are idle, and stand at its end. The designs of an operator's slots are variables of their own beside the operator's, so that
//! the formula grows with the sum of the designs, not with their product. Each family of clauses has a file.
//!
//! [1] H. Kautz, B. Selman: Pushing the envelope: planning, propositional logic and stochastic search, AAAI 1996.

mod arithmetic;
mod axioms;
mod builder;
mod conditional;
mod cost;
mod designs;
mod encoding;
mod equal_designs;
mod formula;
mod goal;
mod interference;
mod numeric;
mod operators;
mod selection;
mod state;
mod symmetry;
#[cfg(test)]
mod tests;
mod variables;

pub use cost::{CostLimit, Counting};
pub use encoding::{Encoding, Plans};
pub use formula::{Family, Formula, Meaning};
pub use interference::Semantics;
pub use symmetry::Symmetry;
