//! Action clients: sending, monitoring and cancelling goals.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::Message;
use ros2_client::ActionTypeName;
use ros2_client::action::{ActionClient, ActionClientQosPolicies, GetResultResponse, GoalId, GoalStatusEnum};
use ros2_client::action_msgs::CancelGoalResponseEnum;
use ros2_client::error::WriteResult;
use ros2_client::request_id::RmwRequestId;
use smol::{Timer, channel};

use crate::interfaces::Action;
use crate::node::action::{ActionNames, GoalEnd, POLL_INTERVAL, expect_action};
use crate::node::graph::{Graph, Server, Topics};
use crate::node::rmw::Mapping;
use crate::node::{Node, client_name, creation_error, latched, qos};
use crate::types::{ActionType, AnyAction};

/// Time for which the client waits after discovering a server, so that the server can discover the client. Earlier
/// answers would be lost.
const MATCHING_TIME: Duration = Duration::from_millis(100);

/// Interval between look-ups of the servers of running goals.
const LOOKUP_INTERVAL: Duration = Duration::from_millis(100);

/// Time for which the server of a goal is missing, or another server is present, after which the goal counts as lost.
const SERVER_LOSS_TIME: Duration = Duration::from_millis(500);

/// Time to wait for the result of a goal that the server does not know, or whose result was probably malformed.
const RESULT_WAIT: Duration = Duration::from_secs(3);

/// Time to wait for the result of a goal that has ended according to its server. Servers of `rclpy` report the end at
/// once, but send the result only when the callback of the goal returns.
const LATE_RESULT_WAIT: Duration = Duration::from_secs(10 * 60);

/// Time for which a late acceptance of a goal is expected, so that the goal can be cancelled.
const LATE_ANSWER_WAIT: Duration = Duration::from_secs(15 * 60);

type Client<A> = ActionClient<<A as Action>::Goal, <A as Action>::Result, <A as Action>::Feedback>;

/// Message about an accepted goal, for the sender of the goal.
#[derive(Debug, Clone, PartialEq)]
pub enum Accepted<A: Action> {
    /// Intermediate feedback.
    Feedback(A::Feedback),
    /// Outcome and result of the goal.
    Ended(GoalEnd, A::Result),
    /// The outcome is unknown, because the server was lost; contains a description.
    Lost(String),
}

/// Reason why a goal was not accepted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GoalError {
    /// The goal was not delivered or not answered. For example, the action has no server, or the server has another
    /// type.
    #[error("{action}: {because}")]
    Unreachable {
        /// Full name of the action.
        action: String,
        /// Description of the error.
        because: String,
    },
    /// The server has rejected the goal.
    #[error("{0} has rejected the goal")]
    Rejected(String),
}

/// Action client of one action.
pub struct ActionCaller<A: Action> {
    node: Arc<Node>,
    full: String,
    kind: ActionTypeName,
    connection: smol::lock::Mutex<Option<Arc<Connection<A>>>>,
}

/// A client of a server with its goals. The client library passes each message to the first
/// receiver, regardless of the goal, so a single task receives the messages about all goals.
struct Connection<A: Action> {
    server: Server,
    client: Client<A>,
    goals: Mutex<ClientGoals<A>>,
}

struct ClientGoals<A: Action> {
    /// Goals that the server has neither accepted nor rejected.
    unanswered: Vec<Unanswered<A>>,
    accepted: BTreeMap<GoalId, Followed<A>>,
    /// Description of the last result that could not be decoded.
    malformed: Option<String>,
}

struct Unanswered<A: Action> {
    request: RmwRequestId,
    goal: GoalId,
    since: Instant,
    /// Closed if the sender of the goal no longer waits.
    answer: channel::Sender<Result<Pursued<A>, GoalError>>,
    /// `true` after a request to cancel the goal, because its sender no longer waits.
    is_cancelled: bool,
}

struct Followed<A: Action> {
    result: RmwRequestId,
    events: channel::Sender<Accepted<A>>,
    cancelled: channel::Receiver<()>,
    /// Last request to cancel the goal.
    cancel: Option<RmwRequestId>,
    prospect: Prospect,
}

