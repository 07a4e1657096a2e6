//! Clients of the nodes, services and topics that procedures use.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::process::Stdio;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use metaplan::message::Message;
use ros2_client::ParameterValue;
use smol::Timer;

use crate::interfaces::lifecycle_msgs::msg::State;
use crate::interfaces::lifecycle_msgs::srv::{ChangeState, ChangeStateRequest, GetState, GetStateRequest};
use crate::interfaces::rcl_interfaces::msg;
use crate::interfaces::rcl_interfaces::srv::{
    GetParameters, GetParametersRequest, SetParametersAtomically, SetParametersAtomicallyRequest,
};
use crate::node::{
    Arrivals, CallError, Caller, Node, PrimaryState, Publisher, fitting, latched, parameter, raw,
};
use crate::procedure::settings::{Condition, Operation, Procedure};
use crate::types::{AnyService, MessageType, Raw, ServiceCall, TopicMessage};

const POLL_INTERVAL: Duration = Duration::from_millis(50);

pub(super) const OBSERVATION_TIMEOUT: Duration = Duration::from_secs(2);

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Failure {
    /// The operation has failed, usually because the robot has refused it.
    Refused(String),
    /// The robot has given no valid answer in time.
    Silent(String),
    Replaced,
}

impl Failure {
    pub(super) fn because(&self) -> &str {
        match self {
            Self::Refused(because) | Self::Silent(because) => because,
            Self::Replaced => "a newer request replaces it",
        }
    }
}

impl From<CallError> for Failure {
    fn from(error: CallError) -> Self {
        Self::Silent(error.to_string())
    }
}

struct NodeClient {
    change_state: Caller<ChangeState>,
    get_state: Caller<GetState>,
    set_parameters: Caller<SetParametersAtomically>,
    get_parameters: Caller<GetParameters>,
}

/// Time after the first message on a topic in which latched messages of its publishers arrive, in any order.
const HISTORY_TIME: Duration = Duration::from_secs(5);

/// Maximum difference between the clocks of the hosts that publish on a topic.
const MAX_CLOCK_DIFFERENCE: Duration = Duration::from_secs(60);

/// Last message on a topic.
#[derive(Debug, Default)]
struct LastMessage {
    /// Arrival of the first message.
    first: Option<Instant>,
    last: Option<TimedMessage>,
}

#[derive(Debug)]
struct TimedMessage {
    message: Vec<u8>,
    /// Time of the publication by the clock of the publisher. If it is unknown, the time of the arrival.
    published: SystemTime,
    is_ours: bool,
}

impl LastMessage {
    /// Records a message that arrives at the times `arrival` and `now` of our clocks. It replaces the last one, unless
    /// it is a latched message that was published before the last one.
    ///
    /// The clocks of hosts differ, so the times of publication alone do not determine the order.
    fn receive(&mut self, message: Vec<u8>, published: SystemTime, arrival: Instant, now: SystemTime) {
        let first = *self.first.get_or_insert(arrival);
        let is_at_start = arrival.saturating_duration_since(first) < HISTORY_TIME;
        // A publisher that is discovered late sends its latched message late.
        let is_old = now.duration_since(published).is_ok_and(|age| age > MAX_CLOCK_DIFFERENCE);
        let precedes =
            |last: &TimedMessage| published < last.published && (is_old || is_at_start && !last.is_ours);
        if !self.last.as_ref().is_some_and(precedes) {
            self.last = Some(TimedMessage { message, published, is_ours: false });
        }
    }

    /// Records a message that this program publishes at the time `now`.
    fn send(&mut self, message: Vec<u8>, now: SystemTime) {
        self.last = Some(TimedMessage { message, published: now, is_ours: true });
    }

    fn message(&self) -> Option<Vec<u8>> {
        self.last.as_ref().map(|last| last.message.clone())
    }
}

struct Observed {
    last: Arc<Mutex<LastMessage>>,
    /// Exists if a step or an undo publishes on the topic.
    publisher: Option<Publisher<Raw>>,
}

