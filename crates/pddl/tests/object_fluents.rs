//! Tests of object fluents (functions with objects as values): their compiled forms, and messages about
//! errors.

use metaplan_pddl::{Severity, Source, parse_problem_of, print_domain, print_problem, read};

const DOMAIN: &str = "(define (domain d) (:requirements :adl :object-fluents :fluents)
 (:types place thing - object van tool - thing)
 (:constants home - place)
 (:predicates (at ?x ?y - place) (busy ?v - van))
 (:functions (loc ?x - thing) (base ?v - van) - place (carrier ?t - tool) - van (capital) - place
   (fuel ?v - van) - number (cost))
 SECTION)";

const PROBLEM: &str = "(define (problem p) (:domain d) (:objects a b - place v w - van t - tool)
 (:init (= (fuel v) 1) INIT) (:goal GOAL) METRIC)";

fn texts(place: &str, what: &str) -> (Source, Source) {
    let (mut section, mut init, mut goal, mut metric) = (String::new(), "", "(and )", "");
    let parameters = "(?p ?q - place ?v ?w - van ?t - tool)";
    match place {
        "section" => what.clone_into(&mut section),
        "condition" => {
            section = format!("(:action a :parameters {parameters} :precondition {what} :effect (and ))");
        }
        "effect" => section = format!("(:action a :parameters {parameters} :effect {what})"),
        "timed effect" => {
            section = format!(
                "(:durative-action a :parameters {parameters} :duration (= ?duration 1) :condition (and ) :effect {what})"
            );
        }
        "duration" => {
            section = format!(
                "(:durative-action a :parameters {parameters} :duration {what} :condition (and ) :effect (and ))"
            );
        }
        "init" => init = what,
        "goal" => goal = what,
        "metric" => metric = what,
        _ => panic!("{place}"),
    }
    let problem = PROBLEM.replace("INIT", init).replace("GOAL", goal).replace("METRIC", metric);
    (Source::new("domain", DOMAIN.replace("SECTION", &section)), Source::new("problem", problem))
}

fn without_space(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace(" )", ")").replace("( ", "(")
}

