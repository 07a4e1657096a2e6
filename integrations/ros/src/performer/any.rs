//! Performers that execute an action of a plan by a goal for an action server, or by a call of a service, of any
//! type. The settings contain the type, the fields and the expected answer.

use std::num::NonZeroUsize;
use std::sync::Arc;

use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};

use crate::interfaces::geometry_msgs::msg::PoseStamped;
use crate::node::{ActionCaller, Caller, Node, valid_name};
use crate::perform::{Call, End, Perform, Running};
use crate::performer::action::{self, pursue_on, send};
use crate::performer::settings::argument;
use crate::performer::{Poses, feedback};
use crate::types::{ActionType, Answer, AnyAction, AnyService, Expectation, Library, Raw, ServiceType};
use crate::validated::validated;

/// Number of bytes before a result in the answer of `get_result`: the status of the goal.
const STATUS_LENGTH: usize = 1;

/// Settings of an action that is performed by a goal for an action server of any type.
#[derive(Debug, Clone, PartialEq)]
pub struct AnyGoal {
    server: String,
    kind: Arc<ActionType>,
    goal: Value,
    expected: Expectation,
}

/// Settings of an action that is performed by a call of a service of any type.
#[derive(Debug, Clone, PartialEq)]
pub struct AnyCall {
    service: String,
    kind: Arc<ServiceType>,
    request: Value,
    answer: Answer,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct GoalEntry {
    server: String,
    r#type: String,
    #[serde(default)]
    goal: Map<String, Value>,
    expect: Option<Value>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CallEntry {
    service: String,
    r#type: String,
    #[serde(default)]
    request: Map<String, Value>,
    expect: Option<Value>,
}

impl<'de> Deserialize<'de> for AnyGoal {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        validated::<GoalEntry, _, _>(deserializer)
    }
}

impl TryFrom<GoalEntry> for AnyGoal {
    type Error = String;

