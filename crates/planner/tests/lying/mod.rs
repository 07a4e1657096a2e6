//! Certificates as a faulty grounder would write them: operators, effects, conditions and numbers of the
//! ground task are changed, and possibly the witness (the over-approximation of the reachable states) too. A
//! changed certificate that the comparison with the files accepts must not prove a false claim.
//!
//! The truth is determined by an independent search over the written task, based on the specification of
//! `metaplan-task/1`. A changed task must not be accepted if it has no plan, or only more expensive plans,
//! although the files have a plan with the known optimal cost.

mod search;
mod tasks;

use certificate::{Cause, Difference, Faithful, check, faithful, witness};
use metaplan_planner::{Certificate, Config, GroundConfig, Limits, certify, ground, optimize};
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use pddl::{Source, read};
use serde_json::{Value, json};

use search::{Best, optimum};
use tasks::{Example, TASKS};

/// Maximum number of changed tasks that are tested for each task, in addition to all that omit an operator or
/// change a cost.
const MUTANTS: usize = 300;

fn files(example: &Example) -> (Domain, Problem) {
    let name = example.name;
    let (domain, problem, _) =
        read(&Source::new("domain", example.domain), &Source::new("problem", example.problem))
            .unwrap_or_else(|errors| panic!("{name}: {errors:?}"));
    (domain, problem)
}

fn fraction(text: &str) -> BigRational {
    text.parse().unwrap_or_else(|_| panic!("{text} is not a fraction"))
}

/// Returns the certificate of an example, and the text of its witness (the over-approximation of the
/// reachable states).
fn certified(example: &Example) -> (Certificate, String) {
    let (domain, problem) = files(example);
    let task = ground(&domain, &problem, &GroundConfig::default())
        .unwrap_or_else(|errors| panic!("{}: {errors:?}", example.name));
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    let cost = solution.plan.as_ref().map(|plan| &plan.cost);
    let cost = cost.map(metaplan_planner::Exact::to_rational);
    assert_eq!(cost, example.optimum.map(fraction), "{}", example.name);
    let certificate = certify(&task, &solution, &Limits::none())
        .unwrap_or_else(|reason| panic!("{}: {reason}", example.name));
    let made = witness(&domain, &problem, &certificate.task, &|| false)
        .unwrap_or_else(|verdict| panic!("{}: {verdict:?}\n{}", example.name, certificate.task));
    (certificate, made)
}

fn compared(example: &Example, task: &str, witness: &str) -> Faithful {
    compared_with(&files(example), task, witness)
}

fn compared_with((domain, problem): &(Domain, Problem), task: &str, witness: &str) -> Faithful {
    faithful(domain, problem, task, witness, &|| false)
}

#[test]
fn true_certificates_are_accepted() {
    for example in TASKS {
        let (certificate, witness) = certified(example);
        let found = compared(example, &certificate.task, &witness);
        let context = format!("{}\n{}\n{witness}", example.name, certificate.task);
        assert!(matches!(found, Faithful::Yes { .. }), "{found:?} {context}");
        let claim = example.optimum.map(fraction);
        let checked = check(&certificate.task, &certificate.argument, claim.as_ref());
        assert!(checked.is_ok(), "{checked:?} {context}");
        let best = claim.map_or(Best::NoPlan, Best::Cost);
        assert_eq!(optimum(&certificate.task), Some(best), "{context}");
    }
}

