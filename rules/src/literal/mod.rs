//! RDF literals as values: lexical forms in, members of the XSD value spaces out ([1], [2]).
//!
//! Equality is *identity* of values: `"1.50"^^xsd:decimal`, `"1.5"^^xsd:decimal` and, where integral, every integer
//! type coincide; `"0"^^xsd:boolean` is `false`; a plain literal is an `xsd:string`. `xsd:float` and `xsd:double`
//! are value spaces of their own (a float never *is* a decimal), but comparisons promote as `XPath` does: decimal to
//! float, decimal or float to double. Values can be equal in that order without being identical ([3], sections 4.2 and
//! 4.7): the two zeros of a floating-point type, one instant in two time zones.
//!
//! Of the values of a datatype that has no meaning here nothing is known but that equal forms are one value: whether two
//! forms are one value, or lie in another datatype, is undecided ([`Literal::differs`], [`Literal::membership`]).
//!
//! [1] W3C XML Schema Definition Language 1.1 Part 2: Datatypes, 2012.
//! [2] W3C RDF 1.1 Concepts, section 5.
//! [3] W3C OWL 2 Structural Specification (Second Edition), 2012.

mod binary;
mod decimal;
mod membership;
mod subsumption;
mod temporal;
mod text;

use std::cmp::Ordering;
use std::fmt;

use num_rational::BigRational;

pub use decimal::Decimal;
pub(crate) use decimal::ten_to;
pub use subsumption::is_subsumed;
pub use temporal::{Duration, Moment, MomentKind};

/// Namespace of the XML Schema datatypes.
pub(crate) const XSD: &str = "http://www.w3.org/2001/XMLSchema#";
const RDFS_LITERAL: &str = "http://www.w3.org/2000/01/rdf-schema#Literal";
const OWL_REAL: &str = "http://www.w3.org/2002/07/owl#real";
const OWL_RATIONAL: &str = "http://www.w3.org/2002/07/owl#rational";
const RDF: &str = "http://www.w3.org/1999/02/22-rdf-syntax-ns#";

/// A data value. `Eq` and `Hash` are those of the value, not of the spelling.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum Literal {
    /// `xsd:string`, its derived types, plain literals, `rdf:PlainLiteral` without language.
    String(Box<str>),
    /// A language-tagged string; the tag is in lower case.
    Language {
        /// The text.
        text: Box<str>,
        /// For example `en-gb`.
        tag: Box<str>,
    },
    /// `xsd:boolean`.
    Boolean(bool),
    /// `xsd:decimal` and its integer types.
    Decimal(Decimal),
    /// `xsd:float`, by bits (one NaN).
    Float(u32),
    /// `xsd:double`, by bits (one NaN).
    Double(u64),
    /// `xsd:dateTime`, `xsd:date` or `xsd:time`.
    Moment(Moment),
    /// `xsd:duration` and its two derived types.
    Duration(Duration),
    /// `xsd:gYear`, `gYearMonth`, `gMonth`, `gMonthDay` or `gDay`: canonical form and local name.
    Recurring(Box<str>, &'static str),
    /// `xsd:hexBinary`.
    Hexadecimal(Box<[u8]>),
    /// `xsd:base64Binary`.
    Base64(Box<[u8]>),
    /// `xsd:anyURI`.
    Uri(Box<str>),
    /// A datatype that has no meaning here, a rational number that is no decimal (in lowest terms), or an XML literal.
    Opaque {
        /// As written.
        lexical: Box<str>,
        /// Its IRI.
        datatype: Box<str>,
    },
    /// A lexical form that its datatype forbids, which makes a knowledge base inconsistent.
    IllTyped {
        /// As written.
        lexical: Box<str>,
        /// The datatype's IRI.
        datatype: Box<str>,
    },
}

impl Literal {
    /// Reads a literal; never fails, see [`Literal::IllTyped`]. A language makes the datatype irrelevant.
    ///
    /// `"1e-05"^^xsd:decimal`, which Python programs write, is read as a decimal although XSD forbids exponents.
    pub fn parse(lexical: &str, datatype_iri: Option<&str>, language: Option<&str>) -> Self {
        if let Some(tag) = language.filter(|tag| !tag.is_empty()) {
            return Self::Language { text: lexical.into(), tag: tag.to_ascii_lowercase().into() };
        }
        let Some(datatype) = datatype_iri else { return Self::String(lexical.into()) };
        let value = match (datatype.strip_prefix(XSD), datatype.strip_prefix(RDF)) {
            (Some(local), _) => parse_xsd(lexical, local),
            (_, Some("PlainLiteral")) => Parsed::Value(parse_plain_literal(lexical)),
            _ if datatype == OWL_RATIONAL => membership::parse_rational(lexical),
            _ => Parsed::Unknown,
        };
        let (lexical, datatype) = (Box::from(lexical), Box::from(datatype));
        match value {
            Parsed::Value(literal) => literal,
            Parsed::IllTyped => Self::IllTyped { lexical, datatype },
            Parsed::Unknown => Self::Opaque { lexical, datatype },
        }
    }

