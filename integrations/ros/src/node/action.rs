//! Action servers and action clients.

mod caller;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::Message;
use ros2_client::ActionTypeName;
use ros2_client::action::{
    ActionServer, ActionServerQosPolicies, GetResultResponse, GoalId, GoalInfo, GoalStatusEnum,
    SendGoalResponse,
};
use ros2_client::action_msgs::{CancelGoalResponse, CancelGoalResponseEnum, GoalStatus, GoalStatusArray};
use ros2_client::builtin_interfaces::Time;
use ros2_client::request_id::RmwRequestId;
use smol::Timer;

use crate::interfaces::action_msgs::srv::CancelGoalRequest;
use crate::interfaces::{Action, Service, ServiceHashes, Structure as _};
use crate::node::graph::{Expected, Graph, Topics};
use crate::node::reply_gate::ReplyGate;
use crate::node::{Node, Severity, client_name, creation_error, dds_type, latched, qos};
use crate::types::ActionType;

pub use caller::{Accepted, ActionCaller, GoalError, Pursued};

/// Interval at which an action server polls for requests, and an action client for messages. The client library has
/// no stream of all these events.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// Minimum time for which the result of an ended goal remains available to clients. Older results are removed when
/// another goal ends.
const LIFETIME: Duration = Duration::from_secs(15 * 60);

type Server<A> = ActionServer<<A as Action>::Goal, <A as Action>::Result, <A as Action>::Feedback>;

/// Outcome of a goal of an action server.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GoalEnd {
    /// The goal was reached.
    Succeeded,
    /// The goal was cancelled.
    Canceled,
    /// The goal could not be reached.
    Aborted,
}

impl GoalEnd {
    fn status(self) -> GoalStatusEnum {
        match self {
            Self::Succeeded => GoalStatusEnum::Succeeded,
            Self::Canceled => GoalStatusEnum::Canceled,
            Self::Aborted => GoalStatusEnum::Aborted,
        }
    }
}

/// Request that a client sends to an action server.
#[derive(Debug)]
pub enum GoalEvent<A: Action> {
    /// Request for a new goal, to be answered by [`Goals::accept`] or [`Goals::reject`].
    Wanted(Wanted, A::Goal),
    /// Request to cancel a goal, to be answered by [`Goals::canceling`].
    Cancel(GoalId, CancelRequest),
}

/// Unanswered request for a new goal.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    request: RmwRequestId,
    goal: GoalId,
}

/// Unanswered request to cancel a goal.
#[derive(Debug, Clone, Copy)]
pub struct CancelRequest {
    request: RmwRequestId,
    info: Time,
    goal: GoalId,
}

/// State of an accepted goal.
#[derive(Debug)]
struct Known<R> {
    accepted: Time,
    status: GoalStatusEnum,
    /// Result of the goal and the time at which the goal ended. `None` while the goal is running.
    result: Option<(R, Instant)>,
    result_requests: Vec<RmwRequestId>,
}

/// Request to cancel one or more goals, which has a single response.
#[derive(Debug)]
struct Cancellation {
    request: RmwRequestId,
    /// Number of selected goals for which [`Goals::canceling`] was not called yet.
    undecided: usize,
    canceling: Vec<GoalInfo>,
}

impl Cancellation {
    /// Records whether a selected goal will be cancelled. Returns the response after the last goal.
    fn decide(&mut self, goal: GoalInfo, will_be: bool) -> Option<(CancelGoalResponseEnum, Vec<GoalInfo>)> {
        self.undecided = self.undecided.saturating_sub(1);
        self.canceling.extend(will_be.then_some(goal));
        let is_rejected = self.canceling.is_empty();
        let code = if is_rejected { CancelGoalResponseEnum::Rejected } else { CancelGoalResponseEnum::None };
        (self.undecided == 0).then(|| (code, std::mem::take(&mut self.canceling)))
    }
}

/// Accepted goals of an action server.
pub struct Goals<A: Action> {
    server: OnceLock<Server<A>>,
    accepted: Mutex<BTreeMap<GoalId, Known<A::Result>>>,
    cancellations: Mutex<Vec<Cancellation>>,
}

