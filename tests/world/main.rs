//! Deterministic simulation of the loop with an unreliable robot, in the style of `FoundationDB`'s
//! simulation tests.
//!
//! A seed determines a schedule. Messages in both directions are delayed, reordered, duplicated and
//! lost. Components fail and recover. Reconfigurations and actions fail. The loop crashes, and
//! recovers from its snapshot and the later lines. After some time, the robot is fair: nothing is
//! lost, nothing fails, and the last reports are repeated.
//!
//! The judge ([`judge::Judge`]) is the oracle. It uses [`DESIGNS`], the messages, and the state of
//! the robot. Demands (a), (f), (g) and (h) also read the beliefs of the loop.
//!
//! Demands:
//! - (a) No action moves without a design, with a design that the delivered reports forbid, or with
//!   another design than the loop has requested. This is checked before and after planning, for the
//!   state after the arrival of all outstanding effects and then of all effects in transit. The robot
//!   itself moves with a forbidden design for a bounded number of steps only.
//! - (b) The believed configuration follows from the messages by the table of
//!   `docs/reference/events.md`. If the believed design is certain and no message about designs is in
//!   transit, it is the actual one, unless no loop could know this.
//! - (c) At the end, each effect was carried out, superseded, abandoned with a report, or implied
//!   by a report. Effects of ended actions are exempt unless they are reconfigurations, as are all
//!   effects for a robot that has never acknowledged one.
//! - (d) At the end, the robot is at the goal, or the last decision is that no plan exists, and
//!   this is true. The loop may also have stopped after repeated failures of a step, or wait for
//!   reports that the robot never sends.
//! - (e) A loop restored from its snapshot and the later steps has the state of the crashed loop,
//!   and repeats the last reconfiguration if it is unanswered.
//! - (f) A line that makes the design of the running action unusable is answered with a safe effect
//!   at once.
//! - (g) After planning, and after the arrival of all effects, an action that the loop lets
//!   continue does not stand still.
//! - (h) After planning, an action is suspended only if no design is available or no plan exists.

mod judge;
mod robot;
mod schedule;

use std::collections::BTreeMap;
use std::path::Path;

use metaplan::mapek::{Loop, Settings};
use metaplan::setup::Setup;

use schedule::{Faults, Schedule};

/// Designs in order of decreasing cost, each with the components that it requires.
pub const DESIGNS: [(&str, &[&str]); 3] = [("fd_a", &["c_a"]), ("fd_b", &["c_b"]), ("fd_c", &["c_a", "c_b"])];

const COMPONENTS: [&str; 2] = ["c_a", "c_b"];

const START: &str = "p0";

const GOAL: &str = "p2";

const FUNCTION: &str = "f_drive";

const DOMAIN: &str = "(define (domain m) (:requirements :typing :fluents :durative-actions)
  (:types place)
  (:predicates (robot_at ?p - place) (way ?from ?to - place))
  (:functions (usage))
  (:durative-action move :parameters (?from ?to - place) :duration (= ?duration (+ 1 (usage)))
    :condition (and (at start (robot_at ?from)) (over all (way ?from ?to)))
    :effect (and (at start (not (robot_at ?from))) (at end (robot_at ?to)))))";

const PROBLEM: &str = "(define (problem p) (:domain m) (:objects p0 p1 p2 - place)
  (:init (robot_at p0) (way p0 p1) (way p1 p0) (way p1 p2) (way p2 p1))
  (:goal (robot_at p2)) (:metric minimize (total-time)))";

fn knowledge() -> String {
    let mut text = "@prefix : <http://example.org/m#> .\n@prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
        @prefix t: <http://metacontrol.org/tomasys#> .\n\
        <http://example.org/m> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .\n\
        :usage a t:QualityAttributeType .\n:f_drive a t:Function .\n:a_move a t:Action ; t:requiresF :f_drive .\n"
        .to_owned();
    for component in COMPONENTS {
        text.extend([":", component, " a t:Component .\n"]);
    }
    for (rank, (design, components)) in DESIGNS.iter().enumerate() {
        let statements = format!(
            ":{design} a t:FunctionDesign ; t:solvesF :f_drive ; t:hasQAestimation :u_{design} .\n\
             :u_{design} a t:QAvalue ; t:isQAtype :usage ; t:hasValue {}.0 .\n",
            2 - rank
        );
        text += &statements;
        for component in *components {
            text.extend([":", design, " t:requiresC :", component, " .\n"]);
        }
    }
    text
}

