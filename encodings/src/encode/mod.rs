//! Encoding of ground tasks: the formula is satisfiable if there is a plan of at most `horizon` allowed steps with a
//! cost of at most `limit`. In sequential semantics and with summed costs, there is such a plan if the formula
//! is satisfiable; in parallel semantics, the plan may have several operators per step.
//!
//! The encoding has finite-domain variables and explanatory frame axioms \[1\], with one or several
//! operators per step. Unused steps are idle and come at the end. The designs of an operator's
//! slots (its parameters for function designs) have variables separate from the operator's
//! variable. The formula therefore grows with the sum of the numbers of designs, not with their product.
//! The families of clauses are divided among the files.
//!
//! The heads of these files state the clauses symbolically. `o@t` means that operator o is executed at step
//! t; `v=d@t` that variable v has the value d in the state before step t, so the effects of step t are true
//! at t+1; `slot=d@t` that design d is selected for the slot at step t. Facts (p, e) and literals (l) are
//! also about the state before the step.
//!
//! \[1\] H. Kautz, B. Selman: Pushing the envelope: planning, propositional logic and stochastic
//! search, AAAI 1996.

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
