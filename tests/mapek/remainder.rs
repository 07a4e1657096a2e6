//! Tests of the remainder of the action under way: with random small actions, the remainder in the domain of
//! [`Outlook`](metaplan::mapek::Outlook) has the effects that the loop assumes after the success of the action.
//! Further tests: actions whose remainder depends on their own changes, and plans after reports about such actions.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use fastrand::Rng;
use metaplan::mapek::{Answer, Loop, PlannedStep};
use metaplan::setup::Setup;
use pddl::ast::{Atom, InitialElement, Name, Term};
use pddl::validate::{PlanStep, advance};

use crate::common::{control, feed, kinds, own, plain};

/// Facts with an empty text, and values with their number, by atom.
fn state(init: &[InitialElement]) -> BTreeMap<String, String> {
    let text = |atom: &Atom| {
        let words: Vec<String> = atom.arguments.iter().map(|term| Term::name(term).to_string()).collect();
        format!("{} {}", atom.predicate.name, words.join(" "))
    };
    let entry = |element: &InitialElement| match element {
        InitialElement::Fact(atom) => Some((text(atom), String::new())),
        InitialElement::Value(atom, value, _) => Some((text(atom), value.to_string())),
        _ => None,
    };
    let mut state: BTreeMap<String, String> = init.iter().filter_map(entry).collect();
    state.retain(|name, _| !name.starts_with("metaplan_"));
    state
}

fn pick<'a>(random: &mut Rng, choices: &[&'a str]) -> &'a str {
    choices[random.usize(..choices.len())]
}

fn condition(random: &mut Rng) -> String {
    if random.bool() {
        return pick(random, &["(p)", "(q)", "(not (q))"]).to_owned();
    }
    let value = pick(random, &["(x)", "(y)", "(level ?k)", "(level ?m)"]);
    format!("({} {value} {})", pick(random, &[">=", "<="]), random.u32(1..12))
}

fn effect(random: &mut Rng, is_durative: bool) -> String {
    let is_quantified = random.u32(..4) == 0;
    let target = if is_quantified {
        "(level ?t)"
    } else {
        pick(random, &["(x)", "(y)", "(z)", "(level ?k)", "(level ?m)"])
    };
    let mut amounts = vec!["1", "4", "(x)", "(y)", "(level ?k)", "(- 10 (x))", "(+ (y) (level ?m))"];
    amounts.extend(is_durative.then_some("?duration"));
    amounts.extend(is_quantified.then_some("(level ?t)"));
    let kind = pick(random, &["increase", "decrease", "increase", "decrease", "assign", "scale-up"]);
    let mut effect = format!("({kind} {target} {})", pick(random, &amounts));
    if random.u32(..6) == 0 {
        "(q)".clone_into(&mut effect);
    }
    if random.u32(..3) == 0 {
        effect = format!("(when {} {effect})", condition(random));
    }
    if is_quantified { format!("(forall (?t - tank) {effect})") } else { effect }
}

