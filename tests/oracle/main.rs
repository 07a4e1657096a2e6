//! The planner, its certificates and its validator against oracles by another hand.
//!
//! A generator makes a tiny task from a seed and computes by brute force what is true of it; [`judge`] asks the planner and compares.
//! The oracles are written from the definition of a plan (PDDL 2.1, PDDL 2.2) and share nothing with the planner, not even the reader:
//! a generator's task is a structure of its own, which is printed as PDDL.
//!
//! `ORACLE_FROM` is the first seed, `ORACLE_TASKS` how many follow, `ORACLE_SAVE` a directory for the files of what fails;
//! where `ORACLE_STOP` is set, the first failure is the last. `mutants.toml` has faults of the planner that the oracles have to notice.

// Speed does not matter here.
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
