//! Tests of the constructs of the language. A construct is accepted and printed as written, rejected as
//! unsupported by its name, or reported with an error code.

use metaplan_pddl::{
    Errors, Severity, Source, parse_domain, parse_problem, print_domain, print_problem, read, render,
};

const DOMAIN: &str = "(define (domain d) (:types place dock - place tool) (:constants home - dock)
 (:predicates (at ?x - place) (link ?x ?y - place) (has ?t - tool) (ready) (path ?x ?y - place) (alone ?x - place))
 (:functions (battery) (distance ?x ?y - place) (total-cost)) SECTIONS)";

const PROBLEM: &str = "(define (problem p) (:domain d) (:objects a b - place drill - tool)
 (:init (at a) (= (battery) 10) INIT) (:goal GOAL) METRIC)";

/// Returns a domain and a problem with the construct `what` in the section `place`, otherwise minimal.
fn texts(place: &str, what: &str) -> (Source, Source) {
    let (mut sections, mut init, mut goal, mut metric) = (String::new(), "", "(at b)", "");
    let truth = "(and )";
    let action = |precondition: &str, effect: &str| {
        format!(
            "(:action a :parameters (?x ?y - place ?t - tool) :precondition {precondition} :effect {effect})"
        )
    };
    let durative = |duration: &str, condition: &str, effect: &str| {
        format!(
            "(:durative-action a :parameters (?x ?y - place) :duration {duration} :condition {condition} :effect {effect})"
        )
    };
    match place {
        "section" => what.clone_into(&mut sections),
        "precondition" => sections = action(what, truth),
        "effect" => sections = action(truth, what),
        "duration" => sections = durative(what, truth, truth),
        "condition" => sections = durative("(= ?duration 1)", what, truth),
        "timed effect" => sections = durative("(= ?duration 1)", truth, what),
        "init" => init = what,
        "goal" => goal = what,
        "metric" => metric = what,
        _ => panic!("{place}"),
    }
    let problem = PROBLEM.replace("INIT", init).replace("GOAL", goal).replace("METRIC", metric);
    (Source::new("domain", DOMAIN.replace("SECTIONS", &sections)), Source::new("problem", problem))
}

fn errors(place: &str, what: &str) -> Vec<&'static str> {
    let (domain, problem) = texts(place, what);
    let diagnostics =
        read(&domain, &problem).map_or_else(Errors::into_vec, |(_, _, diagnostics)| diagnostics);
    diagnostics
        .iter()
        .filter(|diagnostic| diagnostic.severity == Severity::Error)
        .map(|diagnostic| diagnostic.code)
        .collect()
}

fn without_space(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace(" )", ")").replace("( ", "(")
}

