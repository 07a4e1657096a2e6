//! Tests whether two literals certainly have different values, and whether a value lies in a datatype (yes,
//! no or undecided).

use super::datatype::{OWL_RATIONAL, OWL_REAL, RDF, RDFS_LITERAL, XSD};
use super::lexical::{Parsed, parse_xsd};
use super::value::Literal;

const XML_LITERAL: &str = "http://www.w3.org/1999/02/22-rdf-syntax-ns#XMLLiteral";

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Known,
    Rational,
    /// XML content. Two different spellings can denote the same value.
    Xml,
    /// An arbitrary value, see [`Literal::fresh`].
    Fresh,
    /// One of several arbitrary, but different values, see [`Literal::distinct`].
    Distinct,
    Unknown,
}

impl Literal {
    /// Creates a fresh value, for conclusions about an arbitrary value. It can equal any other value, even a fresh value
    /// with another number.
    pub fn fresh(number: usize) -> Self {
        Self::Opaque { lexical: number.to_string().into(), datatype: FRESH.into() }
    }

    /// Creates a fresh value that is assumed to differ from the distinct fresh values with other numbers. It can equal
    /// any other value.
    pub fn distinct(number: usize) -> Self {
        Self::Opaque { lexical: number.to_string().into(), datatype: DISTINCT.into() }
    }

    pub(crate) fn is_fresh(&self) -> bool {
        matches!(self.kind(), Kind::Fresh | Kind::Distinct)
    }

    /// Returns `true` if two literals certainly have different values. Returns `false` if they are equal,
    /// or if that is undecided.
    pub fn differs(&self, other: &Self) -> bool {
        if self == other {
            return false;
        }
        match (self.kind(), other.kind()) {
            (Kind::Distinct, Kind::Distinct) => true,
            (Kind::Unknown | Kind::Fresh | Kind::Distinct, _)
            | (_, Kind::Unknown | Kind::Fresh | Kind::Distinct)
            | (Kind::Xml, Kind::Xml) => false,
            _ => true,
        }
    }

    fn kind(&self) -> Kind {
        match self {
            Self::Opaque { datatype, .. } => match &**datatype {
                OWL_RATIONAL => Kind::Rational,
                XML_LITERAL => Kind::Xml,
                FRESH => Kind::Fresh,
                DISTINCT => Kind::Distinct,
                _ => Kind::Unknown,
            },
            _ => Kind::Known,
        }
    }

    /// Returns `true` if the value certainly lies in the value space of a datatype. For example, `5` lies in
    /// `xsd:byte` and `xsd:decimal`, `1.5` lies in `xsd:decimal` but not in `xsd:byte`, and no float lies in
    /// `xsd:decimal`.
    pub fn is_in(&self, datatype_iri: &str) -> bool {
        self.membership(datatype_iri) == Some(true)
    }

    /// Decides whether the value lies in the value space of a datatype. Returns `None` if that is
    /// undecided, for example because one of the datatypes is unsupported.
    pub fn membership(&self, datatype_iri: &str) -> Option<bool> {
        if self.is_ill_typed() {
            return Some(false);
        }
        if datatype_iri == RDFS_LITERAL {
            return Some(true);
        }
        let is_real = [OWL_REAL, OWL_RATIONAL].contains(&datatype_iri);
        match (self.kind(), self) {
            (_, Self::Opaque { datatype, .. }) if **datatype == *datatype_iri => Some(true),
            (Kind::Rational, _) if is_real => Some(true),
            (Kind::Unknown | Kind::Fresh | Kind::Distinct, _) => None,
            (Kind::Rational | Kind::Xml, _) => is_known(datatype_iri).then_some(false),
            (Kind::Known, _) if datatype_iri == XML_LITERAL => Some(false),
            (Kind::Known, _) if is_real => Some(matches!(self, Self::Decimal(_))),
            (Kind::Known, _) => is_known(datatype_iri).then(|| self.is_in_known(datatype_iri)),
        }
    }

    fn is_in_known(&self, datatype_iri: &str) -> bool {
        // The most frequent case, without a comparison of lexical forms.
        if matches!(self, Self::Decimal(_)) && datatype_iri.strip_prefix(XSD) == Some("decimal") {
            return true;
        }
        match (self, datatype_iri.strip_prefix(RDF)) {
            // The zero duration lies in both derived types, although its canonical form belongs to one of
            // them.
            (Self::Duration(duration), _) => duration.is_in(datatype_iri),
            (Self::Language { .. }, Some("langString" | "PlainLiteral"))
            | (Self::String(_), Some("PlainLiteral")) => true,
            (_, Some(_)) | (Self::Language { .. }, _) => false,
            _ => *self == Self::parse(&self.lexical(), Some(datatype_iri), None),
        }
    }
}

