//! Tests of derived predicates: comparison with the definition, number of evaluation steps, and interruption
//! of the evaluation.
//!
//! The oracle evaluates every ground instance of every axiom repeatedly until a fixpoint is reached.

use std::cell::Cell;
use std::collections::BTreeSet;
use std::fmt::Write as _;

use proptest::prelude::*;

use metaplan_pddl::ast::{Domain, Problem};
use metaplan_pddl::validate::{Interrupted, Options, PlanText, validate, validate_within};
use metaplan_pddl::{Source, read, render};

fn concat(texts: impl Iterator<Item = String>) -> String {
    texts.fold(String::new(), |joined, text| joined + &text)
}

const OBJECTS: usize = 3;
/// Names of the variables. An inner quantifier may shadow a variable of an outer quantifier or of the head.
const VARIABLES: [&str; 3] = ["?a", "?b", "?c"];
/// Derived predicates with their arity. Only the last predicate may negate others, and no predicate negates
/// it.
const DERIVED: [(&str, usize); 4] = [("p", 1), ("q", 1), ("r", 2), ("s", 1)];
const LAST: usize = 3;

/// Object to which each of the three variables is bound; `None` if unbound or not in scope.
type Scope = [Option<usize>; 3];
type Fact = (usize, Vec<usize>);

#[derive(Debug, Clone)]
enum Condition {
    Edge(usize, usize),
    Derived(usize, [usize; 2]),
    NotEdge(usize, usize),
    /// Negated derived atom in axioms of the last predicate; the atom without negation in other axioms.
    NotDerived(usize, [usize; 2]),
    NotNot(Box<Condition>),
    Equal(usize, usize),
    And(Vec<Condition>),
    Or(Vec<Condition>),
    IfEdge(usize, usize, Box<Condition>),
    Exists(Vec<usize>, Box<Condition>),
    ForAll(Vec<usize>, Box<Condition>),
}

/// Interprets a number as a variable in scope (`Ok`) or an object (`Err`).
fn term(number: usize, scope: &Scope) -> Result<usize, usize> {
    let visible: Vec<usize> = (0..3).filter(|variable| scope[*variable].is_some()).collect();
    if number < OBJECTS || visible.is_empty() {
        Err(number % OBJECTS)
    } else {
        Ok(visible[number % visible.len()])
    }
}

fn object(number: usize, scope: &Scope) -> usize {
    term(number, scope).map_or_else(|object| object, |variable| scope[variable].expect("in scope"))
}

fn term_text(number: usize, scope: &Scope) -> String {
    term(number, scope).map_or_else(|object| format!("o{object}"), |variable| VARIABLES[variable].to_owned())
}

fn each(variables: &[usize], scope: &Scope) -> Vec<Scope> {
    let mut scopes = vec![*scope];
    for variable in variables {
        let with = |scope: Scope| {
            (0..OBJECTS).map(move |object| {
                let mut scope = scope;
                scope[*variable] = Some(object);
                scope
            })
        };
        scopes = scopes.into_iter().flat_map(with).collect();
    }
    scopes
}

impl Condition {
    fn holds(
        &self,
        edges: &BTreeSet<(usize, usize)>,
        facts: &BTreeSet<Fact>,
        last: bool,
        scope: &Scope,
    ) -> bool {
        let holds = |part: &Self, scope: &Scope| part.holds(edges, facts, last, scope);
        let edge = |from: usize, to: usize| edges.contains(&(object(from, scope), object(to, scope)));
        let derived = |predicate: usize, terms: &[usize; 2]| {
            let arguments = terms[..DERIVED[predicate].1].iter().map(|term| object(*term, scope));
            facts.contains(&(predicate, arguments.collect()))
        };
        match self {
            Self::Edge(from, to) => edge(*from, *to),
            Self::NotEdge(from, to) => !edge(*from, *to),
            Self::Derived(predicate, terms) => derived(*predicate, terms),
            Self::NotDerived(predicate, terms) => derived(*predicate, terms) != last,
            Self::NotNot(part) => holds(part, scope),
            Self::Equal(left, right) => object(*left, scope) == object(*right, scope),
            Self::And(parts) => parts.iter().all(|part| holds(part, scope)),
            Self::Or(parts) => parts.iter().any(|part| holds(part, scope)),
            Self::IfEdge(from, to, part) => !edge(*from, *to) || holds(part, scope),
            Self::Exists(variables, part) => each(variables, scope).iter().any(|scope| holds(part, scope)),
            Self::ForAll(variables, part) => each(variables, scope).iter().all(|scope| holds(part, scope)),
        }
    }