    fn try_from(GoalEntry { server, r#type, goal, expect }: GoalEntry) -> Result<Self, String> {
        let kind = Arc::new(Library::current().action(&r#type)?);
        let goal = Value::Object(goal);
        kind.goal.encode(&sample(&goal)).map_err(|because| format!("`goal`: {because}"))?;
        let expected = match &expect {
            None => Expectation::default(),
            Some(table) => {
                Expectation::new(&kind.result, table).map_err(|because| format!("`expect`: {because}"))?
            }
        };
        Ok(Self { server: valid_name("action", &server)?, kind, goal, expected })
    }
}

impl<'de> Deserialize<'de> for AnyCall {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        validated::<CallEntry, _, _>(deserializer)
    }
}

impl TryFrom<CallEntry> for AnyCall {
    type Error = String;

    fn try_from(CallEntry { service, r#type, request, expect }: CallEntry) -> Result<Self, String> {
        let kind = Arc::new(Library::current().service(&r#type)?);
        let request = Value::Object(request);
        kind.request.encode(&sample(&request)).map_err(|because| format!("`request`: {because}"))?;
        let answer = Answer::new(&kind, expect.as_ref())?;
        Ok(Self { service: valid_name("service", &service)?, kind, request, answer })
    }
}

/// Values that replace the placeholders in texts of the settings, e.g. `{2}` and `{pose 2}`.
trait Values {
    /// Returns the argument with a number, counted from 1.
    fn argument(&self, number: usize) -> Result<String, String>;
    /// Returns the pose of the object that is the argument with a number, with a header if `is_stamped`.
    fn pose(&self, number: usize, is_stamped: bool) -> Result<Value, String>;
}

struct OfCall<'c> {
    call: &'c Call,
    poses: &'c Poses,
}

impl Values for OfCall<'_> {
    fn argument(&self, number: usize) -> Result<String, String> {
        let number = NonZeroUsize::new(number).ok_or("arguments are counted from 1")?;
        argument(&self.call.arguments, Some(number), 0).map(str::to_owned)
    }

    fn pose(&self, number: usize, is_stamped: bool) -> Result<Value, String> {
        let object = self.argument(number)?;
        let stamped = self.poses.find(&object).ok_or_else(|| self.poses.lacking(&object))?;
        pose_value(stamped, is_stamped)
    }
}

fn pose_value(stamped: PoseStamped, is_stamped: bool) -> Result<Value, String> {
    let value = if is_stamped { serde_json::to_value(stamped) } else { serde_json::to_value(stamped.pose) };
    value.map_err(|error| error.to_string())
}

/// Example values that replace the placeholders when the settings are read. They have the same types as the real
/// values, so that the fields can be checked.
struct Sample;

impl Values for Sample {
    fn argument(&self, number: usize) -> Result<String, String> {
        Ok(number.to_string())
    }

    fn pose(&self, _: usize, is_stamped: bool) -> Result<Value, String> {
        pose_value(PoseStamped::default(), is_stamped)
    }
}

fn sample(template: &Value) -> Value {
    // This cannot fail, because a sample has all values.
    fill(template, &Sample).unwrap_or_default()
}

/// Replaces `{2}` in texts by the second argument, and the texts `{pose 2}` and `{pose_stamped 2}` by its pose.
fn fill(template: &Value, values: &impl Values) -> Result<Value, String> {
    Ok(match template {
        Value::Object(table) => {
            let entries = table.iter().map(|(key, value)| Ok((key.clone(), fill(value, values)?)));
            Value::Object(entries.collect::<Result<_, String>>()?)
        }
        Value::Array(list) => list.iter().map(|value| fill(value, values)).collect::<Result<_, _>>()?,
        Value::String(text) => {
            let inner = text.strip_prefix('{').and_then(|text| text.strip_suffix('}'));
            match inner.and_then(|inner| inner.split_once(' ')) {
                Some((kind @ ("pose" | "pose_stamped"), number)) if number.parse::<usize>().is_ok() => {
                    values.pose(number.parse().unwrap_or_default(), kind == "pose_stamped")?
                }
                _ => fill_text(text, values)?.into(),
            }
        }
        other => other.clone(),
    })
}

fn fill_text(text: &str, values: &impl Values) -> Result<String, String> {
    let mut filled = String::new();
    let mut remaining = text;
    while let Some((before, after)) = remaining.split_once('{') {
        filled.push_str(before);
        remaining = match after.split_once('}') {
            Some((number, after)) if number.parse::<usize>().is_ok() => {
                filled.push_str(&values.argument(number.parse().unwrap_or_default())?);
                after
            }
            _ => {
                filled.push('{');
                after
            }
        };
    }
    Ok(filled + remaining)
}

pub(super) struct GoalClient {
    caller: Arc<ActionCaller<AnyAction>>,
    settings: AnyGoal,
    poses: Poses,
}

impl GoalClient {
    pub(super) fn new(node: &Arc<Node>, settings: &AnyGoal, poses: &Poses) -> Self {
        let caller = Arc::new(node.any_action_caller(&settings.server, &settings.kind));
        Self { caller, settings: settings.clone(), poses: poses.clone() }
    }
}

impl Perform for GoalClient {
    fn start(&self, call: Call) -> Running {
        let (running, performance) = Running::pair();
        let AnyGoal { kind, goal, expected, .. } = self.settings.clone();
        let values = OfCall { call: &call, poses: &self.poses };
        let encoded = fill(&goal, &values).and_then(|goal| kind.goal.encode(&goal));
        let caller = Arc::clone(&self.caller);
        match encoded {
            Ok(goal) => {
                smol::spawn(async move {
                    let shortfall =
                        |Raw(result): &Raw| expected.check(&kind.result, result, STATUS_LENGTH).err();
                    let end = match send(&caller, Raw(goal), &performance).await {
                        Ok(pursued) => {
                            pursue_on(&pursued, &performance, |_| feedback(None, "running"), shortfall).await
                        }
                        Err(end) => end,
                    };
                    performance.end(end);
                })
                .detach();
            }
            Err(because) => performance.end(End::Failed(format!("{}: {because}", call.text()))),
        }
        running
    }
}

pub(super) struct CallClient {
    caller: Arc<Caller<AnyService>>,
    settings: AnyCall,
    poses: Poses,
}

impl CallClient {
    pub(super) fn new(node: &Arc<Node>, settings: &AnyCall, poses: &Poses) -> Self {
        let caller = Arc::new(node.any_caller(&settings.service, &settings.kind));
        Self { caller, settings: settings.clone(), poses: poses.clone() }
    }
}

impl Perform for CallClient {
    fn start(&self, call: Call) -> Running {
        let (running, performance) = Running::pair();
        let AnyCall { kind, request, answer, .. } = self.settings.clone();
        let values = OfCall { call: &call, poses: &self.poses };
        let encoded = fill(&request, &values).and_then(|request| kind.request.encode(&request));
        let caller = Arc::clone(&self.caller);
        match encoded {
            Ok(request) => {
                smol::spawn(async move {
                    let end = match action::call(&caller, Raw(request), &performance).await {
                        Ok(Raw(reply)) => match answer.check(&kind, &reply) {
                            Ok(()) => End::Succeeded,
                            Err(because) => {
                                End::Failed(format!("{} has refused: {because}", caller.service()))
                            }
                        },
                        Err(end) => end,
                    };
                    performance.end(end);
                })
                .detach();
            }
            Err(because) => performance.end(End::Failed(format!("{}: {because}", call.text()))),
        }
        running
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde_json::json;

    use super::{AnyCall, AnyGoal, OfCall, fill};
    use crate::perform::Call;
    use crate::performer::{Pose, Poses};

    #[test]
    fn arguments_and_poses_are_filled_in() {
        let call = Call {
            action: "move".to_owned(),
            arguments: vec!["dock".to_owned(), "hall".to_owned()],
            configuration: BTreeMap::new(),
            duration: 0.0,
        };
        let mut poses = Poses::default();
        poses.places.insert("hall".to_owned(), Pose { x: 1.0, y: 2.0, z: 0.0, yaw: 0.0 });
        let values = OfCall { call: &call, poses: &poses };
        let template =
            json!({"a": "/maps/{2}_{1}.yaml", "b": ["{x}", 1, "{", "{pose 2}"], "c": "{pose_stamped 2}"});
        let filled = fill(&template, &values).expect("filled");
        assert_eq!(filled["a"], json!("/maps/hall_dock.yaml"));
        assert_eq!(
            (&filled["b"][0], &filled["b"][1], &filled["b"][2]),
            (&json!("{x}"), &json!(1), &json!("{"))
        );
        assert_eq!(filled["b"][3]["position"]["y"], json!(2.0));
        assert_eq!(filled["c"]["header"]["frame_id"], json!("map"));
        assert_eq!(filled["c"]["pose"]["position"]["x"], json!(1.0));
        for (wrong, part) in [("{3}", "no argument 3"), ("{0}", "from 1"), ("{pose 1}", "has no `dock`")] {
            let error = fill(&json!(wrong), &values).expect_err(wrong);
            assert!(error.contains(part), "{wrong}: {error}");
        }
    }

    #[test]
    fn settings_are_checked_when_they_are_read() {
        let goal = |text: &str| toml::from_str::<AnyGoal>(text).map_err(|error| error.message().to_owned());
        let navigate = "server = \"/go\"\ntype = \"nav2_msgs/action/NavigateToPose\"\n";
        goal(&format!("{navigate}goal = {{ pose = \"{{pose_stamped 2}}\" }}\nexpect = {{ error_code = 0 }}"))
            .expect("a goal");
        for (rest, part) in [
            ("goal = { pose = \"{pose 2}\" }", "no field `position`"),
            ("goal = { post = 1 }", "no field `post`"),
            ("expect = { error_cod = 0 }", "did you mean `error_code`?"),
            ("goals = 1", "unknown field `goals`"),
        ] {
            let error = goal(&format!("{navigate}{rest}")).expect_err(rest);
            assert!(error.contains(part), "{rest}: {error}");
        }
        let call = |text: &str| toml::from_str::<AnyCall>(text).map_err(|error| error.message().to_owned());
        let set = "service = \"/lamp\"\ntype = \"std_srvs/srv/SetBool\"\n";
        call(&format!("{set}request = {{ data = true }}")).expect("a call");
        let error = call(&format!("{set}request = {{ data = \"{{1}}\" }}")).expect_err("a text");
        assert!(error.contains("neither true nor false"), "{error}");
    }
}
