//! The same task asked in other ways: encodings, strategies, solvers, horizons, several objectives. What is claimed must not differ.

use std::time::{Duration, Instant};

use fastrand::Rng;
use metaplan::mission::Planning as _;
use planner::{
    Backend, Config, Engine, Limits, MetricUnbounded, Solution, Status, StepSemantics, Strategy, Thresholds,
};

use crate::judge::{Case, Mode, Tally, plan_lines, project_verdict, rational, read, steps_of};

use super::Puzzle;
use super::draw::one;
use super::fronts::front;
use super::model::{Expr, Number, applied};
use super::print::objective;
use super::truth::{Known, fewest_steps, within};

/// How long the planner may take each time.
const LIMIT: Duration = Duration::from_millis(500);

fn config(rng: &mut Rng) -> Config {
    let semantics = [StepSemantics::Sequential, StepSemantics::ForAllStep, StepSemantics::ExistsStep];
    Config::default()
        .with_engine(one(rng, &[Engine::Auto, Engine::Sat, Engine::Search]))
        .with_confirmation(rng.bool())
        .with_head_start(one(rng, &[1, 10, 100, 20_000]))
        .with_semantics((!super::draw::once_in(rng, 4)).then(|| one(rng, &semantics)))
        .with_strategy(one(rng, &[Strategy::Auto, Strategy::Tighten, Strategy::Cores]))
        .with_backend(if rng.bool() { Backend::Batsat } else { Backend::Varisat })
        .with_limits(Limits::none().with_time(LIMIT).with_thresholds(thresholds(rng.bool())))
}

fn thresholds(is_early: bool) -> Thresholds {
    if is_early { Thresholds::NONE } else { Thresholds::default() }
}

/// Asks with two random settings, and with a horizon.
pub fn check_variants(puzzle: &Puzzle, case: &Case, rng: &mut Rng, tally: &mut Tally) {
    let Ok((mission, problem)) = read(&case.domain, &case.problem) else { return };
    let Ok(task) = mission.ground(&problem, &[], &Limits::none().with_time(LIMIT)) else { return };
    let started = Instant::now();
    for _ in 0..2 {
        let config = config(rng);
        let solution = planner::optimize(&task, &config, &mut |_| {});
        let said = format!(
            "{:?} {:?} {:?} {:?} confirm: {} head start: {}",
            config.semantics,
            config.strategy,
            config.backend,
            config.engine,
            config.confirm,
            config.head_start
        );
        tally.count(format!("variant: {:?}", solution.status));
        check(puzzle, case, &solution, &said, tally);
    }
    let horizon = rng.usize(0..5);
    let config = config(rng).with_horizon(horizon).with_semantics(None);
    let solution = planner::optimize(&task, &config, &mut |_| {});
    tally.count(format!("horizon: {:?}", solution.status));
    check_horizon(puzzle, case, &solution, (horizon, &config), tally);
    tally.planning += started.elapsed();
}

/// What is said of plans of any length.
fn check(puzzle: &Puzzle, case: &Case, solution: &Solution, said: &str, tally: &mut Tally) {
    let mut cost = None;
    if let Some(plan) = &solution.plan {
        let claimed = rational(&plan.cost);
        if plan.steps.iter().any(|step| !step.configuration.is_empty()) {
            tally.count("variant: a plan with designs in slots");
        }
        match (case.execute)(&steps_of(plan)) {
            Ok(value) if value == claimed => {}
            other => {
                let reason = format!("{said}: {other:?} for {claimed}, {:?}", plan.steps);
                tally.fail(case, "a variant's plan is invalid or costs otherwise", &reason);
            }
        }
        cost = Some(claimed);
    }
    let worse = |found: &Number| match &cost {
        Some(cost) if puzzle.maximize() => cost < found,
        Some(cost) => cost > found,
        None => true,
    };
    let wrong = match (solution.status, &puzzle.explored.known) {
        (Status::Optimal, Known::Best((best, _))) => cost.as_ref() != Some(best),
        (Status::Optimal, Known::Open(Some((found, _)))) => worse(found),
        (Status::Feasible, Known::Best(_)) => solution.unbounded == Some(MetricUnbounded::Proved),
        (Status::Unsolvable, known) => !matches!(known, Known::NoPlan | Known::Open(None)),
        (Status::Optimal, Known::NoBest(_))
        | (Status::Optimal | Status::Feasible, Known::NoPlan)
        | (Status::UnsolvableWithinHorizon, _) => true,
        _ => false,
    };
    if wrong {
        let reason = format!(
            "{said}: {:?} {:?} {cost:?}: {:?}",
            solution.status, solution.proof, puzzle.explored.known
        );
        tally.fail(case, "a variant's claim is false", &reason);
    }
}

/// What is said of plans of at most so many steps.
fn check_horizon(
    puzzle: &Puzzle,
    case: &Case,
    solution: &Solution,
    (horizon, config): (usize, &Config),
    tally: &mut Tally,
) {
    let said = format!("horizon {horizon}, {:?}, {:?}", config.strategy, config.backend);
    let space = &puzzle.explored.space;
    if solution.status == Status::UnsolvableWithinHorizon {
        if fewest_steps(space).is_some_and(|fewest| fewest <= horizon) {
            tally.fail(case, "a plan within the horizon is denied", &said);
        }
        return;
    }
    check(puzzle, case, solution, &said, tally);
    let Some(plan) = &solution.plan else { return };
    if plan.steps.len() > horizon {
        tally.fail(case, "a plan is longer than the horizon", &said);
    }
    let best = within(space, puzzle.maximize(), horizon);
    let reached = config.limits.reached();
    if best.is_some_and(|(best, _)| space.complete && !reached && rational(&plan.cost) != best) {
        tally.count("NOTE: not the best plan within the horizon");
    }
}

