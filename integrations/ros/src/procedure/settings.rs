//! Settings of procedures: the tables `[functions.F.designs.D]` of `ros.toml`.
//!
//! Every value of these types is executable: forms that contradict each other are rejected while the
//! file is read, at their line and column.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use ros2_client::ParameterValue;
use serde::{Deserialize, Deserializer};
use serde_yaml_ng::Value;

use crate::node::{PrimaryState, parameter_value, valid_name};
use crate::types::{Expectation, Library, MessageType, ServiceCall, TopicMessage};
use crate::validated::validated;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Procedure {
    /// Steps in the order of their execution; at least one.
    pub(crate) steps: Vec<Step>,
    /// Conditions that must hold after the last step, in addition to the results of the steps.
    pub(crate) conditions: Vec<Condition>,
    /// Time for all steps and conditions. `None` selects the timeout of the caller: the parameter
    /// `call_timeout` of the manager, or the fixed timeout of the reasoner.
    pub(crate) timeout: Option<Duration>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Step {
    pub(crate) operation: Operation,
    /// Operation that undoes the step if the procedure fails or is replaced after the step may have had an
    /// effect. State transitions and parameters need none, and a message needs one only if there was no
    /// earlier message.
    pub(crate) undo: Option<Operation>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Operation {
    /// Transitions of a lifecycle node until it has a state.
    State {
        node: String,
        state: PrimaryState,
    },
    /// Parameters of a node, set atomically.
    Parameters {
        node: String,
        values: Vec<(String, ParameterValue)>,
    },
    Service {
        service: String,
        call: ServiceCall,
    },
    /// A message on a topic, which late subscribers receive too.
    Publish {
        message: TopicMessage,
        /// Number of subscribers that must exist before the message is published.
        subscribers: usize,
    },
    /// A program with its arguments; no shell is involved.
    Command(Vec<String>),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Condition {
    State {
        node: String,
        state: PrimaryState,
    },
    Parameters {
        node: String,
        values: Vec<(String, ParameterValue)>,
    },
    /// A message arrives on a topic.
    Topic(String),
    /// The last message on a topic is this one.
    Published(TopicMessage),
    /// The last message on a topic has expected values.
    Message {
        topic: String,
        kind: Arc<MessageType>,
        expectation: Expectation,
    },
}

/// Maximum timeout. A time too far ahead cannot be represented as an instant.
const MAX_TIMEOUT: Duration = Duration::from_secs(86_400);

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ProcedureEntry {
    steps: Vec<Step>,
    #[serde(default)]
    verify: Vec<Condition>,
    timeout: Option<f64>,
}

impl<'de> Deserialize<'de> for Procedure {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        validated::<ProcedureEntry, _, _>(deserializer)
    }
}

impl TryFrom<ProcedureEntry> for Procedure {
    type Error = &'static str;

    fn try_from(entry: ProcedureEntry) -> Result<Self, Self::Error> {
        if entry.steps.is_empty() {
            return Err("`steps` is empty: name at least one step that puts the design into effect");
        }
        let timeout = entry.timeout.map(positive_seconds).transpose()?;
        Ok(Self { steps: entry.steps, conditions: entry.verify, timeout })
    }
}

fn positive_seconds(seconds: f64) -> Result<Duration, &'static str> {
    let is_valid = |duration: &Duration| !duration.is_zero() && *duration <= MAX_TIMEOUT;
    let duration = Duration::try_from_secs_f64(seconds).ok().filter(is_valid);
    duration.ok_or("`timeout` must be a number of seconds greater than 0 and at most 86400 (a day)")
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StepEntry {
    node: Option<String>,
    state: Option<PrimaryState>,
    parameters: Option<BTreeMap<String, Value>>,
    service: Option<String>,
    publish: Option<String>,
    r#type: Option<String>,
    data: Option<bool>,
    request: Option<serde_json::Value>,
    expect: Option<serde_json::Value>,
    message: Option<serde_json::Value>,
    subscribers: Option<usize>,
    command: Option<Vec<String>>,
    undo: Option<UndoEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct UndoEntry {
    service: Option<String>,
    publish: Option<String>,
    r#type: Option<String>,
    data: Option<bool>,
    request: Option<serde_json::Value>,
    expect: Option<serde_json::Value>,
    message: Option<serde_json::Value>,
    command: Option<Vec<String>>,
}

/// Keys of an operation that is not about a node.
struct OperationEntry {
    service: Option<String>,
    publish: Option<String>,
    kind: Option<String>,
    data: Option<bool>,
    request: Option<serde_json::Value>,
    expect: Option<serde_json::Value>,
    message: Option<serde_json::Value>,
    subscribers: Option<usize>,
    command: Option<Vec<String>>,
}

impl<'de> Deserialize<'de> for Step {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        validated::<StepEntry, _, _>(deserializer)
    }
}

impl TryFrom<StepEntry> for Step {
    type Error = String;

    fn try_from(entry: StepEntry) -> Result<Self, Self::Error> {
        let StepEntry { node, state, parameters, service, publish, r#type, command, undo, .. } = entry;
        let StepEntry { data, request, expect, message, subscribers, .. } = entry;
        let kind = r#type;
        let operation =
            OperationEntry { service, publish, kind, data, request, expect, message, subscribers, command };
        let Some(node) = node else {
            if state.is_some() || parameters.is_some() {
                return Err("`state` and `parameters` belong to a `node`".to_owned());
            }
            let undo = undo.map(OperationEntry::from).map(OperationEntry::operation).transpose();
            let undo = undo.map_err(|because| format!("`undo`: {because}"))?;
            return Ok(Self { operation: operation.operation()?, undo });
        };
        if undo.is_some() {
            return Err(
                "`undo` belongs to a `service`, `publish` or `command`: states and parameters of a node \
                        are restored by themselves"
                    .to_owned(),
            );
        }
        if operation.has_a_key() {
            return Err(format!("{FORMS}. With a `node`, only `state` or `parameters` are possible"));
        }
        let operation = match node_target(&node, state, parameters)? {
            Target::State(node, state) => Operation::State { node, state },
            Target::Parameters(node, values) => Operation::Parameters { node, values },
        };
        Ok(Self { operation, undo: None })
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ConditionEntry {
    node: Option<String>,
    state: Option<PrimaryState>,
    parameters: Option<BTreeMap<String, Value>>,
    topic: Option<String>,
    r#type: Option<String>,
    expect: Option<serde_json::Value>,
}

impl<'de> Deserialize<'de> for Condition {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        validated::<ConditionEntry, _, _>(deserializer)
    }
}

impl TryFrom<ConditionEntry> for Condition {
    type Error = String;

    fn try_from(entry: ConditionEntry) -> Result<Self, Self::Error> {
        let ConditionEntry { node, state, parameters, topic, r#type, expect } = entry;
        match (node, topic) {
            (Some(node), None) if r#type.is_none() && expect.is_none() => Ok(match node_target(&node, state, parameters)? {
                Target::State(node, state) => Self::State { node, state },
                Target::Parameters(node, values) => Self::Parameters { node, values },
            }),
            (None, Some(topic)) if state.is_none() && parameters.is_none() => {
                let topic = valid_name("topic", &topic)?;
                match (r#type, expect) {
                    (None, None) => Ok(Self::Topic(topic)),
                    (Some(kind), Some(expected)) => {
                        let kind = Arc::new(Library::current().message(&kind)?);
                        let expectation = Expectation::new(&kind.structure, &expected);
                        let expectation = expectation.map_err(|because| format!("`expect`: {because}"))?;
                        Ok(Self::Message { topic, kind, expectation })
                    }
                    _ => Err("`type` and `expect` of a `topic` belong together".to_owned()),
                }
            }
            _ => {
                Err("a condition needs either a `node` (with `state` or `parameters`) or a `topic` (with `type` and `expect`, or alone)"
                    .to_owned())
            }
        }
    }
}

enum Target {
    State(String, PrimaryState),
    Parameters(String, Vec<(String, ParameterValue)>),
}

fn node_target(
    node: &str,
    state: Option<PrimaryState>,
    parameters: Option<BTreeMap<String, Value>>,
) -> Result<Target, String> {
    let node = valid_name("node", node)?;
    match (state, parameters) {
        (Some(state), None) => Ok(Target::State(node, state)),
        (None, Some(parameters)) if parameters.is_empty() => {
            Err("`parameters` is empty: name at least one parameter with its value".to_owned())
        }
        (None, Some(parameters)) => {
            let value = |(name, value): (String, Value)| match parameter_value(&value) {
                Some(value) => Ok((name, value)),
                None => Err(format!(
                    "the parameter `{name}` has a value that no parameter can have: give a truth value, a number, \
                     a text, or a list of values of one of these types"
                )),
            };
            Ok(Target::Parameters(node, parameters.into_iter().map(value).collect::<Result<_, _>>()?))
        }
        _ => Err(format!("give either a `state` or `parameters` for the node {node}")),
    }
}

const FORMS: &str = "a step needs exactly one of `node`, `service`, `publish` and `command`";

impl From<UndoEntry> for OperationEntry {
    fn from(undo: UndoEntry) -> Self {
        let UndoEntry { service, publish, r#type, data, request, expect, message, command } = undo;
        Self { service, publish, kind: r#type, data, request, expect, message, subscribers: None, command }
    }
}

impl OperationEntry {
    fn has_a_key(&self) -> bool {
        self.service.is_some()
            || self.publish.is_some()
            || self.command.is_some()
            || self.kind.is_some()
            || self.has_service_keys()
            || self.has_publish_keys()
    }

    fn has_service_keys(&self) -> bool {
        self.data.is_some() || self.request.is_some() || self.expect.is_some()
    }

    fn has_publish_keys(&self) -> bool {
        self.message.is_some() || self.subscribers.is_some()
    }

    fn operation(self) -> Result<Operation, String> {
        if self.service.is_none() && self.has_service_keys() {
            return Err("`data`, `request` and `expect` belong to a `service`".to_owned());
        }
        if self.publish.is_none() && self.has_publish_keys() {
            return Err("`message` and `subscribers` belong to `publish`".to_owned());
        }
        match (self.service, self.publish, self.command) {
            (Some(service), None, None) => {
                let service = valid_name("service", &service)?;
                let kind = self.kind.ok_or_else(|| {
                    format!("the service {service} needs its `type`, such as std_srvs/srv/Trigger")
                })?;
                let request = match (self.data, self.request) {
                    (Some(_), Some(_)) => {
                        return Err("`data` is a short form of `request`: give one of them".to_owned());
                    }
                    (Some(data), None) => Some(serde_json::json!({"data": data})),
                    (None, None) if kind == "std_srvs/srv/SetBool" => {
                        return Err(
                            "the type std_srvs/srv/SetBool needs `data`, which is true or false".to_owned()
                        );
                    }
                    (None, request) => request,
                };
                let call = ServiceCall::new(&kind, request.as_ref(), self.expect.as_ref())?;
                Ok(Operation::Service { service, call })
            }
            (None, Some(topic), None) => {
                let topic = valid_name("topic", &topic)?;
                let kind = self.kind.ok_or_else(|| {
                    format!("the message on {topic} needs its `type`, such as std_msgs/msg/String")
                })?;
                let message = TopicMessage::new(topic, &kind, self.message.as_ref())?;
                Ok(Operation::Publish { message, subscribers: self.subscribers.unwrap_or(0) })
            }
            (None, None, Some(_)) if self.kind.is_some() => {
                Err("`type` belongs to a `service` or `publish`".to_owned())
            }
            (None, None, Some(command)) => match command.first() {
                Some(program) if !program.is_empty() => Ok(Operation::Command(command)),
                _ => Err("`command` is empty: name a program and its arguments".to_owned()),
            },
            _ => Err(FORMS.to_owned()),
        }
    }
}

impl Operation {
    /// Returns the condition that the operation establishes. Returns `None` if its effect cannot be observed later.
    pub(crate) fn condition(&self) -> Option<Condition> {
        match self {
            Self::State { node, state } => Some(Condition::State { node: node.clone(), state: *state }),
            Self::Parameters { node, values } => {
                Some(Condition::Parameters { node: node.clone(), values: values.clone() })
            }
            Self::Publish { message, .. } => Some(Condition::Published(message.clone())),
            Self::Service { .. } | Self::Command(_) => None,
        }
    }
}

impl Procedure {
    /// Returns all conditions that hold while the design is in effect and that can be observed at
    /// any time. If several steps concern one node, topic or parameter, only the last state,
    /// message or value counts.
    pub(crate) fn lasting(&self) -> Vec<Condition> {
        let steps = self.steps.iter().filter_map(|step| step.operation.condition());
        let conditions = self.conditions.iter().filter(|condition| !matches!(condition, Condition::Topic(_)));
        let mut lasting: Vec<Condition> = Vec::new();
        for condition in steps.chain(conditions.cloned()) {
            if let Condition::State { node, .. } = &condition {
                lasting.retain(
                    |earlier| !matches!(earlier, Condition::State { node: other, .. } if other == node),
                );
            }
            if let Condition::Published(TopicMessage { topic, .. }) = &condition {
                lasting.retain(
                    |earlier| !matches!(earlier, Condition::Published(other) if other.topic == *topic),
                );
            }
            if let Condition::Parameters { node, values } = &condition {
                for earlier in &mut lasting {
                    if let Condition::Parameters { node: other, values: overwritten } = earlier
                        && other == node
                    {
                        overwritten.retain(|(name, _)| values.iter().all(|(later, _)| later != name));
                    }
                }
            }
            lasting.push(condition);
        }
        lasting.retain(
            |condition| !matches!(condition, Condition::Parameters { values, .. } if values.is_empty()),
        );
        lasting
    }

    pub(crate) fn operations(&self) -> impl Iterator<Item = &Operation> {
        self.steps.iter().flat_map(|step| std::iter::once(&step.operation).chain(&step.undo))
    }

    pub(crate) fn has_command(&self) -> bool {
        self.operations().any(|operation| matches!(operation, Operation::Command(_)))
    }
}

impl fmt::Display for Operation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::State { node, state } => write!(formatter, "{node} {state}"),
            Self::Parameters { node, values } => write!(formatter, "{node} {}", names(values)),
            Self::Service { service, .. } => formatter.write_str(service),
            Self::Publish { message, .. } => write!(formatter, "a message to {}", message.topic),
            Self::Command(words) => formatter.write_str(&words.join(" ")),
        }
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::State { node, state } => write!(formatter, "{node} {state}"),
            Self::Parameters { node, values } => write!(formatter, "{node} {}", names(values)),
            Self::Topic(topic) => write!(formatter, "a message on {topic}"),
            Self::Published(TopicMessage { topic, .. }) => {
                write!(formatter, "the published message as the last one on {topic}")
            }
            Self::Message { topic, .. } => write!(formatter, "the expected values on {topic}"),
        }
    }
}

fn names(values: &[(String, ParameterValue)]) -> String {
    values.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use ros2_client::ParameterValue;

    use super::{Condition, Operation, Procedure};
    use crate::node::PrimaryState;
    use crate::types::ServiceCall;

    fn read(text: &str) -> Result<Procedure, String> {
        toml::from_str(text).map_err(|error| error.message().to_owned())
    }

    #[test]
    fn steps_of_nodes_services_and_commands_are_read() {
        let procedure = read(
            r#"timeout = 2.5
            steps = [
                { node = "/camera", state = "inactive" },
                { node = "/server", parameters = { "a.b" = 1.5, c = [1, 2], d = "x", e = true } },
                { service = "/lamp", type = "std_srvs/srv/SetBool", data = false, undo = { command = ["lamp", "on"] } },
                { service = "reset", type = "std_srvs/srv/Trigger" },
                { command = ["systemctl", "start", "lidar"] },
            ]
            verify = [{ topic = "/scan" }, { node = "/map", state = "active" }]"#,
        )
        .expect("a procedure");
        assert_eq!(procedure.timeout, Some(Duration::from_millis(2500)));
        assert_eq!(procedure.steps.len(), 5);
        let values = vec![
            ("a.b".to_owned(), ParameterValue::Double(1.5)),
            ("c".to_owned(), ParameterValue::IntegerArray(vec![1, 2])),
            ("d".to_owned(), ParameterValue::String("x".to_owned())),
            ("e".to_owned(), ParameterValue::Boolean(true)),
        ];
        assert_eq!(
            procedure.steps[1].operation,
            Operation::Parameters { node: "/server".to_owned(), values }
        );
        let data = serde_json::json!({"data": false});
        let call = ServiceCall::new("std_srvs/srv/SetBool", Some(&data), None).expect("a call");
        assert_eq!(procedure.steps[2].operation, Operation::Service { service: "/lamp".to_owned(), call });
        assert!(matches!(&procedure.steps[2].undo, Some(Operation::Command(words)) if words.len() == 2));
        assert!(procedure.has_command());
        assert_eq!(procedure.conditions[0], Condition::Topic("/scan".to_owned()));
    }

    #[test]
    fn the_last_state_and_the_last_value_hold_afterwards() {
        let procedure = read(
            r#"steps = [
                { node = "/a", state = "inactive" },
                { node = "/a", parameters = { p = 1, q = 1 } },
                { node = "/a", parameters = { p = 2 } },
                { node = "/a", state = "active" },
            ]
            verify = [{ topic = "/t" }]"#,
        )
        .expect("a procedure");
        let node = || "/a".to_owned();
        let parameter = |name: &str, value| Condition::Parameters {
            node: node(),
            values: vec![(name.to_owned(), ParameterValue::Integer(value))],
        };
        let state = Condition::State { node: node(), state: PrimaryState::Active };
        assert_eq!(procedure.lasting(), [parameter("q", 1), parameter("p", 2), state]);
    }

    #[test]
    fn contradictory_steps_are_rejected() {
        for (steps, part) in [
            ("[]", "at least one step"),
            ("[{}]", "exactly one of"),
            (r#"[{ node = "/a" }]"#, "either a `state` or `parameters`"),
            (r#"[{ node = "/a", state = "on" }]"#, "unknown variant"),
            (r#"[{ node = "/a", state = "active", service = "/b" }]"#, "exactly one of"),
            (r#"[{ node = "/1", state = "active" }]"#, "not a valid name of a node"),
            (r#"[{ node = "/a", parameters = {} }]"#, "`parameters` is empty"),
            (r#"[{ node = "/a", parameters = { p = [1, "x"] } }]"#, "the parameter `p`"),
            (r#"[{ node = "/a", parameters = { p = { q = 1 } } }]"#, "the parameter `p`"),
            (r#"[{ node = "/a", state = "active", undo = { command = ["x"] } }]"#, "restored by themselves"),
            (r#"[{ service = "/a" }]"#, "needs its `type`"),
            (r#"[{ service = "/a", type = "std_srvs/srv/SetBool" }]"#, "needs `data`"),
            (
                r#"[{ service = "/a", type = "std_srvs/srv/Trigger", data = true }]"#,
                "has no fields: remove `data`",
            ),
            (r#"[{ service = "/a", type = "nav2_msgs/srv/LoadMap" }]"#, "is not known"),
            (
                r#"[{ service = "/a", type = "std_srvs/srv/SetBool", data = true, request = { data = true } }]"#,
                "give one of them",
            ),
            (
                r#"[{ service = "/a", type = "std_srvs/srv/SetBool", request = { date = true } }]"#,
                "did you mean `data`?",
            ),
            (
                r#"[{ service = "/a", type = "std_srvs/srv/Trigger", expect = { success = 1 } }]"#,
                "`expect`: `success`: 1 is neither true nor false",
            ),
            (r#"[{ service = "/a", type = "std_srvs/srv/Trigger", message = {} }]"#, "belong to `publish`"),
            (r#"[{ publish = "/a" }]"#, "needs its `type`"),
            (r#"[{ publish = "/a", type = "std_srvs/srv/Trigger" }]"#, "package/msg/Name"),
            (
                r#"[{ publish = "/a", type = "std_msgs/msg/String", message = { data = 1 } }]"#,
                "is not a text",
            ),
            (r#"[{ publish = "/a", type = "std_msgs/msg/String", data = true }]"#, "belong to a `service`"),
            (r#"[{ publish = "/a", service = "/b" }]"#, "exactly one of"),
            (r#"[{ node = "/a", state = "active", type = "x" }]"#, "With a `node`"),
            (r#"[{ command = ["a"], type = "x" }]"#, "`type` belongs"),
            (r"[{ command = [] }]", "`command` is empty"),
            (r#"[{ command = ["a"], undo = {} }]"#, "`undo`: a step needs exactly one of"),
            (r#"[{ comand = ["a"] }]"#, "unknown field `comand`"),
        ] {
            let message = read(&format!("steps = {steps}")).expect_err(steps);
            assert!(message.contains(part), "{steps}: {message}");
        }
        for (rest, part) in [
            ("timeout = 0", "greater than 0"),
            ("timeout = nan", "greater than 0"),
            ("timeout = 1e19", "at most 86400"),
            (r#"verify = [{ topic = "/a", state = "active" }]"#, "either a `node`"),
            (r#"verify = [{ topic = "a b" }]"#, "not a valid name of a topic"),
            (r#"verify = [{ topic = "/a", type = "std_msgs/msg/Bool" }]"#, "belong together"),
            (
                r#"verify = [{ topic = "/a", type = "std_msgs/msg/Bool", expect = { date = true } }]"#,
                "did you mean `data`?",
            ),
        ] {
            let text = format!("steps = [{{ command = [\"a\"] }}]\n{rest}");
            let message = read(&text).expect_err(rest);
            assert!(message.contains(part), "{rest}: {message}");
        }
    }
}
