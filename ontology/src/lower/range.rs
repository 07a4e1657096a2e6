//! Data ranges as conditions on a value, and as constraints on the values of a property.
//!
//! The engine has no test for a datatype, and needs none: its functions compare a result by identity, so
//! `subtract(0, ?v, ?v)` holds of decimals only (for a float the result is the float zero), and
//! `stringConcat(?v, ?v, "")` of strings only. Enumerations are relations that hold their members as facts.

use rules::{Atom, BuiltIn, Literal, RuleIdentity, Term};

use super::context::{Conjunction, Context, Variables};
use crate::owl::DataRange;
use crate::vocab::{rdfs, xsd};

/// The ways in which `value` can be seen to be in `range`. `Err` says what cannot be tested.
pub(crate) fn condition(
    context: &mut Context,
    range: &DataRange,
    value: Term,
) -> Result<Vec<Conjunction>, &'static str> {
    Ok(match range {
        DataRange::Datatype(iri) => datatype(context, iri, value)?,
        DataRange::OneOf(literals) => {
            let relation = context.members_of(range);
            for literal in literals {
                let member = context.literal(literal);
                context.state(relation, [member]);
            }
            vec![vec![Atom::relation(relation, [value])]]
        }
        DataRange::IntersectionOf(ranges) => {
            let mut product = vec![Vec::new()];
            for range in ranges {
                product = super::class::cross(&product, &condition(context, range, value)?);
            }
            product
        }
        DataRange::UnionOf(ranges) => {
            let mut any = Vec::new();
            for range in ranges {
                any.extend(condition(context, range, value)?);
            }
            any
        }
        DataRange::Restriction(iri, facets) => {
            let mut tests = Vec::new();
            for (facet, bound) in facets {
                let bound = Term::Constant(context.literal(bound));
                tests.push(Atom::BuiltIn { built_in: comparison(facet)?, arguments: vec![value, bound] });
            }
            super::class::cross(&datatype(context, iri, value)?, &[tests])
        }
        DataRange::ComplementOf(_) => return Err("the complement of a data range"),
    })
}

fn comparison(facet: &str) -> Result<BuiltIn, &'static str> {
    match facet.strip_prefix(xsd::NS) {
        Some("minInclusive") => Ok(BuiltIn::GreaterThanOrEqual),
        Some("minExclusive") => Ok(BuiltIn::GreaterThan),
        Some("maxInclusive") => Ok(BuiltIn::LessThanOrEqual),
        Some("maxExclusive") => Ok(BuiltIn::LessThan),
        _ => Err("a facet other than a bound"),
    }
}

fn datatype(context: &mut Context, iri: &str, value: Term) -> Result<Vec<Conjunction>, &'static str> {
    if iri == rdfs::LITERAL {
        return Ok(vec![Vec::new()]);
    }
    let mut constant = |literal| Term::Constant(context.symbols.literal(literal));
    let test = |built_in, arguments: Vec<Term>| Atom::BuiltIn { built_in, arguments };
    let is_decimal = test(BuiltIn::Subtract, vec![constant(Literal::integer(0)), value, value]);
    let integer = |bound: Option<(BuiltIn, Term)>| {
        let mut tests = vec![is_decimal.clone(), test(BuiltIn::Floor, vec![value, value])];
        tests.extend(bound.map(|(built_in, bound)| test(built_in, vec![value, bound])));
        vec![tests]
    };
    let zero = constant(Literal::integer(0));
    Ok(match iri.strip_prefix(xsd::NS) {
        Some("decimal") => vec![vec![is_decimal]],
        Some("integer") => integer(None),
        Some("nonNegativeInteger") => integer(Some((BuiltIn::GreaterThanOrEqual, zero))),
        Some("positiveInteger") => integer(Some((BuiltIn::GreaterThan, zero))),
        Some("nonPositiveInteger") => integer(Some((BuiltIn::LessThanOrEqual, zero))),
        Some("negativeInteger") => integer(Some((BuiltIn::LessThan, zero))),
        Some("string") => {
            vec![vec![test(BuiltIn::StringConcat, vec![value, value, constant(Literal::string(""))])]]
        }
        Some("boolean") => {
            let relation = context.members_of(&DataRange::Datatype(iri.into()));
            for truth in [Literal::Boolean(true), Literal::Boolean(false)] {
                let member = context.symbols.literal(truth);
                context.state(relation, [member]);
            }
            vec![vec![Atom::relation(relation, [value])]]
        }
        _ => return Err("a datatype that is not tested"),
    })
}

/// The bodies that hold where `edges` do and `value` is outside `range`.
pub(crate) fn violations(
    context: &mut Context,
    range: &DataRange,
    edges: &[Atom],
    value: Term,
) -> Result<Vec<Conjunction>, &'static str> {
    let inside = condition(context, range, value)?;
    if inside.iter().any(Vec::is_empty) {
        return Ok(Vec::new());
    }
    let predicate = match &inside[..] {
        [only] if let [Atom::Relation { predicate, .. }] = &only[..] => *predicate,
        _ => {
            let relation = context.members_of(range);
            let label = Some(range.to_string().into());
            let identity = RuleIdentity { source: super::AXIOM_SOURCE.into(), label, position: 0 };
            for tests in inside {
                let body = edges.iter().cloned().chain(tests).collect();
                context.rule(&identity, vec![Atom::relation(relation, [value])], body, &Variables::default());
            }
            relation
        }
    };
    let absent = Atom::Not { predicate, arguments: vec![value] };
    Ok(vec![edges.iter().cloned().chain([absent]).collect()])
}
