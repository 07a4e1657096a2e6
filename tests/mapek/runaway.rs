//! Tests with a rule that does not terminate: no report is refused, and no action starts while inferred facts
//! are missing. Once the rule terminates, designs and objectives have the same statuses as in a loop without the
//! rule.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use metaplan::journal::{Journal, Policy, Sync};
use metaplan::mapek::{Answer, Command, Loop, Observation, Settings};
use metaplan::setup::Setup;
use serde_json::json;

use crate::common::feed;

/// Rule that counts without end while the first component has failed.
const RUNAWAY: &str = "@prefix : <http://example.org/m#> .\n@prefix t: <http://metacontrol.org/tomasys#> .\n\
    [counting] t:c_status(:c_0, \"FALSE\") ^ :counts(?x, ?n) ^ swrlb:add(?m, ?n, 1) -> :counts(?x, ?m) .\n";

fn read(directory: &Path) -> Loop {
    let mission = Setup::read(&directory.join("m.toml")).expect("the mission is read").mission;
    Loop::new(mission, Settings::immediate()).expect("the mission can be planned for")
}

/// Returns the directory of a mission with the non-terminating rule, and a loop for the same mission without
/// the rule.
fn mission(seed: u64) -> (tempfile::TempDir, Loop) {
    let directory = crate::worlds::own_files(seed);
    let append = |name: &str, addition: &str| {
        let path = directory.path().join(name);
        let text = std::fs::read_to_string(&path).expect("text");
        std::fs::write(&path, text + addition).expect("written");
    };
    append("kb.ttl", ":counter :counts 0 .\n:counts a owl:DatatypeProperty .\n");
    let tame = read(directory.path());
    append("own.swrl", RUNAWAY);
    (directory, tame)
}

fn component(number: usize, status: &str) -> String {
    json!({ "event": "component_status", "component": format!("c_{number}"), "status": status }).to_string()
}

fn faults(answers: &[Answer]) -> Vec<Option<String>> {
    let fault = |answer: &Answer| match answer {
        Answer::Unconcluded { fault } => Some(fault.as_ref().map(|fault| fault.rule.clone())),
        _ => None,
    };
    answers.iter().filter_map(fault).collect()
}

fn nothing_begins(answers: &[Answer]) {
    for effect in answers.iter().filter_map(Answer::effect) {
        let stops = matches!(effect.command, Command::Suspend { .. } | Command::Cancel { .. });
        assert!(stops, "{effect:?}");
    }
    assert!(!answers.iter().any(|answer| matches!(answer, Answer::Error { .. })), "{answers:?}");
}

