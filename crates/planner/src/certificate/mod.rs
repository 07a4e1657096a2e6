//! What the search leaves behind for the checker: the ground task, why no plan is cheaper, and a refutation.
//!
//! The forms are those of crate `certificate`, which checks them and links nothing of this one. `write` makes the argument from a
//! search that has ended, `refute` has the checker's formula refuted by a SAT solver, and `trim` keeps of the refutation \[1\] what
//! matters, with what each clause follows from.
//!
//! \[1\] M. Heule, W. Hunt, N. Wetzler: Trimming while checking clausal proofs, FMCAD 2013 (DRUP).

mod integer_scaling;
mod refute;
mod trim;
mod write;

pub use refute::{Outputs, refute};
pub use write::{Certificate, certify, certify_exact};
