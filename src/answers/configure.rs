//! What `metaplan configure` answers, and the first line of its loop.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::configure::{Choice, Configuration, Considered, Verdict};
use crate::mapek::FORMAT;
use crate::message::Message;
use crate::number::to_json;

/// A design for every function in need.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ConfigureAnswer<'a> {
    format: &'static str,
    /// Whether each function in need has a design.
    served: bool,
    /// Whether it is proved that no choice is better.
    optimal: bool,
    #[schemars(with = "f64")]
    utility: Value,
    choices: Vec<ChoicePart<'a>>,
    warnings: &'a [Message],
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ChoicePart<'a> {
    objective: &'a str,
    function: Option<&'a str>,
    need: &'a [String],
    before: Option<&'a str>,
    design: Option<&'a str>,
    considered: Vec<ConsideredPart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ConsideredPart<'a> {
    design: &'a str,
    #[schemars(with = "f64")]
    utility: Value,
    /// Requirements of the objective that it is estimated to miss.
    missed: &'a [String],
    /// `chosen`, `ruled out`, `less` or `not together`.
    verdict: &'static str,
    because: Vec<&'a str>,
}

impl<'a> ConfigureAnswer<'a> {
    /// All of it.
    pub fn new(configuration: &'a Configuration, warnings: &'a [Message]) -> Self {
        Self {
            format: "metaplan-configure/1",
            served: configuration.choices.iter().all(|choice| choice.design.is_some()),
            optimal: configuration.optimal,
            utility: to_json(&configuration.utility),
            choices: configuration.choices.iter().map(ChoicePart::of).collect(),
            warnings,
        }
    }
}

impl<'a> ChoicePart<'a> {
    fn of(choice: &'a Choice) -> Self {
        Self {
            objective: &choice.objective,
            function: choice.function.as_deref(),
            need: &choice.need,
            before: choice.before.as_deref(),
            design: choice.design.as_deref(),
            considered: choice.considered.iter().map(ConsideredPart::of).collect(),
        }
    }
}

impl<'a> ConsideredPart<'a> {
    fn of(considered: &'a Considered) -> Self {
        let (verdict, because) = match &considered.verdict {
            Verdict::Chosen => ("chosen", Vec::new()),
            Verdict::RuledOut(reasons) => ("ruled out", reasons.iter().map(String::as_str).collect()),
            Verdict::Less => ("less", Vec::new()),
            Verdict::Together(reason) => ("not together", vec![reason.as_str()]),
        };
        Self {
            design: &considered.design,
            utility: to_json(&considered.utility),
            missed: &considered.missed,
            verdict,
            because,
        }
    }
}

/// The first line of the loop of `run --configure`.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct KeeperReadyLine {
    answer: &'static str,
    format: &'static str,
    objectives: Vec<String>,
}

impl KeeperReadyLine {
    /// A loop with these objectives.
    pub fn new(objectives: Vec<String>) -> Self {
        Self { answer: "ready", format: FORMAT, objectives }
    }
}
