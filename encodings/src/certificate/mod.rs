//! Certificates: why no plan is cheaper, in a form that is checked by arithmetic.
//!
//! The argument is a closed set of labels [1]. A label is a state with what was paid on the way to it. It *covers* a
//! state with the same values that cost no less and has no more of any number (exactly the same numbers where more may
//! hurt). *Potentials* bound from below what is still to be paid, as tables over a few variables; *needs* bound what must be left of
//! a resource. If the initial state is covered or cut off, no label is a goal state cheaper than the claim, and each
//! successor of a label is covered or cut off again, then no plan of any length is cheaper than the claim: by
//! induction over its steps. A claim without a cost is that there is no plan.
//!
//! `faithful` compares a written task with its files, without grounding them.
//! `clausal` has a second argument for small tasks: a formula, its refutation, and a bound on the number of steps.
//! `smt` writes the first one as verification conditions for an SMT solver.
//!
//! `write` makes the argument from a search that has ended. `check` shares nothing with grounding, bounds and search but the
//! form in `model`.
//!
//! [1] S. Eriksson, G. Röger, M. Helmert: Unsolvability certificates for classical planning, ICAPS 2017 (inductive sets);
//! labels as in M. Desrochers, F. Soumis, INFOR 26(3), 1988.

mod argument;
mod check;
mod clausal;
mod faithful;
mod integer;
mod model;
mod scales;
mod semantics;
mod shape;
mod smt;
mod table;
mod write;

pub use check::{Checked, Fault, check};
pub use clausal::{Inputs, Outputs, StepBound, check_refutation, refute};
pub use faithful::{Cause, Difference, Faithful, faithful, witness};
pub use smt::verification_conditions;
pub use write::{Certificate, certify, certify_exact};
