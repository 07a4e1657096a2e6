//! A second way to the same claim, for small tasks: a formula that says "there is a cheaper plan of at most T steps", its
//! refutation, and why no longer plan is cheaper.
//!
//! [`formula`] is plain: one operator at each step, all states written out, sums in binary. It knows no windows, no reduced
//! costs and no symmetries, and shares nothing with `crate::encode`. It is this formula that a SAT solver refutes for the
//! certificate, not the one that the plan was found with. [`trim`] keeps of the refutation [1] what matters, and notes what each
//! clause follows from. [`proof`] checks that, clause by clause, by going through these notes; it is no solver and
//! shares nothing with one, nor with [`trim`]. [`steps`] bounds the number of steps by arithmetic on a potential.
//!
//! The formula of a task is made again to check it, and compared with the written one.
//!
//! [1] M. Heule, W. Hunt, N. Wetzler: Trimming while checking clausal proofs, FMCAD 2013 (DRUP).

mod binary;
mod formula;
mod lines;
mod literal;
mod proof;
mod steps;
mod sums;
mod trim;

use std::io::{BufRead, Write};

use num_rational::BigRational;

use crate::certificate::argument::Argument;
use crate::certificate::check::{Fault, parse};
use crate::certificate::integer::Integer;
use crate::certificate::model::Model;
use crate::limits::Limits;
use crate::sat::{Answer, refute_with_proof};
use formula::Formula;

/// A formula with more literals than this is not written.
const LITERAL_LIMIT: usize = 4_000_000;
/// After learning so many clauses, a solver gives up on a formula…
const CONFLICT_LIMIT: u64 = 20_000;
/// … whose numbers have at most so many bits; after fewer in proportion if they have more, as each costs more.
const NARROW: usize = 32;

/// Where the parts of a refutation go.
pub struct Outputs<'o> {
    /// The formula, in DIMACS.
    pub formula: &'o mut dyn Write,
    /// A line for each variable: its number and what it stands for.
    pub legend: &'o mut dyn Write,
    /// For the refutation as the solver writes it.
    pub draft: Box<dyn Write>,
    /// Opens what was written to `draft`.
    pub written_draft: &'o dyn Fn() -> std::io::Result<Box<dyn BufRead>>,
    /// What matters of the refutation, in DRAT: clauses that follow by unit propagation, and no deletions.
    pub proof: &'o mut dyn Write,
    /// For each line of the proof the numbers of the clauses that it follows from: the formula's from 1, then the proof's.
    pub hints: &'o mut dyn Write,
}

/// Where the parts of a refutation come from.
pub struct Inputs<'i> {
    /// As in [`Outputs`].
    pub formula: &'i mut dyn BufRead,
    /// As in [`Outputs`].
    pub legend: &'i mut dyn BufRead,
    /// As in [`Outputs`].
    pub proof: &'i mut dyn BufRead,
    /// As in [`Outputs`].
    pub hints: &'i mut dyn BufRead,
}

/// By what a cheaper plan has only so many steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepBound {
    /// By what the steps cost: the formula alone then says that no plan is cheaper.
    Spent,
    /// By what they cost and what a potential says is still to be paid: fewer steps, and a smaller formula.
    Potential,
}

/// Writes the formula "a plan that is cheaper than the claim has at most so many steps" and its refutation; returns the
/// number of steps. The claim is as for [`crate::check_certificate`].
///
/// # Errors
/// Why there is none: a construct that the formula does not cover, no bound on the number of steps, a limit.
#[expect(clippy::arithmetic_side_effects, reason = "two constants, divided by a number that is not 0")]
pub fn refute(
    (task, argument): (&str, &str),
    claim: Option<&BigRational>,
    by: StepBound,
    outputs: Outputs<'_>,
    limits: &Limits,
) -> Result<usize, String> {
    let (model, argument, cost) = parse(task, argument, claim).map_err(|fault| fault.to_string())?;
    let cost = cost.ok_or("that there is no plan is not a matter of a number of steps")?;
    let steps = steps::bound(&model, &argument, &cost, by)?;
    let formula = Formula::new(&model, &cost, steps, LITERAL_LIMIT)?;
    let failed = |error: std::io::Error| format!("it cannot be written: {error}");
    formula.write_dimacs(outputs.formula).map_err(failed)?;
    formula.write_legend(outputs.legend).map_err(failed)?;
    let conflicts = CONFLICT_LIMIT * NARROW as u64 / formula.widest().max(NARROW) as u64;
    let numbers = formula.clauses().map(|clause| clause.iter().map(|literal| literal.number()));
    match refute_with_proof(numbers, outputs.draft, limits, conflicts) {
        Answer::Unsatisfiable => {}
        Answer::Satisfiable => return Err("the formula has a model".to_owned()),
        Answer::Interrupted => {
            return Err(format!("not refuted within the limits ({conflicts} conflicts)"));
        }
    }
    let mut draft = (outputs.written_draft)().map_err(failed)?;
    let files = (outputs.proof, outputs.hints);
    trim::trim(formula.clauses(), formula.variables(), &mut draft, files, limits)?;
    Ok(steps)
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
    let formula = Formula::new(&model, &cost, steps, LITERAL_LIMIT);
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
