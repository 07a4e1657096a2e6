//! The messages, services and actions of ROS 2 that this package speaks, as Rust types.
//!
//! They are made by the build script of the definitions below `interfaces/`: `diagnostic_msgs/msg/DiagnosticArray` is
//! [`diagnostic_msgs::msg::DiagnosticArray`], a service `X` is the structures `XRequest` and `XResponse` and the type `X` with the trait
//! [`Service`], an action `X` is `XGoal`, `XResult`, `XFeedback` and the type `X` with the trait [`Action`].
//!
//! Fields stand in the order of the definition: CDR is positional, and carries no names. The types are those of ROS 2 Jazzy; what another
//! distribution or version has otherwise stands in a module of its name:
//!
//! | type | variant | what differs |
//! |---|---|---|
//! | `lifecycle_msgs/TransitionEvent` | [`lyrical`] | `Time stamp` in place of `uint64 timestamp` |
//! | `nav2_msgs/NavigateToPose` | [`humble`] | the result is an `Empty` |
//! | | [`iron`] | the result has no `error_msg` |
//! | | [`rolling`] | the feedback has two tracking errors more |
//! | `plansys2_msgs/ExecutePlan` | [`plansys2_1`] | the goal is an `Empty`, the feedback tells of one action |

#![allow(
    clippy::struct_excessive_bools,
    unused_qualifications,
    reason = "made of definitions, with full paths"
)]

mod traits;

pub use traits::{Action, Msg, Service, ServiceHashes, Structure};

include!(concat!(env!("OUT_DIR"), "/interfaces.rs"));
