//! A node of a ROS 2 graph over DDS: topics, services, actions, parameters, log and lifecycle, without a ROS
//! installation.
//!
//! Names are expanded and remapped as in ROS 2. Received messages are passed to closures, which must return quickly, on
//! a thread of the executor. Samples of the wrong type and endpoints with another type are reported and ignored.
//! Without a selected mapping, our own services wait until a participant reveals its mapping, at most for one second
//! after the first discovery (see `rmw`).

mod action;
mod any_topic;
mod arguments;
mod clock;
mod departure;
mod graph;
mod lifecycle;
mod log;
mod names;
mod network;
mod parameters;
mod preemptive;
mod qos;
mod reply_gate;
mod rmw;
mod service;
mod topic;

use std::collections::HashSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use metaplan::message::Message;
use ros2_client::dds::Context;
use ros2_client::dds::rustdds::DomainParticipant;
use ros2_client::{NodeName, NodeOptions};
use smol::{Task, Timer};

pub use action::{
    Accepted, ActionCaller, CancelRequest, GoalEnd, GoalError, GoalEvent, Goals, Pursued, Wanted,
};
pub(crate) use any_topic::Arrivals;
pub use arguments::RosArguments;
pub(crate) use arguments::parameter_value;
pub(crate) use clock::Clock;
pub(crate) use lifecycle::PrimaryState;
pub use lifecycle::{Lifecycle, Phase};
pub use log::Severity;
pub(crate) use names::valid_name;
pub use network::Network;
pub use parameters::Declared;
pub(crate) use parameters::{any_value, fitting, parameter, raw};
pub use rmw::Rmw;
pub use service::{CallError, Caller, Responder};
pub use topic::Publisher;

pub(crate) use graph::Endpoints;

use graph::Graph;
use names::FullName;
use preemptive::Preemptive;

pub use qos::{depth, keep_all, latched};

/// Upper limit on the time for which [`Node::close`] waits for the background tasks.
const CLOSING_TIMEOUT: Duration = Duration::from_secs(1);

/// Options for creating a node.
#[derive(Debug, Clone)]
pub struct Opening {
    /// Name of the node, unless `__node` is remapped.
    pub name: String,
    /// Arguments after `--ros-args`.
    pub arguments: RosArguments,
    /// ROS domain and discovery range.
    pub network: Network,
    /// Middleware of the other participants.
    pub rmw: Rmw,
}

/// A node of the ROS graph.
pub struct Node {
    inner: Mutex<ros2_client::Node>,
    name: FullName,
    arguments: RosArguments,
    graph: Arc<Graph>,
    least: Severity,
    warned: Mutex<HashSet<String>>,
    tasks: Mutex<Vec<Task<()>>>,
    clock: Arc<Clock>,
    participant: DomainParticipant,
    network: Network,
}

impl std::fmt::Debug for Node {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("Node").field(&self.name.to_string()).finish()
    }
}

impl Node {
    /// Joins the graph. [`Node::declare`] must be called next, to declare the parameters.
    ///
    /// # Errors
    /// The name is wrong, the log level is unknown, or the network is not available.
    pub fn open(opening: Opening) -> Result<Arc<Self>, Message> {
        let Opening { name, arguments, network, rmw } = opening;
        let name = arguments.node(&name);
        let failed = |error: &dyn std::fmt::Display| {
            let text = format!("no participant in domain {}: {error}", network.domain);
            Message::error("N120", text)
        };
        let participant = network.participant().build().map_err(|error| failed(&error))?;
        let guid = ros2_client::dds::rustdds::RTPSEntity::guid(&participant).to_bytes();
        // The prefix identifies the participant. The graph ignores endpoints with this prefix.
        let mut prefix = [0; 12];
        prefix.copy_from_slice(&guid[..12]);
        let (preemptive, answering) =
            Preemptive::open(&participant, network.loopback).map_err(|error| failed(&error))?;
        let (graph, watching) = Graph::watch(&participant, prefix, rmw, preemptive);
        let context =
            Context::from_domain_participant(participant.clone()).map_err(|error| failed(&error))?;
        let node_name = NodeName::new(name.namespace(), name.name())
            .map_err(|error| Message::error("N121", format!("`{name}` is not a valid node name: {error}")))?;
        let options = NodeOptions::new().start_parameter_services(false).allow_undeclared_parameters(true);
        let inner = context.new_node(node_name, options).map_err(|error| failed(&error))?;
        let least = match arguments.log_level.as_deref() {
            None => Severity::Info,
            Some(level) => Severity::parse(level).ok_or_else(|| {
                Message::error(
                    "N101",
                    format!("`{level}` is not a level of the log; debug, info, warn, error and fatal are"),
                )
            })?,
        };
        let node = Arc::new(Self {
            inner: Mutex::new(inner),
            name,
            arguments,
            graph,
            least,
            warned: Mutex::default(),
            tasks: Mutex::new(vec![watching, answering]),
            clock: Clock::new(),
            participant,
            network,
        });
        node.report_complaints();
        Ok(node)
    }