impl Observed {
    fn last(&self) -> MutexGuard<'_, LastMessage> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

pub(super) struct Clients {
    nodes: BTreeMap<String, NodeClient>,
    node: Arc<Node>,
    /// Clients by service name and full name of the request type.
    services: BTreeMap<(String, String), Caller<AnyService>>,
    topics: BTreeMap<String, Arrivals>,
    /// Topics by name and full name of the type.
    observed: BTreeMap<(String, String), Observed>,
}

fn service_key(service: &str, call: &ServiceCall) -> (String, String) {
    (service.to_owned(), call.kind.request.name.clone())
}

fn topic_key(topic: &str, kind: &MessageType) -> (String, String) {
    (topic.to_owned(), kind.structure.name.clone())
}

fn remaining(deadline: Instant) -> Duration {
    deadline.saturating_duration_since(Instant::now())
}

impl Clients {
    pub(super) fn new<'p>(
        node: &Arc<Node>,
        procedures: impl Iterator<Item = &'p Procedure>,
    ) -> Result<Self, Message> {
        let mut clients = Self {
            nodes: BTreeMap::new(),
            node: Arc::clone(node),
            services: BTreeMap::new(),
            topics: BTreeMap::new(),
            observed: BTreeMap::new(),
        };
        for procedure in procedures {
            for operation in procedure.operations() {
                match operation {
                    Operation::State { node: name, .. } | Operation::Parameters { node: name, .. } => {
                        clients.add_node(node, name);
                    }
                    Operation::Service { service, call } => {
                        let client = || node.any_caller(service, &call.kind);
                        clients.services.entry(service_key(service, call)).or_insert_with(client);
                    }
                    Operation::Publish { message, .. } => {
                        let observed = clients.observe(&message.topic, &message.kind)?;
                        if observed.publisher.is_none() {
                            let publisher = node.raw_publisher(&message.topic, &message.kind, latched(1))?;
                            observed.publisher = Some(publisher);
                        }
                    }
                    Operation::Command(_) => {}
                }
            }
            for condition in &procedure.conditions {
                match condition {
                    Condition::State { node: name, .. } | Condition::Parameters { node: name, .. } => {
                        clients.add_node(node, name);
                    }
                    Condition::Topic(topic) if !clients.topics.contains_key(topic) => {
                        clients.topics.insert(topic.clone(), node.arrivals(topic)?);
                    }
                    Condition::Topic(_) => {}
                    Condition::Published(TopicMessage { topic, kind, .. })
                    | Condition::Message { topic, kind, .. } => drop(clients.observe(topic, kind)?),
                }
            }
        }
        Ok(clients)
    }

    /// Subscribes to a topic, unless it is already subscribed to, and records its last message.
    fn observe(&mut self, topic: &str, kind: &Arc<MessageType>) -> Result<&mut Observed, Message> {
        let key = topic_key(topic, kind);
        if !self.observed.contains_key(&key) {
            let last: Arc<Mutex<LastMessage>> = Arc::default();
            let received = Arc::clone(&last);
            self.node.subscribe_when_published(topic, kind, move |message, published| {
                let mut last = received.lock().unwrap_or_else(PoisonError::into_inner);
                last.receive(message, published, Instant::now(), SystemTime::now());
            })?;
            self.observed.insert(key.clone(), Observed { last, publisher: None });
        }
        self.observed.get_mut(&key).ok_or_else(|| Message::error("N122", format!("{topic} is not observed")))
    }

    fn add_node(&mut self, node: &Arc<Node>, name: &str) {
        self.nodes.entry(name.to_owned()).or_insert_with(|| NodeClient {
            change_state: node.caller(&format!("{name}/change_state")),
            get_state: node.caller(&format!("{name}/get_state")),
            set_parameters: node.caller(&format!("{name}/set_parameters_atomically")),
            get_parameters: node.caller(&format!("{name}/get_parameters")),
        });
    }

    fn node(&self, name: &str) -> Result<&NodeClient, Failure> {
        // Clients exist for all nodes of the settings.
        self.nodes.get(name).ok_or_else(|| Failure::Refused(format!("{name} has no client")))
    }