/// Constructs with object fluents: section, source text, and expected part of the printed text.
const COMPILED: [(&str, &str, &str); 35] = [
    ("section", "", "(loc ?x - thing ?value1 - place)"),
    ("section", "", "(carrier ?t - tool ?value3 - van) (capital ?value4 - place))"),
    ("section", "", "(:functions (fuel ?v - van) (cost))"),
    ("condition", "(= (loc ?v) ?p)", ":precondition (loc ?v ?p)"),
    ("condition", "(= ?p (loc ?v))", ":precondition (loc ?v ?p)"),
    ("condition", "(= (capital) home)", ":precondition (capital home)"),
    ("condition", "(not (= (loc ?v) home))", ":precondition (not (loc ?v home))"),
    (
        "condition",
        "(= (loc ?v) (base ?w))",
        ":precondition (exists (?value5 - place) (and (base ?w ?value5) (loc ?v ?value5)))",
    ),
    (
        "condition",
        "(= (loc (carrier ?t)) ?p)",
        "(exists (?value5 - van) (and (carrier ?t ?value5) (loc ?value5 ?p)))",
    ),
    ("condition", "(= (loc ?v) undefined)", "(not (exists (?value5 - place) (loc ?v ?value5)))"),
    (
        "condition",
        "(at (loc (carrier ?t)) ?p)",
        "(exists (?value5 - van ?value6 - place) (and (carrier ?t ?value5) (loc ?value5 ?value6) (at ?value6 ?p)))",
    ),
    (
        "condition",
        "(not (busy (carrier ?t)))",
        "(not (exists (?value5 - van) (and (carrier ?t ?value5) (busy ?value5))))",
    ),
    (
        "condition",
        "(> (+ (fuel (carrier ?t)) 1) 3)",
        "(exists (?value5 - van) (and (carrier ?t ?value5) (> (+ (fuel ?value5) 1) 3)))",
    ),
    (
        "condition",
        "(forall (?x - van) (imply (busy ?x) (= (loc ?x) (base ?x))))",
        "(exists (?value5 - place)",
    ),
    ("section", "(:derived (busy ?v - van) (= (loc ?v) home))", "(:derived (busy ?v - van) (loc ?v home))"),
    (
        "effect",
        "(assign (loc ?v) ?p)",
        ":effect (and (loc ?v ?p) (forall (?value5 - place) (not (loc ?v ?value5))))",
    ),
    ("effect", "(assign (loc ?v) undefined)", ":effect (forall (?value5 - place) (not (loc ?v ?value5)))"),
    (
        "effect",
        "(assign (loc ?v) (base ?v))",
        ":precondition (and (exists (?value5 - place) (base ?v ?value5)))",
    ),
    (
        "effect",
        "(assign (loc ?v) (base ?v))",
        ":effect (forall (?value5 - place) (when (base ?v ?value5) (and (loc ?v ?value5) (forall (?value6 - place) (not (loc ?v ?value6))))))",
    ),
    (
        "effect",
        "(not (busy (carrier ?t)))",
        ":effect (forall (?value5 - van) (when (carrier ?t ?value5) (not (busy ?value5))))",
    ),
    (
        "effect",
        "(increase (fuel (carrier ?t)) 2)",
        "(forall (?value5 - van) (when (carrier ?t ?value5) (increase (fuel ?value5) 2)))",
    ),
    (
        "effect",
        "(increase (cost) (fuel (carrier ?t)))",
        "(when (carrier ?t ?value5) (increase (cost) (fuel ?value5)))",
    ),
    (
        "effect",
        "(when (busy ?w) (busy (carrier ?t)))",
        ":precondition (and (imply (busy ?w) (exists (?value5 - van) (carrier ?t ?value5))))",
    ),
    (
        "effect",
        "(forall (?x - tool) (busy (carrier ?x)))",
        ":precondition (and (forall (?x - tool) (exists (?value5 - van) (carrier ?x ?value5))))",
    ),
    // Assignments that may give two values to one object fluent.
    (
        "effect",
        "(and (assign (loc ?v) ?p) (assign (loc ?w) ?q))",
        ":precondition (and (imply (and (= ?v ?w)) (= ?p ?q)))",
    ),
    (
        "effect",
        "(and (assign (loc ?v) ?p) (assign (loc ?w) undefined))",
        ":precondition (and (imply (and (= ?v ?w)) (or)))",
    ),
    (
        "effect",
        "(forall (?x - place) (when (at ?p ?x) (assign (capital) ?x)))",
        "(forall (?value6 ?value7 - place) (imply (and (at ?p ?value6) (at ?p ?value7)) (= ?value6 ?value7)))",
    ),
    (
        "timed effect",
        "(and (at start (assign (loc ?v) (base ?v))) (at end (assign (loc ?v) ?p)))",
        ":condition (and (at start (exists (?value5 - place) (base ?v ?value5))))",
    ),
    (
        "timed effect",
        "(forall (?x - tool) (when (at end (busy ?w)) (at end (busy (carrier ?x)))))",
        "(at end (forall (?x - tool) (imply (and (busy ?w)) (exists (?value5 - van) (carrier ?x ?value5)))))",
    ),
    ("init", "(= (loc v) a)", "(:init (= (fuel v) 1) (loc v a))"),
    ("init", "(= a (loc v))", "(loc v a)"),
    ("init", "(= (loc v) undefined)", "(:init (= (fuel v) 1))"),
    (
        "goal",
        "(= (loc (carrier t)) home)",
        "(:goal (exists (?value1 - van) (and (carrier t ?value1) (loc ?value1 home))))",
    ),
    ("goal", "(preference x (= (loc v) home))", "(preference x (loc v home))"),
    (
        "section",
        "(:constraints (always (= (loc home-van) home))) (:constants home-van - van)",
        "(always (loc home-van home))",
    ),
];

