//! The adaptation loop: events in, adaptations out. Monitor, Analyze, Plan, Execute, over shared Knowledge \[1, 2\].
//!
//! A [`Loop`] is fed with [`Observation`]s and answers each with [`Answer`]s, some of which are [`Effect`]s: things that
//! the managed system is to do. It has no clock, no thread, no file and no global state; the same observations at
//! the same times give the same answers. [`drive`] joins it with an [`Observer`], an [`Effector`] and a [`Clock`].
//!
//! A plan is looked for when the plan at hand cannot be kept: it uses a design that is not available any more, an
//! objective is in error, an action has failed, the goal has changed, or the validator rejects the plan for the state as it
//! is (Algorithm 1 of the paper). It is also looked for when a design comes back, and adopted then if it is better by
//! the mission's minimum benefit. A design that is lost and that the plan does not use is not a reason: of fewer choices none is
//! better.
//!
//! - \[1\] J. Kephart, D. Chess: The vision of autonomic computing, Computer 36, 2003.
//! - \[2\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36, 2022.

mod acknowledge;
mod adapt;
mod analyze;
mod answer;
mod ask;
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
mod monitor;
mod plan;
mod react;
mod receipts;
mod record;
mod resume;
mod sense;
mod sequence;
mod settings;
mod step;
mod think;
mod watch;

pub(crate) use analyze::{available, changes, doubts, inferred, ruled_out, said, unavailable};
pub use answer::{Answer, Command, DesignChange, Effect, ObjectiveChange, OverdueOutcome};
pub use beliefs::{Beliefs, Outlook};
pub use control::Loop;
pub use drive::{Clock, Effector, Observer, SystemClock, drive};
pub use event::{Event, FORMAT, LONGEST_LINE, Observation, event_schema};
pub use fields::Refusal;
pub(crate) use filter::{Accepted, FilterStates, Filters};
pub use filter::{ComponentTimes, FilterSettings, MeasuredSettings, Stale};
pub use record::{Decision, Snapshot};
pub(crate) use resume::resume;
pub(crate) use sequence::Numbers;
pub use settings::{AdaptationSection, SafeReaction, Settings};
pub use step::PlannedStep;
pub use think::{Thinker, Thoughts};
pub use watch::{Planning, Watch};
