//! Metaplan adapts a robot's task plan and its software architecture together.
//!
//! This facade joins the libraries: [`ontology`] (what the robot is), [`rules`] (what follows) and [`encodings`] (what to
//! do about it); and `metaplan-probabilistic`, model checking of decision processes, which [`comparison`] brings to a mission.
//! [`mission`] is the only place that sees OWL and PDDL at once. Order lives here, not logic.

pub use {encodings, ontology, rules};

pub mod answers;
pub mod certificate;
pub mod comparison;
pub mod explain;
pub mod file;
pub mod journal;
pub mod knowledge;
pub mod manifest;
pub mod mapek;
pub mod measure;
pub mod message;
pub mod mission;
mod number;
pub mod setup;
pub mod simulate;

/// The example of the README is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
