//! Tests of the journal within one process: after a cut at any byte of the last two lines, the loop
//! is restored, and no acknowledged effect is repeated. Damaged journals and journals of another
//! mission are refused.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use metaplan::journal::{Journal, Policy, Recovery, Sync};
use metaplan::mapek::{Answer, Effect, Loop};

use crate::common::{control, last_segment};

pub const POLICY: Policy = Policy { sync: Sync::Never, snapshot_every: 7 };

/// Returns the reports of a robot during the UGV mission. One of them is invalid.
pub fn script() -> Vec<String> {
    let events = [
        r#""event":"action_started","action":1"#,
        r#""event":"action_progress","action":1,"fraction":0.4"#,
        r#""event":"fact_changed","name":"battery","value":99.1"#,
        r#""event":"measured","attribute":"ambient_light","value":0.5"#,
        r#""event":"action_succeeded","action":1"#,
        r#""event":"action_started","action":2"#,
        r#""event":"component_status","component":"c_kinect","status":"FALSE""#,
        r#""event":"acknowledged","effect":5"#,
        r#""event":"nonsense""#,
        r#""event":"action_cancelled","action":2"#,
        r#""event":"acknowledged","effect":6"#,
        r#""event":"action_started","action":3"#,
        r#""event":"tick""#,
        r#""event":"component_status","component":"c_kinect","status":"RECOVERED""#,
        r#""event":"acknowledged","effect":8"#,
        r#""event":"action_succeeded","action":3"#,
        r#""event":"goal_changed","goal":"(robot_at wp8)""#,
        r#""event":"action_failed","action":4,"reason":"lost""#,
        r#""event":"action_started","action":5"#,
        r#""event":"fact_changed","name":"robot_at","value":"wp5""#,
        r#""event":"action_cancelled","action":5"#,
        r#""event":"action_succeeded","action":6"#,
    ];
    numbered(&events)
}

/// Returns the reports of a robot during the UUV mission. Its thrusters fail, so an action is suspended, and
/// its battery drops.
pub fn uuv_script() -> Vec<String> {
    let events = [
        r#""event":"action_started","action":1"#,
        r#""event":"action_progress","action":1,"fraction":0.25"#,
        r#""event":"measured","attribute":"water_visibility","value":2.5"#,
        r#""event":"acknowledged","effect":4"#,
        r#""event":"component_status","component":"c_thruster_1","status":"FALSE""#,
        r#""event":"acknowledged","effect":5"#,
        r#""event":"tick""#,
        r#""event":"component_status","component":"c_thruster_3","status":"ERROR""#,
        r#""event":"component_status","component":"c_thruster_1","status":"RECOVERED""#,
        r#""event":"acknowledged","effect":7"#,
        r#""event":"action_progress","action":1,"fraction":0.5"#,
        r#""event":"fact_changed","name":"battery","value":9"#,
        r#""event":"fact_changed","name":"battery","value":30"#,
        r#""event":"component_status","component":"c_thruster_3","status":"OK""#,
        r#""event":"action_cancelled","action":1"#,
        r#""event":"action_started","action":2"#,
        r#""event":"action_succeeded","action":2"#,
        r#""event":"action_succeeded","action":3"#,
        r#""event":"nonsense""#,
        r#""event":"action_failed","action":4,"reason":"lost""#,
        r#""event":"action_succeeded","action":5"#,
        r#""event":"action_succeeded","action":6"#,
    ];
    numbered(&events)
}

