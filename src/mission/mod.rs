//! What the robot is and what it has to do, joined by `metaplan-mission`, and planned with.
//!
//! The only room that sees both OWL and the planner.

mod blocking;
mod planning;
mod sections;

pub use ::mission::{Bindings, CoAdaptation, Mission, Names};
pub use blocking::{Blocking, blocking};
pub use planning::Planning;
pub(crate) use planning::{ground_with, replanner};
pub use sections::{BindingsSection, KnowledgeSection, PlanningSection, Scenario};
