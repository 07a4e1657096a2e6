//! Compares the validator with an independent interpreter on random tasks: actions with nested quantifiers,
//! conditional effects, a derived predicate, and a function that is undefined for one object.

use proptest::prelude::*;

use metaplan_pddl::validate::{Options, PlanText, Verdict, validate};
use metaplan_pddl::{Source, read, render};

const OBJECTS: usize = 3;

/// An object, or a quantified variable by its distance from its quantifier (de Bruijn index).
#[derive(Debug, Clone, Copy)]
enum Term {
    Object(usize),
    Variable(usize),
}

#[derive(Debug, Clone)]
enum Condition {
    Fact(usize, Term),
    Derived(Term),
    Equal(Term, Term),
    AtLeast(Term, i64),
    Not(Box<Condition>),
    And(Vec<Condition>),
    Or(Vec<Condition>),
    Imply(Box<Condition>, Box<Condition>),
    Exists(bool, Box<Condition>),
    ForAll(bool, Box<Condition>),
}

#[derive(Debug, Clone)]
enum Effect {
    Add(usize, Term),
    Delete(usize, Term),
    Increase(Term, i64),
    When(Condition, Box<Effect>),
    ForAll(bool, Box<Effect>),
}

#[derive(Debug, Clone)]
struct Task {
    facts: [[bool; OBJECTS]; 2],
    derived: Condition,
    actions: Vec<(Condition, Vec<Effect>)>,
    goal: Condition,
    plan: Vec<(usize, usize)>,
}

/// Facts of two predicates, and the values of a function. The last object has no value.
#[derive(Debug, Clone, PartialEq)]
struct State {
    facts: [[bool; OBJECTS]; 2],
    values: [i64; OBJECTS - 1],
}

fn range(of_all: bool) -> std::ops::Range<usize> {
    if of_all { 0..OBJECTS } else { 1..OBJECTS }
}

impl Term {
    /// Returns the object that the term denotes. `scope` contains the objects of the variables, outermost
    /// first. A variable outside of all quantifiers denotes a fixed object.
    fn object(self, scope: &[usize]) -> usize {
        match self {
            Self::Object(object) => object,
            Self::Variable(level) if scope.is_empty() => level % OBJECTS,
            Self::Variable(level) => scope[scope.len() - 1 - level % scope.len()],
        }
    }

    fn text(self, depth: usize) -> String {
        match self {
            Self::Object(object) => format!("o{object}"),
            Self::Variable(level) if depth == 0 => format!("o{}", level % OBJECTS),
            Self::Variable(level) => format!("?v{}", depth - 1 - level % depth),
        }
    }
}

/// Truth value in three-valued logic: true, false, or undefined (`None`).
type Truth = Option<bool>;

fn all_of(parts: impl Iterator<Item = Truth>) -> Truth {
    let parts: Vec<_> = parts.collect();
    if parts.contains(&Some(false)) {
        return Some(false);
    }
    if parts.contains(&None) { None } else { Some(true) }
}

fn any_of(parts: impl Iterator<Item = Truth>) -> Truth {
    all_of(parts.map(|part| part.map(|truth| !truth))).map(|truth| !truth)
}

fn with(scope: &[usize], object: usize) -> Vec<usize> {
    scope.iter().copied().chain([object]).collect()
}

impl Condition {
    fn holds(&self, state: &State, derived: &Self, scope: &[usize]) -> Truth {
        let holds = |part: &Self| part.holds(state, derived, scope);
        match self {
            Self::Fact(predicate, term) => Some(state.facts[*predicate][term.object(scope)]),
            // An axiom with an undefined condition derives nothing.
            Self::Derived(term) => {
                Some(derived.holds(state, derived, &[term.object(scope)]).unwrap_or(false))
            }
            Self::Equal(left, right) => Some(left.object(scope) == right.object(scope)),
            Self::AtLeast(term, least) => state.values.get(term.object(scope)).map(|value| value >= least),
            Self::Not(part) => holds(part).map(|truth| !truth),
            Self::And(parts) => all_of(parts.iter().map(holds)),
            Self::Or(parts) => any_of(parts.iter().map(holds)),
            Self::Imply(left, right) => any_of([holds(left).map(|truth| !truth), holds(right)].into_iter()),
            Self::Exists(of_all, part) => {
                any_of(range(*of_all).map(|object| part.holds(state, derived, &with(scope, object))))
            }
            Self::ForAll(of_all, part) => {
                all_of(range(*of_all).map(|object| part.holds(state, derived, &with(scope, object))))
            }
        }
    }

