//! Compares the SAT strategies with exhaustive search, and checks the bounds that they report.

use std::sync::atomic::Ordering;
use std::time::Duration;

use encodings::sat::Backend;
use search::bounds::Bounds;
use task::context::Context;
use task::limits::Limits;
use task::number::Int;
use task::plan::solution::{Proof, Solution, Status};
use task::plan::{Exact, metric};
use task::task::Task;
use testing::{depot, fleet, ground_text, optimum};

use crate::optimize::{Config, Engine, Strategy, optimize};

const STRATEGIES: [Strategy; 3] = [Strategy::Auto, Strategy::Tighten, Strategy::Cores];

fn tasks(seeds: std::ops::Range<u64>) -> impl Iterator<Item = (String, Task, Int)> {
    seeds.flat_map(|seed| [fleet(seed), depot(seed)]).filter_map(|text| {
        let problem = text.1.clone();
        let task = ground_text(text);
        let best = if task.unreachable.is_none() { optimum(&task) } else { None };
        best.map(|best| (problem, task, best))
    })
}

fn config(backend: &Backend, strategy: Strategy, limits: Limits) -> Config {
    Config { engine: Engine::Sat, strategy, backend: backend.clone(), limits, ..Config::default() }
}

/// Checks the cost and the bounds of a solution against the optimum. If all operators have positive
/// costs, the solution must be proved optimal. Returns `true` if it is proved optimal.
fn check_optimum(context: &str, (task, best): (&Task, Int), config: &Config) -> bool {
    let solution = optimize(task, config, &mut |_| {});
    let best = metric(task, &best);
    let cost = solution.plan.as_ref().map(|plan| plan.cost.clone());
    let context = || format!("{config:?}: {context}: {solution:?}");
    let proved = solution.status == Status::Optimal;
    assert!(cost.is_some_and(|cost| cost == best || !proved && best <= cost), "{}", context());
    assert!(solution.lower_bound.as_ref().is_some_and(|bound| *bound <= best), "{}", context());
    let costly = task.operators.iter().all(|operator| operator.cost.minimum() > 0);
    assert!(proved || !costly, "{}", context());
    proved
}

fn check_optima(seeds: std::ops::Range<u64>) {
    let tasks: Vec<_> = tasks(seeds).collect();
    for backend in Backend::built_in() {
        for strategy in STRATEGIES {
            let config = config(&backend, strategy, Limits::none());
            let proved =
                tasks.iter().filter(|(text, task, best)| check_optimum(text, (task, *best), &config));
            assert!(2 * proved.count() > tasks.len(), "{config:?}");
        }
    }
}

#[test]
fn every_strategy_finds_the_optimum() {
    check_optima(0..6);
}

#[test]
#[ignore = "takes minutes"]
fn every_strategy_finds_the_optimum_of_many() {
    check_optima(6..1_100);
}

/// Checks that the optimum lies between lower bound and cost in every report and in the solution,
/// and that reports never get worse. Interrupts the run after `stop_after` reports. Returns `true`
/// if there were at least as many reports.
fn check_reports(context: &str, (task, best): (&Task, Int), config: &Config, stop_after: usize) -> bool {
    let interrupt = config.limits.interrupt();
    let best = metric(task, &best);
    let mut last: Option<(Exact, Exact)> = None;
    let mut reports = 0;
    let context = |solution: Option<&Solution>| format!("{config:?}, {stop_after}: {context}: {solution:?}");
    let solution = optimize(task, config, &mut |improvement| {
        let gap = improvement.gap();
        let (cost, bound) = (improvement.cost, improvement.lower_bound);
        assert!(bound <= best && best <= cost, "{bound} {best} {cost} {}", context(None));
        if let Some((before, below)) = &last {
            assert!(cost <= *before && *below <= bound, "{}", context(None));
        }
        assert_eq!(gap == 0.0, cost == bound, "{}", context(None));
        last = Some((cost, bound));
        reports += 1;
        if reports == stop_after {
            interrupt.store(true, Ordering::Relaxed);
        }
    });
    let cost = solution.plan.as_ref().map(|plan| plan.cost.clone());
    let (before, below) = last.unzip();
    assert!(cost.as_ref().is_none_or(|cost| best <= *cost), "{}", context(Some(&solution)));
    assert!(before.is_none_or(|before| cost.as_ref().is_some_and(|cost| *cost <= before)));
    let bound = solution.lower_bound.clone();
    assert!(bound.as_ref().is_none_or(|bound| *bound <= best), "{}", context(Some(&solution)));
    assert!(below.is_none_or(|below| bound.as_ref().is_some_and(|bound| below <= *bound)));
    if solution.status == Status::Optimal {
        assert_eq!((cost, bound), (Some(best.clone()), Some(best)), "{}", context(Some(&solution)));
    }
    reports >= stop_after
}

/// `Proof::Bound` must be returned exactly if the optimal cost equals the initial lower bound.
fn check_reasons(seeds: std::ops::Range<u64>) {
    let (mut by_bound, mut by_search) = (0, 0);
    for (text, task, best) in tasks(seeds) {
        let bounds = Bounds::new(Context::new(&task, &Limits::none())).expect("no limit");
        let floor = bounds.estimate(&task.initial);
        for head_start in [20_000, 10, 1] {
            let config = Config { engine: Engine::Search, head_start, ..Config::default() };
            let solution = optimize(&task, &config, &mut |_| {});
            let is_met = floor == Some(best);
            by_bound += usize::from(is_met);
            by_search += usize::from(!is_met);
            let expected = if is_met { Proof::Bound } else { Proof::Search };
            assert_eq!(solution.proof, Some(expected), "{head_start}: {text:?}");
        }
    }
    assert!(by_bound > 0 && by_search > 0, "{by_bound} by bound, {by_search} by search");
}

#[test]
fn the_proof_is_a_bound_exactly_if_the_initial_bound_is_the_optimum() {
    check_reasons(0..12);
}

fn check_anytime(seeds: std::ops::Range<u64>) {
    let tasks: Vec<_> = tasks(seeds).collect();
    for backend in Backend::built_in() {
        for strategy in STRATEGIES {
            let mut stopped = 0;
            for (text, task, best) in &tasks {
                let further = (1..5).take_while(|stop_after| {
                    let config = config(&backend, strategy, Limits::none());
                    check_reports(text, (task, *best), &config, *stop_after)
                });
                stopped += further.count();
                for microseconds in [0, 300, 2_000] {
                    let limits = Limits::none().with_time(Duration::from_micros(microseconds));
                    check_reports(text, (task, *best), &config(&backend, strategy, limits), usize::MAX);
                }
            }
            assert!(stopped > tasks.len(), "{backend:?}, {strategy:?}: {stopped} of {}", tasks.len());
        }
    }
}

#[test]
fn the_optimum_lies_between_bound_and_cost_at_any_time() {
    check_anytime(0..5);
}

#[test]
#[ignore = "takes minutes"]
fn the_optimum_of_many_lies_between_bound_and_cost_at_any_time() {
    check_anytime(5..600);
}
