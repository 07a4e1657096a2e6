//! Resolves `[bindings.names]` for a knowledge base and a problem: computes the object names of
//! individuals and reports invalid entries.

use std::collections::{BTreeMap, BTreeSet};

use ontology::tomasys::{CalledNames, Individual};
use pddl::TypeHierarchy;
use pddl::ast::{Domain, Name, Problem, TypedName};

use super::likeness::list;
use super::roles::Roles;
use crate::binding::Bindings;
use crate::called::Naming;
use crate::knowledge::Knowledge;
use crate::message::{Errors, Message, did_you_mean};

pub(crate) type Resolved = (CalledNames, Vec<Message>);

/// Computes the object names that `[bindings.names]` gives to individuals. Exact entries take precedence over patterns.
pub(crate) fn resolve(
    domain: &Domain,
    problem: &Problem,
    knowledge: &Knowledge,
    bindings: &Bindings,
) -> Result<Resolved, Errors> {
    let entries = bindings.names().entries();
    if entries.is_empty() {
        return Ok(Resolved::default());
    }
    let roles = Roles::new(domain, problem, knowledge, bindings);
    let individuals: BTreeSet<&Individual> = roles.all().iter().flat_map(|role| &role.individuals).collect();
    let objects = domain.constants.iter().chain(&problem.objects);
    let objects: BTreeMap<&Name, &TypedName> =
        objects.map(|object| (&object.identifier.name, object)).collect();
    let mut resolving = Resolving {
        roles: &roles,
        types: TypeHierarchy::of(domain),
        individuals,
        objects,
        called: BTreeMap::new(),
        errors: Vec::new(),
        warnings: Vec::new(),
    };
    for entry in entries {
        if let Some(fault) = entry.fault() {
            resolving.errors.push(entry.wrong("M223", fault));
        }
    }
    let well_formed = || entries.iter().filter(|entry| entry.fault().is_none());
    well_formed().filter(|entry| !entry.is_pattern()).for_each(|entry| resolving.exact(entry));
    let exact: BTreeSet<String> = resolving.called.keys().map(|iri| (*iri).to_owned()).collect();
    well_formed().filter(|entry| entry.is_pattern()).for_each(|entry| resolving.pattern(entry, &exact));
    resolving.clashes();
    let Resolving { called, errors, warnings, .. } = resolving;
    if errors.is_empty() {
        Ok((called.into_iter().map(|(iri, (name, _))| (iri.to_owned(), name)).collect(), warnings))
    } else {
        Err(errors.into())
    }
}

struct Resolving<'a> {
    roles: &'a Roles,
    types: TypeHierarchy,
    individuals: BTreeSet<&'a Individual>,
    objects: BTreeMap<&'a Name, &'a TypedName>,
    called: BTreeMap<&'a str, (String, &'a Naming)>,
    errors: Vec<Message>,
    warnings: Vec<Message>,
}

impl<'a> Resolving<'a> {
    fn exact(&mut self, entry: &'a Naming) {
        let matches_entry = |candidate: &&&Individual| {
            entry.individual == candidate.name || entry.individual == candidate.iri
        };
        let matches: Vec<&Individual> = self.individuals.iter().filter(matches_entry).copied().collect();
        match matches[..] {
            [] => {
                let names = || self.individuals.iter().map(|individual| individual.name.as_str());
                let text = format!(
                    "the knowledge base has no function, design, action, component or member of a bound class `{}`{}",
                    entry.individual,
                    did_you_mean(&entry.individual, names())
                );
                self.errors.push(entry.wrong("M223", &text));
            }
            [individual] => match self.fits(individual, &entry.object) {
                Ok(name) => self.call(individual, name, entry),
                Err(text) => self.errors.push(entry.wrong("M224", &text)),
            },
            _ => {
                let iris: Vec<&str> = matches.iter().map(|individual| individual.iri.as_str()).collect();
                let text = format!(
                    "`{}` is ambiguous, it can be each of {}; write the IRI",
                    entry.individual,
                    list(&iris)
                );
                self.errors.push(entry.wrong("M223", &text));
            }
        }
    }

