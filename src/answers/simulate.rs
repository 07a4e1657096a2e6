//! JSON answer of `metaplan simulate`, and the figures of its table.

use schemars::JsonSchema;
use serde::Serialize;

use crate::message::Message;
use crate::mission::TimeUnit;
use crate::simulate::{Ending, Run, Sample, Strategy};

const FORMAT: &str = "metaplan-simulate/1";

/// The figures of all ways of control, and all missions.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SimulateAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The mission's name.
    mission: &'a str,
    /// The scenario.
    scenario: &'a str,
    /// The unit of all times: that of the domain's times.
    time_unit: TimeUnit,
    /// Whether all missions that were asked for were simulated to their end.
    complete: bool,
    /// How many missions were asked for, over all ways of control.
    missions: usize,
    /// Why it is not complete (M130).
    messages: Vec<Message>,
    /// The figures of each way of control, over all its missions.
    strategies: Vec<StrategyPart>,
    /// Each mission.
    runs: Vec<RunPart>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct StrategyPart {
    /// The way of control.
    strategy: &'static str,
    /// How many missions.
    runs: usize,
    /// How many of them reached the goal.
    accomplished: usize,
    /// The metric of accomplished missions; null where there is none.
    cost: Option<SamplePart>,
    /// From an event that the action under way cannot go on after, to what is done about it; null without such an event.
    reaction: Option<SamplePart>,
    /// How often a function got another design.
    reconfigurations: Option<SamplePart>,
    /// How many different configurations actions were requested with.
    configurations: Option<SamplePart>,
    /// Missions in which it did better than the loop; null where the loop was not run.
    better_than_joint: Option<usize>,
    /// Missions in which it did worse.
    worse_than_joint: Option<usize>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct SamplePart {
    /// The mean.
    mean: f64,
    /// The standard deviation of the sample.
    deviation: f64,
    /// Half of the 95 % confidence interval's width, by Student's distribution.
    half_width_95: f64,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
#[expect(clippy::struct_excessive_bools, reason = "each is a field of the format")]
struct RunPart {
    /// The way of control.
    strategy: &'static str,
    /// What all that is random was drawn from.
    seed: u64,
    /// Whether the goal was reached.
    accomplished: bool,
    /// Whether the robot came to its end.
    lost: bool,
    /// Whether the time budget was used up before that.
    out_of_time: bool,
    /// Whether the way of control gave up.
    gave_up: bool,
    /// The mission's metric at the end.
    cost: f64,
    /// How long it took.
    time: f64,
    /// Actions that succeeded.
    actions: usize,
    /// Actions that failed.
    failed: usize,
    /// Actions that were cancelled.
    cancelled: usize,
    /// Plans that were looked for.
    plans: usize,
    /// How often a function got another design.
    reconfigurations: usize,
    /// How many different configurations actions were requested with.
    configurations: usize,
    /// The mean reaction; null without an event.
    reaction: Option<f64>,
    /// When the pipeline was found; null where it was not, or the mission has none.
    found: Option<f64>,
    /// How much of it was inspected; null where the mission does not inspect.
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

    /// Sets the number of requested missions, and messages. The answer is incomplete if there is a
    /// message.
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

/// Returns the numbers of missions in which a strategy did better and worse than the loop. `None`
/// if the loop has no runs.
pub fn beside_joint(runs: &[Run], strategy: Strategy) -> Option<(usize, usize)> {
    let mut joint = runs_of(runs, Strategy::Joint).peekable();
    joint.peek()?;
    let pairs = runs_of(runs, strategy).zip(joint);
    Some(pairs.fold((0, 0), |(better, worse), (run, joint)| {
        (better + usize::from(run.is_better_than(joint)), worse + usize::from(joint.is_better_than(run)))
    }))
}

/// Returns the statistics of a figure over the runs of a strategy that have this figure.
pub fn sample(runs: &[Run], strategy: Strategy, figure: impl Fn(&Run) -> Option<f64>) -> Option<Sample> {
    Sample::of(&runs_of(runs, strategy).filter_map(figure).collect::<Vec<_>>())
}

/// Returns the cost of an accomplished mission.
pub fn accomplished_cost(run: &Run) -> Option<f64> {
    run.accomplished.then_some(run.cost)
}