/// Facts that determine whether the result of an accepted goal can still arrive.
#[derive(Debug)]
struct Prospect {
    /// Servers of the action when the goal was accepted. One of them has accepted it.
    servers: BTreeSet<[u8; 16]>,
    /// Time since which these servers are missing, or another server is present.
    changed: Option<Instant>,
    /// Time since which the goal has ended according to its server.
    ended: Option<Instant>,
    /// Time since which the server does not know the goal.
    unknown: Option<Instant>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Loss {
    Server,
    Result,
}

impl Prospect {
    /// Returns the reason why the result can no longer be expected, if there is one. `servers` are the present servers.
    /// `is_malformed` is `true` if a result could not be decoded, perhaps that of this goal.
    ///
    /// A new server replaces one that has crashed and whose endpoints remain until their lease expires. It does not
    /// have the goals of the other one.
    fn loss(&mut self, servers: &BTreeSet<[u8; 16]>, is_malformed: bool, now: Instant) -> Option<Loss> {
        let is_changed = servers.is_empty() || !servers.is_subset(&self.servers);
        self.changed = is_changed.then(|| self.changed.unwrap_or(now));
        let is_over = |since: Option<Instant>, limit: Duration| {
            since.is_some_and(|since| now.saturating_duration_since(since) >= limit)
        };
        let result_wait = if is_malformed { RESULT_WAIT } else { LATE_RESULT_WAIT };
        if is_over(self.unknown, RESULT_WAIT) || is_over(self.ended, result_wait) {
            return Some(Loss::Result);
        }
        is_over(self.changed, SERVER_LOSS_TIME).then_some(Loss::Server)
    }
}

/// A goal that an action server has accepted. The goal is cancelled if this handle is dropped.
#[derive(Debug)]
pub struct Pursued<A: Action> {
    goal: GoalId,
    /// Messages about the goal. The last one is [`Accepted::Ended`] or [`Accepted::Lost`].
    pub events: channel::Receiver<Accepted<A>>,
    cancel: channel::Sender<()>,
}

impl<A: Action> Pursued<A> {
    /// Id of the goal, as it occurs in logs.
    pub fn goal(&self) -> GoalId {
        self.goal
    }

    /// Requests cancellation of the goal. The end of the goal is reported in `events` as usual.
    pub fn cancel(&self) {
        // A full channel means that cancellation was already requested.
        let _ = self.cancel.try_send(());
    }
}

impl<A: Action> std::fmt::Debug for ActionCaller<A> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("ActionCaller").field(&self.full).finish()
    }
}

impl<A: Action + 'static> ActionCaller<A> {
    /// Waits up to `within` for a server and connects to it. Sends nothing.
    ///
    /// # Errors
    /// Fails if the action has no server in time, the server has another type, or the client cannot be created.
    pub async fn ready(&self, within: Duration) -> Result<(), GoalError> {
        self.connect(within).await.map(|_| ()).map_err(|because| unreachable(&self.full, because))
    }

    /// Sends a goal, and waits until the server accepts it. `within` limits the time to wait for a
    /// server and its answer. A goal without an answer in time is cancelled, and again if it is accepted later. The
    /// same applies to a goal that was sent before the returned future is dropped.
    ///
    /// # Errors
    /// Fails if no server of the expected type accepts the goal in time.
    pub async fn pursue(&self, goal: A::Goal, within: Duration) -> Result<Pursued<A>, GoalError> {
        let start = Instant::now();
        let unreachable = |because: String| unreachable(&self.full, because);
        let connection = self.connect(within).await.map_err(unreachable)?;
        let (sender, answer) = channel::bounded(1);
        let is_first = connection.send(goal, sender).map_err(|error| unreachable(error.to_string()))?;
        if is_first {
            let (graph, full, running) =
                (Arc::clone(&self.node.graph), self.full.clone(), Arc::clone(&connection));
            smol::spawn(async move { running.run(&graph, &full).await }).detach();
        }
        let remaining = within.saturating_sub(start.elapsed());
        let timeout = async {
            Timer::after(remaining).await;
            None
        };
        if let Some(answer) = smol::future::or(async { answer.recv().await.ok() }, timeout).await {
            return answer;
        }
        let mapping = connection.server.mapping;
        Err(unreachable(format!(
            "no answer to a goal after {:.1} s; it was sent with the service mapping of {mapping}; `--rmw {}` selects \
             the other mapping",
            within.as_secs_f64(),
            mapping.other()
        )))
    }

    async fn connect(&self, within: Duration) -> Result<Arc<Connection<A>>, String> {
        let topics = goal_topics(&self.full);
        let mut connection = self.connection.lock().await;
        let discovered = self.node.graph.wait(within, |graph| graph.server(&topics)).await;
        let server =
            discovered.ok_or_else(|| format!("it has no server after {:.1} s", within.as_secs_f64()))??;
        if let Some(connected) = connection.as_ref().filter(|connected| connected.server == server) {
            return Ok(Arc::clone(connected));
        }
        let client = self.client(server.mapping).map_err(|message| message.message.clone())?;
        Timer::after(MATCHING_TIME.min(within)).await;
        let goals = ClientGoals { unanswered: Vec::new(), accepted: BTreeMap::new(), malformed: None };
        let connected = Arc::new(Connection { server, client, goals: Mutex::new(goals) });
        Ok(Arc::clone(connection.insert(connected)))
    }

    fn client(&self, mapping: Mapping) -> Result<Client<A>, Message> {
        let name = client_name(&self.full)?;
        let policies = ActionClientQosPolicies {
            goal_service: qos::service(),
            result_service: qos::service(),
            cancel_service: qos::service(),
            feedback_subscription: qos::depth(10),
            status_subscription: latched(1),
        };
        self.node
            .inner()
            .create_action_client(mapping.service_mapping(), &name, &self.kind, policies)
            .map_err(|error| creation_error(&self.full, &error))
    }
}

