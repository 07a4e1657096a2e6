//! Property tests: printing what was parsed from printed text gives the same text again, and no text
//! makes the parser or the checker panic.

use proptest::prelude::*;

use metaplan_pddl::{
    Errors, Source, has_errors, parse_domain, parse_problem, print_domain, print_problem, read, render,
};

fn name() -> impl Strategy<Value = String> {
    prop_oneof![
        "[a-z][a-z0-9_]{0,5}",
        "[A-Z][a-z]{1,3}-[a-z]{1,3}",
        "[0-9]\\.[0-9]_[a-z]{1,4}",
        "<_[a-z]{1,4}"
    ]
    .prop_filter("keywords have a meaning of their own", |name| {
        let reserved = [
            "and",
            "or",
            "not",
            "imply",
            "exists",
            "forall",
            "when",
            "either",
            "at",
            "over",
            "define",
            "preference",
            "assign",
            "increase",
            "decrease",
            "number",
            "object",
            "oneof",
            "within",
            "always",
            "sometime",
        ];
        !reserved.contains(&name.to_lowercase().as_str())
    })
}

fn number() -> impl Strategy<Value = String> {
    prop_oneof!["[0-9]{1,4}", "-?[0-9]{1,3}\\.[0-9]{0,3}", "[0-9]e-?[0-9]"]
}

fn term() -> impl Strategy<Value = String> {
    prop_oneof![name(), name().prop_map(|name| format!("?{name}"))]
}

fn atom() -> impl Strategy<Value = String> {
    (name(), prop::collection::vec(term(), 0..3))
        .prop_map(|(name, terms)| format!("({name} {})", terms.join(" ")))
}

fn typed_list(prefix: &'static str) -> impl Strategy<Value = String> {
    let r#type = prop_oneof![
        Just(String::new()),
        name().prop_map(|name| format!(" - {name}")),
        (name(), name()).prop_map(|(left, right)| format!(" - (either {left} {right})")),
    ];
    prop::collection::vec((name(), r#type), 0..4).prop_map(move |entries| {
        let entries = entries.into_iter().map(|(name, r#type)| format!("{prefix}{name}{type}"));
        entries.collect::<Vec<_>>().join(" ")
    })
}

fn expression() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![number(), atom(), Just("?duration".to_owned())];
    leaf.prop_recursive(3, 12, 3, |inner| {
        (prop_oneof![Just("+"), Just("*"), Just("-"), Just("/")], inner.clone(), inner)
            .prop_map(|(operator, left, right)| format!("({operator} {left} {right})"))
    })
}

fn condition() -> impl Strategy<Value = String> {
    let comparison = prop_oneof![Just("<"), Just("<="), Just("="), Just(">="), Just(">")];
    let leaf = prop_oneof![
        atom(),
        (comparison, expression(), expression())
            .prop_map(|(sign, left, right)| format!("({sign} {left} (+ {right}))")),
        (term(), term()).prop_map(|(left, right)| format!("(= {left} {right})")),
    ];
    leaf.prop_recursive(4, 24, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..3).prop_map(|parts| format!("(and {})", parts.join(" "))),
            prop::collection::vec(inner.clone(), 0..3).prop_map(|parts| format!("(or {})", parts.join(" "))),
            inner.clone().prop_map(|part| format!("(not {part})")),
            (inner.clone(), inner.clone()).prop_map(|(left, right)| format!("(imply {left} {right})")),
            (typed_list("?"), inner.clone())
                .prop_map(|(entries, body)| format!("(exists ({entries}) {body})")),
            (typed_list("?"), inner).prop_map(|(entries, body)| format!("(forall ({entries}) {body})")),
        ]
    })
}

fn soft_condition() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        condition(),
        (name(), condition()).prop_map(|(name, body)| format!("(preference {name} {body})")),
    ];
    leaf.prop_recursive(3, 8, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..3).prop_map(|parts| format!("(and {})", parts.join(" "))),
            (typed_list("?"), inner).prop_map(|(entries, body)| format!("(forall ({entries}) {body})")),
        ]
    })
}

