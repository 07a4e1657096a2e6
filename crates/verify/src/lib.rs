//! Verifies optimality certificates, from the knowledge base to the refutation of a formula.
//!
//! A certificate is a directory with all files that are required to check that a plan is optimal, or that no
//! plan exists:
//!
//! | file | holds |
//! |---|---|
//! | `manifest.json` | the claim, and the size and SHA-256 of every other file |
//! | `domain.pddl`, `problem.pddl` | the PDDL files of the planning problem, with the facts and values of the knowledge base filled in |
//! | `plan.txt` | the plan; absent if no plan exists |
//! | `knowledge.nt`, `origin.json` | the knowledge base, rules, bindings, and the changes since they were read; absent without a knowledge base |
//! | `derivations.json` | all facts, the inferred ones with the rule, its bindings and its supports; absent without a knowledge base |
//! | `task.json` | the ground task |
//! | `witness.json` | the witness, an over-approximation of the reachable states (possible atoms and ranges of numbers); an action instance that it excludes needs no operator |
//! | `formula.cnf`, `legend.txt`, `proof.drat`, `hints.txt` | for small tasks: the formula "some plan of at most T steps is cheaper" in DIMACS, the meaning of its variables, its refutation, the antecedents (numbers of clauses) of each line of the refutation |
//! | `argument.json` | the proof that no plan is cheaper: labels (states), potentials (lower bounds on the remaining cost) and needs (lower bounds on numbers that are required to reach the goal; see `metaplan-certificate`) |
//!
//! The certificate of a Pareto front is a directory with `manifest.json`, `domain.pddl`, `problem.pddl`, `front.txt` with the
//! objectives and the values of the points, the files of the knowledge base, and one subdirectory for each of the
//! certificates that prove it; see [`front`].
//!
//! The crate does not link the planner.
//!
#![doc = include_str!("../README.md")]

mod about;
mod answer;
mod check;
mod codes;
pub mod derivations;
pub mod digest;
pub mod files;
pub mod front;
pub mod knowledge;
pub mod manifest;
pub mod measure;
pub mod memory;
mod parts;
pub mod plan;
pub mod task;
pub mod watch;

pub use answer::{VerificationAnswer, json};
pub use check::Verifier;
pub use codes::CODES;
pub use manifest::{Claim, Front, Subject, SubjectKind, Unchecked, Verification, VerifiedPart};
pub use watch::{Watch, seconds};
