//! The figures of one simulated mission, also in the columns of SUAVE.

use std::fmt;

use crate::mission::TimeUnit;
use crate::simulate::baseline::Strategy;

/// The columns that SUAVE writes, as it names them, in seconds.
pub const SUAVE_COLUMNS: [&str; 4] =
    ["pipeline found", "time searching pipeline (s)", "distance inspected (m)", "mean reaction time (s)"];

/// Reason why a simulated mission is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The goal was reached.
    Goal,
    /// The time budget was used up.
    Time,
    /// The lifeline reached 0.
    Lost,
    /// The strategy gave up.
    GaveUp,
}

/// Short text about several missions with this ending.
impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Goal => "reached the goal",
            Self::Time => "used up the time budget",
            Self::Lost => "lost the robot",
            Self::GaveUp => "gave up",
        })
    }
}

/// What a simulated mission has come to. Times are in the domain's time unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Who decided.
    pub strategy: Strategy,
    /// What all that is random was drawn from.
    pub seed: u64,
    /// Whether the goal was reached.
    pub accomplished: bool,
    /// Whether the robot came to its end.
    pub lost: bool,
    /// Reason why the mission is over.
    pub ending: Ending,
    /// The unit of its times.
    pub time_unit: TimeUnit,
    /// The mission's metric at the end.
    pub cost: f64,
    /// How long it took.
    pub time: f64,
    /// How many actions succeeded.
    pub actions: usize,
    /// How many actions failed.
    pub failed: usize,
    /// How many actions were cancelled.
    pub cancelled: usize,
    /// How many plans were looked for.
    pub plans: usize,
    /// How often a function got another design.
    pub reconfigurations: usize,
    /// How many different configurations actions were requested with.
    pub distinct: usize,
    /// For each time that the action under way could not go on, how long until something was done about it.
    pub reactions: Vec<f64>,
    /// When the pipeline was found.
    pub found: Option<f64>,
    /// How much of it was inspected; none where the mission does not inspect.
    pub distance: Option<f64>,
}

impl Default for Run {
    fn default() -> Self {
        Self {
            strategy: Strategy::Joint,
            seed: 0,
            accomplished: false,
            lost: false,
            ending: Ending::Time,
            time_unit: TimeUnit::default(),
            cost: 0.0,
            time: 0.0,
            actions: 0,
            failed: 0,
            cancelled: 0,
            plans: 0,
            reconfigurations: 0,
            distinct: 0,
            reactions: Vec::new(),
            found: None,
            distance: None,
        }
    }
}

impl Run {
    /// The mean time from a disturbance to what was done about it; none where there was no such event, which is not the
    /// same as a reaction at once.
    pub fn mean_reaction(&self) -> Option<f64> {
        let count = self.reactions.len();
        (count > 0).then(|| self.reactions.iter().sum::<f64>() / count as f64)
    }

    /// The values of [`SUAVE_COLUMNS`]; empty where the mission has none, and `no event` where there was nothing to react
    /// to. The search time of a pipeline that was not found is the mission's, as SUAVE has it.
    pub fn suave(&self) -> [String; 4] {
        let Some(distance) = self.distance else {
            return [String::new(), String::new(), String::new(), self.reaction()];
        };
        [
            if self.found.is_some() { "True" } else { "False" }.to_owned(),
            self.in_seconds(self.found.unwrap_or(self.time)),
            short(distance),
            self.reaction(),
        ]
    }

    fn reaction(&self) -> String {
        self.mean_reaction().map_or_else(|| "no event".to_owned(), |reaction| self.in_seconds(reaction))
    }

    fn in_seconds(&self, time: f64) -> String {
        short(time * self.time_unit.seconds())
    }

    /// Whether this is the better outcome: a mission that is accomplished before one that is not, then the lower cost.
    pub fn is_better_than(&self, other: &Self) -> bool {
        match (self.accomplished, other.accomplished) {
            (true, true) => self.cost < other.cost - 1e-6,
            (mine, theirs) => mine && !theirs,
        }
    }
}

/// A number with at most three decimals.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
