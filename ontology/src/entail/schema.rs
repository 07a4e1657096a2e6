//! What follows about classes and properties: above which others each is, and which can have no instance.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Delta, Engine, Error, Fact, Symbol};

use super::prover::{Prover, contradiction, edge, member, value};
use crate::owl::{EntityKind, Iri, ObjectPropertyExpression};
use crate::vocab::owl;

/// A class or property and what is above it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SchemaEntity {
    /// Its IRI.
    pub iri: String,
    /// The named classes or properties that contain it, without itself; sorted.
    pub above: Vec<String>,
    /// Those of them that are above no other one of them, unless both are equivalent.
    pub direct: Vec<String>,
    /// Why it can have no instance, if so.
    pub empty: Option<String>,
}

/// The classes, object properties and data properties among some entities, in their order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Schema {
    /// Classes.
    pub classes: Vec<SchemaEntity>,
    /// Object properties.
    pub object_properties: Vec<SchemaEntity>,
    /// Data properties.
    pub data_properties: Vec<SchemaEntity>,
}

/// What the rules conclude about any instance of each class, and any pair that a property relates. Nothing follows from
/// knowledge that contradicts itself.
///
/// # Errors
/// A rule does not come to an end.
pub fn schema(engine: &Engine, named: &[(EntityKind, Iri)]) -> Result<Schema, Error> {
    let mut work = Prover::new(engine)?.base;
    Ok(Schema {
        classes: entities(&mut work, named, EntityKind::Class)?,
        object_properties: entities(&mut work, named, EntityKind::ObjectProperty)?,
        data_properties: entities(&mut work, named, EntityKind::DataProperty)?,
    })
}

fn entities(
    work: &mut Engine,
    named: &[(EntityKind, Iri)],
    kind: EntityKind,
) -> Result<Vec<SchemaEntity>, Error> {
    let named = named.iter().filter(|(other, iri)| *other == kind && !iri.starts_with(owl::NS));
    let names: Vec<&Iri> = named.map(|(_, iri)| iri).collect();
    let symbols = names.iter().map(|iri| work.symbols_mut().name(iri)).collect::<BTreeSet<Symbol>>();
    let consistent = contradiction(work).is_none();
    let (mut found, mut above) = (Vec::new(), BTreeMap::new());
    for iri in names {
        let (x, y) = (Prover::fresh(0), Prover::fresh(1));
        let fact = match kind {
            EntityKind::Class => member(work, iri, &x),
            EntityKind::DataProperty => value(work, iri, &x, rules::Literal::fresh(1)),
            _ => edge(work, &ObjectPropertyExpression::Property(iri.clone()), &x, &y),
        };
        let change = work.apply(Delta { insert: vec![fact.clone()], delete: Vec::new() })?;
        let is_above = |other: &&Fact| {
            other.arguments == fact.arguments
                && symbols.contains(&other.predicate)
                && other.predicate != fact.predicate
        };
        let own: BTreeSet<Symbol> =
            change.insert.iter().filter(is_above).map(|other| other.predicate).collect();
        let empty = if consistent { contradiction(work) } else { None };
        work.apply(Delta { insert: Vec::new(), delete: vec![fact.clone()] })?;
        above.insert(fact.predicate, own);
        found.push((iri.to_string(), fact.predicate, empty));
    }
    let name = |symbol: &Symbol| work.symbols().value(*symbol).as_name().unwrap_or_default().to_owned();
    let entity = |(iri, symbol, empty): (String, Symbol, Option<String>)| {
        let own = &above[&symbol];
        // Something between, which is not equivalent to what is above it.
        let between = |other: &Symbol| {
            own.iter().any(|middle| {
                middle != other && above[middle].contains(other) && !above[other].contains(middle)
            })
        };
        let mut direct: Vec<String> = own.iter().filter(|other| !between(other)).map(name).collect();
        let mut all: Vec<String> = own.iter().map(name).collect();
        direct.sort();
        all.sort();
        SchemaEntity { iri, above: all, direct, empty }
    };
    Ok(found.into_iter().map(entity).collect())
}