const FRESH: &str = "urn:metaplan:fresh";
const DISTINCT: &str = "urn:metaplan:distinct";

fn is_known(iri: &str) -> bool {
    match (iri.strip_prefix(XSD), iri.strip_prefix(RDF)) {
        (Some(local), _) => !matches!(parse_xsd("", local), Parsed::Unknown),
        (_, Some(local)) => ["PlainLiteral", "langString"].contains(&local),
        _ => [OWL_REAL, OWL_RATIONAL].contains(&iri),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Literal {
        let (lexical, datatype) = text.split_once('^').unwrap_or((text, "string"));
        let datatype = match datatype {
            "rational" => OWL_RATIONAL.to_owned(),
            "xml" => XML_LITERAL.to_owned(),
            "own" => "http://x#own".to_owned(),
            local => format!("{XSD}{local}"),
        };
        Literal::parse(lexical, Some(&datatype), None)
    }

    #[test]
    fn differences_are_certain_or_undecided() {
        // 1: equal; 2: different; 0: undecided.
        for (left, right, expected) in [
            ("1.0^decimal", "1^integer", 1),
            ("1^decimal", "1^float", 2),
            ("0^float", "-0^float", 2),
            ("2020-01-01T00:00:00Z^dateTime", "2020-01-01T01:00:00+01:00^dateTime", 2),
            ("2020-01-01T00:00:00Z^dateTime", "2020-01-01T00:00:00+00:00^dateTime", 1),
            ("0A^hexBinary", "0a^hexBinary", 1),
            ("0A^hexBinary", "0B^hexBinary", 2),
            ("Zm9v^base64Binary", "Z m 9 v^base64Binary", 1),
            ("1980^gYear", "1981^gYear", 2),
            ("--01^gMonth", "01^string", 2),
            ("1/2^rational", "0.5^decimal", 1),
            // 2^-40 has 40 fractional digits.
            ("1/1099511627776^rational", "0.0000000000009094947017729282379150390625^decimal", 1),
            ("2/6^rational", "1/3^rational", 1),
            ("1/3^rational", "2/3^rational", 2),
            ("1/3^rational", "0.33^decimal", 2),
            ("<a/>^xml", "<a></a>^xml", 0),
            ("<a/>^xml", "<a/>^string", 2),
            ("1^own", "2^own", 0),
            ("1^own", "1^integer", 0),
            ("1^own", "1^own", 1),
        ] {
            let (left, right) = (read(left), read(right));
            let relation = match (left == right, left.differs(&right)) {
                (true, false) => 1,
                (false, true) => 2,
                (false, false) => 0,
                (true, true) => 3,
            };
            assert_eq!(relation, expected, "{left} {right}");
            assert_eq!(left.differs(&right), right.differs(&left), "{left} {right}");
        }
        let [fresh, distinct] = [Literal::fresh, Literal::distinct];
        assert!(distinct(1).differs(&distinct(2)));
        for other in [fresh(2), distinct(2), read("1")] {
            assert!(!fresh(1).differs(&other) && !other.differs(&fresh(1)), "{other}");
        }
        assert!(!distinct(1).differs(&read("1")) && !read("1").differs(&distinct(1)));
    }

    #[test]
    fn membership_is_certain_or_undecided() {
        for (literal, datatype, expected) in [
            ("1^own", "decimal", None),
            ("1^decimal", "own", None),
            ("1^own", "own", Some(true)),
            ("<a/>^xml", "string", Some(false)),
            ("1/3^rational", "decimal", Some(false)),
            ("1/2^rational", "decimal", Some(true)),
            ("1/1099511627776^rational", "decimal", Some(true)),
            ("1/3^rational", "rational", Some(true)),
            ("1980^gYear", "gYear", Some(true)),
            ("1980^gYear", "integer", Some(false)),
            ("x^integer", "integer", Some(false)),
            ("0a^hexBinary", "hexBinary", Some(true)),
            ("0^gYear", "gYear", Some(false)),
        ] {
            let iri = match datatype {
                "own" => "http://x#own".to_owned(),
                "rational" => OWL_RATIONAL.to_owned(),
                local => format!("{XSD}{local}"),
            };
            assert_eq!(read(literal).membership(&iri), expected, "{literal} {datatype}");
        }
    }
}