/// Collects changes of each part of a document: the JSON pointer and the new value (`None` to
/// remove the element of an array).
fn changes(value: &Value, path: &str, found: &mut Vec<(String, Option<Value>)>) {
    match value {
        Value::Array(elements) => {
            for (position, element) in elements.iter().enumerate() {
                let own = format!("{path}/{position}");
                found.push((own.clone(), None));
                changes(element, &own, found);
            }
        }
        Value::Object(fields) => {
            for (name, field) in fields {
                changes(field, &format!("{path}/{name}"), found);
            }
        }
        Value::Number(number) => {
            let old = number.as_i64().expect("an integer");
            for new in [old + 1, old - 1, 0, 2 * old] {
                found.push((path.to_owned(), Some(json!(new))));
            }
        }
        Value::Bool(flag) => found.push((path.to_owned(), Some(json!(!flag)))),
        Value::String(text) => {
            found.push((path.to_owned(), Some(Value::Null)));
            if let Ok(number) = text.parse::<i64>() {
                found.push((path.to_owned(), Some(json!((number + 1).to_string()))));
                found.push((path.to_owned(), Some(json!((number - 1).to_string()))));
            }
        }
        Value::Null => found.push((path.to_owned(), Some(json!("0")))),
    }
}

fn changed(document: &Value, (path, new): &(String, Option<Value>)) -> Value {
    let mut document = document.clone();
    if let Some(new) = new {
        *document.pointer_mut(path).expect("the place") = new.clone();
    } else {
        let (above, position) = path.rsplit_once('/').expect("a place");
        let position: usize = position.parse().expect("a position");
        document.pointer_mut(above).and_then(Value::as_array_mut).expect("an array").remove(position);
    }
    document
}

/// Returns `true` if an accepted task would prove a false claim about the files.
fn lies(example: &Example, task: &str) -> bool {
    let Some(truth) = example.optimum.map(fraction) else { return false };
    match optimum(task) {
        Some(Best::Cost(cost)) if example.problem.contains("maximize") => cost < truth,
        Some(Best::Cost(cost)) => cost > truth,
        Some(Best::NoPlan) => true,
        // The changed task is invalid, or too large to decide.
        None => false,
    }
}

#[derive(Debug, Default)]
struct Count {
    refused: usize,
    harmless: usize,
    lies: usize,
}

fn judge((example, files): (&Example, &(Domain, Problem)), task: &str, witness: &str, count: &mut Count) {
    let accepted = matches!(compared_with(files, task, witness), Faithful::Yes { .. });
    let lie = lies(example, task);
    assert!(!(accepted && lie), "{}: a lie is accepted\n{task}\n{witness}", example.name);
    count.refused += usize::from(!accepted);
    count.harmless += usize::from(accepted);
    count.lies += usize::from(lie);
}

#[test]
fn no_change_of_the_task_makes_a_false_claim_verified() {
    let mut count = Count::default();
    for example in TASKS {
        let files = files(example);
        let (certificate, witness) = certified(example);
        let task: Value = serde_json::from_str(&certificate.task).expect("JSON");
        let mut all = Vec::new();
        changes(&task, "", &mut all);
        let every = all.len().div_ceil(MUTANTS);
        let is_operator = |path: &str| path.matches('/').count() == 2 && path.starts_with("/operators/");
        for (position, change) in all.iter().enumerate() {
            if position % every == 0 || is_operator(&change.0) || change.0.contains("cost") {
                judge((example, &files), &changed(&task, change).to_string(), &witness, &mut count);
            }
        }
    }
    assert!(count.lies >= 200 && count.harmless >= 100, "{count:?}");
}

/// Shifts constants and waits by the smallest amount, half a unit or a unit of time, and omits
/// effects.
#[test]
fn no_shift_of_a_time_makes_a_false_claim_verified() {
    let mut count = Count::default();
    let is_timed = |example: &&Example| {
        let mut rest = example.problem.split("(at ").skip(1);
        rest.any(|rest| rest.starts_with(|first: char| first.is_ascii_digit()))
    };
    for example in TASKS.iter().filter(is_timed).filter(|example| example.optimum.is_some()) {
        let files = files(example);
        let (certificate, witness) = certified(example);
        let task: Value = serde_json::from_str(&certificate.task).expect("JSON");
        let scale = task["number_scale"].as_i64().expect("a scale");
        let mut all = Vec::new();
        changes(&task["operators"], "/operators", &mut all);
        // Only every third change is tested, so that the test takes seconds.
        for (path, new) in all.iter().step_by(3) {
            let is_time = path.ends_with("/quantity/constant") || path.ends_with("/wait");
            if is_time && new.is_some() {
                let old = task.pointer(path).and_then(Value::as_i64).expect("a number");
                for shift in [1, -1, scale, -scale / 2] {
                    let mutant = changed(&task, &(path.clone(), Some(json!(old + shift))));
                    judge((example, &files), &mutant.to_string(), &witness, &mut count);
                }
            } else if new.is_none() && path.contains("/effects/") {
                judge(
                    (example, &files),
                    &changed(&task, &(path.clone(), None)).to_string(),
                    &witness,
                    &mut count,
                );
            }
        }
    }
    assert!(count.lies >= 15 && count.harmless >= 50, "{count:?}");
}

