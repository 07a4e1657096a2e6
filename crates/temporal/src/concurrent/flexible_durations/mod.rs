//! Temporal planning with durations that the planner chooses: a linear program for each sequence of
//! happenings.
//!
//! The bounds of a duration are conditions at the start of its action, and effects may depend on the
//! duration. A sequence has a plan if some times and durations satisfy all constraints, which form a linear
//! program as in COLIN \[1\]. The program is solved in exact arithmetic (`linear_program`), because rounding
//! errors could make plans invalid and infeasibility is part of proofs. An exhaustive and a greedy search run
//! interleaved (`search`). If the variant of the task with minimal durations is supported, the searches for
//! fixed durations are used as well.
//!
//! \[1\] A. Coles, A. Coles, M. Fox, D. Long: COLIN: planning with continuous linear numeric change, JAIR 44,
//! 2012.

mod affine;
mod answer;
mod linear_program;
mod mazurkiewicz_trace;
mod partial_plan_lp;
mod search;
mod simultaneous;

use task::error::{Error, Errors};
use task::limits::Limits;
use task::number::Rational;
use task::plan::solution::{PlannerPart, Proof, Solution, Status};
use tracing::info_span;

use crate::concurrent::happening::Instance;
use crate::concurrent::interleave::interleave_searches;
use crate::concurrent::relaxed_plan_heuristic::RelaxedPlanHeuristic;
use crate::concurrent::search_log::Record;
use crate::concurrent::solution::{ended, in_names};
use crate::concurrent::successors::Expansion;
use crate::concurrent::temporal_relaxation::TemporalRelaxation;
use crate::concurrent::temporal_task::TemporalTask;

use answer::Answer;
use partial_plan_lp::Course;
use search::{Outcome, Search};

pub(super) use simultaneous::may_repair_over_all;

/// Checks that the chosen durations of a task are supported.
///
/// # Errors
/// Fails if a derived predicate compares numbers, because its truth would depend on durations. Grounding also
/// introduces such predicates, for example for disjunctions that compare numbers.
pub(super) fn check(concurrent: &TemporalTask) -> Result<(), Errors> {
    let mut rules = concurrent.task.axioms.iter().flat_map(|layer| &layer.rules);
    if rules.all(|rule| rule.body.linears().next().is_none()) {
        return Ok(());
    }
    Err(vec![Error::Unsupported {
        construct: "a derived predicate, conditional effect or constraint that compares numbers, where durations are chosen"
            .into(),
        instead: "durations that are fixed".into(),
        place: task::error::Place { file: task::error::File::Domain, span: pddl::ast::Span::default() },
    }]
    .into())
}

/// Returns `true` if the exhaustive search covers every plan with all its possible times and durations.
///
/// Returns `false` in particular if
/// - a chosen duration may be less than the separation,
/// - a duration depends on the state and is not chosen,
/// - several happenings can jointly maintain a condition at one time, or
/// - the task has timed initial literals, since a plan may end right before them.
pub(super) fn is_exact(concurrent: &TemporalTask) -> bool {
    let takes_time = |instance: &Instance| {
        let condition = &concurrent.task.operators[instance.start.index()].condition;
        !instance.is_chosen
            || condition.comparisons.iter().any(|linear| {
                let [(number, factor)] = linear.coefficients[..] else { return false };
                let Some((_, times)) = instance.timer.filter(|(timer, _)| *timer == number) else {
                    return false;
                };
                let least = linear.quantity.constant.saturating_neg().checked_mul(times);
                let short = concurrent.separation.checked_mul(factor);
                factor > 0 && least.zip(short).is_some_and(|(least, short)| least >= short)
            })
    };
    let is_decided = |instance: &Instance| instance.timer.is_none() || instance.is_chosen;
    concurrent.is_exact
        && concurrent.events.is_empty()
        && concurrent
            .instances
            .iter()
            .all(|instance| instance.joint.is_empty() && is_decided(instance) && takes_time(instance))
}

