//! Refutes the checker's formula with a SAT solver.

use std::io::{BufRead, Write};

use certificate::StepBound;
use encodings::sat::{Answer, refute_with_proof};
use num_rational::BigRational;
use task::limits::Limits;

use crate::certificate::trim;

/// Conflict limit for formulas whose numbers have at most [`REFERENCE_WIDTH`] bits.
const CONFLICT_LIMIT: u64 = 20_000;
/// Width up to which the full conflict limit applies. Beyond it the limit shrinks in proportion,
/// because each conflict costs more.
const REFERENCE_WIDTH: usize = 32;

/// Destinations of the parts of a refutation.
pub struct Outputs<'o> {
    /// Formula in DIMACS.
    pub formula: &'o mut dyn Write,
    /// Legend: one line per variable with its number and meaning.
    pub legend: &'o mut dyn Write,
    /// Refutation as written by the solver.
    pub draft: Box<dyn Write>,
    /// Opens the written `draft` for reading.
    pub written_draft: &'o dyn Fn() -> std::io::Result<Box<dyn BufRead>>,
    /// Trimmed refutation in DRAT: clauses that follow by unit propagation, without deletions.
    pub proof: &'o mut dyn Write,
    /// Hints: per line of the proof the numbers of the clauses that it follows from. Clauses of the
    /// formula count from 1, followed by those of the proof.
    pub hints: &'o mut dyn Write,
}

/// Writes the formula "some plan is cheaper than the claim and within the step bound" and its
/// refutation. Returns the number of steps. The claim is as for [`certificate::check`].
///
/// # Errors
/// Fails if the formula does not cover a construct, there is no step bound, or a limit is reached.
#[expect(clippy::arithmetic_side_effects, reason = "two constants, divided by a number that is not 0")]
pub fn refute(
    documents: (&str, &str),
    claim: Option<&BigRational>,
    by: StepBound,
    outputs: Outputs<'_>,
    limits: &Limits,
) -> Result<usize, String> {
    let (formula, steps) = certificate::formula(documents, claim, by)?;
    let io_error = |error: std::io::Error| format!("it cannot be written: {error}");
    formula.write_dimacs(outputs.formula).map_err(io_error)?;
    formula.write_legend(outputs.legend).map_err(io_error)?;
    let conflicts = CONFLICT_LIMIT * REFERENCE_WIDTH as u64 / formula.widest().max(REFERENCE_WIDTH) as u64;
    let numbers = formula.clauses().map(|clause| clause.iter().map(|literal| literal.number()));
    match refute_with_proof(numbers, outputs.draft, limits, conflicts) {
        Answer::Unsatisfiable => {}
        Answer::Satisfiable => return Err("the formula has a model".to_owned()),
        Answer::Interrupted => {
            return Err(format!("not refuted within the limits ({conflicts} conflicts)"));
        }
    }
    let mut draft = (outputs.written_draft)().map_err(io_error)?;
    let files = (outputs.proof, outputs.hints);
    trim::trim(formula.clauses(), formula.variables(), &mut draft, files, limits)?;
    Ok(steps)
}
