//! The checker's formula, refuted by a SAT solver.

use std::io::{BufRead, Write};

use certificate::StepBound;
use encodings::sat::{Answer, refute_with_proof};
use num_rational::BigRational;
use task::limits::Limits;

use crate::certificate::trim;

/// After learning so many clauses, a solver gives up on a formula…
const CONFLICT_LIMIT: u64 = 20_000;
/// … whose numbers have at most so many bits; after fewer in proportion if they have more, as each costs more.
const REFERENCE_WIDTH: usize = 32;

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

/// Writes the formula "a plan that is cheaper than the claim has at most so many steps" and its refutation; returns the
/// number of steps. The claim is as for [`certificate::check`].
///
/// # Errors
/// Why there is none: a construct that the formula does not cover, no bound on the number of steps, a limit.
#[expect(clippy::arithmetic_side_effects, reason = "two constants, divided by a number that is not 0")]
pub fn refute(
    documents: (&str, &str),
    claim: Option<&BigRational>,
    by: StepBound,
    outputs: Outputs<'_>,
    limits: &Limits,
) -> Result<usize, String> {
    let (formula, steps) = certificate::formula(documents, claim, by)?;
    let failed = |error: std::io::Error| format!("it cannot be written: {error}");
    formula.write_dimacs(outputs.formula).map_err(failed)?;
    formula.write_legend(outputs.legend).map_err(failed)?;
    let conflicts = CONFLICT_LIMIT * REFERENCE_WIDTH as u64 / formula.widest().max(REFERENCE_WIDTH) as u64;
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
