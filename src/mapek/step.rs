//! Plan steps with rational durations and costs, and their serialisation as JSON and for the journal.

use std::borrow::Cow;

use num_rational::BigRational;
use pddl::ast::Name;
use pddl::validate::{PlanStep, PlanText};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::{Map, Value, json};

use crate::mission::Mission;
use crate::number;

/// A step of a plan: a ground action with the design chosen for each function.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStep {
    /// Name of the action schema.
    pub action: String,
    /// All arguments, including designs, in the order of the schema's parameters.
    pub arguments: Vec<String>,
    /// Number of leading arguments whose parameters the domain file declares. The knowledge base adds parameters for
    /// designs to a plain domain.
    pub written: usize,
    /// Functions with their chosen designs, in the order of the parameters.
    pub configuration: Vec<(String, String)>,
    /// Duration in the domain's time unit.
    pub duration: BigRational,
    /// Contribution to the metric.
    pub cost: BigRational,
}

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
                "action": { "type": "string", "description": "Name of the action." },
                "arguments": {
                    "type": "array",
                    "items": { "type": "string" },
                    "description": "Arguments of the parameters that the domain file declares, in this order."
                },
                "configuration": {
                    "type": "object",
                    "additionalProperties": { "type": "string" },
                    "description": "The design of each function."
                },
                "duration": { "type": "number", "description": "Duration, in the domain's time unit." },
                "cost": { "type": "number", "description": "Contribution to the metric." }
            },
            "required": ["action", "arguments", "configuration", "duration", "cost"]
        })
    }
}

impl PlannedStep {
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

    pub(crate) fn has_same_action(&self, other: &Self) -> bool {
        self.action == other.action
            && self.arguments == other.arguments
            && self.configuration == other.configuration
    }

    /// Returns the action with all arguments in PDDL syntax: `(move a b)`.
    pub fn call(&self) -> String {
        let words: Vec<&str> =
            std::iter::once(&self.action).chain(&self.arguments).map(String::as_str).collect();
        format!("({})", words.join(" "))
    }

    /// Returns a short text in which functions and designs are not repeated as arguments: `move wp1 wp2 (f_localization
    /// = fd_amcl_kinect)`.
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

    /// Returns the arguments, with `None` in place of designs.
    pub fn context(&self) -> Vec<Option<&str>> {
        let is_design = |word: &str| self.configuration.iter().any(|(_, design)| design == word);
        self.arguments.iter().map(|word| (!is_design(word)).then_some(word.as_str())).collect()
    }

    /// Duration in the domain's time unit, rounded to the nearest double.
    pub fn duration_rounded(&self) -> f64 {
        number::to_f64(&self.duration)
    }

    /// Returns the design chosen for `function`, or `None` if the step does not use the function.
    pub fn design(&self, function: &str) -> Option<&str> {
        self.configuration.iter().find(|(name, _)| name == function).map(|(_, design)| design.as_str())
    }

    /// Returns the step with `design` in place of the current design of `function`. A step without this function is
    /// returned unchanged.
    #[must_use]
    pub fn with_design(&self, function: &str, design: &str) -> Self {
        let Some(old) = self.design(function).map(ToOwned::to_owned) else { return self.clone() };
        let mut step = self.clone();
        // A design can serve several functions. If it is an argument for each of them, only the argument for `function`
        // is replaced: these arguments have the order of the functions.
        let served = self.configuration.iter().filter(|(_, design)| *design == old);
        let served: Vec<&str> = served.map(|(name, _)| name.as_str()).collect();
        let places = self.arguments.iter().filter(|word| **word == old).count();
        let words = step.arguments.iter_mut().filter(|word| **word == old);
        for (index, word) in words.enumerate() {
            if places != served.len() || served.get(index) == Some(&function) {
                design.clone_into(word);
            }
        }
        for (_, word) in step.configuration.iter_mut().filter(|(name, _)| name == function) {
            design.clone_into(word);
        }
        step
    }

    pub(crate) fn to_plan_step(&self) -> PlanStep {
        PlanStep {
            action: Name::new(&self.action),
            arguments: self.arguments.iter().map(|argument| Name::new(argument)).collect(),
            start: None,
            // The validator computes the duration in the believed situation, which may differ from the one
            // planned with.
            duration: None,
            line: 0,
        }
    }

    /// Writes all JSON fields except the action's name: arguments (without those that the knowledge base has added),
    /// configuration, duration and cost.
    pub(crate) fn fields<M: SerializeMap>(&self, object: &mut M) -> Result<(), M::Error> {
        let written = self.arguments.get(..self.written).unwrap_or(&self.arguments);
        object.serialize_entry("arguments", written)?;
        object.serialize_entry("configuration", &configuration_to_json(&self.configuration))?;
        object.serialize_entry("duration", &number::to_json(&self.duration))?;
        object.serialize_entry("cost", &number::to_json(&self.cost))
    }

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

pub(super) fn configuration_to_json(configuration: &[(String, String)]) -> Map<String, Value> {
    configuration.iter().map(|(function, design)| (function.clone(), json!(design))).collect()
}

pub(super) fn configuration_from_record(record: &Value) -> Option<Vec<(String, String)>> {
    let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
    let pair = |value: &Value| Some((text(value.get(0)?)?, text(value.get(1)?)?));
    record.as_array()?.iter().map(pair).collect()
}

pub(crate) fn plan_text<'a>(steps: impl IntoIterator<Item = &'a PlannedStep>) -> PlanText {
    PlanText { steps: steps.into_iter().map(PlannedStep::to_plan_step).collect() }
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;

    use super::PlannedStep;

    fn step(arguments: &[&str], configuration: &[(&str, &str)]) -> PlannedStep {
        let pair = |(function, design): &(&str, &str)| ((*function).to_owned(), (*design).to_owned());
        PlannedStep {
            action: "go".to_owned(),
            arguments: arguments.iter().map(|argument| (*argument).to_owned()).collect(),
            written: 1,
            configuration: configuration.iter().map(pair).collect(),
            duration: BigRational::default(),
            cost: BigRational::default(),
        }
    }

    #[test]
    fn a_design_of_two_functions_is_replaced_for_one() {
        let shared = step(&["a", "d", "d"], &[("f", "d"), ("g", "d")]);
        assert_eq!(shared.with_design("f", "e"), step(&["a", "e", "d"], &[("f", "e"), ("g", "d")]));
        assert_eq!(shared.with_design("g", "e"), step(&["a", "d", "e"], &[("f", "d"), ("g", "e")]));
        let once = step(&["a", "d"], &[("f", "d"), ("g", "d")]);
        assert_eq!(once.with_design("g", "e"), step(&["a", "e"], &[("f", "d"), ("g", "e")]));
    }
}
