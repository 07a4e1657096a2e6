//! Random tasks in PLANTA's form: the narrowed task, which the planner gets, and the exported task have the
//! same state space.
//!
//! Both tasks are explored by brute force, independently of the planner. The exported task is the oracle of
//! narrowing: it has all axioms, and no fact is evaluated in advance or restricted.

use std::fmt::Write as _;
use std::path::Path;

use fastrand::Rng;
use metaplan::mission::Planning;

use crate::brute::Task;
use crate::files::{Input, metaplan, real, text_of};
use crate::situations::run;

const CLASSES: [&str; 5] = ["Ca", "Cb", "Cc", "Cd", "Ce"];
const PROPERTIES: [&str; 2] = ["pa", "pb"];
const INDIVIDUALS: [&str; 2] = ["i1", "i2"];
/// Larger tasks are skipped.
const MAX_STATES: usize = 300;

struct Texts {
    knowledge: String,
    domain: String,
    problem: String,
}

impl Texts {
    fn write(&self, directory: &Path) -> Input {
        let file = |name: &str, text: &str| {
            let path = directory.join(name);
            std::fs::write(&path, text).expect("the file is written");
            path
        };
        Input {
            domain: file("domain.pddl", &self.domain),
            problem: file("problem.pddl", &self.problem),
            knowledge: file("kb.ofn", &self.knowledge),
            directory: directory.to_owned(),
        }
    }
}

fn knowledge(axioms: &str) -> String {
    let mut text = "Prefix(:=<http://example.org/k#>)\nOntology(<http://example.org/k>\n".to_owned();
    for (kind, names) in
        [("Class", &CLASSES[..]), ("ObjectProperty", &PROPERTIES), ("NamedIndividual", &INDIVIDUALS)]
    {
        for name in names {
            let _ = writeln!(text, "Declaration({kind}(:{name}))");
        }
    }
    text + axioms + ")\n"
}

fn pick<'n>(random: &mut Rng, names: &[&'n str]) -> &'n str {
    names[random.usize(..names.len())]
}

fn axioms(random: &mut Rng) -> String {
    let mut text = String::new();
    // An individual without an assertion would not become an object.
    for individual in INDIVIDUALS {
        let _ = writeln!(text, "ClassAssertion(:Ce :{individual})");
    }
    for class in CLASSES {
        for individual in INDIVIDUALS {
            if random.u8(..10) < 3 {
                let _ = writeln!(text, "ClassAssertion(:{class} :{individual})");
            }
        }
        let superclass = pick(random, &CLASSES);
        if random.u8(..10) < 3 && class != superclass {
            let _ = writeln!(text, "SubClassOf(:{class} :{superclass})");
        }
    }
    for property in PROPERTIES {
        for (axiom, chance) in [("ObjectPropertyDomain", 7), ("ObjectPropertyRange", 7)] {
            if random.u8(..10) < chance {
                let _ = writeln!(text, "{axiom}(:{property} :{})", pick(random, &CLASSES));
            }
        }
        if random.u8(..10) < 3 {
            let [filler, class] = [pick(random, &CLASSES), pick(random, &CLASSES)];
            let _ = writeln!(text, "SubClassOf(ObjectSomeValuesFrom(:{property} :{filler}) :{class})");
        }
        if random.u8(..10) < 3 {
            let [subject, object] = [pick(random, &INDIVIDUALS), pick(random, &INDIVIDUALS)];
            let _ = writeln!(text, "ObjectPropertyAssertion(:{property} :{subject} :{object})");
        }
    }
    text
}

fn inferred(name: &str) -> String {
    format!("inferred-{}{}", name[..1].to_uppercase(), &name[1..])
}