/// Accepted constructs, which are printed as written here: section and construct.
const ACCEPTED: [(&str, &str); 94] = [
    ("section", "(:action a :parameters (?x - (either place tool)) :effect (and))"),
    ("section", "(:action a :parameters (?x) :effect (and))"),
    ("section", "(:action a :parameters () :effect (at home))"),
    ("section", "(:derived (alone ?x - place) (not (exists (?y - place) (link ?x ?y))))"),
    (
        "section",
        "(:derived (path ?x ?y - place) (or (link ?x ?y) (exists (?z - place) (and (link ?x ?z) (path ?z ?y)))))",
    ),
    (
        "section",
        "(:derived (path ?x ?y - place) (link ?x ?y)) (:derived (alone ?x - place) (forall (?y - place) (not (path ?x ?y))))",
    ),
    ("section", "(:derived (ready) (>= (battery) 5))"),
    ("precondition", "(at ?x)"),
    ("precondition", "(not (at ?x))"),
    ("precondition", "(at home)"),
    ("precondition", "(= ?x ?y)"),
    ("precondition", "(not (= ?x home))"),
    ("precondition", "(or (at ?x) (at ?y))"),
    ("precondition", "(or)"),
    ("precondition", "(imply (at ?x) (link ?x ?y))"),
    ("precondition", "(exists (?z - place ?u - tool) (and (link ?x ?z) (has ?u)))"),
    ("precondition", "(forall (?z) (imply (at ?z) (= ?z ?x)))"),
    ("precondition", "(forall (?z - (either dock tool)) (exists (?x - place) (link ?x ?x)))"),
    ("precondition", "(and (not (and (at ?x) (or (at ?y) (ready)))) (ready))"),
    ("precondition", "(< (battery) 5)"),
    ("precondition", "(<= (battery) (distance ?x ?y))"),
    ("precondition", "(= (battery) 5)"),
    ("precondition", "(= (battery) (distance ?x ?y))"),
    ("precondition", "(>= (battery) (+ 1 (distance ?x ?y) 0.5))"),
    ("precondition", "(> (- (battery)) (- (battery) 3))"),
    ("precondition", "(> (* 2 (battery) (battery)) (/ (battery) 3))"),
    ("effect", "(at ?x)"),
    ("effect", "(not (at ?x))"),
    ("effect", "(and (at ?x) (not (at ?y)) (and))"),
    ("effect", "(forall (?z - place) (not (at ?z)))"),
    ("effect", "(forall (?z - place ?u - tool) (when (link ?x ?z) (and (at ?z) (has ?u))))"),
    ("effect", "(when (and (at ?x) (>= (battery) 1)) (not (at ?x)))"),
    ("effect", "(when (at ?x) (forall (?z - place) (when (link ?x ?z) (increase (distance ?x ?z) 1))))"),
    ("effect", "(assign (battery) 10)"),
    ("effect", "(increase (battery) (* 2 (distance ?x ?y)))"),
    ("effect", "(decrease (distance ?x ?y) (battery))"),
    ("effect", "(scale-up (battery) 2)"),
    ("effect", "(scale-down (battery) (distance ?x ?y))"),
    ("effect", "(increase (total-cost) 0.25)"),
    ("duration", "(= ?duration 5)"),
    ("duration", "(= ?duration (distance ?x ?y))"),
    ("duration", "(<= ?duration 5)"),
    ("duration", "(and (>= ?duration 1) (<= ?duration (* 2 (battery))))"),
    ("duration", "(and (> ?duration 1) (at end (< ?duration (battery))))"),
    ("duration", "(at end (= ?duration (/ 10 (battery))))"),
    ("duration", "()"),
    ("condition", "(and (at start (at ?x)) (over all (link ?x ?y)) (at end (not (at ?y))))"),
    ("condition", "(and (at start (or (at ?x) (at ?y))) (over all (exists (?z - place) (link ?x ?z))))"),
    ("condition", "(and (at start (forall (?z - place) (at ?z))))"),
    ("condition", "(and (over all (>= (battery) ?duration)))"),
    ("timed effect", "(and (at start (not (at ?x))) (at end (at ?y)))"),
    ("timed effect", "(and (at end (decrease (battery) (* 0.5 ?duration))))"),
    ("timed effect", "(and (at start (when (at ?x) (not (at ?x)))))"),
    ("timed effect", "(and (at end (forall (?z - place) (when (link ?x ?z) (at ?z)))))"),
    ("timed effect", "(and (at start (assign (battery) 3)) (at end (scale-up (battery) 2)))"),
    ("init", "(not (at b))"),
    ("init", "(= (distance a b) 2.5)"),
    ("init", "(= (distance a b) -0.001)"),
    ("init", "(at 5 (at b))"),
    ("init", "(at 5.5 (not (at a)))"),
    ("init", "(= (total-cost) 0)"),
    ("goal", "(and (at b) (not (has drill)))"),
    ("goal", "(or (at a) (exists (?x - dock) (at ?x)))"),
    ("goal", "(forall (?x - place) (imply (at ?x) (= ?x home)))"),
    ("goal", "(>= (battery) 3)"),
    ("goal", "(and)"),
    ("metric", "(:metric minimize (total-time))"),
    ("metric", "(:metric minimize (total-cost))"),
    ("metric", "(:metric maximize (battery))"),
    ("metric", "(:metric minimize (+ (* 2 (total-time)) (* 0.5 (battery)) (distance a b)))"),
    ("metric", "(:metric minimize (- (total-time) (battery)))"),
    ("metric", "(:metric minimize (/ (battery) 2))"),
    (
        "section",
        "(:action a :parameters (?x - place) :precondition (at ?x) :effect (and)) (:action a :parameters () :effect (and))",
    ),
    ("goal", "(path a b)"),
    ("precondition", "(and (at ?x) (preference p (at ?y)))"),
    ("precondition", "(and (preference p (at ?x)))"),
    ("precondition", "(and (forall (?z - place) (preference p (link ?x ?z))))"),
    (
        "condition",
        "(and (at start (at ?x)) (preference p (at start (at ?y))) (preference q (at end (ready))))",
    ),
    ("goal", "(and (at b) (preference p (at a)) (forall (?x - place) (preference p (at ?x))))"),
    ("goal", "(and (preference p (or (at a) (at b))))"),
    ("metric", "(:constraints (and (always (at a)) (sometime (ready)) (at-most-once (at b))))"),
    ("metric", "(:constraints (and (sometime-after (at a) (at b)) (sometime-before (at a) (ready))))"),
    ("metric", "(:constraints (and (within 5 (at a)) (always-within 2.5 (at a) (at b))))"),
    ("metric", "(:constraints (and (hold-during 1 2.5 (at a)) (hold-after 3 (at b)) (at end (at b))))"),
    ("metric", "(:constraints (and (forall (?x - place) (preference p (always (at ?x))))))"),
    (
        "metric",
        "(:constraints (and (preference p (and (sometime (at a)) (forall (?x - place) (always (at ?x)))))))",
    ),
    (
        "metric",
        "(:constraints (and (preference p (at-most-once (> (battery) 3))))) (:metric minimize (is-violated p))",
    ),
    (
        "metric",
        "(:constraints (and (preference p (sometime (at b))))) (:metric minimize (+ (* 2 (is-violated p)) (battery)))",
    ),
    ("section", "(:constraints (and (always (at home)) (forall (?x - place) (at-most-once (at ?x)))))"),
    ("section", "(:constraints (and (preference p (sometime (at home)))))"),
    ("section", "(:constraints (and (forall (?x ?y - place) (sometime-after (link ?x ?y) (at ?y)))))"),
    ("section", "(:constraints (and (hold-after 0.5 (ready))))"),
    ("section", "(:constraints (and (forall (?x - dock) (preference p (at end (at ?x))))))"),
    ("init", "(link a b)"),
];

