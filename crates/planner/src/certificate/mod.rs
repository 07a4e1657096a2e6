//! Writes certificates: the ground task, an argument that no plan is cheaper, and a SAT refutation.
//!
//! The crate `certificate` defines the formats and checks the certificates; it does not depend on this crate.
//! `write` derives the argument from an exhausted search. `refute` refutes the checker's formula with a SAT
//! solver. `trim` reduces the refutation \[1\] to the clauses that are needed, with hints for the checker.
//!
//! \[1\] M. Heule, W. Hunt, N. Wetzler: Trimming while checking clausal proofs, FMCAD 2013 (DRUP).

mod integer_scaling;
mod refute;
mod trim;
mod write;

pub use refute::{Outputs, refute};
pub use write::{Certificate, certify, certify_exact};