pub(super) fn optimize(concurrent: &TemporalTask, limits: &Limits, mut record: Record<'_>) -> Solution {
    let span = info_span!("optimize", operators = concurrent.task.operators.len());
    let (is_over, lower, best) = span.in_scope(|| take_turns_choosing(concurrent, limits, &mut record));
    // Rounding durations to decimals may increase the metric slightly; then the value exceeds the
    // bound.
    let is_proved = concurrent.is_exact
        && match &best {
            // The bound alone proves the plan optimal, too, if it is a bound on the whole metric.
            Some(best) => lower >= best.value && (is_over || concurrent.is_whole),
            None => is_over,
        };
    let status = match (&best, is_proved) {
        (Some(_), true) => Status::Optimal,
        (Some(_), false) => Status::Feasible,
        (None, true) => Status::Unsolvable,
        (None, false) => Status::Unknown,
    };
    let lower = match &best {
        Some(best) if is_proved => Some(best.value.clone()),
        _ => Some(lower).filter(|_| !is_proved),
    };
    let plan = best.map(|best| best.plan);
    Solution {
        horizon: plan.as_ref().filter(|_| is_proved).map_or(0, |plan| plan.steps.len()),
        plan,
        lower_bound: lower.filter(|_| concurrent.is_whole).map(|lower| concurrent.measure.metric(&lower)),
        ..ended(status, is_proved.then_some(Proof::Search), record)
    }
}

/// Interleaves the exhaustive search, the greedy search and the searches for fixed durations. Returns
/// whether the exhaustive search has visited all sequences, the lower bound on the metric, and the
/// best plan.
fn take_turns_choosing(
    concurrent: &TemporalTask,
    limits: &Limits,
    record: &mut Record<'_>,
) -> (bool, Rational, Option<Answer>) {
    let expansion = Expansion::new(concurrent);
    let mut best: Option<Answer> = None;
    let mut exhaustive = Search::exhaustive(concurrent, &expansion);
    let least = || Course::new(concurrent).least(concurrent);
    let mut lower = if concurrent.is_bounded { least() } else { Rational::from_integer(0) };
    record.begin(lower.clone());
    let mut turn =
        |search: &mut Search<'_>, best: &mut Option<Answer>, work, part, record: &mut Record<'_>| {
            let before = search.figures;
            let mut remaining_work: u64 = work;
            let outcome = loop {
                let evaluated_before = search.figures.evaluated;
                let outcome = search.run(best, limits, remaining_work);
                if outcome != Outcome::Found {
                    break outcome;
                }
                remaining_work =
                    remaining_work.saturating_sub(search.figures.evaluated.saturating_sub(evaluated_before));
                let improvements = best.iter().map(|best| (best.value.clone(), best.plan.steps.len()));
                improvements.for_each(|(value, steps)| record.improve(&value, steps, lower.clone(), part));
            };
            search.figures.add_to(before, &mut record.statistics);
            if part == PlannerPart::Search && concurrent.is_exact {
                let bound = search.lower().or_else(|| best.as_ref().map(|best| best.value.clone()));
                lower = record.report_lower_bound(bound.unwrap_or_else(|| lower.clone()));
            }
            (outcome, lower.clone())
        };
    let soon = limits.thresholds().chosen;
    let (mut exhaustive_outcome, mut bound) =
        turn(&mut exhaustive, &mut best, soon, PlannerPart::Search, record);
    if exhaustive_outcome == Outcome::Exhausted || limits.reached() {
        return (exhaustive_outcome == Outcome::Exhausted, bound, best);
    }
    let relaxed = TemporalRelaxation::new(concurrent);
    let mut greedy = Search::greedy(concurrent, &expansion, RelaxedPlanHeuristic::new(&relaxed));
    let (mut work, mut rounds) = (soon.max(1), 1..);
    while exhaustive_outcome != Outcome::Exhausted && !limits.reached() {
        // The searches with minimal durations restart in each round with twice the work, so after
        // the first round they only run while no plan is known.
        if let Some(rounds) = rounds.next().filter(|rounds| *rounds == 1 || best.is_none()) {
            shortest(concurrent, (limits, rounds), &mut best, (record, &bound));
        }
        let (greedily, _) = turn(&mut greedy, &mut best, work, PlannerPart::Satisficing, record);
        if exhaustive.is_full(limits) && (greedily == Outcome::Exhausted || greedy.is_full(limits)) {
            break;
        }
        (exhaustive_outcome, bound) = turn(&mut exhaustive, &mut best, work, PlannerPart::Search, record);
        work = work.saturating_mul(2);
    }
    (exhaustive_outcome == Outcome::Exhausted, bound, best)
}

