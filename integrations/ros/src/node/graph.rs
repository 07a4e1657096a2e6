//! ROS graph from DDS discovery: participants with their vendors, and endpoints with their types.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use futures::StreamExt as _;
use ros2_client::Gid;
use ros2_client::dds::rustdds::policy::Durability;
use ros2_client::dds::rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, EndpointDescription, GUID, StatusEvented as _,
};

use smol::{Task, Timer};

use crate::node::preemptive::Preemptive;
use crate::node::rmw::{Mapping, Rmw, Vendor};

const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Time after the first discovery of a participant. If no participant has determined the service mapping by then, the
/// enhanced mapping is selected.
const DISCOVERY_WAIT: Duration = Duration::from_secs(1);

#[derive(Debug)]
pub(crate) struct Graph {
    rmw: Rmw,
    own_prefix: [u8; 12],
    state: Mutex<GraphState>,
}

#[derive(Debug, Default)]
struct GraphState {
    /// Vendors of the participants, by GUID prefix.
    participants: BTreeMap<[u8; 12], Vendor>,
    first: Option<Instant>,
    endpoints: BTreeMap<[u8; 16], Endpoint>,
    matched_readers: BTreeSet<[u8; 16]>,
    /// Mapping of our own services, once it is decided.
    mapping: Option<Mapping>,
    /// Expected types by the DDS names of the topics.
    expected: BTreeMap<String, Expected>,
    complaints: Vec<String>,
    reported: BTreeSet<String>,
}

#[derive(Debug, Clone)]
pub(crate) struct Expected {
    /// DDS name of the type.
    pub(crate) type_name: String,
    /// Type hash (`RIHS01_…`), or empty if unknown. Compared only with endpoints that publish a hash.
    pub(crate) hash: Cow<'static, str>,
}

/// DDS names of the two topics of a service.
#[derive(Debug, Clone)]
pub(crate) struct Topics {
    pub(crate) requests: String,
    pub(crate) replies: String,
}

