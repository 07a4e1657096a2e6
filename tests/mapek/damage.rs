//! No observation is dropped, and nothing is done with what is damaged: bursts of faults, also while actions wait for
//! their cancellation or stand still.
//!
//! After each line, whatever came before it and in whatever order: (a) the designs that are available and the objectives
//! in error are those of fresh knowledge that is told the last word on each component and each attribute, in another
//! order, and those that the definition of the shipped rules gives; (b) no design is asked for, kept at work or
//! taken up again that fresh knowledge calls unavailable.
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

/// The last word on everything.
#[derive(Debug, Clone, Default)]
struct Told {
    components: BTreeMap<String, &'static str>,
    attributes: BTreeMap<String, String>,
}

type Statuses = BTreeMap<String, Vec<String>>;

/// Fresh knowledge that is told the last words in a random order; what is available, and what is in error.
fn fresh(place: &Place, told: &Told, control: &Loop, random: &mut Rng) -> (BTreeSet<String>, Statuses) {
    let mission = place.begun.beliefs().mission();
    let mut knowledge: Knowledge = mission.knowledge().expect("a knowledge base").clone();
    let mut words: Vec<(bool, &str, &str)> = Vec::new();
    words.extend(told.components.iter().map(|(name, status)| (true, name.as_str(), *status)));
    words.extend(told.attributes.iter().map(|(name, value)| (false, name.as_str(), value.as_str())));
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
        objectives.map(|own| (own.individual.name, own.statuses)).collect(),
    )
}

/// Which function has which design, as the loop has told its knowledge base.
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

/// What is wrong with a design by definition: a component that has failed, or that depends on one that has; a bound that
/// the last measurement breaks.
fn defects(place: &Place, told: &Told, design: &str) -> (bool, bool) {
    let mut failed: BTreeSet<&str> = told
        .components
        .iter()
        .filter(|(_, status)| **status == "FALSE")
        .map(|(name, _)| name.as_str())
        .collect();
    for _ in 0..place.depends.len() {
        let more = place.depends.iter().filter(|(_, other)| failed.contains(other.as_str()));
        failed.extend(more.map(|(own, _)| own.as_str()).collect::<Vec<_>>());
    }
    let design = place.designs.iter().find(|known| known.name == design).expect("a design");
    let exact = |text: &String| -> BigRational {
        let literal = rules::Literal::parse(text, Some("http://www.w3.org/2001/XMLSchema#decimal"), None);
        literal.as_rational().expect("a number")
    };
    let broken = design.bounds.iter().any(|(attribute, minimum, maximum)| {
        let Some(value) = told.attributes.get(attribute).map(exact) else { return false };
        minimum.as_ref().is_some_and(|least| value < *least)
            || maximum.as_ref().is_some_and(|most| value > *most)
    });
    (design.components.iter().any(|component| failed.contains(component.as_str())), broken)
}

/// One life of a robot.
struct Life<'a> {
    place: &'a Place,
    control: Loop,
    told: Told,
    random: Rng,
    log: Vec<String>,
}

impl<'a> Life<'a> {
    fn new(place: &'a Place, seed: u64) -> Self {
        let control = place.begun.clone();
        Self { place, control, told: Told::default(), random: Rng::with_seed(seed), log: Vec::new() }
    }

