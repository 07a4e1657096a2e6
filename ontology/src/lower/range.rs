//! Lowers data ranges as conditions on a value, and as constraints on the values of a property.
//!
//! The engine tests if a literal is in the value space of a datatype, and compares values. An enumeration
//! becomes a relation with a fact for each member. Complements are pushed inwards until they reach one of these
//! tests.

use rules::{Atom, BuiltIn, Literal, Term};

use super::context::{Conjunction, Context, cross};
use crate::owl::DataRange;
use crate::vocab::{owl, rdf, rdfs, xsd};

/// Limit on the nesting of data ranges and datatype definitions. Deeper ranges and cyclic definitions are
/// rejected.
const MAX_DEFINITION_DEPTH: usize = 16;

pub(crate) const MAX_RANGE_ALTERNATIVES: usize = 1_024;

/// Local names of the XML Schema datatypes whose value spaces the engine implements, each between spaces.
const DATATYPES: &str = " string normalizedString token language Name NCName NMTOKEN boolean decimal integer \
    nonNegativeInteger positiveInteger nonPositiveInteger negativeInteger long int short byte unsignedLong unsignedInt \
    unsignedShort unsignedByte float double dateTime dateTimeStamp date time duration dayTimeDuration \
    yearMonthDuration anyURI hexBinary base64Binary gYear gYearMonth gMonth gMonthDay gDay ";

/// Alternative conjunctions of tests, or the reason why a value cannot be tested for membership in the
/// range.
type Tests = Result<Vec<Conjunction>, &'static str>;

/// Returns alternative conjunctions of tests: `value` is in `range` if one of them holds.
pub(crate) fn condition(context: &mut Context, range: &DataRange, value: Term) -> Tests {
    RangeLowering { context, value }.tests(range, true, MAX_DEFINITION_DEPTH)
}

/// Returns rule bodies for the violation of `range`: one of them holds if all `edges` hold and `value`
/// is outside `range`.
pub(crate) fn violations(context: &mut Context, range: &DataRange, edges: &[Atom], value: Term) -> Tests {
    let outside = RangeLowering { context, value }.tests(range, false, MAX_DEFINITION_DEPTH)?;
    Ok(outside.into_iter().map(|tests| edges.iter().cloned().chain(tests).collect()).collect())
}

struct RangeLowering<'c, 'a> {
    context: &'c mut Context<'a>,
    value: Term,
}

impl RangeLowering<'_, '_> {
    /// Returns alternative conjunctions of tests. If one of them holds, the value is in `range` (`inside` is
    /// true) or outside `range` (`inside` is false). `depth` is the number of further nesting levels that are
    /// accepted.
    fn tests(&mut self, range: &DataRange, inside: bool, depth: usize) -> Tests {
        if depth == 0 {
            return Err("data ranges that are nested too deeply or defined by each other");
        }
        match range {
            DataRange::Datatype(iri) => match self.context.definitions.get(iri).cloned() {
                Some(definition) => self.tests(&definition, inside, depth - 1),
                None => self.datatype(iri, inside),
            },
            // A value is outside an enumeration if it certainly differs from every member.
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
            // De Morgan: outside an intersection means outside one of the ranges.
            DataRange::IntersectionOf(ranges) if inside => self.conjunction(ranges, inside, depth),
            DataRange::IntersectionOf(ranges) => self.disjunction(ranges, inside, depth),
            DataRange::UnionOf(ranges) if inside => self.disjunction(ranges, inside, depth),
            DataRange::UnionOf(ranges) => self.conjunction(ranges, inside, depth),
            DataRange::ComplementOf(range) => self.tests(range, !inside, depth - 1),
            DataRange::Restriction(iri, facets) => {
                // Outside means: outside of the datatype, or within the previous facets and beyond this one.
                // Facets compare only values of the datatype.
                let mut within = self.datatype(iri, true)?;
                let mut outside = self.datatype(iri, false)?;
                for (facet, bound) in facets {
                    let breaks_facet = self.facet(facet, bound, false)?;
                    outside.extend(cross(&within, &[vec![breaks_facet]]));
                    within = cross(&within, &[vec![self.facet(facet, bound, true)?]]);
                }
                let is_float = [xsd::FLOAT, xsd::DOUBLE].contains(&&**iri);
                let is_nan = |(_, bound): &(_, crate::owl::Literal)| &*bound.lexical == "NaN";
                if is_float && !inside && !facets.is_empty() && !facets.iter().any(is_nan) {
                    // NaN is neither within nor beyond a bound, because it is incomparable.
                    let (lexical, datatype) = ("NaN".into(), Some(iri.clone()));
                    let nan = crate::owl::Literal { lexical, datatype, language: None };
                    outside.extend(self.tests(&DataRange::OneOf(vec![nan]), true, depth)?);
                }
                Ok(if inside { within } else { outside })
            }
        }
    }

    fn conjunction(&mut self, ranges: &[DataRange], inside: bool, depth: usize) -> Tests {
        let mut product = vec![Vec::new()];
        for range in ranges {
            product = cross(&product, &self.tests(range, inside, depth - 1)?);
            if product.len() > MAX_RANGE_ALTERNATIVES {
                return Err("a data range of too many alternatives");
            }
        }
        Ok(product)
    }

    fn disjunction(&mut self, ranges: &[DataRange], inside: bool, depth: usize) -> Tests {
        let mut alternatives = Vec::new();
        for range in ranges {
            alternatives.extend(self.tests(range, inside, depth - 1)?);
        }
        Ok(alternatives)
    }

    fn datatype(&mut self, iri: &str, inside: bool) -> Tests {
        if iri == rdfs::LITERAL {
            return Ok(if inside { vec![Vec::new()] } else { Vec::new() });
        }
        let is_supported = match iri.strip_prefix(xsd::NS) {
            Some(local) => DATATYPES.contains(&format!(" {local} ")),
            None => [owl::REAL, owl::RATIONAL, rdf::PLAIN_LITERAL].contains(&iri),
        };
        if !is_supported {
            return Err("a datatype whose values are not known");
        }
        let datatype = Term::Constant(self.context.symbols.literal(Literal::Uri(iri.into())));
        let built_in = if inside { BuiltIn::DataRange } else { BuiltIn::OutsideDataRange };
        Ok(vec![vec![Atom::BuiltIn { built_in, arguments: vec![self.value, datatype] }]])
    }

    /// Returns the test that a value of the restricted datatype satisfies the facet (`keeps`) or violates it.
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
