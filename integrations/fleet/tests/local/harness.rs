//! Fleets in a directory, with their robots and workers.

use std::fs;
use std::path::Path;
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::{Settings, Shared, serve};
use metaplan_fleet::robot::{Begun, Robot};
use metaplan_fleet::robots::Sender;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Message, Store, Stored, Stream};
use metaplan_fleet::wire::{Address, Decided};
use metaplan_fleet::worker;
use tempfile::TempDir;
use tokio::sync::{broadcast, watch};
use tokio::task::JoinHandle;

use super::common::{has_no_events, read};
use super::scripts;

pub(super) const ENROL: &str = r#"{"event": "enrol", "mission": "ugv"}"#;
pub(super) const RETIRE: &str = r#"{"event": "retire"}"#;
pub(super) const TICK: &str = r#"{"event": "tick"}"#;
pub(super) const LOST: &str = r#"{"event": "component_status", "component": "c_kinect", "status": "FALSE"}"#;

pub(super) static MISSIONS: LazyLock<Missions> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions");
    Missions::read(&folder).unwrap_or_else(|errors| panic!("{errors}"))
});

/// Time limit of all conditions that a test waits for.
const LIMIT: Duration = Duration::from_secs(600);

/// Settings with which each decision contains its plan, so that the answers do not depend on the speed of this machine.
pub(super) fn patient() -> Settings {
    Settings { patience: LIMIT, ..Settings::default() }
}

pub(super) fn shared<S: Store>(store: S, name: &str, settings: Settings) -> Arc<Shared<S>> {
    Arc::new(Shared::new(store, MISSIONS.clone(), name.to_owned(), settings))
}