/// The grounder omits an operator, and changes the witness (the over-approximation of the reachable states)
/// to hide this.
#[test]
fn no_change_of_the_witness_hides_that_an_operator_is_missing() {
    let mut count = Count::default();
    for example in TASKS {
        let files = files(example);
        let (certificate, witness) = certified(example);
        let task: Value = serde_json::from_str(&certificate.task).expect("JSON");
        let witness: Value = serde_json::from_str(&witness).expect("JSON");
        let mut all = Vec::new();
        changes(&witness, "", &mut all);
        let operators = task["operators"].as_array().expect("operators").len();
        for operator in 0..operators {
            let lying = changed(&task, &(format!("/operators/{operator}"), None)).to_string();
            for change in &all {
                judge((example, &files), &lying, &changed(&witness, change).to_string(), &mut count);
            }
        }
    }
    assert!(count.lies >= 200, "{count:?}");
}

#[test]
fn each_difference_has_its_own_cause() {
    let example = TASKS.iter().find(|example| example.name == "ways").expect("the example");
    let (certificate, witness) = certified(example);
    let task: Value = serde_json::from_str(&certificate.task).expect("JSON");
    let verdict = |edit: &dyn Fn(&mut Value)| {
        let mut task = task.clone();
        edit(&mut task);
        compared(example, &task.to_string(), &witness)
    };
    let found = verdict(&|task| drop(task["operators"].as_array_mut().expect("operators").remove(0)));
    assert!(matches!(found, Faithful::No(Difference::NoOperatorFor { .. })), "{found:?}");
    let found = verdict(&|task| task["operators"][0]["cost"]["constant"] = json!(1_000));
    assert!(matches!(found, Faithful::No(Difference::WrongCost { .. })), "{found:?}");
    let found = verdict(&|task| task["operators"][0]["effects"] = json!([]));
    assert!(matches!(found, Faithful::No(Difference::WrongEffect { .. })), "{found:?}");
    let found =
        verdict(&|task| task["values"][0] = json!(task["variables"][0].as_array().map_or(0, Vec::len) - 1));
    assert!(matches!(found, Faithful::No(Difference::Initial { .. })), "{found:?}");
    let found = verdict(&|task| task["goal"]["clauses"] = json!([[]]));
    assert!(matches!(found, Faithful::No(Difference::Goal)), "{found:?}");
    let found = compared(example, &certificate.task, &witness.replacen("\"(at b)\",", "", 1));
    assert!(matches!(found, Faithful::No(Difference::Witness { .. })), "{found:?}");
    let found = compared(example, "{}", &witness);
    assert!(matches!(found, Faithful::No(Difference::Form { .. })), "{found:?}");
}