    fn text(&self, depth: usize) -> String {
        let join = |parts: &[Self]| parts.iter().map(|part| part.text(depth)).collect::<Vec<_>>().join(" ");
        match self {
            Self::Fact(predicate, term) => format!("(p{predicate} {})", term.text(depth)),
            Self::Derived(term) => format!("(derived {})", term.text(depth)),
            Self::Equal(left, right) => format!("(= {} {})", left.text(depth), right.text(depth)),
            Self::AtLeast(term, least) => format!("(>= (f {}) {least})", term.text(depth)),
            Self::Not(part) => format!("(not {})", part.text(depth)),
            Self::And(parts) => format!("(and {})", join(parts)),
            Self::Or(parts) => format!("(or {})", join(parts)),
            Self::Imply(left, right) => format!("(imply {} {})", left.text(depth), right.text(depth)),
            Self::Exists(of_all, part) => {
                format!("(exists ({}) {})", variable(*of_all, depth), part.text(depth + 1))
            }
            Self::ForAll(of_all, part) => {
                format!("(forall ({}) {})", variable(*of_all, depth), part.text(depth + 1))
            }
        }
    }
}

fn variable(of_all: bool, depth: usize) -> String {
    format!("?v{depth} - {}", if of_all { "thing" } else { "part" })
}

impl Effect {
    /// Applies the effect to `after`, with conditions evaluated in `before`. Additions are only recorded in
    /// `added`. Returns `None` if a value is undefined.
    fn apply(
        &self,
        before: &State,
        after: &mut State,
        added: &mut [[bool; OBJECTS]; 2],
        derived: &Condition,
        scope: &[usize],
    ) -> Option<()> {
        match self {
            Self::Add(predicate, term) => added[*predicate][term.object(scope)] = true,
            Self::Delete(predicate, term) => after.facts[*predicate][term.object(scope)] = false,
            Self::Increase(term, by) => *after.values.get_mut(term.object(scope))? += by,
            Self::When(condition, effect) => {
                if condition.holds(before, derived, scope)? {
                    effect.apply(before, after, added, derived, scope)?;
                }
            }
            Self::ForAll(of_all, effect) => {
                for object in range(*of_all) {
                    effect.apply(before, after, added, derived, &with(scope, object))?;
                }
            }
        }
        Some(())
    }

    fn text(&self, depth: usize) -> String {
        match self {
            Self::Add(predicate, term) => format!("(p{predicate} {})", term.text(depth)),
            Self::Delete(predicate, term) => format!("(not (p{predicate} {}))", term.text(depth)),
            Self::Increase(term, by) => format!("(increase (f {}) {by})", term.text(depth)),
            Self::When(condition, effect) => {
                format!("(when {} {})", condition.text(depth), effect.text(depth))
            }
            Self::ForAll(of_all, effect) => {
                format!("(forall ({}) {})", variable(*of_all, depth), effect.text(depth + 1))
            }
        }
    }
}

impl Task {
    /// Executes the plan. Returns the final values of the function. On failure, returns the number of the
    /// step that cannot be executed, from 1, or 0 for the goal.
    fn run(&self) -> Result<[i64; OBJECTS - 1], usize> {
        let mut state = State { facts: self.facts, values: [1; OBJECTS - 1] };
        for (index, (action, object)) in self.plan.iter().enumerate() {
            let (condition, effects) = &self.actions[action % self.actions.len()];
            if condition.holds(&state, &self.derived, &[*object]) != Some(true) {
                return Err(index + 1);
            }
            let (mut after, mut added) = (state.clone(), [[false; OBJECTS]; 2]);
            for effect in effects {
                effect.apply(&state, &mut after, &mut added, &self.derived, &[*object]).ok_or(index + 1)?;
            }
            for (facts, added) in after.facts.iter_mut().zip(added) {
                facts.iter_mut().zip(added).for_each(|(fact, added)| *fact |= added);
            }
            state = after;
        }
        if self.goal.holds(&state, &self.derived, &[]) == Some(true) { Ok(state.values) } else { Err(0) }
    }

    fn texts(&self) -> (String, String, String) {
        let actions = self.actions.iter().enumerate().map(|(index, (condition, effects))| {
            let effects: Vec<_> = effects.iter().map(|effect| effect.text(1)).collect();
            let condition = condition.text(1);
            format!(
                "(:action a{index} :parameters (?v0 - thing) :precondition {condition} :effect (and {}))",
                effects.join(" ")
            )
        });
        let domain = format!(
            "(define (domain d) (:types part - thing) (:predicates (p0 ?x - thing) (p1 ?x - thing) (derived ?x - thing))
             (:functions (f ?x - thing)) (:constants o0 - thing o1 o2 - part) (:derived (derived ?v0 - thing) {}) {})",
            self.derived.text(1),
            actions.collect::<Vec<_>>().join("\n"),
        );
        let facts = self.facts.iter().enumerate().flat_map(|(predicate, facts)| {
            let holding = facts.iter().enumerate().filter(|(_, holds)| **holds);
            holding.map(move |(object, _)| format!("(p{predicate} o{object})"))
        });
        let problem = format!(
            "(define (problem p) (:domain d) (:init (= (f o0) 1) (= (f o1) 1) {}) (:goal {}))",
            facts.collect::<Vec<_>>().join(" "),
            self.goal.text(0),
        );
        let steps = self
            .plan
            .iter()
            .map(|(action, object)| format!("(a{} o{object})\n", action % self.actions.len()));
        (domain, problem, steps.collect::<Vec<_>>().concat())
    }
}

fn term() -> impl Strategy<Value = Term> {
    prop_oneof![(0..OBJECTS).prop_map(Term::Object), (0..3_usize).prop_map(Term::Variable)]
}

