//! Formulas against an oracle: for every number of steps, a formula has a plan at the oracle's cost, and none one below.

#[path = "../tests/missions/mod.rs"]
mod missions;
#[path = "../tests/random/mod.rs"]
mod random;

use crate::bounds::Bounds;
use crate::encode::{CostLimit, Encoding};
use crate::ground::{Config, ground};
use crate::limits::Limits;
use crate::pddl::{Source, read};
use crate::plan::replay;
use crate::sat::{Answer, Backend};
use crate::task::Task;
use missions::Mission;

/// Longest plans that are looked for.
const STEPS: usize = 6;

/// Whether there is a plan with at most so many steps and at most this cost; if so, it is one.
fn is_solvable(task: &Task, bounds: &Bounds, steps: usize, limit: i64, backend: &Backend) -> bool {
    let window = bounds.window(task, Some(limit), Some(steps));
    let cost = CostLimit { limit, bounds };
    let encoding = Encoding::new(task, &window.allowed, Some(cost), &Limits::none()).expect("no limit");
    let mut solver = backend.start(&Limits::none(), u64::MAX);
    for (_, clause) in encoding.formula.clauses() {
        solver.add_clause(clause);
    }
    let answer = solver.solve();
    assert_ne!(answer, Answer::Interrupted, "{backend:?}: {:?}", solver.failure());
    if answer == Answer::Satisfiable {
        let plan = encoding.decode(solver.as_ref());
        let replayed = replay(task, &plan);
        assert!(replayed.is_some_and(|(_, cost)| cost <= limit), "{backend:?}: no plan: {plan:?}");
    }
    answer == Answer::Satisfiable
}

fn check(seed: u64, backend: &Backend) {
    let mission = Mission::random(seed);
    let (domain, problem) = (Source::new("d", mission.domain()), Source::new("p", mission.problem()));
    let (domain, problem, _) = read(&domain, &problem).expect("PDDL");
    let task = ground(&domain, &problem, &Config::default()).expect("a task");
    let costs = mission.oracle_by_steps(STEPS);
    if task.unreachable.is_some() {
        assert!(costs.iter().all(Option::is_none), "seed {seed}");
        return;
    }
    let optimum = mission.oracle();
    assert!(
        costs.iter().flatten().all(|cost| optimum.is_some_and(|optimum| optimum <= *cost)),
        "seed {seed}"
    );
    let scale = task.objective.scale;
    let bounds = Bounds::new(&task, &Limits::none());
    for bounds in [&bounds, &Bounds::trivial(&task)] {
        for (steps, cost) in costs.iter().enumerate() {
            let solvable = |limit| is_solvable(&task, bounds, steps, limit, backend);
            let context = || format!("seed {seed}, {backend:?}, {steps} steps: {mission:?}");
            match cost {
                Some(cost) => {
                    assert!(solvable(cost * scale - task.objective.offset), "{}", context());
                    assert!(!solvable(cost * scale - task.objective.offset - 1), "{}", context());
                }
                None => assert!(!solvable(i64::from(i32::MAX)), "{}", context()),
            }
        }
    }
}

fn built_in() -> impl Iterator<Item = Backend> {
    Backend::BUILT_IN.iter().map(|name| name.parse().expect("a name"))
}

#[test]
fn formulas_have_plans_at_the_cost_of_the_oracle_and_none_below() {
    for backend in built_in() {
        (0..25).for_each(|seed| check(seed, &backend));
    }
}

#[test]
#[ignore = "takes minutes"]
fn many_formulas_have_plans_at_the_cost_of_the_oracle_and_none_below() {
    for backend in built_in() {
        (25..2_100).for_each(|seed| check(seed, &backend));
    }
}