fn trajectory() -> impl Strategy<Value = String> {
    let one = prop_oneof![Just("always"), Just("sometime"), Just("at-most-once"), Just("at end")];
    let two = prop_oneof![Just("sometime-after"), Just("sometime-before"), Just("always-within 2.5")];
    let timed = prop_oneof![Just("within 3"), Just("hold-during 0.5 4"), Just("hold-after 2")];
    let leaf = prop_oneof![
        (prop_oneof![one, timed], condition()).prop_map(|(head, body)| format!("({head} {body})")),
        (two, condition(), condition())
            .prop_map(|(head, first, second)| format!("({head} {first} {second})")),
    ];
    leaf.prop_recursive(2, 6, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..3).prop_map(|parts| format!("(and {})", parts.join(" "))),
            (typed_list("?"), inner).prop_map(|(entries, body)| format!("(forall ({entries}) {body})")),
        ]
    })
}

fn constraints() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        trajectory(),
        (name(), trajectory()).prop_map(|(name, body)| format!("(preference {name} {body})")),
    ];
    leaf.prop_recursive(2, 6, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..3).prop_map(|parts| format!("(and {})", parts.join(" "))),
            (typed_list("?"), inner).prop_map(|(entries, body)| format!("(forall ({entries}) {body})")),
        ]
    })
}

fn effect() -> impl Strategy<Value = String> {
    let assignment =
        prop_oneof![Just("assign"), Just("increase"), Just("decrease"), Just("scale-up"), Just("scale-down")];
    let leaf = prop_oneof![
        atom(),
        atom().prop_map(|atom| format!("(not {atom})")),
        (assignment, atom(), expression()).prop_map(|(kind, atom, value)| format!("({kind} {atom} {value})")),
    ];
    leaf.prop_recursive(3, 12, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..3).prop_map(|parts| format!("(and {})", parts.join(" "))),
            (typed_list("?"), inner.clone())
                .prop_map(|(entries, body)| format!("(forall ({entries}) {body})")),
            (condition(), inner).prop_map(|(condition, effect)| format!("(when {condition} {effect})")),
        ]
    })
}

fn action() -> impl Strategy<Value = String> {
    let time = prop_oneof![Just("at start"), Just("at end")];
    let any_time = prop_oneof![Just("at start"), Just("at end"), Just("over all")];
    prop_oneof![
        (name(), typed_list("?"), soft_condition(), effect()).prop_map(|(name, parameters, condition, effect)| {
            format!("(:action {name} :parameters ({parameters}) :precondition {condition} :effect {effect})")
        }),
        (
            (name(), typed_list("?"), expression()),
            prop::collection::vec((any_time, any::<bool>(), condition()), 0..3),
            prop::collection::vec((time, effect()), 0..3),
        )
            .prop_map(|((name, parameters, duration), conditions, effects)| {
                let timed = |(time, is_soft, what): &(&str, bool, String)| {
                    if *is_soft && *time != "over all" {
                        format!("(preference p ({time} {what}))")
                    } else {
                        format!("({time} {what})")
                    }
                };
                let conditions: Vec<_> = conditions.iter().map(timed).collect();
                let effects: Vec<_> = effects.iter().map(|(time, what)| format!("({time} {what})")).collect();
                format!(
                    "(:durative-action {name} :parameters ({parameters}) :duration (>= ?duration (+ {duration})) :condition (and {}) :effect (and {}))",
                    conditions.join(" "),
                    effects.join(" "),
                )
            }),
    ]
}

fn domain() -> impl Strategy<Value = String> {
    let sections = (typed_list(""), typed_list(""), typed_list("?"), condition());
    let body_sections = (constraints(), prop::collection::vec(action(), 0..3));
    (sections, body_sections).prop_map(|((types, constants, head, body), (constraints, actions))| {
        format!(
            "(define (domain d) (:types {types}) (:constants {constants}) (:predicates (p {head})) (:functions (f {head})) (:derived (p {head}) {body}) (:constraints {constraints}) {})",
            actions.join("\n"),
        )
    })
}

