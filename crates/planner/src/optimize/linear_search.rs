//! Linear SAT-UNSAT search: one solver finds cheaper and cheaper plans until the formula is unsatisfiable.

use encodings::encode::Encoding;
use encodings::sat::Answer;

use crate::optimize::optimizer_run::{Best, Run, StrategyOutcome};

/// Finds cheaper and cheaper plans of a formula, and stores each of them in `best`. A lower cost limit
/// only adds clauses, so learnt clauses stay valid. Stops after `budget` conflicts, or at a time or memory
/// limit.
pub(super) fn linear_search_down(
    run: &mut Run<'_>,
    mut encoding: Encoding<'_>,
    best: &mut Best,
    budget: u64,
) -> StrategyOutcome {
    let mut live = run.live(budget);
    loop {
        let better = match run.call(&mut live, &encoding, &[]) {
            (Answer::Unsatisfiable, _) => return StrategyOutcome::Exhausted,
            (_, None) => return StrategyOutcome::Interrupted,
            (_, Some(better)) => better,
        };
        best.plan = better;
        run.announce(best, encoding.horizon());
        encoding.tighten(best.plan.below());
    }
}
