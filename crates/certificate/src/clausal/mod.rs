//! A second way to the same claim, for small tasks: a formula that says "there is a cheaper plan of at most T steps", its
//! refutation, and why no longer plan is cheaper.
//!
//! [`encoding`] is plain: one operator at each step, all states written out, sums in binary. It knows no windows, no reduced
//! costs and no symmetries, and shares nothing with the planner's encoding. It is this formula that a SAT solver refutes for the
//! certificate, not the one that the plan was found with. [`proof`] checks the refutation, clause by clause, by going through notes
//! of what each follows from; it is not a solver. [`steps`] bounds the number of steps by arithmetic on a potential.
//!
//! The formula of a task is made again to check it, and compared with the written one.

mod binary;
mod encoding;
mod formula;
pub mod lines;
mod literal;
mod proof;
mod steps;
mod sums;
mod timeline;

use std::io::BufRead;

use num_rational::BigRational;

use crate::argument::Argument;
use crate::check::{Fault, parse};
use crate::integer::Integer;
use crate::model::Model;
pub use formula::Formula;
pub use literal::Literal;
pub use steps::StepBound;

/// A formula with more literals than this is not written.
const LITERAL_LIMIT: usize = 4_000_000;
/// Where the parts of a refutation come from.
pub struct Inputs<'i> {
    /// In DIMACS.
    pub formula: &'i mut dyn BufRead,
    /// A line for each variable: its number and what it stands for.
    pub legend: &'i mut dyn BufRead,
    /// In DRAT: clauses that follow by unit propagation, and no deletions.
    pub proof: &'i mut dyn BufRead,
    /// For each line of the proof the numbers of the clauses that it follows from: the formula's from 1, then the proof's.
    pub hints: &'i mut dyn BufRead,
}

/// The formula "a plan that is cheaper than the claim has at most so many steps", with that number. The claim is as for
/// [`crate::check`].
///
/// # Errors
/// Why there is none: a construct that the formula does not cover, no bound on the number of steps, a limit.
pub fn formula(
    (task, argument): (&str, &str),
    claim: Option<&BigRational>,
    by: StepBound,
) -> Result<(Formula, usize), String> {
    let (model, argument, cost) = parse(task, argument, claim).map_err(|fault| fault.to_string())?;
    let cost = cost.ok_or("that there is no plan is not a matter of a number of steps")?;
    let steps = steps::bound(&model, &argument, &cost, by)?;
    Ok((encoding::encode(&model, &cost, steps, LITERAL_LIMIT)?, steps))
}

/// Checks a refutation: that the formula is the one of the task, that the proof refutes it, and that no plan of more steps is
/// cheaper. Each comes with what was checked, or with why it fails.
pub fn check_refutation(
    (task, argument): (&str, &str),
    claim: Option<&BigRational>,
    steps: usize,
    Inputs { formula: written, legend, proof, hints }: Inputs<'_>,
) -> [(&'static str, Result<String, String>); 3] {
    let prepared = parse(task, argument, claim).and_then(|(model, argument, cost)| {
        let reason = || Fault::Form { document: "the manifest", reason: "a formula without a cost".into() };
        Ok((model, argument, cost.ok_or_else(reason)?))
    });
    let (model, argument, cost): (Model, Argument, Integer) = match prepared {
        Ok(prepared) => prepared,
        Err(fault) => {
            let failed = || Err(fault.to_string());
            return [("formula", failed()), ("proof", failed()), ("steps", failed())];
        }
    };
    let steps_checked = steps::check(&model, &argument, &cost, steps)
        .map(|position| format!("no plan of more than {steps} steps is cheaper, by potential {position}"));
    let formula = encoding::encode(&model, &cost, steps, LITERAL_LIMIT);
    let (formula_checked, proof_checked) = match formula {
        Ok(formula) => {
            let same = formula.compare(written, legend).map(|()| {
                format!(
                    "what the task comes to for {steps} steps: {} variables, {} clauses",
                    formula.variables(),
                    formula.count()
                )
            });
            let refuted = proof::check(formula.clauses(), formula.variables(), proof, hints)
                .map(|count| format!("it has no model: {count} clauses follow, the last is empty"));
            (same, refuted)
        }
        Err(reason) => (Err(reason), Err("there is no formula to refute".to_owned())),
    };
    [("formula", formula_checked), ("proof", proof_checked), ("steps", steps_checked)]
}
