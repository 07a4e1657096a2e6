//! Compares cheapest plans of generated missions with an independent oracle: Dijkstra's algorithm over the
//! explicit states of the mission, from which the PDDL text is also generated.

use metaplan_planner::{Backend, Config, Engine, GroundConfig, Proof, Status, Strategy, ground, optimize};
use testing::missions::Mission;

use crate::tally::limits;
use pddl::{Source, read};

/// The SAT solver alone cannot decide missions without a plan, or missions with cycles that cost nothing, so it gets a
/// horizon for these.
fn check(seed: u64, (engine, head_start): (Engine, usize), backend: &Backend, strategy: Strategy) {
    let mission = Mission::random(seed);
    let (domain, problem) = (mission.domain(), mission.problem());
    let (domain, problem, _) = read(&Source::new("domain", domain), &Source::new("problem", problem))
        .unwrap_or_else(|diagnostics| panic!("seed {seed}: {diagnostics:#?}"));
    let task = ground(&domain, &problem, &GroundConfig::default())
        .unwrap_or_else(|errors| panic!("seed {seed}: {errors:#?}"));
    let costly = mission.weights.0 > 0 && mission.weights.1 > 0;
    let bounded = engine == Engine::Auto || costly && mission.oracle().is_some();
    let horizon = if bounded { None } else { Some(14) };
    let config = Config::default()
        .with_engine(engine)
        .with_head_start(head_start)
        .with_confirmation(true)
        .with_horizon(horizon)
        .with_strategy(strategy)
        .with_backend(backend.clone())
        .with_limits(limits(head_start));
    let solution = optimize(&task, &config, &mut |_| {});
    let context = || {
        format!("seed {seed}, {engine:?}, {head_start}, {backend:?}, {strategy:?}: {mission:?}: {solution:?}")
    };
    let Some(cost) = mission.oracle() else {
        let allowed = [Status::Unsolvable, Status::UnsolvableWithinHorizon];
        assert!(allowed.contains(&solution.status) && solution.plan.is_none(), "{}", context());
        assert!(engine == Engine::Sat || solution.status == Status::Unsolvable, "{}", context());
        return;
    };
    let found = solution.plan.as_ref().map(|plan| plan.cost.to_string());
    assert_eq!(found, Some(cost.to_string()), "{}", context());
    let length = solution.plan.as_ref().map_or(0, |plan| plan.steps.len());
    assert_eq!(mission.oracle_by_steps(length).last(), Some(&Some(cost)), "{}", context());
    if engine == Engine::Auto {
        assert_eq!(solution.status, Status::Optimal, "{}", context());
    }
    if costly {
        assert_eq!(solution.status, Status::Optimal, "{}", context());
        assert!(matches!(solution.proof, Some(Proof::Sat { .. } | Proof::Bound)), "{}", context());
    }
}

fn built_in() -> impl Iterator<Item = Backend> {
    Backend::BUILT_IN.iter().map(|name| name.parse().expect("a name"))
}

const STRATEGIES: [Strategy; 3] = [Strategy::Auto, Strategy::Tighten, Strategy::Cores];

#[test]
fn generated_missions_have_the_optimum_of_the_oracle() {
    for head_start in [20_000, 20, 1] {
        (0..150).for_each(|seed| {
            check(seed, (Engine::Auto, head_start), &Backend::default(), Strategy::Auto);
        });
    }
}

#[test]
fn the_sat_solvers_alone_find_the_same_optimum() {
    for backend in built_in() {
        for strategy in STRATEGIES {
            (0..40).for_each(|seed| check(seed, (Engine::Sat, 0), &backend, strategy));
        }
    }
}

#[test]
#[ignore = "takes minutes"]
fn many_generated_missions_have_the_optimum_of_the_oracle() {
    for backend in built_in() {
        for strategy in STRATEGIES {
            for seed in 150..2_200 {
                check(seed, (Engine::Auto, 20_000), &backend, strategy);
                check(seed, (Engine::Auto, 5), &backend, strategy);
                check(seed, (Engine::Sat, 0), &backend, strategy);
            }
        }
    }
}
