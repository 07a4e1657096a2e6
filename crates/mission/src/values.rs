//! Finds attributes with several different values: of a design, or measured. No rule decides which of them counts, so
//! that plans would depend on the order of the statements.

use std::collections::BTreeMap;

use num_rational::BigRational;
use ontology::ANONYMOUS;
use ontology::tomasys::Individual;
use pddl::ast::Domain;

use crate::binding::{self, Bindings};
use crate::knowledge::{Knowledge, doubt_about};
use crate::message::Message;
use crate::native::CoAdaptation;

/// Returns an error for each pair of different values of an attribute that the problem uses. `domain` is the explicit
/// form of the domain.
pub(crate) fn several_values(
    domain: &Domain,
    knowledge: &Knowledge,
    bindings: &Bindings,
    adaptation: Option<&CoAdaptation>,
) -> Vec<Message> {
    let (view, catalogue) = (knowledge.view(), knowledge.catalogue());
    let mut attributes = binding::attributes(domain, bindings);
    attributes.extend(adaptation.into_iter().flat_map(CoAdaptation::attributes));
    let mut errors = Vec::new();
    for design in catalogue.designs() {
        let estimations = view.estimations(&design.individual.iri).into_iter();
        let used = estimations.filter(|estimation| attributes.contains(&estimation.attribute));
        let values = used.map(|estimation| (estimation.attribute, (estimation.individual, estimation.value)));
        let kind = format!("the design <{}> has two estimations", design.individual.iri);
        errors
            .extend(different(values).iter().map(|found| error(knowledge, &kind, &design.individual, found)));
    }
    let measurements = catalogue.measurements().iter();
    let used = measurements.filter(|measurement| attributes.contains(&measurement.attribute));
    let values = used.filter_map(|measurement| {
        let value = measurement.value.clone()?;
        Some((measurement.attribute.clone(), (measurement.individual.clone(), value)))
    });
    for found in different(values) {
        errors.push(error(knowledge, "there are two measured values", &found.second.0, &found));
    }
    errors
}

type Holder = (Individual, BigRational);

/// Two different values of an attribute.
struct Difference {
    attribute: String,
    first: Holder,
    second: Holder,
}

/// Returns the values that differ from the first value of their attribute, each with this first value.
fn different(values: impl Iterator<Item = (String, Holder)>) -> Vec<Difference> {
    let mut first_by_attribute: BTreeMap<String, Holder> = BTreeMap::new();
    let mut differences = Vec::new();
    for (attribute, second) in values {
        match first_by_attribute.get(&attribute) {
            Some(first) if first.1 != second.1 => {
                differences.push(Difference { first: first.clone(), attribute, second });
            }
            Some(_) => {}
            None => {
                first_by_attribute.insert(attribute, second);
            }
        }
    }
    differences
}

fn error(knowledge: &Knowledge, kind: &str, subject: &Individual, found: &Difference) -> Message {
    let value = |(individual, value): &Holder| {
        if individual.iri.starts_with(ANONYMOUS) {
            value.to_string()
        } else {
            format!("{value} (<{}>)", individual.iri)
        }
    };
    let text = format!(
        "{kind} of `{}`, {} and {}; remove one of them",
        found.attribute,
        value(&found.first),
        value(&found.second)
    );
    doubt_about(knowledge, "M234", &subject.iri, text).into_error()
}