fn condition(random: &mut Rng, has_axiom: bool) -> String {
    let variable = pick(random, &["?x", "?x", "?y"]);
    match random.u8(..if has_axiom { 8 } else { 7 }) {
        0 | 1 => format!("({} {variable})", pick(random, &CLASSES)),
        2..=4 => format!("({} {variable})", inferred(pick(random, &CLASSES))),
        5 => format!("({} ?x ?y)", inferred(pick(random, &PROPERTIES))),
        6 => format!("({} ?x ?y)", pick(random, &PROPERTIES)),
        _ => format!("(usable {variable})"),
    }
}

fn effect(random: &mut Rng) -> String {
    let variable = pick(random, &["?x", "?x", "?y"]);
    let atom = match random.u8(..7) {
        0 | 1 => format!("({} {variable})", pick(random, &CLASSES)),
        2 | 3 => format!("({} ?x ?y)", pick(random, &PROPERTIES)),
        4 => format!("(charged {variable})"),
        _ => format!("(done {variable})"),
    };
    if random.u8(..10) < 2 { format!("(not {atom})") } else { atom }
}

fn texts(seed: u64) -> Texts {
    let mut random = Rng::with_seed(seed);
    let knowledge = knowledge(&axioms(&mut random));
    let mut domain =
        "(define (domain d) (:requirements :strips :derived-predicates :durative-actions)\n (:predicates (done ?x) (charged ?x)"
            .to_owned();
    let has_axiom = random.u8(..10) < 4;
    if has_axiom {
        let [first, second] = [pick(&mut random, &CLASSES), pick(&mut random, &CLASSES)].map(inferred);
        let _ = write!(domain, " (usable ?x))\n (:derived (usable ?x) (and ({first} ?x) ({second} ?x)))");
    } else {
        domain.push(')');
    }
    // The domain concludes a predicate of the knowledge base from a predicate of its own.
    if random.u8(..10) < 3 {
        let _ = write!(domain, "\n (:derived ({} ?x) (charged ?x))", inferred(pick(&mut random, &CLASSES)));
    }
    // PLANTA's form is recognised by an inferred predicate in a condition, so the first action has one.
    for number in 0..random.usize(2..5) {
        let mut conditions = vec![condition(&mut random, has_axiom)];
        if number == 0 {
            conditions.push(format!("({} ?x)", inferred(pick(&mut random, &CLASSES))));
        }
        if random.bool() {
            conditions.push(condition(&mut random, has_axiom));
        }
        let mut effects: Vec<String> = (0..random.usize(1..3)).map(|_| effect(&mut random)).collect();
        let (kind, duration, condition) = if random.u8(..10) < 3 {
            for condition in &mut conditions {
                *condition =
                    format!("({} {condition})", pick(&mut random, &["at start", "over all", "at end"]));
            }
            for effect in &mut effects {
                *effect = format!("(at end {effect})");
            }
            ("durative-action", format!(":duration (= ?duration {})", random.u8(..2)), "condition")
        } else {
            ("action", String::new(), "precondition")
        };
        let _ = write!(
            domain,
            "\n (:{kind} a{number} :parameters (?x ?y) {duration} :{condition} (and {}) :effect (and {}))",
            conditions.join(" "),
            effects.join(" ")
        );
    }
    domain += ")\n";
    let goal = format!(
        "(and (done {}) ({} {}))",
        pick(&mut random, &INDIVIDUALS),
        inferred(pick(&mut random, &CLASSES)),
        pick(&mut random, &INDIVIDUALS)
    );
    let problem = format!("(define (problem p) (:domain d) (:init (charged i1)) (:goal {goal}))\n");
    Texts { knowledge, domain, problem }
}

struct Comparison {
    least_steps: Option<usize>,
}

fn compare(texts: &Texts, name: &str) -> Option<Comparison> {
    let directory = tempfile::tempdir().expect("a directory");
    let mission = texts.write(directory.path()).mission();
    let (filled, _) = mission.filled().unwrap_or_else(|messages| panic!("{}", text_of(&messages)));
    let exported = Task::new(mission.domain(), &filled).explore(MAX_STATES)?;
    let (domain, problem) = mission.narrowed(&filled);
    // The limit is higher, so that additional states of a wrong narrowing are detected instead of skipped.
    let narrowed = Task::new(&domain, &problem).explore(2 * MAX_STATES).expect("as many states");
    let text = format!("{name}\n{}\n{}\n{}", texts.knowledge, texts.domain, texts.problem);
    assert_eq!(narrowed.least_steps, exported.least_steps, "{text}");
    assert_eq!(narrowed.steps, exported.steps, "{text}");
    Some(Comparison { least_steps: exported.least_steps })
}

