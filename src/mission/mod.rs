//! What the robot is (a knowledge base) and what it has to do (PDDL), joined.
//!
//! The only room that sees both sides: the PDDL problem gets its functions, designs and actions, which designs are available,
//! and the values of quality attributes from the knowledge base, by the bindings of the manifest.

mod binding;
mod blocking;
mod doubts;
mod joined;
mod live;
mod native;
mod sections;
mod set;

pub use binding::Bindings;
pub use blocking::Blocking;
pub use joined::Mission;
pub use native::CoAdaptation;
pub use sections::{PlanningSection, Scenario};
