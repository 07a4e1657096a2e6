//! Events: reports of the managed system, one JSON object per line, in the format `metaplan-events/1`.
//!
//! Objects in the form of `diagnostic_msgs/DiagnosticArray`, as published by the MROS observers \[1\], are accepted,
//! too. Other input is refused (see [`Refusal`]).
//!
//! \[1\] Bozhinoski et al., MROS: Runtime Adaptation For Robot Control Architectures, Advanced Robotics 36, 2022.

use std::collections::{BTreeMap, HashSet};
use std::time::Duration;

use num_rational::BigRational;
use ontology::tomasys::change::Status;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema, schema_for};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

use crate::mapek::fields::{Refusal, doubled_key, fraction, need, numbers, seconds, take, text, word};
use crate::message::did_you_mean;
use crate::number;

/// Version of the format of events and answers.
pub const FORMAT: &str = "metaplan-events/1";

/// Maximum length of a line in bytes. Longer lines are refused.
pub const LONGEST_LINE: usize = 1 << 20;

/// A report of the managed system.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "event")]
#[schemars(deny_unknown_fields)]
#[non_exhaustive]
pub enum Event {
    /// A sensor reports the value of a quality attribute, or of a function of the problem.
    #[serde(rename = "measured")]
    Measured {
        /// Local name or IRI of the attribute, or name of the function.
        attribute: String,
        /// Value, in the attribute's unit.
        #[serde(serialize_with = "as_number")]
        #[schemars(schema_with = "decimal_schema")]
        value: BigRational,
    },
    /// A component reports its status.
    #[serde(rename = "component_status")]
    Component {
        /// Local name or IRI.
        component: String,
        /// Status of the component.
        #[serde(serialize_with = "as_word")]
        #[schemars(schema_with = "status_schema")]
        status: Status,
    },
    /// A requested action has started.
    #[serde(rename = "action_started")]
    Started {
        /// Number of the action.
        action: u64,
    },
    /// A requested action has succeeded.
    #[serde(rename = "action_succeeded")]
    Succeeded {
        /// Number of the action.
        action: u64,
    },
    /// A requested action has ended without success.
    #[serde(rename = "action_failed")]
    Failed {
        /// Number of the action.
        action: u64,
        /// Reason of the failure.
        #[serde(skip_serializing_if = "String::is_empty")]
        #[schemars(default)]
        reason: String,
    },
    /// An action has been ended safely, as requested.
    #[serde(rename = "action_cancelled")]
    Cancelled {
        /// Number of the action.
        action: u64,
    },
    /// Progress of an action.
    #[serde(rename = "action_progress")]
    Progress {
        /// Number of the action.
        action: u64,
        /// Completed part, from 0 to 1. It is rounded to hundredths.
        #[serde(serialize_with = "as_number")]
        #[schemars(schema_with = "fraction_schema")]
        fraction: BigRational,
    },
    /// The goal has changed.
    #[serde(rename = "goal_changed")]
    Goal {
        /// The new goal, a PDDL condition.
        goal: String,
    },
    /// A fact or a value of the problem, as for `--set`.
    #[serde(rename = "fact_changed")]
    Fact {
        /// Name, as in `battery`, `robot_at`, `pipeline_found pl1`.
        name: String,
        /// A number, the last argument, or a truth value.
        #[schemars(schema_with = "word_schema")]
        value: String,
    },
    /// An effect has arrived at the managed system.
    #[serde(rename = "acknowledged")]
    Acknowledged {
        /// Number of the effect.
        effect: u64,
    },
    /// A reconfiguration has failed. The design counts as not realisable until [`Event::Design`] reports that it is.
    #[serde(rename = "reconfiguration_failed")]
    ReconfigurationFailed {
        /// Number of the effect.
        effect: u64,
    },
    /// A function reports whether it can use a design, independently of components and measurements.
    #[serde(rename = "design_status")]
    Design {
        /// Local name or IRI.
        design: String,
        /// Whether the function can use the design.
        realisable: bool,
    },
    /// A function has a design that the loop did not request.
    #[serde(rename = "configuration_observed")]
    Observed {
        /// Local name.
        function: String,
        /// Local name; null if the function has no design.
        #[schemars(schema_with = "name_or_null_schema")]
        design: Option<String>,
    },
    /// A function is required from now on.
    #[serde(rename = "objective_added")]
    ObjectiveAdded {
        /// Name of the objective.
        objective: String,
        /// Local name or IRI of the function.
        function: String,
        /// Bounds by local name or IRI of the attribute type, in the attribute's unit.
        #[serde(serialize_with = "as_numbers", skip_serializing_if = "Vec::is_empty")]
        #[schemars(with = "BTreeMap<String, f64>", default)]
        requirements: Vec<(String, BigRational)>,
        /// Whether to choose a better design also if the objective is not in error.
        #[schemars(default)]
        always_improve: bool,
    },
    /// An objective has ended.
    #[serde(rename = "objective_removed")]
    ObjectiveRemoved {
        /// Name of the objective.
        objective: String,
    },
    /// Time has passed.
    #[serde(rename = "tick")]
    Tick,
    /// A remark for readers of the journal. It changes nothing.
    #[serde(rename = "note")]
    Note {
        /// Text of the remark.
        text: String,
    },
}