impl Topics {
    pub(crate) fn of(service: &str) -> Self {
        Self { requests: format!("rq{service}Request"), replies: format!("rr{service}Reply") }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Server {
    pub(crate) mapping: Mapping,
    /// GUID of the reader of its requests.
    pub(crate) reader: [u8; 16],
}

/// A reader or writer of another participant.
#[derive(Debug, Clone)]
struct Endpoint {
    is_reader: bool,
    topic: String,
    type_name: String,
    hash: Option<String>,
    /// `true` if late readers receive the last samples: reliable and not volatile.
    is_latched: bool,
}

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Endpoints {
    /// Types of the topics that have a publisher, by name. `/rosout`, `/parameter_events`, `/diagnostics`,
    /// and the topics of lifecycles and actions are omitted.
    pub(crate) topics: BTreeMap<String, String>,
    pub(crate) services: BTreeMap<String, String>,
    pub(crate) actions: BTreeMap<String, String>,
    pub(crate) lifecycle_nodes: Vec<String>,
    /// Names of the systems of `system_modes` (nodes with a service `change_mode`), without the leading slash.
    pub(crate) systems: Vec<String>,
}

impl Endpoints {
    /// Adds the topic, service or action of a publisher or server, unless it is omitted. Returns
    /// `None` if the names are not those of a ROS 2 publisher or server.
    fn add(&mut self, endpoint: &Endpoint) -> Option<()> {
        let (package, rest) = endpoint.type_name.split_once("::")?;
        let (kind, rest) = rest.split_once("::dds_::")?;
        let name = rest.strip_suffix('_')?;
        if let Some(topic) = endpoint.topic.strip_prefix("rt").filter(|_| !endpoint.is_reader) {
            let is_common = ["/rosout", "/parameter_events", "/diagnostics"].contains(&topic)
                || topic.ends_with("/transition_event")
                || topic.contains("/_action/");
            if !is_common {
                self.topics.insert(topic.to_owned(), format!("{package}/{kind}/{name}"));
            }
            return Some(());
        }
        let service =
            endpoint.topic.strip_prefix("rq")?.strip_suffix("Request").filter(|_| endpoint.is_reader)?;
        if let Some(action) = service.strip_suffix("/_action/send_goal") {
            let name = name.strip_suffix("_SendGoal_Request")?;
            self.actions.insert(action.to_owned(), format!("{package}/action/{name}"));
        } else if !service.contains("/_action/") {
            let name = name.strip_suffix("_Request")?;
            self.services.insert(service.to_owned(), format!("{package}/{kind}/{name}"));
        }
        Some(())
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Writer {
    pub(crate) type_name: String,
    pub(crate) is_latched: bool,
}

impl Graph {
    /// Watches discovery until the returned task is dropped. Meanwhile, no other status listener of `participant` may
    /// be used, because each status event reaches only one listener.
    pub(crate) fn watch(
        participant: &DomainParticipant,
        own_prefix: [u8; 12],
        rmw: Rmw,
        preemptive: Arc<Preemptive>,
    ) -> (Arc<Self>, Task<()>) {
        // A mapping that the user has selected is valid before the first participant is discovered.
        let state = GraphState { mapping: rmw.fixed(), ..GraphState::default() };
        let graph = Arc::new(Self { rmw, own_prefix, state: Mutex::new(state) });
        let (listener, watching) = (participant.status_listener(), Arc::clone(&graph));
        let participant = participant.clone();
        let task = smol::spawn(async move {
            let mut events = listener.as_async_status_stream();
            while let Some(event) = events.next().await {
                if let DomainParticipantStatusEvent::RemoteWriterMatched { local_reader, remote_writer } =
                    event
                    && watching.is_fast_dds(remote_writer)
                {
                    preemptive.request_heartbeat(&participant, bytes(local_reader), bytes(remote_writer));
                }
                let discovered = match &event {
                    DomainParticipantStatusEvent::ParticipantDiscovered { dpd } => Some(prefix(dpd.guid)),
                    _ => None,
                };
                watching.take(event);
                if let Some(prefix) = discovered
                    && watching.state().participants.get(&prefix) == Some(&Vendor::FastDds)
                {
                    let graph = Arc::clone(&watching);
                    preemptive.request_endpoints(&participant, own_prefix, prefix, move |are_readers| {
                        graph.has_endpoint_of(prefix, are_readers)
                    });
                }
            }
        });
        (graph, task)
    }

    fn state(&self) -> MutexGuard<'_, GraphState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_fast_dds(&self, endpoint: GUID) -> bool {
        self.state().participants.get(&prefix(endpoint)) == Some(&Vendor::FastDds)
    }

    /// Returns `true` if a reader (`is_reader`) or a writer of the participant is known, or if the participant has
    /// left.
    fn has_endpoint_of(&self, participant: [u8; 12], is_reader: bool) -> bool {
        let state = self.state();
        let is_it = |(guid, endpoint): (&[u8; 16], &Endpoint)| {
            guid[..12] == participant && endpoint.is_reader == is_reader
        };
        !state.participants.contains_key(&participant) || state.endpoints.iter().any(is_it)
    }

    fn take(&self, event: DomainParticipantStatusEvent) {
        use DomainParticipantStatusEvent as Event;
        match event {
            Event::ParticipantDiscovered { dpd } => {
                let prefix = prefix(dpd.guid);
                if prefix != self.own_prefix {
                    self.state().met(prefix, Vendor::new(dpd.vendor_id.as_bytes()));
                }
            }
            Event::ParticipantLost { id, .. } => {
                let lost: &[u8] = id.as_ref();
                let mut state = self.state();
                state.participants.retain(|prefix, _| prefix != lost);
                state.endpoints.retain(|guid, _| &guid[..12] != lost);
                state.matched_readers.retain(|guid| &guid[..12] != lost);
            }
            Event::ReaderDetected { reader } => self.found(true, reader),
            Event::WriterDetected { writer } => self.found(false, writer),
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                let mut state = self.state();
                state.endpoints.remove(&bytes(guid));
                state.matched_readers.remove(&bytes(guid));
            }
            Event::RemoteReaderMatched { remote_reader, .. } => {
                self.state().matched_readers.insert(bytes(remote_reader));
            }
            Event::RemoteReaderQosIncompatible { remote_reader, .. } => self.incompatible(remote_reader),
            Event::RemoteWriterQosIncompatible { remote_writer, .. } => self.incompatible(remote_writer),
            _ => {}
        }
    }

    fn found(&self, is_reader: bool, description: EndpointDescription) {
        let guid = bytes(description.guid);
        if guid[..12] == self.own_prefix {
            return;
        }
        let EndpointDescription { topic_name: topic, type_name, user_data, qos, .. } = description;
        let is_latched =
            qos.is_reliable() && qos.durability().is_some_and(|kept| kept != Durability::Volatile);
        let endpoint = Endpoint { is_reader, topic, type_name, hash: type_hash(&user_data), is_latched };
        let mut state = self.state();
        let complaint = state.expected.get(&endpoint.topic).and_then(|expected| endpoint.complaint(expected));
        state.complaints.extend(complaint);
        state.endpoints.insert(guid, endpoint);
    }

    fn incompatible(&self, guid: GUID) {
        let mut state = self.state();
        let topic = state.endpoints.get(&bytes(guid)).map(|endpoint| endpoint.topic.clone());
        if let Some(topic) = topic {
            state
                .complaints
                .push(format!("an endpoint of {topic} has a quality of service that does not fit ours"));
        }
    }

    /// Sets the expected type of a topic. Endpoints with another type or type hash are reported, and the
    /// messages of such writers are ignored.
    pub(crate) fn expect(&self, topic: String, expected: Expected) {
        let mut state = self.state();
        let complaints: Vec<String> = state
            .endpoints
            .values()
            .filter(|endpoint| endpoint.topic == topic)
            .filter_map(|endpoint| endpoint.complaint(&expected))
            .collect();
        state.complaints.extend(complaints);
        state.expected.insert(topic, expected);
    }

    /// Returns the problems found since the last call, without those that were returned before.
    pub(crate) fn complaints(&self) -> Vec<String> {
        let mut state = self.state();
        let new = std::mem::take(&mut state.complaints);
        new.into_iter().filter(|complaint| state.reported.insert(complaint.clone())).collect()
    }

    pub(crate) fn is_unfit(&self, writer: Gid) -> bool {
        let state = self.state();
        state.endpoints.get(&writer.to_bytes16()).is_some_and(|endpoint| {
            state.expected.get(&endpoint.topic).is_some_and(|expected| endpoint.complaint(expected).is_some())
        })
    }

    /// Returns `true` if a topic, given by its DDS name, has a writer.
    pub(crate) fn has_writer(&self, topic: &str) -> bool {
        self.state().endpoints.values().any(|endpoint| !endpoint.is_reader && endpoint.topic == topic)
    }

    pub(crate) fn interfaces(&self) -> Endpoints {
        let mut interfaces = Endpoints::default();
        for endpoint in self.state().endpoints.values() {
            let _ = interfaces.add(endpoint);
        }
        let servers = |name: &str, kind: &str| -> Vec<String> {
            let of_kind = interfaces.services.iter().filter(|(_, served)| *served == kind);
            of_kind.filter_map(|(service, _)| service.strip_suffix(name)).map(str::to_owned).collect()
        };
        interfaces.lifecycle_nodes = servers("/get_state", "lifecycle_msgs/srv/GetState");
        let systems = servers("/change_mode", "system_modes_msgs/srv/ChangeMode");
        interfaces.systems = systems.iter().map(|system| system.trim_start_matches('/').to_owned()).collect();
        interfaces
    }

    /// Returns a writer of a topic, given by its DDS name.
    pub(crate) fn writer(&self, topic: &str) -> Option<Writer> {
        let state = self.state();
        let writer =
            state.endpoints.values().find(|endpoint| !endpoint.is_reader && endpoint.topic == topic)?;
        Some(Writer { type_name: writer.type_name.clone(), is_latched: writer.is_latched })
    }

    /// Returns the server of a service if there is one. An endpoint with another type name is an error. A
    /// differing type hash is not: DDS has matched the type names, and the warning has been logged.
    pub(crate) fn server(&self, topics: &Topics) -> Option<Result<Server, String>> {
        let state = self.state();
        let endpoint = |topic: &str, is_reader: bool| {
            let fits =
                |entry: &(&[u8; 16], &Endpoint)| entry.1.is_reader == is_reader && entry.1.topic == topic;
            state.endpoints.iter().find(fits)
        };
        let ((guid, reader), (_, writer)) =
            (endpoint(&topics.requests, true)?, endpoint(&topics.replies, false)?);
        for endpoint in [reader, writer] {
            let expected = state.expected.get(&endpoint.topic);
            if let Some(complaint) = expected.and_then(|expected| endpoint.wrong_type(expected)) {
                return Some(Err(complaint));
            }
        }
        let vendor = Vendor::new([guid[0], guid[1]]);
        let mapping = self.rmw.fixed().or_else(|| vendor.mapping()).or(state.mapping);
        Some(Ok(Server { mapping: mapping.unwrap_or(Mapping::Enhanced), reader: *guid }))
    }

    /// Returns `true` if the reply reader of a client is matched with our reply writer. Otherwise,
    /// a reply would be lost.
    ///
    /// Fast DDS identifies a client by its reply reader. Other middlewares with the enhanced
    /// mapping use its request writer: then its participant must have at least as many matched
    /// reply readers as request writers. Cyclone DDS identifies a client by eight bytes that are no
    /// GUID: then this must hold for each participant with request writers.
    pub(crate) fn can_reply(&self, topics: &Topics, client: Gid) -> bool {
        let client = client.to_bytes16();
        let state = self.state();
        let is_known = state.participants.keys().any(|prefix| *prefix == client[..12]);
        if is_known && is_reader(client) {
            return state.matched_readers.contains(&client);
        }
        let mut unmatched: BTreeMap<&[u8], i64> = BTreeMap::new();
        for (guid, endpoint) in &state.endpoints {
            if !endpoint.is_reader && endpoint.topic == topics.requests {
                *unmatched.entry(&guid[..12]).or_default() += 1;
            } else if endpoint.topic == topics.replies && state.matched_readers.contains(guid) {
                *unmatched.entry(&guid[..12]).or_default() -= 1;
            }
        }
        if is_known {
            unmatched.retain(|prefix, _| *prefix == &client[..12]);
        }
        !unmatched.is_empty() && unmatched.values().all(|count| *count <= 0)
    }

    /// Returns the GUIDs of the readers of a topic, given by its DDS name.
    pub(crate) fn readers(&self, topic: &str) -> BTreeSet<[u8; 16]> {
        let state = self.state();
        let fits = |endpoint: &Endpoint| endpoint.is_reader && endpoint.topic == topic;
        state.endpoints.iter().filter(|(_, endpoint)| fits(endpoint)).map(|(guid, _)| *guid).collect()
    }

    /// Returns the GUIDs of the request readers of a service's servers. A reader whose participant has no reply writer
    /// is no server, and so is one of another type.
    pub(crate) fn servers(&self, topics: &Topics) -> BTreeSet<[u8; 16]> {
        let mut servers = self.readers(&topics.requests);
        let state = self.state();
        let is_writer = |endpoint: &Endpoint| !endpoint.is_reader && endpoint.topic == topics.replies;
        let writers = state.endpoints.iter().filter(|(_, endpoint)| is_writer(endpoint));
        let participants: BTreeSet<&[u8]> = writers.map(|(guid, _)| &guid[..12]).collect();
        let has_type = |guid: &[u8; 16]| {
            let types = state.endpoints.get(guid).zip(state.expected.get(&topics.requests));
            types.is_none_or(|(endpoint, expected)| endpoint.wrong_type(expected).is_none())
        };
        servers.retain(|guid| participants.contains(&guid[..12]) && has_type(guid));
        servers
    }

    /// Returns the number of readers of a topic, given by its DDS name, that a writer of ours has matched.
    pub(crate) fn matched_readers(&self, topic: &str) -> usize {
        let readers = self.readers(topic);
        let state = self.state();
        readers.iter().filter(|reader| state.matched_readers.contains(*reader)).count()
    }

    /// Waits until the mapping of our own services is determined: by the user, or by a discovered participant whose
    /// middleware supports only one mapping. Without such a participant, the enhanced mapping is selected
    /// [`DISCOVERY_WAIT`] after the first discovery.
    pub(crate) async fn mapping(&self) -> Mapping {
        loop {
            if let Some(mapping) = self.decide() {
                return mapping;
            }
            Timer::after(POLL_INTERVAL).await;
        }
    }

    fn decide(&self) -> Option<Mapping> {
        let mut state = self.state();
        if state.mapping.is_none() {
            let met = state.participants.values().find_map(|vendor| vendor.mapping());
            let waited = state.first.is_some_and(|first| first.elapsed() >= DISCOVERY_WAIT);
            state.mapping = met.or_else(|| waited.then_some(Mapping::Enhanced));
        }
        state.mapping
    }

    pub(crate) async fn wait<T>(&self, within: Duration, look: impl Fn(&Self) -> Option<T>) -> Option<T> {
        let until = Instant::now() + within;
        loop {
            match look(self) {
                Some(found) => return Some(found),
                None if Instant::now() >= until => return None,
                None => {
                    Timer::after(POLL_INTERVAL).await;
                }
            }
        }
    }
}

impl GraphState {
    fn met(&mut self, prefix: [u8; 12], vendor: Vendor) {
        self.first.get_or_insert_with(Instant::now);
        let is_new = self.participants.insert(prefix, vendor).is_none();
        if let (true, Some(own_mapping), Some(other_mapping)) = (is_new, self.mapping, vendor.mapping())
            && own_mapping != other_mapping
        {
            self.complaints.push(format!(
                "a participant with {other_mapping} was discovered, and our services are mapped as by {own_mapping}: it cannot call them; `--rmw {}` \
                 maps them the other way",
                own_mapping.other()
            ));
        }
    }
}

impl Endpoint {
    /// Describes a difference from the expected type name or type hash, if there is one.
    fn complaint(&self, expected: &Expected) -> Option<String> {
        self.wrong_type(expected).or_else(|| {
            let differs = |hash: &&str| *hash != expected.hash && !expected.hash.is_empty();
            let hash = self.hash.as_deref().filter(differs)?;
            Some(format!(
                "a {} of {} has another definition of {}: its type hash is {hash}, ours is {}",
                self.kind(),
                self.topic,
                self.type_name,
                expected.hash
            ))
        })
    }

    fn wrong_type(&self, expected: &Expected) -> Option<String> {
        (self.type_name != expected.type_name).then(|| {
            format!(
                "a {} of {} has the type {}, and should have {}",
                self.kind(),
                self.topic,
                self.type_name,
                expected.type_name
            )
        })
    }

    fn kind(&self) -> &'static str {
        if self.is_reader { "reader" } else { "writer" }
    }
}

/// Returns `true` if a GUID belongs to a reader of user data (RTPS 2.5, table 9.1).
fn is_reader(guid: [u8; 16]) -> bool {
    matches!(guid[15], 0x04 | 0x07)
}

/// Parses the type hash that endpoints of ROS 2 Iron and later publish: `typehash=RIHS01_…;` in their user data (REP
/// 2011).
fn type_hash(user_data: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(without_length(user_data));
    let hash = text.split(';').find_map(|part| part.trim_matches('\0').strip_prefix("typehash="))?;
    // An unknown hash is all zero, and other versions are not comparable.
    let digits = hash.strip_prefix("RIHS01_")?;
    digits.bytes().any(|digit| digit != b'0').then(|| hash.to_owned())
}

/// Removes the length before user data and the padding after them, which the library does not remove. Data without a
/// valid length are returned unchanged.
fn without_length(user_data: &[u8]) -> &[u8] {
    let Some((length, content)) = user_data.split_first_chunk() else { return user_data };
    // The length has the byte order of the discovery message, which the library does not expose. So both orders are
    // tried, and the first length that fits is used.
    let lengths = [u32::from_le_bytes(*length), u32::from_be_bytes(*length)];
    let content = lengths.into_iter().find_map(|length| content.get(..length as usize));
    content.unwrap_or(user_data)
}

fn bytes(guid: GUID) -> [u8; 16] {
    guid.to_bytes()
}

fn prefix(guid: GUID) -> [u8; 12] {
    let mut prefix = [0; 12];
    prefix.copy_from_slice(&guid.to_bytes()[..12]);
    prefix
}

#[cfg(test)]
mod tests {
    use super::{Endpoint, Endpoints, Expected, type_hash};

