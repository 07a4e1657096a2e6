//! Tests with bursts of faults, also while an action is being cancelled or suspended: no
//! observation is dropped, and damaged designs are not used.
//!
//! The oracle checks after each line: (a) Available designs and objectives in error equal those of
//! a fresh knowledge base that gets the last report of each component and attribute in another
//! order. In most missions, they also satisfy the definition of the shipped rules. (b) No design is
//! requested, used or resumed that is unavailable in the fresh knowledge base.
#![expect(clippy::print_stdout, reason = "figures are what the long test is for")]

use std::collections::{BTreeMap, BTreeSet};

use fastrand::Rng;
use metaplan::knowledge::Knowledge;
use metaplan::mapek::{Answer, Command, Loop};
use num_rational::BigRational;
use ontology::tomasys::change::Status;
use serde_json::{Value, json};

use crate::common::{control, feed};
use crate::worlds::{Place, generated, shipped, suave};

#[derive(Debug, Clone, Default)]
struct LastReports {
    components: BTreeMap<String, &'static str>,
    attributes: BTreeMap<String, String>,
}

type Statuses = BTreeMap<String, Vec<String>>;

/// Applies the last reports to a fresh knowledge base in random order. Returns the available designs, and the
/// statuses of the objectives in error.
fn fresh(
    place: &Place,
    last_reports: &LastReports,
    control: &Loop,
    random: &mut Rng,
) -> (BTreeSet<String>, Statuses) {
    let mission = place.started.beliefs().mission();
    let mut knowledge: Knowledge = mission.knowledge().expect("a knowledge base").clone();
    let mut words: Vec<(bool, &str, &str)> = Vec::new();
    words.extend(last_reports.components.iter().map(|(name, status)| (true, name.as_str(), *status)));
    words.extend(last_reports.attributes.iter().map(|(name, value)| (false, name.as_str(), value.as_str())));
    random.shuffle(&mut words);
    let grounded = at_work(control);
    let early = random.bool();
    if early {
        knowledge.pursue(&grounded).expect("the objectives are known");
    }
    for (is_component, name, word) in words {
        if is_component {
            let status = match word {
                "FALSE" => Status::Failed,
                "RECOVERED" => Status::Recovered,
                _ => Status::Working,
            };
            knowledge.report(name, status).expect("the component is known");
        } else {
            knowledge.measure(name, word).expect("the attribute is known");
        }
    }
    if !early {
        knowledge.pursue(&grounded).expect("the objectives are known");
    }
    let designs = knowledge.view().function_designs().into_iter().filter(|design| design.available);
    let objectives =
        knowledge.runtime().objectives().into_iter().filter(ontology::runtime::Objective::is_in_error);
    (
        designs.map(|design| design.individual.name).collect(),
        objectives.map(|objective| (objective.individual.name, objective.statuses)).collect(),
    )
}

fn at_work(control: &Loop) -> Vec<(String, String)> {
    let knowledge = control.beliefs().mission().knowledge().expect("a knowledge base");
    let mut pairs = Vec::new();
    for objective in knowledge.runtime().objectives() {
        let design = objective.groundings.first().and_then(|grounding| grounding.design.clone());
        if let (Some(function), Some(design)) = (objective.function, design) {
            pairs.push((function.name, design.name));
        }
    }
    pairs
}

/// Returns whether a design has failed by definition, as two flags. The first is `true` if the design
/// requires a failed component, directly or by dependency. The second is `true` if the last measurement
/// violates a bound.
fn defects(place: &Place, last_reports: &LastReports, design: &str) -> (bool, bool) {
    let mut failed: BTreeSet<&str> = last_reports
        .components
        .iter()
        .filter(|(_, status)| **status == "FALSE")
        .map(|(name, _)| name.as_str())
        .collect();
    for _ in 0..place.depends.len() {
        let dependents = place.depends.iter().filter(|(_, dependency)| failed.contains(dependency.as_str()));
        failed.extend(dependents.map(|(component, _)| component.as_str()).collect::<Vec<_>>());
    }
    let design = place.designs.iter().find(|candidate| candidate.name == design).expect("a design");
    let exact = |text: &String| -> BigRational {
        let literal = rules::Literal::parse(text, Some("http://www.w3.org/2001/XMLSchema#decimal"), None);
        literal.as_rational().expect("a number")
    };
    let broken = design.bounds.iter().any(|(attribute, minimum, maximum)| {
        let Some(value) = last_reports.attributes.get(attribute).map(exact) else { return false };
        minimum.as_ref().is_some_and(|lower| value < *lower)
            || maximum.as_ref().is_some_and(|upper| value > *upper)
    });
    (design.components.iter().any(|component| failed.contains(component.as_str())), broken)
}

struct Life<'a> {
    place: &'a Place,
    control: Loop,
    last_reports: LastReports,
    random: Rng,
    log: Vec<String>,
}