fn compare_many(seed: u64, tasks: usize) {
    let outcomes = (seed..).filter_map(|seed| compare(&texts(seed), &format!("seed {seed}")));
    let solvable = outcomes.take(tasks).filter(|comparison| comparison.least_steps.is_some()).count();
    assert!(solvable * 10 > tasks, "only {solvable} of {tasks} tasks have a plan");
}

#[test]
fn random_tasks_have_the_states_of_their_export() {
    compare_many(0, 250);
}

#[test]
#[ignore = "10,000 tasks: minutes"]
fn many_random_tasks_have_the_states_of_their_export() {
    compare_many(1_000, 10_000);
}

/// A condition on an inferred predicate is satisfied by all facts that imply the inferred fact, not only by
/// asserted ones. Therefore narrowing must keep actions that add such facts.
#[test]
fn conditions_on_conclusions_do_not_bound_stated_facts() {
    let knowledge = knowledge("ClassAssertion(:Ca :i1)\n");
    let actions = "(:action b :parameters (?x) :precondition (inferred-Cb ?x) :effect (done ?x)))\n";
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done i1)))\n".to_owned();
    let head = "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x)";
    let domains = [
        format!(
            "{head})\n (:action a :parameters (?x) :precondition (inferred-Ca ?x) :effect (Cb ?x))\n {actions}"
        ),
        format!(
            "{head} (usable ?x))\n (:derived (usable ?x) (inferred-Ca ?x))\n \
             (:action a :parameters (?x) :precondition (usable ?x) :effect (Cb ?x))\n {actions}"
        ),
    ];
    for domain in domains {
        let texts = Texts { knowledge: knowledge.clone(), domain, problem: problem.clone() };
        let comparison = compare(&texts, "conclusions").expect("few states");
        assert_eq!(comparison.least_steps, Some(2));
    }
}

/// A class that only one of two actions requires must not restrict the arguments of facts that the other
/// action adds.
#[test]
fn classes_required_by_one_action_do_not_guard_facts_of_others() {
    let knowledge = knowledge(
        "ClassAssertion(:Ca :i1) ClassAssertion(:Ce :i1) ClassAssertion(:Ce :i2) ObjectPropertyDomain(:pa :Ca)\n",
    );
    let domain = "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x))
 (:action a :parameters (?x ?y) :precondition (Ca ?x) :effect (pa ?x ?y))
 (:action c :parameters (?x ?y) :precondition (Ce ?x) :effect (pa ?x ?y))
 (:action b :parameters (?x) :precondition (inferred-Ca ?x) :effect (done ?x)))\n"
        .to_owned();
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done i2)))\n".to_owned();
    let comparison = compare(&Texts { knowledge, domain, problem }, "two actions").expect("few states");
    assert_eq!(comparison.least_steps, Some(2));
}

