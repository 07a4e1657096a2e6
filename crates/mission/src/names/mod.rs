//! Names of the knowledge base and names of the problem: which of them mean the same, and which meet nothing.
//!
//! An individual and an object are one thing if they have the same name, or if `[bindings.names]` says so. Objects are looked
//! at only in *roles* that a knowledge base speaks about: functions, designs, actions, and members of other classes that a
//! type of the domain is bound to. A waypoint is none of these, and nobody has to know it.

mod likeness;
mod meet;
mod resolve;
mod roles;

pub(crate) use meet::{Meeting, NeverNamed, meet};
pub(crate) use resolve::resolve;
