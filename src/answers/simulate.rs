//! What `metaplan simulate` answers, and the figures of its table.

use schemars::JsonSchema;
use serde::Serialize;

use crate::simulate::{Run, Sample, Strategy};

/// The figures of all ways of control, and all missions.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SimulateAnswer<'a> {
    format: &'static str,
    mission: &'a str,
    scenario: &'a str,
    strategies: Vec<StrategyPart>,
    runs: Vec<RunPart>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StrategyPart {
    strategy: &'static str,
    runs: usize,
    accomplished: usize,
    cost: Option<SamplePart>,
    reaction: Option<SamplePart>,
    reconfigurations: Option<SamplePart>,
    configurations: Option<SamplePart>,
    better_than_joint: Option<usize>,
    worse_than_joint: Option<usize>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct SamplePart {
    mean: f64,
    deviation: f64,
    half_width_95: f64,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct RunPart {
    strategy: &'static str,
    seed: u64,
    accomplished: bool,
    lost: bool,
    cost: f64,
    time: f64,
    actions: usize,
    failed: usize,
    cancelled: usize,
    plans: usize,
    reconfigurations: usize,
    configurations: usize,
    reaction: Option<f64>,
    found: Option<f64>,
    distance: Option<f64>,
}

impl<'a> SimulateAnswer<'a> {
    /// All runs of these ways of control in a scenario.
    pub fn new(mission: &'a str, scenario: &'a str, strategies: &[Strategy], runs: &[Run]) -> Self {
        Self {
            format: "metaplan-simulate/1",
            mission,
            scenario,
            strategies: strategies.iter().map(|&strategy| StrategyPart::of(strategy, runs)).collect(),
            runs: runs.iter().map(RunPart::of).collect(),
        }
    }
}

impl StrategyPart {
    fn of(strategy: Strategy, runs: &[Run]) -> Self {
        let figure = |figure: &dyn Fn(&Run) -> Option<f64>| {
            sample(runs, strategy, figure).map(|sample| SamplePart {
                mean: sample.mean,
                deviation: sample.deviation,
                half_width_95: sample.half_width,
            })
        };
        let beside = beside_joint(runs, strategy);
        Self {
            strategy: strategy.name(),
            runs: runs_of(runs, strategy).count(),
            accomplished: runs_of(runs, strategy).filter(|run| run.accomplished).count(),
            cost: figure(&accomplished_cost),
            reaction: figure(&Run::mean_reaction),
            reconfigurations: figure(&|run| Some(run.reconfigurations as f64)),
            configurations: figure(&|run| Some(run.distinct as f64)),
            better_than_joint: beside.map(|(better, _)| better),
            worse_than_joint: beside.map(|(_, worse)| worse),
        }
    }
}

impl RunPart {
    fn of(run: &Run) -> Self {
        Self {
            strategy: run.strategy.name(),
            seed: run.seed,
            accomplished: run.accomplished,
            lost: run.lost,
            cost: run.cost,
            time: run.time,
            actions: run.actions,
            failed: run.failed,
            cancelled: run.cancelled,
            plans: run.plans,
            reconfigurations: run.reconfigurations,
            configurations: run.distinct,
            reaction: run.mean_reaction(),
            found: run.found,
            distance: run.distance,
        }
    }
}

/// The runs of a strategy.
pub fn runs_of(runs: &[Run], strategy: Strategy) -> impl Iterator<Item = &Run> + Clone {
    runs.iter().filter(move |run| run.strategy == strategy)
}

/// Missions in which a strategy did better than the loop, and in which it did worse; none where the loop has none.
pub fn beside_joint(runs: &[Run], strategy: Strategy) -> Option<(usize, usize)> {
    let mut joint = runs_of(runs, Strategy::Joint).peekable();
    joint.peek()?;
    let pairs = runs_of(runs, strategy).zip(joint);
    Some(pairs.fold((0, 0), |(better, worse), (run, joint)| {
        (better + usize::from(run.is_better_than(joint)), worse + usize::from(joint.is_better_than(run)))
    }))
}

/// A figure of the runs of a strategy, of those that have it.
pub fn sample(runs: &[Run], strategy: Strategy, figure: impl Fn(&Run) -> Option<f64>) -> Option<Sample> {
    Sample::of(&runs_of(runs, strategy).filter_map(figure).collect::<Vec<_>>())
}

/// What an accomplished mission costs.
pub fn accomplished_cost(run: &Run) -> Option<f64> {
    run.accomplished.then_some(run.cost)
}
