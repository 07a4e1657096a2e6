//! Finds individuals of the knowledge base that would be one object, predicate or numeric function of the planning
//! problem. PDDL has one name space and ignores case, so this happens to individuals whose names differ only in their
//! namespaces or in case.
//!
//! Individuals that the problem does not use may have equal names, and so may different IRIs of one individual.

use std::collections::{BTreeMap, BTreeSet};

use ontology::tomasys::{Individual, View};
use pddl::ast::{Domain, Name};

use crate::binding::{self, Bindings};
use crate::knowledge::{Knowledge, doubt_about};
use crate::message::Message;
use crate::native::CoAdaptation;
use crate::planta::{Merged, Planta};

/// Returns an error for each pair of individuals that would be merged. `domain` is the explicit form of the domain,
/// `attributes` contains the names of the attributes that the problem uses.
pub(crate) fn merged(
    domain: &Domain,
    knowledge: &Knowledge,
    bindings: &Bindings,
    adaptation: Option<&CoAdaptation>,
    attributes: &BTreeSet<String>,
) -> Vec<Message> {
    let view = knowledge.view();
    let name = |individual: &Individual| Name::new(&individual.name);
    let objects = pairs(&view, binding::individuals(domain, knowledge, bindings), name);
    let types = view.used_attribute_types().into_iter();
    let symbols = if let Some(adaptation) = adaptation {
        // The explicit form of a plain domain declares functions with the names of attributes.
        let attributes: BTreeSet<Name> = attributes.iter().map(|attribute| Name::new(attribute)).collect();
        let types = types.filter(|own| attributes.contains(&name(own))).collect();
        [pairs(&view, adaptation.requirements(), name), pairs(&view, types, name)].concat()
    } else {
        let types = types.filter(|own| attributes.contains(&own.name)).collect();
        pairs(&view, types, |own| own.name.clone())
    };
    // The objects of a plain domain are not part of the problem, so that no other object can be named.
    let can_be_mapped = adaptation.is_none();
    let objects = objects.iter().map(|(first, second)| error(knowledge, first, second, can_be_mapped));
    objects.chain(symbols.iter().map(|(first, second)| error(knowledge, first, second, false))).collect()
}

/// Returns an error for each pair of entities or values that would be merged in PLANTA's form.
pub(crate) fn merged_by_planta(knowledge: &Knowledge, planta: &Planta) -> Vec<Message> {
    let error = |pair: &Merged| match &pair.iri {
        Some(iri) => doubt_about(knowledge, "M225", iri, pair.text.clone()).into_error(),
        None => Message::error("M225", pair.text.as_str()),
    };
    planta.merged().iter().map(error).collect()
}

/// Returns the pairs of different individuals with equal keys. Of more than two, each is paired with the first.
fn pairs<K: Ord>(
    view: &View<'_>,
    individuals: BTreeSet<Individual>,
    key: impl Fn(&Individual) -> K,
) -> Vec<(Individual, Individual)> {
    let mut first_by_key: BTreeMap<K, Individual> = BTreeMap::new();
    let mut pairs = Vec::new();
    for individual in individuals {
        match first_by_key.get(&key(&individual)) {
            Some(first) if !view.are_same(&first.iri, &individual.iri) => {
                pairs.push((first.clone(), individual));
            }
            Some(_) => {}
            None => {
                first_by_key.insert(key(&individual), individual);
            }
        }
    }
    pairs
}

fn error(knowledge: &Knowledge, first: &Individual, second: &Individual, can_be_mapped: bool) -> Message {
    let mapping = if can_be_mapped {
        ", or give it the name of another object of the problem in `[bindings.names]`, by its IRI"
    } else {
        ""
    };
    let text = format!(
        "`{}` would be both <{}> and <{}>, because PDDL ignores namespaces and case; rename one of them{mapping}",
        second.name, first.iri, second.iri
    );
    doubt_about(knowledge, "M225", &second.iri, text).into_error()
}
