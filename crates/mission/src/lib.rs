//! What the robot is (a knowledge base) and what it has to do (PDDL), joined.
//!
//! The PDDL problem gets its functions, designs and actions, which designs are available, and the values of quality attributes
//! from the knowledge base, by the bindings of the mission. Nothing plans here: who checks a plan joins the two as who makes it.
//!
#![doc = include_str!("../README.md")]

mod binding;
mod called;
mod codes;
mod doubts;
pub mod file;
mod joined;
pub mod knowledge;
mod live;
pub mod message;
mod names;
mod native;
mod planta;
mod set;
pub mod visible;

pub use binding::{Bindings, atom};
pub use called::{Names, Place};
pub use codes::CODES;
pub use doubts::doubt_about;
pub use joined::Mission;
pub use message::{Errors, Message};
pub use native::CoAdaptation;
pub use {num_rational::BigRational, ontology, pddl, rules};
