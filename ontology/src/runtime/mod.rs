//! An engine and what a robot reports to it at run time: the working knowledge of the MROS reasoner \[1\].
//!
//! A [`Runtime`] takes reports (component statuses, measurements, objectives, groundings) as updates of its engine
//! and answers what an adaptation loop asks: which objectives are in error and why, which designs are available, which
//! of them is best. A value of a functional property is replaced within one update, so no rule ever sees two.
//!
//! What was concluded goes when its cause goes ([`Mode::Retract`]). MROS instead writes conclusions back as statements
//! once a cycle, so they stay until grounding or a component's report takes them away; [`Mode::Latch`] does the same,
//! for those who want to compare or to migrate.
//!
//! - \[1\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36, 2022.

mod builder;
mod candidates;
mod knowledge;
mod objective;
mod state;

pub use builder::RuntimeBuilder;
pub use candidates::{Candidate, Missed, Rejection};
pub use knowledge::{Mode, Runtime};
pub use objective::NewObjective;
pub use state::{Grounding, Objective};