/// Conditions over all do not apply to the duration 0, so they do not restrict the facts that the action adds.
#[test]
fn conditions_over_all_guard_facts_only_if_the_duration_is_positive() {
    let knowledge = knowledge(
        "ClassAssertion(:Ce :i1) ClassAssertion(:Ca :i2) ClassAssertion(:Cb :i2) ObjectPropertyDomain(:pa :Ca)\n",
    );
    for (duration, value, status) in [
        ("0", "0", "optimal"),
        ("(span)", "0", "optimal"),
        ("1", "1", "unsolvable"),
        ("(+ 1 (span))", "1", "unsolvable"),
    ] {
        let domain = format!(
            "(define (domain d) (:requirements :derived-predicates :durative-actions :numeric-fluents)\n (:functions (span))
 (:durative-action a :parameters (?x ?y) :duration (= ?duration {duration})
  :condition (and (over all (Ca ?x)) (at start (Cb ?y))) :effect (at end (pa ?x ?y))))\n"
        );
        let problem =
            "(define (problem p) (:domain d) (:init (= (span) 0)) (:goal (inferred-Ca i1)))\n".to_owned();
        let directory = tempfile::tempdir().expect("a directory");
        let input = Texts { knowledge: knowledge.clone(), domain, problem }.write(directory.path());
        let (_, stdout, stderr) = metaplan(&input.arguments("plan", &["--format", "json"]));
        let answer: serde_json::Value = serde_json::from_str(&stdout).unwrap_or_else(|_| panic!("{stderr}"));
        assert_eq!(answer["status"], status, "{duration}: {answer}");
        let plan = directory.path().join("plan.txt");
        std::fs::write(&plan, format!("0: (a i1 i2) [{value}]\n")).expect("the plan is written");
        let mut arguments = input.arguments("validate", &[]);
        arguments.insert(3, plan.to_str().expect("UTF-8"));
        let (exit, stdout, stderr) = metaplan(&arguments);
        assert_eq!(exit == 0, status == "optimal", "{duration}: {stdout}{stderr}");
    }
}

/// A variable of a rule may have the name of another rule's variable, followed by `~` and a number.
#[test]
fn variables_of_unfolded_rules_are_not_merged() {
    let knowledge = knowledge(
        "ClassAssertion(:Cc :i1) ClassAssertion(:Ce :i2) ObjectPropertyAssertion(:pb :i1 :i2)
         DLSafeRule(Body(ObjectPropertyAtom(:pa Variable(:x) Variable(<urn:v#x~1>))) Head(ClassAtom(:Ca Variable(:x))))
         DLSafeRule(Body(ObjectPropertyAtom(:pb Variable(:y) Variable(:x)) ClassAtom(:Cc Variable(:z)))
           Head(ObjectPropertyAtom(:pa Variable(:y) Variable(:z))))\n",
    );
    let domain = "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x))
 (:action a :parameters (?x ?y) :precondition (Ca ?x) :effect (pa ?x ?y))
 (:action b :parameters (?x) :precondition (inferred-Ca ?x) :effect (done ?x)))\n"
        .to_owned();
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done i1)))\n".to_owned();
    let comparison = compare(&Texts { knowledge, domain, problem }, "unfolded rules").expect("few states");
    assert_eq!(comparison.least_steps, Some(1));
}

#[test]
fn names_of_companions_can_be_predicates_of_the_domain() {
    let knowledge = knowledge("ClassAssertion(:Ca :i1)\n");
    let domain = "(define (domain d) (:requirements :strips :derived-predicates)
 (:predicates (done ?x) (possible-inferred-Cb ?x))
 (:action a :parameters (?x) :precondition (Ca ?x) :effect (Cb ?x))
 (:action b :parameters (?x) :precondition (and (inferred-Cb ?x) (possible-inferred-Cb ?x)) :effect (done ?x)))\n"
        .to_owned();
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done i1)))\n".to_owned();
    let comparison = compare(&Texts { knowledge, domain, problem }, "companions").expect("few states");
    assert_eq!(comparison.least_steps, None);
}

/// The domain may conclude a predicate of the knowledge base from a predicate that only the domain has, settled
/// or changed by an action.
#[test]
fn conclusions_from_predicates_of_the_domain_are_kept() {
    let knowledge = knowledge("ClassAssertion(:Ca :i1) ClassAssertion(:Ca :i2)\n");
    let problem = "(define (problem p) (:domain d) (:init (charged i1)) (:goal (done i1)))\n".to_owned();
    let changes = ["", "(:action c :parameters (?x) :precondition (Ca ?x) :effect (charged ?x))\n"];
    for change in changes {
        let domain = format!(
            "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x) (charged ?x))
 (:derived (inferred-Cb ?x) (charged ?x))
 {change}(:action b :parameters (?x) :precondition (inferred-Cb ?x) :effect (done ?x)))\n"
        );
        let texts = Texts { knowledge: knowledge.clone(), domain, problem: problem.clone() };
        let comparison = compare(&texts, "predicates of the domain").expect("few states");
        assert_eq!(comparison.least_steps, Some(1));
    }
}

