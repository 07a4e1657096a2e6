//! Subsumption of datatypes: decides if the intersection of several datatypes is contained in another datatype. Uses
//! the type hierarchy of XML Schema 1.1 (part 2, section 3) and the bounds of its integer types.

use super::datatype::{OWL_RATIONAL, OWL_REAL, RDF, RDFS_LITERAL, XSD, integer_range};

/// Pairs of a derived datatype and its base type, by local name. Integer types are compared by their
/// bounds instead.
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

/// Datatypes with disjoint value spaces, except `integer`, which is contained in `decimal`.
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

fn local(iri: &str) -> Option<&str> {
    match iri {
        OWL_REAL => Some("real"),
        OWL_RATIONAL => Some("rational"),
        _ => iri.strip_prefix(XSD).or_else(|| iri.strip_prefix(RDF).filter(|local| *local == "PlainLiteral")),
    }
}

fn upwards(local: &str) -> Vec<&str> {
    let mut ancestors = vec![local];
    while let Some((_, parent)) =
        ancestors.last().and_then(|last| BELOW.iter().find(|(below, _)| below == last))
    {
        ancestors.push(parent);
    }
    if integer_range(local).is_some() {
        ancestors.push("integer");
    }
    if ancestors.contains(&"integer") || ancestors.contains(&"decimal") {
        ancestors.extend(["decimal", "rational", "real"]);
    }
    if ancestors.contains(&"rational") {
        ancestors.push("real");
    }
    if ancestors.contains(&"string") {
        ancestors.push("PlainLiteral");
    }
    ancestors
}

/// Returns the primitive datatype that contains a datatype; `None` if it has no such datatype, as for `owl:real`.
fn primitive(local: &str) -> Option<&'static str> {
    let ancestors = upwards(local);
    let is_ancestor = |name: &&&str| ancestors.contains(name) && **name != "integer";
    DISJOINT.iter().find(is_ancestor).copied()
}

/// Returns `true` if every value in the intersection of some datatypes lies in another datatype. Returns `false` if
/// this is not so, or undecided.
pub fn is_subsumed(datatypes: &[&str], by: &str) -> bool {
    if by == RDFS_LITERAL || datatypes.contains(&by) {
        return true;
    }
    let Some(by) = local(by) else { return false };
    let local_names: Vec<&str> = datatypes.iter().filter_map(|datatype| local(datatype)).collect();
    let mut primitives: Vec<&str> = local_names.iter().filter_map(|datatype| primitive(datatype)).collect();
    primitives.sort_unstable();
    primitives.dedup();
    // Different primitive types are disjoint, and the empty intersection lies in every datatype.
    if primitives.len() > 1 || local_names.iter().any(|datatype| upwards(datatype).contains(&by)) {
        return true;
    }
    let ranges: Vec<_> = local_names.iter().filter_map(|datatype| integer_range(datatype)).collect();
    let low = ranges.iter().filter_map(|(low, _)| *low).max();
    let high = ranges.iter().filter_map(|(_, high)| *high).min();
    // The integer types have no value in common.
    if low.zip(high).is_some_and(|(low, high)| low > high) {
        return true;
    }
    let (Some((minimum, maximum)), false) = (integer_range(by), ranges.is_empty()) else { return false };
    let is_above = minimum.is_none_or(|minimum| low.is_some_and(|low| low >= minimum));
    is_above && maximum.is_none_or(|maximum| high.is_some_and(|high| high <= maximum))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intersections_of_datatypes_are_subsumed() {
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