    #[test]
    fn interfaces_are_named_as_in_ros() {
        let mut interfaces = Endpoints::default();
        for (is_reader, topic, type_name) in [
            (false, "rt/scan", "sensor_msgs::msg::dds_::LaserScan_"),
            (true, "rt/cmd", "std_msgs::msg::dds_::Bool_"),
            (false, "rt/rosout", "rcl_interfaces::msg::dds_::Log_"),
            (true, "rq/lampRequest", "std_srvs::srv::dds_::SetBool_Request_"),
            (false, "rr/lampReply", "std_srvs::srv::dds_::SetBool_Response_"),
            (
                true,
                "rq/go/_action/send_goalRequest",
                "nav2_msgs::action::dds_::NavigateToPose_SendGoal_Request_",
            ),
            (false, "Square", "ShapeType"),
        ] {
            let (topic, type_name) = (topic.to_owned(), type_name.to_owned());
            let _ = interfaces.add(&Endpoint { is_reader, topic, type_name, hash: None, is_latched: false });
        }
        let pair = |name: &str, kind: &str| [(name.to_owned(), kind.to_owned())].into();
        assert_eq!(interfaces.topics, pair("/scan", "sensor_msgs/msg/LaserScan"));
        assert_eq!(interfaces.services, pair("/lamp", "std_srvs/srv/SetBool"));
        assert_eq!(interfaces.actions, pair("/go", "nav2_msgs/action/NavigateToPose"));
    }

