//! Differential tests of one task with different encodings, strategies, solvers, horizons, and with several
//! objectives. The claims must agree.

use std::time::{Duration, Instant};

use fastrand::Rng;
use metaplan::mission::Planning as _;
use planner::{
    Backend, Config, Engine, Limits, MetricUnbounded, Solution, Status, StepSemantics, Strategy, Thresholds,
};

use crate::certify;
use crate::judge::{Case, Mode, Tally, plan_lines, project_verdict, rational, read, steps_of};

use super::Puzzle;
use super::draw::one_of;
use super::fronts::front;
use super::model::{Expr, Number, applied};
use super::print::objective;
use super::truth::{Outcome, fewest_steps, within};

const LIMIT: Duration = Duration::from_millis(500);

fn config(rng: &mut Rng) -> Config {
    let semantics = [StepSemantics::Sequential, StepSemantics::ForAllStep, StepSemantics::ExistsStep];
    Config::default()
        .with_engine(one_of(rng, &[Engine::Auto, Engine::Sat, Engine::Search]))
        .with_confirmation(rng.bool())
        .with_head_start(one_of(rng, &[1, 10, 100, 20_000]))
        .with_semantics((!super::draw::once_in(rng, 4)).then(|| one_of(rng, &semantics)))
        .with_strategy(one_of(rng, &[Strategy::Auto, Strategy::Tighten, Strategy::Cores]))
        .with_backend(if rng.bool() { Backend::Batsat } else { Backend::Varisat })
        .with_limits(Limits::none().with_time(LIMIT).with_thresholds(thresholds(rng.bool())))
}

fn thresholds(is_early: bool) -> Thresholds {
    if is_early { Thresholds::NONE } else { Thresholds::default() }
}

pub fn check_variants(puzzle: &Puzzle, case: &Case, rng: &mut Rng, tally: &mut Tally) {
    let Ok((mission, problem)) = read(&case.domain, &case.problem) else { return };
    let Ok(task) = mission.ground(&problem, &[], &Limits::none().with_time(LIMIT)) else { return };
    let started = Instant::now();
    for _ in 0..2 {
        let config = config(rng);
        let solution = planner::optimize(&task, &config, &mut |_| {});
        let description = format!(
            "{:?} {:?} {:?} {:?} confirm: {} head start: {}",
            config.semantics,
            config.strategy,
            config.backend,
            config.engine,
            config.confirm,
            config.head_start
        );
        tally.count(format!("variant: {:?}", solution.status));
        check(puzzle, case, &solution, &description, tally);
    }
    let horizon = rng.usize(0..5);
    let config = config(rng).with_horizon(horizon).with_semantics(None);
    let solution = planner::optimize(&task, &config, &mut |_| {});
    tally.count(format!("horizon: {:?}", solution.status));
    check_horizon(puzzle, case, &solution, (horizon, &config), tally);
    tally.planning += started.elapsed();
}

fn check(puzzle: &Puzzle, case: &Case, solution: &Solution, description: &str, tally: &mut Tally) {
    let mut cost = None;
    if let Some(plan) = &solution.plan {
        let claimed = rational(&plan.cost);
        if plan.steps.iter().any(|step| !step.configuration.is_empty()) {
            tally.count("variant: a plan with designs in slots");
        }
        match (case.execute)(&steps_of(plan)) {
            Ok(value) if value == claimed => {}
            unexpected => {
                let reason = format!("{description}: {unexpected:?} for {claimed}, {:?}", plan.steps);
                tally.fail(case, "a variant's plan is invalid or costs otherwise", &reason);
            }
        }
        cost = Some(claimed);
    }
    let is_worse = |incumbent: &Number| match &cost {
        Some(cost) if puzzle.maximize() => cost < incumbent,
        Some(cost) => cost > incumbent,
        None => true,
    };
    let is_wrong = match (solution.status, &puzzle.explored.outcome) {
        (Status::Optimal, Outcome::Best((best, _))) => cost.as_ref() != Some(best),
        (Status::Optimal, Outcome::Open(Some((incumbent, _)))) => is_worse(incumbent),
        (Status::Feasible, Outcome::Best(_)) => solution.unbounded == Some(MetricUnbounded::Proved),
        (Status::Unsolvable, outcome) => !matches!(outcome, Outcome::NoPlan | Outcome::Open(None)),
        (Status::Optimal, Outcome::NoBest(_))
        | (Status::Optimal | Status::Feasible, Outcome::NoPlan)
        | (Status::UnsolvableWithinHorizon, _) => true,
        _ => false,
    };
    if is_wrong {
        let reason = format!(
            "{description}: {:?} {:?} {cost:?}: {:?}",
            solution.status, solution.proof, puzzle.explored.outcome
        );
        tally.fail(case, "a variant's claim is false", &reason);
    }
}

fn check_horizon(
    puzzle: &Puzzle,
    case: &Case,
    solution: &Solution,
    (horizon, config): (usize, &Config),
    tally: &mut Tally,
) {
    let description = format!("horizon {horizon}, {:?}, {:?}", config.strategy, config.backend);
    let space = &puzzle.explored.space;
    if solution.status == Status::UnsolvableWithinHorizon {
        if fewest_steps(space).is_some_and(|least_steps| least_steps <= horizon) {
            tally.fail(case, "a plan within the horizon is denied", &description);
        }
        return;
    }
    check(puzzle, case, solution, &description, tally);
    let Some(plan) = &solution.plan else { return };
    if plan.steps.len() > horizon {
        tally.fail(case, "a plan is longer than the horizon", &description);
    }
    let best = within(space, puzzle.maximize(), horizon);
    let reached = config.limits.reached();
    // This is not a failure: the answer for a horizon may be the first plan found. The count shows how often
    // this happens.
    if best.is_some_and(|(best, _)| space.complete && !reached && rational(&plan.cost) != best) {
        tally.count("NOTE: not the best plan within the horizon");
    }
}