fn status_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "anyOf": [
            { "type": "string", "pattern": "^ *([Ff][Aa][Ll][Ss][Ee]|[Ee][Rr][Rr][Oo][Rr]|[Rr][Ee][Cc][Oo][Vv][Ee][Rr][Ee][Dd]|[Tt][Rr][Uu][Ee]|[Oo][Kk]) *$" },
            { "type": "boolean" }
        ]
    })
}

fn decimal_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "anyOf": [
            { "type": "number" },
            { "type": "string", "pattern": "^\\s*[+-]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][+-]?[0-9]{1,2})?\\s*$" }
        ]
    })
}

fn fraction_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "anyOf": [
            { "type": "number", "minimum": 0, "maximum": 1 },
            { "type": "string", "pattern": "^\\s*[+]?(0*[.][0-9]+|0+[.]?|0*1([.]0*)?)\\s*$" }
        ]
    })
}

fn name_or_null_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["string", "null"] })
}

fn word_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["string", "number", "boolean"] })
}

/// JSON Schema of an event, with the optional fields `seq` and `time` of all lines. Diagnostic arrays are not included,
/// because ROS specifies them.
pub fn event_schema() -> Schema {
    let mut schema = schema_for!(Event);
    let kinds = schema.get_mut("oneOf").and_then(Value::as_array_mut);
    for kind in kinds.into_iter().flatten() {
        if let Some(fields) = kind.get_mut("properties").and_then(Value::as_object_mut) {
            fields.insert("seq".to_owned(), json!({ "type": "integer", "minimum": 0 }));
            fields.insert("time".to_owned(), json!({ "type": "number", "minimum": 0 }));
        }
    }
    schema
}

/// Content of one line of input.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Sequence number, if the sender numbers its lines. Lines with a repeated number are ignored.
    pub sequence: Option<u64>,
    /// Time of the observation since the start of the mission, if the line has one.
    pub time: Option<Duration>,
    /// Events of the line. A diagnostic array can contain several.
    pub events: Vec<Result<Event, Refusal>>,
    /// Whether the observation is the passing of time and not an input line. Such an observation is not counted as a
    /// line.
    pub is_timer: bool,
}

impl From<Event> for Observation {
    fn from(event: Event) -> Self {
        Self { sequence: None, time: None, events: vec![Ok(event)], is_timer: false }
    }
}

impl Observation {
    /// Text that represents a [timer](Self::timer) in a journal. Blank lines of input are skipped, so no input line has
    /// this text.
    pub const TIMER: &str = "";

    /// Creates the observation that time has passed, for the time requested by [`Loop::due`](crate::mapek::Loop::due).
    pub fn timer() -> Self {
        Self { is_timer: true, ..Self::from(Event::Tick) }
    }

    /// Parses a line of a journal: a [timer](Self::TIMER), or a line of input.
    pub fn recorded(text: &str) -> Self {
        if text == Self::TIMER { Self::timer() } else { Self::parse(text) }
    }

    /// Parses a line of input. A line that cannot be parsed becomes a [`Refusal`] in `events`.
    pub fn parse(text: &str) -> Self {
        let mut observation = Self { sequence: None, time: None, events: Vec::new(), is_timer: false };
        match observation.read(text) {
            Ok(events) => observation.events = events,
            Err(fault) => observation.events.push(Err(fault)),
        }
        observation
    }