#[test]
fn each_form_is_compiled_and_its_printed_form_can_be_parsed() {
    for (place, what, expected) in COMPILED {
        let (domain, problem) = texts(place, what);
        let (tree, task, warnings) =
            read(&domain, &problem).unwrap_or_else(|errors| panic!("{what}: {errors:#?}"));
        assert!(warnings.is_empty(), "{what}: {warnings:#?}");
        let printed = (print_domain(&tree), print_problem(&task));
        let text = without_space(&(printed.0.clone() + &printed.1));
        assert!(text.contains(expected), "{what}\nis\n{text}");
        let sources = (Source::new("domain", printed.0.as_str()), Source::new("problem", printed.1.as_str()));
        let (again, task, _) =
            read(&sources.0, &sources.1).unwrap_or_else(|errors| panic!("{what}: {errors:#?}"));
        assert_eq!((print_domain(&again), print_problem(&task)), printed);
    }
}

#[test]
fn assignments_that_cannot_differ_add_no_precondition() {
    let consistent_effects = [
        "(and (assign (loc v) ?p) (assign (loc w) ?q))",
        "(and (assign (loc ?v) ?p) (assign (loc ?w) ?p))",
        "(forall (?x - van) (assign (loc ?x) home))",
        "(forall (?x - place) (assign (capital) home))",
        "(and (assign (loc ?v) ?p) (assign (base ?v) ?q))",
    ];
    for what in consistent_effects {
        let (domain, problem) = texts("effect", what);
        let (tree, ..) = read(&domain, &problem).unwrap_or_else(|errors| panic!("{what}: {errors:#?}"));
        assert!(!print_domain(&tree).contains(":precondition"), "{what}\n{}", print_domain(&tree));
    }
}

/// Erroneous constructs: section, source text, error code, part of the message, and text at the reported
/// position.
const WRONG: [(&str, &str, &str, &str, &str); 28] = [
    (
        "condition",
        "(= (loc ?v) ?t)",
        "P126",
        "the value of `loc` is of type `place`, but `?t` is of type `tool`",
        "?t)",
    ),
    ("condition", "(= (loc ?p) ?q)", "P126", "argument 1 of `loc`", "?p)"),
    ("condition", "(= (loc) ?q)", "P125", "the function `loc` takes 1 argument, found 0", "(loc)"),
    ("condition", "(= (loc ?v ?p) ?q)", "P125", "takes 1 argument, found 2", "(loc ?v ?p)"),
    ("condition", "(loc ?v ?p)", "P106", "`loc` is a function with an object as its value", "(loc ?v ?p)"),
    ("condition", "(> (loc ?v) 3)", "P106", "`loc` is a function with an object as its value", "(loc ?v) 3"),
    ("condition", "(= (loc ?v) 3)", "P106", "expected an object, found `3`", "3)"),
    ("condition", "(= (loc ?v) (fuel ?v))", "P106", "expected an object", "(fuel ?v)"),
    ("condition", "(at (fuel ?v) ?p)", "P106", "expected a variable or an object", "(fuel ?v)"),
    ("condition", "(= (loc ?v) ?z)", "P124", "unknown variable `?z`", "?z"),
    ("condition", "(= (lok ?v) ?p)", "P106", "expected a number", "?p)"),
    ("effect", "(loc ?v ?p)", "P106", "`loc` is a function with an object as its value", "(loc ?v ?p)"),
    ("effect", "(not (loc ?v ?p))", "P106", "`loc` is a function with an object as its value", "(loc ?v ?p)"),
    (
        "effect",
        "(increase (loc ?v) 1)",
        "P106",
        "`loc` is a function with an object as its value",
        "(loc ?v) 1",
    ),
    ("effect", "(assign (loc ?v) 1)", "P106", "expected an object, found `1`", "1)"),
    ("effect", "(assign (loc ?v) ?w)", "P126", "the value of `loc` is of type `place`", "?w)"),
    (
        "effect",
        "(assign (loc ?v) (carrier ?t))",
        "P126",
        "the value of `loc` is of type `place`",
        "(carrier ?t)",
    ),
    (
        "effect",
        "(forall (?x) (assign (loc ?v) ?x))",
        "P126",
        "the value of `loc` is of type `place`, but what is assigned is of type `object`",
        "?x)))",
    ),
    ("effect", "(assign (loc ?z) (base ?v))", "P124", "unknown variable `?z`", "?z"),
    ("duration", "(= ?duration (fuel (carrier ?t)))", "P113", "object fluents in durations", "(carrier ?t)"),
    (
        "metric",
        "(:metric minimize (fuel (carrier t)))",
        "P113",
        "object fluents in durations, metrics",
        "(carrier t)",
    ),
    ("init", "(= (loc (carrier t)) a)", "P113", "within initial values", "(carrier t)"),
    ("init", "(= (loc v) a) (= (loc v) b)", "P127", "this function has another value already", "(loc v) b"),
    ("init", "(= (loc v) t)", "P126", "the value of `loc` is of type `place`", "t)"),
    ("init", "(= (loc v) 3)", "P106", "expected an object, found `3`", "3)"),
    ("init", "(at 5 (= (loc v) a))", "P113", "timed initial values", "(= (loc v)"),
    (
        "section",
        "(:functions (loc ?x - thing) - van)",
        "P127",
        "the function `loc` is declared twice",
        "loc ?x - thing) - van",
    ),
    (
        "section",
        "(:derived (loc ?x ?y) (at ?x ?y))",
        "P127",
        "`loc` is a function with an object as its value, and this predicate",
        "loc ?x ?y)",
    ),
];