    fn text(&self, last: bool, scope: &Scope) -> String {
        let text = |part: &Self| part.text(last, scope);
        let edge =
            |from: usize, to: usize| format!("(edge {} {})", term_text(from, scope), term_text(to, scope));
        let derived = |predicate: usize, terms: &[usize; 2]| {
            let (name, arity) = DERIVED[predicate];
            let terms: Vec<String> = terms[..arity].iter().map(|term| term_text(*term, scope)).collect();
            format!("({name} {})", terms.join(" "))
        };
        let join = |parts: &[Self]| parts.iter().map(text).collect::<Vec<_>>().join(" ");
        let quantified = |word: &str, variables: &[usize], part: &Self| {
            let names: Vec<&str> = variables.iter().map(|variable| VARIABLES[*variable]).collect();
            let mut inner = *scope;
            for variable in variables {
                inner[*variable] = Some(0);
            }
            format!("({word} ({}) {})", names.join(" "), part.text(last, &inner))
        };
        match self {
            Self::Edge(from, to) => edge(*from, *to),
            Self::NotEdge(from, to) => format!("(not {})", edge(*from, *to)),
            Self::NotDerived(predicate, terms) if last => format!("(not {})", derived(*predicate, terms)),
            Self::Derived(predicate, terms) | Self::NotDerived(predicate, terms) => {
                derived(*predicate, terms)
            }
            Self::NotNot(part) => format!("(not (not {}))", text(part)),
            Self::Equal(left, right) => {
                format!("(= {} {})", term_text(*left, scope), term_text(*right, scope))
            }
            Self::And(parts) => format!("(and {})", join(parts)),
            Self::Or(parts) => format!("(or {})", join(parts)),
            Self::IfEdge(from, to, part) => format!("(imply {} {})", edge(*from, *to), text(part)),
            Self::Exists(variables, part) => quantified("exists", variables, part),
            Self::ForAll(variables, part) => quantified("forall", variables, part),
        }
    }
}

fn condition() -> impl Strategy<Value = Condition> {
    let term = || 0..OBJECTS * 3;
    let leaf = prop_oneof![
        2 => (term(), term()).prop_map(|(from, to)| Condition::Edge(from, to)),
        4 => (0..LAST, [term(), term()]).prop_map(|(predicate, terms)| Condition::Derived(predicate, terms)),
        1 => (term(), term()).prop_map(|(from, to)| Condition::NotEdge(from, to)),
        1 => (0..LAST, [term(), term()]).prop_map(|(predicate, terms)| Condition::NotDerived(predicate, terms)),
        1 => (term(), term()).prop_map(|(left, right)| Condition::Equal(left, right)),
    ];
    let variables =
        || prop_oneof![3 => (0..3_usize).prop_map(|variable| vec![variable]), 1 => Just(vec![1, 2])];
    leaf.prop_recursive(4, 16, 3, move |inner| {
        let parts = || prop::collection::vec(inner.clone(), 1..4);
        prop_oneof![
            3 => parts().prop_map(Condition::And),
            2 => parts().prop_map(Condition::Or),
            3 => (variables(), inner.clone()).prop_map(|(bound, part)| Condition::Exists(bound, part.into())),
            1 => (variables(), inner.clone()).prop_map(|(bound, part)| Condition::ForAll(bound, part.into())),
            1 => (term(), term(), inner.clone()).prop_map(|(from, to, part)| Condition::IfEdge(from, to, part.into())),
            1 => inner.clone().prop_map(|part| Condition::NotNot(part.into())),
        ]
    })
}

fn head(predicate: usize) -> Vec<usize> {
    (0..DERIVED[predicate].1).collect()
}

fn fixpoint(edges: &BTreeSet<(usize, usize)>, axioms: &[(usize, Condition)]) -> BTreeSet<Fact> {
    let mut facts = BTreeSet::new();
    for last in [false, true] {
        loop {
            let before = facts.len();
            for (predicate, condition) in
                axioms.iter().filter(|(head_predicate, _)| (*head_predicate == LAST) == last)
            {
                for scope in each(&head(*predicate), &[None; 3]) {
                    if condition.holds(edges, &facts, last, &scope) {
                        facts.insert((*predicate, scope.into_iter().flatten().collect()));
                    }
                }
            }
            if facts.len() == before {
                break;
            }
        }
    }
    facts
}

