//! Action clients: sending, monitoring and cancelling goals.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use futures::FutureExt as _;
use metaplan::message::Message;
use ros2_client::ActionTypeName;
use ros2_client::action::{ActionClient, ActionClientQosPolicies, GoalId, GoalStatusEnum};
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

/// Maximum number of consecutive failed look-ups of a server, one per `POLL_INTERVAL`. After more, the server counts
/// as lost.
const MAX_FAILED_LOOKUPS: u32 = 250;

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

/// A client of a server with its running goals. The client library passes each message to the first
/// receiver, regardless of the goal, so a single task receives the messages about all goals.
struct Connection<A: Action> {
    server: Server,
    client: Client<A>,
    goals: Mutex<BTreeMap<GoalId, Followed<A>>>,
}

struct Followed<A: Action> {
    result: RmwRequestId,
    events: channel::Sender<Accepted<A>>,
    cancelled: channel::Receiver<()>,
}

/// A goal that an action server has accepted.
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
    /// Sends a goal, and waits until the server accepts it. `within` limits the time to wait for a
    /// server and its answer.
    ///
    /// # Errors
    /// Fails if no server of the expected type accepts the goal in time.
    pub async fn pursue(&self, goal: A::Goal, within: Duration) -> Result<Pursued<A>, GoalError> {
        let start = Instant::now();
        let unreachable = |because: String| GoalError::Unreachable { action: self.full.clone(), because };
        // The lock is held until the answer arrives: of two concurrent receivers, one could take the answer to the
        // other's goal.
        let mut connection = self.connection.lock().await;
        let connection = self.connect(&mut connection, within).await.map_err(unreachable)?;
        let (client, mapping) = (&connection.client, connection.server.mapping);
        let remaining = within.saturating_sub(start.elapsed());
        let mut timer = futures::FutureExt::fuse(Timer::after(remaining));
        let mut sent = Box::pin(client.async_send_goal(goal)).fuse();
        let (id, response) = futures::select! {
            sent = sent => sent.map_err(|error| unreachable(error.to_string()))?,
            _ = timer => {
                let text = format!(
                    "no answer to a goal after {:.1} s; it was sent with the service mapping of {mapping}; `--rmw {}` \
                     selects the other mapping",
                    within.as_secs_f64(),
                    mapping.other()
                );
                return Err(unreachable(text));
            }
        };
        if !response.accepted {
            return Err(GoalError::Rejected(self.full.clone()));
        }
        let result = client.request_result(id).map_err(|error| unreachable(error.to_string()))?;
        let (sender, events) = channel::unbounded();
        let (cancel, cancelled) = channel::bounded(1);
        let is_first = connection.follow(id, Followed { result, events: sender, cancelled });
        if is_first {
            let (graph, full, followed) =
                (Arc::clone(&self.node.graph), self.full.clone(), Arc::clone(connection));
            smol::spawn(async move { followed.run(&graph, &full).await }).detach();
        }
        Ok(Pursued { goal: id, events, cancel })
    }

    async fn connect<'c>(
        &self,
        connection: &'c mut Option<Arc<Connection<A>>>,
        within: Duration,
    ) -> Result<&'c Arc<Connection<A>>, String> {
        let topics = goal_topics(&self.full);
        let discovered = self.node.graph.wait(within, |graph| graph.server(&topics)).await;
        let server =
            discovered.ok_or_else(|| format!("it has no server after {:.1} s", within.as_secs_f64()))??;
        if connection.as_ref().is_none_or(|connected| connected.server != server) {
            let client = self.client(server.mapping).map_err(|message| message.message.clone())?;
            Timer::after(MATCHING_TIME.min(within)).await;
            *connection = Some(Arc::new(Connection { server, client, goals: Mutex::default() }));
        }
        connection.as_ref().ok_or_else(String::new)
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
    fn goals(&self) -> MutexGuard<'_, BTreeMap<GoalId, Followed<A>>> {
        self.goals.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Registers a running goal. Returns `true` if it is the only one, so that a task must be
    /// started to receive messages.
    fn follow(&self, goal: GoalId, followed: Followed<A>) -> bool {
        let mut goals = self.goals();
        let is_first = goals.is_empty();
        goals.insert(goal, followed);
        is_first
    }

    /// Forwards the messages about all goals until no goal is running. If the server is lost, all goals end with
    /// [`Accepted::Lost`].
    async fn run(&self, graph: &Graph, full: &str) {
        let topics = goal_topics(full);
        let mut absent = 0;
        loop {
            self.poll();
            absent = if graph.server(&topics).is_some() { 0 } else { absent + 1 };
            if absent > MAX_FAILED_LOOKUPS {
                for followed in std::mem::take(&mut *self.goals()).into_values() {
                    let because = format!("the server of {full} is gone");
                    let _ = followed.events.try_send(Accepted::Lost(because));
                }
            }
            if self.goals().is_empty() {
                return;
            }
            Timer::after(POLL_INTERVAL).await;
        }
    }

    fn poll(&self) {
        // Invalid messages are skipped. A goal with an invalid result ends only if the server is lost.
        while let Ok(Some((message, _))) = self.client.feedback_subscription().take() {
            if let Some(followed) = self.goals().get(&message.goal_id) {
                let _ = followed.events.try_send(Accepted::Feedback(message.feedback));
            }
        }
        while let Ok(Some((request, response))) = self.client.result_client().receive_response() {
            let mut goals = self.goals();
            let goal = goals.iter().find(|(_, followed)| followed.result == request).map(|(goal, _)| *goal);
            let end = match response.status {
                GoalStatusEnum::Succeeded => GoalEnd::Succeeded,
                GoalStatusEnum::Canceled => GoalEnd::Canceled,
                _ => GoalEnd::Aborted,
            };
            if let Some(followed) = goal.and_then(|goal| goals.remove(&goal)) {
                let _ = followed.events.try_send(Accepted::Ended(end, response.result));
            }
        }
        let wishes: Vec<GoalId> = self
            .goals()
            .iter()
            .filter(|(_, pursued)| pursued.cancelled.try_recv().is_ok())
            .map(|(goal, _)| *goal)
            .collect();
        for goal in wishes {
            let _ = self.client.cancel_goal(goal);
        }
    }
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