impl<A: Action> std::fmt::Debug for Goals<A> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("Goals").field(&A::NAME).finish()
    }
}

/// Requests that wait until their clients can receive the replies (see [`ReplyGate`]).
struct Gates<A: Action> {
    goals: ReplyGate<(GoalId, A::Goal)>,
    cancels: ReplyGate<ros2_client::action::CancelGoalRequest>,
    results: ReplyGate<GoalId>,
}

impl<A: Action> Gates<A> {
    fn new(action: &str) -> Self {
        Self {
            goals: ReplyGate::new(&format!("{action}/_action/send_goal")),
            cancels: ReplyGate::new(&format!("{action}/_action/cancel_goal")),
            results: ReplyGate::new(&format!("{action}/_action/get_result")),
        }
    }
}

impl<A: Action> Goals<A> {
    fn goals(&self) -> MutexGuard<'_, BTreeMap<GoalId, Known<A::Result>>> {
        self.accepted.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Accepts a requested goal and marks it as executing. Returns the id of the goal.
    pub fn accept(&self, wanted: Wanted) -> GoalId {
        let accepted = Time::now();
        let goal_state =
            Known { accepted, status: GoalStatusEnum::Executing, result: None, result_requests: Vec::new() };
        self.goals().insert(wanted.goal, goal_state);
        self.answer(wanted, true, accepted);
        self.publish_status();
        wanted.goal
    }

    /// Registers a running goal that a previous run of this program had accepted. Returns the id of
    /// the goal.
    pub fn go_on(&self, goal: [u8; 16]) -> GoalId {
        // The library has no constructor for goal ids other than deserialisation.
        let id = serde_json::from_value(serde_json::json!({ "uuid": goal })).unwrap_or(GoalId::ZERO);
        let goal_state = Known {
            accepted: Time::now(),
            status: GoalStatusEnum::Executing,
            result: None,
            result_requests: Vec::new(),
        };
        self.goals().insert(id, goal_state);
        id
    }

    /// Rejects a requested goal.
    pub fn reject(&self, wanted: Wanted) {
        self.answer(wanted, false, Time::now());
    }

    fn answer(&self, wanted: Wanted, accepted: bool, stamp: Time) {
        if let Some(server) = self.server.get() {
            // A lost response leads to a timeout of the client.
            let _ = server.send_goal_response(wanted.request, SendGoalResponse { accepted, stamp });
        }
    }

    /// Records whether a goal will be cancelled. The client gets its response after the decision
    /// about the last goal that its request selects.
    pub fn canceling(&self, request: CancelRequest, will_be: bool) {
        if will_be && let Some(known) = self.goals().get_mut(&request.goal) {
            known.status = GoalStatusEnum::Canceling;
        }
        let mut cancellations = self.cancellations.lock().unwrap_or_else(PoisonError::into_inner);
        let position = cancellations.iter().position(|waiting| waiting.request == request.request);
        let goal = GoalInfo { goal_id: request.goal, stamp: request.info };
        let response = position.and_then(|position| {
            let response = cancellations[position].decide(goal, will_be);
            response.inspect(|_| drop(cancellations.swap_remove(position)))
        });
        drop(cancellations);
        if let Some((code, canceling)) = response {
            self.answer_cancel(request.request, code, canceling);
        }
        self.publish_status();
    }

    fn answer_cancel(&self, request: RmwRequestId, code: CancelGoalResponseEnum, goals: Vec<GoalInfo>) {
        if let Some(server) = self.server.get() {
            let _ = server.send_cancel_response(
                request,
                CancelGoalResponse { return_code: code, goals_canceling: goals },
            );
        }
    }

    /// Publishes feedback on a goal.
    pub fn feedback(&self, goal: GoalId, feedback: A::Feedback) {
        if let Some(server) = self.server.get() {
            let _ = server.send_feedback(goal, feedback);
        }
    }