impl<A: Action + 'static> Connection<A> {
    fn goals(&self) -> MutexGuard<'_, ClientGoals<A>> {
        self.goals.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends a goal. Returns `true` if it is the only one, so that a task must be started to receive messages.
    fn send(
        &self,
        goal: A::Goal,
        answer: channel::Sender<Result<Pursued<A>, GoalError>>,
    ) -> WriteResult<bool, ()> {
        // The lock is held so that the answer cannot be received before the goal is registered.
        let mut goals = self.goals();
        let is_first = goals.is_empty();
        if is_first {
            // A malformed result belonged to one of the earlier goals.
            goals.malformed = None;
        }
        let (request, goal) = self.client.send_goal(goal)?;
        let since = Instant::now();
        goals.unanswered.push(Unanswered { request, goal, since, answer, is_cancelled: false });
        Ok(is_first)
    }

    /// Forwards the messages about all goals until all goals have ended. A goal whose result can no longer arrive ends with
    /// [`Accepted::Lost`].
    async fn run(&self, graph: &Graph, full: &str) {
        let topics = goal_topics(full);
        let mut next_lookup = Instant::now();
        loop {
            self.take_answers(full, || graph.servers(&topics));
            self.poll();
            if Instant::now() >= next_lookup {
                next_lookup = Instant::now() + LOOKUP_INTERVAL;
                self.end_lost(&graph.servers(&topics), full);
            }
            if self.goals().is_empty() {
                return;
            }
            Timer::after(POLL_INTERVAL).await;
        }
    }

    /// Receives the answers to goals. A goal that is accepted after its sender has given up is cancelled.
    fn take_answers(&self, full: &str, servers: impl Fn() -> BTreeSet<[u8; 16]>) {
        let mut goals = self.goals();
        if goals.unanswered.is_empty() {
            return;
        }
        while let Ok(Some((request, response))) = self.client.goal_client().receive_response() {
            let position = goals.unanswered.iter().position(|unanswered| unanswered.request == request);
            let Some(position) = position else { continue };
            let Unanswered { goal, answer, .. } = goals.unanswered.swap_remove(position);
            if !response.accepted {
                let _ = answer.try_send(Err(GoalError::Rejected(full.to_owned())));
                continue;
            }
            let (events, received) = channel::unbounded();
            let (cancel, cancelled) = channel::bounded(1);
            let requested = self.client.request_result(goal);
            let result = requested.as_ref().ok().copied();
            let pursued = requested
                .map(|_| Pursued { goal, events: received, cancel })
                .map_err(|error| unreachable(full, error.to_string()));
            let is_awaited = answer.try_send(pursued).is_ok();
            let Some(result) = result.filter(|_| is_awaited) else {
                let _ = self.client.cancel_goal(goal);
                continue;
            };
            let prospect = Prospect { servers: servers(), changed: None, ended: None, unknown: None };
            let followed = Followed { result, events, cancelled, cancel: None, prospect };
            goals.accepted.insert(goal, followed);
        }
    }

    /// Cancels the unanswered goals whose senders no longer wait. Ends the goals whose results can no longer arrive,
    /// with the servers that are present.
    fn end_lost(&self, servers: &BTreeSet<[u8; 16]>, full: &str) {
        let (mut goals, now) = (self.goals(), Instant::now());
        let ClientGoals { unanswered, accepted, malformed } = &mut *goals;
        unanswered.retain(|unanswered| unanswered.since.elapsed() < LATE_ANSWER_WAIT);
        for unanswered in unanswered.iter_mut().filter(|goal| goal.answer.is_closed() && !goal.is_cancelled) {
            // The server may have accepted the goal, and the robot would then move on its own.
            unanswered.is_cancelled = self.client.cancel_goal(unanswered.goal).is_ok();
        }
        accepted.retain(|goal, followed| {
            let because = match followed.prospect.loss(servers, malformed.is_some(), now) {
                None => return true,
                Some(Loss::Server) => format!("the server of {full} is gone"),
                Some(Loss::Result) => match malformed {
                    Some(error) => format!(
                        "a result of {full} is malformed, perhaps of another version of its type: {error}"
                    ),
                    None => format!("{full} has ended the goal, but its result has not arrived"),
                },
            };
            let _ = followed.events.try_send(Accepted::Lost(because));
            // A server that still has the goal must not go on with it.
            let _ = self.client.cancel_goal(*goal);
            false
        });
    }

    fn poll(&self) {
        let mut goals = self.goals();
        // Without a running goal, feedback stays in the queue, because it may arrive before the answer to its goal.
        if goals.accepted.is_empty() {
            return;
        }
        // Invalid feedback is skipped.
        while let Ok(Some((message, _))) = self.client.feedback_subscription().take() {
            if let Some(followed) = goals.accepted.get(&message.goal_id) {
                let _ = followed.events.try_send(Accepted::Feedback(message.feedback));
            }
        }
        loop {
            match self.client.result_client().receive_response() {
                Ok(Some((request, response))) => goals.end(request, response),
                Ok(None) => break,
                Err(error) => {
                    // The goal is not known. Its status shows that it has ended.
                    goals.malformed = Some(error.to_string());
                    break;
                }
            }
        }
        // Received after the results: a goal with a result is no longer registered.
        while let Ok(Some(statuses)) = self.client.receive_status() {
            for status in statuses.status_list {
                goals.note_status(status.goal_info.goal_id, status.status);
            }
        }
        while let Ok(Some((request, response))) = self.client.cancel_client().receive_response() {
            goals.note_cancellation(request, response.return_code);
        }
        for (goal, followed) in &mut goals.accepted {
            let is_abandoned = followed.events.is_closed() && followed.cancel.is_none();
            if followed.cancelled.try_recv().is_ok() || is_abandoned {
                followed.cancel = self.client.cancel_goal(*goal).ok();
            }
        }
    }
}

