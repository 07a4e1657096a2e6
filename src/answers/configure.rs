//! JSON answer of `metaplan configure`, and the first line of its loop.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::configure::{Choice, Configuration, Considered, Verdict};
use crate::mapek::FORMAT;
use crate::message::Message;
use crate::number::to_json;

const CONFIGURE: &str = "metaplan-configure/1";

/// A design for every function in need.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ConfigureAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = CONFIGURE))]
    format: &'static str,
    /// Whether each function in need has a design.
    served: bool,
    /// Whether it is proved that no choice is better.
    optimal: bool,
    /// What the chosen designs are worth in sum.
    #[schemars(with = "f64")]
    utility: Value,
    /// Each objective in need, with what was chosen for it.
    choices: Vec<ChoicePart<'a>>,
    /// What is questionable about the files.
    warnings: &'a [Message],
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ChoicePart<'a> {
    /// The objective.
    objective: &'a str,
    /// The function that it is of; null where the knowledge base does not say.
    function: Option<&'a str>,
    /// Why it is in need: its statuses, `updatable`, `always improve`, or `ungrounded`.
    need: &'a [String],
    /// The design that it had; null where there is none.
    before: Option<&'a str>,
    /// The design that it gets; null where there is none for it.
    design: Option<&'a str>,
    /// All designs of the function, in the order of preference.
    considered: Vec<ConsideredPart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ConsideredPart<'a> {
    /// The design.
    design: &'a str,
    /// What it is worth; larger is better.
    #[schemars(with = "f64")]
    utility: Value,
    /// Requirements of the objective that it is estimated to miss.
    missed: &'a [String],
    /// `chosen`, `ruled out`, `less` or `not together`.
    verdict: &'static str,
    /// Why it is ruled out, or not chosen together with the others.
    because: Vec<&'a str>,
}

impl<'a> ConfigureAnswer<'a> {
    /// Answer with a configuration and warnings.
    pub fn new(configuration: &'a Configuration, warnings: &'a [Message]) -> Self {
        Self {
            format: CONFIGURE,
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
    /// `ready`.
    answer: &'static str,
    /// Name and version of this format.
    format: &'static str,
    /// The objectives that are there.
    objectives: Vec<String>,
}

impl KeeperReadyLine {
    /// First line of a loop with these objectives.
    pub fn new(objectives: Vec<String>) -> Self {
        Self { answer: "ready", format: FORMAT, objectives }
    }
}
