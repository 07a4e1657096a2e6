//! Tests with missions that change: robots finish on the former version, change to the new one, or are
//! suspended until their version is back or they are retired.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::{Settings, Shared};
use metaplan_fleet::robot::{Begun, Robot, Undecided};
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Stored, Stream};
use metaplan_fleet::wire::{Decided, State};
use tempfile::TempDir;

use super::harness::{
    Client, ENROL, Fleet, LOST, RETIRE, Running, TICK, event, heard, patient, until, write_version,
};
use super::scripts;

/// A fleet with one partition, and directories with two versions of the mission `ugv`: the original, and one with a
/// setting.
struct Versions {
    fleet: Fleet,
    folder: TempDir,
}

impl Versions {
    fn new() -> Self {
        let (fleet, folder) = (Fleet::new(1), tempfile::tempdir().expect("a directory"));
        write_version(&folder.path().join("old"), "");
        write_version(&folder.path().join("new"), "settle = 1");
        Self { fleet, folder }
    }

    /// Returns missions with the versions `names`, of which the first one is current.
    fn missions(&self, names: &[&str]) -> Missions {
        let directory = |name: &str| self.folder.path().join(name);
        let current = Missions::read(&directory(names[0])).unwrap_or_else(|errors| panic!("{errors}"));
        names[1..].iter().fold(current, |missions, name| {
            missions.with_former(&directory(name)).unwrap_or_else(|errors| panic!("{errors}"))
        })
    }

    fn shared(&self, names: &[&str]) -> Arc<Shared<Local>> {
        let settings = Settings { discard_every: 2, ..patient() };
        Arc::new(Shared::new(self.fleet.store.clone(), self.missions(names), names.join("+"), settings))
    }

    async fn work(&self, names: &[&str], count: usize) {
        let worker = Running::worker(self.shared(names));
        self.fleet.decided(count).await;
        worker.stop().await;
    }

    async fn refuse(&self, names: &[&str], count: u64) {
        let shared = self.shared(names);
        let worker = Running::worker(Arc::clone(&shared));
        until("refusals", async || shared.counts.refused.load(Ordering::Relaxed) >= count).await;
        worker.stop().await;
    }

