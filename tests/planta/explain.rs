//! Tests of `explain` and of the reasons of unsolvability in PLANTA's form: the facts of the problem and the effects of
//! actions determine which designs are realisable. Expected costs are the lengths of the shortest plans by hand and, for
//! the best plan, by brute force on the exported task.

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::brute::Task;
use crate::files::{Input, metaplan, real};
use crate::situations::extended;

/// The design `d` solves the function `f`. Broken designs are not realisable.
const KNOWLEDGE: &str = "Prefix(:=<http://e.org/k#>)\nPrefix(t:=<http://www.metacontrol.org/tomasys#>)
  Prefix(xsd:=<http://www.w3.org/2001/XMLSchema#>)\nOntology(<http://e.org/k>
  Declaration(Class(t:Function)) Declaration(Class(t:FunctionDesign)) Declaration(Class(:Broken))
  Declaration(ObjectProperty(t:solvesF)) Declaration(DataProperty(t:fd_realisability))
  ClassAssertion(t:Function :f) ClassAssertion(t:FunctionDesign :d) ObjectPropertyAssertion(t:solvesF :d :f)
  DLSafeRule(Body(ClassAtom(:Broken Variable(:x)))
    Head(DataPropertyAtom(t:fd_realisability Variable(:x) \"false\"^^xsd:boolean)))\n";
const USE: &str =
    "(:action use :parameters (?fd) :precondition (and (FunctionDesign ?fd) (inferred-SolvesF ?fd f)
    (not (inferred-Fd_realisability ?fd false_boolean))) :effect (done))\n";
const REPAIR: &str =
    "(:action repair :parameters (?fd) :precondition (Broken ?fd) :effect (not (Broken ?fd)))\n";

/// Writes a mission with the goal `done`, whose knowledge base has `axioms` in addition to [`KNOWLEDGE`].
fn mission(axioms: &str, actions: &str, init: &str) -> (TempDir, Input) {
    let directory = tempfile::tempdir().expect("a directory");
    let file = |name: &str, text: String| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).expect("written");
        path
    };
    let domain = "(define (domain d) (:requirements :adl :derived-predicates)
        (:predicates (done) (loaded) (ready ?fd))\n";
    let input = Input {
        domain: file("domain.pddl", format!("{domain}{actions})\n")),
        problem: file(
            "problem.pddl",
            format!("(define (problem p) (:domain d) (:init {init}) (:goal (done)))\n"),
        ),
        knowledge: file("kb.ofn", format!("{KNOWLEDGE}{axioms})\n")),
        directory: directory.path().to_owned(),
    };
    (directory, input)
}

fn answer(input: &Input, command: &str, options: &[&str], status: i32) -> Value {
    let outcome = metaplan(&input.arguments(command, &[options, &["--format", "json"]].concat()));
    assert_eq!(outcome.0, status, "{outcome:?}");
    serde_json::from_str(&outcome.1).expect("JSON")
}

/// Availability of a design; costs of the best plan, of that with the design as the only one, and of that without it.
fn explained(input: &Input, design: &str) -> (Value, Value) {
    let answer = answer(input, "explain", &[design], 0);
    assert_eq!(answer["complete"], true, "{answer:#}");
    let mission = input.mission();
    let (filled, _) = mission.filled().expect("a problem");
    let exported = Task::new(mission.domain(), &filled).explore(1_000).expect("few states");
    assert_eq!(answer["best"]["cost"].as_u64(), exported.least_steps.map(|steps| steps as u64), "{answer:#}");
    let costs = ["best", "alone", "without"].map(|plan| answer[plan]["cost"].clone());
    (json!([answer["available"], costs]), answer)
}

/// Actions of which the first breaks the design that the second needs.
fn loading_breaks() -> String {
    let load = "(:action load :parameters () :precondition () :effect (and (loaded) (Broken d)))\n";
    USE.replace("(FunctionDesign ?fd)", "(FunctionDesign ?fd) (loaded)") + load
}

#[test]
fn facts_and_effects_determine_realisability() {
    let odd = "Declaration(Class(:Odd)) EquivalentClasses(:Odd :Broken) ClassAssertion(:Odd :d)";
    let (repaired, broken) = (format!("{USE}{REPAIR}"), loading_breaks());
    for (axioms, actions, init, expected) in [
        ("", &repaired, "", json!([true, [1, 1, null]])),
        ("", &repaired, "(Broken d)", json!([false, [2, 1, null]])),
        ("ClassAssertion(:Broken :d)", &repaired, "", json!([false, [2, 1, null]])),
        ("", &broken, "", json!([true, [null, 2, null]])),
        // PLANTA's form does not translate the equivalence.
        (odd, &repaired, "", json!([true, [1, 1, null]])),
    ] {
        let (_directory, input) = mission(axioms, actions, init);
        let (actual, answer) = explained(&input, "d");
        assert_eq!(actual, expected, "{axioms} {init}: {answer:#}");
        // The knowledge base alone has another conclusion, and no change of the problem is examined.
        let is_examined = answer["unexamined"] == json!([]);
        assert_eq!(is_examined, axioms != odd && init.is_empty(), "{answer:#}");
    }
}

