//! Interleaves the exact search with incomplete ones (greedy search, goal orders, sequential plans). The
//! budgets double in each round. They begin again when all incomplete searches have ended and restart.
//!
//! Small tasks are solved by the exact search alone, before the others begin. After that, the best
//! plan of any search is the incumbent.

use search::bounds::Bounds;
use task::limits::Limits;

use task::plan::solution::PlannerPart;
use tracing::info_span;

use crate::concurrent::exclusive_resources::makespan_bound;
use crate::concurrent::goal_orders::GoalOrders;
use crate::concurrent::greedy::{Greedy, Mode, Outcome};
use crate::concurrent::makespan_heuristic::Estimate;
use crate::concurrent::relaxed_plan_heuristic::RelaxedPlanHeuristic;
use crate::concurrent::search::{Search, SearchEnd, Sequence};
use crate::concurrent::search_log::Record;
use crate::concurrent::sequential_first::{SequentialPlanner, SequentialTask};
use crate::concurrent::successors::Expansion;
use crate::concurrent::temporal_relaxation::TemporalRelaxation;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

/// Work units of the exact search per generated successor of the greedy search, once a plan is known.
const EXACT_BUDGET: usize = 4;
/// Number of first rounds in which the search for sequential plans runs even if a plan is known. In later
/// rounds it runs only until a plan is known. Its best plan gives an upper bound on the metric.
const WHOLE: usize = 2;

/// Interleaves the searches until optimality is proved, no search can continue, a limit is reached, or
/// `rounds` rounds are over. Returns the outcome and the best plan. Better plans and lower bounds are also
/// reported to `record`.
pub(super) fn interleave_searches<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    bounds: Option<&Bounds>,
    limits: &Limits,
    record: &mut Record<'_, T>,
    rounds: usize,
) -> (SearchEnd<T>, Option<Sequence<T>>) {
    let estimate = Estimate::new(concurrent, limits);
    let expansion = Expansion::new(concurrent);
    let mut exact = Search::new(concurrent, &expansion, &estimate, bounds);
    let mut root = if concurrent.is_bounded { exact.lower() } else { T::ZERO };
    record.begin(root.to_rational());
    let mut search_end =
        info_span!("search").in_scope(|| exact.run(limits, limits.thresholds().concurrent, record));
    if exact.is_over() || limits.reached() {
        return (claimed(search_end, (concurrent, &exact), root), exact.incumbent);
    }
    if concurrent.is_bounded && concurrent.measure.time > T::ZERO {
        let _span = info_span!("resources").entered();
        exact.raise_floor(makespan_bound(concurrent, limits));
        root = root.max(concurrent.measure.total(exact.floor(), 0).unwrap_or(T::ZERO));
        record.begin(root.to_rational());
        search_end = SearchEnd::Stopped(exact.lower());
    }
    let relaxed = TemporalRelaxation::new(concurrent);
    let begin = |mode| {
        let guidance = RelaxedPlanHeuristic::new(&relaxed);
        Greedy::new(concurrent, &expansion, &estimate, bounds, guidance, mode)
    };
    // If all actions are compressible, sequential mode hardly differs from overlapping mode.
    let differs = concurrent.instances.iter().any(|instance| !instance.compressible);
    let mut greedy = vec![begin(Mode::Overlapping)];
    greedy.extend(differs.then(|| begin(Mode::Sequential)));
    let (mut share, turn) = (1_usize, limits.thresholds().turn.max(1));
    let mut orders = GoalOrders::new(concurrent, &expansion, &relaxed, 0, limits);
    // A first plan is sought before the sequential task is grounded.
    improve(&mut orders, &mut exact, turn, limits, record);
    let whole = SequentialTask::new(concurrent, limits);
    let mut seeker = whole.as_ref().map(|task| SequentialPlanner::new(task, limits));
    let mut seed = 0;
    for round in 0..rounds {
        let is_over = exact.is_over() || is_best(concurrent, &exact, root);
        let is_stuck = greedy.is_empty() && orders.is_none() && exact.is_full(limits);
        if is_over || limits.reached() || is_stuck && !limits.has_deadline() {
            break;
        }
        if is_stuck {
            // The exact search has used up its memory, and the other searches have ended. Until the
            // deadline, the others begin again, in other orders and with the incumbent as upper bound.
            let restarts = &mut record.statistics.restarts;
            *restarts = restarts.saturating_add(1);
            seed = *restarts as u64;
            greedy.push(begin(Mode::Overlapping).with_noise(seed));
            orders = GoalOrders::new(concurrent, &expansion, &relaxed, seed, limits);
            share = 1;
        }
        seeker = seeker.filter(|_| exact.incumbent.is_none() || round < WHOLE);
        if let Some(seeker) = &mut seeker {
            let _span = info_span!("satisfice").entered();
            let work = turn.saturating_mul(share);
            let plan = seeker.run((concurrent, &expansion), work, &mut record.statistics);
            let is_better = |sequence: &Sequence<T>| {
                exact.incumbent.as_ref().is_none_or(|best| sequence.value < best.value)
            };
            if let Some(sequence) = plan.filter(is_better) {
                sequence.tell(exact.lower(), PlannerPart::Satisficing, record);
                exact.incumbent = Some(sequence);
            }
        }
        for position in (0..greedy.len()).rev() {
            let _span = info_span!("greedy").entered();
            let work = turn.saturating_mul(share);
            if pursue(&mut greedy[position], &mut exact, work, limits, record) == Outcome::Exhausted {
                let mode = greedy.remove(position).mode;
                // Successors that were pruned as duplicates may reach a state at an earlier time, so
                // a complete restart may find better plans.
                greedy.extend((mode == Mode::Overlapping).then(|| begin(Mode::Sooner).with_noise(seed)));
                let restarts = &mut record.statistics.restarts;
                *restarts = restarts.saturating_add(1);
            }
        }
        improve(&mut orders, &mut exact, turn.saturating_mul(share), limits, record);
        // Once a plan is known, sequential mode is dropped: better plans usually overlap more.
        greedy.retain(|search| search.mode != Mode::Sequential || exact.incumbent.is_none());
        let _span = info_span!("search").entered();
        // Without a plan, the greedy search gets a larger share: a plan is more useful than a
        // bound.
        let part = if exact.incumbent.is_none() { 1 } else { EXACT_BUDGET };
        search_end = exact.run(limits, turn.saturating_mul(part).saturating_mul(share), record);
        share = share.saturating_mul(2);
    }
    (claimed(search_end, (concurrent, &exact), root), exact.incumbent)
}