#[test]
fn errors_have_code_message_and_position() {
    for (place, what, code, words, here) in WRONG {
        let (domain, problem) = texts(place, what);
        let Err(diagnostics) = read(&domain, &problem) else { panic!("{what} is read") };
        let errors: Vec<_> =
            diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).collect();
        let [error] = errors[..] else { panic!("{what}: {errors:#?}") };
        assert_eq!(error.code, code, "{what}: {error:#?}");
        assert!(error.message.contains(words), "{what}: {}", error.message);
        let source = if error.file == "domain" { &domain } else { &problem };
        let text_at_error = &source.text()[error.span.start as usize..];
        assert!(
            text_at_error.starts_with(here),
            "{what}: {} points at {}",
            error.message,
            &text_at_error[..20.min(text_at_error.len())]
        );
    }
}

#[test]
fn new_variables_do_not_occur_in_the_file() {
    let what = "(:action a :parameters (?value1 ?VALUE - van) :precondition (= (loc ?value1) (loc ?value)) :effect (and ))";
    let (domain, problem) = texts("section", what);
    let (tree, ..) = read(&domain, &problem).expect("it is read");
    let printed = without_space(&print_domain(&tree));
    let expected = "(exists (?value-5 - place) (and (loc ?value ?value-5) (loc ?value1 ?value-5)))";
    assert!(printed.to_ascii_lowercase().contains(expected), "{printed}");
}

#[test]
fn a_repeated_value_is_a_warning() {
    let (domain, problem) = texts("init", "(= (loc v) a) (= (loc v) a)");
    let (_, _, diagnostics) = read(&domain, &problem).expect("it is read");
    assert!(diagnostics.iter().all(|diagnostic| diagnostic.code == "P127"), "{diagnostics:#?}");
}

#[test]
fn a_problem_can_be_parsed_with_the_object_fluents_of_its_domain() {
    let (domain, problem) = texts("goal", "(= (loc v) home)");
    let (tree, task, _) = read(&domain, &problem).expect("it is read");
    let (again, diagnostics) = parse_problem_of(&tree, &problem);
    assert!(diagnostics.is_empty());
    assert_eq!(print_problem(&again.expect("it is read")), print_problem(&task));
}