    fn read(&mut self, text: &str) -> Result<Vec<Result<Event, Refusal>>, Refusal> {
        if text.len() > LONGEST_LINE {
            let text = format!(
                "the line is longer than {LONGEST_LINE} bytes, the limit; send several shorter lines"
            );
            return Err(Refusal::new("M301", text));
        }
        let value: Value = serde_json::from_str(text)
            .map_err(|error| Refusal::new("M301", format!("this is not JSON: {error}")))?;
        if let Some(key) = doubled_key(text) {
            return Err(Refusal::new("M302", format!("the field `{key}` is repeated")));
        }
        let Value::Object(mut fields) = value else {
            return Err(Refusal::new("M301", "an event is a JSON object"));
        };
        if fields.contains_key("status") && !fields.contains_key("event") {
            return diagnostics(&fields);
        }
        // Sequence number and time are used even if the other fields are wrong.
        self.sequence = take(&mut fields, "seq", "a whole number", Value::as_u64)?;
        self.time = take(&mut fields, "time", "a number of seconds, not negative", seconds)?;
        event(&mut fields).map(|event| vec![Ok(event)])
    }
}

fn event(fields: &mut Map<String, Value>) -> Result<Event, Refusal> {
    let kind = need(fields, "event", "the kind of the event", text)?;
    let number = "the number of a requested action";
    let event = match kind.as_str() {
        "measured" => Event::Measured {
            attribute: need(fields, "attribute", "the name of an attribute", text)?,
            value: need(fields, "value", number::DECIMAL, number::from_json)?,
        },
        "component_status" => Event::Component {
            component: need(fields, "component", "the name of a component", text)?,
            status: need(fields, "status", STATUSES, |value| status(&word(value)?))?,
        },
        "action_started" => Event::Started { action: need(fields, "action", number, Value::as_u64)? },
        "action_succeeded" => Event::Succeeded { action: need(fields, "action", number, Value::as_u64)? },
        "action_failed" => Event::Failed {
            action: need(fields, "action", number, Value::as_u64)?,
            reason: take(fields, "reason", "a sentence", text)?.unwrap_or_default(),
        },
        "action_cancelled" => Event::Cancelled { action: need(fields, "action", number, Value::as_u64)? },
        "action_progress" => Event::Progress {
            action: need(fields, "action", number, Value::as_u64)?,
            fraction: need(fields, "fraction", "a number from 0 to 1", fraction)?,
        },
        "goal_changed" => Event::Goal { goal: need(fields, "goal", "a PDDL condition", text)? },
        "fact_changed" => Event::Fact {
            name: need(fields, "name", "a function or predicate, with arguments", text)?,
            value: need(fields, "value", "a number, an object or a truth value", word)?,
        },
        "acknowledged" => {
            Event::Acknowledged { effect: need(fields, "effect", "the number of an effect", Value::as_u64)? }
        }
        "reconfiguration_failed" => Event::ReconfigurationFailed {
            effect: need(fields, "effect", "the number of an effect", Value::as_u64)?,
        },
        "note" => Event::Note { text: need(fields, "text", "a sentence", text)? },
        "design_status" => Event::Design {
            design: need(fields, "design", "the name of a function design", text)?,
            realisable: need(fields, "realisable", "true or false", Value::as_bool)?,
        },
        "configuration_observed" => Event::Observed {
            function: need(fields, "function", "the name of a function", text)?,
            design: match fields.remove("design") {
                Some(Value::Null) => None,
                Some(value) => {
                    let wrong =
                        || Refusal::new("M302", format!("`design` is {value}, but should be a name or null"));
                    Some(text(&value).ok_or_else(wrong)?)
                }
                None => {
                    return Err(Refusal::new(
                        "M302",
                        "the field `design` is missing; it should be a name or null",
                    ));
                }
            },
        },
        "objective_added" => Event::ObjectiveAdded {
            objective: need(fields, "objective", "a name", text)?,
            function: need(fields, "function", "the name of a function", text)?,
            requirements: take(
                fields,
                "requirements",
                "an object of attributes and decimal numbers",
                numbers,
            )?
            .unwrap_or_default(),
            always_improve: take(fields, "always_improve", "true or false", Value::as_bool)?
                .unwrap_or_default(),
        },
        "objective_removed" => Event::ObjectiveRemoved {
            objective: need(fields, "objective", "the name of an objective", text)?,
        },
        "tick" => Event::Tick,
        unknown_kind => {
            let suggestion = did_you_mean(unknown_kind, KINDS);
            let text =
                format!("there is no event `{unknown_kind}`; there are: {}{suggestion}", KINDS.join(", "));
            return Err(Refusal::new("M303", text));
        }
    };
    match fields.keys().next() {
        None => Ok(event),
        Some(field) => Err(Refusal::new("M302", format!("`{kind}` has no field `{field}`"))),
    }
}

