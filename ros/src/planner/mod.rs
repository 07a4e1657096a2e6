//! In the place of PlanSys2's planner.

mod solve;

pub use solve::{DOMAIN, Found, Manner, NoPlan, PROBLEM, Request, check_domain, one_line, solve};