/// Instances that grounders have lost in practice: one of their cases contradicts itself, or their condition
/// contains a product of decimals.
const FIELD: [(&str, &str, &str); 4] = [
    (
        "a",
        "(define (domain d) (:predicates (p) (q)) (:functions (f))
          (:durative-action a :parameters () :duration (= ?duration 2) :condition (and)
            :effect (and (at start (q)) (at start (p)) (at start (increase (f) 5))
              (at start (when (p) (assign (f) 0)))))
          (:durative-action dear :parameters () :duration (= ?duration 100) :condition (and) :effect (at end (q))))",
        "(define (problem p) (:domain d) (:init (= (f) 2)) (:goal (q)))",
    ),
    (
        "a",
        "(define (domain d) (:predicates (p) (q)) (:functions (f))
          (:durative-action a :parameters () :duration (= ?duration 2) :condition (and)
            :effect (and (at start (q)) (at start (p)) (at start (increase (f) 5))
              (at start (when (p) (assign (f) 0))))))",
        "(define (problem p) (:domain d) (:init (= (f) 2)) (:goal (q)))",
    ),
    (
        "risky",
        "(define (domain d) (:predicates (done)) (:functions (a) (b) (c) (total-cost))
          (:action risky :parameters () :precondition (<= (* (a) (b) (c)) 0.5)
            :effect (and (done) (increase (total-cost) 1)))
          (:action safe :parameters () :precondition () :effect (and (done) (increase (total-cost) 100))))",
        "(define (problem p) (:domain d) (:init (= (total-cost) 0) (= (a) 0.6338035485622269)
          (= (b) 0.2174744612379466) (= (c) 0.9250096893649316)) (:goal (done)) (:metric minimize (total-cost)))",
    ),
    (
        "go",
        "(define (domain d) (:predicates (done)) (:functions (a) (b) (c))
          (:action go :parameters () :precondition (>= (* (a) (b) (c)) 0.5) :effect (done)))",
        "(define (problem p) (:domain d) (:init (= (a) 0.9389000000000001) (= (b) 0.9762000000000003)
          (= (c) 0.9856000000000007)) (:goal (done)))",
    ),
];

#[test]
fn omitted_instances_are_detected() {
    for (action, domain, problem) in FIELD {
        let example = Example { name: action, domain, problem, optimum: None };
        let (domain, problem) = files(&example);
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        let solution = optimize(&task, &Config::default(), &mut |_| {});
        let certificate = certify(&task, &solution, &Limits::none()).expect("a certificate");
        let mut task: Value = serde_json::from_str(&certificate.task).expect("JSON");
        let schemas = task["schemas"].clone();
        let is_lost = |operator: &Value| {
            operator["schema"].as_u64().is_some_and(|schema| schemas[schema as usize] == action)
        };
        task["operators"].as_array_mut().expect("operators").retain(|operator| !is_lost(operator));
        for goal in [task["goal"]["clauses"].clone(), json!([[]])] {
            if !goal.is_null() {
                task["goal"]["clauses"] = goal;
            }
            let written = task.to_string();
            let made = witness(&domain, &problem, &written, &|| false);
            let found = match made {
                Ok(witness) => faithful(&domain, &problem, &written, &witness, &|| false),
                Err(verdict) => verdict,
            };
            let expected = Difference::NoOperatorFor { instance: format!("({action})") };
            assert!(
                found == Faithful::No(expected) || found == Faithful::No(Difference::Goal),
                "{action}: {found:?}"
            );
        }
    }
}

/// No action of the files changes a static atom. If the atom could be a value of a variable, the comparison would
/// therefore ignore effects on it, and take a condition on it for constant.
#[test]
fn static_atoms_are_not_values_of_variables() {
    let example = Example {
        name: "static",
        domain: "(define (domain d) (:predicates (p) (q) (g)) (:action a :parameters () :precondition () :effect (q))
          (:action b :parameters () :precondition (and (p) (q)) :effect (g)))",
        problem: "(define (problem x) (:domain d) (:init (p)) (:goal (g)))",
        optimum: Some("2"),
    };
    let (certificate, witness) = certified(&example);
    let mut task: Value = serde_json::from_str(&certificate.task).expect("JSON");
    let added = |list: &mut Value, element: Value| list.as_array_mut().expect("an array").push(element);
    let variable = task["basic"].as_u64().expect("a number");
    added(&mut task["variables"], json!(["(p)", "none of these"]));
    added(&mut task["values"], json!(0));
    task["basic"] = json!(variable + 1);
    // The first action makes the atom false, and the second requires it.
    added(&mut task["operators"][0]["effects"], json!([variable, 1]));
    added(&mut task["operators"][1]["condition"]["facts"], json!([variable, 0]));
    let task = task.to_string();
    assert!(lies(&example, &task), "{task}");
    let found = compared(&example, &task, &witness);
    assert!(matches!(found, Faithful::No(Difference::Form { .. })), "{found:?}");
}

