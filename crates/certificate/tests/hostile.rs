//! Adversarial documents. Large ones are checked, or rejected with a message that names the
//! exceeded size; wrong ones are rejected. The stack of a test has 2 MB.

use std::fmt::Write as _;

use metaplan_certificate::{
    Cause, Claimed, Difference, Faithful, Fault, GroundTask, LITERAL_LIMIT, check, faithful, witness,
};
use num_rational::BigRational;
use pddl::Source;
use pddl::ast::{Domain, Problem};

fn read(domain: &str, problem: &str) -> (Domain, Problem) {
    let (domain, problem, _) =
        pddl::read(&Source::new("d", domain), &Source::new("p", problem)).expect("PDDL");
    (domain, problem)
}

/// Creates a task in which each variable has a single atom. Operators are given by name, arguments,
/// optionally the variable that is required to be true, and the variable that becomes true.
fn task(objects: &str, atoms: &[&str], operators: &[(&str, &str, Option<usize>, usize)]) -> String {
    let variables: Vec<String> = atoms.iter().map(|atom| format!(r#"["{atom}", "none of these"]"#)).collect();
    let values: Vec<&str> = atoms.iter().map(|_| "1").collect();
    let mut schemas: Vec<String> = Vec::new();
    let mut all: Vec<String> = Vec::new();
    for (name, arguments, needs, gives) in operators {
        schemas.push(format!("\"{name}\""));
        let needs = needs.map_or_else(String::new, |variable| format!("[{variable}, 0]"));
        all.push(format!(
            r#"{{"schema": {}, "arguments": [{arguments}], "uses": 0, "exclusions": 0, "condition": {{"facts": [{needs}]}},
              "effects": [[{gives}, 0]], "cost": {{"constant": 1}}, "duration": {{"constant": 0}}}}"#,
            all.len()
        ));
    }
    format!(
        r#"{{"format": "metaplan-task/1", "objects": [{objects}], "schemas": [{}], "variables": [{}], "basic": {},
          "values": [{}], "numbers": [], "fluents": [], "number_scale": 1, "slots": [], "uses": [[]], "exclusions": [[]],
          "tables": [], "operators": [{}], "axioms": [], "goal": {{"facts": [[1, 0]]}},
          "objective": {{"scale": 1, "offset": 0, "maximize": false}}, "time_scale": 1}}"#,
        schemas.join(", "),
        variables.join(", "),
        atoms.len(),
        values.join(", "),
        all.join(", ")
    )
}

/// Compares a task that reaches `(b)` in two steps with PDDL files for this task, which contain
/// additional declarations, actions and rules (`more`), objects and facts.
fn compare(declarations: &str, more: &str, objects: &str, facts: &str) -> Faithful {
    let domain = format!(
        "(define (domain d) (:predicates (a) (b) {declarations}) {more}
          (:action go :parameters () :precondition (a) :effect (b)) (:action on :parameters () :precondition () :effect (a)))"
    );
    let problem =
        format!("(define (problem p) (:domain d) (:objects {objects}) (:init {facts}) (:goal (b)))");
    let (domain, problem) = read(&domain, &problem);
    let task = task("", &["(a)", "(b)"], &[("go", "", Some(0), 1), ("on", "", None, 0)]);
    match witness(&domain, &problem, &task, &|| false) {
        Ok(witness) => faithful(&domain, &problem, &task, &witness, &|| false),
        Err(verdict) => verdict,
    }
}

fn names(prefix: &str, count: usize) -> String {
    (0..count).fold(String::new(), |mut text, number| {
        let _ = write!(text, " {prefix}{number}");
        text
    })
}

fn chain(length: usize) -> String {
    let mut facts = format!("(end o{length})");
    for number in 0..length {
        let _ = write!(facts, " (next o{number} o{})", number + 1);
    }
    facts
}

#[test]
fn long_chains_of_derived_atoms_are_unfolded() {
    let length = 5_000;
    let declarations = "(next ?x ?y) (end ?x) (p ?x)";
    let more = "(:derived (p ?x) (or (and (end ?x) (a)) (exists (?y) (and (next ?x ?y) (p ?y)))))
      (:action zz :parameters () :precondition (p o0) :effect (a))";
    let found = compare(declarations, more, &names("o", length + 1), &chain(length));
    assert!(matches!(found, Faithful::Yes { instances: 3, .. }), "{found:?}");
}