    /// Connects to the services of an operation, or waits for the subscribers of its message. Returns descriptions of
    /// the missing ones.
    pub(super) async fn missing(&self, operation: &Operation, within: Duration) -> Vec<String> {
        let mut missing = Vec::new();
        let mut note =
            |result: Result<(), CallError>| missing.extend(result.err().map(|error| error.to_string()));
        match operation {
            Operation::State { node, .. } => {
                let Ok(client) = self.node(node) else { return missing };
                note(client.change_state.ready(within).await);
                note(client.get_state.ready(within).await);
            }
            Operation::Parameters { node, .. } => {
                let Ok(client) = self.node(node) else { return missing };
                note(client.set_parameters.ready(within).await);
                note(client.get_parameters.ready(within).await);
            }
            Operation::Service { service, call } => {
                if let Some(client) = self.services.get(&service_key(service, call)) {
                    note(client.ready(within).await);
                }
            }
            Operation::Publish { message, subscribers } => {
                if let Err(failure) = self.await_subscribers(&message.topic, *subscribers, within).await {
                    missing.push(failure.because().to_owned());
                }
            }
            Operation::Command(_) => {}
        }
        missing
    }

    /// Returns `true` if the services of an operation answer, as far as that can be tested without an effect.
    pub(super) async fn answers(&self, operation: &Operation) -> bool {
        if !self.missing(operation, Duration::ZERO).await.is_empty() {
            return false;
        }
        match operation.condition() {
            Some(condition) => self.holds(&condition).await.is_ok(),
            None => true,
        }
    }

    /// Returns the GUIDs of the servers that report the state or the parameters of a node. For a condition about the
    /// last message on a topic, which has no server, returns an id of the condition while it holds: a change of the
    /// mode then changes the result.
    pub(super) fn servers(&self, condition: &Condition) -> BTreeSet<[u8; 16]> {
        let (Condition::State { node, .. } | Condition::Parameters { node, .. }) = condition else {
            let is_met = !matches!(condition, Condition::Topic(_)) && self.is_met(condition);
            let mut hasher = DefaultHasher::new();
            format!("{condition:?}").hash(&mut hasher);
            let mut id = [0; 16];
            id[..8].copy_from_slice(&hasher.finish().to_le_bytes());
            return is_met.then_some(id).into_iter().collect();
        };
        let Ok(client) = self.node(node) else { return BTreeSet::new() };
        match condition {
            Condition::State { .. } => client.get_state.servers(),
            _ => client.get_parameters.servers(),
        }
    }

    async fn state(&self, node: &str, within: Duration) -> Result<State, Failure> {
        let answer = self.node(node)?.get_state.call(GetStateRequest::default(), within).await?;
        Ok(answer.current_state)
    }

    /// Returns the primary state of a node, once it is in no transition. Fails for a finalized node, and for
    /// a transition that does not end before the deadline.
    async fn primary_state(&self, node: &str, deadline: Instant) -> Result<PrimaryState, Failure> {
        loop {
            let state = self.state(node, remaining(deadline)).await?;
            if let Some(primary) = PrimaryState::of(&state) {
                return Ok(primary);
            }
            if state.id == State::PRIMARY_STATE_FINALIZED {
                return Err(Failure::Refused(format!("{node} is finalized and has to be started again")));
            }
            if remaining(deadline).is_zero() {
                return Err(Failure::Refused(format!(
                    "{node} is still {} at the end of the timeout",
                    state.label
                )));
            }
            Timer::after(POLL_INTERVAL).await;
        }
    }

    /// Brings a node to a state by successive transitions. Passes its initial state to `before`. Fails if a
    /// transition is refused or the deadline passes.
    pub(super) async fn bring(
        &self,
        node: &str,
        target: PrimaryState,
        deadline: Instant,
        mut before: impl FnMut(PrimaryState),
    ) -> Result<(), Failure> {
        let mut state = self.primary_state(node, deadline).await?;
        before(state);
        while let Some(transition) = state.toward(target) {
            let label = transition.label.clone();
            let request = ChangeStateRequest { transition };
            let answer = self.node(node)?.change_state.call(request, remaining(deadline)).await?;
            let reached = self.primary_state(node, deadline).await?;
            if !answer.success || reached == state {
                let text = format!("{node} has refused the transition `{label}` and is {reached}");
                return Err(Failure::Refused(text));
            }
            state = reached;
        }
        Ok(())
    }

