//! SAT encodings of ground planning tasks, in which function designs are selected together with the operators, and SAT
//! solvers behind one trait.
//!
//! The crate reads neither PDDL nor OWL. The ground task already contains which designs are available.

#![allow(missing_docs, reason = "an interface of the workspace; names say what fields hold")]
#![warn(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::arithmetic_side_effects
)]
#![cfg_attr(
    test,
    allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        clippy::arithmetic_side_effects
    )
)]

pub mod encode;
pub mod sat;
pub mod shipped;
