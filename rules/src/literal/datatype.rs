//! IRIs of the datatypes of XSD, RDF, RDFS and OWL, and the bounds of the integer types.

pub(crate) const XSD: &str = "http://www.w3.org/2001/XMLSchema#";
pub(super) const RDFS_LITERAL: &str = "http://www.w3.org/2000/01/rdf-schema#Literal";
pub(super) const OWL_REAL: &str = "http://www.w3.org/2002/07/owl#real";
pub(super) const OWL_RATIONAL: &str = "http://www.w3.org/2002/07/owl#rational";
pub(super) const RDF: &str = "http://www.w3.org/1999/02/22-rdf-syntax-ns#";

pub(crate) fn is_datatype(iri: &str) -> bool {
    let rdf = |iri: &str| {
        iri.strip_prefix(RDF).is_some_and(|local| ["PlainLiteral", "langString"].contains(&local))
    };
    iri.starts_with(XSD) || [RDFS_LITERAL, OWL_REAL, OWL_RATIONAL].contains(&iri) || rdf(iri)
}

/// Returns the inclusive bounds of an integer type of XSD, given by its local name; a bound of `None` is no
/// limit. Returns `None` for other types.
pub(super) fn integer_range(local: &str) -> Option<(Option<i128>, Option<i128>)> {
    Some(match local {
        "integer" => (None, None),
        "nonNegativeInteger" => (Some(0), None),
        "positiveInteger" => (Some(1), None),
        "nonPositiveInteger" => (None, Some(0)),
        "negativeInteger" => (None, Some(-1)),
        "long" => (Some(i64::MIN.into()), Some(i64::MAX.into())),
        "int" => (Some(i32::MIN.into()), Some(i32::MAX.into())),
        "short" => (Some(i16::MIN.into()), Some(i16::MAX.into())),
        "byte" => (Some(i8::MIN.into()), Some(i8::MAX.into())),
        "unsignedLong" => (Some(0), Some(u64::MAX.into())),
        "unsignedInt" => (Some(0), Some(u32::MAX.into())),
        "unsignedShort" => (Some(0), Some(u16::MAX.into())),
        "unsignedByte" => (Some(0), Some(u8::MAX.into())),
        _ => return None,
    })
}
