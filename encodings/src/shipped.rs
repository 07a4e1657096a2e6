//! Domains and problems that we ship, embedded for who starts from them. Nothing here is read but as text.

/// The plain domain of the ground vehicle, `ugv/plain.pddl`.
pub const UGV_PLAIN: &str = include_str!("../ugv/plain.pddl");

/// The problem of the ground vehicle, `ugv/problem.pddl`.
pub const UGV_PROBLEM: &str = include_str!("../ugv/problem.pddl");