    async fn kept(&self) -> Vec<u64> {
        self.fleet.all(Stream::Events).await.iter().map(|event| event.sequence).collect()
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_waits_for_the_version_with_which_it_was_enrolled_and_delays_nobody() {
    let versions = Versions::new();
    let fleet = &versions.fleet;
    let [mut robot, mut other] = [("r", 3), ("s", 4)]
        .map(|(name, seed)| Client::play(name, ("ugv", "kinect_comes_and_goes"), seed, 30));
    robot.send(fleet, 10).await;
    versions.work(&["old"], 10).await;
    robot.send(fleet, 15).await;
    let worker = Running::worker(versions.shared(&["new"]));
    other.send(fleet, 10).await;
    fleet.decided(20).await;
    // These events reach a robot that is suspended already.
    robot.send(fleet, 20).await;
    other.send_all(fleet).await;
    fleet.decided(10 + other.events.len()).await;
    worker.stop().await;
    assert_eq!(versions.kept().await, robot.sequences[10..], "only events of `r` are kept");
    assert_eq!(fleet.of("r").await.len(), 10);
    // The former files are back.
    robot.send_all(fleet).await;
    for names in [&["old", "new"][..], &["new", "old"]] {
        versions.work(names, robot.events.len() + other.events.len()).await;
    }
    robot.verify(fleet).await;
    let digests = [fleet.of("r").await, fleet.of("s").await]
        .map(|made| made.into_iter().map(|decided| decided.state.digest).collect::<BTreeSet<_>>());
    assert!(digests[0].len() == 1 && digests[1].len() == 1 && digests[0] != digests[1], "{digests:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_without_its_version_can_be_retired_and_enrolled() {
    let versions = Versions::new();
    let fleet = &versions.fleet;
    fleet.tell("r", &[ENROL]).await;
    versions.work(&["old"], 1).await;
    let mut notices = fleet.store.notices();
    fleet.tell("r", &[TICK, ENROL]).await;
    let sequences = fleet.tell("r", &[RETIRE, ENROL, TICK]).await;
    versions.work(&["new"], 4).await;
    assert!(heard(&mut notices).await.contains("--former"));
    // With the former files, the events before the retirement are not decided, either.
    let more = fleet.tell("r", &[TICK]).await;
    versions.work(&["old", "new"], 5).await;
    let made = fleet.of("r").await;
    let events: Vec<u64> = made.iter().map(|decided| decided.event).collect();
    assert_eq!(events, [&[1], &sequences[..], &more].concat());
    assert!(made[1].retired && made[2].enrolled.is_some());
    assert_ne!(made[0].state.digest, made[2].state.digest);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_refused_retirement_discards_no_event_of_a_suspended_robot() {
    let versions = Versions::new();
    let fleet = &versions.fleet;
    fleet.tell("r", &[ENROL]).await;
    versions.work(&["old"], 1).await;
    let mut sequences = fleet.tell("r", &[TICK, LOST]).await;
    sequences.push(fleet.append_event("0.r", "other:2", RETIRE.as_bytes()).await);
    // The suspension and the refused retirement.
    versions.refuse(&["new"], 2).await;
    assert_eq!(versions.kept().await, sequences);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_pending_plan_is_found_after_the_robot_was_suspended() {
    let versions = Versions::new();
    let fleet = &versions.fleet;
    let enrolment = fleet.enrol_without_plan(&versions.missions(&["old"])).await;
    versions.refuse(&["new"], 1).await;
    assert_eq!(versions.kept().await, [enrolment], "the event is kept for the plan");
    versions.work(&["new", "old"], 2).await;
    assert!(fleet.of("r").await[1].planned);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_changes_its_version_at_the_end_of_an_action() {
    let versions = Versions::new();
    let fleet = &versions.fleet;
    fleet.tell("r", &[ENROL, LOST]).await;
    versions.work(&["old"], 2).await;
    let migrate = r#"{"event": "migrate", "at": "action_end"}"#;
    let wrong = r#"{"event": "migrate", "at": "once"}"#;
    let end = r#"{"event": "action_succeeded", "action": 1}"#;
    fleet.tell("r", &[wrong, migrate, TICK, end]).await;
    versions.work(&["new", "old"], 5).await;
    // The former version is not needed any longer, and the robot's reports are known.
    fleet.tell("r", &[LOST]).await;
    versions.work(&["new"], 6).await;
    let made = fleet.of("r").await;
    let migrated: Vec<bool> = made.iter().map(|decided| decided.migrated).collect();
    assert_eq!(migrated, [false, false, false, false, true, false]);
    let target = made[2].state.migration.as_ref().map(|migration| &migration.target);
    assert!(target.is_some() && made[2].answers.is_empty());
    assert_eq!(Some(&made[4].state.digest), target);
    let has = |decided: &Decided, kind: &str| decided.answers.iter().any(|answer| answer["answer"] == kind);
    assert!(has(&made[1], "inferred") && !has(&made[5], "inferred"), "{:?}", made[5].answers);
    assert!(has(&made[4], "plan_found"), "{:?}", made[4].answers);
}

/// The loops of both versions count their planning problems from 0.
#[test]
fn plans_of_the_former_version_are_not_adopted_after_a_migration() {
    let versions = Versions::new();
    let missions = versions.missions(&["new", "old"]);
    for is_late in [false, true] {
        let mut robot = Robot::default();
        let begun = robot.begin(&event(1, ENROL), &versions.missions(&["old"]));
        let Ok(Begun::Search(search)) = begun else { panic!("a search is necessary") };
        let mut robot = Robot::restore(robot.finish(search, None));
        let thinker =
            |robot: &mut Robot| robot.thinker(&missions).expect("it is loaded").expect("it is pending");
        let former = thinker(&mut robot).think();
        let Ok(Begun::Search(search)) = robot.begin(&event(2, r#"{"event": "migrate"}"#), &missions) else {
            panic!("a search is necessary")
        };
        assert!(robot.finish(search, None).migrated);
        assert_eq!(robot.plan(former, is_late), None);
        let current = thinker(&mut robot).think();
        assert!(robot.plan(current, is_late).is_some_and(|decided| decided.planned && !decided.late));
    }
}

const SETS: [&[&str]; 4] = [&["old"], &["new"], &["new", "old"], &["old", "new"]];

/// Checks decisions by an independent definition: a robot without network that is restored from the preceding decision
/// must decide equally with the missions of the worker. An event without a decision must be refused with the missions
/// of some worker, or precede the retirement of the robot.
async fn verify(versions: &Versions, events: &BTreeMap<u64, &str>) {
    let missions: BTreeMap<String, Missions> =
        SETS.iter().map(|names| (names.join("+"), versions.missions(names))).collect();
    let decisions = versions.fleet.of("r").await;
    let count = decisions.len();
    let made: BTreeMap<u64, Decided> =
        decisions.into_iter().map(|decided| (decided.event, decided)).collect();
    assert_eq!(made.len(), count, "each event once");
    let mut last: Option<Decided> = None;
    for (sequence, text) in events {
        let decide = |worker: &str, time| {
            let event = Stored { time, ..event(*sequence, text) };
            last.clone().map_or_else(Robot::default, Robot::restore).decide(&event, &missions[worker])
        };
        if let Some(decided) = made.get(sequence) {
            let again = decide(&decided.worker, decided.state.enrolled + decided.now);
            let Ok(again) = again else { panic!("event {sequence}: {again:?}") };
            let [answers, expected] = [&again, decided].map(|decided| scripts::essence(&decided.answers));
            assert_eq!(answers, expected, "event {sequence}");
            let [flags, expected] = [&again, decided]
                .map(|decided| (&decided.enrolled, decided.retired, decided.migrated, &decided.state.digest));
            assert_eq!(flags, expected, "event {sequence}");
            last = Some(decided.clone());
        } else if !made.range(*sequence..).next().is_some_and(|(_, next)| next.retired) {
            let outcomes: Vec<_> = missions.keys().map(|worker| decide(worker, 0)).collect();
            let is_refused = outcomes.iter().any(|outcome| matches!(outcome, Err(Undecided::Refused(_))));
            assert!(is_refused, "event {sequence}: {outcomes:?}");
        }
    }
}

/// Owners with different versions are stopped at any time.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn owners_with_different_versions_agree_on_what_was_decided() {
    let ends: Vec<String> =
        (1..100).map(|action| format!(r#"{{"event": "action_succeeded", "action": {action}}}"#)).collect();
    let (migrate, later) = (r#"{"event": "migrate"}"#, r#"{"event": "migrate", "at": "goal"}"#);
    let mut random = fastrand::Rng::with_seed(11);
    for _ in 0..6 {
        let versions = Versions::new();
        let shared = SETS.map(|names| versions.shared(names));
        let mut texts = BTreeMap::new();
        let mut actions = 0;
        for _ in 0..25 {
            let mut events = Vec::new();
            for _ in 0..random.usize(1..4) {
                let end = ends[actions].as_str();
                let event =
                    [ENROL, ENROL, RETIRE, migrate, migrate, later, end, end, LOST, TICK][random.usize(..10)];
                actions = match event {
                    ENROL | RETIRE => 0,
                    event => actions + usize::from(event == end),
                };
                events.push(event);
            }
            texts.extend(versions.fleet.tell("r", &events).await.into_iter().zip(events));
            let _owner = Running::owner(Arc::clone(&shared[random.usize(..4)]));
            tokio::time::sleep(Duration::from_millis(random.u64(1..60))).await;
        }
        let end = [RETIRE, ENROL, TICK];
        texts.extend(versions.fleet.tell("r", &end).await.into_iter().zip(end));
        let last = texts.last_key_value().map(|(sequence, _)| *sequence);
        let worker = Running::worker(versions.shared(&["new", "old"]));
        let is_over = async || versions.fleet.of("r").await.last().map(|decided| decided.event) == last;
        until("the last event is not decided", is_over).await;
        worker.stop().await;
        verify(&versions, &texts).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn only_ids_are_kept_of_retired_robots() {
    let versions = Versions::new();
    let fleet = &versions.fleet;
    let mut count = 0;
    for _ in 0..2 {
        let shared = versions.shared(&["old"]);
        let worker = Running::worker(Arc::clone(&shared));
        for robot in ["a", "b", "c"] {
            count += fleet.tell(robot, &[ENROL, TICK, RETIRE]).await.len();
        }
        fleet.decided(count).await;
        let is_empty =
            async || shared.counts.robots.load(Ordering::Relaxed) == 0 && fleet.has_no_events().await;
        until("robots or events are kept", is_empty).await;
        worker.stop().await;
    }
    let made = fleet.of("a").await;
    assert!(made.iter().all(|decided| decided.answers.iter().all(|answer| answer["answer"] != "error")));
    let last = made.last().expect("there are decisions");
    assert_eq!(last.state, State { ids: last.state.ids.clone(), ..State::default() });
    assert_eq!(made.len(), 6);
}