impl<A: Action> ClientGoals<A> {
    fn is_empty(&self) -> bool {
        self.unanswered.is_empty() && self.accepted.is_empty()
    }

    fn end(&mut self, request: RmwRequestId, response: GetResultResponse<A::Result>) {
        let goal = self.accepted.iter().find(|(_, followed)| followed.result == request);
        let goal = goal.map(|(goal, _)| *goal);
        let end = match response.status {
            GoalStatusEnum::Succeeded => GoalEnd::Succeeded,
            GoalStatusEnum::Canceled => GoalEnd::Canceled,
            _ => GoalEnd::Aborted,
        };
        if let Some(followed) = goal.and_then(|goal| self.accepted.remove(&goal)) {
            let _ = followed.events.try_send(Accepted::Ended(end, response.result));
        }
    }

    fn note_status(&mut self, goal: GoalId, status: GoalStatusEnum) {
        use GoalStatusEnum::{Aborted, Canceled, Succeeded};
        if let Some(followed) = self.accepted.get_mut(&goal)
            && matches!(status, Succeeded | Canceled | Aborted)
        {
            followed.prospect.ended.get_or_insert_with(Instant::now);
        }
    }

    fn note_cancellation(&mut self, request: RmwRequestId, code: CancelGoalResponseEnum) {
        use CancelGoalResponseEnum::{GoalTerminated, UnknownGoal};
        let followed = self.accepted.values_mut().find(|followed| followed.cancel == Some(request));
        let Some(Followed { prospect, .. }) = followed else { return };
        let since = match code {
            UnknownGoal => &mut prospect.unknown,
            GoalTerminated => &mut prospect.ended,
            _ => return,
        };
        since.get_or_insert_with(Instant::now);
    }
}