#[test]
fn conditions_that_nest_too_deeply_are_rejected() {
    let length = 5_000;
    let declarations = "(next ?x ?y) (end ?x) (p ?x) (q ?x)";
    let more = "(:derived (p ?x) (or (and (end ?x) (a)) (exists (?y) (and (next ?x ?y) (or (a) (and (q ?x) (p ?y)))))))
      (:action q :parameters (?x) :precondition (q ?x) :effect (q ?x))
      (:action zz :parameters () :precondition (p o0) :effect (a))";
    let facts = (0..length).fold(chain(length), |text, number| format!("{text} (q o{number})"));
    let found = compare(declarations, more, &names("o", length + 1), &facts);
    let Faithful::Undecided(cause) = &found else { panic!("{found:?}") };
    let said = "the comparison of the task with the files ends at 300 levels of a condition";
    assert!(cause.to_string().starts_with(said), "{cause}");
}

#[test]
fn long_lists_of_names_are_rejected_or_compared() {
    let many = names("?x", 60_000);
    let quantified =
        |word: &str| format!("(:action zz :parameters () :precondition ({word} ({many}) (a)) :effect (a))");
    for more in [
        quantified("exists"),
        quantified("forall"),
        format!("(:derived (p{many}) (a)) (:action zz :parameters () :precondition (a) :effect (a))"),
    ] {
        let found = compare(&format!("(p{many})"), &more, "o", "");
        let Faithful::Undecided(cause) = &found else { panic!("{found:?}") };
        let said = "ends at 10000 variables of one quantifier or rule, of which one has 60000";
        assert!(cause.to_string().ends_with(said), "{cause}");
    }
    let more = format!("(:action zz :parameters ({many}) :precondition (a) :effect (a))");
    let found = compare("", &more, "o", "");
    assert!(matches!(found, Faithful::Yes { instances: 3, .. }), "{found:?}");
    // Two objects give too many instances; the check must reject them without enumeration.
    let found = compare("", &more, "o o2", "");
    assert!(matches!(found, Faithful::Undecided(Cause::TooMany { .. })), "{found:?}");
}

#[test]
fn long_chains_of_derived_predicates_are_compared() {
    let count = 3_000;
    let mut declarations = String::new();
    let mut more = String::new();
    for number in 0..=count {
        let _ = write!(declarations, "(p{number})");
        let body = if number == count { "(a)".to_owned() } else { format!("(p{})", number + 1) };
        let _ = write!(more, "(:derived (p{number}) {body})");
    }
    let found = compare(&declarations, &more, "", "");
    assert!(matches!(found, Faithful::Yes { .. }), "{found:?}");
}

/// The combinations of designs do not dominate each other: of two combinations, one costs less, and
/// the other has a greater sum in the condition.
#[test]
fn many_non_dominated_design_combinations_are_rejected() {
    let slots = 19;
    let task = task("\"x\", \"y\"", &["(a)", "(b)"], &[("go", "", Some(0), 1), ("on", "", None, 0)]);
    let mut task: serde_json::Value = serde_json::from_str(&task).expect("JSON");
    task["slots"] = serde_json::json!(vec![[0, 1]; slots]);
    task["uses"] = serde_json::json!([[], (0..slots).map(|slot| (slot, [0, 1])).collect::<Vec<_>>()]);
    let powers = (0..slots).map(|slot| [0, 1 << slot]);
    task["tables"] = powers.collect();
    task["numbers"] = serde_json::json!([0]);
    task["fluents"] = serde_json::json!(["(n)"]);
    let tables: Vec<(Vec<usize>, usize)> = (0..slots).map(|slot| (vec![slot], slot)).collect();
    let operator = &mut task["operators"][0];
    operator["uses"] = 1.into();
    operator["cost"]["tables"] = serde_json::json!(tables);
    operator["condition"]["comparisons"] =
        serde_json::json!([{"factors": [], "quantity": {"constant": 0, "tables": tables}}]);
    let argument =
        r#"{"format": "metaplan-argument/1", "potentials": [], "needs": [], "labels": [[[1, 1], [0], 0]]}"#;
    let fault = check(&task.to_string(), argument, None).expect_err("too many");
    let Fault::Form { reason, .. } = &fault else { panic!("{fault}") };
    assert!(reason.starts_with("an operator with 524288 combinations of designs"), "{reason}");
}

