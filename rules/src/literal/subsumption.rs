//! Whether all values that lie in several datatypes lie in another one, by the hierarchy of XML Schema ([1], section 3) and the
//! bounds of its integer types.

use super::datatype::{OWL_RATIONAL, OWL_REAL, RDF, RDFS_LITERAL, XSD, integer_range};

/// Datatypes below others, by local name; integer types are told by their bounds.
const BELOW: [(&str, &str); 9] = [
    ("normalizedString", "string"),
    ("token", "normalizedString"),
    ("language", "token"),
    ("NMTOKEN", "token"),
    ("Name", "token"),
    ("NCName", "Name"),
    ("dateTimeStamp", "dateTime"),
    ("dayTimeDuration", "duration"),
    ("yearMonthDuration", "duration"),
];

/// Datatypes without values in common, unless one is below the other.
const DISJOINT: [&str; 18] = [
    "string",
    "boolean",
    "decimal",
    "float",
    "double",
    "dateTime",
    "date",
    "time",
    "duration",
    "anyURI",
    "hexBinary",
    "base64Binary",
    "gYear",
    "gYearMonth",
    "gMonth",
    "gMonthDay",
    "gDay",
    "integer",
];

/// The local name of a datatype of XML Schema; those of OWL that contain all decimals have names of their own.
fn local(iri: &str) -> Option<&str> {
    match iri {
        OWL_REAL => Some("real"),
        OWL_RATIONAL => Some("rational"),
        _ => iri.strip_prefix(XSD).or_else(|| iri.strip_prefix(RDF).filter(|local| *local == "PlainLiteral")),
    }
}

/// The datatype and those above it.
fn upwards(local: &str) -> Vec<&str> {
    let mut all = vec![local];
    while let Some((_, above)) = all.last().and_then(|last| BELOW.iter().find(|(below, _)| below == last)) {
        all.push(above);
    }
    if integer_range(local).is_some() {
        all.push("integer");
    }
    if all.contains(&"integer") || all.contains(&"decimal") {
        all.extend(["decimal", "rational", "real"]);
    }
    if all.contains(&"rational") {
        all.push("real");
    }
    if all.contains(&"string") {
        all.push("PlainLiteral");
    }
    all
}

/// The datatype without values in common with others in which a datatype lies.
fn primitive(local: &str) -> Option<&'static str> {
    let above = upwards(local);
    let found = |name: &&&str| above.contains(name) && **name != "integer";
    DISJOINT.iter().find(found).copied()
}

/// Whether each value that lies in all of some datatypes lies in another one. `false` also where that is not known.
pub fn is_subsumed(datatypes: &[&str], by: &str) -> bool {
    if by == RDFS_LITERAL || datatypes.contains(&by) {
        return true;
    }
    let Some(by) = local(by) else { return false };
    let known: Vec<&str> = datatypes.iter().filter_map(|datatype| local(datatype)).collect();
    let mut primitives: Vec<&str> = known.iter().filter_map(|datatype| primitive(datatype)).collect();
    primitives.sort_unstable();
    primitives.dedup();
    if primitives.len() > 1 || known.iter().any(|datatype| upwards(datatype).contains(&by)) {
        return true;
    }
    let ranges: Vec<_> = known.iter().filter_map(|datatype| integer_range(datatype)).collect();
    let low = ranges.iter().filter_map(|(low, _)| *low).max();
    let high = ranges.iter().filter_map(|(_, high)| *high).min();
    if low.zip(high).is_some_and(|(low, high)| low > high) {
        return true;
    }
    let (Some((least, most)), false) = (integer_range(by), ranges.is_empty()) else { return false };
    let is_above = least.is_none_or(|least| low.is_some_and(|low| low >= least));
    is_above && most.is_none_or(|most| high.is_some_and(|high| high <= most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_several_datatypes_in_another() {
        for (datatypes, by, expected) in [
            ("byte", "short", true),
            ("short", "byte", false),
            ("short unsignedInt", "unsignedShort", true),
            ("nonNegativeInteger nonPositiveInteger", "short", true),
            ("nonNegativeInteger", "integer", true),
            ("integer", "decimal", true),
            ("decimal", "integer", false),
            ("decimal", "double", false),
            ("token", "string", true),
            ("NCName", "token", true),
            ("string", "token", false),
            ("string integer", "boolean", true),
            ("positiveInteger negativeInteger", "boolean", true),
            ("dayTimeDuration", "duration", true),
            ("dayTimeDuration yearMonthDuration", "boolean", false),
            ("own", "own", true),
            ("own", "string", false),
            ("", "string", false),
        ] {
            let iris: Vec<String> =
                datatypes.split_whitespace().map(|local| format!("{XSD}{local}")).collect();
            let iris: Vec<&str> = iris.iter().map(String::as_str).collect();
            assert_eq!(is_subsumed(&iris, &format!("{XSD}{by}")), expected, "{datatypes} in {by}");
        }
        assert!(is_subsumed(&[], RDFS_LITERAL) && is_subsumed(&[&format!("{XSD}byte")], OWL_REAL));
    }
}