/// A name that a disjunct binds is another variable than the same name in a later conjunct.
#[test]
fn variables_of_disjuncts_are_not_merged_with_later_ones() {
    let knowledge = knowledge(
        "ClassAssertion(:Ca :i1) ClassAssertion(:Cb :i2)
         ObjectPropertyAssertion(:pa :i1 :i2) ObjectPropertyAssertion(:pb :i2 :i1)\n",
    );
    let domain = "(define (domain d)
 (:requirements :strips :derived-predicates :existential-preconditions :disjunctive-preconditions)
 (:predicates (done ?x) (ready ?f))
 (:derived (ready ?f) (and (Ca ?f) (or (exists (?x ?y) (pa ?x ?y)) (Cd ?f)) (exists (?x) (pb ?x ?f))))
 (:action b :parameters (?f) :precondition (and (inferred-Ca ?f) (ready ?f)) :effect (done ?f)))\n"
        .to_owned();
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done i1)))\n".to_owned();
    let comparison = compare(&Texts { knowledge, domain, problem }, "disjuncts").expect("few states");
    assert_eq!(comparison.least_steps, Some(1));
}

#[test]
fn rules_that_require_an_individual_of_nothing_conclude_nothing() {
    let knowledge = knowledge(
        "ClassAssertion(:Ca :i1) SubClassOf(:Ce <http://www.w3.org/2002/07/owl#Nothing>)
         DLSafeRule(Body(ClassAtom(:Ca Variable(:x)) ClassAtom(<http://www.w3.org/2002/07/owl#Nothing> Variable(:x)))
           Head(ClassAtom(:Cb Variable(:x))))\n",
    );
    let domain = "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x))
 (:action b :parameters (?x) :precondition (inferred-Cb ?x) :effect (done ?x)))\n"
        .to_owned();
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done i1)))\n".to_owned();
    let directory = tempfile::tempdir().expect("a directory");
    let input = Texts { knowledge, domain, problem }.write(directory.path());
    let (_, stdout, stderr) = metaplan(&input.arguments("plan", &["--format", "json"]));
    let answer: serde_json::Value = serde_json::from_str(&stdout).unwrap_or_else(|_| panic!("{stderr}"));
    assert_eq!(answer["status"], "unsolvable", "{answer}");
}

/// The second parameter of the head is not a variable of the rule.
#[test]
fn rules_with_a_repeated_variable_in_the_head_capture_no_other_variable() {
    let knowledge = knowledge(
        "ClassAssertion(:Ca :i1) ObjectPropertyAssertion(:pa :i1 :i2)
         DLSafeRule(Body(ObjectPropertyAtom(:pa Variable(:x) Variable(:x_2)))
           Head(ObjectPropertyAtom(:pb Variable(:x) Variable(:x))))\n",
    );
    let domain = "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x))
 (:action b :parameters (?x) :precondition (inferred-Pb ?x ?x) :effect (done ?x)))\n"
        .to_owned();
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done i1)))\n".to_owned();
    let directory = tempfile::tempdir().expect("a directory");
    let input = Texts { knowledge, domain, problem }.write(directory.path());
    let (_, stdout, stderr) = metaplan(&input.arguments("plan", &["--format", "json"]));
    let answer: serde_json::Value = serde_json::from_str(&stdout).unwrap_or_else(|_| panic!("{stderr}"));
    assert_eq!(answer["status"], "optimal", "{answer}");
}