    /// Ends a goal, and sends the result to all clients that have requested it. Unknown goals are
    /// ignored.
    pub fn finish(&self, goal: GoalId, end: GoalEnd, result: A::Result) {
        let mut goals = self.goals();
        let Some(known) = goals.get_mut(&goal) else { return };
        known.status = end.status();
        known.result = Some((result, Instant::now()));
        for request in std::mem::take(&mut known.result_requests) {
            self.send_result(request, known);
        }
        goals.retain(|_, goal| goal.result.as_ref().is_none_or(|(_, ended)| ended.elapsed() < LIFETIME));
        drop(goals);
        self.publish_status();
    }

    fn send_result(&self, request: RmwRequestId, known: &Known<A::Result>) {
        if let (Some(server), Some((result, _))) = (self.server.get(), &known.result) {
            let _ = server
                .send_result(request, GetResultResponse { status: known.status, result: result.clone() });
        }
    }

    fn publish_status(&self) {
        let status = |(goal_id, known): (&GoalId, &Known<A::Result>)| GoalStatus {
            goal_info: GoalInfo { goal_id: *goal_id, stamp: known.accepted },
            status: known.status,
        };
        let status_list = self.goals().iter().map(status).collect();
        if let Some(server) = self.server.get() {
            let _ = server.send_goal_statuses(GoalStatusArray { status_list });
        }
    }

    /// Receives at most one new request of each service, and handles the requests that need not wait any longer.
    /// Returns descriptions of invalid requests.
    fn poll(&self, graph: &Graph, gates: &mut Gates<A>, take: &mut impl FnMut(GoalEvent<A>)) -> Vec<String> {
        let Some(server) = self.server.get() else { return Vec::new() };
        let mut errors = Vec::new();
        match server.receive_goal() {
            Ok(Some((request, goal))) => gates.goals.push(request, (goal.goal_id, goal.goal)),
            Ok(None) => {}
            Err(error) => errors.push(error.to_string()),
        }
        match server.receive_cancel_request() {
            Ok(Some((request, cancel))) => gates.cancels.push(request, cancel),
            Ok(None) => {}
            Err(error) => errors.push(error.to_string()),
        }
        match server.receive_result_request() {
            Ok(Some((request, wanted))) => gates.results.push(request, wanted.goal_id),
            Ok(None) => {}
            Err(error) => errors.push(error.to_string()),
        }
        while let Some((request, (id, goal))) = gates.goals.pop(graph) {
            let offer = Wanted { request, goal: id };
            // Like the action server of rclpy, this one rejects a second goal with the same id.
            if self.goals().contains_key(&id) {
                self.reject(offer);
            } else {
                take(GoalEvent::Wanted(offer, goal));
            }
        }
        while let Some((request, cancel)) = gates.cancels.pop(graph) {
            self.cancel(request, &cancel, take);
        }
        while let Some((request, goal)) = gates.results.pop(graph) {
            self.result(request, goal);
        }
        errors
    }

    fn result(&self, request: RmwRequestId, goal: GoalId) {
        let mut goals = self.goals();
        match goals.get_mut(&goal) {
            Some(known) if known.result.is_some() => self.send_result(request, known),
            Some(known) => known.result_requests.push(request),
            None => {
                drop(goals);
                let response =
                    GetResultResponse { status: GoalStatusEnum::Unknown, result: A::Result::default() };
                if let Some(server) = self.server.get() {
                    let _ = server.send_result(request, response);
                }
            }
        }
    }

