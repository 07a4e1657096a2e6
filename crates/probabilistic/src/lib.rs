//! Probabilistic model checking of Markov decision processes, with bounds that are certified or exact.
//!
//! A model is PRISM-language text ([`prism`]) or an [`explore::Generator`] that computes successors natively.
//! Exploration turns the model into a sparse process ([`mdp`]). [`solve`] computes least and greatest
//! probabilities and expected rewards with bounds and policies. [`policy`] evaluates a given policy; [`pareto`]
//! computes trade-offs between two objectives. [`check`] performs all these steps for a property in PRISM's
//! syntax.
//!
//! The crate contains no OWL, no PDDL, no file access and no output.

#![warn(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    clippy::arithmetic_side_effects
)]
#![cfg_attr(
    test,
    allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        clippy::arithmetic_side_effects
    )
)]

pub mod check;
mod codes;
pub mod error;
pub mod explore;
mod fraction;
pub mod graph;
pub mod jani;
pub mod mdp;
pub mod number;
pub mod pareto;
pub mod policy;
pub mod prism;
pub mod property;
pub mod solve;
pub mod states;

pub use codes::CODES;
pub use error::{Diagnostic, Error, Place};
pub use mdp::Mdp;
pub use number::Number;
pub use solve::{Direction, Problem, Solution};
pub use {fixedbitset::FixedBitSet, num_rational::BigRational, smallvec::SmallVec};

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
