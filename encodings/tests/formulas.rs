//! Compares formulas with an oracle: for every number of steps, a formula must be satisfiable at
//! the oracle's cost and unsatisfiable below it.

use std::cell::OnceCell;

use metaplan_encodings::encode::{CostEncoding, CostLimit, Encoding, PlanConstraints, StepSemantics};
use metaplan_encodings::sat::{Answer, Backend};
use pddl::{Source, read};
use search::bounds::Bounds;
use task::context::Context;
use task::ground::{GroundConfig, ground};
use task::limits::Limits;
use task::number::Int;
use task::plan::ground::replay;
use task::task::Task;
use testing::missions::Mission;
use testing::{costs_by_steps, depot, fleet, ground_text, optimum};

/// Minimum number of steps up to which formulas are tested.
const STEPS: usize = 6;

const MOST_STEPS: usize = 16;

/// Cost limit above all costs. Used if no plan is known, so that the limit is not the reason.
const MUCH: Int = 200;

/// Returns `true` if the formula admits a plan with at most `steps` steps and a cost of at most
/// `limit`. Also executes the decoded plan.
fn is_solvable(
    task: &Task,
    bounds: &Bounds,
    steps: usize,
    limit: Int,
    semantics: StepSemantics,
    backend: &Backend,
) -> bool {
    let window =
        bounds.window(Context::new(task, &Limits::none()), Some(limit), Some(steps)).expect("no limit");
    let cost = CostLimit { limit, bounds, counting: CostEncoding::Sum };
    let limits = Limits::none();
    let encoding = Encoding::new(
        Context::new(task, &limits),
        PlanConstraints { allowed: &window.allowed, cost: Some(cost), semantics, max_clauses: usize::MAX },
        &OnceCell::new(),
    )
    .expect("no limit");
    let mut solver = backend.start(&Limits::none(), u64::MAX);
    for (_, clause) in encoding.formula.clauses() {
        solver.add_clause(clause);
    }
    let answer = solver.solve(&[]);
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
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let optimum = mission.oracle().map(Int::from);
    if task.unreachable.is_some() {
        assert!(optimum.is_none(), "seed {seed}");
        return;
    }
    let (scale, offset) = (task.objective.scale, task.objective.offset);
    let bounds = Bounds::new(Context::new(&task, &Limits::none())).expect("no limit");
    let below = optimum.map_or(MUCH, |optimum| optimum * scale - offset - 1);
    let step_bound = bounds
        .window(Context::new(&task, &Limits::none()), Some(below), None)
        .expect("no limit")
        .steps
        .unwrap_or(STEPS);
    let costs = mission.oracle_by_steps(step_bound.clamp(STEPS, MOST_STEPS));
    let costs: Vec<_> = costs.into_iter().map(|cost| cost.map(Int::from)).collect();
    assert!(
        costs.iter().flatten().all(|cost| optimum.is_some_and(|optimum| optimum <= *cost)),
        "seed {seed}"
    );
    for bounds in [&bounds, &Bounds::trivial(Context::new(&task, &Limits::none())).expect("no limit")] {
        for (steps, cost) in costs.iter().enumerate() {
            let solvable =
                |limit| is_solvable(&task, bounds, steps, limit, StepSemantics::Sequential, backend);
            let context = || format!("seed {seed}, {backend:?}, {steps} steps: {mission:?}");
            match cost {
                Some(cost) => {
                    assert!(solvable(cost * scale - offset), "{}", context());
                    assert!(!solvable(cost * scale - offset - 1), "{}", context());
                }
                None => assert!(!solvable(Int::from(i32::MAX)), "{}", context()),
            }
        }
    }
}

#[test]
fn formulas_are_satisfiable_exactly_from_the_cost_of_the_oracle_on() {
    for backend in Backend::built_in() {
        (0..25).for_each(|seed| check(seed, &backend));
    }
}

#[test]
#[ignore = "takes minutes"]
fn many_formulas_are_satisfiable_exactly_from_the_cost_of_the_oracle_on() {
    for backend in crate::solvers::backends() {
        (25..2_100).for_each(|seed| check(seed, &backend));
    }
}

