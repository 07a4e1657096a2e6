//! The section `simulation` of a scenario: the environment of a simulated robot.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

/// Settings of a simulation. Times are in the domain's time unit (`planning.time_unit`).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Simulation {
    /// Time between two reports. All times of the section are in the domain's time unit.
    pub step: f64,
    /// Time after which the mission is aborted.
    pub time_budget: f64,
    /// Time that an action waits before it fails, if it cannot continue.
    pub patience: f64,
    /// Maximum relative deviation of action durations.
    #[serde(default)]
    pub noise: f64,
    /// Numeric function, such as `battery`, that ends the mission when it reaches 0.
    #[serde(default)]
    pub lifeline: Option<String>,
    /// Events that occur once.
    #[serde(default)]
    pub events: Vec<Disturbance>,
    /// Attributes that oscillate.
    #[serde(default)]
    pub signals: Vec<Signal>,
    /// Components that fail at random.
    #[serde(default)]
    pub failures: Vec<RandomFailure>,
    /// Symbols for the figures of SUAVE.
    #[serde(default)]
    pub suave: Option<Suave>,
}

/// An event that occurs once: at a time, or when a condition first holds.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// Time of the event; an event has either `at` or `when`.
    #[serde(default)]
    pub at: Option<f64>,
    /// Condition of the event: a fact as `predicate arguments` or `(predicate arguments)`, or any PDDL
    /// condition, such as `(< (battery) 20)`.
    #[serde(default)]
    pub when: Option<String>,
    /// Maximum random delay after the time or condition.
    #[serde(default)]
    pub within: f64,
    /// Components that fail.
    #[serde(default)]
    pub fail: Vec<String>,
    /// Components that recover.
    #[serde(default)]
    pub recover: Vec<String>,
    /// Values by name, as for `--set`.
    #[serde(default)]
    pub set: BTreeMap<String, String>,
}

/// An attribute that oscillates: `mean + amplitude * sin(2 * pi * (time / period + phase))`, rounded to two decimals.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Signal {
    /// The attribute.
    pub attribute: String,
    /// Mean value, in the attribute's unit.
    pub mean: f64,
    /// Amplitude, in the attribute's unit.
    pub amplitude: f64,
    /// Period, in the domain's time unit.
    pub period: f64,
    /// Phase, from 0 to 1; random by default.
    #[serde(default)]
    pub phase: Option<f64>,
}

/// A component that fails at random.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomFailure {
    /// The component.
    pub component: String,
    /// Mean time to a failure.
    pub mean_time: f64,
    /// Time from a failure to the recovery; by default the component does not recover.
    #[serde(default)]
    pub recovery: Option<f64>,
}

/// Symbols of the mission from which the figures of SUAVE are computed.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Suave {
    /// Fact that holds once the pipeline is found, in the form of `when` of an event.
    pub found: String,
    /// Action that inspects the pipeline.
    pub inspect: String,
    /// Numeric function with the length of the pipeline.
    pub length: String,
}

impl Simulation {
    /// Settings of a world without disturbances. Observations are reported at least every `step`, the
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
