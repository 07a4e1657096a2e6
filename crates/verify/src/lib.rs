//! Verifies optimality certificates, from the knowledge base to the refutation of a formula.
//!
//! A certificate is a directory with everything that is required to check that a plan is optimal
//! or that no plan exists:
//!
//! | file | holds |
//! |---|---|
//! | `manifest.json` | the claim, and the size and SHA-256 of every other file |
//! | `domain.pddl`, `problem.pddl` | the files as they were planned with: availability and values filled in |
//! | `plan.txt` | the plan; missing if there is none |
//! | `knowledge.nt`, `origin.json` | the knowledge base, rules, bindings, and what has changed since they were read; missing if there is no knowledge base |
//! | `derivations.json` | everything that follows from them, with the rule, its bindings and what it rests on; missing likewise |
//! | `task.json` | the ground task |
//! | `witness.json` | the atoms that may ever hold, and the values that numbers may have: why other instances of actions need no operator |
//! | `formula.cnf`, `legend.txt`, `proof.drat`, `hints.txt` | for small tasks: "a cheaper plan has at most so many steps" in DIMACS, what its variables mean, its refutation, what each line of that follows from |
//! | `argument.json` | why no plan is cheaper: labels, potentials, needs (see `metaplan-certificate`) |
//!
//! What is absent: the crate links no planner code.
//!
#![doc = include_str!("../README.md")]

mod about;
mod answer;
mod check;
mod codes;
pub mod derivations;
pub mod digest;
pub mod files;
pub mod knowledge;
pub mod manifest;
pub mod measure;
pub mod memory;
pub mod plan;
pub mod task;
pub mod watch;

pub use answer::{VerificationAnswer, json};
pub use check::Verifier;
pub use codes::CODES;
pub use manifest::{Claim, Subject, SubjectKind, Unchecked, Verification, VerifiedPart};
pub use watch::{Watch, seconds};
