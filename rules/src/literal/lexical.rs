//! Parsers of the lexical forms of XSD, RDF and OWL datatypes.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::Zero;

use super::datatype::{OWL_RATIONAL, RDF, XSD, integer_range};
use super::decimal::{self, Decimal};
use super::temporal::{Duration, Moment, within_limits};
use super::value::Literal;
use super::{binary, text};

impl Literal {
    /// Parses a literal. Never fails: an invalid form gives [`Literal::IllTyped`]. With a language, the datatype is
    /// ignored. Without both, the literal is an `xsd:string`.
    ///
    /// `"1e-05"^^xsd:decimal`, the output of Python programs, is accepted as a decimal, although XSD forbids
    /// exponents.
    pub fn parse(lexical: &str, datatype_iri: Option<&str>, language: Option<&str>) -> Self {
        if let Some(tag) = language.filter(|tag| !tag.is_empty()) {
            return Self::Language { text: lexical.into(), tag: tag.to_ascii_lowercase().into() };
        }
        let Some(datatype) = datatype_iri else { return Self::String(lexical.into()) };
        let value = match (datatype.strip_prefix(XSD), datatype.strip_prefix(RDF)) {
            (Some(local), _) => parse_xsd(lexical, local),
            (_, Some("PlainLiteral")) => Parsed::Value(parse_plain_literal(lexical)),
            _ if datatype == OWL_RATIONAL => parse_rational(lexical),
            _ => Parsed::Unknown,
        };
        let (lexical, datatype) = (Box::from(lexical), Box::from(datatype));
        match value {
            Parsed::Value(literal) => literal,
            Parsed::IllTyped => Self::IllTyped { lexical, datatype },
            Parsed::Unknown => Self::Opaque { lexical, datatype },
        }
    }
}

impl Literal {
    /// Returns `true` for a valid moment or duration whose numbers exceed the supported range. Only its datatype is
    /// known.
    pub fn exceeds_limits(&self) -> bool {
        let Self::Opaque { datatype, .. } = self else { return false };
        let local = datatype.strip_prefix(XSD);
        local.is_some_and(|local| !matches!(parse_xsd("", local), Parsed::Unknown))
    }
}

pub(super) enum Parsed {
    Value(Literal),
    IllTyped,
    /// A value of an unsupported datatype, or a valid value beyond the limits of the program.
    Unknown,
}

/// Parses `text@tag` of `rdf:PlainLiteral`. The last at-sign separates the tag. Without a tag, the literal is a
/// string.
fn parse_plain_literal(lexical: &str) -> Literal {
    match lexical.rsplit_once('@') {
        Some((text, "")) => Literal::String(text.into()),
        Some((text, tag)) => Literal::Language { text: text.into(), tag: tag.to_ascii_lowercase().into() },
        None => Literal::String(lexical.into()),
    }
}

pub(super) fn parse_xsd(lexical: &str, local: &str) -> Parsed {
    let collapsed = lexical.trim_matches([' ', '\t', '\n', '\r']);
    let value = match local {
        "string" => Some(Literal::String(lexical.into())),
        "normalizedString" | "token" | "language" | "Name" | "NCName" | "NMTOKEN" => {
            text::parse(lexical, local).map(|text| Literal::String(text.into()))
        }
        "anyURI" => text::parse(lexical, "token").map(|text| Literal::Uri(text.into())),
        "boolean" => match collapsed {
            "true" | "1" => Some(Literal::Boolean(true)),
            "false" | "0" => Some(Literal::Boolean(false)),
            _ => None,
        },
        "decimal" => Decimal::parse(collapsed).map(Literal::Decimal),
        "float" => parse_float(collapsed).map(Literal::float),
        "double" => parse_float(collapsed).map(Literal::double),
        "dateTime" | "dateTimeStamp" | "date" | "time" => {
            let parse = |text: &str| Moment::parse(text, local).map(Literal::Moment);
            match parse(collapsed) {
                None if parse(&within_limits(collapsed, local)).is_some() => return Parsed::Unknown,
                moment => moment,
            }
        }
        "duration" | "dayTimeDuration" | "yearMonthDuration" => {
            let parse = |text: &str| Duration::parse(text, local).map(Literal::Duration);
            match parse(collapsed) {
                None if parse(&within_limits(collapsed, local)).is_some() => return Parsed::Unknown,
                duration => duration,
            }
        }
        "gYear" | "gYearMonth" | "gMonth" | "gMonthDay" | "gDay" => {
            binary::recurring(collapsed, local).map(|(text, local)| Literal::Recurring(text, local))
        }
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

/// Parses a float of XSD. Accepts `INF`, `+INF`, `-INF` and `NaN`, but not `infinity`, which Rust accepts.
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

/// Parses an `owl:rational`: an integer, or `numerator / denominator`. The result is a decimal if the decimal expansion is
/// finite, and otherwise a [`Literal::Opaque`] in lowest terms.
fn parse_rational(lexical: &str) -> Parsed {
    let text = lexical.trim_matches([' ', '\t', '\n', '\r']);
    let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
    let plain = |text: &str| text.trim().strip_prefix('+').unwrap_or(text.trim()).parse::<BigInt>().ok();
    let (Some(numerator), Some(denominator)) = (plain(numerator), plain(denominator)) else {
        return Parsed::IllTyped;
    };
    // The grammar of `owl:rational` requires a positive denominator.
    if denominator <= BigInt::zero() {
        return Parsed::IllTyped;
    }
    let exact = BigRational::new(numerator, denominator);
    let fraction = || {
        let lexical = format!("{}/{}", exact.numer(), exact.denom());
        Literal::Opaque { lexical: lexical.into(), datatype: OWL_RATIONAL.into() }
    };
    Parsed::Value(Decimal::exact(&exact).map_or_else(fraction, Literal::Decimal))
}