/// A simultaneous assignment and addition to one number contradict each other, so there is no such step.
#[test]
fn contradictions_are_no_steps() {
    let example = Example {
        name: "contradiction",
        domain: "(define (domain d) (:predicates (q)) (:functions (f))
          (:action never :parameters () :precondition () :effect (and (q) (assign (f) 5) (increase (f) 5)))
          (:action long :parameters () :precondition () :effect (increase (f) 4))
          (:action last :parameters () :precondition (>= (f) 8) :effect (q)))",
        problem: "(define (problem p) (:domain d) (:init (= (f) 0)) (:goal (q)))",
        optimum: Some("3"),
    };
    let (certificate, witness) = certified(&example);
    let found = compared(&example, &certificate.task, &witness);
    assert!(matches!(found, Faithful::Yes { .. }), "{found:?}");
}

#[test]
fn unsupported_constructs_are_named() {
    let domain = "(define (domain d) (:predicates (p) (q) (r)) (:functions (p) (total-cost))
      (:derived (r) (not (p)))
      (:action a :parameters () :precondition (not (r)) :effect (and (q) (increase (total-cost) (p)))))";
    let example = Example {
        name: "one name",
        domain,
        problem: "(define (problem x) (:domain d) (:init (p) (= (p) 3) (= (total-cost) 0)) (:goal (q))
          (:metric minimize (total-cost)))",
        optimum: None,
    };
    let (files, problem) = files(&example);
    let task = ground(&files, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    let certificate = certify(&task, &solution, &Limits::none()).expect("a certificate");
    let found = witness(&files, &problem, &certificate.task, &|| false);
    let construct = "derived predicates beside a predicate and a function of one name".to_owned();
    assert_eq!(found, Err(Faithful::Undecided(Cause::Unsupported { construct })));
}

/// Extreme numbers in a certificate must neither cause a panic nor prove a false claim.
#[test]
fn hostile_numbers_prove_nothing() {
    let hostile = [i128::MAX, i128::MIN, 1 << 107, -(1 << 107), 1 << 63];
    let hostile = hostile.map(|number| serde_json::from_str::<Value>(&number.to_string()).expect("JSON"));
    let mut tried = 0;
    for example in TASKS.iter().filter(|example| ["battery", "bounds", "durative"].contains(&example.name)) {
        let files = files(example);
        let (certificate, witness) = certified(example);
        let claim = example.optimum.map(fraction);
        let dearer = claim.clone().map(|cost| cost + fraction("1"));
        let documents = [&certificate.task, &certificate.argument];
        for (place, document) in documents.into_iter().enumerate() {
            let document: Value = serde_json::from_str(document).expect("JSON");
            let mut all = Vec::new();
            changes(&document, "", &mut all);
            let mut paths: Vec<String> = all
                .into_iter()
                .filter(|(_, new)| new.as_ref().is_some_and(Value::is_number))
                .map(|own| own.0)
                .collect();
            paths.dedup();
            for path in paths {
                for number in &hostile {
                    let mutant = changed(&document, &(path.clone(), Some(number.clone()))).to_string();
                    let (task, argument) = match place {
                        0 => (&mutant, &certificate.argument),
                        _ => (&certificate.task, &mutant),
                    };
                    let stands = matches!(compared_with(&files, task, &witness), Faithful::Yes { .. });
                    let proves = check(task, argument, dearer.as_ref()).is_ok();
                    assert!(!(stands && proves), "{}: {path} {number}", example.name);
                    tried += 1;
                }
            }
        }
    }
    assert!(tried >= 500, "{tried}");
}