#[test]
fn a_slot_that_is_used_twice_is_rejected() {
    let task = task("\"x\", \"y\"", &["(a)", "(b)"], &[("go", "", Some(0), 1), ("on", "", None, 0)]);
    let mut task: serde_json::Value = serde_json::from_str(&task).expect("JSON");
    task["slots"] = serde_json::json!([[0, 1]]);
    task["uses"] = serde_json::json!([[], [(0, [0, 1]), (0, [0, 1])]]);
    let argument = r#"{"format": "metaplan-argument/1", "potentials": [], "needs": [], "labels": []}"#;
    let fault = check(&task.to_string(), argument, None).expect_err("a slot twice");
    assert!(fault.to_string().ends_with("a slot that is used twice"), "{fault}");
}

#[test]
fn formulas_do_not_cover_derived_variables_without_rules() {
    let task = task("", &["(a)", "(b)", "(c)"], &[("go", "", Some(0), 1), ("on", "", None, 0)]);
    let argument = r#"{"format": "metaplan-argument/1", "potentials": [{"pattern": [], "values": [0]}], "needs": [],
      "labels": []}"#;
    let claim = BigRational::from_integer(2.into());
    let reason = |task: &str| {
        let task = GroundTask::read(task).expect("a task");
        let claimed = Claimed::read(&task, argument, Some(&claim)).expect("an argument");
        let steps = claimed.step_bounds(&|| false).expect("a bound").spent.expect("a bound");
        claimed.formula(steps, LITERAL_LIMIT, &|| false).err()
    };
    assert_eq!(reason(&task), None);
    let derived = task.replace(r#""basic": 3"#, r#""basic": 2"#);
    assert_eq!(reason(&derived).as_deref(), Some("derived predicates are not covered"));
}

/// Checks the need of 8 for two walking steps with a battery of 7. Each step uses 4 and requires at
/// least `required`.
fn walk(required: i32) -> Result<(), Fault> {
    let task = format!(
        r#"{{"format": "metaplan-task/1", "objects": [], "schemas": ["walk"],
          "variables": [["(s)", "(t)", "(u)", "none of these"]], "basic": 1, "values": [0], "numbers": [7], "fluents": ["(battery)"],
          "number_scale": 1, "slots": [], "uses": [[]], "exclusions": [[]], "tables": [], "operators": [{}, {}],
          "axioms": [], "goal": {{"facts": [[0, 2]]}},
          "objective": {{"scale": 1, "offset": 0, "maximize": false}}, "time_scale": 1}}"#,
        step(0, required),
        step(1, required)
    );
    // From `(s)`, two steps are required, which use 8.
    let argument = r#"{"format": "metaplan-argument/1", "potentials": [],
      "needs": [{"number": 0, "pattern": [0], "values": [8, 4, 0, null]}], "labels": []}"#;
    check(&task, argument, None).map(|_| ())
}

fn step(from: u32, required: i32) -> String {
    format!(
        r#"{{"schema": 0, "arguments": [], "uses": 0, "exclusions": 0, "condition": {{"facts": [[0, {from}]],
          "comparisons": [{{"factors": [[0, 1]], "quantity": {{"constant": {}}}}}]}}, "effects": [[0, {}]],
          "changes": [[0, {{"factors": [[0, 1]], "quantity": {{"constant": -4}}}}]],
          "cost": {{"constant": 1}}, "duration": {{"constant": 0}}}}"#,
        -required,
        from + 1
    )
}

/// With a battery of 7, two steps are impossible if each step requires at least the charge that it
/// uses. If steps require less, the charge may fall below 0 and the need is not proved.
#[test]
fn needs_are_proved_only_if_each_step_requires_at_least_its_use() {
    for required in [4, 5, 100] {
        assert_eq!(walk(required), Ok(()), "{required}");
    }
    for required in [3, 0, -1] {
        assert!(matches!(walk(required), Err(Fault::Bound { table: "need", .. })), "{required}");
    }
}

