//! Joins a knowledge base, which describes the robot, with a PDDL domain and problem, which
//! describe its task.
//!
//! The PDDL problem receives its functions, its designs with their availability, its actions and the values of quality
//! attributes from the knowledge base, according to the bindings of the mission. The crate also contains the messages
//! of all programs, and functions to read and write files. It contains no planner, so that the certificate checker
//! fills a problem with the same code as the planner.
//!
#![doc = include_str!("../README.md")]

mod binding;
mod called;
mod codes;
mod doubts;
pub mod file;
mod history;
mod joined;
pub mod knowledge;
mod live;
pub mod message;
mod names;
mod native;
mod planta;
mod set;
mod values;
pub mod visible;
mod withdraw;

pub use binding::{Bindings, atom};
pub use called::{Names, Place};
pub use codes::CODES;
pub use joined::{Mission, ParsedObjective};
pub use knowledge::doubt_about;
pub use message::{Errors, Message};
pub use native::CoAdaptation;
pub use set::unused_measurement;
pub use {num_rational::BigRational, ontology, pddl, rules};
