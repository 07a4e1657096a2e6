//! Tests with missions that change: robots finish on the former version, change to the new one, or are
//! suspended until their version is back or they are retired.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::{Order, Settings, Shared, serve};
use metaplan_fleet::robot::{Begun, Robot};
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Message, Store, Stored, Stream};
use metaplan_fleet::wire::{Decided, State};
use metaplan_fleet::worker;
use tempfile::TempDir;
use tokio::sync::watch;

use super::{PATIENT, all, assert_same, decided, decisions, has_no_events, heard, open, scripts, tell};

/// Directories with two versions of the mission `ugv`: the original, and one with a setting.
struct Versions(TempDir);

impl Versions {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a directory");
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("it exists");
        let text = fs::read_to_string(root.join("missions/ugv.toml")).expect("it can be read");
        let text = text.replace("\"../", &format!("\"{}/", root.display()));
        let new = text.replacen("[knowledge]", "[adaptation]\nsettle = 1\n\n[knowledge]", 1);
        for (name, text) in [("old", text), ("new", new)] {
            fs::create_dir(folder.path().join(name)).expect("it can be made");
            fs::write(folder.path().join(name).join("ugv.toml"), text).expect("it can be written");
        }
        Self(folder)
    }

    /// Returns missions with the versions `names`, of which the first one is current.
    fn missions(&self, names: &[&str]) -> Missions {
        let directory = |name: &str| self.0.path().join(name);
        let current = Missions::read(&directory(names[0])).unwrap_or_else(|errors| panic!("{errors}"));
        names[1..].iter().fold(current, |missions, name| {
            missions.with_former(&directory(name)).unwrap_or_else(|errors| panic!("{errors}"))
        })
    }

    fn shared(&self, store: &Local, names: &[&str]) -> Arc<Shared<Local>> {
        let look = Duration::from_millis(5);
        let settings = Settings { patience: PATIENT, discard_every: 2, look, ..Settings::default() };
        Arc::new(Shared::new(store.clone(), self.missions(names), names.join("+"), settings))
    }
}

struct Worker(watch::Sender<bool>, tokio::task::JoinHandle<()>);

impl Worker {
    fn start(shared: Arc<Shared<Local>>) -> Self {
        let (stop, stopped) = watch::channel(false);
        Self(stop, tokio::spawn(worker::run(shared, stopped)))
    }

    async fn stop(self) {
        self.0.send_replace(true);
        self.1.await.expect("it ends in order");
    }
}

fn event(text: &str) -> Vec<String> {
    vec![text.to_owned()]
}

const ENROL: &str = r#"{"event": "enrol", "mission": "ugv"}"#;
const RETIRE: &str = r#"{"event": "retire"}"#;
const TICK: &str = r#"{"event": "tick"}"#;
const LOST: &str = r#"{"event": "component_status", "component": "c_kinect", "status": "FALSE"}"#;

