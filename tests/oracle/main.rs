//! Tests of the planner, its certificates and its validator against independent oracles.
//!
//! A generator derives a tiny task from a seed. The oracle computes the correct answer by brute force, and
//! [`judge`] compares the planner's answer with this answer. The oracles implement the definition of a plan
//! (PDDL 2.1, PDDL 2.2) and share no code with the planner, not even the parser: a generator has its own task
//! structure, which is printed as PDDL.
//!
//! Environment variables: `ORACLE_FROM` is the first seed, `ORACLE_TASKS` the number of tasks, `ORACLE_SAVE` a
//! directory for the files of failing tasks, `ORACLE_FRONTS` one for the certificates of fronts. If `ORACLE_STOP` is
//! set, a run ends at the first failure (not in [`front`] and [`enumerate`]). `mutants.toml` lists faults of the planner
//! that the oracles must detect.

// Readability of the oracles matters more than their speed.
#![allow(clippy::format_collect, clippy::format_push_string, clippy::needless_for_each)]

mod alternatives;
mod certify;
mod enumerate;
mod field;
mod front;
mod judge;
mod magnify;
mod numbers;
mod temporal;
mod two_objectives;
