//! The predicates and types that a domain and a problem mention.

use std::collections::BTreeSet;

use pddl::Mentioned;
use pddl::ast::{Domain, Name, Problem, TypeExpression};

/// The predicates that a domain uses in conditions and effects and that it declares nowhere.
pub(super) fn undeclared(domain: &Domain) -> BTreeSet<Name> {
    let mut used = Mentioned::by_domain(domain).predicates;
    for declared in &domain.predicates {
        used.remove(&declared.identifier.name);
    }
    used
}

/// The types that a domain or a problem gives to parameters, constants and objects.
pub(super) fn types(domain: &Domain, problem: &Problem) -> BTreeSet<Name> {
    let mut found = BTreeSet::new();
    let mut note = |r#type: &TypeExpression| {
        found.extend(r#type.alternatives.iter().map(|alternative| alternative.name.clone()));
    };
    let parameters = domain.actions.iter().flat_map(|action| &action.parameters);
    let heads = domain.derived.iter().flat_map(|axiom| &axiom.head.parameters);
    let declared = domain.predicates.iter().flat_map(|declared| &declared.parameters);
    let named = domain.types.iter().chain(&domain.constants).chain(&problem.objects);
    for entry in named.clone().chain(parameters).chain(heads).chain(declared) {
        note(&entry.r#type);
    }
    found.extend(domain.types.iter().map(|entry| entry.identifier.name.clone()));
    found
}