fn problem() -> impl Strategy<Value = String> {
    let fact = (name(), prop::collection::vec(name(), 0..3))
        .prop_map(|(name, objects)| format!("({name} {})", objects.join(" ")))
        .boxed();
    let element = prop_oneof![
        fact.clone(),
        fact.clone().prop_map(|fact| format!("(not {fact})")),
        (fact.clone(), number()).prop_map(|(fact, value)| format!("(= {fact} {value})")),
        (fact, "[0-9]{1,3}").prop_map(|(fact, time)| format!("(at {time} {fact})")),
    ];
    let metric = prop_oneof![
        expression(),
        (name(), expression()).prop_map(|(name, summand)| format!("(+ (is-violated {name}) {summand})")),
    ];
    let init = prop::collection::vec(element, 0..5);
    (typed_list(""), init, soft_condition(), constraints(), metric).prop_map(
        |(objects, init, goal, constraints, metric)| {
            format!(
                "(define (problem p) (:domain d) (:objects {objects}) (:init {}) (:constraints {constraints}) (:goal {goal}) (:metric minimize {metric}))",
                init.join(" "),
            )
        },
    )
}

fn parse_and_print_domain(text: &str) -> String {
    let source = Source::new("domain", text);
    let (domain, diagnostics) = parse_domain(&source);
    assert!(!has_errors(&diagnostics), "{}", render(&diagnostics, &[&source], false));
    print_domain(&domain.expect("a domain without errors is read"))
}

fn parse_and_print_problem(text: &str) -> String {
    let source = Source::new("problem", text);
    let (problem, diagnostics) = parse_problem(&source);
    assert!(!has_errors(&diagnostics), "{}", render(&diagnostics, &[&source], false));
    print_problem(&problem.expect("a problem without errors is read"))
}

#[derive(Debug, Clone)]
enum Mutation {
    Delete(usize, usize),
    Insert(usize, String),
    Copy(usize, usize, usize),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let junk = prop_oneof![
        "[()\\[\\];:?= \\-0-9.a-z#é]{0,6}",
        Just("(:action".to_owned()),
        Just("(at start".to_owned()),
        Just("?duration".to_owned()),
        Just("(:goal".to_owned()),
        Just("- (either".to_owned()),
        Just("1e399".to_owned()),
    ];
    let place = 0..10_000_usize;
    prop_oneof![
        (place.clone(), 0..40_usize).prop_map(|(at, length)| Mutation::Delete(at, length)),
        (place.clone(), junk).prop_map(|(at, text)| Mutation::Insert(at, text)),
        (place.clone(), 0..200_usize, place).prop_map(|(from, length, to)| Mutation::Copy(from, length, to)),
    ]
}

fn mutate(text: &str, mutation: &Mutation) -> String {
    let mut characters: Vec<char> = text.chars().collect();
    let count = characters.len();
    let place = |at: usize| at % (count + 1);
    match mutation {
        Mutation::Delete(at, length) => drop(characters.drain(place(*at)..(place(*at) + length).min(count))),
        Mutation::Insert(at, text) => drop(characters.splice(place(*at)..place(*at), text.chars())),
        Mutation::Copy(from, length, to) => {
            let piece = characters[place(*from)..(place(*from) + length).min(count)].to_vec();
            characters.splice(place(*to)..place(*to), piece);
        }
    }
    characters.into_iter().collect()
}

const DOMAIN: &str = "(define (domain robot) (:requirements :typing :adl) (:types dock - place place tool)
 (:constants base - dock) (:predicates (at ?x - place) (link ?x ?y - place) (near ?x ?y - place) (has ?t - tool))
 (:functions (battery) (distance ?x ?y - place) - number)
 (:derived (near ?x ?y - place) (or (link ?x ?y) (exists (?z - place) (and (link ?x ?z) (near ?z ?y)))))
 (:action move :parameters (?x ?y - place) :precondition (and (at ?x) (near ?x ?y) (>= (battery) (distance ?x ?y)))
  :effect (and (not (at ?x)) (at ?y) (decrease (battery) (distance ?x ?y)) (when (has drill) (increase (battery) 0.5))))
 (:durative-action charge :parameters (?d - dock) :duration (and (>= ?duration 1) (<= ?duration (* 2 (battery))))
  :condition (and (over all (at ?d)) (at start (forall (?t - tool) (imply (has ?t) (at base)))))
  :effect (and (at end (assign (battery) (+ 10 ?duration))))))";

