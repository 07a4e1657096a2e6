//! Tests with missions that change: robots finish on the former version, change to the new one, or are
//! suspended until their version is back or they are retired.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::{Order, Settings, Shared, serve};
use metaplan_fleet::robot::Robot;
use metaplan_fleet::robots::status;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Bucket, Store, Stored, Stream};
use metaplan_fleet::wire::Decided;
use metaplan_fleet::worker;
use tempfile::TempDir;
use tokio::sync::watch;

use super::{assert_same, decided, decisions, open, scripts, tell};

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
        let settings = Settings { save_every: 2, look: Duration::from_millis(5), ..Settings::default() };
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
    let (old, new) = (of(&store, "r").await[0].digest.clone(), of(&store, "s").await[0].digest.clone());
    assert!(old.is_some() && new.is_some() && old != new);
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
    let progress = status(&store).await.expect("it can be read").partitions[0].events;
    assert_eq!(progress, *others.last().expect("there are events"), "the progress does not wait for `r`");
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
    assert!(notices.try_recv().expect("there is a notice").1.contains("--former"));
    // With the former files, the events before the retirement are not decided, either.
    let worker = Worker::start(versions.shared(&store, &["old", "new"]));
    let more = tell(&store, "r", &event(TICK)).await;
    decided(&store, 5).await;
    worker.stop().await;
    let made = of(&store, "r").await;
    let events: Vec<u64> = made.iter().map(|own| own.event).collect();
    assert_eq!(events, [&[1], &sequences[..], &more].concat());
    assert!(made[1].retired && made[1].skips && made[2].enrolled.is_some());
    assert_ne!(made[0].digest, made[2].digest);
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
    assert!(made[2].target.is_some() && made[2].answers.is_empty());
    assert_eq!(made[4].digest, made[2].target);
    let has = |decided: &Decided, kind: &str| decided.answers.iter().any(|answer| answer["answer"] == kind);
    assert!(has(&made[1], "inferred") && !has(&made[5], "inferred"), "{:?}", made[5].answers);
    let request = made[4]
        .answers
        .iter()
        .find(|answer| answer["effect"].is_object() || answer["answer"] == "request_action");
    assert!(has(&made[4], "plan_found"), "{request:?} {:?}", made[4].answers);
}

/// Checks decisions by an independent definition: a robot without network that replays them must agree, and
/// events without a decision must be refused or precede the retirement of a suspended robot.
async fn verify(store: &Local, missions: &Missions) {
    let mut made: BTreeMap<u64, Decided> = BTreeMap::new();
    for message in store.history(Stream::Decisions, 0, 0).await.expect("it can be read") {
        let decided = Decided::parse(&message.payload).expect("a decision");
        assert!(
            made.last_key_value().is_none_or(|(last, _)| *last < decided.event),
            "in order, each event once"
        );
        made.insert(decided.event, decided);
    }
    let mut robot = Robot::default();
    for event in store.history(Stream::Events, 0, 0).await.expect("it can be read") {
        let next = made.range(event.sequence..).next().map(|(_, decided)| decided);
        match made.get(&event.sequence) {
            Some(decided) if decided.skips => drop(robot.retire_suspended(&event)),
            Some(decided) => {
                let replayed = robot.decide(&event, missions, Some(decided));
                assert!(replayed.as_ref().is_ok_and(Result::is_ok), "{replayed:?}");
            }
            None if next.is_some_and(|next| next.skips) => {}
            None => {
                let outcome = robot.decide(&event, missions, None);
                assert!(
                    matches!(outcome, Ok(Err(_))),
                    "event {} {outcome:?}\n{}",
                    event.sequence,
                    listing(store, &made).await
                );
            }
        }
    }
}

async fn listing(store: &Local, made: &BTreeMap<u64, Decided>) -> String {
    let events = store.history(Stream::Events, 0, 0).await.expect("it can be read");
    let line = |event: &Stored| {
        let decision = made.get(&event.sequence).map(|decided| {
            let Decided { worker, epoch, retired, skips, migrated, digest, target, .. } = decided;
            format!(
                "{worker}/{epoch} retired {retired} skips {skips} migrated {migrated} {digest:?} {target:?}"
            )
        });
        format!("{} {} {decision:?}\n", event.sequence, String::from_utf8_lossy(&event.payload))
    };
    events.iter().map(line).collect()
}

/// Owners with different versions are stopped at any time.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn owners_with_different_versions_agree_on_what_was_decided() {
    let versions = Versions::new();
    let mut random = fastrand::Rng::with_seed(11);
    for _ in 0..6 {
        let folder = tempfile::tempdir().expect("a directory");
        let store = open(folder.path(), 1);
        let sets: [&[&str]; 4] = [&["old"], &["new"], &["new", "old"], &["old", "new"]];
        let shared = sets.map(|names| versions.shared(&store, names));
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
            tell(&store, "r", &events).await;
            let (_orders, heard) = watch::channel(Order::Go);
            let own = Arc::clone(&shared[random.usize(..4)]);
            let task = tokio::spawn(serve(own, 0, heard));
            tokio::time::sleep(Duration::from_millis(random.u64(1..60))).await;
            task.abort();
        }
        tell(&store, "r", &[RETIRE, ENROL, TICK].map(str::to_owned)).await;
        let last = store.end(Stream::Events, 0).await.expect("it can be read");
        let worker = Worker::start(versions.shared(&store, &["new", "old"]));
        for attempt in 0.. {
            let made = of(&store, "r").await;
            if made.last().is_some_and(|decided| decided.event == last) {
                break;
            }
            assert!(attempt < 3000, "the last event is not decided: {:?}", made.last());
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        worker.stop().await;
        verify(&store, &versions.missions(&["new", "old"])).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn nothing_is_kept_of_retired_robots() {
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
        worker.stop().await;
        // Another worker removes what the first one has left.
        let worker = Worker::start(versions.shared(&store, &["old"]));
        for attempt in 0.. {
            let saved = store.list(Bucket::Robots, None, 0).await.expect("it can be read");
            if saved.is_empty() {
                break;
            }
            assert!(attempt < 1000, "{} snapshots", saved.len());
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        // The same robots can be enrolled once more, with the chain of their decisions.
        count += tell(&store, "a", &[ENROL, TICK, RETIRE].map(str::to_owned)).await.len();
        decided(&store, count).await;
        worker.stop().await;
    }
    let made = of(&store, "a").await;
    assert_eq!(made.len(), 12);
    assert!(made.iter().all(|own| own.answers.iter().all(|answer| answer["answer"] != "error")));
}
