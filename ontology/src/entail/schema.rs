//! The class and property hierarchy: superclasses and superproperties of each entity, and unsatisfiable
//! entities.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Delta, Engine, Error, Fact, Symbol};

use super::prover::{Prover, contradiction, edge, member, value};
use crate::owl::{EntityKind, Iri, ObjectPropertyExpression};
use crate::vocab::owl;

/// A class or property with its superclasses or superproperties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SchemaEntity {
    /// IRI of the class or property.
    pub iri: String,
    /// Named classes or properties that contain the entity, without the entity itself; sorted.
    pub above: Vec<String>,
    /// Members of `above` that contain the entity directly: no other member lies strictly between;
    /// sorted.
    pub direct: Vec<String>,
    /// Explanation if the rules prove the entity unsatisfiable: it has no instance in any model.
    pub empty: Option<String>,
}

/// Hierarchy of the classes, object properties and data properties of a knowledge base, each in the order in which
/// they were given.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Schema {
    /// Classes.
    pub classes: Vec<SchemaEntity>,
    /// Object properties.
    pub object_properties: Vec<SchemaEntity>,
    /// Data properties.
    pub data_properties: Vec<SchemaEntity>,
}

/// Computes the hierarchy of the classes and properties in `named`, except those in the namespace of OWL, from the
/// consequences for a fresh instance of each class, and for a fresh pair of each property. `empty` is always `None`
/// if the rules that serve for this already derive a violation without the fresh instances.
///
/// # Errors
/// Returns an error if the evaluation of the rules exceeds its budget or is interrupted.
pub fn schema(engine: &Engine, named: &[(EntityKind, Iri)]) -> Result<Schema, Error> {
    let mut base = Prover::new(engine)?.monotone;
    Ok(Schema {
        classes: entities(&mut base, named, EntityKind::Class)?,
        object_properties: entities(&mut base, named, EntityKind::ObjectProperty)?,
        data_properties: entities(&mut base, named, EntityKind::DataProperty)?,
    })
}

fn entities(
    engine: &mut Engine,
    named: &[(EntityKind, Iri)],
    kind: EntityKind,
) -> Result<Vec<SchemaEntity>, Error> {
    let named = named.iter().filter(|(candidate, iri)| *candidate == kind && !iri.starts_with(owl::NS));
    let names: Vec<&Iri> = named.map(|(_, iri)| iri).collect();
    let symbols = names.iter().map(|iri| engine.symbols_mut().name(iri)).collect::<BTreeSet<Symbol>>();
    let consistent = contradiction(engine).is_none();
    let (mut results, mut above) = (Vec::new(), BTreeMap::new());
    for iri in names {
        let (x, y) = (Prover::fresh(0), Prover::fresh(1));
        let fact = match kind {
            EntityKind::Class => member(engine, iri, &x),
            EntityKind::DataProperty => value(engine, iri, &x, rules::Literal::fresh(1)),
            _ => edge(engine, &ObjectPropertyExpression::Property(iri.clone()), &x, &y),
        };
        // The fact is withdrawn afterwards: incremental maintenance is cheaper than a copy of the engine.
        let change = engine.apply(Delta { insert: vec![fact.clone()], delete: Vec::new() })?;
        let is_above = |candidate: &&Fact| {
            candidate.arguments == fact.arguments
                && symbols.contains(&candidate.predicate)
                && candidate.predicate != fact.predicate
        };
        let supers: BTreeSet<Symbol> =
            change.insert.iter().filter(is_above).map(|candidate| candidate.predicate).collect();
        let empty = if consistent { contradiction(engine) } else { None };
        engine.apply(Delta { insert: Vec::new(), delete: vec![fact.clone()] })?;
        above.insert(fact.predicate, supers);
        results.push((iri.to_string(), fact.predicate, empty));
    }
    let name = |symbol: &Symbol| engine.symbols().value(*symbol).as_name().unwrap_or_default().to_owned();
    let entity = |(iri, symbol, empty): (String, Symbol, Option<String>)| {
        let supers = &above[&symbol];
        // Returns `true` if a third entity lies strictly between the current entity and `candidate`.
        // Equivalent entities are above each other.
        let between = |candidate: &Symbol| {
            supers.iter().any(|middle| {
                middle != candidate
                    && !above[middle].contains(&symbol)
                    && above[middle].contains(candidate)
                    && !above[candidate].contains(middle)
            })
        };
        let mut direct: Vec<String> =
            supers.iter().filter(|candidate| !between(candidate)).map(name).collect();
        let mut above_names: Vec<String> = supers.iter().map(name).collect();
        direct.sort();
        above_names.sort();
        SchemaEntity { iri, above: above_names, direct, empty }
    };
    Ok(results.into_iter().map(entity).collect())
}