fn condition(with_derived: bool) -> BoxedStrategy<Condition> {
    let derived = if with_derived { 2 } else { 0 };
    let leaf = prop_oneof![
        4 => (0..2_usize, term()).prop_map(|(predicate, term)| Condition::Fact(predicate, term)),
        derived => term().prop_map(Condition::Derived),
        1 => (term(), term()).prop_map(|(left, right)| Condition::Equal(left, right)),
        1 => (term(), 0..4_i64).prop_map(|(term, least)| Condition::AtLeast(term, least)),
    ];
    let tree = leaf.prop_recursive(3, 10, 3, |inner| {
        let several = prop::collection::vec(inner.clone(), 0..4);
        prop_oneof![
            inner.clone().prop_map(|part| Condition::Not(Box::new(part))),
            several.clone().prop_map(Condition::And),
            several.prop_map(Condition::Or),
            (inner.clone(), inner.clone())
                .prop_map(|(left, right)| Condition::Imply(Box::new(left), Box::new(right))),
            (any::<bool>(), inner.clone())
                .prop_map(|(of_all, part)| Condition::Exists(of_all, Box::new(part))),
            (any::<bool>(), inner).prop_map(|(of_all, part)| Condition::ForAll(of_all, Box::new(part))),
        ]
    });
    tree.boxed()
}

fn effect() -> impl Strategy<Value = Effect> {
    let leaf = prop_oneof![
        3 => (0..2_usize, term()).prop_map(|(predicate, term)| Effect::Add(predicate, term)),
        3 => (0..2_usize, term()).prop_map(|(predicate, term)| Effect::Delete(predicate, term)),
        1 => (term(), 1..3_i64).prop_map(|(term, by)| Effect::Increase(term, by)),
    ];
    leaf.prop_recursive(2, 4, 1, |inner| {
        prop_oneof![
            (condition(true), inner.clone())
                .prop_map(|(condition, effect)| Effect::When(condition, Box::new(effect))),
            (any::<bool>(), inner).prop_map(|(of_all, effect)| Effect::ForAll(of_all, Box::new(effect))),
        ]
    })
}

fn task() -> impl Strategy<Value = Task> {
    // The precondition is a disjunction with facts that often hold; otherwise most plans would fail at their
    // first step.
    let precondition = condition(true).prop_map(|condition| {
        Condition::Or(vec![
            condition,
            Condition::Fact(0, Term::Variable(0)),
            Condition::Fact(1, Term::Object(0)),
        ])
    });
    let action = (precondition, prop::collection::vec(effect(), 1..4));
    (
        any::<[[bool; OBJECTS]; 2]>(),
        condition(false),
        prop::collection::vec(action, 1..3),
        condition(true),
        prop::collection::vec((0..2_usize, 0..OBJECTS), 0..4),
    )
        .prop_map(|(facts, derived, actions, goal, plan)| Task { facts, derived, actions, goal, plan })
}

fn check(task: &Task) {
    let (domain_text, problem_text, plan) = task.texts();
    let (domain, problem) = (Source::new("domain", domain_text), Source::new("problem", problem_text));
    let (domain_tree, problem_tree) = match read(&domain, &problem) {
        Ok((domain, problem, _)) => (domain, problem),
        Err(errors) => panic!("{}", render(&errors, &[&domain, &problem], false)),
    };
    let plan_tree = PlanText::parse(&Source::new("plan", plan.clone())).expect("the plan can be read");
    let verdict = validate(&domain_tree, &problem_tree, &plan_tree, &Options::default());
    // If the actions are separated in time, they have the same effects in concurrent execution.
    let timed: Vec<_> = plan.lines().enumerate().map(|(index, step)| format!("{index}: {step}\n")).collect();
    let timed = PlanText::parse(&Source::new("timed plan", timed.concat())).expect("the plan can be read");
    let options = Options::default().with_concurrent(true);
    let concurrent = validate(&domain_tree, &problem_tree, &timed, &options);
    let failure =
        |verdict: &Verdict| verdict.violation.as_ref().map(|violation| (violation.step, violation.kind));
    assert_eq!((failure(&concurrent), &concurrent.values), (failure(&verdict), &verdict.values));
    let outcome = match &verdict.violation {
        None => Ok(()),
        Some(violation) => Err(violation.step.unwrap_or(0)),
    };
    let expected = task.run();
    assert_eq!(
        outcome,
        expected.map(|_| ()),
        "{}\n{}\n{plan}{:?}",
        domain.text(),
        problem.text(),
        verdict.violation
    );
    let Ok(values) = expected else { return };
    for (name, value) in &verdict.values {
        let Some(object) = name.strip_prefix("(f o").and_then(|rest| rest.strip_suffix(')')) else {
            continue;
        };
        let object: usize = object.parse().expect("objects are numbered");
        assert_eq!(value.to_string(), values[object].to_string(), "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn validator_and_interpreter_agree(task in task()) {
        check(&task);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    #[ignore = "takes a minute"]
    fn validator_and_interpreter_agree_on_many(task in task()) {
        check(&task);
    }
}
