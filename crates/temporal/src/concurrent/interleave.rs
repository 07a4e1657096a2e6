//! Interleaves exact and greedy search with growing, equal budgets.
//!
//! Small tasks are proved before the greedy search begins. After that, its plans are incumbents of both searches.

use search::bounds::Bounds;
use task::limits::Limits;
use task::number::{Int, Rational};
use task::plan::solution::PlannerPart;
use tracing::info_span;

use crate::concurrent::greedy::{Greedy, Mode, Outcome};
use crate::concurrent::makespan_heuristic::Estimate;
use crate::concurrent::relaxed_plan_heuristic::RelaxedPlanHeuristic;
use crate::concurrent::search::{Search, SearchEnd, Sequence};
use crate::concurrent::search_log::Record;
use crate::concurrent::sequential_first::{SequentialPlanner, SequentialTask};
use crate::concurrent::successors::Expansion;
use crate::concurrent::temporal_relaxation::TemporalRelaxation;
use crate::concurrent::temporal_task::TemporalTask;

/// For each situation that the greedy search evaluates in a turn, how many the exact one looks at.
const EXACT_BUDGET: usize = 4;
/// Number of rounds in which the search for sequential plans runs although a plan is known. Its best plan is an upper
/// bound.
const WHOLE: usize = 2;

/// Searches until nothing better is left, a limit is reached, or both have had so many turns. `search_log` hears of each better plan and of what none can get below.
pub(super) fn interleave_searches(
    concurrent: &TemporalTask,
    bounds: Option<&Bounds>,
    limits: &Limits,
    record: &mut Record<'_>,
    rounds: usize,
) -> (SearchEnd, Option<Sequence>) {
    let estimate = Estimate::new(concurrent);
    let expansion = Expansion::new(concurrent);
    let mut exact = Search::new(concurrent, &expansion, &estimate, bounds);
    let root = if concurrent.is_bounded { exact.lower() } else { 0 };
    record.begin(Rational::from_integer(root));
    let mut ended =
        info_span!("search").in_scope(|| exact.run(limits, limits.thresholds().concurrent, record));
    if exact.is_over() || limits.reached() {
        return (claimed(ended, (concurrent, &exact), root), exact.incumbent);
    }
    let relaxed = TemporalRelaxation::new(concurrent);
    let begin = |mode| {
        let guidance = RelaxedPlanHeuristic::new(&relaxed);
        Greedy::new(concurrent, &expansion, &estimate, bounds, guidance, mode)
    };
    // Where each end comes right after its start, the one is the other.
    let differs = concurrent.instances.iter().any(|instance| !instance.compressible);
    let mut greedy = vec![begin(Mode::Overlapping)];
    greedy.extend(differs.then(|| begin(Mode::Sequential)));
    let whole = SequentialTask::new(concurrent, limits);
    let mut seeker = whole.as_ref().map(|own| SequentialPlanner::new(own, limits));
    let (mut share, turn) = (1_usize, limits.thresholds().turn.max(1));
    for round in 0..rounds {
        let is_over = exact.is_over() || is_best(concurrent, &exact, root);
        if is_over || limits.reached() || (greedy.is_empty() && exact.is_full(limits)) {
            break;
        }
        seeker = seeker.filter(|_| exact.incumbent.is_none() || round < WHOLE);
        if let Some(seeker) = &mut seeker {
            let _span = info_span!("satisfice").entered();
            let work = turn.saturating_mul(share);
            let found = seeker.run((concurrent, &expansion), work, &mut record.statistics);
            let is_better =
                |own: &Sequence| exact.incumbent.as_ref().is_none_or(|known| own.value < known.value);
            if let Some(sequence) = found.filter(is_better) {
                sequence.tell(exact.lower(), PlannerPart::Satisficing, record);
                exact.incumbent = Some(sequence);
            }
        }
        for position in (0..greedy.len()).rev() {
            let _span = info_span!("greedy").entered();
            let work = turn.saturating_mul(share);
            if pursue(&mut greedy[position], &mut exact, work, limits, record) == Outcome::Exhausted {
                let mode = greedy.remove(position).mode;
                // What was left out may have come sooner.
                greedy.extend((mode == Mode::Overlapping).then(|| begin(Mode::Sooner)));
                let restarts = &mut record.statistics.restarts;
                *restarts = restarts.saturating_add(1);
            }
        }
        // What is better than a plan overlaps more.
        greedy.retain(|own| own.mode != Mode::Sequential || exact.incumbent.is_none());
        let _span = info_span!("search").entered();
        // A plan is worth more than a bound.
        let part = if exact.incumbent.is_none() { 1 } else { EXACT_BUDGET };
        ended = exact.run(limits, turn.saturating_mul(part).saturating_mul(share), record);
        share = share.saturating_mul(2);
    }
    (claimed(ended, (concurrent, &exact), root), exact.incumbent)
}

/// Goes on with a greedy search, from one better plan to the next.
fn pursue(
    greedy: &mut Greedy<'_>,
    exact: &mut Search<'_>,
    work: usize,
    limits: &Limits,
    record: &mut Record<'_>,
) -> Outcome {
    loop {
        let before = greedy.figures;
        let outcome = greedy.run(&mut exact.incumbent, limits, work);
        greedy.figures.add_to(before, &mut record.statistics);
        if outcome != Outcome::Found {
            return outcome;
        }
        let lower = exact.lower();
        let incumbent = exact.incumbent.iter();
        incumbent.for_each(|sequence| sequence.tell(lower, PlannerPart::Satisficing, record));
    }
}

/// What can be said of all plans where the search leaves some out: what could be said before it began.
fn claimed(ended: SearchEnd, (concurrent, search): (&TemporalTask, &Search<'_>), root: Int) -> SearchEnd {
    match ended {
        _ if is_best(concurrent, search, root) => SearchEnd::Exhausted,
        ended if concurrent.is_exact => ended,
        _ => SearchEnd::Stopped(root),
    }
}

/// Whether a plan is as good as any can be, by what could be said before the search began: it may leave out shorter ones.
fn is_best(concurrent: &TemporalTask, search: &Search<'_>, root: Int) -> bool {
    !concurrent.is_exact
        && concurrent.is_whole
        && search.incumbent.as_ref().is_some_and(|known| known.value.0 <= root)
}