/// An observed fact is used even if no action could have added it: the action requires `Ca`, which is not
/// asserted for `i2`.
#[test]
fn observations_that_violate_a_guard_are_used() {
    let knowledge = knowledge(
        "ClassAssertion(:Ca :i1) ClassAssertion(:Ce :i1) ClassAssertion(:Ce :i2) ObjectPropertyDomain(:pa :Ca)\n",
    );
    let domain = "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x))
 (:action a :parameters (?x ?y) :precondition (Ca ?x) :effect (pa ?x ?y))
 (:action b :parameters (?x) :precondition (inferred-Ca ?x) :effect (done ?x)))\n"
        .to_owned();
    let problem = "(define (problem p) (:domain d) (:init) (:goal (done i2)))\n".to_owned();
    let directory = tempfile::tempdir().expect("a directory");
    let input = Texts { knowledge, domain, problem }.write(directory.path());
    let line = "{\"event\":\"fact_changed\",\"name\":\"pa i2 i1\",\"value\":true}\n";
    let answers = run(&input.arguments("run", &[]), line);
    let first_answer = |kind: &str| answers.iter().find(|answer| answer["answer"] == kind);
    assert!(first_answer("plan_none").is_some() && first_answer("error").is_none(), "{answers:#?}");
    let plan = first_answer("plan_found").unwrap_or_else(|| panic!("{answers:#?}"));
    assert_eq!(plan["steps"].as_array().map(Vec::len), Some(1), "{plan}");
}

/// A domain in this form uses the names of the knowledge base. Entries that map other names, and bindings to
/// queries, would have no effect and are refused at their position.
#[test]
fn bindings_without_effect_are_refused() {
    let texts = texts(1);
    let directory = tempfile::tempdir().expect("a directory");
    let input = texts.write(directory.path());
    let (status, _, stderr) = metaplan(&input.arguments("plan", &["--name", "nobody=i1"]));
    assert!(status == 3 && stderr.contains("M236") && stderr.contains("`--name nobody=i1`"), "{stderr}");
    let manifest = directory.path().join("mission.toml");
    let path = manifest.to_str().expect("UTF-8");
    let files = "name = \"m\"\n[knowledge]\nfiles = [\"kb.ofn\"]\n[planning]\ndomain = \"domain.pddl\"\n\
                 problem = \"problem.pddl\"\n";
    for (section, words) in [
        ("[bindings.names]\nnobody = \"i1\"\n", &["M236", "mission.toml:8:"][..]),
        ("[bindings]\neffort = \"estimation:start\"\n", &["M236", "`effort` is bound"]),
    ] {
        std::fs::write(&manifest, format!("{files}{section}")).expect("the manifest is written");
        let (status, stdout, _) = metaplan(&["lint", path]);
        let has_words = words.iter().all(|word| stdout.contains(word));
        assert!(status == 3 && has_words, "{section}: {stdout}");
    }
}

/// If the knowledge base has no designs, a missing plan is not explained with designs.
#[test]
fn designs_are_not_mentioned_if_there_are_none() {
    let domain = "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x))
 (:action b :parameters (?x) :precondition (inferred-Ca ?x) :effect (done ?x)))\n"
        .to_owned();
    let problem = "(define (problem p) (:domain d) (:objects i2) (:init) (:goal (done i2)))\n".to_owned();
    let directory = tempfile::tempdir().expect("a directory");
    let knowledge = knowledge("ClassAssertion(:Ca :i1)\n");
    let input = Texts { knowledge, domain, problem }.write(directory.path());
    let (status, stdout, stderr) = metaplan(&input.arguments("plan", &[]));
    assert!(status == 10 && stdout.contains("no plan exists"), "{stdout}{stderr}");
    assert!(!stdout.contains("designs") && !stderr.contains("designs"), "{stdout}{stderr}");
}