#[test]
fn designs_that_the_problem_makes_unrealisable_are_reasons() {
    let broken = loading_breaks();
    let cases = [("", USE, "(Broken d)"), ("ClassAssertion(:Broken :d)", USE, ""), ("", &broken, "")];
    for (axioms, actions, init) in cases {
        let (_directory, input) = mission(axioms, actions, init);
        let answer = answer(&input, "plan", &[], 10);
        assert_eq!(answer["blocking"], json!(["d"]), "{axioms} {init}: {answer:#}");
    }
}

#[test]
fn spellings_of_a_boolean_are_one_value() {
    let unrealisable = "ClassAssertion(t:FunctionDesign :e) ObjectPropertyAssertion(t:solvesF :e :f)
      DataPropertyAssertion(t:fd_realisability :e \"0\"^^xsd:boolean)";
    let (_directory, input) = mission(unrealisable, USE, "(Broken d)");
    let answer = answer(&input, "plan", &[], 10);
    assert_eq!(answer["blocking"], json!(["d", "e"]), "{answer:#}");
}

/// The design `r` is ready, but `d` has to be prepared.
#[test]
fn rivals_keep_their_other_functions() {
    let axioms = "ClassAssertion(t:Function :g) ClassAssertion(t:FunctionDesign :r) ObjectPropertyAssertion(t:solvesF :r :g)
      Declaration(ObjectProperty(:serves)) SubObjectPropertyOf(:serves t:solvesF) ObjectPropertyAssertion(:serves :r :f)";
    let actions = "(:action prepare :parameters (?fd) :precondition (FunctionDesign ?fd) :effect (ready ?fd))
      (:action use :parameters (?a ?b) :precondition (and (FunctionDesign ?a) (FunctionDesign ?b)
        (inferred-SolvesF ?a f) (inferred-SolvesF ?b g) (ready ?a)
        (not (inferred-Fd_realisability ?a false_boolean)) (not (inferred-Fd_realisability ?b false_boolean)))
        :effect (done))";
    let (_directory, input) = mission(axioms, actions, "(ready r)");
    for (design, expected) in [("d", json!([true, [1, 2, 1]])), ("r", json!([true, [1, 1, null]]))] {
        let (actual, answer) = explained(&input, design);
        assert_eq!(actual, expected, "{design}: {answer:#}");
    }
}

/// PLANTA's problem has a measurement, which the knowledge base does not have.
#[test]
fn measurements_of_the_problem_rule_designs_out() {
    let Some(real) = real() else { return };
    let directory = tempfile::tempdir().expect("a directory");
    let mut input = extended(&real);
    let text = std::fs::read_to_string(&input.problem).expect("a problem");
    let line = ";(qa_has_value obs_water_visibility 2.5_decimal)";
    assert!(text.contains(line), "{text}");
    input.problem = directory.path().join("problem.pddl");
    let text = text.replace(line, "(qa_has_value obs_water_visibility 1.5_decimal)");
    std::fs::write(&input.problem, text).expect("written");
    let planned = answer(&input, "plan", &[], 0);
    let explained = answer(&input, "explain", &["fd_spiral_high"], 0);
    assert_eq!(json!([planned["cost"], false]), json!([explained["best"]["cost"], explained["available"]]));
    assert_eq!((&explained["used"], &explained["complete"]), (&json!([]), &json!(true)), "{explained:#}");
    let arguments = |answer: &Value| -> Vec<Value> {
        let steps = answer["steps"].as_array().expect("steps").iter();
        steps.map(|step| step["arguments"].clone()).collect()
    };
    assert_eq!(arguments(&planned), arguments(&explained["best"]), "{explained:#}");
    assert!(explained["alone"].to_string().contains("fd_spiral_high"), "{explained:#}");
}

#[test]
fn reports_state_the_availability_that_follows_from_the_axioms() {
    let (directory, input) = mission("", &format!("{USE}{REPAIR}"), "");
    let page = directory.path().join("report.html").display().to_string();
    let outcome = metaplan(&input.arguments("report", &["--set", "Broken d=true", "--output", &page]));
    assert_eq!(outcome.0, 0, "{outcome:?}");
    let text = std::fs::read_to_string(&page).expect("a page");
    assert!(text.contains("d is not available any more"), "{text}");
    // In the list of changes, and in the list of designs.
    assert_eq!(text.matches("the axioms of the domain rule it out").count(), 2, "{text}");
}