/// `(total-cost)` is 0 unless `:init` sets it. So `x` takes no time, and its condition over all never applies.
#[test]
fn a_duration_of_total_cost_without_a_value_is_zero() {
    let action = |duration: &str| {
        format!(
            "(define (domain d) (:predicates (a) (p))
              (:durative-action x :parameters () :duration (= ?duration {duration})
                :condition (over all (p)) :effect (at end (a))))"
        )
    };
    let nothing =
        task("", &["(a)"], &[]).replace(r#""goal": {"facts": [[1, 0]]}"#, r#""goal": {"facts": [[0, 0]]}"#);
    for (duration, is_executable) in [("(total-cost)", true), ("0", true), ("(+ 1 (total-cost))", false)] {
        let problem = "(define (problem p) (:domain d) (:init) (:goal (a)))";
        let (domain, problem) = read(&action(duration), problem);
        let witness = witness(&domain, &problem, &nothing, &|| false).expect("a witness");
        let verdict = faithful(&domain, &problem, &nothing, &witness, &|| false);
        let is_missed = matches!(verdict, Faithful::No(Difference::NoOperatorFor { .. }));
        assert_eq!(is_missed, is_executable, "{duration}: {verdict:?}");
    }
}

/// A duration at end is that of the state after the start effects, in which `x` is 5. The witness contains only the
/// values of `x` between actions.
#[test]
fn durations_at_end_over_changing_functions_are_rejected() {
    let duration = ["(at end (= ?duration (x)))", "(and (>= ?duration 1) (at end (<= ?duration (x))))"];
    for (duration, effect) in [(duration[0], "(assign (x) 5)"), (duration[1], "(increase (x) 5)")] {
        let domain = format!(
            "(define (domain d) (:predicates (done)) (:functions (x) (y))
              (:durative-action a :parameters () :duration {duration} :condition ()
                :effect (and (at start {effect}) (at end (assign (x) 0)) (at end (done)))))"
        );
        let verdict = |domain: &str| {
            let problem = "(define (problem p) (:domain d) (:init (= (x) 0) (= (y) 0)) (:goal (done)))";
            let (domain, problem) = read(domain, problem);
            let nothing = task("", &["(done)"], &[]);
            let nothing = nothing.replace(r#""goal": {"facts": [[1, 0]]}"#, r#""goal": {"facts": [[0, 0]]}"#);
            let witness = r#"{"format": "metaplan-witness/1", "atoms": [], "numbers": [["(x)", "0", "0"]]}"#;
            faithful(&domain, &problem, &nothing, witness, &|| false)
        };
        let is_unsupported =
            |verdict: &Faithful| matches!(verdict, Faithful::Undecided(Cause::Unsupported { .. }));
        let changing = verdict(&domain);
        assert!(is_unsupported(&changing), "{changing:?}");
        // No action changes `y`.
        let constant = verdict(&domain.replace("?duration (x)", "?duration (y)"));
        assert!(!is_unsupported(&constant), "{constant:?}");
    }
}

const STAGES: &str = "(define (domain d) (:predicates (idle) (loading) (loaded) (done))
  (:action begin :parameters () :precondition (idle) :effect (and (not (idle)) (loading)))
  (:action load :parameters () :precondition (loading) :effect (and (not (loading)) (loaded)))
  (:action finish :parameters () :precondition (loaded) :effect (and (not (loaded)) (idle) (done))))";

/// Creates a task for [`STAGES`] whose first variable contains only two of the three mutually
/// exclusive atoms.
fn stages() -> String {
    let operator = |schema: u32, facts: &str, effects: &str| {
        format!(
            r#"{{"schema": {schema}, "arguments": [], "uses": 0, "exclusions": 0, "condition": {{"facts": [{facts}]}},
              "effects": [{effects}], "cost": {{"constant": 1}}, "duration": {{"constant": 0}}}}"#
        )
    };
    format!(
        r#"{{"format": "metaplan-task/1", "objects": [], "schemas": ["begin", "load", "finish"],
          "variables": [["(loading)", "(loaded)", "none of these"], ["(idle)", "none of these"], ["(done)", "none of these"]],
          "basic": 3, "values": [2, 0, 1], "numbers": [], "fluents": [], "number_scale": 1, "slots": [], "uses": [[]],
          "exclusions": [[]], "tables": [], "operators": [{}, {}, {}], "axioms": [], "goal": {{"facts": [[2, 0]]}},
          "objective": {{"scale": 1, "offset": 0, "maximize": false}}, "time_scale": 1}}"#,
        operator(0, "[1, 0]", "[0, 0], [1, 1]"),
        operator(1, "[0, 0]", "[0, 1]"),
        operator(2, "[0, 1]", "[0, 2], [1, 0], [2, 0]")
    )
}

