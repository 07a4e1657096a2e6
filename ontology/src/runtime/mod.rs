//! An engine with the reports of a robot at run time: the knowledge of the MROS reasoner \[1\].
//!
//! A [`Runtime`] applies reports (component statuses, measurements, objectives, groundings) to its engine. It
//! answers the queries of an adaptation loop: objectives in error with reasons, available designs, and their
//! utility. The value of a functional property is replaced in one update, so that no rule is evaluated with two
//! values.
//!
//! A conclusion is retracted with its cause ([`Mode::Retract`]). MROS instead stores conclusions as statements
//! once per cycle, so that they remain until grounding or a component's report removes them. [`Mode::Latch`]
//! reproduces this, for comparison and migration.
//!
//! - \[1\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36,
//!   2022.

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