impl<'a> Life<'a> {
    fn new(place: &'a Place, seed: u64) -> Self {
        let control = place.started.clone();
        Self {
            place,
            control,
            last_reports: LastReports::default(),
            random: Rng::with_seed(seed),
            log: Vec::new(),
        }
    }

    fn burst(&mut self) -> String {
        let count = if self.random.bool() { 1 } else { self.random.usize(2..=5) };
        let (mut components, mut measured) = (Vec::new(), Vec::new());
        for _ in 0..count {
            if self.random.u32(..3) == 0 && !self.place.attributes.is_empty() {
                let (name, values) = &self.place.attributes[self.random.usize(..self.place.attributes.len())];
                measured.push((name.clone(), values[self.random.usize(..values.len())].clone()));
            } else {
                let name = &self.place.components[self.random.usize(..self.place.components.len())];
                let status = ["FALSE", "FALSE", "RECOVERED", "TRUE"][self.random.usize(..4)];
                components.push((name.clone(), status));
            }
        }
        // Of several values for one key, the first one counts.
        for (name, status) in components.iter().rev() {
            self.last_reports.components.insert(name.clone(), status);
        }
        for (name, value) in measured.iter().rev() {
            self.last_reports.attributes.insert(name.clone(), value.clone());
        }
        if let ([(name, status)], []) = (&components[..], &measured[..]) {
            return json!({ "event": "component_status", "component": name, "status": status }).to_string();
        }
        let values = |pairs: Vec<(String, String)>| -> Vec<Value> {
            pairs.into_iter().map(|(key, value)| json!({ "key": key, "value": value })).collect()
        };
        let components = components.into_iter().map(|(name, status)| (name, status.to_owned())).collect();
        json!({ "status": [
            { "message": "Component status", "values": values(components) },
            { "message": "QA status", "values": values(measured) },
        ] })
        .to_string()
    }

    fn line(&mut self) -> String {
        let beliefs = self.control.beliefs();
        let running = beliefs.running().map(|(action, _)| action);
        let (cancelling, choice) = (beliefs.cancelling(), self.random.u32(..10));
        match (running, choice) {
            (Some(action), 0) => json!({ "event": "action_started", "action": action }),
            (Some(action), 1) => json!({ "event": "action_progress", "action": action, "fraction": 0.5 }),
            (Some(action), 2) if cancelling => json!({ "event": "action_cancelled", "action": action }),
            (Some(action), 2 | 3) => json!({ "event": "action_succeeded", "action": action }),
            (Some(action), 4) if self.random.bool() => json!({ "event": "action_failed", "action": action }),
            (Some(action), 5) if self.random.bool() => {
                json!({ "event": "action_cancelled", "action": action })
            }
            (None, 0) => json!({ "event": "tick" }),
            _ => return self.burst(),
        }
        .to_string()
    }

    fn step(&mut self) {
        let line = self.line();
        let answers = feed(&mut self.control, &line);
        self.log.push(line);
        let context = || format!("{}: {:#?}\n{answers:#?}", self.place.name, self.log);
        assert!(
            !answers.iter().any(|answer| matches!(answer, Answer::Error { .. })),
            "refused: {}",
            context()
        );
        let (available, statuses) =
            fresh(self.place, &self.last_reports, &self.control, &mut self.random.clone());
        let beliefs = self.control.beliefs();
        assert_eq!(*beliefs.available(), available, "{}", context());
        assert_eq!(*beliefs.statuses(), statuses, "{}", context());
        if self.place.is_plain {
            for design in &self.place.designs {
                let is_sound = defects(self.place, &self.last_reports, &design.name) == (false, false);
                assert_eq!(available.contains(&design.name), is_sound, "{}: {}", design.name, context());
            }
            let mut expected = Statuses::new();
            for (function, design) in at_work(&self.control) {
                let (failed, broken) = defects(self.place, &self.last_reports, &design);
                let words = [(failed, "IN_ERROR_COMPONENT"), (broken, "IN_ERROR_NFR")];
                let words: Vec<String> =
                    words.iter().filter(|(is_so, _)| *is_so).map(|(_, word)| (*word).to_owned()).collect();
                if !words.is_empty() {
                    expected.insert(format!("o_{function}"), words);
                }
            }
            assert_eq!(statuses, expected, "{}", context());
        }
        let allowed = |design: &String| assert!(available.contains(design), "{design}: {}", context());
        let running = beliefs.running().map(|(_, step)| step.configuration.iter().map(|(_, design)| design));
        for effect in answers.iter().filter_map(Answer::effect) {
            match &effect.command {
                Command::Reconfigure { to, .. } => allowed(to),
                Command::Request { step } => {
                    step.configuration.iter().for_each(|(_, design)| allowed(design));
                }
                Command::Resume { .. } => running.clone().into_iter().flatten().for_each(allowed),
                _ => {}
            }
        }
        if !beliefs.cancelling() && !beliefs.suspended() {
            running.into_iter().flatten().for_each(allowed);
        }
        self.random.u64(..);
    }
}