#[test]
fn accepted_constructs_are_read_and_printed_as_written() {
    for (place, what) in ACCEPTED {
        assert_eq!(errors(place, what), [""; 0], "{place}: {what}");
        let (domain, problem) = texts(place, what);
        let domain = parse_domain(&domain).0.expect("it is read");
        let problem = parse_problem(&problem).0.expect("it is read");
        let printed = without_space(&(print_domain(&domain) + &print_problem(&problem)));
        assert!(printed.contains(&without_space(what)), "{what}\nis not in\n{printed}");
    }
}

/// Unsupported constructs: section, construct, and part of the error message.
const REFUSED: [(&str, &str, &str); 11] = [
    (
        "section",
        "(:functions (place-of ?t - tool) - place) (:durative-action a :parameters (?t - tool) :duration (= ?duration (distance home (place-of ?t))) :condition (and) :effect (and))",
        "object fluents in durations",
    ),
    (
        "section",
        "(:process drain :parameters () :effect (decrease (battery) (* #t 1)))",
        "processes and events",
    ),
    ("section", "(:event empty :parameters () :effect (ready))", "processes and events"),
    ("section", "(:task go :parameters ())", "hierarchical tasks"),
    ("section", "(:method go :parameters ())", "hierarchical tasks"),
    ("section", "(:axiom :vars (?x) :context (at ?x) :implies (ready))", "axioms of PDDL 1.2"),
    ("condition", "(and (over all (preference p (at ?x))))", "preferences"),
    ("timed effect", "(decrease (battery) (* #t 1))", "continuous effects"),
    ("timed effect", "(at end (decrease (battery) (* #t 1)))", "continuous effects"),
    ("timed effect", "(when (at start (at ?x)) (at end (at ?y)))", "at another time than their condition"),
    ("init", "(at 5 (= (battery) 3))", "timed initial values"),
];

