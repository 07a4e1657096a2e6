//! Narrowing: computes a smaller task with the same plans, for the planner.
//!
//! The knowledge base completes a domain in PLANTA's form with hundreds of axioms, but actions change few of
//! their conclusions. Derived predicates that no action can change become initial facts (`settle`, `fold`).
//! Other derived predicates get an upper bound where possible: a static predicate that is true wherever the
//! derived predicate can be true (`possible`), so that grounding enumerates few objects.
//!
//! Only the planner uses narrowing. Messages, exports and certificates are about the task before
//! narrowing, with which the checker compares the ground task.

mod clause;
mod fold;
mod possible;
mod settle;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashSet};

use ::mission::Mission;
use pddl::ast::{Atom, Domain, InitialElement, Name, Problem, Span, Term, TypeExpression};
use pddl::{Mentioned, TypeHierarchy};

use clause::Fact;
use fold::Folded;
use settle::Guards;

/// Returns a domain and a problem with the same plans as the given ones. They are narrowed if the mission's
/// knowledge base has completed the domain (PLANTA's form), otherwise unchanged.
///
/// `domain` and `problem` may be variants of the mission's own files, with another state or goal.
pub(crate) fn narrowed<'t>(
    mission: &Mission,
    domain: &'t Domain,
    problem: &'t Problem,
) -> (Cow<'t, Domain>, Cow<'t, Problem>) {
    match mission.completed_predicates() {
        Some(completed) => {
            let (domain, problem) = narrow(domain, problem, completed);
            (Cow::Owned(domain), Cow::Owned(problem))
        }
        None => (Cow::Borrowed(domain), Cow::Borrowed(problem)),
    }
}

/// Computes a smaller domain and problem. Removes unused derived predicates. Of the others, changes only those in
/// `completed`, and those whose axioms mention only such predicates and bind all their variables. `completed` contains the predicates of the knowledge
/// base; the domain can have axioms of its own for them. Other predicates, e.g. of maps and tasks, may have large
/// extensions, so grounding handles them.
fn narrow(domain: &Domain, problem: &Problem, completed: &HashSet<Name>) -> (Domain, Problem) {
    let mentioned = Mentioned::by_domain(domain).and_problem(problem);
    let facts_of = |is_needed: &dyn Fn(&Name) -> bool| -> BTreeSet<Fact> {
        let facts = problem.init.iter().filter_map(InitialElement::fact);
        facts.filter(|(predicate, _)| is_needed(predicate)).collect()
    };
    let facts = facts_of(&|predicate| completed.contains(predicate));
    let heads = domain.derived.iter().map(|axiom| &axiom.head.identifier.name);
    let varying = mentioned.changed.iter().chain(heads).cloned().collect();
    let guarding = settle::with_certain_conditions(domain, problem);
    let mut guards: Guards = settle::guards(&guarding, &varying, &mentioned.timed);
    guards.retain(|guard @ (predicate, _, class)| {
        completed.contains(predicate)
            && completed.contains(class)
            && facts.iter().all(|fact| settle::keeps(fact, guard, &facts))
    });
    let folded = Folded::new(&guarding, (&mentioned.changed, &mentioned.timed), &guards, completed);
    // An axiom of the domain can conclude a predicate of the knowledge base from a predicate of the domain.
    let premises = folded.premises();
    let facts = facts_of(&|predicate| completed.contains(predicate) || premises.contains(predicate));
    let (mut domain, mut problem) = (domain.clone(), problem.clone());
    folded.shorten(&mut domain);
    drop_unused(&mut domain, &problem);
    let objects = domain.constants.iter().chain(&problem.objects);
    let names: BTreeSet<Name> = objects.clone().map(|object| object.identifier.name.clone()).collect();
    let mut types: BTreeMap<&Name, Vec<&TypeExpression>> = BTreeMap::new();
    for object in objects {
        types.entry(&object.identifier.name).or_default().push(&object.r#type);
    }
    let hierarchy = TypeHierarchy::of(&domain);
    let is_of = |object: &Name, r#type: &Name| {
        let expected = TypeExpression { alternatives: vec![r#type.clone().into()] };
        types.get(object).is_some_and(|types_of_object| {
            types_of_object.iter().any(|expression| hierarchy.fits(expression, &expected))
        })
    };
    let conclusions = folded.facts(&facts, &names, &is_of);
    let conclusions = conclusions.into_iter().filter(|fact| !facts.contains(fact));
    problem.init.extend(conclusions.map(|(predicate, arguments)| {
        let arguments = arguments.into_iter().map(|name| Term::Constant(name.into())).collect();
        InitialElement::Fact(Atom { span: Span::default(), predicate: predicate.into(), arguments })
    }));
    (domain, problem)
}

/// Removes the axioms and declarations of derived predicates on which no action, goal, metric or
/// remaining predicate depends.
fn drop_unused(domain: &mut Domain, problem: &Problem) {
    let derived = std::mem::take(&mut domain.derived);
    let mut used = Mentioned::by_domain(domain).and_problem(problem).predicates;
    loop {
        let mut mentioned = Mentioned::default();
        for axiom in derived.iter().filter(|axiom| used.contains(&axiom.head.identifier.name)) {
            mentioned.condition(&axiom.condition);
        }
        let count = used.len();
        used.extend(mentioned.predicates);
        if used.len() == count {
            break;
        }
    }
    let (needed, unused): (Vec<_>, Vec<_>) =
        derived.into_iter().partition(|axiom| used.contains(&axiom.head.identifier.name));
    domain.derived = needed;
    let unused: BTreeSet<Name> = unused.into_iter().map(|axiom| axiom.head.identifier.name).collect();
    domain.predicates.retain(|declared| !unused.contains(&declared.identifier.name));
}
