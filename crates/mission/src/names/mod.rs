//! Names of the knowledge base and names of the problem: resolution of `[bindings.names]`,
//! comparison of the two sets of names, and check that different individuals have different names.
//!
//! An individual and an object are identical if they have the same name, or if `[bindings.names]` maps one to the
//! other. Objects are compared only in *roles* that occur in a knowledge base: functions, designs, actions,
//! components, and members of other classes to which a type of the domain is bound. A waypoint has no role, so the
//! knowledge base need not contain it.

mod likeness;
mod meet;
mod merged;
mod resolve;
mod roles;

pub(crate) use meet::{Meeting, NeverNamed, meet};
pub(crate) use merged::{merged, merged_by_planta};
pub(crate) use resolve::resolve;
