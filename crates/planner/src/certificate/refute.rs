//! Refutes a formula of the crate `certificate`, "some plan is cheaper than the claim", with a SAT solver, and
//! writes the refutation.

use std::io::{BufRead, Write};

use certificate::{Claimed, StepBounds};
use encodings::sat::{Answer, refute_with_proof};
use task::limits::Limits;

use crate::certificate::trim;

/// Maximum number of conflicts for the formula whose number of steps does not depend on a potential. Writing a certificate
/// should take about five times as long as planning on average, and the claim rests on the argument without a formula.
const SPENT_CONFLICT_LIMIT: u64 = 500;
/// Maximum number of conflicts for the formula with the fewest steps.
const CONFLICT_LIMIT: u64 = 2_000;
/// Maximum number of literals of a formula that is written; the checkers read formulas of up to
/// [`certificate::LITERAL_LIMIT`] literals. The largest formula that is refuted within the conflict limits for a reference
/// instance has 21,862 clauses.
const WRITTEN_LITERALS: usize = 400_000;
/// Number of bits up to which the full conflict limit applies. For wider numbers, the limit is inversely
/// proportional to the width, because each conflict costs more.
const REFERENCE_WIDTH: usize = 32;

/// A formula that may have a short refutation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Attempt {
    /// Number of steps of the formula.
    pub steps: usize,
    /// Maximum number of conflicts for numbers of at most 32 bits.
    pub conflicts: u64,
}

/// Returns the formulas of which the first refuted one belongs to the certificate: one whose number of steps does not
/// depend on a potential, and one with the fewest steps.
///
/// # Errors
/// There is no bound on the number of steps of a cheaper plan, or a limit is reached.
pub fn attempts(claimed: &Claimed<'_>, limits: &Limits) -> Result<Vec<Attempt>, String> {
    let StepBounds { spent, potential } = claimed.step_bounds(&|| limits.reached())?;
    let spent = spent.filter(|steps| *steps > potential);
    let spent = spent.map(|steps| Attempt { steps, conflicts: SPENT_CONFLICT_LIMIT });
    Ok(spent.into_iter().chain([Attempt { steps: potential, conflicts: CONFLICT_LIMIT }]).collect())
}

/// Output streams for the parts of a refutation.
pub struct Outputs<'o> {
    /// Formula in DIMACS format.
    pub formula: &'o mut dyn Write,
    /// Legend: one line for each variable, with its number and meaning.
    pub legend: &'o mut dyn Write,
    /// Untrimmed refutation as the solver writes it.
    pub draft: Box<dyn Write>,
    /// Function that opens the untrimmed refutation for reading, after the solver has written it.
    pub written_draft: &'o dyn Fn() -> std::io::Result<Box<dyn BufRead>>,
    /// Trimmed refutation in DRAT format: clauses that follow by unit propagation, without deletions.
    pub proof: &'o mut dyn Write,
    /// Hints: for each line of the proof, the numbers of the clauses from which its clause follows. The
    /// clauses of the formula are numbered from 1, followed by those of the proof.
    pub hints: &'o mut dyn Write,
}

/// Writes the formula "some plan is cheaper than the claim and has at most as many steps as the attempt", and its
/// refutation.
///
/// # Errors
/// The formula does not support a construct of the task, the formula is satisfiable, the solver's refutation is
/// invalid, a limit is reached, or an output cannot be written or read again.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "a small limit times a constant, divided by a number that is not 0"
)]
pub fn refute(
    claimed: &Claimed<'_>,
    attempt: Attempt,
    outputs: Outputs<'_>,
    limits: &Limits,
) -> Result<(), String> {
    let formula = claimed.formula(attempt.steps, WRITTEN_LITERALS, &|| limits.reached())?;
    let io_error = |error: std::io::Error| format!("it cannot be written: {error}");
    let conflicts = attempt.conflicts * REFERENCE_WIDTH as u64 / formula.widest().max(REFERENCE_WIDTH) as u64;
    let numbers = formula.clauses().map(|clause| clause.iter().map(|literal| literal.number()));
    match refute_with_proof(numbers, outputs.draft, limits, conflicts) {
        Answer::Unsatisfiable => {}
        Answer::Satisfiable => return Err("the formula has a model".to_owned()),
        Answer::Interrupted => {
            return Err(format!("not refuted within the limits ({conflicts} conflicts)"));
        }
    }
    formula.write_dimacs(outputs.formula).map_err(io_error)?;
    formula.write_legend(outputs.legend).map_err(io_error)?;
    let mut draft = (outputs.written_draft)().map_err(io_error)?;
    let files = (outputs.proof, outputs.hints);
    trim::trim(formula.clauses(), formula.variables(), &mut draft, files, limits)
}
