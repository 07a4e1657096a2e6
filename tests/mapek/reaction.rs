//! Tests of the order "safe first, then optimal": safe effects before planning, also while a search runs and
//! within five milliseconds. Further tests: causes of planning, reports without consequences, deadlines, the
//! repetition of unfinished searches, and effects of actions.

use std::path::Path;
use std::time::{Duration, Instant};

use cpu_time::ThreadTime;
use metaplan::mapek::{Answer, Command, Loop, Observation, ParallelSearch, SafeReaction, Settings};
use metaplan::setup::Setup;

use crate::common::{control, crossroads, feed, kinds, own};

fn with(settings: impl Fn(Settings) -> Settings) -> Loop {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
    let Setup { mission, settings: mission_settings, .. } =
        Setup::read(&manifest).expect("the mission is read");
    let mut control = Loop::new(mission, settings(mission_settings)).expect("a loop");
    control.start();
    feed(&mut control, r#"{"event":"action_started","action":1}"#);
    control
}

fn react(control: &mut Loop, line: &str) -> Vec<Answer> {
    let now = control.beliefs().now() + Duration::from_millis(100);
    control.react(&Observation::parse(line), now)
}

fn status(component: &str, status: &str) -> String {
    format!(r#"{{"event":"component_status","component":"{component}","status":"{status}"}}"#)
}

#[test]
fn a_lost_design_is_replaced_before_planning() {
    let mut ugv = with(|settings| settings);
    let answers = react(&mut ugv, &status("c_kinect", "FALSE"));
    assert_eq!(kinds(&answers), ["inferred", "reconfigure", "inferred"]);
    // A second loss also leads to a reaction before planning.
    let answers = react(&mut ugv, &status("c_lidar", "FALSE"));
    assert_eq!(kinds(&answers)[..2], ["inferred", "reconfigure"]);
    assert!(ugv.has_agenda());
    // Planning requests available designs only.
    for answer in ugv.deliberate() {
        if let Some(Command::Reconfigure { to, .. }) = answer.effect().map(|effect| &effect.command) {
            assert!(ugv.beliefs().available().contains(to), "{to}");
        }
    }
    assert!(!ugv.has_agenda() && ugv.deliberate().is_empty());
}

#[test]
fn suspension_can_be_preferred() {
    let mut ugv = with(|settings| settings.with_safe_reaction(SafeReaction::Suspend));
    let answers = react(&mut ugv, &status("c_kinect", "FALSE"));
    assert_eq!(kinds(&answers), ["inferred", "suspend_action"]);
    let answers = ugv.deliberate();
    let effects: Vec<String> = kinds(&answers).into_iter().filter(|kind| kind.contains("re")).collect();
    assert_eq!(effects, ["plan_requested", "reconfigure", "inferred", "resume_action"]);
    // An action whose design recovers before the decision is resumed.
    let mut ugv = with(|settings| settings.with_safe_reaction(SafeReaction::Suspend));
    react(&mut ugv, &status("c_kinect", "FALSE"));
    react(&mut ugv, &status("c_kinect", "OK"));
    assert!(kinds(&ugv.deliberate()).contains(&"resume_action".to_owned()));
    assert!(!ugv.beliefs().suspended());
}

/// Plans that another thread computed are adopted after progress and the passing of time, and dropped after
/// other events.
#[test]
fn plans_of_another_thread_are_adopted_unless_outdated() {
    for (line, serves) in [
        (r#"{"event":"tick"}"#.to_owned(), true),
        (r#"{"event":"action_progress","action":1,"fraction":0.5}"#.to_owned(), true),
        (status("c_lidar", "FALSE"), false),
        (r#"{"event":"goal_changed","goal":"(robot_at wp2)"}"#.to_owned(), false),
    ] {
        let mut ugv = with(|settings| settings);
        react(&mut ugv, &status("c_kinect", "FALSE"));
        let before = ugv.snapshot();
        assert!(ugv.deliberate_at_once().is_none(), "a plan is needed");
        assert_eq!(ugv.snapshot(), before, "nothing has changed");
        let thinker = ugv.thinker();
        let thoughts = std::thread::spawn(move || thinker.think()).join().expect("plans");
        react(&mut ugv, &line);
        let answers = ugv.deliberate_with(thoughts, false);
        assert_eq!(answers.is_some(), serves, "{line}");
        assert_eq!(ugv.has_agenda(), !serves, "{line}");
        let answers = answers.unwrap_or_else(|| ugv.deliberate());
        assert!(kinds(&answers).contains(&"plan_found".to_owned()), "{line}: {answers:?}");
    }
}

#[test]
fn no_more_than_three_searches_in_a_row_are_cancelled() {
    let mut ugv = with(|settings| settings);
    react(&mut ugv, &status("c_kinect", "FALSE"));
    let mut search = ParallelSearch::default();
    for round in 0..4 {
        search.begin(ugv.thinker().handle());
        search.update(Some(ugv.question()));
        react(&mut ugv, &format!(r#"{{"event":"goal_changed","goal":"(robot_at wp{})"}}"#, 2 + round));
        search.update(Some(ugv.question()));
        assert_eq!(search.accepts_late_plans(), round == 3);
        assert_eq!(search.end(), round < 3, "round {round}");
    }
    search.begin(ugv.thinker().handle());
    search.update(None);
    assert!(search.end(), "a search for nothing is always cancelled");
    search.reset();
    assert!(!search.accepts_late_plans());
    search.begin(ugv.thinker().handle());
    search.interrupt();
    assert!(!search.is_running() && search.end(), "its plans are not used");
    assert!(!search.accepts_late_plans());
}

#[test]
fn a_late_plan_for_another_goal_is_not_proved() {
    let mut ugv = with(|settings| settings);
    let goal = |goal: &str| format!(r#"{{"event":"goal_changed","goal":"{goal}"}}"#);
    react(&mut ugv, &goal("(robot_at wp8)"));
    let thoughts = ugv.thinker().think();
    // The plan for the former goal also reaches this one, but is not the best.
    react(&mut ugv, &goal("(or (robot_at wp8) (robot_at wp2))"));
    let answers = ugv.deliberate_with(thoughts, true).expect("the plan fits");
    let is_unproved = |answer: &Answer| matches!(answer, Answer::PlanFound { optimal: false, .. });
    assert!(answers.iter().any(is_unproved), "{answers:?}");
}

#[test]
fn a_report_of_a_known_fact_changes_nothing() {
    let mut ugv = with(|settings| settings);
    let here = r#"{"event":"fact_changed","name":"robot_at","value":"wp1"}"#;
    assert_eq!(feed(&mut ugv, here), Vec::new());
    for action in 1..=3 {
        feed(&mut ugv, &format!(r#"{{"event":"action_failed","action":{action}}}"#));
    }
    assert_eq!(feed(&mut ugv, here), Vec::new(), "what was given up is not tried again");
}

#[test]
fn a_goal_that_no_longer_holds_is_pursued_again() {
    let mut ugv = with(|settings| settings);
    feed(&mut ugv, r#"{"event":"goal_changed","goal":"(robot_at wp2)"}"#);
    let answers = feed(&mut ugv, r#"{"event":"action_succeeded","action":1}"#);
    assert!(answers.contains(&Answer::GoalReached), "{answers:?}");
    let answers = feed(&mut ugv, r#"{"event":"fact_changed","name":"robot_at","value":"wp1"}"#);
    assert!(kinds(&answers).contains(&"request_action".to_owned()), "{answers:?}");
}

#[test]
fn a_better_value_leads_to_a_better_plan() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/templates/warehouse/mission.toml");
    let Setup { mission, settings, .. } = Setup::read(&manifest).expect("the mission is read");
    let mut control = Loop::new(mission, settings.with_settle(Duration::ZERO)).expect("a loop");
    control.start();
    let answers = feed(&mut control, r#"{"event":"measured","attribute":"battery","value":30}"#);
    let cost = answers.iter().find_map(|answer| match answer {
        Answer::PlanFound { cost, .. } => Some(cost.clone()),
        _ => None,
    });
    assert!(
        cost.is_some_and(|cost| cost < num_rational::BigRational::from_integer(50.into())),
        "{answers:?}"
    );
}

/// Snapshots store microseconds. With finer times, a restored loop could decide differently.
#[test]
fn times_are_in_whole_microseconds() {
    let mut ugv = with(|settings| settings);
    feed(&mut ugv, r#"{"event":"tick","time":10.0000009}"#);
    assert_eq!(ugv.beliefs().now(), Duration::from_secs(10));
}

#[test]
fn a_refused_line_does_not_use_up_its_number() {
    let mut ugv = with(|settings| settings);
    for (status_, number) in [("FALSE", 1), ("RECOVERED", 2)] {
        let line = status("c_kinect", status_);
        feed(&mut ugv, &line.replace('}', &format!(r#","time":{number},"seq":{number}}}"#)));
    }
    // The recovery becomes due at the time of the refused line.
    let answers = feed(&mut ugv, r#"{"event":"goal_changd","goal":"(robot_at wp2)","time":10,"seq":3}"#);
    assert_eq!(kinds(&answers)[..2], ["error", "inferred"], "{answers:?}");
    feed(&mut ugv, r#"{"event":"goal_changed","goal":"(robot_at wp2)","time":10,"seq":3}"#);
    assert_eq!(ugv.beliefs().goal(), Some("(robot_at wp2)"));
}

#[test]
fn effects_are_those_in_the_state_before_the_action() {
    let domain = "(define (domain d) (:requirements :strips :fluents :conditional-effects)
      (:predicates (done)) (:functions (x) (y) (used))
      (:action go :parameters () :precondition (>= (x) 5)
        :effect (and (decrease (x) 20) (increase (used) (x)) (assign (y) (x)) (when (>= (x) 90) (done)))))";
    let problem = "(define (problem p) (:domain d) (:init (= (x) 100) (= (y) 0) (= (used) 0))
      (:goal (and (done) (= (y) 100) (>= (used) 100))))";
    let progress = r#"{"event":"action_progress","action":1,"fraction":0.5}"#;
    for events in [&[][..], &[progress], &[progress, &progress.replace("0.5", "0.8")]] {
        let mut control = own(domain, problem, "");
        control.start();
        for event in events {
            assert_eq!(feed(&mut control, event), Vec::new());
        }
        let answers = feed(&mut control, r#"{"event":"action_succeeded","action":1}"#);
        let values = control.beliefs().mission().values();
        assert!(answers.contains(&Answer::GoalReached), "{events:?}: {values:?}");
    }
}

/// The planner chooses a duration that no equality determines, and the loop judges its plans by the same choice.
#[test]
fn variable_durations_are_those_of_the_planner() {
    for (constraint, metric, expected) in [
        ("(>= ?duration 3)", "", "3"),
        ("(and (>= ?duration (least)) (<= ?duration 9))", "(:metric minimize (total-time))", "4"),
        ("(and (>= ?duration 3) (<= ?duration (most)))", "(:metric maximize (total-time))", "7"),
    ] {
        let domain = format!(
            "(define (domain d) (:requirements :strips :fluents :durative-actions :duration-inequalities)
              (:predicates (half) (done)) (:functions (least) (most))
              (:durative-action go :parameters () :duration {constraint}
                :condition (at start (not (half))) :effect (at end (half)))
              (:durative-action return :parameters () :duration (= ?duration 1)
                :condition (at start (half)) :effect (at end (done))))"
        );
        let problem = format!(
            "(define (problem p) (:domain d) (:init (= (least) 4) (= (most) 7)) (:goal (done)) {metric})"
        );
        let mut control = own(&domain, &problem, "");
        let answers = control.start();
        let plan = &answers
            .iter()
            .find(|answer| answer.to_json()["answer"] == "plan_found")
            .expect("a plan")
            .to_json();
        assert_eq!(plan["steps"][0]["duration"].to_string(), expected, "{constraint}: {plan}");
        feed(&mut control, r#"{"event":"action_progress","action":1,"fraction":0.5}"#);
        assert_eq!(control.beliefs().violation(), None, "{constraint}");
        let answers = feed(&mut control, r#"{"event":"action_succeeded","action":1}"#);
        assert_eq!(kinds(&answers), ["request_action"], "{constraint}: {answers:?}");
        let answers = feed(&mut control, r#"{"event":"action_succeeded","action":2}"#);
        assert!(answers.contains(&Answer::GoalReached), "{constraint}: {answers:?}");
    }
}

#[test]
fn an_action_without_duration_continues_after_progress() {
    let domain = "(define (domain d) (:requirements :strips :fluents)
      (:predicates (done) (other)) (:functions (battery))
      (:action go :parameters () :precondition (>= (battery) 10)
        :effect (and (decrease (battery) 10) (done))))";
    let problem = "(define (problem p) (:domain d) (:init (= (battery) 12)) (:goal (done)))";
    let mut control = own(domain, problem, "");
    control.start();
    feed(&mut control, r#"{"event":"action_progress","action":1,"fraction":0.5}"#);
    let answers = feed(&mut control, r#"{"event":"fact_changed","name":"other","value":"true"}"#);
    assert_eq!(answers, Vec::new());
    // With what half of the action has used, the condition does not hold.
    let answers = feed(&mut control, r#"{"event":"fact_changed","name":"battery","value":4}"#);
    assert!(kinds(&answers).contains(&"plan_none".to_owned()), "{answers:?}");
}

#[test]
fn a_measurement_counts_for_all_its_functions_but_only_once() {
    let domain = "(define (domain d) (:requirements :strips :fluents) (:predicates (okay))
      (:functions (la) (lb))
      (:action a :parameters () :precondition (and (>= (la) 0.8) (>= (lb) 0.8)) :effect (okay)))";
    let problem = "(define (problem p) (:domain d) (:init (= (la) 0.3) (= (lb) 0.3)) (:goal (okay)))";
    let bindings = "[bindings]\nla = 'measured:ambient_light'\nlb = 'measured:ambient_light'";
    let mut control = own(domain, problem, bindings);
    control.start();
    let measured =
        |value: &str| format!(r#"{{"event":"measured","attribute":"ambient_light","value":{value}}}"#);
    let answers = feed(&mut control, &measured("0.9"));
    assert!(kinds(&answers).contains(&"plan_found".to_owned()), "{answers:?}");
    // An equal measurement must not cancel a search.
    let question = control.question();
    feed(&mut control, &measured("0.9"));
    assert_eq!(control.question(), question);
    feed(&mut control, &measured("0.95"));
    assert_ne!(control.question(), question);
}

#[test]
fn a_plan_without_metric_is_kept_unless_another_has_a_benefit() {
    let domain = "(define (domain d) (:requirements :strips :typing) (:types place)
      (:predicates (at ?p - place) (road ?a ?b - place))
      (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b))
        :effect (and (not (at ?a)) (at ?b))))";
    let problem = "(define (problem p) (:domain d) (:objects a s m b g - place)
      (:init (at s) (road s m) (road m b) (road b g) (road a g)) (:goal (at g)))";
    for (benefit, road, expected) in
        [("1", "m a", "plan_kept"), ("2", "m g", "plan_kept"), ("1", "m g", "plan_found")]
    {
        let mut control =
            own(domain, problem, &format!("[adaptation]\nminimum_benefit = {benefit}\nsettle = 0"));
        control.start();
        feed(&mut control, r#"{"event":"action_started","action":1}"#);
        let line = format!(r#"{{"event":"fact_changed","name":"road {road}","value":"true"}}"#);
        let answers = kinds(&feed(&mut control, &line));
        assert_eq!(answers, ["plan_requested", expected], "{road}");
    }
}

#[test]
fn a_wrong_time_is_refused() {
    for time in ["1700000000000000000", "18446744073709549568", "1700000000"] {
        let mut ugv = with(|settings| settings.with_settle(Duration::from_secs(3600)));
        let answers = feed(&mut ugv, &format!(r#"{{"event":"tick","time":{time}}}"#));
        assert!(matches!(&answers[..], [Answer::Error { code, .. }] if code == "M308"), "{answers:?}");
        assert!(ugv.beliefs().now() < Duration::from_secs(10));
        for (status_, time) in [("FALSE", 5), ("TRUE", 6)] {
            let line = status("c_kinect", status_).replace('}', &format!(r#","time":{time}}}"#));
            feed(&mut ugv, &line);
        }
        // The recovery counts after the heal time.
        feed(&mut ugv, r#"{"event":"tick","time":9}"#);
        let answers = feed(&mut ugv, r#"{"event":"tick","time":5000}"#);
        assert!(
            kinds(&answers).contains(&"plan_requested".to_owned()),
            "it is looked for a better plan: {answers:?}"
        );
    }
}

#[test]
fn the_time_of_a_line_that_is_not_understood_counts_only_among_times() {
    let mut ugv = with(|settings| settings);
    feed(&mut ugv, r#"{"event":"tikc","time":43200}"#);
    assert!(ugv.beliefs().now() < Duration::from_secs(10));
    feed(&mut ugv, r#"{"event":"tick","time":50}"#);
    feed(&mut ugv, r#"{"event":"tikc","time":60}"#);
    assert_eq!(ugv.beliefs().now(), Duration::from_secs(60));
}

#[test]
fn missed_deadlines_have_the_documented_outcomes() {
    let overdue = |answers: &[Answer]| {
        let outcome = |answer: &Answer| match answer {
            Answer::Overdue { .. } => answer.to_json()["outcome"].as_str().map(ToOwned::to_owned),
            _ => None,
        };
        answers.iter().filter_map(outcome).collect::<Vec<_>>()
    };
    let tick = |time: u32| format!(r#"{{"event":"tick","time":{time}}}"#);
    // With acknowledgements, a reconfiguration is repeated, and then counts as failed.
    let mut ugv = with(|settings| settings);
    feed(&mut ugv, r#"{"event":"action_succeeded","action":1}"#);
    let mut ugv2 = control("ugv");
    ugv2.start();
    feed(&mut ugv2, r#"{"event":"acknowledged","effect":1}"#);
    feed(&mut ugv2, &status("c_kinect", "FALSE"));
    assert!(overdue(&feed(&mut ugv2, &tick(9))).is_empty());
    let answers = feed(&mut ugv2, &tick(11));
    assert!(overdue(&answers).contains(&"repeated".to_owned()), "{answers:?}");
    let answers = feed(&mut ugv2, &tick(22));
    assert!(overdue(&answers).contains(&"failed".to_owned()), "{answers:?}");
    assert!(!ugv2.beliefs().available().contains("fd_amcl_lidar"));
    // With reports of starts, a request is repeated, and then cancelled.
    assert_eq!(overdue(&feed(&mut ugv, &tick(200))), ["repeated"]);
    assert_eq!(overdue(&feed(&mut ugv, &tick(400))), ["cancelled"]);
    assert!(ugv.beliefs().cancelling());
    // Without any reports, the loop only reports missed deadlines, at increasing intervals.
    let mut silent = control("ugv");
    silent.start();
    let report_count: usize = (1..2000).map(|time| overdue(&feed(&mut silent, &tick(time * 60))).len()).sum();
    assert!((2..20).contains(&report_count), "{report_count}");
    assert!(!silent.beliefs().cancelling());
}

/// The report of the end can be lost, also if the robot has acknowledged the cancellation.
#[test]
fn an_acknowledged_cancellation_is_repeated_until_the_action_ends() {
    let mut control = crossroads("(road b c) (road b d)", "c");
    let mut restored = control.clone();
    control.start();
    feed(&mut control, r#"{"event":"acknowledged","effect":1}"#);
    let answers = feed(&mut control, r#"{"event":"goal_changed","goal":"(at d)"}"#);
    assert_eq!(kinds(&answers), ["plan_requested", "cancel_action"]);
    feed(&mut control, r#"{"event":"acknowledged","effect":2,"time":5}"#);
    restored.restore(&control.snapshot()).expect("the snapshot fits");
    for control in [&mut control, &mut restored] {
        let mut times = Vec::new();
        for time in 6..=60 {
            // A second acknowledgement does not begin another deadline.
            let event = if time % 7 == 0 { r#""acknowledged","effect":2"# } else { r#""tick""# };
            let answers = feed(control, &format!(r#"{{"event":{event},"time":{time}}}"#));
            if !answers.is_empty() {
                assert_eq!(kinds(&answers), ["overdue", "cancel_action"]);
                times.push(time);
            }
        }
        assert_eq!(times, [15, 25, 35, 55]);
        let answers = feed(control, r#"{"event":"action_cancelled","action":1}"#);
        assert!(kinds(&answers).contains(&"request_action".to_owned()), "{answers:?}");
        assert_eq!(control.beliefs().outstanding().map(|effect| effect.number).collect::<Vec<_>>(), [3]);
    }
}

#[test]
fn an_unfinished_search_is_repeated() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/ferry/mission.toml");
    let Setup { mission, settings, .. } = Setup::read(&manifest).expect("the mission is read");
    let settings = settings.with_time_limit(Duration::from_micros(1));
    let mut ferry = Loop::new(mission, settings).expect("a loop");
    let answers = ferry.start();
    assert_eq!(kinds(&answers), ["plan_requested", "plan_none"], "{answers:?}");
    let mut pauses = Vec::new();
    for _ in 0..4 {
        let before = ferry.beliefs().now();
        let due = ferry.due().expect("it is tried again");
        assert!(ferry.handle(&Observation::timer(), due.saturating_sub(Duration::from_secs(1))).is_empty());
        let answers = ferry.handle(&Observation::timer(), due);
        assert_eq!(kinds(&answers), ["plan_requested", "plan_none"], "{answers:?}");
        pauses.push(due.saturating_sub(before).as_secs());
    }
    assert_eq!(pauses, [20, 40, 80, 160]);
    assert_eq!(ferry.beliefs().lines(), 0, "time that passes is no line");
}

#[test]
fn safe_effects_do_not_wait_for_planning() {
    let mut ugv = with(|settings| settings.with_time_limit(None));
    let start = Instant::now();
    for _ in 0..50 {
        assert!(kinds(&react(&mut ugv, &status("c_kinect", "FALSE"))).len() < 4);
        react(&mut ugv, &status("c_kinect", "OK"));
    }
    assert!(ugv.has_agenda());
    assert!(start.elapsed() < Duration::from_secs(5));
}

/// Measures the processor time from an observation to its safe effect, in parallel to an endless search.
#[test]
#[ignore = "measures; only an optimised build is of interest"]
#[expect(clippy::print_stdout, reason = "figures are what this test is for")]
fn the_safe_effect_comes_within_five_milliseconds() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ferry = Setup::read(&root.join("tests/program/ferry/mission.toml")).expect("the mission is read");
    let ferry = Loop::new(ferry.mission, ferry.settings.with_time_limit(None)).expect("a loop");
    let thinker = ferry.thinker();
    let handle = thinker.handle();
    let search = std::thread::spawn(move || thinker.think());
    let mut late = Vec::new();
    for (mission, count) in [("camara_like", 1_000), ("ugv", 1_000), ("uuv", 1_000)] {
        let mut robot = control(mission);
        robot.start();
        feed(&mut robot, r#"{"event":"action_started","action":1}"#);
        let (mut times, mut walls) = (Vec::new(), Vec::new());
        for number in 0..count {
            let (_, step) = robot.beliefs().running().expect("an action is under way");
            let designs: Vec<&String> = step.configuration.iter().map(|(_, design)| design).collect();
            // Fallback: a design that is an argument of the step but serves no function of the action.
            let design =
                designs.get(number % designs.len().max(1)).copied().unwrap_or(&step.arguments[0]).clone();
            let line = |realisable: bool| {
                format!(r#"{{"event":"design_status","design":"{design}","realisable":{realisable}}}"#)
            };
            let start = (Instant::now(), ThreadTime::now());
            let answers = react(&mut robot, &line(false));
            walls.push(start.0.elapsed());
            times.push(start.1.elapsed());
            assert!(answers.iter().any(|answer| answer.effect().is_some()), "{mission}: {answers:?}");
            react(&mut robot, &line(true));
            if robot.beliefs().suspended() {
                robot.deliberate();
            }
        }
        let shares = |times: &mut Vec<Duration>| {
            times.sort_unstable();
            [times.len() / 2, times.len() * 999 / 1000, times.len() - 1].map(|place| times[place])
        };
        let ([median, tail, greatest], wall) = (shares(&mut times), shares(&mut walls));
        println!("{mission}: median {median:?}, p99.9 {tail:?}, greatest {greatest:?} of processor time");
        println!("{mission}: median {:?}, p99.9 {:?}, greatest {:?} of wall time", wall[0], wall[1], wall[2]);
        late.extend((tail > Duration::from_millis(5)).then_some((mission, tail)));
    }
    assert!(late.is_empty(), "{late:?}");
    assert!(!search.is_finished(), "the search has never ended");
    drop(handle);
    search.join().expect("it stops");
}
