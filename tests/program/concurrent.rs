//! Tests of `metaplan plan --concurrent`: output formats, agreement with `validate`, rejected options, claims
//! about chosen durations, and missions with designs.

use serde_json::json;

use crate::common::{Outcome, metaplan, metaplan_in};

const DOMAIN: &str = "(define (domain match) (:requirements :durative-actions :typing)
  (:types match fuse) (:predicates (light) (handfree) (unused ?m - match) (mended ?f - fuse))
  (:durative-action light :parameters (?m - match) :duration (= ?duration 5)
    :condition (and (at start (unused ?m)) (over all (light)))
    :effect (and (at start (not (unused ?m))) (at start (light)) (at end (not (light)))))
  (:durative-action mend :parameters (?f - fuse) :duration (= ?duration 2)
    :condition (and (at start (handfree)) (over all (light)))
    :effect (and (at start (not (handfree))) (at end (mended ?f)) (at end (handfree)))))";

const PROBLEM: &str = "(define (problem p) (:domain match) (:objects m1 - match f1 f2 - fuse)
  (:init (handfree) (unused m1)) (:goal (and (mended f1) (mended f2))))";

fn plan(domain: &str, problem: &str, arguments: &[&str]) -> Outcome {
    let directory = tempfile::tempdir().expect("a temporary directory");
    for (name, text) in [("domain.pddl", domain), ("problem.pddl", problem)] {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    let command = ["plan", "domain.pddl", "problem.pddl", "--concurrent"].iter().chain(arguments);
    metaplan_in(directory.path(), &command.copied().collect::<Vec<_>>(), "")
}

#[test]
fn plans_in_every_format() {
    let ipc = "0.000: (light m1)  [5.000]\n0.000: (mend f1)  [2.000]\n2.001: (mend f2)  [2.000]\n";
    assert_eq!(plan(DOMAIN, PROBLEM, &["--plan-format", "ipc"]).stdout, ipc);
    let plansys2 = format!("Solution Found\n{ipc}");
    assert_eq!(plan(DOMAIN, PROBLEM, &["--plan-format", "plansys2"]).stdout, plansys2);
    let fine = plan(DOMAIN, PROBLEM, &["--plan-format", "ipc", "--epsilon", "0.00025"]).stdout;
    assert_eq!(fine, ipc.replace("2.001", "2.00025"));
    let answer = plan(DOMAIN, PROBLEM, &["--format", "json"]).json();
    assert_eq!(
        (&answer["status"], &answer["cost"], &answer["makespan"]),
        (&json!("optimal"), &json!(5), &json!(5))
    );
    let starts: Vec<_> =
        answer["steps"].as_array().into_iter().flatten().map(|step| &step["start"]).collect();
    assert_eq!(starts, [&json!(0), &json!(0), &json!(2.001)]);
    let text = plan(DOMAIN, PROBLEM, &[]);
    assert_eq!(text.status, 0);
    assert!(text.stdout.ends_with("dominated or too expensive\nmakespan 5\n"), "{}", text.stdout);
}

#[test]
fn concurrency_can_be_required() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    for (name, text) in [("domain.pddl", DOMAIN), ("problem.pddl", PROBLEM)] {
        std::fs::write(directory.path().join(name), text).expect("a file");
    }
    let files = ["domain.pddl", "problem.pddl"];
    let sequential = metaplan_in(directory.path(), &[&["plan"][..], &files].concat(), "");
    assert_eq!(sequential.status, 10);
    let hint = "only sequences of actions were considered; with `--concurrent`, actions may overlap\n";
    assert!(sequential.stdout.contains(hint), "{sequential:#?}");
    let arguments = ["--concurrent", "--format", "json"];
    let answer = metaplan_in(directory.path(), &[&["plan"][..], &files, &arguments].concat(), "");
    let arguments = ["-", "--concurrent"];
    let valid =
        metaplan_in(directory.path(), &[&["validate"][..], &files, &arguments].concat(), &answer.stdout);
    assert_eq!((valid.status, valid.stdout.as_str()), (0, "valid, total time 5\n"));
}