#[test]
fn unsupported_constructs_are_refused_by_name() {
    for (place, what, words) in REFUSED {
        let (domain, problem) = texts(place, what);
        let diagnostics =
            read(&domain, &problem).map_or_else(Errors::into_vec, |(_, _, diagnostics)| diagnostics);
        let refusal = diagnostics
            .iter()
            .find(|diagnostic| diagnostic.code == "P113" && diagnostic.severity == Severity::Error);
        let refusal = refusal.unwrap_or_else(|| panic!("{what}: {diagnostics:#?}"));
        assert!(refusal.message.contains(words), "{what}: {}", refusal.message);
        let text = render(std::slice::from_ref(refusal), &[&domain, &problem], false);
        assert!(text.contains("= help: "), "{what} is refused without a word on what would be right: {text}");
    }
}

/// Erroneous constructs: section, construct, and error code.
const WRONG: [(&str, &str, &str); 43] = [
    ("duration", "(= ?duration =)", "P106"),
    ("precondition", "(> (battery) -)", "P106"),
    ("effect", "(increase + 1)", "P106"),
    ("precondition", "(not (at ?x) (at ?y))", "P108"),
    ("precondition", "(imply (at ?x))", "P108"),
    ("precondition", "(exists ?z (at ?z))", "P106"),
    ("precondition", "(at ?z)", "P124"),
    ("precondition", "(= ?x (battery))", "P106"),
    ("precondition", "(= ?x 5)", "P123"),
    ("precondition", "(>= (battery) ?duration)", "P137"),
    ("precondition", "(>= (battery) (total-time))", "P137"),
    ("precondition", "(> (battery))", "P108"),
    ("precondition", "(> (- 1 2 3) 0)", "P108"),
    ("precondition", "(> (/ 1) 0)", "P108"),
    ("precondition", "((at ?x))", "P106"),
    ("precondition", "(at start (at ?x))", "P115"),
    ("effect", "(or (at ?x) (at ?y))", "P106"),
    ("effect", "(not (not (at ?x)))", "P106"),
    ("effect", "(when (at ?x))", "P108"),
    ("effect", "(increase (battery))", "P108"),
    ("effect", "(increase 5 (battery))", "P122"),
    ("effect", "(assign (ready) 1)", "P122"),
    ("section", "(:action a :parameters (?x ?x - place) :effect (and))", "P127"),
    ("section", "(:action a :parameters (?x - (either)) :effect (and))", "P108"),
    ("section", "(:derived (path ?x - place) (at ?x))", "P125"),
    ("section", "(:derived (battery) (ready))", "P121"),
    ("section", "(:derived (alone ?x - place) (not (alone ?x)))", "P130"),
    ("duration", "(= 1 2)", "P106"),
    ("duration", "(over all (= ?duration 1))", "P106"),
    ("timed effect", "(over all (at ?x))", "P115"),
    ("timed effect", "(at ?x)", "P115"),
    ("init", "(or (at a) (at b))", "P106"),
    ("init", "(= (battery) (distance a b))", "P106"),
    ("init", "(at -1 (at b))", "P139"),
    ("metric", "(:metric least (battery))", "P106"),
    ("metric", "(:metric minimize (is-violated p))", "P118"),
    ("metric", "(:metric minimize (is-violated))", "P125"),
    ("precondition", "(> (is-violated p) 0)", "P137"),
    ("precondition", "(or (at ?x) (preference p (at ?y)))", "P106"),
    ("goal", "(not (preference p (at a)))", "P106"),
    ("metric", "(:constraints (and (never (at a))))", "P106"),
    ("metric", "(:constraints (and (preference p (preference q (always (at a))))))", "P106"),
    ("metric", "(:metric minimize (battery) (total-time))", "P108"),
];

#[test]
fn each_error_has_its_code() {
    for (place, what, code) in WRONG {
        assert!(errors(place, what).contains(&code), "{what}: {:?}, not {code}", errors(place, what));
    }
}

#[test]
fn untyped_names_before_typed_ones_survive_printing() {
    for types in ["a b - object c - d", "a b c - d e f", "a - Object b -object"] {
        let source = Source::new("domain", format!("(define (domain d) (:types {types}))"));
        let print = |source: &Source| parse_domain(source).0.map(|domain| print_domain(&domain));
        let printed = print(&source).expect("it is read");
        assert_eq!(print(&Source::new("again", printed.clone())), Some(printed), "{types}");
    }
}
