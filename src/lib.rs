//! Metaplan adapts a robot's task plan and its software architecture together.
//!
//! This facade joins the libraries: [`ontology`] (what the robot is), [`rules`] (what follows) and `metaplan-planner` (what to
//! do about it); and `metaplan-probabilistic`, model checking of decision processes, which [`comparison`] brings to a mission.
//! `metaplan-mission` joins OWL and PDDL, [`mission`] plans with both, and `metaplan-verify` checks what is claimed of plans. Order lives
//! here, not logic.

pub use ::{probabilistic, verify};
pub use ::mission::{Errors, Message, file, knowledge, message, visible};
pub use ::verify::measure;
pub use {ontology, pddl, picture, rules};

pub mod answers;
pub mod certificate;
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

/// The examples of the book are compiled and run with the tests.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../docs/how-to/built-ins.md")]
    struct BuiltIns;

    #[doc = include_str!("../docs/how-to/library.md")]
    struct Library;
}