    /// Between one and five reports at one instant.
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
        // Of several values with one key the first counts.
        for (name, status) in components.iter().rev() {
            self.told.components.insert(name.clone(), status);
        }
        for (name, value) in measured.iter().rev() {
            self.told.attributes.insert(name.clone(), value.clone());
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
        let known = self.control.beliefs();
        let running = known.running().map(|(action, _)| action);
        let (cancelling, choice) = (known.cancelling(), self.random.u32(..10));
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
        let (available, statuses) = fresh(self.place, &self.told, &self.control, &mut self.random.clone());
        let known = self.control.beliefs();
        assert_eq!(*known.available(), available, "{}", context());
        assert_eq!(*known.statuses(), statuses, "{}", context());
        if self.place.is_plain {
            for design in &self.place.designs {
                let is_sound = defects(self.place, &self.told, &design.name) == (false, false);
                assert_eq!(available.contains(&design.name), is_sound, "{}: {}", design.name, context());
            }
            let mut expected = Statuses::new();
            for (function, design) in at_work(&self.control) {
                let (failed, broken) = defects(self.place, &self.told, &design);
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
        let running = known.running().map(|(_, step)| step.configuration.iter().map(|(_, design)| design));
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
        if !known.cancelling() && !known.suspended() {
            running.into_iter().flatten().for_each(allowed);
        }
        self.random.u64(..);
    }
}

/// So many lives, a dozen lines each, spread over all places; how many lines there were.
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
fn nothing_is_done_with_what_is_damaged() {
    check(120, 8);
}

#[test]
#[ignore = "takes a quarter of an hour; only a release build is of interest"]
fn nothing_is_done_with_what_is_damaged_in_a_hundred_thousand_lives() {
    println!("{} lines in 100,000 lives", check(100_000, 500));
}

fn kinect(status: &str) -> String {
    json!({ "event": "component_status", "component": "c_kinect", "status": status }).to_string()
}

/// The answers that are errors, and those that ask for something, in a few words.
fn said(answers: &[Answer]) -> Vec<String> {
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
fn a_second_fault_while_an_action_waits_for_its_cancellation_is_kept() {
    let mut ugv = control("ugv");
    ugv.start();
    feed(&mut ugv, r#"{"event":"action_started","action":1}"#);
    feed(&mut ugv, r#"{"event":"action_succeeded","action":1}"#);
    assert_eq!(said(&feed(&mut ugv, &kinect("FALSE"))), ["suspend", "cancel"]);
    let bright = r#"{"event":"measured","attribute":"ambient_light","value":0.95}"#;
    assert_eq!(said(&feed(&mut ugv, bright)), [""; 0]);
    let both = vec!["IN_ERROR_COMPONENT".to_owned(), "IN_ERROR_NFR".to_owned()];
    assert_eq!(ugv.beliefs().statuses().get("o_f_localization"), Some(&both));
    let lidar = "move wp2 wp3 (f_localization = fd_amcl_lidar)";
    let answers = feed(&mut ugv, r#"{"event":"action_cancelled","action":2}"#);
    assert_eq!(said(&answers), ["fd_amcl_lidar", lidar]);
    // The Kinect works again, but the light still forbids it.
    assert_eq!(said(&feed(&mut ugv, &kinect("OK"))), [""; 0]);
    let dim = r#"{"event":"measured","attribute":"ambient_light","value":0.3}"#;
    assert_eq!(said(&feed(&mut ugv, dim)), ["fd_amcl_kinect"]);
}

/// What a rule concludes of a component contradicts what it says itself: both stay, the worse counts, and it is said.
#[test]
fn a_failure_that_contradicts_what_rules_conclude_is_kept() {
    let place = (0..100).map(generated).find(|place| !place.depends.is_empty()).expect("a mission");
    let (own, other) = place.depends[0].clone();
    let mut control = place.begun.clone();
    let report = |control: &mut Loop, component: &str, status: &str| {
        let event = json!({ "event": "component_status", "component": component, "status": status });
        feed(control, &event.to_string())
    };
    report(&mut control, &own, "RECOVERED");
    let answers = report(&mut control, &other, "FALSE");
    let contradicted = |answer: &Answer| match answer {
        Answer::Contradicted { contradictions } => Some(contradictions.clone()),
        _ => None,
    };
    let found = answers.iter().find_map(contradicted).expect("it is said");
    assert!(found.iter().any(|one| one.facts.iter().any(|fact| fact.contains(&own))), "{found:?}");
    let knowledge = control.beliefs().mission().knowledge().expect("a knowledge base");
    let components = knowledge.view().components();
    let status =
        |name: &str| components.iter().find(|c| c.individual.name == name).and_then(|c| c.status.clone());
    assert_eq!(status(&other).as_deref(), Some("FALSE"));
    for design in
        place.designs.iter().filter(|d| d.components.contains(&own) || d.components.contains(&other))
    {
        assert!(!control.beliefs().available().contains(&design.name), "{}", design.name);
    }
    let answers = report(&mut control, &other, "RECOVERED");
    assert_eq!(answers.iter().find_map(contradicted), Some(Vec::new()), "{answers:?}");
}
