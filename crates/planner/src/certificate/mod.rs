//! Writes certificates: the ground task, an argument that no plan is cheaper than the given one (or that there is
//! no plan), and a SAT refutation.
//!
//! The crate `certificate` defines the formats and checks the certificates; it does not depend on this crate. `write`
//! derives the argument from an exhausted search; `no_certificate` lists the reasons why there is no certificate.
//! `refute` refutes the formula "there is a cheaper plan" with a SAT solver; the checker builds this formula from the
//! ground task. `trim` reduces the refutation \[1\] to the clauses that are needed, with hints for the checker.
//!
//! \[1\] M. Heule, W. Hunt, N. Wetzler: Trimming while checking clausal proofs, FMCAD 2013 (DRUP).

mod integer_scaling;
mod no_certificate;
mod refute;
mod trim;
mod write;

pub use no_certificate::NoCertificate;
pub use refute::{Attempt, Outputs, attempts, refute};
pub use write::{Certificate, certify, certify_exact};