fn numbered(events: &[&str]) -> Vec<String> {
    let line =
        |(index, event): (usize, &&str)| format!(r#"{{{event},"seq":{},"time":{}.25}}"#, index + 1, index);
    events.iter().enumerate().map(line).collect()
}

#[derive(Debug, Default, PartialEq)]
pub struct Robot {
    pub effects: BTreeMap<u64, Effect>,
}

impl Robot {
    /// Returns the effects that no other effect supersedes. Only these must arrive.
    fn needed(&self) -> Vec<&Effect> {
        let replaced: Vec<u64> = self.effects.values().flat_map(|effect| effect.supersedes.clone()).collect();
        self.effects.values().filter(|effect| !replaced.contains(&effect.number)).collect()
    }

    fn take(&mut self, control: &Loop, answers: &[Answer]) {
        for effect in answers.iter().filter_map(Answer::effect) {
            let plain = Effect { repeated: false, ..effect.clone() };
            let before = self.effects.insert(effect.number, plain.clone());
            assert!(before.is_none() || effect.repeated, "{effect:?} comes twice without a word");
            assert!(before.is_none_or(|before| before == plain), "{effect:?} has changed");
            if effect.repeated {
                let waiting =
                    control.beliefs().outstanding().any(|outstanding| outstanding.number == effect.number);
                assert!(waiting, "{effect:?} was acknowledged");
            }
        }
    }
}

fn open(directory: &Path, pristine: &Loop) -> (Journal, Loop, Recovery, Vec<Answer>) {
    let mut control = pristine.clone();
    let (mut journal, recovery) = Journal::open(directory, POLICY, &mut control).expect("the journal opens");
    let answers = journal.begin(&mut control).expect("written");
    (journal, control, recovery, answers)
}

fn go_on(journal: &mut Journal, control: &mut Loop, robot: &mut Robot) {
    for (index, line) in script().iter().enumerate() {
        if control.beliefs().sequence() < Some(index as u64 + 1) {
            let answers = journal.handle(control, line, Duration::ZERO).expect("written");
            robot.take(control, &answers);
        }
    }
}

/// Returns the state of a loop without the number of lines, because refused lines may be repeated.
pub fn state(control: &Loop) -> serde_json::Value {
    let mut state = control.snapshot().0;
    state.as_object_mut().expect("an object").remove("lines");
    state
}

fn undisturbed(pristine: &Loop) -> (serde_json::Value, Robot, tempfile::TempDir) {
    let directory = tempfile::tempdir().expect("a directory");
    let (mut journal, mut control, _, answers) = open(directory.path(), pristine);
    let mut robot = Robot::default();
    robot.take(&control, &answers);
    go_on(&mut journal, &mut control, &mut robot);
    assert!(control.beliefs().reached(), "{:?}", control.snapshot());
    (state(&control), robot, directory)
}

#[test]
fn a_journal_cut_anywhere_restores_the_loop() {
    check(60);
}

#[test]
#[ignore = "takes a minute"]
fn a_journal_cut_at_five_hundred_places_restores_the_loop() {
    check(500);
}

fn check(cuts: usize) {
    let pristine = control("ugv");
    let (state, effects, _directory) = undisturbed(&pristine);
    let mut random = fastrand::Rng::with_seed(3);
    let received = received(&pristine);
    for _ in 0..cuts {
        let directory = tempfile::tempdir().expect("a directory");
        let (mut journal, mut control, _, answers) = open(directory.path(), &pristine);
        let mut robot = Robot::default();
        robot.take(&control, &answers);
        let stop = random.usize(1..=script().len());
        for line in &script()[..stop] {
            let answers = journal.handle(&mut control, line, Duration::ZERO).expect("written");
            robot.take(&control, &answers);
        }
        drop(journal);
        // Up to two lines at the end of the last segment are missing or incomplete. Only unsent effects may be
        // lost, so the robot forgets the effects that it received for the lost lines.
        let last = last_segment(directory.path());
        let text = std::fs::read(&last).expect("a journal");
        let lines: Vec<&[u8]> = text.split_inclusive(|&byte| byte == b'\n').collect();
        let sound: usize = lines[..lines.len().saturating_sub(2).max(1)].iter().map(|line| line.len()).sum();
        let keep = random.usize(sound..=text.len());
        std::fs::write(&last, &text[..keep]).expect("cut");
        let (mut journal, mut control, recovery, answers) = open(directory.path(), &pristine);
        let handled = control.beliefs().sequence().unwrap_or(0);
        let mut robot = Robot { effects: received[handled.saturating_sub(1) as usize].clone() };
        let torn = keep > sound && text[keep - 1] != b'\n' && text.get(keep) != Some(&b'\n');
        assert_eq!(recovery.cut > 0, torn);
        robot.take(&control, &answers);
        go_on(&mut journal, &mut control, &mut robot);
        assert_eq!(self::state(&control), state, "stopped after {stop}, kept {keep} of {}", text.len());
        assert_eq!(robot.needed(), effects.needed());
    }
}

fn received(pristine: &Loop) -> Vec<BTreeMap<u64, Effect>> {
    let mut control = pristine.clone();
    let mut robot = Robot::default();
    let answers = control.start();
    robot.take(&control, &answers);
    let mut effects_by_lines = vec![robot.effects.clone()];
    for line in script() {
        let answers = crate::common::feed(&mut control, &line);
        robot.take(&control, &answers);
        effects_by_lines.push(robot.effects.clone());
    }
    effects_by_lines
}

#[test]
fn a_damaged_journal_is_refused() {
    let pristine = control("ugv");
    let (_, _, directory) = undisturbed(&pristine);
    let last = last_segment(directory.path());
    let mut text = std::fs::read(&last).expect("a journal");
    text[60] ^= 1;
    std::fs::write(&last, &text).expect("damaged");
    let refused = Journal::open(directory.path(), POLICY, &mut pristine.clone());
    let message = refused.expect_err("a damaged journal").message.clone();
    assert!(message.contains("is damaged"), "{message}");
}

#[test]
fn a_journal_of_another_mission_is_refused() {
    let (_, _, directory) = undisturbed(&control("ugv"));
    let refused = Journal::open(directory.path(), POLICY, &mut control("uuv"));
    let message = refused.expect_err("another mission's journal").message.clone();
    assert!(message.contains("belongs to another mission"), "{message}");
}

/// A power loss during a checkpoint can leave the new segment, without records, and remove the last records of the old
/// one, with which it begins.
#[test]
fn a_segment_that_a_checkpoint_has_begun_is_not_needed() {
    let pristine = control("ugv");
    let (state, effects, _directory) = undisturbed(&pristine);
    let directory = tempfile::tempdir().expect("a directory");
    let (mut journal, mut control, _, answers) = open(directory.path(), &pristine);
    let mut robot = Robot::default();
    robot.take(&control, &answers);
    let count = POLICY.snapshot_every as usize;
    for line in &script()[..count] {
        let answers = journal.handle(&mut control, line, Duration::ZERO).expect("written");
        robot.take(&control, &answers);
    }
    drop(journal);
    std::fs::remove_file(directory.path().join("snapshot-000001")).expect("a snapshot");
    let cut = |name: &str, keep: &dyn Fn(usize) -> usize| {
        let file = directory.path().join(name);
        let text = std::fs::read_to_string(&file).expect("a segment");
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        std::fs::write(&file, lines[..keep(lines.len())].concat()).expect("written");
    };
    cut("journal-000001", &|_| 1);
    // The `end` record and the last event with its decision are missing.
    cut("journal-000000", &|lines| lines - 3);
    let (mut journal, mut control, recovery, answers) = open(directory.path(), &pristine);
    let warnings: Vec<String> = recovery.warnings.iter().map(|warning| warning.message.clone()).collect();
    assert!(warnings.iter().any(|text| text.contains("records of the journal are missing")), "{warnings:?}");
    let mut robot = Robot { effects: received(&pristine)[count - 1].clone() };
    robot.take(&control, &answers);
    go_on(&mut journal, &mut control, &mut robot);
    assert_eq!(self::state(&control), state);
    assert_eq!(robot.needed(), effects.needed());
    drop(journal);
    open(directory.path(), &pristine);
}

/// The time of lines with times must not advance by the clock after a restart.
#[test]
fn a_restored_loop_knows_that_lines_have_times() {
    let pristine = control("ugv");
    for (line, expected) in [
        (r#"{"event":"tick"}"#, false),
        (r#"{"event":"tick","time":3}"#, true),
        // The loop refuses these lines.
        (r#"{"event":"tick","time":1764535144}"#, false),
        (r#"{"event":"tikc","time":3}"#, false),
    ] {
        let mut control = pristine.clone();
        assert!(!control.beliefs().has_times());
        crate::common::feed(&mut control, line);
        let mut restored = pristine.clone();
        restored.restore(&control.snapshot()).expect("the snapshot fits");
        assert_eq!([control.beliefs().has_times(), restored.beliefs().has_times()], [expected; 2]);
    }
}