    /// Ends the background tasks and announces the departure to participants of Fast DDS. The library announces it to
    /// other participants when the node is dropped. Without this call, the tasks may hold the participant until the
    /// program ends, and other participants notice the departure only when the lease expires.
    pub fn close(&self) {
        let tasks = std::mem::take(&mut *self.tasks.lock().unwrap_or_else(PoisonError::into_inner));
        let canceled = futures::future::join_all(tasks.into_iter().map(Task::cancel));
        // A task that does not end must not keep the program from ending.
        let timeout = Timer::after(CLOSING_TIMEOUT);
        smol::block_on(futures::future::select(canceled, timeout));
        departure::announce(&self.participant, self.network.loopback);
    }

    /// Full name with namespace, such as `/uuv/metaplan`.
    pub fn full_name(&self) -> String {
        self.name.to_string()
    }

    /// Returns the full name of a topic, service or action of this node after remapping.
    pub fn resolve(&self, name: &str) -> String {
        self.arguments.remap(name, &self.name)
    }

    /// Returns `true` if a topic has a publisher of another participant.
    pub fn is_written(&self, topic: &str) -> bool {
        self.graph.has_writer(&format!("rt{}", self.resolve(topic)))
    }

    pub(crate) fn endpoints(&self) -> Endpoints {
        self.graph.interfaces()
    }

    fn inner(&self) -> MutexGuard<'_, ros2_client::Node> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs a background task until it ends, or the node is closed or dropped.
    fn spawn(&self, work: impl Future<Output = ()> + Send + 'static) {
        let mut tasks = self.tasks.lock().unwrap_or_else(PoisonError::into_inner);
        tasks.retain(|task| !task.is_finished());
        tasks.push(smol::spawn(work));
    }

    fn report_complaints(self: &Arc<Self>) {
        const PERIOD: Duration = Duration::from_millis(100);
        let node = Arc::downgrade(self);
        self.spawn(async move {
            while let Some(node) = node.upgrade() {
                for complaint in node.graph.complaints() {
                    node.log(Severity::Warn, &complaint);
                }
                drop(node);
                Timer::after(PERIOD).await;
            }
        });
    }
}

fn dds_type(package: &str, kind: &str, name: &str) -> String {
    format!("{package}::{kind}::dds_::{name}_")
}

fn client_name(full: &str) -> Result<ros2_client::Name, Message> {
    ros2_client::Name::parse(full).map_err(|error| {
        Message::error("N121", format!("`{full}` is not a valid name of a topic, service or action: {error}"))
    })
}

fn creation_error(entity: &str, error: &dyn std::fmt::Display) -> Message {
    Message::error("N122", format!("{entity} could not be created: {error}"))
}

/// Returns `true` if `ROS_DISTRO` is `lyrical` or `rolling`, in which some message types differ.
pub(crate) fn is_lyrical() -> bool {
    std::env::var("ROS_DISTRO").is_ok_and(|name| ["lyrical", "rolling"].contains(&name.trim()))
}

pub(crate) fn now() -> crate::interfaces::builtin_interfaces::msg::Time {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    crate::interfaces::builtin_interfaces::msg::Time {
        sec: i32::try_from(since.as_secs()).unwrap_or(i32::MAX),
        nanosec: since.subsec_nanos(),
    }
}
