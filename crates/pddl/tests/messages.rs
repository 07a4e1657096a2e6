//! Snapshots of the messages about common mistakes.

use metaplan_pddl::{Errors, Source, parse_domain, read, render};

const DOMAIN: &str = "(define (domain robot)
  (:requirements :typing)
  (:types place - object dock - place tool)
  (:predicates (at ?x - place) (link ?x ?y - place) (has ?t - tool) (fd_available ?t - tool))
  (:functions (battery) (distance ?x ?y - place))
  (:action move
    :parameters (?x ?y - place)
    :precondition (and (at ?x) (link ?x ?y))
    :effect (and (not (at ?x)) (at ?y) (decrease (battery) (distance ?x ?y)))))
";

const PROBLEM: &str = "(define (problem p)
  (:domain robot)
  (:objects a b - place d - dock drill - tool)
  (:init (at a) (link a b) (= (battery) 10) (= (distance a b) 2))
  (:goal (at b)))
";

fn messages(right: &str, wrong: &str) -> String {
    assert!(DOMAIN.contains(right) || PROBLEM.contains(right), "{right}");
    let domain = Source::new("domain.pddl", DOMAIN.replacen(right, wrong, 1));
    let problem = if DOMAIN.contains(right) { PROBLEM.to_owned() } else { PROBLEM.replacen(right, wrong, 1) };
    let problem = Source::new("problem.pddl", problem);
    let diagnostics =
        read(&domain, &problem).map_or_else(Errors::into_vec, |(_, _, diagnostics)| diagnostics);
    let text = render(&diagnostics, &[&domain, &problem], false);
    text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// Different bytes of a file in Latin-1 must not become equal names, but comments may have any encoding.
#[test]
fn names_in_another_encoding_are_refused() {
    let messages = |problem: &[u8]| {
        let (domain, problem) =
            (Source::new("domain.pddl", DOMAIN), Source::from_bytes("problem.pddl", problem));
        let diagnostics =
            read(&domain, &problem).map_or_else(Errors::into_vec, |(_, _, diagnostics)| diagnostics);
        render(&diagnostics, &[&domain, &problem], false)
    };
    assert_eq!(messages(&[b"; caf\xe9\n", PROBLEM.as_bytes()].concat()), "");
    let problem = PROBLEM.replace("a b - place", "a\u{e8} a\u{e9} - place");
    let text = messages(&problem.chars().map(|c| c as u8).collect::<Vec<_>>());
    assert!(text.starts_with("error[P106]"), "{text}");
    assert!(text.contains("problem.pddl:3:13") && text.contains("convert the file to UTF-8"), "{text}");
}

macro_rules! says {
    ($name:ident, $right:literal => $wrong:literal, @$expected:literal) => {
        #[test]
        fn $name() {
            insta::assert_snapshot!(messages($right, $wrong), @$expected);
        }
    };
}

says!(nothing_about_a_correct_file, "(at b)" => "(at b)", @"");
says!(misspelt_predicate, "(at ?x) (link ?x ?y))" => "(at ?x) (lnik ?x ?y))", @r"
    error[P121]: unknown predicate `lnik`
      ┌─ domain.pddl:8:33
      │
    8 │     :precondition (and (at ?x) (lnik ?x ?y))
      │                                 ^^^^
      │
      = help: did you mean `link`?
");
says!(words_in_another_order, "(at a)" => "(at a) (available_fd drill)", @r"
    error[P121]: unknown predicate `available_fd`
      ┌─ problem.pddl:4:18
      │
    4 │   (:init (at a) (available_fd drill) (link a b) (= (battery) 10) (= (distance a b) 2))
      │                  ^^^^^^^^^^^^
      │
      = help: did you mean `fd_available`?
");
says!(misspelt_function, "(decrease (battery)" => "(decrease (batery)", @r"
    error[P122]: unknown function `batery`
      ┌─ domain.pddl:9:51
      │
    9 │     :effect (and (not (at ?x)) (at ?y) (decrease (batery) (distance ?x ?y)))))
      │                                                   ^^^^^^
      │
      = help: did you mean `battery`?
");
says!(function_as_predicate, "(at a)" => "(at a) (battery)", @r"
    error[P121]: unknown predicate `battery`
      ┌─ problem.pddl:4:18
      │
    4 │   (:init (at a) (battery) (link a b) (= (battery) 10) (= (distance a b) 2))
      │                  ^^^^^^^
      │
      = help: `battery` is a function
");
says!(function_of_another_domain, "(= (battery) 10)" => "(= (fuel) 7)", @r"
    error[P122]: unknown function `fuel`
      ┌─ problem.pddl:4:32
      │
    4 │   (:init (at a) (link a b) (= (fuel) 7) (= (distance a b) 2))
      │                                ^^^^
      │
      = help: the domain has to declare it in `:functions`, or it has no meaning here
");
says!(unknown_object, "(link a b)" => "(link a bb)", @r"
    error[P123]: unknown object `bb`
      ┌─ problem.pddl:4:25
      │
    4 │   (:init (at a) (link a bb) (= (battery) 10) (= (distance a b) 2))
      │                         ^^
      │
      = help: did you mean `b`?
");
says!(forgotten_question_mark, "(at ?x) (link ?x ?y))" => "(at x) (link ?x ?y))", @r"
    error[P123]: unknown object `x`
      ┌─ domain.pddl:8:28
      │
    8 │     :precondition (and (at x) (link ?x ?y))
      │                            ^
      │
      = help: did you mean the variable `?x`?
");
says!(unknown_variable, "(at ?y) (decrease" => "(at ?to) (decrease", @r"
    error[P124]: unknown variable `?to`
      ┌─ domain.pddl:9:36
      │
    9 │     :effect (and (not (at ?x)) (at ?to) (decrease (battery) (distance ?x ?y)))))
      │                                    ^^^
");
says!(unknown_type, "drill - tool" => "drill - tol", @r"
    error[P120]: unknown type `tol`
      ┌─ problem.pddl:3:42
      │
    3 │   (:objects a b - place d - dock drill - tol)
      │                                          ^^^
      │
      = help: did you mean `tool`?
");
says!(wrong_arity, "(at a)" => "(at a b)", @r"
    error[P125]: the predicate `at` takes 1 argument, found 2
      ┌─ problem.pddl:4:10
      │
    4 │   (:init (at a b) (link a b) (= (battery) 10) (= (distance a b) 2))
      │          ^^^^^^^^
      │
      = help: it is declared as `(at ?x - place)`
");
says!(wrong_type, "(at a)" => "(at drill)", @r"
    error[P126]: argument 1 of `at` is of type `place`, but `drill` is of type `tool`
      ┌─ problem.pddl:4:14
      │
    4 │   (:init (at drill) (link a b) (= (battery) 10) (= (distance a b) 2))
      │              ^^^^^
");
says!(unclosed_section, "(link ?x ?y - place) (has ?t - tool) (fd_available ?t - tool))" => "(link ?x ?y - place) (has ?t - tool) (fd_available ?t - tool)", @r"
    error[P101]: this parenthesis is not closed before the next section begins
      ┌─ domain.pddl:4:3
      │
    4 │   (:predicates (at ?x - place) (link ?x ?y - place) (has ?t - tool) (fd_available ?t - tool)
      │   ^
      │
      ┌─ domain.pddl:5:4
      │
    5 │   (:functions (battery) (distance ?x ?y - place))
      │    ---------- `:functions` begins here
      │
      = help: add the missing `)` at the end of this section
");
says!(extra_parenthesis, "(at b)))" => "(at b))))", @r"
    error[P102]: this `)` closes nothing
      ┌─ problem.pddl:5:18
      │
    5 │   (:goal (at b))))
      │                  ^
      │
      = help: remove it
");
says!(definition_closed_too_early, "(= (distance a b) 2))" => "(= (distance a b) 2)))", @r"
    error[P102]: this `)` closes the whole definition, but sections follow
      ┌─ problem.pddl:4:66
      │
    4 │   (:init (at a) (link a b) (= (battery) 10) (= (distance a b) 2)))
      │                                                                  ^
      │
      ┌─ problem.pddl:5:4
      │
    5 │   (:goal (at b)))
      │    ----- `:goal` stands outside
      │
      = help: remove one `)` here or before
");
says!(misspelt_section, "(:goal" => "(:gaol", @r"
    error[P109]: a problem has no section `:gaol`
      ┌─ problem.pddl:5:3
      │
    5 │   (:gaol (at b)))
      │   ^^^^^^
      │
      = help: did you mean `:goal`?
");
says!(other_domain, "(:domain robot)" => "(:domain robots)", @r"
    warning[P131]: the problem belongs to the domain `robots`
      ┌─ problem.pddl:2:12
      │
    2 │   (:domain robots)
      │            ^^^^^^
      │
      ┌─ domain.pddl:1:17
      │
    1 │ (define (domain robot)
      │                 ----- this domain has another name
      │
      = help: write `(:domain robot)`; other planners reject the problem
");
says!(missing_goal, "(:goal (at b))" => "", @r"
    error[P110]: the problem has no `:goal`
      ┌─ problem.pddl:1:18
      │
    1 │ (define (problem p)
      │                  ^
      │
      = help: write `(:goal (and …))`
");
says!(several_conditions_without_and, ":precondition (and (at ?x) (link ?x ?y))" => ":precondition (at ?x) (link ?x ?y)", @r"
    error[P106]: expected a keyword such as `:effect`, found `(link …)`
      ┌─ domain.pddl:8:27
      │
    8 │     :precondition (at ?x) (link ?x ?y)
      │                           ^^^^^
      │
      = help: each keyword of an action has one value; several conditions or effects need `(and …)`
");
says!(comparison_as_effect, "(decrease (battery) (distance ?x ?y))" => "(= (battery) 3)", @r"
    error[P106]: `=` is a comparison, expected an effect
      ┌─ domain.pddl:9:40
      │
    9 │     :effect (and (not (at ?x)) (at ?y) (= (battery) 3))))
      │                                        ^^
      │
      = help: numbers are changed by `assign`, `increase`, `decrease`, `scale-up` and `scale-down`
");
says!(time_in_an_instantaneous_action, "(and (at ?x) (link" => "(and (at start (at ?x)) (link", @r"
    error[P115]: a time specifier cannot stand here
      ┌─ domain.pddl:8:24
      │
    8 │     :precondition (and (at start (at ?x)) (link ?x ?y))
      │                        ^^^
      │
      = help: `at start`, `over all` and `at end` are the outermost parts of conditions and effects of durative actions
");
says!(object_fluent_without_its_type, "(at a)" => "(= (place-of drill) a)", @r"
    error[P106]: expected a number, found `a`
      ┌─ problem.pddl:4:30
      │
    4 │   (:init (= (place-of drill) a) (link a b) (= (battery) 10) (= (distance a b) 2))
      │                              ^
      │
      = help: a function with objects as values is declared with their type in `:functions`: `(place-of ?x - tool) - place`
");
says!(misplaced_preference, "(:goal (at b))" => "(:goal (or (at a) (preference p (at b))))", @r"
    error[P106]: a preference cannot stand here
      ┌─ problem.pddl:5:21
      │
    5 │   (:goal (or (at a) (preference p (at b)))))
      │                     ^^^^^^^^^^^
      │
      = help: preferences are parts of goals, preconditions and `:constraints`, below `and` and `forall` only
");
says!(unknown_preference, "(:goal (at b))" => "(:goal (preference drilled (at b))) (:metric minimize (is-violated driled))", @r"
    error[P118]: unknown preference `driled`
      ┌─ problem.pddl:5:70
      │
    5 │   (:goal (preference drilled (at b))) (:metric minimize (is-violated driled)))
      │                                                                      ^^^^^^
      │
      = help: did you mean `drilled`?
");
says!(two_values, "(= (battery) 10)" => "(= (battery) 10) (= (battery) 11)", @r"
    error[P127]: this function has another value already
      ┌─ problem.pddl:4:45
      │
    4 │   (:init (at a) (link a b) (= (battery) 10) (= (battery) 11) (= (distance a b) 2))
      │                                             ^^^^^^^^^^^^^^^^
      │
      ┌─ problem.pddl:4:28
      │
    4 │   (:init (at a) (link a b) (= (battery) 10) (= (battery) 11) (= (distance a b) 2))
      │                            ---------------- it stands here
");
says!(cyclic_types, "place - object dock" => "place - dock dock", @r"
    error[P128]: the type `place` is a subtype of itself
      ┌─ domain.pddl:3:11
      │
    3 │   (:types place - dock dock - place tool)
      │           ^^^^^

    error[P128]: the type `dock` is a subtype of itself
      ┌─ domain.pddl:3:24
      │
    3 │   (:types place - dock dock - place tool)
      │                        ^^^^
");
says!(a_type_above_object, "dock - place tool" => "dock - place object - dock tool", @r"
    error[P128]: the type `object` is a subtype of itself
      ┌─ domain.pddl:3:39
      │
    3 │   (:types place - object dock - place object - dock tool)
      │                                       ^^^^^^
");
says!(negative_cycle, "(:action move" => "(:derived (has ?t - tool) (not (has ?t))) (:action move", @r"
    error[P130]: the derived predicate `has` depends on its own negation
      ┌─ domain.pddl:6:14
      │
    6 │   (:derived (has ?t - tool) (not (has ?t))) (:action move
      │              ^^^
      │
      = help: such axioms have no meaning in PDDL
");
says!(derived_predicate_as_effect, "(:action move" => "(:derived (at ?x - place) (link ?x ?x)) (:action move", @r"
    error[P129]: `at` is derived and cannot be set
      ┌─ domain.pddl:9:24
      │
    9 │     :effect (and (not (at ?x)) (at ?y) (decrease (battery) (distance ?x ?y)))))
      │                        ^^
      │
      = help: set the predicates that it follows from

    error[P129]: `at` is derived and cannot be set
      ┌─ domain.pddl:9:33
      │
    9 │     :effect (and (not (at ?x)) (at ?y) (decrease (battery) (distance ?x ?y)))))
      │                                 ^^
      │
      = help: set the predicates that it follows from

    error[P129]: `at` is derived and cannot be set
      ┌─ problem.pddl:4:11
      │
    4 │   (:init (at a) (link a b) (= (battery) 10) (= (distance a b) 2))
      │           ^^
      │
      = help: set the predicates that it follows from
");

#[test]
fn durative_condition_without_time() {
    let text = "(define (domain d) (:predicates (p))\n (:durative-action a :parameters () :duration (= ?duration 1)\n  :condition (p) :effect (at end (p))))";
    let source = Source::new("domain.pddl", text);
    insta::assert_snapshot!(render(&parse_domain(&source).1, &[&source], false), @r"
    error[P115]: this condition of a durative action has no time specifier
      ┌─ domain.pddl:3:14
      │
    3 │   :condition (p) :effect (at end (p))))
      │              ^^
      │
      = help: write `(at start (…))`, `(over all (…))` or `(at end (…))`
    ");
}

#[test]
fn a_long_line_is_truncated() {
    let text = format!(
        "(define (domain d) (:predicates (p)) {} (:actoin x){})",
        " ".repeat(5_000),
        " ".repeat(5_000)
    );
    let source = Source::new("domain.pddl", text);
    let text_of_message = render(&parse_domain(&source).1, &[&source], false);
    assert!(text_of_message.contains("domain.pddl:1:5039"), "{text_of_message}");
    assert!(text_of_message.len() < 1_500, "{text_of_message}");
}

#[test]
fn colours_are_ansi_escapes() {
    let source = Source::new("domain.pddl", "(define (domain d) (:x))");
    let diagnostics = parse_domain(&source).1;
    let (plain, coloured) = (render(&diagnostics, &[&source], false), render(&diagnostics, &[&source], true));
    assert!(coloured.contains("\u{1b}[") && !plain.contains('\u{1b}'));
}

#[test]
fn the_number_of_messages_about_a_file_is_limited() {
    let source = Source::new("noise", "(a) b ) ".repeat(50_000));
    let diagnostics = parse_domain(&source).1;
    assert_eq!(diagnostics.len(), 201);
    assert!(diagnostics.iter().any(|diagnostic| diagnostic.code == "P119"));
}

#[test]
fn any_number_of_warnings_is_no_error() {
    let domain = Source::new("domain", "(define (domain d) (:predicates (p)))");
    let repeated = |goal: &str| {
        let facts = "(p) ".repeat(300);
        Source::new("problem", format!("(define (problem n) (:domain d) (:init {facts}) (:goal {goal}))"))
    };
    let (_, _, warnings) = read(&domain, &repeated("(p)")).expect("warnings only");
    assert!(warnings.iter().any(|diagnostic| diagnostic.code == "P119"));
    // An error among the messages that are not shown remains an error.
    assert!(read(&domain, &repeated("(q)")).is_err());
}
