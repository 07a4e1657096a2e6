//! Steps of a plan as the loop keeps them: with exact numbers, and so that they can be written to the journal.

use std::borrow::Cow;

use num_rational::BigRational;
use pddl::ast::Name;
use pddl::validate::{PlanStep, PlanText};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::{Map, Value, json};

use crate::mission::Mission;
use crate::number;

/// An action with its configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStep {
    /// The name of the action schema.
    pub action: String,
    /// All arguments in the order of the schema's parameters, designs among them.
    pub arguments: Vec<String>,
    /// How many of them stand in the domain's file; the knowledge base has added the others to a plain domain.
    pub written: usize,
    /// The function and the design chosen for it, in the order of the parameters.
    pub configuration: Vec<(String, String)>,
    /// How long it takes, in the domain's time unit.
    pub duration: BigRational,
    /// What it adds to the metric.
    pub cost: BigRational,
}

/// The step as an object of the format.
impl Serialize for PlannedStep {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("action", &self.action)?;
        self.fields(&mut object)?;
        object.end()
    }
}

impl JsonSchema for PlannedStep {
    fn schema_name() -> Cow<'static, str> {
        "PlannedStep".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "object",
            "properties": {
                "action": { "type": "string", "description": "The name of the action." },
                "arguments": {
                    "type": "array",
                    "items": { "type": "string" },
                    "description": "All its arguments in the order of the parameters, designs among them."
                },
                "configuration": {
                    "type": "object",
                    "additionalProperties": { "type": "string" },
                    "description": "Function to design."
                },
                "duration": { "type": "number", "description": "How long it takes, in the domain's time unit." },
                "cost": { "type": "number", "description": "What it adds to the metric." }
            },
            "required": ["action", "arguments", "configuration", "duration", "cost"]
        })
    }
}

impl PlannedStep {
    /// A step of a plan for a mission.
    pub(crate) fn new(mission: &Mission, step: &planner::Step) -> Self {
        Self {
            action: step.action.clone(),
            arguments: step.arguments.clone(),
            written: mission.written_arguments(&step.action).unwrap_or(step.arguments.len()),
            configuration: step.configuration.clone(),
            duration: number::of_plan(&step.duration),
            cost: number::of_plan(&step.cost),
        }
    }

    /// The action with all its arguments, as PDDL writes it: `(move a b)`.
    pub fn call(&self) -> String {
        let words: Vec<&str> =
            std::iter::once(&self.action).chain(&self.arguments).map(String::as_str).collect();
        format!("({})", words.join(" "))
    }

    /// `move wp1 wp2 (f_localization = fd_amcl_kinect)`: without functions and designs among the arguments.
    pub fn summary(&self) -> String {
        let configured = |word: &str| self.configuration.iter().any(|(f, d)| f == word || d == word);
        let mut text = self.action.clone();
        for argument in self.arguments.iter().filter(|argument| !configured(argument)) {
            text.push(' ');
            text += argument;
        }
        let pairs: Vec<String> = self.configuration.iter().map(|(f, d)| format!("{f} = {d}")).collect();
        if pairs.is_empty() { text } else { format!("{text} ({})", pairs.join(", ")) }
    }

    /// The arguments without those that say which design fills which function.
    pub fn context(&self) -> Vec<Option<&str>> {
        let is_design = |word: &str| self.configuration.iter().any(|(_, design)| design == word);
        self.arguments.iter().map(|word| (!is_design(word)).then_some(word.as_str())).collect()
    }

    /// How long it takes, in the domain's time unit, as the nearest double.
    pub fn duration_rounded(&self) -> f64 {
        number::to_f64(&self.duration)
    }

    /// The design of a function.
    pub fn design(&self, function: &str) -> Option<&str> {
        self.configuration.iter().find(|(known, _)| known == function).map(|(_, design)| design.as_str())
    }

    /// The same action with another design for a function.
    #[must_use]
    pub fn with_design(&self, function: &str, design: &str) -> Self {
        let Some(old) = self.design(function).map(ToOwned::to_owned) else { return self.clone() };
        let mut step = self.clone();
        for word in step.arguments.iter_mut().filter(|word| **word == old) {
            design.clone_into(word);
        }
        for (_, word) in step.configuration.iter_mut().filter(|(known, _)| known == function) {
            design.clone_into(word);
        }
        step
    }

    /// The step for the validator.
    pub(crate) fn to_plan_step(&self) -> PlanStep {
        PlanStep {
            action: Name::new(&self.action),
            arguments: self.arguments.iter().map(|argument| Name::new(argument)).collect(),
            start: None,
            // What the planner has chosen; where the domain says how long it takes, the validator compares.
            duration: None,
            line: 0,
        }
    }

    /// Writes what stands behind the name of the step as an object of the format.
    pub(crate) fn fields<M: SerializeMap>(&self, object: &mut M) -> Result<(), M::Error> {
        let written = self.arguments.get(..self.written).unwrap_or(&self.arguments);
        object.serialize_entry("arguments", written)?;
        object.serialize_entry("configuration", &configuration_to_json(&self.configuration))?;
        object.serialize_entry("duration", &number::to_json(&self.duration))?;
        object.serialize_entry("cost", &number::to_json(&self.cost))
    }

    /// Everything, for the journal.
    pub(crate) fn to_record(&self) -> Value {
        json!([
            self.action,
            self.arguments,
            self.written,
            self.configuration,
            self.duration.to_string(),
            self.cost.to_string()
        ])
    }

    /// The inverse of [`PlannedStep::to_record`].
    pub(crate) fn from_record(record: &Value) -> Option<Self> {
        let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
        let [action, arguments, written, configuration, duration, cost] = record.as_array()?.as_slice()
        else {
            return None;
        };
        Some(Self {
            action: text(action)?,
            arguments: arguments.as_array()?.iter().map(text).collect::<Option<_>>()?,
            written: written.as_u64()? as usize,
            configuration: configuration_from_record(configuration)?,
            duration: duration.as_str()?.parse().ok()?,
            cost: cost.as_str()?.parse().ok()?,
        })
    }
}

/// Functions with their designs, as an object of the format.
pub(super) fn configuration_to_json(configuration: &[(String, String)]) -> Map<String, Value> {
    configuration.iter().map(|(function, design)| (function.clone(), json!(design))).collect()
}

/// Functions with their designs, from an array of pairs in the journal.
pub(super) fn configuration_from_record(record: &Value) -> Option<Vec<(String, String)>> {
    let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
    let pair = |value: &Value| Some((text(value.get(0)?)?, text(value.get(1)?)?));
    record.as_array()?.iter().map(pair).collect()
}

/// Steps for the validator.
pub(crate) fn plan_text<'a>(steps: impl IntoIterator<Item = &'a PlannedStep>) -> PlanText {
    PlanText { steps: steps.into_iter().map(PlannedStep::to_plan_step).collect() }
}
