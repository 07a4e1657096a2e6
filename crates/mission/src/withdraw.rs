//! Removes facts of a predicate from a task: from the initial state, and from the conclusions of the axioms.

use std::borrow::Cow;
use std::collections::HashSet;

use pddl::ast::{Condition, Derived, Domain, InitialElement, Name, Problem, Span, Term, TypedName};

/// Removes the facts `(predicate FIRST SECOND)` with an argument in each of two lists: from the initial state, and from
/// the conclusions of the axioms. Actions may still add such facts.
pub(crate) fn withdraw(
    domain: &mut Cow<'_, Domain>,
    problem: &mut Problem,
    predicate: &Name,
    (first, second): (&[Name], &[Name]),
) {
    let is_withdrawn = |element: &InitialElement| match element {
        InitialElement::Fact(atom) if atom.predicate.name == *predicate => match &atom.arguments[..] {
            [subject, object] => first.contains(subject.name()) && second.contains(object.name()),
            _ => false,
        },
        _ => false,
    };
    problem.init.retain(|element| !is_withdrawn(element));
    // The knowledge base may have names that are no objects of the problem.
    let objects: HashSet<&Name> =
        domain.constants.iter().chain(&problem.objects).map(|object| &object.identifier.name).collect();
    let [first, second] = [first, second]
        .map(|names| names.iter().filter(|name| objects.contains(name)).cloned().collect::<Vec<_>>());
    let concludes = |axiom: &Derived| axiom.head.identifier.name == *predicate;
    if first.is_empty() || second.is_empty() || !domain.derived.iter().any(concludes) {
        return;
    }
    for axiom in domain.to_mut().derived.iter_mut().filter(|axiom| concludes(axiom)) {
        let [subject, object] = &axiom.head.parameters[..] else { continue };
        let remains = Condition::Or(vec![differs(subject, &first), differs(object, &second)]);
        let condition = std::mem::replace(&mut axiom.condition, Condition::And(Vec::new()));
        axiom.condition = Condition::And(vec![condition, remains]);
    }
}

/// Returns the condition that a parameter differs from all objects.
fn differs(parameter: &TypedName, objects: &[Name]) -> Condition {
    let differs_from = |object: &Name| {
        let parameter = Term::Variable(parameter.identifier.clone());
        let equal = Condition::Equal(parameter, Term::Constant(object.clone().into()), Span::default());
        Condition::Not(Box::new(equal))
    };
    Condition::And(objects.iter().map(differs_from).collect())
}