/// Returns a domain with a random action `go`, and a problem that `go` alone solves if it is executable.
fn random_action(random: &mut Rng) -> (String, String) {
    let is_durative = random.u32(..4) > 0;
    let count = random.usize(1..5);
    let mut conditions = String::from("(chosen ?k ?m)");
    let mut effects = String::from("(done)");
    if is_durative {
        (conditions, effects) = ("(at start (chosen ?k ?m))".to_owned(), "(at end (done))".to_owned());
    }
    for _ in 0..random.usize(..3) {
        let condition = condition(random);
        let time = pick(random, &["at start", "over all", "at end"]);
        let _ = if is_durative {
            write!(conditions, " ({time} {condition})")
        } else {
            write!(conditions, " {condition}")
        };
    }
    for _ in 0..count {
        let effect = effect(random, is_durative);
        let time = pick(random, &["at start", "at end", "at end"]);
        // The time of a quantified effect is inside the quantifier.
        let _ = match effect.strip_prefix("(forall (?t - tank) ").and_then(|body| body.strip_suffix(')')) {
            _ if !is_durative => write!(effects, " {effect}"),
            Some(body) => write!(effects, " (forall (?t - tank) {})", timed(time, body)),
            None => write!(effects, " {}", timed(time, &effect)),
        };
    }
    let head = "(define (domain d) (:requirements :typing :fluents :durative-actions :conditional-effects \
                :negative-preconditions) (:types tank) (:constants t1 t2 - tank)
      (:predicates (p) (q) (done) (chosen ?k ?m - tank)) (:functions (x) (y) (z) (pace) (level ?t - tank))";
    let action = if is_durative {
        let duration = pick(random, &["4", "(pace)", "(* 2 (pace))"]);
        format!(
            "(:durative-action go :parameters (?k ?m - tank) :duration (= ?duration {duration})
              :condition (and {conditions}) :effect (and {effects}))"
        )
    } else {
        format!(
            "(:action go :parameters (?k ?m - tank) :precondition (and {conditions})
              :effect (and {effects}))"
        )
    };
    let mut number = || random.u32(1..9);
    let values = [number(), number(), number(), number(), number()];
    let chosen = pick(random, &["t1 t1", "t1 t2", "t2 t1"]);
    let fact = pick(random, &["", "(p)", "(q)"]);
    let [x, y, z, first, second] = values;
    let problem = format!(
        "(define (problem p) (:domain d) (:init (chosen {chosen}) {fact} (= (x) {x}) (= (y) {y}) (= (z) {z}) (= (pace) 3)
          (= (level t1) {first}) (= (level t2) {second})) (:goal (done)))"
    );
    (format!("{head} {action})"), problem)
}

/// Adds the time to an effect without quantifier. In a conditional effect, the condition has this time, too.
fn timed(time: &str, effect: &str) -> String {
    let Some(rest) = effect.strip_prefix("(when ").and_then(|rest| rest.strip_suffix(')')) else {
        return format!("({time} {effect})");
    };
    let mut depth = 0;
    let end = rest
        .bytes()
        .position(|byte| {
            depth += i32::from(byte == b'(') - i32::from(byte == b')');
            depth == 0
        })
        .expect("a condition");
    format!("(when ({time} {}) ({time} {}))", &rest[..=end], rest[end + 1..].trim())
}