fn unreachable(action: &str, because: String) -> GoalError {
    GoalError::Unreachable { action: action.to_owned(), because }
}

fn goal_topics(action: &str) -> Topics {
    Topics::of(&format!("{action}/_action/send_goal"))
}

impl Node {
    /// Creates a client of the action `name`.
    pub fn action_caller<A: Action>(self: &Arc<Self>, name: &str) -> ActionCaller<A> {
        self.action_caller_of(name, ActionNames::of::<A>())
    }

    pub(crate) fn any_action_caller(
        self: &Arc<Self>,
        name: &str,
        kind: &ActionType,
    ) -> ActionCaller<AnyAction> {
        self.action_caller_of(name, kind.into())
    }

    fn action_caller_of<A: Action>(self: &Arc<Self>, name: &str, names: ActionNames<'_>) -> ActionCaller<A> {
        let full = self.resolve(name);
        let kind = ActionTypeName::new(names.package, names.name);
        expect_action(&self.graph, &full, names);
        ActionCaller { node: Arc::clone(self), full, kind, connection: smol::lock::Mutex::new(None) }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::time::{Duration, Instant};

    use super::{Loss, Prospect};

    #[derive(Clone, Copy)]
    enum End {
        Ended(u64),
        /// The goal ends with a result that cannot be decoded.
        Malformed(u64),
        Unknown(u64),
    }

    fn servers(names: &str) -> BTreeSet<[u8; 16]> {
        names.bytes().map(|name| [name; 16]).collect()
    }

    /// Checks the loss of a goal that the servers with the letters `before` could have accepted. `looks` are the times
    /// of look-ups in milliseconds, and the present servers. The goal ends, or the server reports it as unknown, at the
    /// time of `end`.
    fn check(before: &str, end: Option<End>, looks: &[(u64, &str)], expected: Option<(u64, Loss)>) {
        let start = Instant::now();
        let at = |millis: u64| start + Duration::from_millis(millis);
        let mut prospect = Prospect { servers: servers(before), changed: None, ended: None, unknown: None };
        let mut losses = looks.iter().filter_map(|(millis, present)| {
            let at_end = |time: u64| (time <= *millis).then(|| at(time));
            match end {
                Some(End::Ended(time) | End::Malformed(time)) => prospect.ended = at_end(time),
                Some(End::Unknown(time)) => prospect.unknown = at_end(time),
                None => {}
            }
            let is_malformed = matches!(end, Some(End::Malformed(_)));
            Some((*millis, prospect.loss(&servers(present), is_malformed, at(*millis))?))
        });
        assert_eq!(losses.next(), expected, "{before} {looks:?}");
    }

    #[test]
    fn a_goal_is_lost_with_its_server_or_without_its_result() {
        check("a", None, &[(0, "a"), (9_000_000, "a")], None);
        check("a", None, &[(0, "a"), (100, ""), (599, ""), (600, "")], Some((600, Loss::Server)));
        // An interruption of discovery is no loss.
        check("a", None, &[(100, ""), (500, "a"), (600, ""), (1000, "a"), (1200, "a")], None);
        // A new server appears while the endpoints of a crashed one remain, or takes its place.
        check("a", None, &[(0, "a"), (100, "ab"), (700, "ab")], Some((700, Loss::Server)));
        check("a", None, &[(0, "a"), (100, "b"), (700, "b")], Some((700, Loss::Server)));
        // The goal was accepted while the endpoints of a crashed server remained.
        check("ab", None, &[(0, "ab"), (20_000, "b"), (40_000, "b")], None);
        for end in [End::Malformed(100), End::Unknown(100)] {
            check("a", Some(end), &[(3000, "a"), (3100, "a")], Some((3100, Loss::Result)));
        }
        // The callback of a server continues for minutes after the end of the goal.
        let looks = [(3100, "a"), (540_000, "a"), (600_100, "a")];
        check("a", Some(End::Ended(100)), &looks, Some((600_100, Loss::Result)));
        check("a", Some(End::Ended(100)), &[(9000, ""), (9500, "")], Some((9500, Loss::Server)));
    }
}
