//! Tests of changes between two decisions: exact values after progress, plans of another thread after progress,
//! designs that only conditions read, reports that arrive together with a failure, facts that rules infer, and effects
//! of actions on the knowledge base.

use std::time::Duration;

use metaplan::mapek::{Answer, Loop, Observation};
use metaplan::setup::Setup;
use num_rational::BigRational;
use pddl::ast::{InitialElement, Name};

use crate::common::{control, crossroads, feed, kinds, own, plain};

fn react(control: &mut Loop, line: &str) -> Vec<Answer> {
    let now = control.beliefs().now() + Duration::from_millis(100);
    control.react(&Observation::parse(line), now)
}

fn progress(action: u64, fraction: &str) -> String {
    format!(r#"{{"event":"action_progress","action":{action},"fraction":{fraction}}}"#)
}

fn fact(name: &str, value: &str) -> String {
    format!(r#"{{"event":"fact_changed","name":"{name}","value":{value}}}"#)
}

fn component(component: &str, status: &str) -> String {
    format!(r#"{{"event":"component_status","component":"{component}","status":"{status}"}}"#)
}

fn has(answers: &[Answer], kind: &str) -> bool {
    kinds(answers).iter().any(|found| found == kind)
}

fn number(numerator: i64, denominator: i64) -> BigRational {
    BigRational::new(numerator.into(), denominator.into())
}

/// Returns a loop, not started, whose plan moves along `count` roads and needs the whole battery.
fn journey(count: u32, battery: &str, energy: &str) -> Loop {
    let domain = format!(
        "(define (domain d) (:requirements :strips :typing :fluents) (:types place)
          (:predicates (at ?p - place) (road ?a ?b - place)) (:functions (battery))
          (:action go :parameters (?a ?b - place)
            :precondition (and (at ?a) (road ?a ?b) (>= (battery) {energy}))
            :effect (and (not (at ?a)) (at ?b) (decrease (battery) {energy}))))"
    );
    let places: Vec<String> = (0..=count).map(|place| format!("p{place}")).collect();
    let roads: Vec<String> =
        places.windows(2).map(|pair| format!("(road {} {})", pair[0], pair[1])).collect();
    let problem = format!(
        "(define (problem p) (:domain d) (:objects {} - place) (:init (at p0) (= (battery) {battery}) {})
          (:goal (at p{count})))",
        places.join(" "),
        roads.join(" ")
    );
    plain(&domain, &problem)
}

/// The plan is made with exact numbers, so its execution must be believed with exact numbers, too.
#[test]
fn a_plan_that_needs_the_whole_battery_is_executed() {
    for (count, battery, energy) in [(2, "0.6666668", "0.3333334"), (6, "1", "(/ 1 6)")] {
        for fractions in [&[][..], &["0.37"], &["0.1", "0.23", "0.9"]] {
            let mut control = journey(count, battery, energy);
            control.start();
            for action in 1..=count {
                for fraction in fractions {
                    assert_eq!(feed(&mut control, &progress(action.into(), fraction)), Vec::new());
                }
                let answers =
                    feed(&mut control, &format!(r#"{{"event":"action_succeeded","action":{action}}}"#));
                let expected = if action == count { "goal_reached" } else { "request_action" };
                assert_eq!(kinds(&answers), [expected], "{battery} {fractions:?}: {answers:?}");
            }
            assert_eq!(control.beliefs().mission().value("battery"), Some(number(0, 1)), "{fractions:?}");
        }
    }
}

#[test]
fn reported_values_are_exact_unless_they_are_long() {
    let mut control = journey(6, "1", "(/ 1 6)");
    control.start();
    for (report, expected) in [
        ("0.0000004", number(4, 10_000_000)),
        ("2.3333334", number(23_333_334, 10_000_000)),
        ("1.30000000000000004", number(13, 10)),
    ] {
        feed(&mut control, &fact("battery", report));
        assert_eq!(control.beliefs().mission().value("battery"), Some(expected), "{report}");
    }
    // The believed value is 1.3 - 1/12. A report of this value changes nothing.
    feed(&mut control, &progress(1, "0.5"));
    let question = control.question();
    assert_eq!(feed(&mut control, &fact("battery", "1.216667")), Vec::new());
    assert_eq!(control.question(), question);
    assert_eq!(control.beliefs().mission().value("battery"), Some(number(13, 10) - number(1, 12)));
    feed(&mut control, &fact("battery", "1.216668"));
    assert_eq!(control.beliefs().mission().value("battery"), Some(number(1_216_668, 1_000_000)));
}

/// The goal is reachable only if the action under way, which leads into a dead end, is cancelled. Progress arrives
/// during the search.
#[test]
fn an_action_is_cancelled_although_it_has_progressed_during_the_search() {
    let mut control = crossroads("(road b c) (road b d)", "c");
    control.start();
    feed(&mut control, r#"{"event":"action_started","action":1}"#);
    react(&mut control, r#"{"event":"goal_changed","goal":"(at d)"}"#);
    let thoughts = control.thinker().think();
    react(&mut control, &progress(1, "0.1"));
    let mut replayed = control.clone();
    let answers = control.deliberate_with(thoughts, false).expect("the search has an answer");
    assert_eq!(kinds(&answers), ["plan_requested", "cancel_action"], "{answers:?}");
    // A journal records the plans of the other thread.
    let plans = control.decision(&answers).plans;
    assert_eq!(replayed.deliberate_again(&plans), answers);
    assert_eq!(replayed.snapshot(), control.snapshot());
}

#[test]
fn the_absence_of_a_plan_in_an_earlier_situation_is_not_used() {
    let mut control = crossroads("(road b c)", "d");
    assert!(has(&control.start(), "plan_none"));
    react(&mut control, &fact("road d b", "true"));
    let thoughts = control.thinker().think();
    react(&mut control, &fact("road b d", "true"));
    assert!(control.deliberate_with(thoughts, true).is_none());
    assert!(control.has_agenda());
    assert!(has(&control.deliberate(), "plan_found"));
}

/// Returns a loop whose first step, into a dead end, has failed twice. It is under way again as action 3.
fn failed_twice() -> Loop {
    let mut control = crossroads("(road b c) (road b d)", "c");
    control.start();
    for action in 1..=2 {
        feed(&mut control, &ended("failed", action));
    }
    control
}

fn ended(outcome: &str, action: u64) -> String {
    format!(r#"{{"event":"action_{outcome}","action":{action}}}"#)
}

#[test]
fn the_end_of_a_cancelled_action_leads_to_a_plan_for_the_changes_before() {
    let mut control = failed_twice();
    let answers = feed(&mut control, r#"{"event":"goal_changed","goal":"(at d)"}"#);
    assert_eq!(kinds(&answers), ["plan_requested", "cancel_action"]);
    let answers = feed(&mut control, &ended("failed", 3));
    assert_eq!(kinds(&answers), ["plan_requested", "plan_found", "request_action"], "{answers:?}");
    // This action is cancelled because of its deadline, and the change is reported before its end.
    let mut control = failed_twice();
    feed(&mut control, &progress(3, "0.5"));
    for time in [15, 30] {
        feed(&mut control, &format!(r#"{{"event":"tick","time":{time}}}"#));
    }
    assert!(control.beliefs().cancelling());
    assert_eq!(feed(&mut control, &fact("road d b", "true")), Vec::new());
    let answers = feed(&mut control, &ended("failed", 3));
    assert_eq!(kinds(&answers), ["plan_requested", "plan_found", "request_action"], "{answers:?}");
}

/// Otherwise, a robot that ends each action by itself would get requests without end.
#[test]
fn cancellations_that_the_loop_has_not_requested_count_as_failures() {
    let mut control = crossroads("(road b c)", "c");
    control.start();
    for action in 1..=2 {
        let answers = feed(&mut control, &ended("cancelled", action));
        assert!(has(&answers, "request_action"), "{answers:?}");
    }
    let answers = feed(&mut control, &ended("cancelled", 3));
    assert!(matches!(&answers[..], [Answer::PlanNone { status: "failed", .. }]), "{answers:?}");
    // A robot that cannot suspend an action cancels it, before or after the resumption.
    for is_resumed in [false, true] {
        let mut control = crossroads("(road b c)", "c");
        control.start();
        for action in 1..=4 {
            feed(&mut control, &fact("road b c", "false"));
            assert!(control.beliefs().suspended());
            if is_resumed {
                assert!(has(&feed(&mut control, &fact("road b c", "true")), "resume_action"));
            }
            let answers = feed(&mut control, &ended("cancelled", action));
            assert_eq!(has(&answers, "request_action"), is_resumed, "{answers:?}");
            if !is_resumed {
                assert!(has(&feed(&mut control, &fact("road b c", "true")), "request_action"));
            }
        }
    }
}

/// The objective of the action that has ended is in error, and no longer so when the loop plans.
#[test]
fn an_objective_that_has_recovered_is_no_reason_to_plan() {
    let mut ugv = control("ugv");
    ugv.start();
    react(&mut ugv, &ended("succeeded", 1));
    for _ in 0..3 {
        let answers = react(&mut ugv, &component("c_kinect", "FALSE"));
        assert!(answers[0].to_json()["objectives"][0]["statuses"][0].is_string(), "{answers:?}");
        react(&mut ugv, &component("c_kinect", "OK"));
    }
    let mut failing = ugv.clone();
    assert_eq!(kinds(&ugv.deliberate()), ["request_action"]);
    // An objective that is still in error is a reason, but only one.
    react(&mut failing, &component("c_kinect", "FALSE"));
    let answers = failing.deliberate();
    let because = answers[0].to_json()["because"].clone();
    let errors =
        because.as_array().expect("reasons").iter().filter(|text| text.to_string().contains(" is IN_"));
    assert_eq!(errors.count(), 1, "{because}");
}

/// The situation changes during each search. Otherwise, there would be neither a decision nor a pause between searches.
#[test]
fn the_absence_of_a_plan_is_used_after_three_results_for_earlier_situations() {
    for (is_moving, expected) in [(false, "plan_none"), (true, "cancel_action")] {
        let roads = if is_moving { "(road b c) (road b d)" } else { "(road b c)" };
        let mut control = crossroads(roads, if is_moving { "c" } else { "d" });
        control.start();
        if is_moving {
            feed(&mut control, r#"{"event":"action_started","action":1}"#);
            react(&mut control, r#"{"event":"goal_changed","goal":"(at d)"}"#);
        }
        for round in 0..8 {
            react(&mut control, &fact("road d b", if round % 2 == 0 { "true" } else { "false" }));
            let thoughts = control.thinker().think();
            react(&mut control, &fact("road d c", if round % 2 == 0 { "true" } else { "false" }));
            let mut replayed = control.clone();
            let Some(answers) = control.deliberate_with(thoughts, true) else {
                assert!(round % 4 < 3, "{round}");
                continue;
            };
            assert_eq!(round % 4, 3, "the results are counted again: {answers:?}");
            assert_eq!(kinds(&answers), ["plan_requested", expected]);
            let is_unproved =
                |answer: &Answer| !matches!(answer, Answer::PlanNone { status: "unsolvable", .. });
            assert!(answers.iter().all(is_unproved), "{answers:?}");
            let plans = control.decision(&answers).plans;
            assert_eq!(replayed.deliberate_again(&plans), answers);
            assert_eq!(replayed.snapshot(), control.snapshot());
            if is_moving {
                break;
            }
        }
    }
}

/// Only conditions, not the configuration of a step, mention the lost design.
#[test]
fn a_lost_design_that_a_condition_or_the_goal_reads_leads_to_a_plan() {
    let domain = "(define (domain d) (:requirements :strips :typing :disjunctive-preconditions)
      (:types function functiondesign) (:constants fd_amcl_kinect - functiondesign)
      (:predicates (ready) (loaded) (done) (fd_available ?d - functiondesign))
      (:action go :parameters () :precondition (and) :effect (ready))
      (:action upload :parameters () :precondition (and (ready) (fd_available fd_amcl_kinect)) :effect (done))
      (:action load :parameters () :precondition (ready) :effect (loaded))
      (:action carry :parameters () :precondition (loaded) :effect (done)))";
    let problem = |goal: &str| format!("(define (problem p) (:domain d) (:init) (:goal {goal}))");
    let mut control = own(domain, &problem("(done)"), "");
    control.start();
    assert_eq!(control.beliefs().plan().expect("a plan").count(), 1);
    let answers = feed(&mut control, &component("c_kinect", "FALSE"));
    assert!(has(&answers, "plan_found") && !has(&answers, "plan_kept"), "{answers:?}");
    let steps: Vec<&str> =
        control.beliefs().plan().expect("a plan").map(|step| step.action.as_str()).collect();
    assert_eq!(steps, ["load", "carry"]);

    let mut control = own(domain, &problem("(or (done) (fd_available fd_amcl_kinect))"), "");
    assert!(control.start().contains(&Answer::GoalReached));
    let answers = feed(&mut control, &component("c_kinect", "FALSE"));
    assert!(has(&answers, "request_action"), "{answers:?}");
}

#[test]
fn a_report_that_arrives_with_the_third_failure_leads_to_a_plan() {
    for line in
        [component("c_kinect", "FALSE"), r#"{"event":"goal_changed","goal":"(robot_at wp3)"}"#.to_owned()]
    {
        let mut ugv = control("ugv");
        ugv.start();
        let failure = |action: u64| format!(r#"{{"event":"action_failed","action":{action}}}"#);
        feed(&mut ugv, &failure(1));
        feed(&mut ugv, &failure(2));
        let mut alone = ugv.clone();
        assert_eq!(kinds(&feed(&mut alone, &failure(3))), ["plan_none"], "{line}");
        react(&mut ugv, &failure(3));
        react(&mut ugv, &line);
        let answers = ugv.deliberate();
        assert!(has(&answers, "request_action") && !has(&answers, "plan_none"), "{line}: {answers:?}");
    }
}

/// A debounced measurement is believed in the same line as the failure.
#[test]
fn a_held_report_that_is_due_with_the_third_failure_leads_to_a_plan() {
    let domain = "(define (domain d) (:requirements :strips :typing) (:types open)
      (:predicates (visited ?p - open) (done))
      (:action visit :parameters (?p - open) :precondition (and) :effect (visited ?p))
      (:action go :parameters () :precondition (and) :effect (done)))";
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done)))";
    let bindings = "[bindings]\nopen = 'class:OpenPlace'\n[adaptation.measured.light]\ndebounce = 5";
    for (measurement, expected) in [("0.5", "plan_none"), ("0.9", "request_action")] {
        let mut control = lighted(domain, problem, bindings);
        control.start();
        for action in 1..=2 {
            feed(&mut control, &format!(r#"{{"event":"action_failed","action":{action}}}"#));
        }
        let answers = react(&mut control, &light(measurement));
        assert!(!has(&answers, "error"), "{answers:?}");
        let answers = feed(&mut control, r#"{"event":"action_failed","action":3,"time":30}"#);
        assert!(has(&answers, expected), "{measurement}: {answers:?}");
    }
}

const KNOWLEDGE: &str = "@prefix : <http://example.org/m#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix t: <http://metacontrol.org/tomasys#> .
<http://example.org/m> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .
:OpenPlace a owl:Class . :ClosedPlace a owl:Class . :wp5 a :ClosedPlace .
:light a t:QualityAttributeType . :battery a t:QualityAttributeType .
:obs_light a t:QAvalue ; t:isQAtype :light ; t:isMeasured true ; t:hasValue 0.5 .
:obs_battery a t:QAvalue ; t:isQAtype :battery ; t:isMeasured true ; t:hasValue 100.0 .
:robotAt a owl:ObjectProperty . :road a owl:ObjectProperty .
:r a owl:NamedIndividual ; :robotAt :wp6 .
:wp6 a owl:NamedIndividual ; :road :wp5 . :wp5 :road :wp6 .
";

const RULES: &str = "@prefix : <http://example.org/m#> .
@prefix t: <http://metacontrol.org/tomasys#> .
[open] t:hasValue(:obs_light, ?v) ^ swrlb:greaterThan(?v, 0.8) -> :OpenPlace(:wp5) .
";

fn lighted(domain: &str, problem: &str, bindings: &str) -> Loop {
    let directory = tempfile::tempdir().expect("a directory");
    let manifest = format!(
        "name = 'own'\n[knowledge]\nfiles = ['kb.ttl']\nrules = ['coadaptation', 'own.swrl']
         [planning]\ndomain = 'domain.pddl'\nproblem = 'problem.pddl'\n{bindings}\n"
    );
    let files =
        [("kb.ttl", KNOWLEDGE), ("own.swrl", RULES), ("domain.pddl", domain), ("problem.pddl", problem)];
    for (name, text) in files {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    let setup = Setup::parse("m.toml", &manifest, directory.path());
    let Setup { mission, settings, .. } = setup.expect("the mission is read");
    Loop::new(mission, settings.with_settle(Duration::ZERO)).expect("a loop")
}

fn light(value: &str) -> String {
    measured("light", value)
}

/// Returns a loop, not started, in which a rule infers the only object that can be visited.
fn open_place() -> Loop {
    let domain = "(define (domain d) (:requirements :strips :typing :existential-preconditions) (:types open)
      (:predicates (visited ?p - open) (lit))
      (:action visit :parameters (?p - open) :precondition (and) :effect (visited ?p)))";
    let problem = "(define (problem p) (:domain d) (:init) (:goal (exists (?p - open) (visited ?p))))";
    lighted(domain, problem, "[bindings]\nopen = 'class:OpenPlace'")
}

#[test]
fn inferred_objects_and_measured_facts_lead_to_a_plan() {
    // In PLANTA's form, a condition can read a measured value.
    let domain = "(define (domain d) (:requirements :strips :typing) (:predicates (done))
      (:action go :parameters () :precondition (hasValue obs_light 0.9_decimal) :effect (done)))";
    let planta = lighted(domain, "(define (problem p) (:domain d) (:init) (:goal (done)))", "");
    // The goal can read it, too.
    let domain = "(define (domain d) (:requirements :strips :typing) (:predicates (done))
      (:action go :parameters () :precondition (isQAtype obs_light light) :effect (done)))";
    let goal =
        "(define (problem p) (:domain d) (:init) (:goal (and (done) (hasValue obs_light 0.9_decimal))))";
    let in_goal = lighted(domain, goal, "");
    for mut control in [open_place(), planta, in_goal] {
        let answers = control.start();
        assert!(has(&answers, "plan_none"), "{answers:?}");
        let answers = feed(&mut control, &light("0.9"));
        assert!(has(&answers, "request_action"), "{answers:?}");
    }
}

/// An object that is not inferred any more is refused, also if it was accepted before, and only in reports about it.
#[test]
fn a_reported_fact_is_checked_in_the_present_situation() {
    let mut control = open_place();
    let is_refused = |control: &mut Loop, name: &str, value: &str| {
        let answers = react(control, &fact(name, value));
        answers.iter().any(|answer| matches!(answer, Answer::Error { .. }))
    };
    assert!(is_refused(&mut control, "visited wp5", "true"));
    react(&mut control, &light("0.9"));
    assert!(!is_refused(&mut control, "visited wp5", "true"));
    assert!(!is_refused(&mut control, "visited wp5", "false"));
    let mut restored = open_place();
    restored.restore(&control.snapshot()).expect("the snapshot fits");
    for control in [&mut control, &mut restored] {
        assert!(!is_refused(control, "visited wp5", "true"));
        react(control, &light("0.1"));
        assert!(!is_refused(control, "lit", "true"), "this report is about another fact");
        assert!(!is_refused(control, "visited wp5", "false"));
        assert!(is_refused(control, "visited wp5", "true"));
    }
}

fn succeeded(action: u64) -> String {
    format!(r#"{{"event":"action_succeeded","action":{action}}}"#)
}

fn measured(attribute: &str, value: &str) -> String {
    format!(r#"{{"event":"measured","attribute":"{attribute}","value":{value}}}"#)
}

fn planned(control: &Loop) -> Vec<String> {
    control.beliefs().plan().into_iter().flatten().map(|step| step.action.clone()).collect()
}

/// The values are those that follow from the definition: each move takes 10 s and 20 units of energy at the speed 1.
#[test]
fn a_success_counts_although_its_effects_cannot_be_evaluated() {
    let domain = "(define (domain d) (:requirements :strips :typing :fluents :durative-actions) (:types place)
      (:predicates (at ?p - place)) (:functions (speed) (battery) (distance ?a ?b - place))
      (:durative-action move :parameters (?a ?b - place) :duration (= ?duration (/ (distance ?a ?b) (speed)))
        :condition (at start (at ?a))
        :effect (and (at start (not (at ?a))) (at end (at ?b)) (at end (decrease (battery) (* 2 ?duration))))))";
    let problem = "(define (problem p) (:domain d) (:objects wp1 wp2 wp3 - place)
      (:init (at wp1) (= (speed) 1) (= (battery) 100) (= (distance wp1 wp2) 10) (= (distance wp2 wp3) 10))
      (:goal (at wp3)))";
    let started = || {
        let mut control = plain(domain, problem);
        control.start();
        control
    };
    let battery = |control: &Loop| control.beliefs().mission().value("battery").expect("a value");

    let mut control = started();
    feed(&mut control, &progress(1, "0.9"));
    let answers = feed(&mut control, &measured("speed", "0"));
    assert!(has(&answers, "suspend_action"), "{answers:?}");
    let answers = feed(&mut control, &succeeded(1));
    let reasons = answers.iter().map(|answer| answer.to_json().to_string()).collect::<String>();
    assert!(reasons.contains("the effects of action 1 are uncertain: "), "{reasons}");
    let mission = control.beliefs().mission();
    assert!(mission.holds("at wp2") && !mission.holds("at wp1"), "{answers:?}");
    assert_eq!(battery(&control), number(80, 1));
    let answers = feed(&mut control, &measured("speed", "1"));
    assert!(has(&answers, "request_action"), "{answers:?}");
    let (_, step) = control.beliefs().running().expect("an action");
    assert_eq!(step.arguments, ["wp2", "wp3"]);

    // A share of the effects that cannot be evaluated is applied later.
    let mut control = started();
    for (line, expected) in [
        (progress(1, "0.5"), 90),
        (measured("speed", "0"), 90),
        (progress(1, "0.9"), 90),
        (measured("speed", "1"), 90),
        (progress(1, "0.9"), 82),
        (succeeded(1), 80),
    ] {
        feed(&mut control, &line);
        assert_eq!(battery(&control), number(expected, 1), "{line}");
    }
}

#[test]
fn effects_are_those_of_the_schema_that_could_start() {
    let domain = "(define (domain d) (:requirements :strips :fluents)
      (:predicates (on_table ?x) (on_floor ?x) (holding ?x)) (:functions (battery))
      (:action take :parameters (?x) :precondition (on_table ?x) :effect (and (holding ?x) (not (on_table ?x))))
      (:action take :parameters (?x) :precondition (on_floor ?x)
        :effect (and (holding ?x) (not (on_floor ?x)) (decrease (battery) 5))))";
    let problem = "(define (problem p) (:domain d) (:objects b) (:init (on_floor b) (= (battery) 9))
      (:goal (holding b)))";
    let mut control = plain(domain, problem);
    control.start();
    let answers = feed(&mut control, &succeeded(1));
    assert!(answers.contains(&Answer::GoalReached), "{answers:?}");
    let mission = control.beliefs().mission();
    assert!(mission.holds("holding b") && !mission.holds("on_floor b"));
    assert_eq!(mission.value("battery"), Some(number(4, 1)));
}

/// The value of the battery is measured, and not stated by the problem. Each move uses 40 of 100 units.
#[test]
fn actions_change_a_value_of_the_knowledge_base() {
    let domain = "(define (domain d) (:requirements :strips :typing :fluents) (:types place)
      (:predicates (at ?p - place) (way ?a ?b - place)) (:functions (battery))
      (:action move :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b) (>= (battery) 40))
        :effect (and (not (at ?a)) (at ?b) (decrease (battery) 40))))";
    let problem = "(define (problem p) (:domain d) (:objects a b c - place)
      (:init (at a) (way a b) (way b c) (way b a) (way c b)) (:goal (at c)))";
    for has_progress in [false, true] {
        let mut control = lighted(domain, problem, "");
        control.start();
        if has_progress {
            feed(&mut control, &progress(1, "0.5"));
            assert_eq!(control.beliefs().mission().value("battery"), Some(number(80, 1)));
        }
        feed(&mut control, &succeeded(1));
        let answers = feed(&mut control, &succeeded(2));
        assert!(answers.contains(&Answer::GoalReached), "{answers:?}");
        assert_eq!(control.beliefs().mission().value("battery"), Some(number(20, 1)));
        let answers = feed(&mut control, r#"{"event":"goal_changed","goal":"(at a)"}"#);
        assert!(has(&answers, "plan_none"), "{answers:?}");
        let answers = feed(&mut control, &measured("battery", "90"));
        assert!(has(&answers, "request_action"), "{answers:?}");
        assert_eq!(control.beliefs().mission().value("battery"), Some(number(90, 1)));
    }
}

/// In PLANTA's form, the knowledge base states where the robot is, and a value.
#[test]
fn actions_change_facts_of_the_knowledge_base() {
    let domain = "(define (domain d) (:requirements :strips :typing) (:predicates (done))
      (:action move :parameters (?a ?b) :precondition (and (robotAt r ?a) (road ?a ?b))
        :effect (and (not (robotAt r ?a)) (robotAt r ?b)))
      (:action brighten :parameters () :precondition (robotAt r wp5) :effect (hasValue obs_light 0.9_decimal))
      (:action work :parameters () :precondition (and (robotAt r wp6) (hasValue obs_light 0.9_decimal))
        :effect (done)))";
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done)))";
    let mut control = lighted(domain, problem, "");
    control.start();
    let facts = |control: &Loop| -> Vec<String> {
        let problem = control.beliefs().mission().current();
        let facts = problem.init.iter().filter_map(InitialElement::fact);
        let facts = facts.filter(|(name, _)| [Name::new("robotAt"), Name::new("hasValue")].contains(name));
        let facts = facts.map(|(_, arguments)| format!("{} {}", arguments[0], arguments[1]));
        let mut facts: Vec<String> = facts.filter(|fact| !fact.starts_with("obs_battery")).collect();
        facts.sort();
        facts
    };
    let expected = [
        ("move", ["obs_light 0.5_decimal", "r wp6"]),
        ("brighten", ["obs_light 0.5_decimal", "r wp5"]),
        ("move", ["obs_light 0.9_decimal", "r wp5"]),
        ("work", ["obs_light 0.9_decimal", "r wp6"]),
    ];
    for (action, (name, situation)) in (1..).zip(expected) {
        assert_eq!(facts(&control), situation, "{action}");
        let (_, step) = control.beliefs().running().expect("an action");
        assert_eq!(step.action, name);
        let mut restored = lighted(domain, problem, "");
        restored.restore(&control.snapshot()).expect("the snapshot fits");
        assert_eq!(facts(&restored), situation, "{action}");
        feed(&mut control, &succeeded(action));
    }
    assert!(control.beliefs().reached());
    // A measurement replaces the believed value.
    feed(&mut control, &light("0.5"));
    assert_eq!(facts(&control), ["obs_light 0.5_decimal", "r wp6"]);
}

