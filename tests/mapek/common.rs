//! Creation of MAPE-K loops for the tests, and delivery of events.

use std::path::{Path, PathBuf};
use std::time::Duration;

use metaplan::mapek::{Answer, Loop, Observation, Settings};
use metaplan::setup::Setup;

/// Creates a loop for a shipped mission. The loop accepts every report immediately, without filters, so that
/// tests can compare its beliefs with the last report.
pub fn control(name: &str) -> Loop {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{name}.toml"));
    let Setup { mission, settings, .. } = Setup::read(&manifest).expect("the mission is read");
    let settings = Settings::immediate().with_time_unit(settings.time_unit);
    Loop::new(mission, settings).expect("the mission can be planned for")
}

/// Delivers an event line 100 ms after the previous line.
pub fn feed(control: &mut Loop, line: &str) -> Vec<Answer> {
    let now = control.beliefs().now() + Duration::from_millis(100);
    control.handle(&Observation::parse(line), now)
}

/// Returns a loop, not started, for the knowledge base of the UGV with this domain and problem. `sections` end its
/// manifest.
pub fn own(domain: &str, problem: &str, sections: &str) -> Loop {
    let knowledge = Path::new(env!("CARGO_MANIFEST_DIR")).join("ontology/kb/ugv.ttl");
    read(domain, problem, &format!("[knowledge]\nfiles = ['{}']", knowledge.display()), sections)
}

/// Returns a loop, not started, for this domain and problem without a knowledge base.
pub fn plain(domain: &str, problem: &str) -> Loop {
    read(domain, problem, "[knowledge]\nfiles = []", "")
}

const ROADS: &str = "(define (domain d) (:requirements :strips :typing) (:types place)
  (:predicates (at ?p - place) (road ?a ?b - place))
  (:action move :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b))
    :effect (and (not (at ?a)) (at ?b))))";

/// Returns a loop, not started, for a robot at place b of the places b, c and d. It has no knowledge base.
pub fn crossroads(roads: &str, goal: &str) -> Loop {
    let problem = format!(
        "(define (problem p) (:domain d) (:objects b c d - place) (:init (at b) {roads}) (:goal (at {goal})))"
    );
    plain(ROADS, &problem)
}

fn read(domain: &str, problem: &str, knowledge: &str, sections: &str) -> Loop {
    let directory = tempfile::tempdir().expect("a directory");
    for (name, text) in [("domain.pddl", domain), ("problem.pddl", problem)] {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    let manifest = format!(
        "name = 'own'\n{knowledge}\n[planning]\ndomain = 'domain.pddl'\nproblem = 'problem.pddl'\n{sections}\n"
    );
    let setup = Setup::parse("m.toml", &manifest, directory.path());
    let Setup { mission, settings, .. } = setup.expect("the mission is read");
    Loop::new(mission, settings).expect("a loop")
}

/// Returns the kinds of the answers.
pub fn kinds(answers: &[Answer]) -> Vec<String> {
    answers.iter().map(|answer| answer.to_json()["answer"].as_str().expect("a kind").to_owned()).collect()
}

/// Returns the last segment of the journal in a directory.
pub fn last_segment(directory: &Path) -> PathBuf {
    let entries =
        std::fs::read_dir(directory).expect("a directory").map(|entry| entry.expect("an entry").path());
    entries.filter(|path| path.to_string_lossy().contains("journal-")).max().expect("a journal")
}
