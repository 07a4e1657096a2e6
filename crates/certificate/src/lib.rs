//! The checker of certificates: why no plan is cheaper, in a form that is checked by arithmetic.
//!
//! The argument is a closed set of labels \[1\]. A label is a state with what was paid on the way to it. It *covers* a
//! state with the same values that cost no less and has no more of any number (exactly the same numbers where more may
//! hurt). *Potentials* bound from below what is still to be paid, as tables over a few variables; *needs* bound what must be left of
//! a resource. If the initial state is covered or cut off, no label is a goal state cheaper than the claim, and each
//! successor of a label is covered or cut off again, then no plan of any length is cheaper than the claim: by
//! induction over its steps. A claim without a cost is that there is no plan.
//!
//! [`faithful()`] compares a written task with its files, without grounding them. [`check_refutation`] checks a second argument for
//! small tasks: a formula, its refutation, and a bound on the number of steps. [`verification_conditions`] writes the first one for
//! an SMT solver.
//!
//! What is absent: whatever plans. No grounder, no search and no SAT solver is linked.
//!
//! \[1\] S. Eriksson, G. Röger, M. Helmert: Unsolvability certificates for classical planning, ICAPS 2017 (inductive sets);
//! labels as in M. Desrochers, F. Soumis, INFOR 26(3), 1988.

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

/// The documents of a certificate as they are written.
pub mod format {
    pub use crate::argument::{ARGUMENT_FORMAT, Argument, Label, Need, Potential};
    pub use crate::integer::{Integer, MAX_DIGITS};
    pub use crate::model::{
        Argument as Parameter, Condition, Conditional, Exclusion, Fact, Layer, Linear, Literal, Model,
        Objective, Operator, Quantity, TASK_FORMAT,
    };
}

pub use check::{Checked, Fault, check};
pub use clausal::{Formula, Inputs, Literal, StepBound, check_refutation, formula, lines};
pub use faithful::{Cause, Difference, Faithful, faithful, witness};
pub use smt::verification_conditions;
pub use {num_rational::BigRational, pddl};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
