//! Writes certificates: directories with a proof that a plan is optimal, that no plan exists, or
//! that a Pareto front is complete. `metaplan-verify` checks them. The documentation of the crate
//! `verify` specifies the files.

mod derivations;
mod front;
mod knowledge;
mod proved;
mod write;

pub use front::write_front;
pub(crate) use knowledge::unrepeatable;
pub use proved::{ProvedChecker, Theorem};
pub use write::{Contents, Ground, write};

pub use ::verify::{Claim, Verification, VerifiedPart, Verifier};
