//! Replacement of PlanSys2's planner.

mod joint;
mod manner;
mod node;
mod solve;
mod told;

pub(crate) use joint::Joint;
pub(crate) use manner::Chosen;
pub use node::{Options, run, serve};
pub(crate) use node::{on_a_thread, plan_message};
pub(crate) use solve::{DOMAIN, PROBLEM, check_domain};
pub use solve::{Found, Manner, NoPlan, Request, solve};
pub(crate) use told::PlanPublisher;
