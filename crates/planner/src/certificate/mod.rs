//! Writes certificates: the ground task, the argument that no plan is cheaper, and a refutation.
//!
//! The formats are those of crate `certificate`, which checks them and links nothing of this crate.
//! `write` derives the argument from an exhausted search, `refute` refutes the checker's formula
//! with a SAT solver, and `trim` reduces the refutation \[1\] to the clauses that matter, with
//! hints.
//!
//! \[1\] M. Heule, W. Hunt, N. Wetzler: Trimming while checking clausal proofs, FMCAD 2013 (DRUP).

mod integer_scaling;
mod refute;
mod trim;
mod write;

pub use refute::{Outputs, refute};
pub use write::{Certificate, certify, certify_exact};