/// Runs random lives of robots with shipped and generated missions; `lives` and `missions` are the numbers of
/// lives and of generated missions. Returns the number of lines.
fn check(lives: u64, missions: u64) -> usize {
    let mut places = shipped();
    places.extend(suave());
    places.extend((0..missions).map(generated));
    let mut lines = 0;
    for seed in 0..lives {
        let place = &places[seed as usize % places.len()];
        let mut life = Life::new(place, seed);
        for _ in 0..life.random.usize(4..=20) {
            life.step();
            lines += 1;
        }
    }
    lines
}

#[test]
fn damaged_designs_are_never_used() {
    check(120, 8);
}

#[test]
#[ignore = "takes a quarter of an hour; only a release build is of interest"]
fn damaged_designs_are_never_used_in_a_hundred_thousand_lives() {
    println!("{} lines in 100,000 lives", check(100_000, 500));
}

fn kinect(status: &str) -> String {
    json!({ "event": "component_status", "component": "c_kinect", "status": status }).to_string()
}

fn outcomes(answers: &[Answer]) -> Vec<String> {
    let word = |answer: &Answer| match answer {
        Answer::Error { code, .. } => Some(format!("error {code}")),
        Answer::Contradicted { contradictions } => Some(format!("{} contradictions", contradictions.len())),
        Answer::Effect(effect) => match &effect.command {
            Command::Reconfigure { to, .. } => Some(to.clone()),
            Command::Request { step } => Some(step.summary()),
            Command::Cancel { .. } => Some("cancel".to_owned()),
            Command::Suspend { .. } => Some("suspend".to_owned()),
            other => Some(format!("{other:?}")),
        },
        _ => None,
    };
    answers.iter().filter_map(word).collect()
}

#[test]
fn a_second_fault_during_a_cancellation_is_recorded() {
    let mut ugv = control("ugv");
    ugv.start();
    feed(&mut ugv, r#"{"event":"action_started","action":1}"#);
    feed(&mut ugv, r#"{"event":"action_succeeded","action":1}"#);
    assert_eq!(outcomes(&feed(&mut ugv, &kinect("FALSE"))), ["suspend", "cancel"]);
    let bright = r#"{"event":"measured","attribute":"ambient_light","value":0.95}"#;
    assert_eq!(outcomes(&feed(&mut ugv, bright)), [""; 0]);
    let both = vec!["IN_ERROR_COMPONENT".to_owned(), "IN_ERROR_NFR".to_owned()];
    assert_eq!(ugv.beliefs().statuses().get("o_f_localization"), Some(&both));
    let lidar = "move wp2 wp3 (f_localization = fd_amcl_lidar)";
    let answers = feed(&mut ugv, r#"{"event":"action_cancelled","action":2}"#);
    assert_eq!(outcomes(&answers), ["fd_amcl_lidar", lidar]);
    // The Kinect works again, but the designs with the Kinect remain unavailable because of the light.
    assert_eq!(outcomes(&feed(&mut ugv, &kinect("OK"))), [""; 0]);
    let dim = r#"{"event":"measured","attribute":"ambient_light","value":0.3}"#;
    assert_eq!(outcomes(&feed(&mut ugv, dim)), ["fd_amcl_kinect"]);
}

/// A rule infers a failure that contradicts the component's own report. Both statements are kept, the failure
/// takes precedence, and the contradiction is reported.
#[test]
fn an_inferred_failure_that_contradicts_a_report_is_recorded() {
    let place = (0..100).map(generated).find(|place| !place.depends.is_empty()).expect("a mission");
    let (dependent, failing) = place.depends[0].clone();
    let mut control = place.started.clone();
    let report = |control: &mut Loop, component: &str, status: &str| {
        let event = json!({ "event": "component_status", "component": component, "status": status });
        feed(control, &event.to_string())
    };
    report(&mut control, &dependent, "RECOVERED");
    let answers = report(&mut control, &failing, "FALSE");
    let contradicted = |answer: &Answer| match answer {
        Answer::Contradicted { contradictions } => Some(contradictions.clone()),
        _ => None,
    };
    let contradictions_found = answers.iter().find_map(contradicted).expect("it is said");
    assert!(
        contradictions_found
            .iter()
            .any(|contradiction| contradiction.facts.iter().any(|fact| fact.contains(&dependent))),
        "{contradictions_found:?}"
    );
    let knowledge = control.beliefs().mission().knowledge().expect("a knowledge base");
    let components = knowledge.view().components();
    let status =
        |name: &str| components.iter().find(|c| c.individual.name == name).and_then(|c| c.status.clone());
    assert_eq!(status(&failing).as_deref(), Some("FALSE"));
    for design in
        place.designs.iter().filter(|d| d.components.contains(&dependent) || d.components.contains(&failing))
    {
        assert!(!control.beliefs().available().contains(&design.name), "{}", design.name);
    }
    let answers = report(&mut control, &failing, "RECOVERED");
    assert_eq!(answers.iter().find_map(contradicted), Some(Vec::new()), "{answers:?}");
}
