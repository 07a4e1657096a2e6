//! Generator A: tasks with all temporal and logical features, for sequential and concurrent plans.

mod battery;
pub mod best;
mod evaluate;
pub mod execute;
mod graph;
pub mod happening;
mod make;
pub mod model;
pub mod overlap;
mod problem;
mod reduce;
mod sequence;
mod shrink;

use std::time::Duration;

use num_rational::BigRational;
use num_traits::ToPrimitive as _;

use crate::judge::{Case, Executor, Mode, SHORT, Step, Tally, judge, run};
use happening::{Obstacle, World};
use make::Maker;
use model::{Measure, Q, Task, big};

/// Maximum number of nodes of the oracle for sequential plans.
const CAP: usize = 400;
/// Maximum number of nodes of the oracle for concurrent plans.
const OVERLAP_CAP: usize = 300;

fn schedule_of(world: &World, steps: &[Step]) -> Result<Vec<(usize, Q, Q)>, String> {
    let to_small = |number: &BigRational| {
        let (numerator, denominator) = (number.numer().to_i64(), number.denom().to_i64());
        let number = Q::new(numerator.ok_or("too large")?, denominator.ok_or("too large")?);
        happening::fit(number).map_err(|_| "too large".to_owned())
    };
    let step = |step: &Step| {
        let is_named = |(action, objects): &&(usize, Vec<usize>)| {
            let objects: Vec<_> = objects.iter().map(|object| format!("o{object}")).collect();
            world.task.actions[*action].name == step.action && objects == step.arguments
        };
        let instance = world.instances.iter().position(|instance| is_named(&instance));
        let instance = instance.ok_or_else(|| format!("no action ({} {:?})", step.action, step.arguments))?;
        Ok((instance, to_small(&step.start)?, to_small(&step.duration)?))
    };
    steps.iter().map(step).collect()
}

#[allow(clippy::needless_pass_by_value)]
fn obstacle(obstacle: Obstacle) -> String {
    match obstacle {
        Obstacle::Blocked(reason) => reason.to_owned(),
        Obstacle::TooLarge => "too large".to_owned(),
    }
}

/// Returns the task of a seed; for concurrent plans if `unit` is given.
pub fn sequential_task(seed: u64, unit: Option<Q>) -> Task {
    Maker::make(seed, unit)
}

/// Returns the separation for the concurrent task of a seed.
pub fn concurrent_unit(seed: u64) -> Q {
    let units = [Q::from_integer(1), Q::from_integer(1), Q::new(1, 1000), Q::new(1, 2), Q::from_integer(2)];
    units[(seed % 5) as usize]
}

pub fn maximizes(task: &Task) -> bool {
    matches!(task.measure, Measure::Metric { maximize: true, .. })
}

pub fn executor(world: World, unit: Option<Q>) -> Executor {
    Box::new(move |steps| {
        let plan = schedule_of(&world, steps)?;
        let value = match unit {
            None => execute::execute(&world, &plan),
            Some(unit) => overlap::execute(&world, &plan, unit),
        };
        value.map(big).map_err(obstacle)
    })
}

fn case(name: &str, seed: u64, unit: Option<Q>) -> Case {
    case_of(format!("{name}-{seed}"), Maker::make(seed, unit), unit)
}

fn case_of(name: String, task: Task, unit: Option<Q>) -> Case {
    case_up_to(if unit.is_none() { CAP } else { OVERLAP_CAP }, name, task, unit)
}

/// Generates a case with derived predicates. Returns `None` if the task of the seed has none.
pub fn with_derived(seed: u64) -> Option<Case> {
    let task = Maker::make(seed, None);
    (!task.axioms.is_empty()).then(|| case_of(format!("derived-{seed}"), task, None))
}

/// Creates the case of a task, with the answer of the oracle. If the oracle would exceed `cap` nodes, the answer is
/// open, or that there is no best value.
fn case_up_to(cap: usize, name: String, task: Task, unit: Option<Q>) -> Case {
    let world = World::new(task);
    let truth = match unit {
        None => best::best(&world, cap),
        Some(unit) => overlap::best(&world, unit, cap),
    };
    Case {
        name,
        domain: world.task.domain(),
        problem: world.task.problem(),
        mode: unit.map_or(Mode::Sequential, |unit| Mode::Concurrent(big(unit))),
        maximize: maximizes(&world.task),
        truth,
        execute: executor(world, unit),
        certify: unit.is_none(),
        limit: Duration::from_secs(2),
        second_limit: SHORT,
    }
}

#[test]
fn actions_one_after_another() {
    run(250, |seed| vec![case("temporal", seed, None)]).finish();
}

#[test]
fn actions_with_designs() {
    let case = |seed| vec![case_of(format!("designs-{seed}"), Maker::with_designs(seed), None)];
    run(120, case).finish();
}

#[test]
fn overlapping_actions() {
    run(100, |seed| vec![case("overlap", seed, Some(concurrent_unit(seed)))]).finish();
}

#[test]
fn batteries_that_are_charged() {
    let case = |seed| {
        let unit = concurrent_unit(seed);
        let (task, cap) = battery::make(seed, unit);
        vec![case_up_to(cap, format!("battery-{seed}"), task, Some(unit))]
    };
    run(60, case).finish();
}

fn kinds(task: &Task, unit: Option<Q>) -> (Vec<&'static str>, String) {
    // The oracle panics if its own plan is invalid, which is a failure to be shrunk as well.
    let case = std::panic::catch_unwind(|| case_of("smaller".into(), task.clone(), unit));
    let Ok(case) = case else { return (vec!["the oracle"], String::new()) };
    let mut tally = Tally::default();
    judge(&case, &mut tally);
    let text = tally.failures.iter().map(|failure| failure.text.as_str()).collect();
    (tally.failures.iter().map(|failure| failure.kind).collect(), text)
}

/// Shrinks the failing tasks of the seeds `ORACLE_SEEDS` and prints them. If `ORACLE_OVERLAP` is set, these
/// are seeds of concurrent tasks.
#[test]
#[ignore = "a tool"]
#[allow(clippy::print_stdout)]
fn shrink() {
    let overlap = std::env::var_os("ORACLE_OVERLAP").is_some();
    for seed in std::env::var("ORACLE_SEEDS").expect("ORACLE_SEEDS").split_whitespace() {
        let seed = seed.parse().expect("a seed");
        let unit = overlap.then(|| concurrent_unit(seed));
        let mut task = Maker::make(seed, unit);
        let (original_kinds, mut text) = kinds(&task, unit);
        // Only the kind of the last failure must be preserved, so the shrunk task may fail for a different
        // reason of this kind.
        let Some(kind) = original_kinds.last() else { continue };
        'less: loop {
            for candidate in shrink::smaller(&task) {
                let (kinds, candidate_text) = kinds(&candidate, unit);
                if kinds.contains(kind) {
                    (task, text) = (candidate, candidate_text);
                    continue 'less;
                }
            }
            break;
        }
        println!("#### seed {seed}\n{text}");
    }
}
