//! Actions that others do: goals are sent, followed and cancelled.

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
use crate::node::action::{GoalEnd, POLL, expect_action};
use crate::node::graph::{Graph, Server, Topics};
use crate::node::rmw::Mapping;
use crate::node::{Node, client_name, latched, not_made, qos};

/// After a server was discovered, so long is waited for it to discover us.
const MATCHING: Duration = Duration::from_millis(100);

/// A server that is missing when it is looked for more often than this in a row is gone.
const GONE: u32 = 250;

type Client<A> = ActionClient<<A as Action>::Goal, <A as Action>::Result, <A as Action>::Feedback>;

/// What is heard of a goal that somebody else has accepted.
#[derive(Debug, Clone, PartialEq)]
pub enum Accepted<A: Action> {
    /// How it goes.
    Feedback(A::Feedback),
    /// How it has ended.
    Ended(GoalEnd, A::Result),
    /// Nobody knows how it ends.
    Lost(String),
}

/// Why a goal is not pursued.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GoalError {
    /// Nobody serves the action, or whoever does does not answer.
    #[error("{action}: {because}")]
    Unreachable {
        /// Its full name.
        action: String,
        /// What has happened.
        because: String,
    },
    /// The server does not want it.
    #[error("{0} has rejected the goal")]
    Rejected(String),
}

/// Has actions done by somebody else.
pub struct ActionCaller<A: Action> {
    node: Arc<Node>,
    full: String,
    connection: smol::lock::Mutex<Option<Arc<Connection<A>>>>,
}

/// A client with the goals that are under way. The client library gives what is heard to whoever asks first, whichever goal it is
/// about; so one task asks for all goals.
struct Connection<A: Action> {
    server: Server,
    client: Client<A>,
    goals: Mutex<BTreeMap<GoalId, Followed<A>>>,
}

/// Who is told of a goal.
struct Followed<A: Action> {
    result: RmwRequestId,
    events: channel::Sender<Accepted<A>>,
    cancelled: channel::Receiver<()>,
}

/// A goal that somebody else pursues.
#[derive(Debug)]
pub struct Pursued<A: Action> {
    goal: GoalId,
    /// What is heard of it; ends with its end.
    pub events: channel::Receiver<Accepted<A>>,
    cancel: channel::Sender<()>,
}

impl<A: Action> Pursued<A> {
    /// The goal's number, as in logs.
    pub fn goal(&self) -> GoalId {
        self.goal
    }

    /// Asks for a safe end, which is heard of as any other.
    pub fn cancel(&self) {
        // Asked twice is asked once.
        let _ = self.cancel.try_send(());
    }
}

impl<A: Action> std::fmt::Debug for ActionCaller<A> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("ActionCaller").field(&self.full).finish()
    }
}

impl<A: Action + 'static> ActionCaller<A> {
    /// Sends a goal; `within` is how long a server is waited for, and its answer.
    ///
    /// # Errors
    /// There is no server, no answer, or the goal is rejected.
    pub async fn pursue(&self, goal: A::Goal, within: Duration) -> Result<Pursued<A>, GoalError> {
        let begun = Instant::now();
        let unreachable = |because: String| GoalError::Unreachable { action: self.full.clone(), because };
        // Held until there is an answer: two who wait would take each other's.
        let mut connection = self.connection.lock().await;
        let connection = self.connect(&mut connection, within).await.map_err(unreachable)?;
        let (client, mapping) = (&connection.client, connection.server.mapping);
        let left = within.saturating_sub(begun.elapsed());
        let mut timer = futures::FutureExt::fuse(Timer::after(left));
        let mut sent = Box::pin(client.async_send_goal(goal)).fuse();
        let (id, response) = futures::select! {
            sent = sent => sent.map_err(|error| unreachable(error.to_string()))?,
            _ = timer => {
                let text = format!(
                    "no answer to a goal after {:.1} s; it was sent with the mapping of {mapping}, `--rmw {}` has the other one",
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
        let found = self.node.graph.wait(within, |graph| graph.server(&topics)).await;
        let server =
            found.ok_or_else(|| format!("nobody serves it after {:.1} s", within.as_secs_f64()))??;
        if connection.as_ref().is_none_or(|own| own.server != server) {
            let client = self.client(server.mapping).map_err(|message| message.message.clone())?;
            // What is answered before the server has discovered us is lost.
            Timer::after(MATCHING.min(within)).await;
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
        let kind = ActionTypeName::new(A::PACKAGE, A::NAME);
        self.node
            .inner()
            .create_action_client(mapping.service_mapping(), &name, &kind, policies)
            .map_err(|error| not_made(&self.full, &error))
    }
}

impl<A: Action + 'static> Connection<A> {
    fn goals(&self) -> MutexGuard<'_, BTreeMap<GoalId, Followed<A>>> {
        self.goals.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a goal; returns whether nobody asks for what is heard yet.
    fn follow(&self, goal: GoalId, followed: Followed<A>) -> bool {
        let mut goals = self.goals();
        let is_first = goals.is_empty();
        goals.insert(goal, followed);
        is_first
    }

    /// Hands on what is heard of all goals, as long as there are any.
    async fn run(&self, graph: &Graph, full: &str) {
        let topics = goal_topics(full);
        let mut absent = 0;
        loop {
            self.poll();
            absent = if graph.server(&topics).is_some() { 0 } else { absent + 1 };
            if absent > GONE {
                for followed in std::mem::take(&mut *self.goals()).into_values() {
                    let because = format!("nobody serves {full} any more");
                    let _ = followed.events.try_send(Accepted::Lost(because));
                }
            }
            if self.goals().is_empty() {
                return;
            }
            Timer::after(POLL).await;
        }
    }

    fn poll(&self) {
        // What is not an answer is left out; a goal whose result is none is never heard of again, as with any client.
        while let Ok(Some((message, _))) = self.client.feedback_subscription().take() {
            if let Some(followed) = self.goals().get(&message.goal_id) {
                let _ = followed.events.try_send(Accepted::Feedback(message.feedback));
            }
        }
        while let Ok(Some((request, response))) = self.client.result_client().receive_response() {
            let mut goals = self.goals();
            let goal = goals.iter().find(|(_, own)| own.result == request).map(|(goal, _)| *goal);
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
            .filter(|(_, own)| own.cancelled.try_recv().is_ok())
            .map(|(goal, _)| *goal)
            .collect();
        for goal in wishes {
            let _ = self.client.cancel_goal(goal);
        }
    }
}

/// Topics of the service that accepts goals.
fn goal_topics(action: &str) -> Topics {
    Topics::of(&format!("{action}/_action/send_goal"))
}

impl Node {
    /// To have an action done by somebody else.
    pub fn action_caller<A: Action>(self: &Arc<Self>, name: &str) -> ActionCaller<A> {
        let full = self.resolve(name);
        expect_action::<A>(&self.graph, &full);
        ActionCaller { node: Arc::clone(self), full, connection: smol::lock::Mutex::new(None) }
    }
}
