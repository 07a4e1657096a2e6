//! SAT encodings of ground planning tasks with the selection of function designs in the same
//! formula, and SAT solvers behind one trait.
//!
//! Absent: PDDL and OWL. Which designs are available is part of the ground task.

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