#[test]
fn a_mutex_group_proves_its_subsets_exclusive() {
    let problem = "(define (problem p) (:domain d) (:init (idle)) (:goal (done)))";
    let (domain, problem) = read(STAGES, problem);
    let made = witness(&domain, &problem, &stages(), &|| false).expect("a witness");
    let group = r#","exclusive":[["(idle)","(loading)","(loaded)"]]"#;
    assert!(made.contains(group), "{made}");
    let compared = |witness: &str| faithful(&domain, &problem, &stages(), witness, &|| false);
    assert_eq!(compared(&made), Faithful::Yes { instances: 3, idle: 0, timed: false });
    // Without the group, the check is undecided and reports no difference.
    let found = compared(&made.replace(group, ""));
    let Faithful::Undecided(cause @ Cause::Exclusion { .. }) = &found else { panic!("{found:?}") };
    assert!(cause.to_string().starts_with("cannot tell whether the ground task"), "{cause}");
    // Groups that are not exclusive are rejected, even in addition to a valid group.
    for wrong in [r#""(idle)","(done)""#, r#""(loading)","(done)""#] {
        let found = compared(
            &made.replace(group, &format!(r#","exclusive":[["(idle)","(loading)","(loaded)"],[{wrong}]]"#)),
        );
        assert!(matches!(found, Faithful::No(Difference::Exclusive { .. })), "{wrong}: {found:?}");
    }
}

#[test]
fn a_group_violated_by_the_initial_state_is_rejected() {
    let problem = "(define (problem p) (:domain d) (:init (idle) (done)) (:goal (done)))";
    let (domain, problem) = read(STAGES, problem);
    let made = witness(&domain, &problem, &stages(), &|| false).expect("a witness");
    let wrong = made.replacen('}', r#","exclusive":[["(idle)","(done)"]]}"#, 1);
    let wrong = if made.contains("exclusive") {
        made.replace(r#"["(idle)","(loading)","(loaded)"]"#, r#"["(idle)","(done)"]"#)
    } else {
        wrong
    };
    let found = faithful(&domain, &problem, &stages(), &wrong, &|| false);
    assert!(matches!(found, Faithful::No(Difference::Exclusive { .. })), "{found:?}");
}

#[test]
fn numbers_with_too_many_digits_are_rejected() {
    let task = task("", &["(a)", "(b)"], &[("go", "", Some(0), 1)]);
    let task = task.replace(r#""time_scale": 1"#, &format!(r#""time_scale": {}"#, "9".repeat(10_000_000)));
    let argument = r#"{"format": "metaplan-argument/1", "potentials": [], "needs": [], "labels": []}"#;
    let claim = BigRational::from_integer(1.into());
    let fault = check(&task, argument, Some(&claim)).expect_err("too long");
    assert!(fault.to_string().contains("a number of 10000000 digits, more than 10000"), "{fault}");
}

/// A fault describes the claim: every goal state refutes that there is no plan, independently of its cost.
#[test]
fn a_goal_state_refutes_each_claim_in_its_words() {
    let task = task("", &["(a)", "(b)"], &[]).replace(r#""values": [1, 1]"#, r#""values": [1, 0]"#);
    let argument =
        r#"{"format": "metaplan-argument/1", "potentials": [], "needs": [], "labels": [[[1, 0], [], 0]]}"#;
    let one = BigRational::from_integer(1.into());
    for (claim, expected) in [
        (Some(&one), "label 0 is a goal state, and cheaper than claimed"),
        (None, "label 0 is a goal state, but the claim is that there is no plan"),
    ] {
        let fault = check(&task, argument, claim).expect_err("a goal state");
        assert_eq!(fault.to_string(), expected);
    }
}
