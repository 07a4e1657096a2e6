//! Procedures: ordered steps that put a design of a function into effect on nodes without `system_modes`.
//!
//! ```toml
//! [functions.f_localize.designs.fd_lidar_localization]
//! steps = [
//!     { node = "/visual_localization", state = "inactive" },
//!     { node = "/amcl", state = "active" },
//! ]
//! verify = [{ topic = "/amcl_pose" }]
//! ```
//!
//! The design is in effect when all steps have succeeded and all conditions hold. If one fails, the executed steps
//! are undone in reverse order, as far as possible.

mod clients;
mod execution;
mod settings;

pub(crate) use execution::{Outcome, Procedures, Seen};
pub(crate) use settings::Procedure;
