//! A deterministic simulation of the loop with an unreliable robot, as `FoundationDB` tests itself.
//!
//! A schedule is a seed. Messages either way are delayed, reordered, duplicated and lost; components fail and recover;
//! reconfigurations and actions fail; the loop crashes and comes back from its snapshot and the lines since. After some
//! time the robot is fair: nothing is lost, nothing fails any more, and what was said last is said again.
//!
//! The judge knows [`DESIGNS`], the messages, and the robot; rules (a) and (f) also read the beliefs of the loop. It demands:
//! - (a) after each reaction, before any planning: once all effects have arrived that the loop waits for, and after them those that are on their way, no action moves
//!   with a design that is forbidden by the reports delivered so far, without one, or with another one than the loop has given it; and
//!   the robot does not do so for longer than a bound;
//! - (b) the believed configuration is the one that follows from the messages by the table of `docs/reference/events.md`, and where
//!   nothing is pending it is the actual one;
//! - (c) at the end, each effect was carried out, superseded, about an action that has ended, or given up aloud;
//! - (d) at the end, the robot is at the goal, or the last decision is that there is no plan, and there is none;
//! - (e) a loop that is brought back from its snapshot and the steps since is in the state of the one that has crashed, and repeats
//!   the reconfigurations that have no answer;
//! - (f) a line that takes its design from the action under way is answered with a safe effect at once;
//! - (g) after planning, once all effects have arrived, the action that the loop lets go on does not stand still;
//! - (h) after planning an action stands still only where no design is available or there is no plan.

mod judge;
mod robot;
mod schedule;

use std::collections::BTreeMap;
use std::path::Path;

use metaplan::mapek::{Loop, Settings};
use metaplan::setup::Setup;

use schedule::{Faults, Schedule};

/// Designs of the function, each with the components that it needs. The judge knows nothing else of what is allowed.
pub const DESIGNS: [(&str, &[&str]); 3] = [("fd_a", &["c_a"]), ("fd_b", &["c_b"]), ("fd_c", &["c_a", "c_b"])];

/// The components.
pub const COMPONENTS: [&str; 2] = ["c_a", "c_b"];

/// The place where the robot begins.
pub const START: &str = "p0";

/// The place where the robot is to be.
pub const GOAL: &str = "p2";

/// The function.
pub const FUNCTION: &str = "f_drive";

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

/// A knowledge base with the designs, and estimations by which the first one is the slowest.
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

/// A loop to which nothing has happened.
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

/// Runs schedules; all violations, with their seeds.
fn violations(seeds: impl Iterator<Item = u64>, faults: fn(u64) -> Faults) -> Vec<(u64, String)> {
    let loops = [pristine(Settings::immediate()), pristine(Settings::default())];
    let run = |seed: u64| {
        let pristine = &loops[usize::from(seed % 4 == 3)];
        let schedule = || Schedule::new(pristine, seed, faults(seed));
        schedule().run().err()?;
        // Messages are kept in a second run only, of which they are the larger part.
        schedule().with_log().run().err().map(|violation| (seed, violation))
    };
    seeds.filter_map(run).collect()
}

#[test]
fn no_schedule_violates_what_the_loop_promises() {
    let first = number("METAPLAN_FIRST").unwrap_or(0);
    let found = violations(first..first + number("METAPLAN_SCHEDULES").unwrap_or(100), faults);
    assert!(found.is_empty(), "{}", told(&found));
}

/// In every other schedule the effects of the start may be lost, too.
fn faults(seed: u64) -> Faults {
    let faults = Faults::of(seed);
    if seed.is_multiple_of(2) { faults.with_lost_start() } else { faults }
}

/// The seeds of each kind of violation, with the messages of the first.
fn told(found: &[(u64, String)]) -> String {
    let kind = |violation: &str| violation.get(..3).unwrap_or_default().to_owned();
    let mut kinds: BTreeMap<String, Vec<&(u64, String)>> = BTreeMap::new();
    for violation in found {
        kinds.entry(kind(&violation.1)).or_default().push(violation);
    }
    let text = kinds.into_iter().map(|(kind, found)| {
        let seeds: Vec<u64> = found.iter().map(|own| own.0).collect();
        format!("{} of {kind}: {seeds:?}\n{}\n", found.len(), found[0].1)
    });
    text.collect()
}

/// The number in a variable of the environment.
fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

#[test]
#[ignore = "takes an hour or more; only a release build is of interest"]
fn a_million_schedules() {
    let found = violations(0..1_000_000, faults);
    assert!(found.is_empty(), "{}", told(&found));
}

/// Seeds of violations that were found: an effect that was superseded twice was carried out last (12), a suspension came before its
/// request (16, 85), an acknowledgement crossed an observation (10, 20, 64, 115), an action that was acknowledged never started (88, 128),
/// the first request was lost (320), a design that was given up counted as possible (140, 270), the lost request of an action that
/// stood still was never repeated (808, 918, 1102), the robot forgot a suspension (10532) or that its function had the design of a
/// request (1510), and the judge knew no doubt about an observed design (11036).
const FOUND: [u64; 18] =
    [10, 12, 16, 20, 64, 85, 88, 115, 128, 140, 270, 320, 808, 918, 1102, 1510, 10532, 11036];

/// Seeds of violations with all kinds of faults.
///
/// - A reconfiguration that was superseded or given up arrived after an observation of the function: 37078, 66068, 69890, 104954, 130019, 170712.
/// - The design before a failed reconfiguration had failed, too, or was not known: 2027, 2048, 3125, 3920, 39845, 54391, 78452.
/// - An action waited for a design that its function was not to get any more: 39, 201, 4693, 33347, 36095, 36977, 57984.
/// - An action never started, since its function had lost the design: 43186, 63592, 65974.
/// - The only cancellation was lost, and the robot had never acknowledged anything, as far as the loop knew: 165595.
/// - The attempt to decide without a search left traces: 46304, 67888, 123382.
/// - The judge was wrong about late failures, forgotten actions and robots that acknowledge nothing: 20, 529, 2245, 15852, 23994, 37483, 116491.
const FOUND_LATER: [u64; 35] = [
    20, 39, 201, 529, 2027, 2048, 2245, 3125, 3920, 4693, 15852, 23994, 33347, 36095, 36977, 37078, 37483,
    39845, 43186, 46304, 54391, 57984, 63592, 65974, 66068, 67888, 69890, 78452, 104_954, 116_491, 123_382,
    130_019, 165_595, 170_712, 14748,
];

#[test]
fn seeds_that_violated_something_once_are_kept() {
    let violations_of_earlier_kinds = violations(FOUND.into_iter(), |seed| faults(seed).of_earlier_kinds());
    assert!(violations_of_earlier_kinds.is_empty(), "{}", told(&violations_of_earlier_kinds));
    let violations_of_all_kinds = violations(FOUND_LATER.into_iter(), faults);
    assert!(violations_of_all_kinds.is_empty(), "{}", told(&violations_of_all_kinds));
}
