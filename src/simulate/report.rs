//! The results of one simulated mission, including the columns of SUAVE's reports.

use std::fmt;

use crate::mission::TimeUnit;
use crate::simulate::baseline::Strategy;

/// Columns of the reports of SUAVE, with SUAVE's names; times are in seconds.
pub const SUAVE_COLUMNS: [&str; 4] =
    ["pipeline found", "time searching pipeline (s)", "distance inspected (m)", "mean reaction time (s)"];

/// Reason for the end of a simulated mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The goal was reached.
    Goal,
    /// The time budget was used up.
    Time,
    /// The robot was lost because its lifeline, such as the battery, reached 0.
    Lost,
    /// The strategy will make no further request.
    GaveUp,
}

/// Writes the ending as a verb phrase that can follow a number of missions, such as "lost the robot" in
/// "2 lost the robot".
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

/// Result of a simulated mission. Times are in the domain's time unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The control strategy of the run.
    pub strategy: Strategy,
    /// Seed of all random numbers.
    pub seed: u64,
    /// `true` if the goal was reached.
    pub accomplished: bool,
    /// `true` if the lifeline, such as the battery, reached 0.
    pub lost: bool,
    /// Reason for the end of the mission.
    pub ending: Ending,
    /// Unit of the times of this result.
    pub time_unit: TimeUnit,
    /// Value of the mission's metric at the end, or the duration of the mission if there is no metric or its value is
    /// undefined.
    pub cost: f64,
    /// Whether the metric is maximised.
    pub maximize: bool,
    /// Duration of the mission.
    pub time: f64,
    /// Number of actions that succeeded.
    pub actions: usize,
    /// Number of actions that failed.
    pub failed: usize,
    /// Number of actions that were cancelled.
    pub cancelled: usize,
    /// Number of plans that were requested or computed.
    pub plans: usize,
    /// Number of requested reconfigurations, except those of functions whose previous design was unknown.
    pub reconfigurations: usize,
    /// Number of distinct configurations with which actions were requested.
    pub distinct: usize,
    /// Reaction times: the time from each stall of the running action to the next effect of the controller, if there
    /// was one.
    pub reactions: Vec<f64>,
    /// Time at which the pipeline was found. `None` if it was not found.
    pub found: Option<f64>,
    /// Inspected length of the pipeline. `None` if the simulation names no function for the length, or the function has
    /// no value.
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
            maximize: false,
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
    /// Returns the mean reaction time. `None` if the controller did not react to a stalled action; an immediate
    /// reaction gives 0.
    pub fn mean_reaction(&self) -> Option<f64> {
        let count = self.reactions.len();
        (count > 0).then(|| self.reactions.iter().sum::<f64>() / count as f64)
    }

    /// Returns the texts for [`SUAVE_COLUMNS`]. The first three are empty if the mission does not inspect a pipeline;
    /// the last is `no event` if there was no reaction. As in SUAVE, the search time of a pipeline that was not found
    /// is the duration of the mission.
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

    /// Returns `true` if this run is better than `other`: it alone reached the goal, or both did and its metric is
    /// better by more than 10⁻⁶.
    pub fn is_better_than(&self, other: &Self) -> bool {
        match (self.accomplished, other.accomplished) {
            (true, true) if self.maximize => self.cost > other.cost + 1e-6,
            (true, true) => self.cost < other.cost - 1e-6,
            (mine, theirs) => mine && !theirs,
        }
    }
}

pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