    /// An `xsd:string`.
    pub fn string(text: &str) -> Self {
        Self::String(text.into())
    }

    /// An `xsd:integer`.
    pub fn integer(value: i64) -> Self {
        Self::Decimal(value.into())
    }

    /// An `xsd:double`; every NaN is the same, and zero has a sign.
    pub fn double(value: f64) -> Self {
        Self::Double(if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() })
    }

    /// An `xsd:float`; every NaN is the same, and zero has a sign.
    pub fn float(value: f32) -> Self {
        Self::Float(if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() })
    }

    /// Whether the lexical form is forbidden by its datatype.
    pub fn is_ill_typed(&self) -> bool {
        matches!(self, Self::IllTyped { .. })
    }

    /// The IRI of the most specific datatype of the canonical form; `rdf:langString` for tagged strings.
    pub fn datatype(&self) -> &str {
        match self {
            Self::String(_) => "http://www.w3.org/2001/XMLSchema#string",
            Self::Language { .. } => "http://www.w3.org/1999/02/22-rdf-syntax-ns#langString",
            Self::Boolean(_) => "http://www.w3.org/2001/XMLSchema#boolean",
            Self::Decimal(value) if value.is_integer() => "http://www.w3.org/2001/XMLSchema#integer",
            Self::Decimal(_) => "http://www.w3.org/2001/XMLSchema#decimal",
            Self::Float(_) => "http://www.w3.org/2001/XMLSchema#float",
            Self::Double(_) => "http://www.w3.org/2001/XMLSchema#double",
            Self::Moment(moment) => moment.datatype(),
            Self::Duration(duration) => duration.datatype(),
            Self::Recurring(_, local) => binary::recurring_datatype(local),
            Self::Hexadecimal(_) => "http://www.w3.org/2001/XMLSchema#hexBinary",
            Self::Base64(_) => "http://www.w3.org/2001/XMLSchema#base64Binary",
            Self::Uri(_) => "http://www.w3.org/2001/XMLSchema#anyURI",
            Self::Opaque { datatype, .. } | Self::IllTyped { datatype, .. } => datatype,
        }
    }

    /// The canonical lexical form.
    pub fn lexical(&self) -> String {
        match self {
            Self::String(text) | Self::Uri(text) | Self::Language { text, .. } | Self::Recurring(text, _) => {
                text.to_string()
            }
            Self::Hexadecimal(bytes) => binary::hexadecimal(bytes),
            Self::Base64(bytes) => binary::base64(bytes),
            Self::Boolean(value) => value.to_string(),
            Self::Decimal(value) => value.to_string(),
            Self::Float(bits) => canonical_float(f32::from_bits(*bits)),
            Self::Double(bits) => canonical_float(f64::from_bits(*bits)),
            Self::Moment(moment) => moment.to_string(),
            Self::Duration(duration) => duration.to_string(),
            Self::Opaque { lexical, .. } | Self::IllTyped { lexical, .. } => lexical.to_string(),
        }
    }

    /// The order of two values, with numeric promotion. `None` where they are incomparable: different kinds, NaN,
    /// moments with and without time zone that are closer than a time zone can tell apart.
    pub fn compare(&self, other: &Self) -> Option<Ordering> {
        match (self, other) {
            (Self::Decimal(a), Self::Decimal(b)) => Some(a.cmp(b)),
            (Self::String(a), Self::String(b)) | (Self::Uri(a), Self::Uri(b)) => Some(a.cmp(b)),
            (Self::Boolean(a), Self::Boolean(b)) => Some(a.cmp(b)),
            (Self::Moment(a), Self::Moment(b)) => a.partial_cmp(b),
            (Self::Duration(a), Self::Duration(b)) => a.partial_cmp(b),
            (Self::Float(_) | Self::Decimal(_), Self::Float(_) | Self::Decimal(_)) => {
                self.as_f32()?.partial_cmp(&other.as_f32()?)
            }
            _ if self.is_numeric() && other.is_numeric() => self.as_f64()?.partial_cmp(&other.as_f64()?),
            (Self::IllTyped { .. }, _) | (_, Self::IllTyped { .. }) => None,
            _ if self == other => Some(Ordering::Equal),
            _ => None,
        }
    }

    /// Whether the value is a number.
    pub fn is_numeric(&self) -> bool {
        matches!(self, Self::Decimal(_) | Self::Float(_) | Self::Double(_))
    }

    /// The exact value of a finite number.
    pub fn as_rational(&self) -> Option<BigRational> {
        match self {
            Self::Decimal(value) => Some(value.to_rational()),
            Self::Float(bits) => BigRational::from_float(f32::from_bits(*bits)),
            Self::Double(bits) => BigRational::from_float(f64::from_bits(*bits)),
            _ => None,
        }
    }

    /// The nearest double of a number.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Decimal(value) => Some(value.to_f64()),
            Self::Float(bits) => Some(f32::from_bits(*bits).into()),
            Self::Double(bits) => Some(f64::from_bits(*bits)),
            _ => None,
        }
    }

    pub(crate) fn as_f32(&self) -> Option<f32> {
        match self {
            Self::Decimal(value) => Some(value.to_f32()),
            Self::Float(bits) => Some(f32::from_bits(*bits)),
            _ => None,
        }
    }
}

