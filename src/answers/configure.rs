//! JSON answer of `metaplan configure`, and the first output line of `metaplan run --configure`.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::answers::run::RecoveryPart;
use crate::configure::{Choice, Configuration, Considered, Keeper, Verdict};
use crate::journal::Recovery;
use crate::mapek::FORMAT;
use crate::message::Message;
use crate::number::to_json;

const CONFIGURE: &str = "metaplan-configure/1";

/// The chosen design for each function that needs one.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ConfigureAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = CONFIGURE))]
    format: &'static str,
    /// Whether a design was chosen for each function that needs one.
    served: bool,
    /// Whether it is proved that no choice for these objectives is better.
    optimal: bool,
    /// Total utility of the chosen designs.
    #[schemars(with = "f64")]
    utility: Value,
    /// The objectives that need a design, with the choices for them.
    choices: Vec<ChoicePart<'a>>,
    /// Warnings about the files and the choice.
    warnings: &'a [Message],
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ChoicePart<'a> {
    /// The objective.
    objective: &'a str,
    /// Function of the objective; null if the knowledge base does not define it.
    function: Option<&'a str>,
    /// Reasons why the objective needs a design: its statuses, `updatable`, `always improve`, `ungrounded`, or that its
    /// design is not available.
    need: &'a [String],
    /// Previous design, or null.
    before: Option<&'a str>,
    /// Chosen design; null if no design was chosen.
    design: Option<&'a str>,
    /// All designs of the function, in the order of preference.
    considered: Vec<ConsideredPart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct ConsideredPart<'a> {
    /// The design.
    design: &'a str,
    /// Utility of the design; larger is better.
    #[schemars(with = "f64")]
    utility: Value,
    /// Requirements of the objective that the design is estimated to violate.
    missed: &'a [String],
    /// `chosen`, `ruled out`, `less` or `not together`.
    verdict: &'static str,
    /// Reasons why the design is ruled out, or not chosen together with the others.
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

/// The first output line of `run --configure`: the loop is ready.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct KeeperReadyLine {
    /// `ready`.
    answer: &'static str,
    /// Name and version of this format.
    format: &'static str,
    /// The current objectives.
    objectives: Vec<String>,
    #[serde(flatten)]
    recovered: Option<RecoveryPart>,
}

impl KeeperReadyLine {
    /// Creates the first output line of the loop. `recovery` is the state of the loop's journal, if
    /// it has a journal.
    pub fn new(keeper: &Keeper, recovery: Option<&Recovery>) -> Self {
        let objectives = keeper.configurator().objectives().into_iter();
        let recovered = recovery
            .map(|recovery| RecoveryPart::new(keeper.lines(), keeper.sequence(), keeper.missing(), recovery));
        Self {
            answer: "ready",
            format: FORMAT,
            objectives: objectives.map(|objective| objective.individual.name).collect(),
            recovered,
        }
    }
}