fn parsed(domain: &str, problem: &str) -> (Domain, Problem) {
    let (domain, problem) = (Source::new("d", domain), Source::new("p", problem));
    match read(&domain, &problem) {
        Ok((domain, problem, _)) => (domain, problem),
        Err(errors) => panic!("{}", render(&errors, &[&domain, &problem], false)),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    #[test]
    fn derived_facts_are_the_least_fixpoint(
        edges in prop::collection::btree_set((0..OBJECTS, 0..OBJECTS), 0..6),
        axioms in prop::collection::vec((0..=LAST, condition()), 1..6),
    ) {
        let mut domain = "(define (domain d) (:predicates (edge ?a ?b) (p ?a) (q ?a) (r ?a ?b) (s ?a))".to_owned();
        for (predicate, condition) in &axioms {
            let parameters = head(*predicate);
            let scope = each(&parameters, &[None; 3])[0];
            let names: Vec<&str> = parameters.iter().map(|parameter| VARIABLES[*parameter]).collect();
            let (name, text) = (DERIVED[*predicate].0, condition.text(*predicate == LAST, &scope));
            let _ = write!(domain, "(:derived ({name} {}) {text})", names.join(" "));
        }
        domain.push(')');
        let init = concat(edges.iter().map(|(from, to)| format!("(edge o{from} o{to})")));
        let facts = fixpoint(&edges, &axioms);
        for (predicate, (name, _)) in DERIVED.iter().enumerate() {
            for scope in each(&head(predicate), &[None; 3]) {
                let arguments: Vec<usize> = scope.into_iter().flatten().collect();
                let names: Vec<String> = arguments.iter().map(|argument| format!("o{argument}")).collect();
                let problem = format!(
                    "(define (problem p) (:domain d) (:objects o0 o1 o2) (:init {init}) (:goal ({name} {})))",
                    names.join(" ")
                );
                let (domain_tree, problem_tree) = parsed(&domain, &problem);
                let verdict = validate(&domain_tree, &problem_tree, &PlanText::default(), &Options::default());
                let expected = facts.contains(&(predicate, arguments));
                prop_assert_eq!(verdict.valid, expected, "{}\n{}", domain, problem);
            }
        }
    }
}

/// Returns a task with a derived predicate `p` along a chain of `length` links. `axiom` is the condition of
/// `p`.
fn chain(length: usize, axiom: &str) -> (Domain, Problem) {
    let domain = format!(
        "(define (domain d) (:predicates (next ?x ?y) (end ?x) (on) (p ?x)) (:derived (p ?x) {axiom})
           (:action switch :parameters () :precondition () :effect (on)))"
    );
    let objects = concat((0..=length).map(|number| format!(" o{number}")));
    let next = concat((0..length).map(|number| format!("(next o{number} o{})", number + 1)));
    let problem = format!(
        "(define (problem p) (:domain d) (:objects{objects}) (:init (end o{length}) {next}) (:goal (p o0)))"
    );
    parsed(&domain, &problem)
}

const JOINED: &str = "(or (and (end ?x) (on)) (exists (?y) (and (next ?x ?y) (p ?y))))";

fn polls(length: usize, axiom: &str) -> u64 {
    let (domain, problem) = chain(length, axiom);
    let plan = PlanText::parse(&Source::new("plan", "(switch)")).expect("a plan");
    let count = Cell::new(0);
    let stop = || {
        count.set(count.get() + 1);
        false
    };
    let verdict = validate_within(&domain, &problem, &plan, &Options::default(), &stop).expect("no limit");
    assert!(verdict.valid, "{:?}", verdict.violation);
    count.get()
}

/// A cubic evaluation would need 64 times as many steps for a chain four times as long.
#[test]
fn a_chain_of_derived_facts_takes_linear_time() {
    let (short, long) = (polls(200, JOINED), polls(800, JOINED));
    assert!(long <= 5 * short, "{short} {long}");
}

#[test]
fn a_validation_ends_when_stop_returns_true() {
    let (domain, problem) = chain(2_000, JOINED);
    let plan = PlanText::parse(&Source::new("plan", "(switch)")).expect("a plan");
    for allowed in [0, 1, 2, 10] {
        let count = Cell::new(0);
        let stop = || {
            count.set(count.get() + 1);
            count.get() > allowed
        };
        let outcome = validate_within(&domain, &problem, &plan, &Options::default(), &stop);
        assert_eq!(outcome.err(), Some(Interrupted), "after {allowed} polls");
    }
}

#[test]
fn quantifiers_may_bind_many_variables() {
    let check = |count: usize, objects: &str, condition: &dyn Fn(&str) -> String| {
        let names = concat((0..count).map(|number| format!(" ?v{number}")));
        let domain = format!(
            "(define (domain d) (:requirements :typing) (:types one) (:predicates (on) (p ?x)) (:action switch :parameters () :precondition {} :effect (on)))",
            condition(&names)
        );
        let problem =
            format!("(define (problem p) (:domain d) (:objects {objects} - one) (:init (p a)) (:goal (on)))");
        let (domain, problem) = parsed(&domain, &problem);
        let plan = PlanText::parse(&Source::new("plan", "(switch)")).expect("a plan");
        let verdict = validate(&domain, &problem, &plan, &Options::default());
        assert!(verdict.valid, "{:?}", verdict.violation);
    };
    check(2_000, "a", &|names| format!("(exists ({names} - one) (not (on)))"));
    check(2_000, "a", &|names| format!("(forall ({names} - one) (not (on)))"));
    check(300, "a b", &|names| {
        let parts = concat(names.split_whitespace().map(|name| format!("(p {name})")));
        format!("(exists ({names} - one) (and {parts}))")
    });
    check(2_000, "a b", &|names| format!("(exists ({names} - one) (not (on)))"));
}

const UNIVERSAL: &str =
    "(and (on) (or (end ?x) (exists (?y) (next ?x ?y))) (forall (?y) (imply (next ?x ?y) (p ?y))))";

/// Each axiom instance visits all objects twice: at its first evaluation, and when the missing fact is
/// derived.
#[test]
fn a_chain_below_a_universal_quantifier_takes_quadratic_time() {
    let (short, long) = (polls(60, UNIVERSAL), polls(240, UNIVERSAL));
    assert!(long <= 20 * short, "{short} {long}");
}
