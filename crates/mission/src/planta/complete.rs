//! Completes a PLANTA domain with the types, constants and predicates of the knowledge base.

use std::collections::BTreeSet;

use pddl::TypeHierarchy;
use pddl::ast::{Declaration, Domain, Identifier, Name, Problem, TypedName};

use super::names::{self, EQUAL, LESS};
use super::syntax::{object, typed, untyped};
use super::terms::Terms;
use crate::message::Message;

impl Terms {
    /// Records the names that the PDDL files use for numbers, such as `0.25_decimal`. These names
    /// take precedence.
    pub(super) fn name_numbers(&mut self, domain: &Domain, problem: &Problem, mentioned: &BTreeSet<Name>) {
        let declared = domain.constants.iter().chain(&problem.objects);
        let declared = declared.map(|object| &object.identifier.name);
        let mut literals = names::Literals::default();
        for name in declared.chain(mentioned) {
            if let Some(value) = names::number(name) {
                literals.insert(value, name.clone());
            }
        }
        self.literals.prefer(literals);
    }

    pub(super) fn declare_types(
        &self,
        domain: &mut Domain,
        problem: &Problem,
        number: &Name,
        warnings: &mut Vec<Message>,
    ) {
        let mut declared: BTreeSet<Name> =
            domain.types.iter().map(|entry| entry.identifier.name.clone()).collect();
        declared.extend(
            domain
                .types
                .iter()
                .flat_map(|entry| &entry.r#type.alternatives)
                .map(|parent| parent.name.clone()),
        );
        declared.insert(Name::new("object"));
        let typed: BTreeSet<&Name> = self.constants.values().flatten().chain([number]).collect();
        for name in typed {
            if declared.insert(name.clone()) {
                domain.types.push(object(name.clone(), None));
            }
        }
        let objects = domain.constants.iter().chain(&problem.objects);
        let mentioned: Vec<Identifier> =
            objects.flat_map(|object| object.r#type.alternatives.clone()).collect();
        for r#type in mentioned {
            if declared.insert(r#type.name.clone()) {
                let text = format!(
                    "the type `{}` of objects is declared nowhere, and nothing else is of that type",
                    r#type.name
                );
                warnings.push(Message::warning("M213", text));
                domain.types.push(object(r#type.name, None));
            }
        }
    }

    pub(super) fn declare_constants(
        &self,
        domain: &mut Domain,
        problem: &Problem,
        number: &Name,
        mentioned: &BTreeSet<Name>,
    ) {
        let mut declared: BTreeSet<Name> =
            domain.constants.iter().map(|constant| constant.identifier.name.clone()).collect();
        for (name, r#type) in &self.constants {
            if declared.insert(name.clone()) {
                // An object of the problem keeps its own type if the ontology gives the individual
                // none.
                let object_of_problem = problem.objects.iter().find(|object| object.identifier.name == *name);
                let r#type = match (r#type, object_of_problem) {
                    (None, Some(object_of_problem)) => object_of_problem.r#type.clone(),
                    (r#type, _) => typed(r#type.clone()),
                };
                domain.constants.push(TypedName { identifier: name.clone().into(), r#type });
            }
        }
        declared.extend(problem.objects.iter().map(|object| object.identifier.name.clone()));
        let mentioned = mentioned.iter().filter(|name| names::number(name).is_some());
        for name in self.numbers.iter().chain(mentioned) {
            if declared.insert(name.clone()) {
                domain.constants.push(object(name.clone(), Some(number.clone())));
            }
        }
    }

    pub(super) fn declare_predicates(&self, domain: &mut Domain) {
        let mut declared: BTreeSet<Name> =
            domain.predicates.iter().map(|predicate| predicate.identifier.name.clone()).collect();
        let compared = [LESS, EQUAL].map(|name| (Name::new(name), 2));
        let predicates = self.predicates.iter().map(|(name, arity)| (name.clone(), *arity));
        for (name, arity) in predicates.chain(compared) {
            if declared.insert(name.clone()) {
                let parameters = untyped(&["x", "y"][..arity]);
                domain.predicates.push(Declaration { identifier: name.into(), parameters });
            }
        }
    }
}

/// Removes objects of the problem that are also constants of the domain and whose type is
/// undeclared; the constant takes precedence. Returns warnings.
pub(super) fn drop_repeated(domain: &Domain, problem: &mut Problem) -> Vec<Message> {
    let hierarchy = TypeHierarchy::of(domain);
    let undeclared_type = |object: &TypedName| {
        object
            .r#type
            .alternatives
            .iter()
            .find(|own| !hierarchy.contains(&own.name))
            .map(|own| own.name.clone())
    };
    let mut warnings = Vec::new();
    problem.objects.retain(|object| {
        let name = &object.identifier.name;
        let is_constant = domain.constants.iter().any(|constant| constant.identifier.name == *name);
        let Some(r#type) = undeclared_type(object).filter(|_| is_constant) else { return true };
        let text = format!(
            "`{name}` is a constant of the domain; its type in the problem, `{type}`, is declared nowhere"
        );
        warnings.push(Message::warning("M213", text));
        false
    });
    warnings
}