#[test]
fn reports_are_accepted_despite_a_nonterminating_rule() {
    let (directory, mut tame) = mission(3);
    let mut wild = read(directory.path());
    tame.start();
    wild.start();
    assert_eq!(wild.beliefs().available(), tame.beliefs().available());
    let answers = feed(&mut wild, &component(0, "FALSE"));
    assert_eq!(faults(&answers), [Some("counting".to_owned())], "{answers:?}");
    nothing_begins(&answers);
    assert!(wild.beliefs().available().is_empty());
    for (number, status) in [(1, "FALSE"), (2, "FALSE"), (1, "TRUE"), (2, "TRUE")] {
        let answers = feed(&mut wild, &component(number, status));
        assert_eq!(faults(&answers), [], "it is said once: {answers:?}");
        nothing_begins(&answers);
        feed(&mut tame, &component(number, status));
    }
    nothing_begins(&feed(&mut wild, r#"{"event":"tick"}"#));
    // A restored loop lacks the same inferred facts.
    let mut restored = read(directory.path());
    restored.restore(&wild.snapshot()).expect("the snapshot fits");
    assert_eq!(restored.snapshot(), wild.snapshot());
    for control in [&mut wild, &mut restored] {
        let answers = feed(control, &component(0, "TRUE"));
        assert_eq!(faults(&answers), [None], "{answers:?}");
    }
    feed(&mut tame, &component(0, "TRUE"));
    for control in [&wild, &restored] {
        assert_eq!(control.beliefs().available(), tame.beliefs().available());
        assert_eq!(control.beliefs().statuses(), tame.beliefs().statuses());
        assert!(control.beliefs().running().is_some() && !control.beliefs().suspended());
    }
}

#[test]
fn a_journal_restores_missing_conclusions() {
    let (directory, _) = mission(3);
    let place = tempfile::tempdir().expect("a directory");
    let policy = Policy { sync: Sync::Never, snapshot_every: 3 };
    let mut control = read(directory.path());
    let (mut journal, _) = Journal::open(place.path(), policy, &mut control).expect("it opens");
    journal.begin(&mut control).expect("written");
    for (number, status) in [(1, "FALSE"), (0, "FALSE"), (2, "FALSE"), (1, "TRUE")] {
        journal.handle(&mut control, &component(number, status), Duration::ZERO).expect("written");
    }
    drop(journal);
    let mut restored = read(directory.path());
    let (mut journal, recovery) = Journal::open(place.path(), policy, &mut restored).expect("it opens again");
    journal.begin(&mut restored).expect("written");
    assert!(recovery.warnings.is_empty(), "{:?}", recovery.warnings);
    assert_eq!(restored.snapshot(), control.snapshot());
    assert!(restored.beliefs().available().is_empty());
}

#[test]
fn another_version_has_the_conclusions_that_were_missing() {
    let (directory, mut next) = mission(3);
    // The next version lacks a component.
    let kb = directory.path().join("kb.ttl");
    let text = std::fs::read_to_string(&kb).expect("text");
    std::fs::write(&kb, text + ":c_9 a t:Component .\n").expect("written");
    let initial = read(directory.path());
    let (mut wild, mut told) = (initial.clone(), next.clone());
    let report = |control: &mut Loop, number: usize, status: &str| {
        control.react(&Observation::parse(&component(number, status)), Duration::from_secs(1))
    };
    report(&mut wild, 0, "FALSE");
    report(&mut wild, 9, "FALSE");
    report(&mut told, 0, "FALSE");
    assert!(wild.beliefs().available().is_empty() && wild.beliefs().running().is_none());
    let answers = next.migrate(&wild, &initial).expect("no action is under way");
    assert_eq!(faults(&answers), [None], "{answers:?}");
    nothing_begins(&report(&mut next, 1, "FALSE"));
    report(&mut told, 1, "FALSE");
    assert_eq!(next.beliefs().available(), told.beliefs().available());
    assert_eq!(next.beliefs().statuses(), told.beliefs().statuses());
}

#[test]
fn a_reported_value_replaces_that_of_another_version() {
    let (directory, tame) = mission(3);
    let kb = directory.path().join("kb.ttl");
    let text = std::fs::read_to_string(&kb).expect("text");
    std::fs::write(&kb, text.replace("t:hasValue 0.5", "t:hasValue 0.6")).expect("written");
    let mut next = read(directory.path());
    let mut robot = tame.clone();
    let line = r#"{"event":"measured","attribute":"light","value":0.7}"#;
    robot.react(&Observation::parse(line), Duration::from_secs(1));
    let light = |control: &Loop| {
        let knowledge = control.beliefs().mission().knowledge().expect("a knowledge base");
        let values = knowledge.view().measurements().into_iter();
        let values = values.map(|element| (element.attribute, element.value.map(|value| value.to_string())));
        values.collect::<BTreeMap<_, _>>()
    };
    assert_eq!(light(&next)["light"].as_deref(), Some("3/5"));
    next.migrate(&robot, &tame).expect("no action is under way");
    assert_eq!(light(&next)["light"].as_deref(), Some("7/10"));
    assert_eq!(light(&next)["depth"].as_deref(), Some("3/5"), "the robot has not reported it");
}