    /// Returns the present values of parameters, `NotSet` for a parameter that does not exist.
    pub(super) async fn parameters(
        &self,
        node: &str,
        values: &[(String, ParameterValue)],
        within: Duration,
    ) -> Result<Vec<ParameterValue>, Failure> {
        let names: Vec<String> = values.iter().map(|(name, _)| name.clone()).collect();
        let answer = self.node(node)?.get_parameters.call(GetParametersRequest { names }, within).await?;
        let mut present: Vec<ParameterValue> = answer
            .values
            .into_iter()
            .map(|value| parameter(value).unwrap_or(ParameterValue::NotSet))
            .collect();
        // Nodes of `rclcpp` answer without values if one of the parameters is not declared.
        present.resize(values.len(), ParameterValue::NotSet);
        Ok(present)
    }

    /// Sets parameters atomically and checks the values afterwards. Passes the earlier values to `note`, unless the node
    /// refuses the request. Sets nothing if the node already has the values.
    pub(super) async fn set(
        &self,
        node: &str,
        values: &[(String, ParameterValue)],
        deadline: Instant,
        note: impl FnOnce(Vec<(String, ParameterValue)>),
    ) -> Result<(), Failure> {
        let present = self.parameters(node, values, remaining(deadline)).await?;
        let values_to_set = fitted(values, &present);
        if equal(&values_to_set, &present) {
            return Ok(());
        }
        let earlier = values.iter().map(|(name, _)| name.clone()).zip(present).collect();
        let parameters = values
            .iter()
            .zip(&values_to_set)
            .map(|((name, _), value)| msg::Parameter { name: name.clone(), value: raw(value.clone()) })
            .collect();
        let request = SetParametersAtomicallyRequest { parameters };
        let answer = self.node(node)?.set_parameters.call(request, remaining(deadline)).await;
        // A refused request has no effect, because it is atomic.
        if let Ok(answer) = &answer
            && !answer.result.successful
        {
            let reason = &answer.result.reason;
            return Err(Failure::Refused(format!("{node} has refused the parameters: {reason}")));
        }
        note(earlier);
        answer?;
        let present = self.parameters(node, values, remaining(deadline)).await?;
        let differs =
            values.iter().zip(&values_to_set).zip(&present).find(|((_, value), present)| {
                !equal(std::slice::from_ref(value), std::slice::from_ref(present))
            });
        match differs {
            None => Ok(()),
            Some((((name, _), values_to_set), present)) => Err(Failure::Refused(format!(
                "{node} has accepted the parameter {name} = {}, and has {}",
                text(values_to_set),
                text(present)
            ))),
        }
    }

    fn service(&self, service: &str, call: &ServiceCall) -> Result<&Caller<AnyService>, Failure> {
        let client = self.services.get(&service_key(service, call));
        client.ok_or_else(|| Failure::Refused(format!("{service} has no client")))
    }

    /// Waits for the server of a service, and connects to it.
    pub(super) async fn ready(
        &self,
        service: &str,
        call: &ServiceCall,
        within: Duration,
    ) -> Result<(), Failure> {
        Ok(self.service(service, call)?.ready(within).await?)
    }

    pub(super) async fn call(
        &self,
        service: &str,
        call: &ServiceCall,
        within: Duration,
    ) -> Result<(), Failure> {
        let Raw(answer) = self.service(service, call)?.call(Raw(call.request.clone()), within).await?;
        call.check(&answer).map_err(|because| Failure::Refused(format!("{service} has refused: {because}")))
    }

    /// Publishes a message once the topic has enough subscribers, unless it is the last message already. Passes the
    /// previous message to `before`.
    pub(super) async fn publish(
        &self,
        message: &TopicMessage,
        subscribers: usize,
        within: Duration,
        before: impl FnOnce(Option<Vec<u8>>),
    ) -> Result<(), Failure> {
        let TopicMessage { topic, kind, message } = message;
        let observed = self.observed.get(&topic_key(topic, kind));
        let publisher = observed.and_then(|observed| Some((observed, observed.publisher.as_ref()?)));
        let Some((observed, publisher)) = publisher else {
            return Err(Failure::Refused(format!("{topic} has no publisher")));
        };
        self.await_subscribers(topic, subscribers, within).await?;
        let last = observed.last().message();
        if last.as_ref() == Some(message) {
            return Ok(());
        }
        before(last);
        // Recorded first, so that a message of another node that is published later replaces it.
        observed.last().send(message.clone(), SystemTime::now());
        publisher.publish(Raw(message.clone()));
        Ok(())
    }

