//! In the place of PlanSys2's planner.

mod node;
mod solve;

pub use node::{Options, run, serve};
pub use solve::{DOMAIN, Found, Manner, NoPlan, PROBLEM, Request, check_domain, solve};