async fn of<S: Store>(store: &S, robot: &str) -> Vec<Decided> {
    decisions(store).await.remove(robot).unwrap_or_default()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn robots_finish_on_the_version_with_which_they_were_enrolled() {
    let (versions, folder) = (Versions::new(), tempfile::tempdir().expect("a directory"));
    let store = open(folder.path(), 1);
    let (events, answers) = scripts::play("ugv", "kinect_comes_and_goes", 3, 30);
    let mut sequences = tell(&store, "r", &events[..10]).await;
    let worker = Worker::start(versions.shared(&store, &["old"]));
    decided(&store, 10).await;
    worker.stop().await;
    sequences.extend(tell(&store, "r", &events[10..]).await);
    let worker = Worker::start(versions.shared(&store, &["new", "old"]));
    tell(&store, "s", &event(ENROL)).await;
    decided(&store, events.len() + 1).await;
    worker.stop().await;
    assert_same("r", &of(&store, "r").await, &sequences, &answers);
    let digests = [of(&store, "r").await, of(&store, "s").await].map(|made| made[0].state.digest.clone());
    assert!(!digests[0].is_empty() && !digests[1].is_empty() && digests[0] != digests[1]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_without_its_version_waits_for_it_and_delays_nobody() {
    let (versions, folder) = (Versions::new(), tempfile::tempdir().expect("a directory"));
    let store = open(folder.path(), 1);
    let (events, answers) = scripts::play("ugv", "kinect_comes_and_goes", 3, 30);
    let mut sequences = tell(&store, "r", &events[..10]).await;
    let worker = Worker::start(versions.shared(&store, &["old"]));
    decided(&store, 10).await;
    worker.stop().await;
    let worker = Worker::start(versions.shared(&store, &["new"]));
    sequences.extend(tell(&store, "r", &events[10..20]).await);
    let others = tell(&store, "s", &scripts::play("ugv", "kinect_comes_and_goes", 4, 30).0).await;
    decided(&store, 10 + others.len()).await;
    worker.stop().await;
    let kept = all(&store, Stream::Events).await;
    let kept: Vec<u64> = kept.iter().map(|event| event.sequence).collect();
    assert_eq!(kept, sequences[10..], "only events of `r` are kept");
    assert_eq!(of(&store, "r").await.len(), 10);
    // The former files are back.
    sequences.extend(tell(&store, "r", &events[20..]).await);
    for names in [&["old", "new"][..], &["new", "old"]] {
        let worker = Worker::start(versions.shared(&store, names));
        decided(&store, events.len() + others.len()).await;
        worker.stop().await;
    }
    assert_same("r", &of(&store, "r").await, &sequences, &answers);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_without_its_version_can_be_retired_and_enrolled() {
    let (versions, folder) = (Versions::new(), tempfile::tempdir().expect("a directory"));
    let store = open(folder.path(), 1);
    tell(&store, "r", &event(ENROL)).await;
    let worker = Worker::start(versions.shared(&store, &["old"]));
    decided(&store, 1).await;
    worker.stop().await;
    let mut notices = store.notices();
    tell(&store, "r", &[TICK.to_owned(), ENROL.to_owned()]).await;
    let sequences = tell(&store, "r", &[RETIRE, ENROL, TICK].map(str::to_owned)).await;
    let worker = Worker::start(versions.shared(&store, &["new"]));
    decided(&store, 4).await;
    worker.stop().await;
    assert!(heard(&mut notices).await.contains("--former"));
    // With the former files, the events before the retirement are not decided, either.
    let worker = Worker::start(versions.shared(&store, &["old", "new"]));
    let more = tell(&store, "r", &event(TICK)).await;
    decided(&store, 5).await;
    worker.stop().await;
    let made = of(&store, "r").await;
    let events: Vec<u64> = made.iter().map(|own| own.event).collect();
    assert_eq!(events, [&[1], &sequences[..], &more].concat());
    assert!(made[1].retired && made[2].enrolled.is_some());
    assert_ne!(made[0].state.digest, made[2].state.digest);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_refused_retirement_discards_no_event_of_a_suspended_robot() {
    let (versions, folder) = (Versions::new(), tempfile::tempdir().expect("a directory"));
    let store = open(folder.path(), 1);
    tell(&store, "r", &event(ENROL)).await;
    let worker = Worker::start(versions.shared(&store, &["old"]));
    decided(&store, 1).await;
    worker.stop().await;
    let mut sequences = tell(&store, "r", &[TICK, LOST].map(str::to_owned)).await;
    let forged = Message { subject: "0.r", id: "other:2", after: None, payload: RETIRE.as_bytes() };
    sequences.push(store.append(Stream::Events, forged).await.expect("it is our own directory").sequence);
    let shared = versions.shared(&store, &["new"]);
    let worker = Worker::start(Arc::clone(&shared));
    // The suspension and the refused retirement.
    while shared.counts.refused.load(Ordering::Relaxed) < 2 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    worker.stop().await;
    let kept: Vec<u64> = all(&store, Stream::Events).await.iter().map(|event| event.sequence).collect();
    assert_eq!(kept, sequences);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_pending_plan_is_found_after_the_robot_was_suspended() {
    let (versions, folder) = (Versions::new(), tempfile::tempdir().expect("a directory"));
    let store = open(folder.path(), 1);
    tell(&store, "r", &event(ENROL)).await;
    // The decision of an owner that ends before it has found the plan.
    let (enrolment, mut robot) = (all(&store, Stream::Events).await.remove(0), Robot::default());
    let Ok(Begun::Search(search)) = robot.begin(&enrolment, &versions.missions(&["old"])) else {
        panic!("a search is necessary")
    };
    let payload = serde_json::to_vec(&robot.finish(search, None)).expect("plain data");
    let message = Message { subject: "0.r", id: "", after: Some(0), payload: &payload };
    store.append(Stream::Decisions, message).await.expect("it is our own directory");
    let shared = versions.shared(&store, &["new"]);
    let worker = Worker::start(Arc::clone(&shared));
    while shared.counts.refused.load(Ordering::Relaxed) < 1 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    worker.stop().await;
    assert_eq!(all(&store, Stream::Events).await, [enrolment], "the event is kept for the plan");
    let worker = Worker::start(versions.shared(&store, &["new", "old"]));
    decided(&store, 2).await;
    worker.stop().await;
    assert!(of(&store, "r").await[1].planned);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_changes_its_version_at_the_end_of_an_action() {
    let (versions, folder) = (Versions::new(), tempfile::tempdir().expect("a directory"));
    let store = open(folder.path(), 1);
    tell(&store, "r", &[ENROL, LOST].map(str::to_owned)).await;
    let worker = Worker::start(versions.shared(&store, &["old"]));
    decided(&store, 2).await;
    worker.stop().await;
    let worker = Worker::start(versions.shared(&store, &["new", "old"]));
    let migrate = r#"{"event": "migrate", "at": "action_end"}"#;
    let wrong = r#"{"event": "migrate", "at": "once"}"#;
    let end = r#"{"event": "action_succeeded", "action": 1}"#;
    tell(&store, "r", &[wrong, migrate, TICK, end].map(str::to_owned)).await;
    decided(&store, 5).await;
    worker.stop().await;
    // The former version is not needed any longer, and the robot's reports are known.
    let worker = Worker::start(versions.shared(&store, &["new"]));
    tell(&store, "r", &event(LOST)).await;
    decided(&store, 6).await;
    worker.stop().await;
    let made = of(&store, "r").await;
    assert_eq!(
        made.iter().map(|own| own.migrated).collect::<Vec<_>>(),
        [false, false, false, false, true, false]
    );
    let target = made[2].state.migration.as_ref().map(|migration| &migration.target);
    assert!(target.is_some() && made[2].answers.is_empty());
    assert_eq!(Some(&made[4].state.digest), target);
    let has = |decided: &Decided, kind: &str| decided.answers.iter().any(|answer| answer["answer"] == kind);
    assert!(has(&made[1], "inferred") && !has(&made[5], "inferred"), "{:?}", made[5].answers);
    assert!(has(&made[4], "plan_found"), "{:?}", made[4].answers);
}

/// Checks decisions by an independent definition: a robot without network that is restored from the preceding decision
/// must decide equally with the missions of the worker. An event without a decision must be refused with the missions
/// of some worker, or precede the retirement of the robot.
async fn verify(store: &Local, versions: &Versions, events: &BTreeMap<u64, String>) {
    let missions: BTreeMap<String, Missions> =
        SETS.iter().map(|names| (names.join("+"), versions.missions(names))).collect();
    let made: BTreeMap<u64, Decided> =
        of(store, "r").await.into_iter().map(|decided| (decided.event, decided)).collect();
    assert_eq!(made.len(), of(store, "r").await.len(), "each event once");
    let mut last: Option<Decided> = None;
    for (sequence, text) in events {
        let (sequence, payload) = (*sequence, text.clone().into_bytes());
        let decide = |worker: &str, time| {
            let event =
                Stored { sequence, subject: "0.r".to_owned(), id: None, time, payload: payload.clone() };
            last.clone().map_or_else(Robot::default, Robot::restore).decide(&event, &missions[worker])
        };
        if let Some(decided) = made.get(&sequence) {
            let again = decide(&decided.worker, decided.state.enrolled + decided.now);
            let Ok(Ok(again)) = again else { panic!("event {sequence}: {again:?}") };
            assert_eq!(
                scripts::essence(&again.answers),
                scripts::essence(&decided.answers),
                "event {sequence}"
            );
            let flags =
                |own: &Decided| (own.enrolled.clone(), own.retired, own.migrated, own.state.digest.clone());
            assert_eq!(flags(&again), flags(decided), "event {sequence}");
            last = Some(decided.clone());
        } else if !made.range(sequence..).next().is_some_and(|(_, next)| next.retired) {
            let outcomes: Vec<_> = missions.keys().map(|worker| decide(worker, 0)).collect();
            assert!(outcomes.iter().any(|own| matches!(own, Ok(Err(_)))), "event {sequence}: {outcomes:?}");
        }
    }
}

const SETS: [&[&str]; 4] = [&["old"], &["new"], &["new", "old"], &["old", "new"]];

/// Owners with different versions are stopped at any time.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn owners_with_different_versions_agree_on_what_was_decided() {
    let versions = Versions::new();
    let mut random = fastrand::Rng::with_seed(11);
    for _ in 0..6 {
        let folder = tempfile::tempdir().expect("a directory");
        let store = open(folder.path(), 1);
        let shared = SETS.map(|names| versions.shared(&store, names));
        let mut texts = BTreeMap::new();
        let mut action = 1;
        for _ in 0..25 {
            let mut events = Vec::new();
            for _ in 0..random.usize(1..4) {
                let end = format!(r#"{{"event": "action_succeeded", "action": {action}}}"#);
                let migrate = r#"{"event": "migrate"}"#.to_owned();
                let later = r#"{"event": "migrate", "at": "goal"}"#.to_owned();
                let texts = [
                    ENROL.to_owned(),
                    RETIRE.to_owned(),
                    migrate,
                    later,
                    end,
                    LOST.to_owned(),
                    TICK.to_owned(),
                ];
                let choice = [0, 0, 1, 2, 2, 3, 4, 4, 5, 6][random.usize(..10)];
                action = if choice < 2 { 1 } else { action + u64::from(choice == 4) };
                events.push(texts[choice].clone());
            }
            texts.extend(tell(&store, "r", &events).await.into_iter().zip(events));
            let (_orders, heard) = watch::channel(Order::Go);
            let own = Arc::clone(&shared[random.usize(..4)]);
            let task = tokio::spawn(serve(own, 0, heard));
            tokio::time::sleep(Duration::from_millis(random.u64(1..60))).await;
            task.abort();
        }
        let end = [RETIRE, ENROL, TICK].map(str::to_owned);
        texts.extend(tell(&store, "r", &end).await.into_iter().zip(end));
        let last = *texts.last_key_value().expect("there are events").0;
        let worker = Worker::start(versions.shared(&store, &["new", "old"]));
        for attempt in 0.. {
            let made = of(&store, "r").await;
            if made.last().is_some_and(|decided| decided.event == last) {
                break;
            }
            assert!(attempt < 60_000, "the last event is not decided: {:?}", made.last());
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        worker.stop().await;
        verify(&store, &versions, &texts).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn only_ids_are_kept_of_retired_robots() {
    let (versions, folder) = (Versions::new(), tempfile::tempdir().expect("a directory"));
    let store = open(folder.path(), 1);
    let mut count = 0;
    for _ in 0..2 {
        let shared = versions.shared(&store, &["old"]);
        let worker = Worker::start(Arc::clone(&shared));
        for robot in ["a", "b", "c"] {
            count += tell(&store, robot, &[ENROL, TICK, RETIRE].map(str::to_owned)).await.len();
        }
        decided(&store, count).await;
        while shared.counts.robots.load(Ordering::Relaxed) > 0 || !has_no_events(&store).await {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        worker.stop().await;
    }
    let made = of(&store, "a").await;
    assert!(made.iter().all(|own| own.answers.iter().all(|answer| answer["answer"] != "error")));
    let last = made.last().expect("there are decisions");
    assert_eq!(last.state, State { ids: last.state.ids.clone(), ..State::default() });
    assert_eq!(made.len(), 6);
}