    async fn await_subscribers(&self, topic: &str, count: usize, within: Duration) -> Result<(), Failure> {
        let present = self.node.await_subscribers(topic, count, within).await;
        if present >= count {
            return Ok(());
        }
        Err(Failure::Silent(format!(
            "{topic} has {present} of {count} subscribers after {:.1} s",
            within.as_secs_f64()
        )))
    }

    /// Returns `true` if a condition about the last message on a topic holds, and for all other conditions.
    fn is_met(&self, condition: &Condition) -> bool {
        let last = |topic: &str, kind: &MessageType| {
            self.observed.get(&topic_key(topic, kind)).and_then(|observed| observed.last().message())
        };
        match condition {
            Condition::Published(TopicMessage { topic, kind, message }) => {
                last(topic, kind).as_ref() == Some(message)
            }
            Condition::Message { topic, kind, expectation } => last(topic, kind)
                .is_some_and(|message| expectation.check(&kind.structure, &message, 0).is_ok()),
            _ => true,
        }
    }

    /// Returns `true` if a node has the required state or parameters, or if the last message on a topic has the
    /// required values. The arrival of a message is not checked. Fails if the node is silent or in a transition.
    pub(super) async fn holds(&self, condition: &Condition) -> Result<bool, Failure> {
        match condition {
            Condition::State { node, state } => {
                let present = self.state(node, OBSERVATION_TIMEOUT).await?;
                match PrimaryState::of(&present) {
                    Some(primary) => Ok(primary == *state),
                    None if present.id == State::PRIMARY_STATE_FINALIZED => Ok(false),
                    None => Err(Failure::Silent(format!("{node} is {}", present.label))),
                }
            }
            Condition::Parameters { node, values } => {
                let present = self.parameters(node, values, OBSERVATION_TIMEOUT).await?;
                Ok(equal(&fitted(values, &present), &present))
            }
            Condition::Topic(_) | Condition::Published(_) | Condition::Message { .. } => {
                Ok(self.is_met(condition))
            }
        }
    }

    /// Waits until a condition holds, at most until the deadline. A `Condition::Topic` holds if the last message
    /// arrived at `since` or later.
    pub(super) async fn until(
        &self,
        condition: &Condition,
        since: Instant,
        deadline: Instant,
    ) -> Result<(), Failure> {
        loop {
            let outcome = match condition {
                Condition::Topic(topic) => {
                    Ok(self.topics.get(topic).is_some_and(|arrivals| arrivals.is_after(since)))
                }
                other => self.holds(other).await,
            };
            match outcome {
                Ok(true) => return Ok(()),
                Ok(false) if remaining(deadline).is_zero() => {
                    return Err(Failure::Refused(format!("not seen afterwards: {condition}")));
                }
                Err(failure) if remaining(deadline).is_zero() => return Err(failure),
                Ok(false) | Err(_) => {
                    Timer::after(POLL_INTERVAL).await;
                }
            }
        }
    }
}

/// Executes a program, and kills it at the deadline. Calls `before` once the program is started. Its output goes to
/// standard error.
pub(super) async fn execute(
    words: &[String],
    deadline: Instant,
    before: impl FnOnce(),
) -> Result<(), Failure> {
    let [program, arguments @ ..] = words else { return Ok(()) };
    let child = smol::process::Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::from(std::io::stderr()))
        .kill_on_drop(true)
        .spawn();
    let mut child =
        child.map_err(|error| Failure::Refused(format!("`{program}` cannot be started: {error}")))?;
    before();
    let ended = async { Some(child.status().await) };
    let late = async {
        Timer::at(deadline).await;
        None
    };
    match smol::future::or(ended, late).await {
        Some(Ok(status)) if status.success() => Ok(()),
        Some(Ok(status)) => Err(Failure::Refused(format!("`{}` has ended with {status}", words.join(" ")))),
        Some(Err(error)) => Err(Failure::Refused(format!("`{program}` cannot be waited for: {error}"))),
        None => Err(Failure::Silent(format!("`{}` had not ended in time and was killed", words.join(" ")))),
    }
}

