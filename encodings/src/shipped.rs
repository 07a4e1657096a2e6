//! Shipped domains and problems, embedded as text for templates and examples.

/// The domain of the ground vehicle without function designs, `ugv/plain.pddl`.
pub const UGV_PLAIN: &str = include_str!("../ugv/plain.pddl");

/// The problem of the ground vehicle, `ugv/problem.pddl`.
pub const UGV_PROBLEM: &str = include_str!("../ugv/problem.pddl");