#[test]
fn incompatible_options_are_refused() {
    let refused = |arguments: &[&str], status: i32, expected: &str| {
        let outcome = plan(DOMAIN, PROBLEM, arguments);
        assert_eq!(outcome.status, status, "{arguments:?}: {}", outcome.stderr);
        assert!(outcome.stderr.contains(expected), "{arguments:?}: {}", outcome.stderr);
    };
    refused(&["--certificate", "proof"], 2, "cannot be used with '--certificate <DIR>'");
    refused(&["--pareto", "total-time,total-cost"], 2, "cannot be used with '--pareto");
    refused(&["--epsilon", "0"], 2, "`0` is not a time above 0 such as 0.001");
    refused(&["--epsilon", "3"], 3, "`mend` that takes less time than the separation");
    refused(&["--minimize", "total-time", "--minimize", "total-time"], 2, "takes one objective");
}

#[test]
fn chosen_durations_are_proved_optimal_but_conditional_end_effects_are_not() {
    let bounded = DOMAIN.replace("(= ?duration 2)", "(>= ?duration 2)");
    let conditional = DOMAIN.replace("(at end (mended ?f))", "(at end (when (light) (mended ?f)))");
    for (domain, status) in [(bounded, 0), (conditional, 1)] {
        let outcome = plan(&domain, PROBLEM, &[]);
        assert_eq!(outcome.status, status, "{}", outcome.stderr);
    }
}

#[test]
fn missions_are_planned_with_separation() {
    for (mission, status, cost) in [
        ("ugv", "optimal", 408.3),
        ("ugv_plain", "optimal", 408.3),
        ("uuv", "optimal", 28.001),
        ("uuv_plain", "optimal", 28.001),
    ] {
        let file = format!("{}/missions/{mission}.toml", env!("CARGO_MANIFEST_DIR"));
        let answer = metaplan(&["plan", &file, "--concurrent", "--format", "json"]).json();
        assert_eq!((&answer["status"], &answer["cost"]), (&json!(status), &json!(cost)), "{mission}");
    }
}

/// `validate` needs the start of each action, and each duration that the planner has chosen, even if it is 0.
#[test]
fn plans_that_take_no_time_are_written_with_their_times() {
    let durative = |duration: &str| {
        format!("(:durative-action a :parameters () :duration {duration} :condition () :effect (at end (p)))")
    };
    let instantaneous = "(:action a :parameters () :effect (p)) (:action b :parameters () :effect (q))";
    let (a, b) = ("0.000: (a)  [0.000]\n", "0.000: (b)  [0.000]\n");
    let longest = "(:metric maximize (total-time))";
    for (actions, goal, metric, options, expected) in [
        (durative("(>= ?duration 0)"), "(p)", "", &["--concurrent"][..], a.to_owned()),
        (durative("()"), "(p)", "", &["--concurrent"], a.to_owned()),
        (durative("(<= ?duration 0)"), "(p)", longest, &[], a.to_owned()),
        (instantaneous.to_owned(), "(p) (q)", "", &["--concurrent"], [a, b].concat()),
        (instantaneous.to_owned(), "(p) (q)", "", &[], "(a)\n(b)\n".to_owned()),
    ] {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let domain = format!("(define (domain d) (:predicates (p) (q)) {actions})");
        let problem = format!("(define (problem n) (:domain d) (:init) (:goal (and {goal})) {metric})");
        for (name, text) in [("domain.pddl", domain), ("problem.pddl", problem)] {
            std::fs::write(directory.path().join(name), text).expect("a file");
        }
        let plan = ["plan", "domain.pddl", "problem.pddl", "--plan-format", "ipc"];
        let plan = metaplan_in(directory.path(), &[&plan[..], options].concat(), "");
        assert_eq!(plan.stdout, expected, "{actions}: {}", plan.stderr);
        let validate = ["validate", "domain.pddl", "problem.pddl", "-"];
        let verdict = metaplan_in(directory.path(), &[&validate[..], options].concat(), &plan.stdout);
        assert_eq!(verdict.status, 0, "{actions}: {}{}", verdict.stdout, verdict.stderr);
    }
}
