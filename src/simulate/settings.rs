//! The section `simulation` of a scenario: the environment of a simulated robot.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

/// How a scenario is simulated. Times are in the domain's time unit (`planning.time_unit`).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Simulation {
    /// The time from one report to the next, in the domain's time unit, as all times of the section.
    pub step: f64,
    /// The mission is given up after this time.
    pub time_budget: f64,
    /// How long an action that cannot go on waits before it fails.
    pub patience: f64,
    /// Actions take up to this share longer or shorter than expected.
    #[serde(default)]
    pub noise: f64,
    /// The numeric function that ends the mission when it comes to 0, such as `battery`.
    #[serde(default)]
    pub lifeline: Option<String>,
    /// What happens once.
    #[serde(default)]
    pub events: Vec<Disturbance>,
    /// Attributes that swing.
    #[serde(default)]
    pub signals: Vec<Signal>,
    /// Components that fail at random.
    #[serde(default)]
    pub failures: Vec<RandomFailure>,
    /// How the figures of SUAVE are found.
    #[serde(default)]
    pub suave: Option<Suave>,
}

/// Something that happens once: at a time, or when a condition holds for the first time.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// When; an event has either this or `when`.
    #[serde(default)]
    pub at: Option<f64>,
    /// The condition: a fact as `predicate arguments` or `(predicate arguments)`, or any condition of PDDL, such as `(< (battery) 20)`.
    #[serde(default)]
    pub when: Option<String>,
    /// So much later than that at most, by a random part of it.
    #[serde(default)]
    pub within: f64,
    /// Components that fail.
    #[serde(default)]
    pub fail: Vec<String>,
    /// Components that recover.
    #[serde(default)]
    pub recover: Vec<String>,
    /// Names to values, as for `--set`.
    #[serde(default)]
    pub set: BTreeMap<String, String>,
}

/// An attribute that swings: `mean + amplitude * sin(2 * pi * (time / period + phase))`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Signal {
    /// The attribute.
    pub attribute: String,
    /// In the attribute's unit.
    pub mean: f64,
    /// In the attribute's unit.
    pub amplitude: f64,
    /// In the domain's time unit.
    pub period: f64,
    /// From 0 to 1; random without it.
    #[serde(default)]
    pub phase: Option<f64>,
}

/// A component that fails at random.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomFailure {
    /// The component.
    pub component: String,
    /// The mean time to a failure.
    pub mean_time: f64,
    /// The time from a failure to the recovery; never without it.
    #[serde(default)]
    pub recovery: Option<f64>,
}

/// How the figures that SUAVE reports are found in this mission.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Suave {
    /// The fact that the pipeline is found, as `when` of an event.
    pub found: String,
    /// The action that inspects it.
    pub inspect: String,
    /// The numeric function that says how long it is.
    pub length: String,
}

impl Simulation {
    /// Settings of a world without disturbances. Observations are reported every `step`, the
    /// mission ends after `time_budget`, and an action that has stalled for `patience` fails.
    pub fn new(step: f64, time_budget: f64, patience: f64) -> Self {
        Self {
            step,
            time_budget,
            patience,
            noise: 0.0,
            lifeline: None,
            events: Vec::new(),
            signals: Vec::new(),
            failures: Vec::new(),
            suave: None,
        }
    }
}
