//! Delivers random valid and invalid events to a loop and checks invariants after each event.

use std::collections::BTreeSet;
use std::time::Duration;

use metaplan::mapek::{Answer, Baseline, Loop, Observation, PlannedStep};
use rules::{Engine, Fact};
use serde_json::{Value, json};

use crate::common::{control, feed};

/// Reports that the robot of a mission can send.
pub struct World {
    pub mission: &'static str,
    components: &'static [&'static str],
    /// Measured attributes: name, minimum, and maximum.
    measured: &'static [(&'static str, f64, f64)],
    /// Facts and functions that can change: name and possible values.
    facts: &'static [(&'static str, &'static [&'static str])],
    goals: &'static [&'static str],
}

pub const WORLDS: [World; 2] = [
    World {
        mission: "ugv",
        components: &["c_kinect", "c_lidar", "c_camera", "c_flashlight"],
        measured: &[("ambient_light", 0.0, 1.2), ("battery", 0.0, 100.0)],
        facts: &[
            ("robot_at", &["wp1", "wp2", "wp3", "wp4", "wp5", "wp6", "wp7", "wp8", "wp9"]),
            ("battery", &["100", "30", "12.5", "3"]),
            ("travel_time wp2 wp3", &["1", "3"]),
            ("corridor wp5 wp8", &["true", "false"]),
        ],
        goals: &["(robot_at wp9)", "(robot_at wp7)", "(robot_at wp1)", "(and (robot_at wp3))"],
    },
    World {
        mission: "uuv",
        components: &["c_thruster_1", "c_thruster_3", "c_camera", "c_sonar", "c_charging_port"],
        measured: &[("water_visibility", 0.0, 5.0), ("battery", 0.0, 100.0)],
        facts: &[
            ("battery", &["100", "70", "25", "15", "5"]),
            ("pipeline_found pl1", &["true", "false"]),
            ("pipeline_inspected pl1", &["true", "false"]),
            ("search_area pl1", &["3", "2"]),
        ],
        goals: &["(pipeline_inspected pl1)", "(pipeline_found pl1)", "(>= (battery) 60)"],
    },
];

const INVALID: [&str; 14] = [
    "",
    "no JSON",
    "[]",
    "{}",
    r#"{"event":"unheard_of"}"#,
    r#"{"event":"measured","attribute":"ambient_light"}"#,
    r#"{"event":"measured","attribute":"nothing","value":1}"#,
    r#"{"event":"measured","attribute":"battery","value":"NaN"}"#,
    r#"{"event":"component_status","component":"c_none","status":"FALSE"}"#,
    r#"{"event":"component_status","component":"c_kinect","status":"perhaps"}"#,
    r#"{"event":"action_succeeded","action":999999999}"#,
    r#"{"event":"goal_changed","goal":"(robot_at nowhere)"}"#,
    r#"{"event":"fact_changed","name":"robot_at","value":"nowhere"}"#,
    r#"{"event":"tick","extra":1}"#,
];

pub struct Fuzz {
    pub world: &'static World,
    pub random: fastrand::Rng,
    /// The knowledge base is compared with a recomputed one after each `compare_every` events.
    pub compare_every: usize,
    pristine: Loop,
}

fn pick<'a, T>(random: &mut fastrand::Rng, choices: &'a [T]) -> &'a T {
    &choices[random.usize(..choices.len())]
}

impl Fuzz {
    pub fn new(world: &'static World, seed: u64) -> Self {
        let random = fastrand::Rng::with_seed(seed);
        Self { world, random, compare_every: 10, pristine: control(world.mission) }
    }

    pub fn begin(&self) -> Loop {
        let mut control = self.pristine.clone();
        control.start();
        control
    }

