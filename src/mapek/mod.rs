//! The adaptation loop: Monitor, Analyze, Plan, Execute over shared Knowledge (MAPE-K) \[1, 2\].
//!
//! A [`Loop`] receives [`Observation`]s and returns [`Answer`]s. Some answers are [`Effect`]s: requests to the managed
//! system. The loop has no thread, file or global state, and receives the time with each observation. The same
//! observations at the same times produce the same answers, unless a search ends at its time limit. [`drive`] connects
//! the loop to an [`Observer`], an [`Effector`] and a [`Clock`].
//!
//! The loop replans if the current plan cannot be kept: the plan uses an unavailable design, an objective is in error,
//! an action has failed, the goal has changed, or the validator rejects the plan in the current state (Algorithm 1 of
//! \[2\]). The loop also searches for a better plan some time after a design has become available again or facts have
//! changed. It adopts this plan if its benefit is at least the minimum benefit of the mission. If the current plan is
//! proved optimal, the loss of a design that the plan does not use is no reason to replan: losing alternatives cannot
//! improve the optimum.
//!
//! - \[1\] J. Kephart, D. Chess: The vision of autonomic computing, Computer 36, 2003.
//! - \[2\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36, 2022.

mod acknowledge;
mod adapt;
mod analyze;
mod answer;
mod ask;
mod baseline;
mod beliefs;
mod changes;
mod control;
mod deadlines;
mod digest;
mod drive;
mod effects;
mod event;
mod execute;
mod fields;
mod filter;
mod interrupt;
mod live;
mod memo;
mod migrate;
mod monitor;
mod plan;
mod react;
mod receipts;
mod record;
mod recoverable;
mod resume;
mod sense;
mod sequence;
mod settings;
mod step;
mod think;
mod watch;

pub(crate) use analyze::{available, changes, doubts, fact_text, inferred, ruled_out, unavailable};
pub use answer::{Answer, Command, DesignChange, Effect, ObjectiveChange, OverdueOutcome};
pub use baseline::Baseline;
pub use beliefs::{Beliefs, Outlook};
pub use control::Loop;
pub(crate) use control::time_of_line;
pub(crate) use digest::{checksum, knowledge_parts};
pub use drive::{Clock, Effector, Observer, SystemClock, drive};
pub use event::{Event, FORMAT, LONGEST_LINE, Observation, event_schema};
pub use fields::Refusal;
pub(crate) use filter::{Accepted, FilterStates, Filters};
pub use filter::{ComponentTimes, FilterSettings, MeasuredSettings, Stale};
pub use record::{Decision, Snapshot};
pub(crate) use record::{statement_from_record, statement_to_record};
pub use recoverable::Recoverable;
pub(crate) use resume::{Remainder, gradual_functions, resume};
pub(crate) use sequence::Numbers;
pub use settings::{AdaptationSection, SafeReaction, Settings, Unrecorded};
pub use step::PlannedStep;
pub use think::{ParallelSearch, SearchHandle, Thinker, Thoughts};
pub use watch::{Planning, Watch};