/// A domain that declares all its `inferred-…` predicates gets no axioms. A predicate that stays empty causes a
/// warning, but not one with facts, effects or axioms of the PDDL files.
#[test]
fn declared_conclusions_without_facts_are_reported() {
    let head = "(define (domain d) (:requirements :strips :derived-predicates)\n (:predicates (done ?x)";
    let declared = "(inferred-Ca ?x) (inferred-Cb ?x)";
    let action = |effect: &str| {
        format!(
            "(:action a :parameters (?x) :precondition (and (inferred-Ca ?x) (inferred-Cb ?x)) :effect {effect}))\n"
        )
    };
    let done = action("(done ?x)");
    let axiom = "(:derived (inferred-Ca ?x) (done ?x))";
    for (domain, init, reported) in [
        (format!("{head} {declared})\n {done}"), "", &["`inferred-Ca`", "`inferred-Cb`"][..]),
        (format!("{head} {declared})\n {done}"), "(inferred-Ca i1)", &["`inferred-Cb`"]),
        (format!("{head} {declared})\n {axiom} {done}"), "(inferred-Cb i1)", &[]),
        (
            format!("{head} {declared})\n {}", action("(and (done ?x) (inferred-Ca ?x))")),
            "",
            &["`inferred-Cb`"],
        ),
        (format!("{head} (inferred-Ca ?x))\n {done}"), "", &[]),
    ] {
        let problem =
            format!("(define (problem p) (:domain d) (:objects i1) (:init {init}) (:goal (done i1)))\n");
        let knowledge = knowledge("ClassAssertion(:Ca :i1) ClassAssertion(:Cb :i1)\n");
        let directory = tempfile::tempdir().expect("a directory");
        let input = Texts { knowledge, domain, problem }.write(directory.path());
        let (_, stdout, stderr) = metaplan(&input.arguments("lint", &[]));
        assert_eq!(stdout.matches("M215").count(), reported.len(), "{stdout}{stderr}");
        for name in reported {
            assert!(stdout.contains(name) && stdout.contains("domain.pddl:2:"), "{name}: {stdout}");
        }
    }
}

/// The public domain, with an inferred predicate instead of one class in its conditions, has the same optimum as
/// its export, and a valid certificate.
#[test]
fn public_domain_with_conclusions_has_the_optimum_of_its_export() {
    let Some(real) = real() else { return };
    let source = real.join("pddl/suave_planta");
    let domain = std::fs::read_to_string(source.join("suave_domain_extended.pddl")).expect("a domain");
    let edits = [
        ("(Function ?f)", "(inferred-Function ?f)"),
        ("(FunctionDesign ?fd_goal)", "(inferred-FunctionDesign ?fd_goal)"),
    ];
    for (class, conclusion) in edits {
        assert!(domain.contains(class), "{class}");
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("domain.pddl");
        std::fs::write(&path, domain.replace(class, conclusion)).expect("the domain is written");
        let input = Input {
            domain: path,
            problem: source.join("suave_problem_extended.pddl"),
            knowledge: real.join("owl/suave_planta/suave_extended.owl"),
            directory: real.join("owl/pddl_tomasys"),
        };
        let text = |path: &Path| path.to_str().expect("UTF-8").to_owned();
        let (proof, exported) =
            (text(&directory.path().join("proof")), text(&directory.path().join("exported")));
        let planned = metaplan(&input.arguments("plan", &["--certificate", &proof]));
        assert!(planned.0 == 0 && planned.1.contains("cost 7: optimal"), "{conclusion}: {planned:?}");
        let verified = metaplan(&["verify", &proof]);
        assert_eq!(verified.0, 0, "{conclusion}: {verified:?}");
        let written = metaplan(&input.arguments("export", &["--to", "pddl", "-o", &exported]));
        assert_eq!(written.0, 0, "{conclusion}: {written:?}");
        let [domain, problem] = ["domain.pddl", "problem.pddl"].map(|name| format!("{exported}/{name}"));
        let planned = metaplan(&["plan", &domain, &problem, "--quiet"]);
        assert!(planned.0 == 0 && planned.1.contains("cost 7: optimal"), "{conclusion}: {planned:?}");
    }
}
