//! Metaplan plans a robot's actions and its software architecture together.
//!
//! This facade joins the libraries: [`ontology`] (OWL model of the robot), [`rules`] (inference),
//! `metaplan-planner` (planning) and `metaplan-probabilistic` (model checking of decision
//! processes, applied to missions by [`comparison`]). `metaplan-mission` joins OWL and PDDL,
//! [`mission`] plans with both, and `metaplan-verify` checks the certificates of plans.
//!
//! The facade also contains the adaptation loop ([`mapek`]) with its [`journal`] and web page ([`live`]), the choice of
//! designs without a plan ([`configure`]), explanations of plans ([`explain`]), simulation ([`simulate`]), pictures
//! ([`report`]), studies ([`sweep`]), and the command line ([`cli`]).

pub use ::{probabilistic, verify};
pub use ::mission::{Errors, Message, file, knowledge, message, visible};
pub use ::verify::measure;
pub use {ontology, pddl, picture, rules};

pub mod answers;
pub mod certificate;
pub mod cli;
pub mod codes;
pub mod comparison;
pub mod configure;
pub mod explain;
pub mod journal;
pub mod lint;
pub mod live;
pub mod manifest;
pub mod mapek;
pub mod mission;
mod narrow;
mod number;
pub mod planner;
pub mod recording;
pub mod report;
pub mod schemas;
pub mod setup;
pub mod simulate;
pub mod sweep;
pub mod templates;

/// Includes pages of the book, so that their examples are compiled and run as doc tests.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../docs/how-to/built-ins.md")]
    struct BuiltIns;

    #[doc = include_str!("../docs/how-to/library.md")]
    struct Library;
}