/// Converts values to the types of the present values: an integer to a double. Other values of different type stay
/// unchanged.
fn fitted(values: &[(String, ParameterValue)], present: &[ParameterValue]) -> Vec<ParameterValue> {
    let fit = |((_, value), present): (&(String, ParameterValue), &ParameterValue)| {
        fitting(present, value.clone()).unwrap_or_else(|_| value.clone())
    };
    values.iter().zip(present).map(fit).collect()
}

/// Returns `true` if two lists of values are equal. NaN is equal to NaN, which `==` denies.
fn equal(values: &[ParameterValue], present: &[ParameterValue]) -> bool {
    values == present || format!("{values:?}") == format!("{present:?}")
}

fn text(value: &ParameterValue) -> String {
    match value {
        ParameterValue::NotSet => "no value".to_owned(),
        ParameterValue::Boolean(truth) => truth.to_string(),
        ParameterValue::Integer(number) => number.to_string(),
        ParameterValue::Double(number) => number.to_string(),
        ParameterValue::String(text) => format!("{text:?}"),
        other => format!("{other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

    use ros2_client::ParameterValue;

    use super::{LastMessage, equal};

    #[test]
    fn parameters_are_equal_if_both_are_not_a_number() {
        let list = |value: f64| vec![ParameterValue::Double(value), ParameterValue::DoubleArray(vec![value])];
        for (value, present) in [(f64::NAN, f64::NAN), (0.0, -0.0), (1.5, 1.5)] {
            assert!(equal(&list(value), &list(present)), "{value}");
        }
        for (value, present) in [(f64::NAN, 1.0), (1.5, 1.25), (1.0, -1.0)] {
            assert!(!equal(&list(value), &list(present)), "{value}");
        }
        assert!(!equal(&[ParameterValue::Integer(1)], &[ParameterValue::Double(1.0)]));
    }

    /// Checks the last message of a sequence. For each message: the seconds since the start, the difference of our clock
    /// from the time since the start, the seconds of the publication by the clock of the publisher (`None` for a message
    /// of this program), and the content.
    fn check(messages: &[(u64, i64, Option<i64>, u8)], expected: u8) {
        let start = Instant::now();
        let clock =
            |seconds: i64| UNIX_EPOCH + Duration::from_secs(1_000_000_u64.saturating_add_signed(seconds));
        let mut last = LastMessage::default();
        for (seconds, offset, published, content) in messages {
            let now: SystemTime = clock(seconds.cast_signed() + offset);
            match published {
                Some(published) => {
                    let arrival = start + Duration::from_secs(*seconds);
                    last.receive(vec![*content], clock(*published), arrival, now);
                }
                None => last.send(vec![*content], now),
            }
        }
        assert_eq!(last.message(), Some(vec![expected]), "{messages:?}");
    }

    #[test]
    fn the_last_message_is_the_one_that_was_published_last() {
        assert_eq!(LastMessage::default().message(), None);
        check(&[(0, 0, Some(0), 1), (1, 0, Some(1), 2)], 2);
        check(&[(0, 0, Some(0), 1), (1, 0, None, 2)], 2);
        // Latched messages of several publishers arrive in any order; one publisher is discovered late.
        check(&[(0, 0, Some(-20), 1), (1, 0, Some(-30), 2)], 1);
        check(&[(0, 0, Some(-30), 1), (1, 0, Some(-20), 2)], 2);
        check(&[(0, 0, Some(-20), 1), (500, 0, Some(-90), 2)], 1);
        check(&[(0, 0, None, 1), (1, 0, Some(-90), 2)], 1);
    }

    #[test]
    fn clocks_may_differ_and_step_back() {
        // The clock of the other host is 10 s behind ours.
        check(&[(0, 0, None, 1), (5, 0, Some(-5), 2)], 2);
        check(&[(0, 0, Some(-10), 1), (100, 0, None, 2), (105, 0, Some(95), 3)], 3);
        // It is 10 s, or an hour, ahead of ours.
        check(&[(0, 0, Some(10), 1), (2, 0, None, 2)], 2);
        check(&[(0, 0, Some(3600), 1), (9, 0, None, 2), (60, 0, Some(3660), 3)], 3);
        // The clock of the only host is set back by an hour.
        check(&[(0, 0, Some(0), 1), (10, -3600, Some(-3590), 2)], 2);
        check(&[(0, 0, Some(0), 1), (10, -3600, None, 2), (20, -3600, Some(-3580), 3)], 3);
    }
}