    #[test]
    fn types_and_their_hashes_are_compared() {
        let expected = Expected { type_name: "a::msg::dds_::B_".to_owned(), hash: "RIHS01_12".into() };
        let endpoint = |type_name: &str, data: &str| Endpoint {
            is_reader: false,
            topic: "rt/t".to_owned(),
            type_name: type_name.to_owned(),
            hash: type_hash(data.as_bytes()),
            is_latched: false,
        };
        let complaint = |name: &str, data: &str| endpoint(name, data).complaint(&expected).is_some();
        assert!(!complaint("a::msg::dds_::B_", ""));
        assert!(!complaint("a::msg::dds_::B_", "typehash=RIHS01_12;"));
        assert!(!complaint("a::msg::dds_::B_", "enclave=/;typehash=RIHS01_00;"));
        assert!(complaint("a::msg::dds_::B_", "typehash=RIHS01_13;\0"));
        assert!(complaint("a::msg::dds_::C_", ""));
        // As RustDDS 0.15.1 passes the user data of Fast DDS: with length and padding.
        assert!(!complaint("a::msg::dds_::B_", "\x13\0\0\0typehash=RIHS01_12;\0"));
        assert!(complaint("a::msg::dds_::B_", "\x13\0\0\0typehash=RIHS01_13;\0"));
        assert!(complaint("a::msg::dds_::B_", "\0\0\0\x13typehash=RIHS01_13;\0"));
    }
}