    /// Passes each running goal that a cancel request selects to `take`: all goals, the goal with an id, the goals
    /// accepted up to a time, or the goal with an id and the goals accepted up to a time
    /// (`action_msgs/srv/CancelGoal`). Answers with an error code if the request selects no running goal.
    fn cancel(
        &self,
        request: RmwRequestId,
        cancel: &ros2_client::action::CancelGoalRequest,
        take: &mut impl FnMut(GoalEvent<A>),
    ) {
        // The library's fields are private and only accessible by serialisation.
        let Some(cancel) = serde_json::to_value(cancel)
            .ok()
            .and_then(|data| serde_json::from_value::<CancelGoalRequest>(data).ok())
        else {
            self.answer_cancel(request, CancelGoalResponseEnum::UnknownGoal, Vec::new());
            return;
        };
        let (requested, stamp) = (cancel.goal_info.goal_id.uuid, cancel.goal_info.stamp);
        let until = i128::from(stamp.sec) * 1_000_000_000 + i128::from(stamp.nanosec);
        let nanoseconds = |time: Time| i128::from(ros2_client::ros_time::ROSTime::from(time).to_nanos());
        // An id of zeros selects all goals, and a time of 0 sets no time limit.
        let (any, always) = (requested == [0; 16], until == 0);
        let is_selected = |(goal, known): &(&GoalId, &Known<A::Result>)| {
            let is_requested = goal.uuid.into_bytes() == requested;
            let is_before = nanoseconds(known.accepted) <= until;
            known.result.is_none()
                && if any { always || is_before } else { is_requested || (!always && is_before) }
        };
        let goals = self.goals();
        let selected: Vec<(GoalId, Time)> =
            goals.iter().filter(is_selected).map(|(goal, known)| (*goal, known.accepted)).collect();
        let is_known = any || goals.keys().any(|goal| goal.uuid.into_bytes() == requested);
        drop(goals);
        if selected.is_empty() {
            let code = match (is_known, any) {
                (true, false) => CancelGoalResponseEnum::GoalTerminated,
                (true, true) => CancelGoalResponseEnum::Rejected,
                (false, _) => CancelGoalResponseEnum::UnknownGoal,
            };
            self.answer_cancel(request, code, Vec::new());
            return;
        }
        let cancellation = Cancellation { request, undecided: selected.len(), canceling: Vec::new() };
        self.cancellations.lock().unwrap_or_else(PoisonError::into_inner).push(cancellation);
        for (goal, info) in selected {
            take(GoalEvent::Cancel(goal, CancelRequest { request, info, goal }));
        }
    }
}

struct ActionNames<'n> {
    package: &'n str,
    name: &'n str,
    /// Hashes of request and response.
    send_goal: [Cow<'static, str>; 2],
    get_result: [Cow<'static, str>; 2],
    feedback: Cow<'static, str>,
}

impl ActionNames<'static> {
    fn of<A: Action>() -> Self {
        let hashes = |hashes: ServiceHashes| [Cow::Borrowed(hashes.request), Cow::Borrowed(hashes.response)];
        Self {
            package: A::PACKAGE,
            name: A::NAME,
            send_goal: hashes(A::SEND_GOAL_RIHS01),
            get_result: hashes(A::GET_RESULT_RIHS01),
            feedback: A::FEEDBACK_RIHS01.into(),
        }
    }
}

impl<'n> From<&'n ActionType> for ActionNames<'n> {
    fn from(kind: &'n ActionType) -> Self {
        Self {
            package: &kind.package,
            name: &kind.name,
            send_goal: kind.send_goal.clone().map(Cow::Owned),
            get_result: kind.get_result.clone().map(Cow::Owned),
            feedback: kind.feedback.clone().into(),
        }
    }
}

fn expect_action(graph: &Graph, full: &str, names: ActionNames<'_>) {
    use crate::interfaces::action_msgs::srv::CancelGoal;
    let ActionNames { package, name, send_goal, get_result, feedback } = names;
    let part = |part: &str| format!("{name}_{part}");
    let cancel = ServiceHashes::of::<CancelGoal>();
    let cancel_goal = [cancel.request.into(), cancel.response.into()];
    let services = [
        ("send_goal", package, "action", part("SendGoal"), send_goal),
        ("get_result", package, "action", part("GetResult"), get_result),
        ("cancel_goal", CancelGoal::PACKAGE, "srv", CancelGoal::NAME.to_owned(), cancel_goal),
    ];
    for (service, package, folder, name, [request_hash, response_hash]) in services {
        let topics = Topics::of(&format!("{full}/_action/{service}"));
        let request = dds_type(package, folder, &format!("{name}_Request"));
        let response = dds_type(package, folder, &format!("{name}_Response"));
        graph.expect(topics.requests, Expected { type_name: request, hash: request_hash });
        graph.expect(topics.replies, Expected { type_name: response, hash: response_hash });
    }
    let type_name = dds_type(package, "action", &part("FeedbackMessage"));
    graph.expect(format!("rt{full}/_action/feedback"), Expected { type_name, hash: feedback });
    let status = crate::interfaces::action_msgs::msg::GoalStatusArray::RIHS01;
    let type_name = dds_type("action_msgs", "msg", "GoalStatusArray");
    graph.expect(format!("rt{full}/_action/status"), Expected { type_name, hash: status.into() });
}