fn pristine(settings: Settings) -> Loop {
    let directory = tempfile::tempdir().expect("a directory");
    let manifest = "name = \"m\"\n[knowledge]\nfiles = [\"kb.ttl\"]\n[planning]\ndomain = \"domain.pddl\"\n\
        problem = \"problem.pddl\"\n";
    let files =
        [("kb.ttl", knowledge()), ("domain.pddl", DOMAIN.to_owned()), ("problem.pddl", PROBLEM.to_owned())];
    for (name, text) in files {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    let path: &Path = directory.path();
    let mission = Setup::parse("m.toml", manifest, path).expect("the mission is read").mission;
    Loop::new(mission, settings).expect("the mission can be planned for")
}

/// Runs the schedules of the seeds. Returns the first violation of each schedule, with its seed.
fn violations(seeds: impl Iterator<Item = u64>, faults: fn(u64) -> Faults) -> Vec<(u64, String)> {
    let loops = [pristine(Settings::immediate()), pristine(Settings::default())];
    let run = |seed: u64| {
        let pristine = &loops[usize::from(seed % 4 == 3)];
        let schedule = || Schedule::new(pristine, seed, faults(seed));
        schedule().run().err()?;
        // Messages are recorded only in a second run, because recording dominates the run time.
        schedule().with_log().run().err().map(|violation| (seed, violation))
    };
    seeds.filter_map(run).collect()
}

#[test]
fn no_schedule_violates_a_demand() {
    let first = number("METAPLAN_FIRST").unwrap_or(0);
    let violations_found = violations(first..first + number("METAPLAN_SCHEDULES").unwrap_or(100), faults);
    assert!(violations_found.is_empty(), "{}", summary(&violations_found));
}

/// Returns the faults of a seed. With an even seed, the effects sent at the start can be lost, too.
fn faults(seed: u64) -> Faults {
    let faults = Faults::of(seed);
    if seed.is_multiple_of(2) { faults.with_lost_start() } else { faults }
}

fn summary(violations_found: &[(u64, String)]) -> String {
    let kind = |violation: &str| violation.get(..3).unwrap_or_default().to_owned();
    let mut kinds: BTreeMap<String, Vec<&(u64, String)>> = BTreeMap::new();
    for violation in violations_found {
        kinds.entry(kind(&violation.1)).or_default().push(violation);
    }
    let text = kinds.into_iter().map(|(kind, violations_found)| {
        let seeds: Vec<u64> = violations_found.iter().map(|own| own.0).collect();
        format!("{} of {kind}: {seeds:?}\n{}\n", violations_found.len(), violations_found[0].1)
    });
    text.collect()
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

#[test]
#[ignore = "takes an hour or more; only a release build is of interest"]
fn a_million_schedules() {
    let violations_found = violations(0..1_000_000, faults);
    assert!(violations_found.is_empty(), "{}", summary(&violations_found));
}

/// Seeds of earlier violations, all repaired. An effect that was superseded twice was carried out last (12). A
/// suspension arrived before its request (16, 85). An acknowledgement crossed an observation (10, 20, 64, 115). An
/// acknowledged action never started (88, 128). The first request was lost (320). An abandoned design counted as
/// available (140, 270). The lost request of a suspended action was never repeated (808, 918, 1102). The robot forgot a
/// suspension (10532), or that its function had the design of a request (1510). The judge did not regard an observed
/// design as doubtful (11036).
const REPAIRED_SEEDS: [u64; 18] =
    [10, 12, 16, 20, 64, 85, 88, 115, 128, 140, 270, 320, 808, 918, 1102, 1510, 10532, 11036];

/// Seeds of earlier violations with all kinds of faults, all repaired.
///
/// - A superseded or abandoned reconfiguration arrived after an observation of the function: 37078, 66068, 69890,
///   104954, 130019, 170712.
/// - The arrival of a reconfiguration was implied by a report, but a copy of it or an earlier one was still on its way:
///   1553946, 4514333.
/// - The design before a failed reconfiguration had failed, too, or was unknown: 2027, 2048, 3125, 3920, 39845, 54391,
///   78452.
/// - An action waited for a design that its function would never get: 39, 201, 4693, 33347, 36095, 36977, 57984.
/// - An action never started, because its function had lost the design: 43186, 63592, 65974.
/// - The only cancellation was lost, and the robot had never acknowledged anything to the loop: 165595.
/// - A deliberation without a search changed the state although it was undone: 46304, 67888, 123382.
/// - A refused line came at the time of another search: 540936.
/// - Two reconfigurations were refused at the same time: 14748.
/// - The judge was wrong about late failures, forgotten actions and robots without acknowledgements: 20, 529, 2245,
///   15852, 23994, 37483, 116491, 377435, 429245, 614663,
///   4501127.
const REPAIRED_SEEDS_OF_ALL_KINDS: [u64; 42] = [
    429_245, 614_663, 377_435, 1_553_946, 4_514_333, 4_501_127, 540_936, 20, 39, 201, 529, 2027, 2048, 2245,
    3125, 3920, 4693, 15852, 23994, 33347, 36095, 36977, 37078, 37483, 39845, 43186, 46304, 54391, 57984,
    63592, 65974, 66068, 67888, 69890, 78452, 104_954, 116_491, 123_382, 130_019, 165_595, 170_712, 14748,
];

/// Seeds of schedules in which rare faults of the loop would show: a suspension or resumption that does not name the
/// effects superseded by its predecessor (22789, 29794), a reconfiguration that does not name an abandoned one (7159), and
/// superseded reconfigurations that count as not carried out (1762, 2094).
const SENSITIVE_SEEDS: [u64; 5] = [1762, 2094, 7159, 22_789, 29_794];

#[test]
fn no_sensitive_seed_violates_anything() {
    let violations_found = violations(SENSITIVE_SEEDS.into_iter(), faults);
    assert!(violations_found.is_empty(), "{}", summary(&violations_found));
}

#[test]
fn no_repaired_seed_violates_anything_again() {
    let violations_of_earlier_kinds =
        violations(REPAIRED_SEEDS.into_iter(), |seed| faults(seed).of_earlier_kinds());
    assert!(violations_of_earlier_kinds.is_empty(), "{}", summary(&violations_of_earlier_kinds));
    let violations_of_all_kinds = violations(REPAIRED_SEEDS_OF_ALL_KINDS.into_iter(), faults);
    assert!(violations_of_all_kinds.is_empty(), "{}", summary(&violations_of_all_kinds));
}
