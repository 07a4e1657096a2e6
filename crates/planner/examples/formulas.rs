//! Plans with the SAT solver only. Usage: `formulas DOMAIN PROBLEM SOLVER STRATEGY SECONDS`.
//!
//! Prints one line with the status, cost, lower bound, horizon (number of steps), number of solver calls, number of
//! conflicts, and seconds. Used to compare strategies.

#![allow(clippy::print_stdout)]

use std::time::{Duration, Instant};

use metaplan_planner::{Backend, Config, Engine, GroundConfig, Limits, Strategy, ground, optimize};
use pddl::{Source, read};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [domain, problem, solver, strategy, seconds] = &arguments[..] else {
        return Err("formulas DOMAIN PROBLEM SOLVER STRATEGY SECONDS".into());
    };
    let strategy = match strategy.as_str() {
        "auto" => Strategy::Auto,
        "tighten" => Strategy::Tighten,
        "cores" => Strategy::Cores,
        other => return Err(format!("no strategy: {other}").into()),
    };
    let file = |path: &String| std::fs::read_to_string(path).map(|text| Source::new(path.as_str(), text));
    let (domain, problem, _) =
        read(&file(domain)?, &file(problem)?).map_err(|faults| format!("{faults:?}"))?;
    let task = ground(&domain, &problem, &GroundConfig::default()).map_err(|faults| format!("{faults:?}"))?;
    let backend: Backend = solver.parse()?;
    let limits = Limits::none().with_time(Duration::from_secs_f64(seconds.parse()?));
    let config = Config::default()
        .with_engine(Engine::Sat)
        .with_strategy(strategy)
        .with_backend(backend)
        .with_limits(limits);
    let started = Instant::now();
    let solution = optimize(&task, &config, &mut |_| {});
    let text = |value: Option<_>| {
        value.map_or_else(|| "-".to_owned(), |value: metaplan_planner::Exact| value.to_string())
    };
    let line = [
        format!("{:?}", solution.status),
        text(solution.plan.as_ref().map(|plan| plan.cost.clone())),
        text(solution.lower_bound),
        solution.horizon.to_string(),
        solution.statistics.calls.to_string(),
        solution.statistics.conflicts.to_string(),
        format!("{:.3}", started.elapsed().as_secs_f64()),
    ];
    println!("{}", line.join(" "));
    Ok(())
}
