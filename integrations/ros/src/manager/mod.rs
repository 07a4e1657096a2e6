//! Manager: plans the tasks of a robot jointly with the designs of its functions, and adapts both
//! during execution.
//!
//! Diagnostics and tasks become events of the adaptation loop [`metaplan::mapek`]. Its effects become
//! calls of `/<function>/change_mode` of `system_modes`, and actions of performers. Between both is a
//! state machine without clock, threads and network, `machine`:
//!
//! ```text
//! START --mission and settings are read--> WAIT_GRAPH --every function replies--> IDLE
//! IDLE --/task/request--> PLAN --a plan--> RECONFIGURE --every function has its design--> EXECUTE
//! RECONFIGURE --a function refuses, or does not reply--> its design is not realisable --> PLAN
//! EXECUTE --a fact changes the best plan--> RECONFIGURE     EXECUTE --an action ends--> RECONFIGURE or IDLE
//! EXECUTE --/task/cancel, the autopilot--> functions without a design --> IDLE
//! any --another client has changed a mode--> that mode is adopted and evaluated
//! PLAN --no plan--> DEGRADED --a change--> PLAN
//! ```
//!
//! Each line for the loop is written to the journal, and each transition as a note.

mod driver;
mod machine;
mod robot;
mod settings;

pub(crate) use driver::components;
pub use driver::{Options, run};
pub use settings::{Functions, Settings};
