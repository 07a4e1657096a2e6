//! The manager: owns the robot's tasks, plans them jointly with the designs of its functions, and keeps both fitting.
//!
//! Diagnostics and tasks become events of the adaptation loop [`metaplan::mapek`]; its effects become calls of
//! `/<function>/change_mode` of `system_modes`, and actions that somebody performs. What stands between both is a state machine without
//! clock, thread or network, `machine`:
//!
//! ```text
//! START --the mission and its settings are read--> WAIT_GRAPH --every function answers--> IDLE
//! IDLE --/task/request--> PLAN --a plan--> RECONFIGURE --every function has its design--> EXECUTE
//! RECONFIGURE --a function refuses, or does not answer--> its design is not realisable --> PLAN
//! EXECUTE --a fact changes what is right--> RECONFIGURE     EXECUTE --an action ends--> RECONFIGURE or IDLE
//! EXECUTE --/task/cancel, the autopilot--> functions without a design --> IDLE
//! any --somebody else has changed a mode--> that mode is adopted, and weighed
//! PLAN --no plan--> DEGRADED --something changes--> PLAN
//! ```
//!
//! Each line that the loop hears is in the journal, and each arrow as a note.

mod driver;
mod machine;
mod robot;
mod settings;

pub use driver::{Options, run};
pub use settings::{Functions, Settings};
