//! JSON answer of `metaplan simulate`, and the figures of its table.

use schemars::JsonSchema;
use serde::Serialize;

use crate::message::Message;
use crate::mission::TimeUnit;
use crate::simulate::{Ending, Run, Sample, Strategy};

const FORMAT: &str = "metaplan-simulate/1";

/// Statistics of all strategies, and all simulated runs.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SimulateAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The mission's name.
    mission: &'a str,
    /// The scenario.
    scenario: &'a str,
    /// Unit of all times: the time unit of the domain.
    time_unit: TimeUnit,
    /// Whether all requested runs were simulated to their end.
    complete: bool,
    /// Number of requested runs over all strategies.
    missions: usize,
    /// Reason why the answer is incomplete (M130).
    messages: Vec<Message>,
    /// Statistics of each strategy over its runs.
    strategies: Vec<StrategyPart>,
    /// The simulated runs.
    runs: Vec<RunPart>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StrategyPart {
    /// The strategy.
    strategy: &'static str,
    /// Number of runs.
    runs: usize,
    /// Number of runs that reached the goal.
    accomplished: usize,
    /// Cost of accomplished runs (see `runs`); null without such runs.
    cost: Option<SamplePart>,
    /// Reaction time: from an event that prevents the current action from continuing to the reaction; null
    /// without a reaction.
    reaction: Option<SamplePart>,
    /// Number of requested changes of a function's design, except those of an unknown design.
    reconfigurations: Option<SamplePart>,
    /// Number of different configurations of requested actions.
    configurations: Option<SamplePart>,
    /// Number of runs in which the strategy did better than the adaptation loop (strategy `joint`); null if the
    /// loop was not simulated.
    better_than_joint: Option<usize>,
    /// Number of runs in which the strategy did worse than the adaptation loop; null if the loop was not
    /// simulated.
    worse_than_joint: Option<usize>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct SamplePart {
    /// Mean.
    mean: f64,
    /// Standard deviation of the sample; 0 for a single value.
    deviation: f64,
    /// Half-width of the 95 % confidence interval of the mean, by Student's distribution. 0 for a single
    /// value, which has no such interval.
    half_width_95: f64,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
#[expect(clippy::struct_excessive_bools, reason = "each is a field of the format")]
struct RunPart {
    /// The strategy.
    strategy: &'static str,
    /// Seed of the random numbers.
    seed: u64,
    /// Whether the goal was reached.
    accomplished: bool,
    /// Whether the robot was lost because its `lifeline` reached 0.
    lost: bool,
    /// Whether the run ended because the time budget was exhausted.
    out_of_time: bool,
    /// Whether the strategy gave up.
    gave_up: bool,
    /// Metric at the end of the run, or its duration if the metric is missing or undefined.
    cost: f64,
    /// Duration of the run.
    time: f64,
    /// Number of actions that succeeded.
    actions: usize,
    /// Number of actions that failed.
    failed: usize,
    /// Number of actions that were cancelled.
    cancelled: usize,
    /// Number of planning queries.
    plans: usize,
    /// Number of requested changes of a function's design, except those of an unknown design.
    reconfigurations: usize,
    /// Number of different configurations of requested actions.
    configurations: usize,
    /// Mean reaction time; null without a reaction.
    reaction: Option<f64>,
    /// Time at which the pipeline was found; null if it was not found or the mission has none.
    found: Option<f64>,
    /// Inspected length of the pipeline; null if the mission does not inspect.
    distance: Option<f64>,
}

impl<'a> SimulateAnswer<'a> {
    /// Answer with all runs of the strategies in a scenario.
    pub fn new(mission: &'a str, scenario: &'a str, strategies: &[Strategy], runs: &[Run]) -> Self {
        Self {
            format: FORMAT,
            mission,
            scenario,
            time_unit: TimeUnit::default(),
            complete: true,
            missions: runs.len(),
            messages: Vec::new(),
            strategies: strategies.iter().map(|&strategy| StrategyPart::of(strategy, runs)).collect(),
            runs: runs.iter().map(RunPart::of).collect(),
        }
    }
}

impl SimulateAnswer<'_> {
    /// Sets the unit of the times.
    #[must_use]
    pub fn timed(self, time_unit: TimeUnit) -> Self {
        Self { time_unit, ..self }
    }

    /// Sets the number of requested runs (the field `missions`) and the messages. The answer is incomplete if
    /// there is a message.
    #[must_use]
    pub fn of(self, missions: usize, messages: Vec<Message>) -> Self {
        Self { missions, complete: messages.is_empty(), messages, ..self }
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
            out_of_time: run.ending == Ending::Time,
            gave_up: run.ending == Ending::GaveUp,
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

/// Returns the runs of a strategy.
pub fn runs_of(runs: &[Run], strategy: Strategy) -> impl Iterator<Item = &Run> + Clone {
    runs.iter().filter(move |run| run.strategy == strategy)
}

/// Compares the n-th run of `strategy` with the n-th run of the loop (strategy `Joint`), for each n. Returns the
/// number of runs in which `strategy` did better, and the number in which it did worse. Returns `None` if the loop
/// has no runs.
pub fn beside_joint(runs: &[Run], strategy: Strategy) -> Option<(usize, usize)> {
    let mut joint = runs_of(runs, Strategy::Joint).peekable();
    joint.peek()?;
    let pairs = runs_of(runs, strategy).zip(joint);
    Some(pairs.fold((0, 0), |(better, worse), (run, joint)| {
        (better + usize::from(run.is_better_than(joint)), worse + usize::from(joint.is_better_than(run)))
    }))
}

/// Returns the statistics of `figure` over the runs of a strategy. Runs for which `figure` is `None` are ignored.
/// Returns `None` if no run has a value.
pub fn sample(runs: &[Run], strategy: Strategy, figure: impl Fn(&Run) -> Option<f64>) -> Option<Sample> {
    Sample::of(&runs_of(runs, strategy).filter_map(figure).collect::<Vec<_>>())
}

/// Returns the cost of a run that reached its goal, otherwise `None`.
pub fn accomplished_cost(run: &Run) -> Option<f64> {
    run.accomplished.then_some(run.cost)
}