    /// Generates a line, with `true` if the line is valid.
    pub fn next(&mut self, control: &Loop) -> (String, bool) {
        let random = &mut self.random;
        if random.u32(..10) == 0 {
            return ((*pick(random, &INVALID)).to_owned(), false);
        }
        let running = control.beliefs().running().map(|(action, _)| action);
        let event = match random.u32(..20) {
            0..=2 => {
                let status = *pick(random, &["FALSE", "RECOVERED", "TRUE", "ERROR", "OK"]);
                json!({ "event": "component_status", "component": pick(random, self.world.components), "status": status })
            }
            4..=7 => {
                let (name, low, high) = *pick(random, self.world.measured);
                json!({ "event": "measured", "attribute": name, "value": low + random.f64() * (high - low) })
            }
            8 => {
                let (name, values) = *pick(random, self.world.facts);
                json!({ "event": "fact_changed", "name": name, "value": pick(random, values) })
            }
            9 if random.u32(..4) == 0 || control.beliefs().reached() => {
                json!({ "event": "goal_changed", "goal": pick(random, self.world.goals) })
            }
            3 | 9 => self.burst(),
            10 => json!({ "event": "tick" }),
            kind => match (running, kind) {
                (Some(action), 11..=12) => {
                    json!({ "event": "action_progress", "action": action, "fraction": random.f64() })
                }
                (Some(action), 13) => json!({ "event": "action_failed", "action": action }),
                (Some(action), 14..=15) => json!({ "event": "action_cancelled", "action": action }),
                (Some(action), 16) => json!({ "event": "action_started", "action": action }),
                (Some(action), _) => json!({ "event": "action_succeeded", "action": action }),
                (None, _) => json!({ "event": "tick" }),
            },
        };
        (event.to_string(), true)
    }

    fn burst(&mut self) -> Value {
        let (random, world) = (&mut self.random, self.world);
        let (mut components, mut measured) = (Vec::new(), Vec::new());
        for _ in 0..random.usize(2..=5) {
            if random.u32(..3) == 0 {
                let (name, low, high) = *pick(random, world.measured);
                let value = low + random.f64() * (high - low);
                measured.push(json!({ "key": name, "value": value.to_string() }));
            } else {
                let status = *pick(random, &["FALSE", "FALSE", "RECOVERED", "TRUE"]);
                components.push(json!({ "key": pick(random, world.components), "value": status }));
            }
        }
        json!({ "status": [
            { "message": "Component status", "values": components },
            { "message": "QA status", "values": measured },
        ] })
    }
}

pub fn run(world: &'static World, seed: u64, count: usize) -> Loop {
    let mut fuzz = Fuzz::new(world, seed);
    let mut loop_ = fuzz.begin();
    for number in 0..count {
        step(&mut loop_, &mut fuzz, number);
    }
    loop_
}

pub fn step(control: &mut Loop, fuzz: &mut Fuzz, number: usize) -> Vec<Answer> {
    let (line, valid) = fuzz.next(control);
    let before = (!valid).then(|| without_counters(control));
    let answers = feed(control, &line);
    // Computed plans accumulate until they are taken by a call of `decision`.
    let _ = control.decision(&answers);
    let context = || format!("line {number} of {}: {line}\n{answers:#?}", fuzz.world.mission);
    if let Some(before) = before {
        assert!(answers.iter().all(|answer| matches!(answer, Answer::Error { .. })), "{}", context());
        assert_eq!(answers.len(), 1, "{}", context());
        assert_eq!(without_counters(control), before, "{}", context());
    }
    invariants(control, &context);
    if number.is_multiple_of(fuzz.compare_every) {
        incremental_is_from_scratch(control, &context);
    }
    if number.is_multiple_of(200) {
        restored_is_equal(control, fuzz.pristine.clone(), &context);
    }
    answers
}

fn without_counters(control: &Loop) -> Value {
    let mut snapshot = control.snapshot().0;
    for counter in ["lines", "now"] {
        snapshot.as_object_mut().expect("an object").remove(counter);
    }
    snapshot
}

fn invariants(control: &Loop, context: &dyn Fn() -> String) {
    let beliefs = control.beliefs();
    let mission = beliefs.mission();
    let base = mission.knowledge().expect("a knowledge base");
    let designs = base.view().function_designs();
    let available: BTreeSet<String> =
        designs.into_iter().filter(|design| design.available).map(|design| design.individual.name).collect();
    assert_eq!(*beliefs.available(), available, "{}", context());
    assert!(base.contradictions().is_empty(), "{}", context());
    assert!(beliefs.outstanding().count() < 32, "{}", context());
    let cancelling = beliefs.cancelling();
    let Some(plan) = beliefs.plan() else { return };
    assert!(!beliefs.suspended(), "a plan beside a suspended action: {}", context());
    assert!(!cancelling, "a plan beside an action to be cancelled: {}", context());
    let running = beliefs.running().map(|(_, step)| step);
    let steps: Vec<&PlannedStep> = running.into_iter().chain(plan).collect();
    for step in &steps {
        for (_, design) in &step.configuration {
            assert!(available.contains(design), "{design} is not available: {}", context());
        }
    }
    assert_eq!(control.beliefs().violation(), None, "{}", context());
}