#[test]
fn inferred_facts_and_measured_values_lead_to_a_better_plan() {
    let steps = "(:action first :parameters () :precondition (and) :effect (a))
      (:action second :parameters () :precondition (a) :effect (b))
      (:action third :parameters () :precondition (b) :effect (done))";
    let inferred = format!(
        "(define (domain d) (:requirements :strips :typing) (:types open) (:predicates (a) (b) (done))
          {steps} (:action through :parameters (?p - open) :precondition (and) :effect (done)))"
    );
    let value = format!(
        "(define (domain d) (:requirements :strips :fluents) (:predicates (a) (b) (done)) (:functions (light))
          {steps} (:action through :parameters () :precondition (>= (light) 0.8) :effect (done)))"
    );
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done)))";
    for (domain, bindings) in [(inferred, "[bindings]\nopen = 'class:OpenPlace'"), (value, "")] {
        let mut control = lighted(&domain, problem, bindings);
        control.start();
        assert_eq!(planned(&control), ["second", "third"]);
        let answers = feed(&mut control, &light("0.9"));
        assert!(has(&answers, "plan_found"), "{answers:?}");
        assert_eq!(planned(&control), ["through"]);
    }
}

/// A condition requires that a design is not available.
#[test]
fn the_loss_of_a_design_can_lead_to_a_plan() {
    let domain = "(define (domain d) (:requirements :strips :typing :negative-preconditions)
      (:types function functiondesign) (:constants fd_amcl_kinect - functiondesign)
      (:predicates (a) (b) (done) (started) (fd_available ?d - functiondesign))
      (:action first :parameters () :precondition (started) :effect (a))
      (:action second :parameters () :precondition (a) :effect (b))
      (:action third :parameters () :precondition (b) :effect (done))
      (:action replace :parameters () :precondition (not (fd_available fd_amcl_kinect)) :effect (done)))";
    let problem = |init: &str| format!("(define (problem p) (:domain d) (:init {init}) (:goal (done)))");
    let mut control = own(domain, &problem(""), "[adaptation]\nsettle = 0");
    let answers = control.start();
    assert!(has(&answers, "plan_none"), "{answers:?}");
    let answers = feed(&mut control, &component("c_kinect", "FALSE"));
    assert!(has(&answers, "request_action"), "{answers:?}");

    let mut control = own(domain, &problem("(started)"), "[adaptation]\nsettle = 0");
    control.start();
    assert_eq!(planned(&control), ["second", "third"]);
    feed(&mut control, &component("c_kinect", "FALSE"));
    assert_eq!(planned(&control), ["replace"]);
}