    fn pattern(&mut self, entry: &'a Naming, exact: &BTreeSet<String>) {
        let (mut match_count, mut unmatched) = (0, Vec::new());
        let mut reason = None;
        for individual in self.individuals.clone() {
            let image = entry.call(&individual.name).or_else(|| entry.call(&individual.iri));
            let Some(image) = image.filter(|_| !exact.contains(&individual.iri)) else { continue };
            match self.fits(individual, &image) {
                Ok(name) => {
                    match_count += 1;
                    self.call(individual, name, entry);
                }
                Err(text) => {
                    unmatched.push(individual.name.as_str());
                    reason.get_or_insert(text);
                }
            }
        }
        match reason {
            None if match_count == 0 => {
                let names: Vec<&str> =
                    self.individuals.iter().map(|individual| individual.name.as_str()).collect();
                let text = format!(
                    "the pattern `{}` matches no individual without an entry of its own; there are: {}",
                    entry.individual,
                    list(&names)
                );
                self.errors.push(entry.wrong("M223", &text));
            }
            Some(reason) if match_count == 0 => self.errors.push(entry.wrong("M224", &reason)),
            Some(reason) => {
                let text = format!(
                    "the pattern does not map {}, which keep their names: {reason}",
                    list(&unmatched)
                );
                self.warnings.push(entry.questionable("M226", &text));
            }
            None => {}
        }
    }

    /// Returns the object `name` in its declared spelling. Returns a description of the error if
    /// there is no such object or if its type does not admit the individual.
    fn fits(&self, individual: &Individual, name: &str) -> Result<String, String> {
        let Some(object) = self.objects.get(&Name::new(name)) else {
            let names = self.objects.keys().map(|name| name.as_str());
            return Err(format!(
                "there is no object `{name}`, neither in the problem nor among the domain's constants{}",
                did_you_mean(name, names)
            ));
        };
        let bound = self.roles.all().iter().filter(|role| !role.types.alternatives.is_empty());
        let roles: Vec<_> = bound.filter(|role| role.individuals.contains(individual)).collect();
        if roles.is_empty() || roles.iter().any(|role| self.types.fits(&object.r#type, &role.types)) {
            return Ok(object.identifier.name.as_str().to_owned());
        }
        let classes: Vec<&str> = roles.iter().map(|role| role.class.as_str()).collect();
        let types = roles.iter().flat_map(|role| &role.types.alternatives);
        let types: Vec<&str> = types.map(|r#type| r#type.name.as_str()).collect();
        let object_types: Vec<&str> =
            object.r#type.alternatives.iter().map(|alternative| alternative.name.as_str()).collect();
        // In PDDL, an object without a type has the type `object`.
        let object_types = if object_types.is_empty() { vec!["object"] } else { object_types };
        Err(format!(
            "`{name}` is of type {}, but `{}` is a {}; an object of type {} would be right",
            list(&object_types),
            individual.name,
            classes.join(" and "),
            list(&types)
        ))
    }

    fn call(&mut self, individual: &'a Individual, name: String, entry: &'a Naming) {
        match self.called.get(individual.iri.as_str()) {
            Some((other, _)) if Name::new(other) != Name::new(&name) => {
                let text = format!("`{}` would be `{name}` and `{other}`", individual.name);
                self.errors.push(entry.wrong("M225", &text));
            }
            Some(_) => {}
            None => {
                self.called.insert(&individual.iri, (name, entry));
            }
        }
    }

    fn clashes(&mut self) {
        let mut by_name: BTreeMap<Name, Vec<&Individual>> = BTreeMap::new();
        for individual in &self.individuals {
            let name = self.called.get(individual.iri.as_str()).map_or(&individual.name, |(name, _)| name);
            by_name.entry(Name::new(name)).or_default().push(individual);
        }
        for (name, individuals) in by_name.iter().filter(|(_, individuals)| individuals.len() > 1) {
            let mut entries =
                individuals.iter().filter_map(|individual| self.called.get(individual.iri.as_str()));
            let Some((_, entry)) = entries.next_back() else { continue };
            let names: Vec<&str> = individuals.iter().map(|individual| individual.name.as_str()).collect();
            let text = format!("`{name}` would be {}; an object is one individual", list(&names));
            self.errors.push(entry.wrong("M225", &text));
        }
    }
}