/// Resumes a greedy search, again after each better plan, until it generates `work` successors without
/// finding one or has ended. Each better plan is reported and becomes the incumbent.
fn pursue<T: TimeNumber>(
    greedy: &mut Greedy<'_, T>,
    exact: &mut Search<'_, T>,
    work: usize,
    limits: &Limits,
    record: &mut Record<'_, T>,
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

/// Resumes the search over goal orders for `work` work units. Each better plan is reported and becomes
/// the incumbent. Sets `orders` to `None` once the search has ended.
fn improve<T: TimeNumber>(
    orders: &mut Option<GoalOrders<'_, T>>,
    exact: &mut Search<'_, T>,
    work: usize,
    limits: &Limits,
    record: &mut Record<'_, T>,
) {
    let Some(search) = orders else { return };
    let _span = info_span!("goal orders").entered();
    let before = search.figures;
    let end = search.work().saturating_add(work as u64);
    while let Some(budget) = end.checked_sub(search.work()).filter(|budget| *budget > 0) {
        let budget = usize::try_from(budget).unwrap_or(usize::MAX);
        let Some(sequence) = search.run(exact.incumbent.as_ref(), limits, budget) else { break };
        sequence.tell(exact.lower(), PlannerPart::Satisficing, record);
        exact.incumbent = Some(sequence);
    }
    search.figures.add_to(before, &mut record.statistics);
    if search.is_over() {
        *orders = None;
    }
}

/// Outcome that is proved after the searches. If the exact search is incomplete, only the initial lower bound
/// holds for all plans.
fn claimed<T: TimeNumber>(
    search_end: SearchEnd<T>,
    (concurrent, search): (&TemporalTask<T>, &Search<'_, T>),
    root: T,
) -> SearchEnd<T> {
    match search_end {
        _ if is_best(concurrent, search, root) => SearchEnd::Exhausted,
        search_end if concurrent.is_exact => search_end,
        _ => SearchEnd::Stopped(root),
    }
}

/// Returns `true` if the exact search is incomplete, but the incumbent reaches the lower bound
/// `root` on the whole metric.
fn is_best<T: TimeNumber>(concurrent: &TemporalTask<T>, search: &Search<'_, T>, root: T) -> bool {
    !concurrent.is_exact
        && concurrent.is_whole
        && search.incumbent.as_ref().is_some_and(|incumbent| incumbent.value.0 <= root)
}
