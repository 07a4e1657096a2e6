//! Ground task to formula: is there a plan of at most `horizon` steps that costs at most `limit`?
//!
//! An encoding over finite-domain variables with explanatory frame axioms \[1\], sequential or with several operators at a
//! step. Steps that a plan does not need are idle, and stand at its end. The designs of an operator's slots are variables of their own beside the operator's, so that
//! the formula grows with the sum of the designs, not with their product. Each family of clauses has a file.
//!
//! \[1\] H. Kautz, B. Selman: Pushing the envelope: planning, propositional logic and stochastic search, AAAI 1996.

mod arithmetic;
mod axioms;
mod builder;
mod conditional;
mod cost;
mod designs;
mod encoding;
mod formula;
mod goal;
mod interchangeable_designs;
mod interference;
mod numeric;
mod operators;
mod selection;
mod state;
mod symmetry;
#[cfg(test)]
mod tests;
mod variables;

pub use cost::{CostEncoding, CostLimit};
pub use encoding::{Encoding, PlanConstraints};
pub use formula::{Family, Formula, VariableMeaning};
pub use interference::StepSemantics;
pub use symmetry::Symmetry;