/// Checks the formulas of a task in all step semantics. Returns `true` in the first part if several
/// operators shared a step, and in the second part if the task has symmetries.
fn check_all(text: (String, String), backend: &Backend) -> (bool, bool) {
    let task = ground_text(text.clone());
    let text = text.1;
    if task.unreachable.is_some() {
        return (false, false);
    }
    let max_steps = 4;
    let (costs, optimum) = (costs_by_steps(&task, max_steps), optimum(&task));
    let bounds = Bounds::new(Context::new(&task, &Limits::none())).expect("no limit");
    let mut together = false;
    for bounds in [&bounds, &Bounds::trivial(Context::new(&task, &Limits::none())).expect("no limit")] {
        for (steps, cost) in costs.iter().enumerate() {
            let context = |semantics| format!("{backend:?}, {steps} steps, {semantics:?}, {cost:?}: {text}");
            for semantics in [StepSemantics::Sequential, StepSemantics::ForAllStep, StepSemantics::ExistsStep]
            {
                let solvable = |limit| is_solvable(&task, bounds, steps, limit, semantics, backend);
                if let Some(cost) = cost {
                    assert!(solvable(*cost), "{}", context(semantics));
                }
                let below = cost.unwrap_or(MUCH) - 1;
                match (semantics, optimum) {
                    (StepSemantics::Sequential, _) => assert!(!solvable(below), "{}", context(semantics)),
                    (_, Some(optimum)) => {
                        assert!(!solvable(optimum - 1), "{}", context(semantics));
                        together |= below >= optimum && solvable(below);
                    }
                    (_, None) => assert!(!solvable(MUCH), "{}", context(semantics)),
                }
            }
        }
    }
    let allowed = vec![vec![true; task.operators.len()]; max_steps];
    let limits = Limits::none();
    let encoding = Encoding::new(
        Context::new(&task, &limits),
        PlanConstraints {
            allowed: &allowed,
            cost: None,
            semantics: StepSemantics::Sequential,
            max_clauses: usize::MAX,
        },
        &OnceCell::new(),
    );
    let counts = encoding.expect("no limit").formula.counts();
    (together, !counts.contains(&("symmetry", 0)))
}

/// The number of level constraints is quadratic in the number of pairs of places.
#[test]
fn formulas_with_too_many_level_constraints_are_given_up() {
    let domain = "(define (domain d) (:predicates (open ?a ?b) (connected ?a ?b) (done))
      (:derived (connected ?a ?b) (or (open ?a ?b) (exists (?c) (and (connected ?a ?c) (connected ?c ?b)))))
      (:action link :parameters (?a ?b) :precondition (not (open ?a ?b)) :effect (open ?a ?b))
      (:action cut :parameters (?a ?b) :precondition (open ?a ?b) :effect (not (open ?a ?b)))
      (:action finish :parameters (?a ?b) :precondition (connected ?a ?b) :effect (done)))";
    let problem =
        "(define (problem p) (:domain d) (:objects a b c d e f g h) (:init (open a b)) (:goal (done)))";
    let task = ground_text((domain.to_owned(), problem.to_owned()));
    let limits = Limits::none();
    let clauses = |steps: usize, max_clauses: usize| {
        let allowed = vec![vec![true; task.operators.len()]; steps];
        let semantics = StepSemantics::Sequential;
        let plans = PlanConstraints { allowed: &allowed, cost: None, semantics, max_clauses };
        let encoding = Encoding::new(Context::new(&task, &limits), plans, &OnceCell::new());
        encoding.map(|encoding| encoding.formula.clause_count())
    };
    let all = clauses(0, usize::MAX).expect("a small formula");
    assert!(all > 20_000, "{all}");
    assert_eq!(clauses(0, 10_000), None);
    assert_eq!(clauses(1_000, usize::MAX), None);
}

#[test]
fn parallel_steps_and_symmetry_breaking_preserve_the_optimum() {
    for backend in Backend::built_in() {
        let fleets = (0..8).map(|seed| check_all(fleet(seed), &backend));
        let together = fleets.filter(|(together, _)| *together).count();
        assert!(together > 1, "{backend:?}: operators stand together in {together} tasks only");
        let depots = (0..8).map(|seed| check_all(depot(seed), &backend));
        let equal = depots.filter(|(_, equal)| *equal).count();
        assert!(equal > 3, "{backend:?}: something is equal in {equal} tasks only");
    }
}

#[test]
#[ignore = "takes minutes"]
fn parallel_steps_and_symmetry_breaking_preserve_the_optimum_of_many_tasks() {
    for backend in Backend::built_in() {
        for seed in 8..1_100 {
            check_all(fleet(seed), &backend);
            check_all(depot(seed), &backend);
        }
    }
}