pub(super) async fn until(what: &str, mut holds: impl AsyncFnMut() -> bool) {
    let begun = Instant::now();
    while !holds().await {
        assert!(begun.elapsed() < LIMIT, "{what}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// Waits for the next notice, which is sent by another task, and returns its text.
pub(super) async fn heard(notices: &mut broadcast::Receiver<(String, String)>) -> String {
    let notice = tokio::time::timeout(LIMIT, notices.recv()).await.expect("there is a notice");
    notice.expect("there are few notices").1
}

pub(super) fn event(sequence: u64, payload: &str) -> Stored {
    Stored { sequence, subject: "0.r".to_owned(), id: None, time: 0, payload: payload.into() }
}

/// Creates a directory with a version of the mission `ugv` that has these settings of the adaptation.
pub(super) fn write_version(directory: &Path, settings: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("it exists");
    let text = fs::read_to_string(root.join("missions/ugv.toml")).expect("it can be read");
    let text = text.replace("\"../", &format!("\"{}/", root.display()));
    let adaptation = format!("[adaptation]\n{settings}\n\n[knowledge]");
    let text = if settings.is_empty() { text } else { text.replacen("[knowledge]", &adaptation, 1) };
    fs::create_dir(directory).expect("it can be made");
    fs::write(directory.join("ugv.toml"), text).expect("it can be written");
}

/// A fleet in a directory, which is removed at the end.
pub(super) struct Fleet {
    pub(super) store: Local,
    pub(super) folder: TempDir,
}

impl Fleet {
    pub(super) fn new(partitions: u32) -> Self {
        Self::with(partitions, usize::MAX - 1, Duration::from_millis(400))
    }

    pub(super) fn with(partitions: u32, history: usize, lease: Duration) -> Self {
        let folder = tempfile::tempdir().expect("a directory");
        let store = Local::open(folder.path(), partitions, history, lease);
        Self { store: store.unwrap_or_else(|message| panic!("{message}")), folder }
    }

    /// Appends a message that is not a repetition. Returns its sequence number.
    pub(super) async fn append(&self, stream: Stream, message: Message<'_>) -> u64 {
        let receipt = self.store.append(stream, message).await.expect("it is our own directory");
        assert!(!receipt.is_known, "the log has the id of {message:?}");
        receipt.sequence
    }

    pub(super) async fn append_event(&self, subject: &str, id: &str, payload: &[u8]) -> u64 {
        self.append(Stream::Events, Message { subject, id, after: None, payload }).await
    }

    /// Appends the enrolment of the robot `r`, and the decision of an owner that ends before it has found the plan. Returns
    /// the sequence number of the enrolment.
    pub(super) async fn enrol_without_plan(&self, missions: &Missions) -> u64 {
        let enrolment = self.append_event("0.r", "", ENROL.as_bytes()).await;
        let mut robot = Robot::default();
        let Ok(Begun::Search(search)) = robot.begin(&event(enrolment, ENROL), missions) else {
            panic!("a search is necessary")
        };
        let payload = serde_json::to_vec(&robot.finish(search, None)).expect("plain data");
        let message = Message { subject: "0.r", id: "", after: Some(0), payload: &payload };
        self.append(Stream::Decisions, message).await;
        enrolment
    }

    /// Appends events without ids. Returns their sequence numbers.
    pub(super) async fn tell(&self, robot: &str, events: &[impl AsRef<str>]) -> Vec<u64> {
        let subject = Address::of(robot, self.store.partitions()).to_string();
        let mut sequences = Vec::new();
        for event in events {
            sequences.push(self.append_event(&subject, "", event.as_ref().as_bytes()).await);
        }
        sequences
    }

    /// Sends events as a client with a session. Returns their sequence numbers.
    pub(super) async fn send(&self, robot: &str, session: &str, events: &[String]) -> Vec<u64> {
        let mut sender = Sender::new(self.store.clone(), robot, session);
        let mut sequences = Vec::new();
        for event in events {
            sequences.push(sender.send(event).await.expect("it is our own directory"));
        }
        sequences
    }

    pub(super) async fn all(&self, stream: Stream) -> Vec<Stored> {
        let mut messages = Vec::new();
        for partition in 0..self.store.partitions() {
            messages.extend(read(&self.store, stream, partition).await.expect("it can be read"));
        }
        messages
    }

    /// Returns the decisions about a robot that can be parsed.
    pub(super) async fn of(&self, robot: &str) -> Vec<Decided> {
        let messages = self.all(Stream::Decisions).await.into_iter();
        let subject = Address::of(robot, self.store.partitions()).to_string();
        let messages = messages.filter(|message| message.subject == subject);
        messages.filter_map(|message| Decided::parse(&message.payload)).collect()
    }

    /// Returns `true` if there are no events. Unlike [`all`](Self::all), it does not wait for events that are discarded
    /// meanwhile.
    pub(super) async fn has_no_events(&self) -> bool {
        has_no_events(&self.store).await.expect("it can be read")
    }

    /// Waits until all events are handled, their plans are found, and the events are discarded.
    pub(super) async fn settle(&self) {
        until("events are not handled", async || self.has_no_events().await).await;
    }

    pub(super) async fn decided(&self, count: usize) {
        let what = format!("there are fewer than {count} decisions");
        until(&what, async || self.all(Stream::Decisions).await.len() >= count).await;
    }

    pub(super) fn own(&self, name: &str, settings: Settings) -> Running {
        Running::owner(shared(self.store.clone(), name, settings))
    }

    pub(super) async fn work(&self, name: &str, settings: Settings, count: usize) {
        let worker = Running::worker(shared(self.store.clone(), name, settings));
        self.decided(count).await;
        worker.stop().await;
    }
}

/// A robot and its events, the first of which are sent.
#[derive(Clone)]
pub(super) struct Client {
    pub(super) name: String,
    pub(super) mission: &'static str,
    pub(super) events: Vec<String>,
    /// Sequence numbers of the events that are sent.
    pub(super) sequences: Vec<u64>,
}

impl Client {
    pub(super) fn new(name: &str, mission: &'static str, events: Vec<String>) -> Self {
        Self { name: name.to_owned(), mission, events, sequences: Vec::new() }
    }

    pub(super) fn play(name: &str, scenario: (&'static str, &str), seed: u64, most: usize) -> Self {
        Self::new(name, scenario.0, scripts::play(scenario, seed, most))
    }

    /// Sends the next events, up to `count` in total.
    pub(super) async fn send(&mut self, fleet: &Fleet, count: usize) {
        let next = &self.events[self.sequences.len()..count];
        self.sequences.extend(fleet.tell(&self.name, next).await);
    }

    pub(super) async fn send_all(&mut self, fleet: &Fleet) {
        self.send(fleet, self.events.len()).await;
    }

    /// Checks that each event that was sent has one decision, which contains its plan, with the answers of a single
    /// local loop.
    pub(super) async fn verify(&self, fleet: &Fleet) {
        let decided = fleet.of(&self.name).await;
        assert!(decided.iter().all(|decided| !decided.planning && !decided.planned), "{}", self.name);
        scripts::assert_replayed(&self.name, self.mission, &self.events, &decided, &self.sequences);
    }
}

/// A running worker, or an owner of the first partition only, which is aborted when it is dropped.
pub(super) struct Running(watch::Sender<bool>, JoinHandle<()>);

impl Running {
    pub(super) fn worker<S: Store>(shared: Arc<Shared<S>>) -> Self {
        let (stop, stopped) = watch::channel(false);
        Self(stop, tokio::spawn(worker::run(shared, stopped)))
    }

    pub(super) fn owner<S: Store>(shared: Arc<Shared<S>>) -> Self {
        let (drain, receiver) = watch::channel(false);
        Self(drain, tokio::spawn(serve(shared, 0, receiver)))
    }

    pub(super) async fn stop(mut self) {
        self.0.send_replace(true);
        let end = tokio::time::timeout(LIMIT, &mut self.1).await;
        end.expect("it ends in time").expect("no panic");
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.1.abort();
    }
}
