//! Checks optimality certificates of plans in exact arithmetic.
//!
//! The optimality proof is a closed set of labels \[1\]. A label is a state with the cost of reaching it. A
//! label *covers* a state with the same values of variables if the state costs no less and has no larger
//! numbers (equal numbers, if larger numbers may hurt). *Potentials* are lower bounds on the remaining cost, as
//! tables over a few variables. *Needs* are lower bounds on numbers that are required to reach the goal.
//!
//! The potentials and needs are checked to be lower bounds. Three further conditions are checked. The initial
//! state is covered or pruned (by a potential or a need), no label is a goal state cheaper than the claim, and
//! each successor of a label is covered or pruned. Then no plan of any length is cheaper than the claim, by
//! induction over its steps. A claim without a cost states that the task has no plan.
//!
//! [`faithful()`] checks that a ground task is faithful to its PDDL files, without grounding them.
//! [`check_refutation`] checks an additional proof for small tasks: a formula, its refutation, and a bound on
//! the number of steps.
//! [`verification_conditions`] exports the label proof to SMT solvers.
//!
//! The crate contains no planner code: it links no grounder, no search and no SAT solver.
//!
//! \[1\] S. Eriksson, G. Röger, M. Helmert: Unsolvability certificates for classical planning, ICAPS 2017
//! (inductive sets); labels as in M. Desrochers, F. Soumis, INFOR 26(3), 1988.

#![warn(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    clippy::arithmetic_side_effects
)]
#![cfg_attr(
    test,
    allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        clippy::cast_sign_loss,
        clippy::arithmetic_side_effects
    )
)]

mod argument;
mod check;
mod clausal;
mod faithful;
mod integer;
mod model;
mod references;
mod semantics;
mod smt;
mod table;

/// The types of the documents in a certificate.
pub mod format {
    pub use crate::argument::{ARGUMENT_FORMAT, Argument, Label, Need, Potential};
    pub use crate::integer::{Integer, MAX_DIGITS};
    pub use crate::model::{
        Argument as Parameter, Condition, Conditional, Exclusion, Fact, Layer, Linear, Literal, Model,
        Objective, Operator, Quantity, TASK_FORMAT,
    };
}

pub use check::{Checked, Claimed, Fault, GroundTask, check};
pub use clausal::{
    Formula, Inputs, LITERAL_LIMIT, Literal, REFUTATION_PARTS, StepBounds, check_refutation, lines,
};
pub use faithful::{Cause, Difference, Faithful, faithful, faithful_to, witness, witnessed};
pub use smt::verification_conditions;
pub use {num_rational::BigRational, pddl};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