pub fn objectives(puzzle: &Puzzle, rng: &mut Rng) -> Vec<Expr> {
    let task = &puzzle.task;
    let mut candidates: Vec<Expr> = Vec::new();
    for name in ["total-cost", "energy", "x0"] {
        if let Some(position) = task.functions.iter().position(|function| function.name == name) {
            candidates.push(Expr::Function(applied(position, &[])));
        }
    }
    let sum = Expr::Sum(vec![
        candidates[0].clone(),
        Expr::Product(vec![Expr::Number(super::model::decimal("0.3")), candidates[1].clone()]),
    ]);
    candidates.push(sum);
    if task.is_timed() {
        candidates.push(Expr::TotalTime);
    }
    rng.shuffle(&mut candidates);
    candidates.truncate(rng.usize(2..4));
    candidates
}

/// Checks plans with several objectives: the first two objectives as a Pareto front, and all objectives
/// lexicographically.
pub fn check_objectives(puzzle: &Puzzle, expressions: &[Expr], case: &Case, tally: &mut Tally) {
    let Some(expected_points) = front(&puzzle.explored.space) else { return };
    let puzzle_of_pair = Puzzle::new(puzzle.name.clone(), puzzle.task.clone(), &expressions[..2]);
    let Some(pairs) = puzzle_of_pair.and_then(|puzzle_of_pair| front(&puzzle_of_pair.explored.space)) else {
        return;
    };
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
    let description =
        || expressions.iter().map(|e| objective(&puzzle.task, e)).collect::<Vec<_>>().join(", ");
    let started = Instant::now();
    if let Ok(task) = mission.ground(&problem, &metrics, &Limits::none()) {
        let point = planner::lexicographic(&task, &config(), &mut |_| {});
        let values: Vec<Number> = point.values.iter().map(rational).collect();
        tally.count(format!("list: {:?}", point.solution.status));
        let is_wrong = match point.solution.status {
            Status::Optimal => expected_points.first() != Some(&values),
            Status::Unsolvable => !expected_points.is_empty(),
            _ => false,
        };
        if is_wrong {
            tally.fail(
                case,
                "a list is not minimal",
                &format!("{}: {values:?}, not {expected_points:?}", description()),
            );
        }
    }
    if let Ok(task) = mission.ground(&problem, &metrics[..2], &Limits::none()) {
        let computed = planner::pareto(&task, &config(), &mut |_| {});
        tally.count(format!("front: {:?}", computed.status));
        let points = computed.points.iter();
        let mut points: Vec<Vec<Number>> =
            points.map(|point| point.values.iter().map(rational).collect()).collect();
        points.retain(|point| !point.is_empty());
        points.sort();
        let is_wrong = match computed.status {
            Status::Optimal => points != pairs,
            Status::Unsolvable => !pairs.is_empty(),
            // An incomplete front may lack points, but an exact point must equal or dominate each
            // of its points.
            _ => points.iter().any(|point| pairs.iter().all(|best| best[0] > point[0] || best[1] > point[1])),
        };
        if is_wrong {
            tally.fail(case, "a front is wrong", &format!("{}: {points:?}, not {pairs:?}", description()));
        }
        if let (Status::Optimal, [first, second, ..]) = (computed.status, &metrics[..]) {
            let objectives = [first, second].map(|objective| objective.metric.clone());
            let front = (&computed.points[..], is_wrong);
            certify::check_front(case, (&mission, &problem), &objectives, front, tally);
        }
    }
    tally.planning += started.elapsed();
}

/// Checks that validator and oracle agree on random variations of the oracle's plan, most of which
/// are invalid.
pub fn check_validator(puzzle: &Puzzle, case: &Case, rng: &mut Rng, tally: &mut Tally) {
    let Ok((mission, problem)) = read(&case.domain, &case.problem) else { return };
    let base_plan = match &puzzle.explored.outcome {
        Outcome::Best((_, plan)) | Outcome::NoBest((_, plan)) | Outcome::Open(Some((_, plan))) => {
            plan.clone()
        }
        Outcome::NoPlan | Outcome::Open(None) => Vec::new(),
    };
    let instances = puzzle.ground.instances.len();
    for _ in 0..4 {
        // Small changes of a valid plan fail late and for many reasons. Random plans would fail at the first
        // step.
        let mut plan = base_plan.clone();
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
        let executed = (case.execute)(&steps);
        tally.count(if executed.is_ok() { "random plan: valid" } else { "random plan: invalid" });
        let measured = puzzle.task.metric.is_some();
        if executed.is_ok() != verdict.valid
            || executed.is_ok() && measured && executed.as_ref().ok() != verdict.metric.as_ref()
        {
            let violation_text =
                verdict.violation.map_or_else(String::new, |violation| violation.message.clone());
            let reason = format!(
                "{executed:?}, but {} {violation_text} {:?}\n{}",
                verdict.valid,
                verdict.metric,
                plan_lines(&steps)
            );
            tally.fail(case, "the validator judges a plan otherwise", &reason);
        }
    }
}