const KINDS: [&str; 17] = [
    "measured",
    "component_status",
    "action_started",
    "action_succeeded",
    "action_failed",
    "action_cancelled",
    "action_progress",
    "goal_changed",
    "fact_changed",
    "acknowledged",
    "reconfiguration_failed",
    "objective_added",
    "objective_removed",
    "design_status",
    "configuration_observed",
    "tick",
    "note",
];

const STATUSES: &str = "`FALSE` or `ERROR`, `RECOVERED`, `TRUE` or `OK`, or a truth value";

fn status(text: &str) -> Option<Status> {
    match text.to_ascii_uppercase().as_str() {
        "FALSE" | "ERROR" => Some(Status::Failed),
        "RECOVERED" => Some(Status::Recovered),
        "TRUE" | "OK" => Some(Status::Working),
        _ => None,
    }
}

/// Returns the measurements and component statuses of a diagnostic array. Malformed values become refusals in the
/// result. Well-formed values of other statuses, and repetitions of a key within one status, are ignored.
fn diagnostics(fields: &Map<String, Value>) -> Result<Vec<Result<Event, Refusal>>, Refusal> {
    let Some(statuses) = fields.get("status").and_then(Value::as_array) else {
        return Err(Refusal::new("M304", "`status` of a diagnostic array is a list"));
    };
    let mut events = Vec::new();
    for entry in statuses {
        let message = entry.get("message").and_then(Value::as_str).unwrap_or_default();
        let values = entry.get("values").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        // SUAVE's thruster monitor reports each status twice, in the vocabularies of MROS and of PLANTA: the first
        // value of each key counts.
        let mut keys: HashSet<&str> = HashSet::new();
        for pair in values {
            let part = |name: &str| pair.get(name).and_then(Value::as_str).map(str::trim);
            let (Some(key), Some(value)) = (part("key"), part("value")) else {
                events.push(Err(Refusal::new(
                    "M304",
                    "a value of a diagnostic status has a `key` and a `value`",
                )));
                continue;
            };
            if !keys.insert(key) {
                continue;
            }
            match message {
                "QA status" => events.push(measured(key, value)),
                "Component status" => events.push(component(key, value)),
                _ => {}
            }
        }
    }
    Ok(events)
}

fn measured(attribute: &str, value: &str) -> Result<Event, Refusal> {
    let wrong = || {
        let text = format!("the value of {attribute} is `{value}`, but should be {}", number::DECIMAL);
        Refusal::new("M304", text)
    };
    Ok(Event::Measured { attribute: attribute.to_owned(), value: number::exact(value).ok_or_else(wrong)? })
}

fn component(component: &str, value: &str) -> Result<Event, Refusal> {
    let wrong = || {
        Refusal::new(
            "M304",
            format!("the status `{value}` of {component} is not valid; it should be {STATUSES}"),
        )
    };
    Ok(Event::Component { component: component.to_owned(), status: status(value).ok_or_else(wrong)? })
}

fn as_number<S: Serializer>(value: &BigRational, serializer: S) -> Result<S::Ok, S::Error> {
    number::to_json(value).serialize(serializer)
}

fn as_numbers<S: Serializer>(values: &[(String, BigRational)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(values.iter().map(|(name, value)| (name, number::to_json(value))))
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn as_word<S: Serializer>(status: &Status, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(status.word())
}

impl Event {
    /// Converts the event to a JSON object of the format.
    pub fn to_json(&self) -> Value {
        // The serialisation cannot fail: all map keys are strings.
        serde_json::to_value(self).unwrap_or_default()
    }

    pub(crate) fn kind(&self) -> String {
        self.to_json().get("event").and_then(Value::as_str).unwrap_or_default().to_owned()
    }
}

#[derive(Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    event: &'a Event,
    #[serde(skip_serializing_if = "Option::is_none")]
    seq: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
}

impl Observation {
    /// Converts the observation to a JSON object of the format if it consists of one event, and to an empty object
    /// otherwise.
    pub fn to_json(&self) -> Value {
        let [Ok(event)] = self.events.as_slice() else { return Map::new().into() };
        let line = Line { event, seq: self.sequence, time: self.time.map(|time| time.as_secs_f64()) };
        serde_json::to_value(line).unwrap_or_default()
    }
}