/// Objectives of a mission, two or three.
pub fn objectives(puzzle: &Puzzle, rng: &mut Rng) -> Vec<Expr> {
    let task = &puzzle.task;
    let mut all: Vec<Expr> = Vec::new();
    for name in ["total-cost", "energy", "x0"] {
        if let Some(position) = task.functions.iter().position(|function| function.name == name) {
            all.push(Expr::Function(applied(position, &[])));
        }
    }
    let sum = Expr::Sum(vec![
        all[0].clone(),
        Expr::Product(vec![Expr::Number(super::model::decimal("0.3")), all[1].clone()]),
    ]);
    all.push(sum);
    if task.is_timed() {
        all.push(Expr::TotalTime);
    }
    rng.shuffle(&mut all);
    all.truncate(rng.usize(2..4));
    all
}

/// Asks for plans by several objectives: the first two as a Pareto front, all of them as a list.
pub fn check_objectives(puzzle: &Puzzle, expressions: &[Expr], case: &Case, tally: &mut Tally) {
    let Some(all) = front(&puzzle.explored.space) else { return };
    let two = Puzzle::new(puzzle.name.clone(), puzzle.task.clone(), &expressions[..2]);
    let Some(pairs) = two.and_then(|two| front(&two.explored.space)) else { return };
    let Ok((mission, problem)) = read(&case.domain, &case.problem) else { return };
    let read = |expression: &Expr| mission.objective(&problem, &objective(&puzzle.task, expression));
    let metrics: Result<Vec<_>, _> = expressions.iter().map(read).collect();
    let metrics = match metrics {
        Ok(metrics) => metrics,
        Err(messages) => {
            return tally.fail(case, "an objective is not read", &messages[0].message);
        }
    };
    let is_early = expressions.len() == 2;
    let limits = || Limits::none().with_time(LIMIT).with_thresholds(thresholds(is_early));
    let config =
        || Config::default().with_limits(limits()).with_head_start(if is_early { 1 } else { 20_000 });
    let said = || expressions.iter().map(|e| objective(&puzzle.task, e)).collect::<Vec<_>>().join(", ");
    let started = Instant::now();
    if let Ok(task) = mission.ground(&problem, &metrics, &Limits::none()) {
        let point = planner::lexicographic(&task, &config(), &mut |_| {});
        let values: Vec<Number> = point.values.iter().map(rational).collect();
        tally.count(format!("list: {:?}", point.solution.status));
        let wrong = match point.solution.status {
            Status::Optimal => all.first() != Some(&values),
            Status::Unsolvable => !all.is_empty(),
            _ => false,
        };
        if wrong {
            tally.fail(case, "a list is not minimal", &format!("{}: {values:?}, not {all:?}", said()));
        }
    }
    if let Ok(task) = mission.ground(&problem, &metrics[..2], &Limits::none()) {
        let found = planner::pareto(&task, &config(), &mut |_| {});
        tally.count(format!("front: {:?}", found.status));
        let points = found.points.into_iter();
        let mut points: Vec<Vec<Number>> =
            points.map(|point| point.values.iter().map(rational).collect()).collect();
        points.retain(|point| !point.is_empty());
        points.sort();
        let wrong = match found.status {
            Status::Optimal => points != pairs,
            Status::Unsolvable => !pairs.is_empty(),
            _ => points.iter().any(|point| pairs.iter().all(|best| best[0] > point[0] || best[1] > point[1])),
        };
        if wrong {
            tally.fail(case, "a front is wrong", &format!("{}: {points:?}, not {pairs:?}", said()));
        }
    }
    tally.planning += started.elapsed();
}

/// The validator has to agree with the oracle on random plans, most of them invalid.
pub fn check_validator(puzzle: &Puzzle, case: &Case, rng: &mut Rng, tally: &mut Tally) {
    let Ok((mission, problem)) = read(&case.domain, &case.problem) else { return };
    let known = match &puzzle.explored.known {
        Known::Best((_, plan)) | Known::NoBest((_, plan)) | Known::Open(Some((_, plan))) => plan.clone(),
        Known::NoPlan | Known::Open(None) => Vec::new(),
    };
    let instances = puzzle.ground.instances.len();
    for _ in 0..4 {
        let mut plan = known.clone();
        plan.truncate(6);
        for _ in 0..rng.usize(1..4) {
            let position = rng.usize(0..=plan.len());
            match rng.u32(0..3) {
                0 if position < plan.len() => {
                    plan.remove(position);
                }
                1 if position + 1 < plan.len() => plan.swap(position, position + 1),
                _ if instances > 0 => plan.insert(position, rng.usize(0..instances)),
                _ => {}
            }
        }
        let steps = puzzle.steps(&plan);
        let verdict = project_verdict(&mission, &problem, &steps, &Mode::Sequential);
        let own = (case.execute)(&steps);
        tally.count(if own.is_ok() { "random plan: valid" } else { "random plan: invalid" });
        let measured = puzzle.task.metric.is_some();
        if own.is_ok() != verdict.valid
            || own.is_ok() && measured && own.as_ref().ok() != verdict.metric.as_ref()
        {
            let said = verdict.violation.map_or_else(String::new, |violation| violation.message.clone());
            let reason =
                format!("{own:?}, but {} {said} {:?}\n{}", verdict.valid, verdict.metric, plan_lines(&steps));
            tally.fail(case, "the validator judges a plan otherwise", &reason);
        }
    }
}