const PROBLEM: &str = "(define (problem p) (:domain robot) (:objects a b - place drill - tool)
 (:init (at a) (link a b) (not (link b a)) (= (battery) 10.) (= (distance a b) 2.5) (at 5 (link b base)))
 (:goal (and (at b) (not (has drill)))) (:metric minimize (+ (* 2 (total-time)) (battery))))";

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn printing_a_parsed_domain_is_a_fixpoint(text in domain()) {
        let printed = parse_and_print_domain(&text);
        prop_assert_eq!(parse_and_print_domain(&printed), printed);
    }

    #[test]
    fn printing_a_parsed_problem_is_a_fixpoint(text in problem()) {
        let printed = parse_and_print_problem(&text);
        prop_assert_eq!(parse_and_print_problem(&printed), printed);
    }

    #[test]
    fn mutated_files_never_panic(
        of_domain in prop::collection::vec(mutation(), 0..4),
        of_problem in prop::collection::vec(mutation(), 0..4),
    ) {
        let domain = of_domain.iter().fold(DOMAIN.to_owned(), |text, mutation| mutate(&text, mutation));
        let problem = of_problem.iter().fold(PROBLEM.to_owned(), |text, mutation| mutate(&text, mutation));
        let (domain, problem) = (Source::new("domain", domain), Source::new("problem", problem));
        let found = read(&domain, &problem).map_or_else(Errors::into_vec, |(_, _, found)| found);
        render(&found, &[&domain, &problem], false);
        for source in [&domain, &problem] {
            let (tree, found) = parse_domain(source);
            if let (Some(tree), false) = (tree, has_errors(&found)) {
                parse_and_print_domain(&print_domain(&tree));
            }
        }
    }

    #[test]
    fn any_text_is_read_without_panic(text in "\\PC{0,200}|[()?:; a\n-]{0,200}") {
        let source = Source::new("text", text);
        render(&parse_domain(&source).1, &[&source], false);
        render(&parse_problem(&source).1, &[&source], false);
    }
}

#[test]
fn the_unmodified_files_have_no_errors() {
    let (domain, problem) = (Source::new("domain", DOMAIN), Source::new("problem", PROBLEM));
    let diagnostics =
        read(&domain, &problem).map_or_else(Errors::into_vec, |(_, _, diagnostics)| diagnostics);
    // The domain uses an object of the problem.
    assert_eq!(diagnostics.iter().map(|diagnostic| diagnostic.code).collect::<Vec<_>>(), ["P138"]);
}

fn only_error(precondition: &str) -> &'static str {
    let text = format!(
        "(define (domain d) (:predicates (p)) (:action a :parameters () :precondition {precondition} :effect (p)))"
    );
    let source = Source::new("deep", text);
    let diagnostics = parse_domain(&source).1;
    assert_eq!(diagnostics.len(), 1, "{}", render(&diagnostics, &[&source], false));
    diagnostics[0].code
}

#[test]
fn nesting_is_limited() {
    assert_eq!(only_error(&format!("{}(p){}", "(not ".repeat(100_000), ")".repeat(100_000))), "P103");
    assert_eq!(only_error(&"(".repeat(100_000)), "P103");
    let source = Source::new("closing", format!("(define (domain d)){}", ")".repeat(100_000)));
    assert_eq!(parse_domain(&source).1.len(), 201);
}

#[test]
fn nesting_up_to_the_limit_works() {
    for (open, close) in [("(not ", ")"), ("(and (p) ", ")"), ("(exists (?x) ", ")"), ("(imply (p) ", ")")] {
        let body = format!("{}(p){}", open.repeat(190), close.repeat(190));
        let text = format!(
            "(define (domain d) (:predicates (p)) (:derived (q) {body}) (:action a :parameters () :precondition {body} :effect (p)))"
        );
        let printed = parse_and_print_domain(&text);
        assert_eq!(parse_and_print_domain(&printed), printed);
        let problem = Source::new("problem", "(define (problem p) (:domain d) (:init) (:goal (p)))");
        let diagnostics = read(&Source::new("deep", text), &problem)
            .map_or_else(Errors::into_vec, |(_, _, diagnostics)| diagnostics);
        assert!(!diagnostics.is_empty(), "`q` is not declared");
    }
    let sum = format!("{}1{}", "(+ 1 ".repeat(190), ")".repeat(190));
    let text = format!(
        "(define (domain d) (:functions (f)) (:action a :parameters () :effect (increase (f) {sum})))"
    );
    parse_and_print_domain(&text);
    let effect = format!("{}(p){}", "(when (p) ".repeat(190), ")".repeat(190));
    parse_and_print_domain(&format!(
        "(define (domain d) (:predicates (p)) (:action a :parameters () :effect {effect}))"
    ));
}