impl Node {
    /// Serves an action as soon as the service mapping of the middleware is determined. `take`
    /// receives the requests of clients.
    ///
    /// # Errors
    /// Fails if the name is not a valid action name.
    pub fn serve_action<A: Action + 'static>(
        self: &Arc<Self>,
        name: &str,
        mut take: impl FnMut(GoalEvent<A>) + Send + 'static,
    ) -> Result<Arc<Goals<A>>, Message> {
        let full = self.resolve(name);
        let action_name = client_name(&full)?;
        expect_action(&self.graph, &full, ActionNames::of::<A>());
        let goals = Arc::new(Goals {
            server: OnceLock::new(),
            accepted: Mutex::default(),
            cancellations: Mutex::default(),
        });
        let (graph, weak, served) = (Arc::clone(&self.graph), Arc::downgrade(self), Arc::clone(&goals));
        self.spawn(async move {
            let mapping = graph.mapping().await;
            let Some(node) = weak.upgrade() else { return };
            let policies = ActionServerQosPolicies {
                goal_service: qos::service(),
                result_service: qos::service(),
                cancel_service: qos::service(),
                feedback_publisher: qos::depth(10),
                status_publisher: latched(1),
            };
            let kind = ActionTypeName::new(A::PACKAGE, A::NAME);
            let created =
                node.inner().create_action_server(mapping.service_mapping(), &action_name, &kind, policies);
            match created {
                Ok(server) => drop(served.server.set(server)),
                Err(error) => {
                    node.log(Severity::Fatal, &creation_error(&full, &error).message);
                    return;
                }
            }
            drop(node);
            let mut gates = Gates::<A>::new(&full);
            loop {
                for error in served.poll(&graph, &mut gates, &mut take) {
                    let Some(node) = weak.upgrade() else { return };
                    node.log(Severity::Warn, &format!("a message to {full} is malformed: {error}"));
                }
                if weak.strong_count() == 0 {
                    return;
                }
                Timer::after(POLL_INTERVAL).await;
            }
        });
        Ok(goals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn goal(byte: u8) -> GoalInfo {
        let id = serde_json::from_value(serde_json::json!({ "uuid": ([byte; 16]) })).expect("an id");
        GoalInfo { goal_id: id, stamp: Time::ZERO }
    }

    fn cancellation(undecided: usize) -> Cancellation {
        let request = RmwRequestId::default();
        Cancellation { request, undecided, canceling: Vec::new() }
    }

    #[test]
    fn a_request_to_cancel_several_goals_has_one_response() {
        let mut cancellation_of_three = cancellation(3);
        assert!(cancellation_of_three.decide(goal(1), true).is_none());
        assert!(cancellation_of_three.decide(goal(2), false).is_none());
        let (code, goals) = cancellation_of_three.decide(goal(3), true).expect("the last goal");
        assert_eq!(code, CancelGoalResponseEnum::None);
        let ids: Vec<_> = goals.iter().map(|goal| goal.goal_id).collect();
        assert_eq!(ids, [goal(1).goal_id, goal(3).goal_id]);
        let (code, goals) = cancellation(1).decide(goal(1), false).expect("the only goal");
        assert_eq!((code, goals.len()), (CancelGoalResponseEnum::Rejected, 0));
    }
}
