//! Finds attributes with several different values: of a design, or measured. No rule decides which of them counts, so
//! that plans would depend on the order of the statements.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use ontology::ANONYMOUS;
use ontology::tomasys::{Estimation, Individual, Measurement};

use crate::knowledge::{Knowledge, doubt_about};
use crate::message::Message;

/// Returns an error for each value that differs from the first one, for the attributes that the problem uses.
pub(crate) fn several_values(knowledge: &Knowledge, attributes: &BTreeSet<String>) -> Vec<Message> {
    let (view, catalogue) = (knowledge.view(), knowledge.catalogue());
    let mut errors = Vec::new();
    for design in catalogue.designs() {
        let estimations = view.estimations(&design.individual.iri).into_iter();
        let estimations = estimations.filter(|estimation| attributes.contains(&estimation.attribute));
        let values = estimations.map(|Estimation { individual, attribute, value }| Held {
            individual,
            attribute,
            value,
        });
        let kind = format!("the design <{}> has two estimations", design.individual.iri);
        for (first, second) in different(values) {
            errors.push(error(knowledge, &kind, &design.individual, &first, &second));
        }
    }
    let measurements = catalogue.measurements().iter();
    let measurements = measurements.filter(|measurement| attributes.contains(&measurement.attribute));
    let values = measurements.cloned().filter_map(|Measurement { individual, attribute, value }| {
        Some(Held { individual, attribute, value: value? })
    });
    for (first, second) in different(values) {
        errors.push(error(knowledge, "there are two measured values", &second.individual, &first, &second));
    }
    errors
}

/// A value of an attribute, and the individual that holds it.
#[derive(Clone)]
struct Held {
    individual: Individual,
    attribute: String,
    value: BigRational,
}

/// Returns the values that differ from the first value of their attribute, each after this first value.
fn different(values: impl Iterator<Item = Held>) -> Vec<(Held, Held)> {
    let mut first_by_attribute: BTreeMap<String, Held> = BTreeMap::new();
    let mut differences = Vec::new();
    for held in values {
        match first_by_attribute.get(&held.attribute) {
            Some(first) if first.value != held.value => differences.push((first.clone(), held)),
            Some(_) => {}
            None => {
                first_by_attribute.insert(held.attribute.clone(), held);
            }
        }
    }
    differences
}

fn error(knowledge: &Knowledge, kind: &str, subject: &Individual, first: &Held, second: &Held) -> Message {
    let shown = |held: &Held| {
        if held.individual.iri.starts_with(ANONYMOUS) {
            held.value.to_string()
        } else {
            format!("{} (<{}>)", held.value, held.individual.iri)
        }
    };
    let (attribute, first, second) = (&first.attribute, shown(first), shown(second));
    let text = format!("{kind} of `{attribute}`, {first} and {second}; remove one of them");
    doubt_about(knowledge, "M234", &subject.iri, text).into_error()
}