fn incremental_is_from_scratch(control: &Loop, context: &dyn Fn() -> String) {
    let engine = control.beliefs().mission().knowledge().expect("a knowledge base").engine();
    let stated: Vec<Fact> = engine.facts().filter(|fact| engine.is_asserted(fact)).collect();
    let scratch =
        Engine::new(engine.symbols().clone(), engine.program().clone(), stated).expect("it comes to an end");
    let texts = |engine: &Engine| -> BTreeSet<String> {
        engine.facts().map(|fact| fact.display(engine.symbols()).to_string()).collect()
    };
    assert_eq!(texts(engine), texts(&scratch), "{}", context());
}

fn restored_is_equal(loop_: &Loop, mut restored: Loop, context: &dyn Fn() -> String) {
    restored.restore(&loop_.snapshot()).expect("the snapshot fits");
    assert_eq!(restored.snapshot(), loop_.snapshot(), "{}", context());
    let facts = |loop_: &Loop| {
        let engine = loop_.beliefs().mission().knowledge().expect("a knowledge base").engine();
        let facts: BTreeSet<String> =
            engine.facts().map(|fact| fact.display(engine.symbols()).to_string()).collect();
        facts
    };
    assert_eq!(facts(&restored), facts(loop_), "{}", context());
}

#[test]
fn random_events_leave_the_loop_sound() {
    for world in &WORLDS {
        for seed in 0..3 {
            run(world, seed, 300);
        }
    }
}

#[test]
fn a_restored_loop_completes_a_pending_deliberation() {
    for world in &WORLDS {
        for seed in 20..23 {
            let mut fuzz = Fuzz::new(world, seed);
            let mut control = fuzz.pristine.clone();
            let mut answered = 0;
            for number in 0..100 {
                for _ in 0..fuzz.random.usize(..3) {
                    let (line, _) = fuzz.next(&control);
                    control.react(&Observation::parse(&line), Duration::ZERO);
                }
                let mut restored = fuzz.pristine.clone();
                restored.restore(&control.snapshot()).expect("the snapshot fits");
                let (again, answers) = (restored.deliberate(), control.deliberate());
                answered += answers.len();
                let (again, decision) = (restored.decision(&again), control.decision(&answers));
                assert!(again.agrees(&decision.answers), "{} seed {seed}, round {number}", world.mission);
                assert_eq!(
                    restored.snapshot(),
                    control.snapshot(),
                    "{} seed {seed}, round {number}",
                    world.mission
                );
            }
            assert!(answered > 20, "{} seed {seed}: {answered} answers", world.mission);
        }
    }
}

#[test]
fn a_difference_from_the_baseline_gives_the_snapshot() {
    for world in &WORLDS {
        for seed in 10..13 {
            let mut fuzz = Fuzz::new(world, seed);
            let baseline = Baseline::new(&fuzz.pristine);
            let pristine = fuzz.pristine.snapshot();
            assert_eq!(baseline.difference(&fuzz.pristine), json!({}));
            let mut control = fuzz.begin();
            let mut has_other_facts = false;
            for number in 1..=150 {
                let (line, _) = fuzz.next(&control);
                let answers = feed(&mut control, &line);
                let _ = control.decision(&answers);
                // A restored loop has facts without positions in a file, which must not be differences.
                if number % 20 == 0 {
                    let snapshot = control.snapshot();
                    control = fuzz.pristine.clone();
                    control.restore(&snapshot).expect("the snapshot fits");
                }
                let (difference, snapshot) = (baseline.difference(&control), control.snapshot());
                let context = || format!("{} seed {seed}, line {number}: {line}", world.mission);
                for (name, value) in snapshot.0.as_object().expect("an object") {
                    let differs = pristine.0.get(name) != Some(value);
                    assert_eq!(difference.get(name).is_some(), differs, "{name}: {}", context());
                }
                has_other_facts |= difference.get("init").is_some();
                assert_eq!(baseline.snapshot(difference), snapshot, "{}", context());
            }
            assert!(has_other_facts, "{} seed {seed}", world.mission);
        }
    }
}
