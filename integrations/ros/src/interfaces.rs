//! Rust types of the ROS 2 messages, services and actions that this package uses.
//!
//! The build script generates them from the definitions below `interfaces/`:
//! `diagnostic_msgs/msg/DiagnosticArray` is [`diagnostic_msgs::msg::DiagnosticArray`]; a service
//! `X` is the structures `XRequest` and `XResponse` and the type `X` with the trait [`Service`]; an
//! action `X` is `XGoal`, `XResult`, `XFeedback` and the type `X` with the trait [`Action`].
//!
//! Fields have the order of the definition, because CDR is positional and has no names. The types
//! are those of ROS 2 Jazzy. Types that differ in another distribution or version are in a module
//! of its name:
//!
//! | type | variant | difference |
//! |---|---|---|
//! | `lifecycle_msgs/TransitionEvent` | [`lyrical`] | `Time stamp` in place of `uint64 timestamp` |
//! | `nav2_msgs/NavigateToPose` | [`humble`] | the result is an `Empty` |
//! | | [`iron`] | the result has no `error_msg` |
//! | | [`rolling`] | the feedback has two additional tracking errors |
//! | `plansys2_msgs/ExecutePlan` | [`plansys2_1`] | the goal is an `Empty`, the feedback is about a single action |

#![allow(
    clippy::struct_excessive_bools,
    unused_qualifications,
    reason = "made of definitions, with full paths"
)]

mod traits;

pub use traits::{Action, Msg, Service, ServiceHashes, Structure};

include!(concat!(env!("OUT_DIR"), "/interfaces.rs"));
