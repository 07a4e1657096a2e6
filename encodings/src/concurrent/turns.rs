//! The exact and the greedy search in turns that get longer: what one needs, the other has as well.
//!
//! Small tasks are proved before the greedy search begins. Where it does begin, its plans are the incumbents of both.

use tracing::info_span;

use crate::bounds::Bounds;
use crate::concurrent::compile::Concurrent;
use crate::concurrent::estimate::Estimate;
use crate::concurrent::expansion::Expansion;
use crate::concurrent::greedy::{Greedy, Outcome};
use crate::concurrent::guidance::Guidance;
use crate::concurrent::record::Record;
use crate::concurrent::relaxed::Relaxed;
use crate::concurrent::search::{Ended, Search, Sequence};
use crate::limits::Limits;
use crate::number::{Int, Rational};
use crate::plan::solution::Part;

/// How many situations the exact search looks at before the greedy one has its turn.
const SOON: usize = 10_000;
/// How many situations the greedy search evaluates at its first turn, and how many the exact one looks at then.
const GREEDY: usize = 5_000;
const EXACT: usize = 20_000;

/// Searches until nothing better is left, a limit is reached, or both have had so many turns. `record` hears of each better plan and of what none can get below.
pub(super) fn take_turns(
    concurrent: &Concurrent,
    bounds: Option<&Bounds>,
    limits: &Limits,
    record: &mut Record<'_>,
    rounds: usize,
) -> (Ended, Option<Sequence>) {
    let estimate = Estimate::new(concurrent);
    let expansion = Expansion::new(concurrent);
    let mut exact = Search::new(concurrent, &expansion, &estimate, bounds);
    let root = exact.lower();
    record.begin(Rational::from_integer(root));
    let mut ended = info_span!("search").in_scope(|| exact.run(limits, SOON, record));
    if exact.is_over() || limits.reached() {
        return (claimed(ended, concurrent, root), exact.incumbent);
    }
    let relaxed = Relaxed::new(concurrent);
    let begin = |reopens| {
        let guidance = Guidance::new(&relaxed);
        Greedy::new(concurrent, &expansion, &estimate, bounds, guidance, reopens)
    };
    let mut greedy = Some(begin(false));
    let mut share = 1_usize;
    for _ in 0..rounds {
        if exact.is_over() || limits.reached() || (greedy.is_none() && exact.is_full(limits)) {
            break;
        }
        while let Some(own) = &mut greedy {
            let _span = info_span!("greedy").entered();
            let before = own.figures;
            let outcome = own.run(&mut exact.incumbent, limits, GREEDY.saturating_mul(share));
            own.figures.add_to(before, &mut record.statistics);
            match outcome {
                Outcome::Found => {
                    let lower = exact.lower();
                    let incumbent = exact.incumbent.iter();
                    incumbent.for_each(|sequence| sequence.tell(lower, Part::Satisficing, record));
                }
                // What was left out may have come sooner.
                Outcome::Exhausted => {
                    greedy = (!own.reopens).then(|| begin(true));
                    let restarts = &mut record.statistics.restarts;
                    *restarts = restarts.saturating_add(usize::from(greedy.is_some()));
                }
                Outcome::Stopped => break,
            }
        }
        let _span = info_span!("search").entered();
        ended = exact.run(limits, EXACT.saturating_mul(share), record);
        share = share.saturating_mul(2);
    }
    (claimed(ended, concurrent, root), exact.incumbent)
}

/// What can be said of all plans where the search leaves some out: what could be said before it began.
fn claimed(ended: Ended, concurrent: &Concurrent, root: Int) -> Ended {
    if concurrent.is_exact { ended } else { Ended::Stopped(root) }
}