/// Compares the remainder of the action under way with the loop's state after the success of the action. Returns
/// `false` if the remainder is not executable.
fn compare(control: &Loop, context: &str) -> bool {
    let outlook = control.beliefs().outlook().expect("a plan");
    let step = &outlook.steps[0];
    let step = PlanStep {
        action: Name::new(&step.action),
        arguments: step.arguments.iter().map(|argument| Name::new(argument)).collect(),
        start: None,
        duration: None,
        line: 0,
    };
    let Ok(change) = advance(&outlook.domain, &outlook.problem, &step, false) else { return false };
    let mut init = outlook.problem.init.clone();
    change.apply(&mut init);
    let mut control = control.clone();
    feed(&mut control, r#"{"event":"action_succeeded","action":1}"#);
    assert_eq!(state(&init), state(&control.beliefs().mission().problem().init), "{context}");
    true
}

fn check_random(seed: u64) -> [usize; 3] {
    let mut random = Rng::with_seed(seed);
    let (domain, problem) = random_action(&mut random);
    let mut control = plain(&domain, &problem);
    if !kinds(&control.start()).contains(&"request_action".to_owned()) {
        return [0; 3];
    }
    let mut compared = [1, 0, 0];
    for (progress, changed) in [("0", false), ("0.3", false), ("0.3", true), ("0.5", true), ("1", true)] {
        let context = format!("seed {seed}, progress {progress}, changed {changed}\n{domain}\n{problem}");
        feed(&mut control, &format!(r#"{{"event":"action_progress","action":1,"fraction":{progress}}}"#));
        if changed {
            let (name, value) = (pick(&mut random, &["x", "y", "level t1"]), random.u32(1..9));
            feed(&mut control, &format!(r#"{{"event":"fact_changed","name":"{name}","value":{value}}}"#));
        }
        // A changed situation can violate the conditions of the action, which is then suspended or cancelled.
        if control.beliefs().plan().is_none() {
            assert!(changed, "{context}");
            break;
        }
        let is_executable = compare(&control, &context);
        assert!(changed || is_executable, "the remainder is not executable: {context}");
        compared[if changed { 2 } else { 1 }] += usize::from(is_executable);
    }
    compared
}

#[test]
fn the_remainder_has_the_effects_of_a_success() {
    let mut sums = [0; 3];
    for seed in 0..250 {
        let compared = check_random(seed);
        for (sum, count) in sums.iter_mut().zip(compared) {
            *sum += count;
        }
    }
    // Many random actions are not executable, or interfere with themselves.
    assert!(sums[0] > 40 && sums[1] > 80 && sums[2] > 40, "{sums:?}");
}

/// Runs the loop for a domain with `header`, a durative action of 10 time units with `action`, and an action that
/// reaches the goal. The first action has done half of its changes when an unrelated value changes. Asserts that the
/// plan is kept.
fn check_half(header: &str, action: &str, last: &str, init: &str) {
    let domain = format!(
        "(define (domain d) (:requirements :typing :fluents :durative-actions :conditional-effects)
          (:types tank) (:constants t1 t2 - tank) {header}
          (:durative-action first {action})
          (:durative-action last :parameters () :duration (= ?duration 5) :condition (at start {last})
            :effect (at end (home))))"
    );
    let problem = format!(
        "(define (problem p) (:domain d) (:init (= (wind) 0) {init}) (:goal (home)) (:metric minimize (total-time)))"
    );
    let mut control = own(&domain, &problem, "[adaptation]\nsettle = 0");
    control.start();
    feed(&mut control, r#"{"event":"action_progress","action":1,"fraction":0.5}"#);
    let answers = feed(&mut control, r#"{"event":"fact_changed","name":"wind","value":1}"#);
    assert_eq!(kinds(&answers), ["plan_requested", "plan_kept"], "{action}: {answers:?}");
    let because = "it is still the best".to_owned();
    assert!(answers.contains(&Answer::PlanKept { because }), "{action}: {answers:?}");
    let answers = feed(&mut control, r#"{"event":"action_succeeded","action":1}"#);
    assert_eq!(kinds(&answers), ["request_action"], "{action}: {answers:?}");
    let answers = feed(&mut control, r#"{"event":"action_succeeded","action":2}"#);
    assert_eq!(kinds(&answers), ["goal_reached"], "{action}: {answers:?}");
}

#[test]
fn an_action_reads_values_without_its_own_changes() {
    check_half(
        "(:predicates (home)) (:functions (battery) (wind))",
        ":parameters () :duration (= ?duration 10) :condition (at start (<= (battery) 50))
         :effect (at end (increase (battery) (- 100 (battery))))",
        "(>= (battery) 95)",
        "(= (battery) 20)",
    );
    check_half(
        "(:predicates (home)) (:functions (cargo) (delivered) (wind))",
        ":parameters () :duration (= ?duration 10) :condition (at start (>= (cargo) 1))
         :effect (and (at end (increase (delivered) (cargo))) (at end (decrease (cargo) (cargo))))",
        "(>= (delivered) 8)",
        "(= (cargo) 8) (= (delivered) 0)",
    );
    let tanks = "(:predicates (home) (there) (main ?t - tank)) (:functions (level ?t - tank) (wind))";
    check_half(
        tanks,
        ":parameters (?k - tank) :duration (= ?duration 10) :condition (at start (>= (level ?k) 4))
         :effect (and (at end (there)) (forall (?t - tank) (at end (decrease (level ?t) 4))))",
        "(there)",
        "(= (level t1) 4) (= (level t2) 3)",
    );
    check_half(
        tanks,
        ":parameters (?k ?m - tank) :duration (= ?duration 10)
         :condition (and (at start (>= (level ?k) 4)) (at start (main ?m)))
         :effect (and (at end (there)) (at end (decrease (level ?m) 4)))",
        "(there)",
        "(main t1) (= (level t1) 4) (= (level t2) 3)",
    );
    check_half(
        "(:predicates (home) (there) (sunny)) (:functions (battery) (wind))",
        ":parameters () :duration (= ?duration 10) :condition (at start (<= (battery) 10))
         :effect (and (at end (there)) (when (at end (sunny)) (at end (decrease (battery) 4))))",
        "(there)",
        "(= (battery) 10)",
    );
    // Changes at the start are part of the values at the end.
    check_half(
        "(:predicates (home) (there)) (:functions (battery) (wind))",
        ":parameters () :duration (= ?duration 10)
         :condition (and (at start (<= (battery) 90)) (over all (>= (battery) 92)) (at end (<= (battery) 92)))
         :effect (and (at end (there)) (at start (increase (battery) 2)) (at end (increase (battery) ?duration)))",
        "(>= (battery) 102)",
        "(= (battery) 90)",
    );
}

#[test]
fn messages_do_not_contain_internal_functions() {
    let domain = "(define (domain d) (:requirements :fluents) (:predicates (done)) (:functions (battery))
      (:action go :parameters () :precondition (>= (battery) 10)
        :effect (and (decrease (battery) 10) (done))))";
    let problem = "(define (problem p) (:domain d) (:init (= (battery) 12)) (:goal (done)))";
    let mut control = own(domain, problem, "");
    control.start();
    feed(&mut control, r#"{"event":"action_progress","action":1,"fraction":0.5}"#);
    let answers = feed(&mut control, r#"{"event":"fact_changed","name":"battery","value":4}"#);
    assert!(kinds(&answers).contains(&"plan_none".to_owned()), "{answers:?}");
    assert!(!format!("{answers:?}").contains("metaplan_"), "{answers:?}");
}

#[test]
fn a_success_without_plan_is_a_reason_to_plan() {
    let domain =
        "(define (domain d) (:requirements :fluents) (:predicates (there) (home)) (:functions (battery))
      (:action drive :parameters () :precondition () :effect (and (there) (decrease (battery) 4)))
      (:action return :parameters () :precondition (and (there) (>= (battery) 5)) :effect (home)))";
    let problem = "(define (problem p) (:domain d) (:init (= (battery) 10)) (:goal (home)))";
    let mut control = own(domain, problem, "");
    control.start();
    let answers = feed(&mut control, r#"{"event":"fact_changed","name":"battery","value":3}"#);
    assert!(kinds(&answers).contains(&"plan_none".to_owned()), "{answers:?}");
    let answers = feed(&mut control, r#"{"event":"action_succeeded","action":1}"#);
    assert_eq!(kinds(&answers), ["plan_requested", "plan_none"], "{answers:?}");
}

#[test]
fn an_action_of_duration_zero_is_not_interrupted() {
    let domain = "(define (domain d) (:requirements :fluents :durative-actions)
      (:predicates (ready) (a) (b)) (:functions (t1) (fuel))
      (:durative-action beep :parameters () :duration (= ?duration (t1)) :condition (at start (ready))
        :effect (and (at end (a)) (at end (decrease (fuel) 1))))
      (:durative-action go :parameters () :duration (= ?duration 5) :condition (at start (a)) :effect (at end (b))))";
    let problem = "(define (problem p) (:domain d) (:init (ready) (= (t1) 0) (= (fuel) 3)) (:goal (b))
      (:metric minimize (total-time)))";
    let mut control = own(domain, problem, "[adaptation]\nsettle = 0");
    control.start();
    feed(&mut control, r#"{"event":"action_started","action":1}"#);
    let answers = feed(&mut control, r#"{"event":"fact_changed","name":"fuel","value":7}"#);
    assert_eq!(kinds(&answers), ["plan_requested", "plan_kept"], "{answers:?}");
    feed(&mut control, r#"{"event":"action_progress","action":1,"fraction":0.5}"#);
    let answers = feed(&mut control, r#"{"event":"fact_changed","name":"fuel","value":5}"#);
    assert_eq!(kinds(&answers), ["plan_requested", "plan_kept"], "{answers:?}");
    let answers = feed(&mut control, r#"{"event":"action_succeeded","action":1}"#);
    assert_eq!(kinds(&answers), ["request_action"], "{answers:?}");
}

/// The rest of an action is judged by the designs that it will have, whichever designs made the progress.
#[test]
fn a_design_that_changes_during_an_action_can_continue_it() {
    let mut ugv = control("ugv");
    ugv.start();
    for line in [
        r#"{"event":"goal_changed","goal":"(robot_at wp2)"}"#,
        r#"{"event":"fact_changed","name":"battery","value":3.5}"#,
        r#"{"event":"action_started","action":1}"#,
        r#"{"event":"action_progress","action":1,"fraction":0.5}"#,
    ] {
        feed(&mut ugv, line);
    }
    let answers = feed(&mut ugv, r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#);
    let kinds = kinds(&answers);
    assert!(kinds.contains(&"reconfigure".to_owned()), "{answers:?}");
    assert!(!kinds.contains(&"suspend_action".to_owned()), "{answers:?}");
    assert!(!kinds.contains(&"cancel_action".to_owned()), "{answers:?}");
    assert_eq!(ugv.beliefs().violation(), None, "{answers:?}");
}

/// Start and end of a movement.
fn places(step: &PlannedStep) -> [String; 2] {
    let places: Vec<String> =
        step.arguments.iter().filter(|argument| argument.starts_with("wp")).cloned().collect();
    places.try_into().expect("two places")
}

/// A localisation can report the effects of an action before the action has succeeded.
#[test]
fn a_report_of_the_effects_does_not_interrupt_the_action() {
    let mut ugv = control("ugv");
    ugv.start();
    feed(&mut ugv, r#"{"event":"action_started","action":1}"#);
    let [_, to] = places(ugv.beliefs().running().expect("an action").1);
    let answers = feed(&mut ugv, &format!(r#"{{"event":"fact_changed","name":"robot_at","value":"{to}"}}"#));
    let expected = ["plan_requested", "plan_kept"];
    assert!(kinds(&answers).iter().all(|kind| expected.contains(&kind.as_str())), "{answers:?}");
    let answers = feed(&mut ugv, r#"{"event":"action_succeeded","action":1}"#);
    assert!(kinds(&answers).contains(&"request_action".to_owned()), "{answers:?}");
    // Another place is no effect of the action.
    let answers = feed(&mut ugv, r#"{"event":"action_started","action":2}"#);
    assert_eq!(answers, Vec::new());
    let answers = feed(&mut ugv, r#"{"event":"fact_changed","name":"robot_at","value":"wp9"}"#);
    assert_ne!(kinds(&answers), Vec::<String>::new());
}

#[test]
fn a_requested_action_has_its_present_duration_and_cost() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
    // At the time of the tick, a new plan is made, and the current one is kept.
    for (events, kept) in [
        (&[r#"{"event":"action_succeeded","action":1,"time":3}"#][..], 0),
        (&[r#"{"event":"tick","time":8}"#, r#"{"event":"action_succeeded","action":1,"time":60}"#], 1),
    ] {
        let Setup { mission, settings, .. } = Setup::read(&manifest).expect("the mission is read");
        let mut ugv = Loop::new(mission, settings).expect("a loop");
        ugv.start();
        feed(&mut ugv, r#"{"event":"action_started","action":1,"time":1}"#);
        feed(&mut ugv, r#"{"event":"fact_changed","name":"travel_time wp2 wp5","value":1.5,"time":2}"#);
        let answers: Vec<Answer> = events.iter().flat_map(|event| feed(&mut ugv, event)).collect();
        let count = kinds(&answers).iter().filter(|kind| *kind == "plan_kept").count();
        assert_eq!(count, kept, "{answers:?}");
        let request = answers.iter().map(Answer::to_json).find(|answer| answer["answer"] == "request_action");
        let request = request.expect("a request");
        let values = [&request["duration"], &request["cost"]].map(ToString::to_string);
        assert_eq!(values, ["1.5", "152"], "{request}");
    }
}

#[test]
fn failures_of_one_action_count_despite_another_cost() {
    let mut ugv = control("ugv");
    ugv.start();
    let mut answers = Vec::new();
    for action in 1..=3 {
        let step = ugv.beliefs().running().expect("an action").1.clone();
        let [from, to] = places(&step);
        let value = format!("1.{action}");
        let changed =
            format!(r#"{{"event":"fact_changed","name":"travel_time {from} {to}","value":{value}}}"#);
        assert!(!kinds(&feed(&mut ugv, &changed)).contains(&"error".to_owned()));
        assert_eq!(ugv.beliefs().running().expect("an action").1.summary(), step.summary());
        answers = feed(&mut ugv, &format!(r#"{{"event":"action_failed","action":{action}}}"#));
    }
    let is_failed = |answer: &Answer| matches!(answer, Answer::PlanNone { status: "failed", .. });
    assert!(answers.iter().any(is_failed), "{answers:?}");
}
