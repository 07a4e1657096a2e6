//! Collects the predicates that a domain uses but does not declare, and the types that a domain and a problem use.

use std::collections::BTreeSet;

use pddl::Mentioned;
use pddl::ast::{Domain, Name, Problem, TypeExpression};

pub(super) fn undeclared(domain: &Domain) -> BTreeSet<Name> {
    let mut used = Mentioned::by_domain(domain).predicates;
    for declared in &domain.predicates {
        used.remove(&declared.identifier.name);
    }
    used
}

/// Returns the declared types and their supertypes, and the types of constants, objects, and parameters of actions,
/// axioms and predicates.
pub(super) fn types(domain: &Domain, problem: &Problem) -> BTreeSet<Name> {
    let mut types = BTreeSet::new();
    let mut note = |r#type: &TypeExpression| {
        types.extend(r#type.alternatives.iter().map(|alternative| alternative.name.clone()));
    };
    let parameters = domain.actions.iter().flat_map(|action| &action.parameters);
    let heads = domain.derived.iter().flat_map(|axiom| &axiom.head.parameters);
    let declared = domain.predicates.iter().flat_map(|declared| &declared.parameters);
    let named = domain.types.iter().chain(&domain.constants).chain(&problem.objects);
    for entry in named.clone().chain(parameters).chain(heads).chain(declared) {
        note(&entry.r#type);
    }
    types.extend(domain.types.iter().map(|entry| entry.identifier.name.clone()));
    types
}