/// N-Triples: `"1.5"^^<http://www.w3.org/2001/XMLSchema#decimal>`, strings without datatype.
impl fmt::Display for Literal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"")?;
        for character in self.lexical().chars() {
            match character {
                '"' => f.write_str("\\\"")?,
                '\\' => f.write_str("\\\\")?,
                '\n' => f.write_str("\\n")?,
                '\r' => f.write_str("\\r")?,
                '\t' => f.write_str("\\t")?,
                other => write!(f, "{other}")?,
            }
        }
        f.write_str("\"")?;
        match self {
            Self::String(_) => Ok(()),
            Self::Language { tag, .. } => write!(f, "@{tag}"),
            _ => write!(f, "^^<{}>", self.datatype()),
        }
    }
}

enum Parsed {
    Value(Literal),
    IllTyped,
    Unknown,
}

/// Whether an IRI names a datatype of XSD, RDF, RDFS or OWL.
pub(crate) fn is_datatype(iri: &str) -> bool {
    let rdf = |iri: &str| {
        iri.strip_prefix(RDF).is_some_and(|local| ["PlainLiteral", "langString"].contains(&local))
    };
    iri.starts_with(XSD) || [RDFS_LITERAL, OWL_REAL, OWL_RATIONAL].contains(&iri) || rdf(iri)
}

/// `text@tag` of `rdf:PlainLiteral`; the last at-sign separates.
fn parse_plain_literal(lexical: &str) -> Literal {
    match lexical.rsplit_once('@') {
        Some((text, "")) => Literal::String(text.into()),
        Some((text, tag)) => Literal::Language { text: text.into(), tag: tag.to_ascii_lowercase().into() },
        None => Literal::String(lexical.into()),
    }
}

fn parse_xsd(lexical: &str, local: &str) -> Parsed {
    let collapsed = lexical.trim_matches([' ', '\t', '\n', '\r']);
    let value = match local {
        "string" => Some(Literal::String(lexical.into())),
        "normalizedString" | "token" | "language" | "Name" | "NCName" | "NMTOKEN" => {
            text::parse(lexical, local).map(|text| Literal::String(text.into()))
        }
        "anyURI" => Some(Literal::Uri(collapsed.into())),
        "boolean" => match collapsed {
            "true" | "1" => Some(Literal::Boolean(true)),
            "false" | "0" => Some(Literal::Boolean(false)),
            _ => None,
        },
        "decimal" => Decimal::parse(collapsed).map(Literal::Decimal),
        "float" => parse_float(collapsed).map(Literal::float),
        "double" => parse_float(collapsed).map(Literal::double),
        "dateTime" | "dateTimeStamp" | "date" | "time" => {
            Moment::parse(collapsed, local).map(Literal::Moment)
        }
        "duration" | "dayTimeDuration" | "yearMonthDuration" => {
            Duration::parse(collapsed, local).map(Literal::Duration)
        }
        "gYear" | "gYearMonth" | "gMonth" | "gMonthDay" | "gDay" => binary::recurring(collapsed, local),
        "hexBinary" => binary::parse_hexadecimal(collapsed).map(Literal::Hexadecimal),
        "base64Binary" => binary::parse_base64(collapsed).map(Literal::Base64),
        _ => match integer_range(local) {
            Some((minimum, maximum)) => parse_integer(collapsed, minimum, maximum),
            None => return Parsed::Unknown,
        },
    };
    value.map_or(Parsed::IllTyped, Parsed::Value)
}

fn parse_integer(lexical: &str, minimum: Option<i128>, maximum: Option<i128>) -> Option<Literal> {
    if lexical.contains(['.', 'e', 'E']) {
        return None;
    }
    let value = Decimal::parse(lexical)?;
    decimal::in_range(&value, minimum, maximum).then_some(Literal::Decimal(value))
}

/// The inclusive bounds of the integer types of XSD.
fn integer_range(local: &str) -> Option<(Option<i128>, Option<i128>)> {
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

/// XSD's spelling of floats: `INF`, `-INF`, `NaN`, and no `infinity` as Rust would accept.
fn parse_float<F: std::str::FromStr>(lexical: &str) -> Option<F> {
    let normal = match lexical {
        "INF" | "+INF" => "inf",
        "-INF" => "-inf",
        "NaN" => "NaN",
        other if other.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b)) => other,
        _ => return None,
    };
    normal.parse().ok()
}

/// XSD's canonical form of a float: `1.5E0`, `INF`, `NaN`.
fn canonical_float<F: fmt::LowerExp>(value: F) -> String {
    let text = format!("{value:e}");
    match text.as_str() {
        "inf" => "INF".into(),
        "-inf" => "-INF".into(),
        "NaN" => text,
        _ => match text.split_once('e') {
            Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
            Some((mantissa, exponent)) => format!("{mantissa}.0E{exponent}"),
            None => text,
        },
    }
}
