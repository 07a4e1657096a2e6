//! Settings of procedures: the tables `[functions.F.designs.D]` of `ros.toml`.
//!
//! Every value of these types is executable: forms that contradict each other are rejected while the
//! file is read, at their line and column.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

use ros2_client::ParameterValue;
use serde::{Deserialize, Deserializer};
use serde_yaml_ng::Value;

use crate::node::{PrimaryState, parameter_value, valid_name};
use crate::validated::validated;

/// Ordered steps that put a design into effect, and the conditions that must hold afterwards.
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

/// A step, with the operation that undoes it if its results cannot be undone by themselves.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Step {
    pub(crate) operation: Operation,
    /// Operation that is executed if a later step fails. State transitions and parameters need none.
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
    /// A program with its arguments; no shell is involved.
    Command(Vec<String>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ServiceCall {
    Empty,
    Trigger,
    SetBool(bool),
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
}

/// A table `[functions.F.designs.D]`.
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
    let duration = Duration::try_from_secs_f64(seconds).ok().filter(|duration| !duration.is_zero());
    duration.ok_or("`timeout` must be a number of seconds greater than 0")
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StepEntry {
    node: Option<String>,
    state: Option<PrimaryState>,
    parameters: Option<BTreeMap<String, Value>>,
    service: Option<String>,
    r#type: Option<String>,
    data: Option<bool>,
    command: Option<Vec<String>>,
    undo: Option<UndoEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct UndoEntry {
    service: Option<String>,
    r#type: Option<String>,
    data: Option<bool>,
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
        let StepEntry { node, state, parameters, service, r#type, data, command, undo } = entry;
        let operation = match (node, service, command) {
            (Some(node), None, None) => {
                if r#type.is_some() || data.is_some() {
                    return Err("`type` and `data` belong to a `service`".to_owned());
                }
                if undo.is_some() {
                    return Err(
                        "`undo` belongs to a `service` or a `command`: states and parameters of a node \
                                are restored by themselves"
                            .to_owned(),
                    );
                }
                match node_target(&node, state, parameters)? {
                    Target::State(node, state) => Operation::State { node, state },
                    Target::Parameters(node, values) => Operation::Parameters { node, values },
                }
            }
            (None, service, command) if service.is_some() != command.is_some() => {
                if state.is_some() || parameters.is_some() {
                    return Err("`state` and `parameters` belong to a `node`".to_owned());
                }
                service_or_command(service, r#type.as_deref(), data, command)?
            }
            _ => {
                return Err("a step needs exactly one of `node` (with `state` or `parameters`), `service` \
                            (with `type`) and `command`"
                    .to_owned());
            }
        };
        let undo = undo.map(|undo| {
            let UndoEntry { service, r#type, data, command } = undo;
            if service.is_some() == command.is_some() {
                return Err("`undo` needs either a `service` (with `type`) or a `command`".to_owned());
            }
            service_or_command(service, r#type.as_deref(), data, command)
        });
        Ok(Self { operation, undo: undo.transpose()? })
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ConditionEntry {
    node: Option<String>,
    state: Option<PrimaryState>,
    parameters: Option<BTreeMap<String, Value>>,
    topic: Option<String>,
}

impl<'de> Deserialize<'de> for Condition {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        validated::<ConditionEntry, _, _>(deserializer)
    }
}

impl TryFrom<ConditionEntry> for Condition {
    type Error = String;

    fn try_from(entry: ConditionEntry) -> Result<Self, Self::Error> {
        let ConditionEntry { node, state, parameters, topic } = entry;
        match (node, topic) {
            (Some(node), None) => Ok(match node_target(&node, state, parameters)? {
                Target::State(node, state) => Self::State { node, state },
                Target::Parameters(node, values) => Self::Parameters { node, values },
            }),
            (None, Some(topic)) if state.is_none() && parameters.is_none() => {
                Ok(Self::Topic(valid_name("topic", &topic)?))
            }
            _ => {
                Err("a condition needs either a `node` (with `state` or `parameters`) or a `topic`"
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

fn service_or_command(
    service: Option<String>,
    kind: Option<&str>,
    data: Option<bool>,
    command: Option<Vec<String>>,
) -> Result<Operation, String> {
    let Some(service) = service else {
        if kind.is_some() || data.is_some() {
            return Err("`type` and `data` belong to a `service`".to_owned());
        }
        let command = command.unwrap_or_default();
        return match command.first() {
            Some(program) if !program.is_empty() => Ok(Operation::Command(command)),
            _ => Err("`command` is empty: name a program and its arguments".to_owned()),
        };
    };
    let service = valid_name("service", &service)?;
    let call = match (kind, data) {
        (Some("std_srvs/srv/Empty"), None) => ServiceCall::Empty,
        (Some("std_srvs/srv/Trigger"), None) => ServiceCall::Trigger,
        (Some("std_srvs/srv/SetBool"), Some(data)) => ServiceCall::SetBool(data),
        (Some("std_srvs/srv/SetBool"), None) => {
            return Err("the type std_srvs/srv/SetBool needs `data`, which is true or false".to_owned());
        }
        (Some("std_srvs/srv/Empty" | "std_srvs/srv/Trigger"), Some(_)) => {
            return Err("only the type std_srvs/srv/SetBool has `data`".to_owned());
        }
        (Some(other), _) => {
            return Err(format!(
                "services of the type `{other}` cannot be called; std_srvs/srv/Trigger, std_srvs/srv/SetBool and \
                 std_srvs/srv/Empty can"
            ));
        }
        (None, _) => {
            return Err(format!("the service {service} needs its `type`, such as std_srvs/srv/Trigger"));
        }
    };
    Ok(Operation::Service { service, call })
}

impl Operation {
    /// Returns the condition that an operation must have established, if one can be observed later.
    pub(crate) fn condition(&self) -> Option<Condition> {
        match self {
            Self::State { node, state } => Some(Condition::State { node: node.clone(), state: *state }),
            Self::Parameters { node, values } => {
                Some(Condition::Parameters { node: node.clone(), values: values.clone() })
            }
            Self::Service { .. } | Self::Command(_) => None,
        }
    }
}

impl Procedure {
    /// Returns all conditions that hold while the design is in effect and that can be observed at any time. A
    /// node that occurs in several steps has only its last state.
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

    /// Returns all operations, including those that undo steps.
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
            Self::Service { service, call: ServiceCall::SetBool(data) } => {
                write!(formatter, "{service} {data}")
            }
            Self::Service { service, .. } => formatter.write_str(service),
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

    use super::{Condition, Operation, Procedure, ServiceCall};
    use crate::node::PrimaryState;

    fn read(text: &str) -> Result<Procedure, String> {
        toml::from_str(text).map_err(|error| error.message().to_owned())
    }

    #[test]
    fn all_kinds_of_steps_are_read() {
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
        let call = ServiceCall::SetBool(false);
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
            (r#"[{ node = "/1", state = "active" }]"#, "not the name of a node"),
            (r#"[{ node = "/a", parameters = {} }]"#, "`parameters` is empty"),
            (r#"[{ node = "/a", parameters = { p = [1, "x"] } }]"#, "the parameter `p`"),
            (r#"[{ node = "/a", parameters = { p = { q = 1 } } }]"#, "the parameter `p`"),
            (r#"[{ node = "/a", state = "active", undo = { command = ["x"] } }]"#, "restored by themselves"),
            (r#"[{ service = "/a" }]"#, "needs its `type`"),
            (r#"[{ service = "/a", type = "std_srvs/srv/SetBool" }]"#, "needs `data`"),
            (r#"[{ service = "/a", type = "std_srvs/srv/Trigger", data = true }]"#, "has `data`"),
            (r#"[{ service = "/a", type = "nav2_msgs/srv/LoadMap" }]"#, "cannot be called"),
            (r"[{ command = [] }]", "`command` is empty"),
            (r#"[{ command = ["a"], undo = {} }]"#, "`undo` needs either"),
            (r#"[{ comand = ["a"] }]"#, "unknown field `comand`"),
        ] {
            let message = read(&format!("steps = {steps}")).expect_err(steps);
            assert!(message.contains(part), "{steps}: {message}");
        }
        for (rest, part) in [
            ("timeout = 0", "greater than 0"),
            ("timeout = nan", "greater than 0"),
            (r#"verify = [{ topic = "/a", state = "active" }]"#, "either a `node`"),
            (r#"verify = [{ topic = "a b" }]"#, "not the name of a topic"),
        ] {
            let text = format!("steps = [{{ command = [\"a\"] }}]\n{rest}");
            let message = read(&text).expect_err(rest);
            assert!(message.contains(part), "{rest}: {message}");
        }
    }
}
