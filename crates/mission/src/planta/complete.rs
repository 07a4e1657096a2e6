//! What a domain lacks that asks a knowledge base: types, constants and predicates.

use std::collections::BTreeSet;

use pddl::TypeHierarchy;
use pddl::ast::{Declaration, Domain, Identifier, Name, Problem, TypedName};

use super::names::{self, EQUAL, LESS};
use super::syntax::{object, typed, untyped};
use super::terms::Terms;
use crate::message::Message;

impl Terms {
    /// Numbers keep the names that the files give them.
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

    /// Types of individuals and numbers, and those that only objects mention.
    pub(super) fn declare_types(
        &self,
        domain: &mut Domain,
        problem: &Problem,
        number: &Name,
        warnings: &mut Vec<Message>,
    ) {
        let mut known: BTreeSet<Name> = domain.types.iter().map(|own| own.identifier.name.clone()).collect();
        known
            .extend(domain.types.iter().flat_map(|own| &own.r#type.alternatives).map(|own| own.name.clone()));
        known.insert(Name::new("object"));
        let typed: BTreeSet<&Name> = self.constants.values().flatten().chain([number]).collect();
        for name in typed {
            if known.insert(name.clone()) {
                domain.types.push(object(name.clone(), None));
            }
        }
        let objects = domain.constants.iter().chain(&problem.objects);
        let mentioned: Vec<Identifier> =
            objects.flat_map(|object| object.r#type.alternatives.clone()).collect();
        for r#type in mentioned {
            if known.insert(r#type.name.clone()) {
                let text = format!(
                    "the type `{}` of objects is declared nowhere, and nothing else is of that type",
                    r#type.name
                );
                warnings.push(Message::warning("M213", text));
                domain.types.push(object(r#type.name, None));
            }
        }
    }

    /// Individuals, values, and the numbers that rules or the files name.
    pub(super) fn declare_constants(
        &self,
        domain: &mut Domain,
        problem: &Problem,
        number: &Name,
        mentioned: &BTreeSet<Name>,
    ) {
        let mut known: BTreeSet<Name> =
            domain.constants.iter().map(|own| own.identifier.name.clone()).collect();
        for (name, r#type) in &self.constants {
            if known.insert(name.clone()) {
                // An object of the problem that the ontology gives no type keeps its own.
                let own = problem.objects.iter().find(|object| object.identifier.name == *name);
                let r#type = match (r#type, own) {
                    (None, Some(own)) => own.r#type.clone(),
                    (r#type, _) => typed(r#type.clone()),
                };
                domain.constants.push(TypedName { identifier: name.clone().into(), r#type });
            }
        }
        known.extend(problem.objects.iter().map(|object| object.identifier.name.clone()));
        let mentioned = mentioned.iter().filter(|name| names::number(name).is_some());
        for name in self.numbers.iter().chain(mentioned) {
            if known.insert(name.clone()) {
                domain.constants.push(object(name.clone(), Some(number.clone())));
            }
        }
    }

    /// Classes and properties, stated and inferred, and how numbers compare.
    pub(super) fn declare_predicates(&self, domain: &mut Domain) {
        let mut known: BTreeSet<Name> =
            domain.predicates.iter().map(|own| own.identifier.name.clone()).collect();
        let compared = [LESS, EQUAL].map(|name| (Name::new(name), 2));
        let own = self.predicates.iter().map(|(name, arity)| (name.clone(), *arity));
        for (name, arity) in own.chain(compared) {
            if known.insert(name.clone()) {
                let parameters = untyped(&["x", "y"][..arity]);
                domain.predicates.push(Declaration { identifier: name.into(), parameters });
            }
        }
    }
}

/// Objects of the problem that are constants of the domain, too, and of a type that is declared nowhere: what counts is the constant.
pub(super) fn drop_repeated(domain: &Domain, problem: &mut Problem) -> Vec<Message> {
    let hierarchy = TypeHierarchy::of(domain);
    let unknown = |object: &TypedName| {
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
        let Some(r#type) = unknown(object).filter(|_| is_constant) else { return true };
        let text = format!(
            "`{name}` is a constant of the domain; its type in the problem, `{type}`, is declared nowhere"
        );
        warnings.push(Message::warning("M213", text));
        false
    });
    warnings
}
