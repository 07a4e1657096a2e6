//! Data ranges as conditions on a value, and as constraints on the values of a property.
//!
//! The engine tests whether a literal lies in the value space of a datatype, and compares values; enumerations are
//! relations that hold their members as facts. A complement is moved inwards until it is one of these tests.

use rules::{Atom, BuiltIn, Literal, Term};

use super::context::{Conjunction, Context, cross};
use crate::owl::DataRange;
use crate::vocab::{owl, rdf, rdfs, xsd};

/// Datatypes may be defined by each other so deep; deeper, or in a circle, they are not tested.
const DEPTH: usize = 16;

/// An intersection of unions of data ranges is multiplied out up to so many alternatives.
const MOST_ALTERNATIVES: usize = 1_024;

/// The datatypes whose value spaces the engine knows, by local name in the XML Schema namespace. Of others nothing is
/// known but that they have values.
const DATATYPES: &str = " string normalizedString token language Name NCName NMTOKEN boolean decimal integer \
    nonNegativeInteger positiveInteger nonPositiveInteger negativeInteger long int short byte unsignedLong unsignedInt \
    unsignedShort unsignedByte float double dateTime dateTimeStamp date time duration dayTimeDuration \
    yearMonthDuration anyURI hexBinary base64Binary gYear gYearMonth gMonth gMonthDay gDay ";

type Tests = Result<Vec<Conjunction>, &'static str>;

/// The ways in which `value` can be seen to be in `range`. `Err` says what cannot be tested.
pub(crate) fn condition(context: &mut Context, range: &DataRange, value: Term) -> Tests {
    Lowering { context, value }.tests(range, true, DEPTH)
}

/// The bodies that hold where `edges` do and `value` is outside `range`.
pub(crate) fn violations(context: &mut Context, range: &DataRange, edges: &[Atom], value: Term) -> Tests {
    let outside = Lowering { context, value }.tests(range, false, DEPTH)?;
    Ok(outside.into_iter().map(|tests| edges.iter().cloned().chain(tests).collect()).collect())
}

struct Lowering<'c, 'a> {
    context: &'c mut Context<'a>,
    value: Term,
}

impl Lowering<'_, '_> {
    /// The conjunctions of tests of which one holds where the value is in `range` (or is outside it).
    fn tests(&mut self, range: &DataRange, inside: bool, depth: usize) -> Tests {
        if depth == 0 {
            return Err("datatypes that are defined by each other");
        }
        match range {
            DataRange::Datatype(iri) => match self.context.definitions.get(iri).cloned() {
                Some(definition) => self.tests(&definition, inside, depth - 1),
                None => self.datatype(iri, inside),
            },
            // A value is outside where it certainly is none of the members.
            DataRange::OneOf(literals) if !inside => {
                let differs = |member| Atom::Different(self.value, Term::Constant(member));
                let members: Vec<_> = literals.iter().map(|literal| self.context.literal(literal)).collect();
                Ok(vec![members.into_iter().map(differs).collect()])
            }
            DataRange::OneOf(literals) => {
                let predicate = self.context.members_of(range);
                for literal in literals {
                    let member = self.context.literal(literal);
                    self.context.state(predicate, [member]);
                }
                Ok(vec![vec![Atom::relation(predicate, [self.value])]])
            }
            DataRange::IntersectionOf(ranges) if inside => self.all(ranges, inside, depth),
            DataRange::IntersectionOf(ranges) => self.any(ranges, inside, depth),
            DataRange::UnionOf(ranges) if inside => self.any(ranges, inside, depth),
            DataRange::UnionOf(ranges) => self.all(ranges, inside, depth),
            DataRange::ComplementOf(range) => self.tests(range, !inside, depth - 1),
            DataRange::Restriction(iri, facets) => {
                let mut within = self.datatype(iri, true)?;
                let mut outside = self.datatype(iri, false)?;
                for (facet, bound) in facets {
                    let outer = self.facet(facet, bound, false)?;
                    outside.extend(cross(&within, &[vec![outer]]));
                    within = cross(&within, &[vec![self.facet(facet, bound, true)?]]);
                }
                Ok(if inside { within } else { outside })
            }
        }
    }

    fn all(&mut self, ranges: &[DataRange], inside: bool, depth: usize) -> Tests {
        let mut product = vec![Vec::new()];
        for range in ranges {
            product = cross(&product, &self.tests(range, inside, depth - 1)?);
            if product.len() > MOST_ALTERNATIVES {
                return Err("a data range of too many alternatives");
            }
        }
        Ok(product)
    }

    fn any(&mut self, ranges: &[DataRange], inside: bool, depth: usize) -> Tests {
        let mut any = Vec::new();
        for range in ranges {
            any.extend(self.tests(range, inside, depth - 1)?);
        }
        Ok(any)
    }

    fn datatype(&mut self, iri: &str, inside: bool) -> Tests {
        if iri == rdfs::LITERAL {
            return Ok(if inside { vec![Vec::new()] } else { Vec::new() });
        }
        let known = match iri.strip_prefix(xsd::NS) {
            Some(local) => DATATYPES.contains(&format!(" {local} ")),
            None => [owl::REAL, owl::RATIONAL, rdf::PLAIN_LITERAL].contains(&iri),
        };
        if !known {
            return Err("a datatype whose values are not known");
        }
        let datatype = Term::Constant(self.context.symbols.literal(Literal::Uri(iri.into())));
        let built_in = if inside { BuiltIn::DataRange } else { BuiltIn::OutsideDataRange };
        Ok(vec![vec![Atom::BuiltIn { built_in, arguments: vec![self.value, datatype] }]])
    }

    /// The test that a value of the restricted datatype keeps a facet, or breaks it.
    fn facet(&mut self, facet: &str, bound: &crate::owl::Literal, keeps: bool) -> Result<Atom, &'static str> {
        let built_in = match (facet.strip_prefix(xsd::NS), keeps) {
            (Some("minInclusive"), true) | (Some("maxExclusive"), false) => BuiltIn::GreaterThanOrEqual,
            (Some("minExclusive"), true) | (Some("maxInclusive"), false) => BuiltIn::GreaterThan,
            (Some("maxInclusive"), true) | (Some("minExclusive"), false) => BuiltIn::LessThanOrEqual,
            (Some("maxExclusive"), true) | (Some("minInclusive"), false) => BuiltIn::LessThan,
            _ => return Err("a facet other than a bound"),
        };
        let bound = Term::Constant(self.context.literal(bound));
        Ok(Atom::BuiltIn { built_in, arguments: vec![self.value, bound] })
    }
}