/// Runs the searches for fixed durations on the variant with minimal durations, for a number of
/// rounds, if the variant exists. Updates `best`.
fn shortest(
    concurrent: &TemporalTask,
    (limits, rounds): (&Limits, usize),
    best: &mut Option<Answer>,
    (record, lower): (&mut Record<'_>, &Rational),
) {
    let Some(shortest) = concurrent.shortest.as_deref() else { return };
    let mut discard = |_| {};
    let mut inner_record = Record::new(shortest, std::time::Instant::now(), &mut discard);
    let (_, sequence) = interleave_searches(shortest, None, limits, &mut inner_record, rounds);
    let (figures, part) = (inner_record.statistics, PlannerPart::Satisficing);
    let statistics = &mut record.statistics;
    statistics.expanded = statistics.expanded.saturating_add(figures.expanded);
    statistics.generated = statistics.generated.saturating_add(figures.generated);
    statistics.evaluated = statistics.evaluated.saturating_add(figures.evaluated);
    statistics.restarts = statistics.restarts.saturating_add(figures.restarts);
    let Some(plan) = sequence.map(|sequence| in_names(shortest, &sequence)) else { return };
    let value = concurrent.measure.total_of(&plan.cost);
    if best.as_ref().is_none_or(|best| value < best.value) {
        let steps = plan.steps.len();
        *best = Some(Answer { value: value.clone(), least: value.clone(), plan });
        record.improve(&value, steps, lower.clone(), figures.found_by.unwrap_or(part));
    }
}

#[cfg(test)]
mod tests {
    use pddl::Source;
    use task::ground::GroundConfig;
    use task::limits::Limits;
    use task::number::Rational;

    use crate::concurrent::{ground_concurrent, optimize_concurrent};

    /// Numbers in sequences have any size. A large one makes no plan infeasible.
    #[test]
    fn large_numbers_make_no_plan_infeasible() {
        let domain = "(define (domain d) (:predicates (p) (g)) (:functions (m) (n) (charge))
          (:durative-action load :parameters () :duration (and (>= ?duration 1) (<= ?duration 9)) :condition ()
            :effect (and (at end (p)) (at end (increase (charge) ?duration))
              (at end (assign (n) (* (m) 10000000000000000000000000)))))
          (:durative-action go :parameters () :duration (= ?duration 1) :condition (at start (p))
            :effect (and (at end (g)) (at end (increase (m) 1)))))";
        let problem = "(define (problem p) (:domain d)
          (:init (= (m) 100000000000000000000) (= (n) 0) (= (charge) 0))
          (:goal (and (>= (charge) 3) (>= (n) 1) (g))) (:metric minimize (total-time)))";
        let read = pddl::read(&Source::new("domain", domain), &Source::new("problem", problem));
        let (domain, problem, _) = read.expect("PDDL");
        let separation = Rational::from_integer(1).to_big() / Rational::from_integer(1000).to_big();
        let task =
            ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation).expect("a task");
        let solution = optimize_concurrent(&task, &Limits::none(), &mut |_| {});
        assert!(solution.plan.is_some(), "{:?}", solution.status);
    }
}
