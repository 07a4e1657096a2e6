//! Literals, their order and their canonical forms.

use std::cmp::Ordering;
use std::fmt;

use num_rational::BigRational;

use super::binary;
use super::decimal::Decimal;
use super::temporal::{Duration, Moment};

/// A literal. `Eq` and `Hash` compare values, not lexical forms, except for ill-typed literals and for
/// [`Literal::Opaque`] ones that are not rational numbers.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum Literal {
    /// `xsd:string` and its derived types, plain literals, and `rdf:PlainLiteral` without language.
    String(Box<str>),
    /// A language-tagged string. The tag is in lower case.
    Language {
        /// The text.
        text: Box<str>,
        /// Language tag, for example `en-gb`.
        tag: Box<str>,
    },
    /// `xsd:boolean`.
    Boolean(bool),
    /// `xsd:decimal` and its integer types.
    Decimal(Decimal),
    /// `xsd:float` as bits. There is only one NaN.
    Float(u32),
    /// `xsd:double` as bits. There is only one NaN.
    Double(u64),
    /// `xsd:dateTime`, `xsd:date` or `xsd:time`.
    Moment(Moment),
    /// `xsd:duration` and its two derived types.
    Duration(Duration),
    /// Canonical form and local name of `xsd:gYear`, `gYearMonth`, `gMonth`, `gMonthDay` or `gDay`.
    Recurring(Box<str>, &'static str),
    /// `xsd:hexBinary`.
    Hexadecimal(Box<[u8]>),
    /// `xsd:base64Binary`.
    Base64(Box<[u8]>),
    /// `xsd:anyURI`.
    Uri(Box<str>),
    /// A literal of an unsupported datatype, a rational number that is not a decimal (in lowest terms), an XML
    /// literal, or a moment or duration whose numbers exceed the supported range.
    Opaque {
        /// Lexical form as written; for a rational number, in lowest terms.
        lexical: Box<str>,
        /// IRI of the datatype.
        datatype: Box<str>,
    },
    /// A literal whose lexical form is invalid for its datatype. Such a literal makes a knowledge base
    /// inconsistent.
    IllTyped {
        /// Lexical form as written.
        lexical: Box<str>,
        /// IRI of the datatype.
        datatype: Box<str>,
    },
}

impl From<bool> for Literal {
    fn from(value: bool) -> Self {
        Self::Boolean(value)
    }
}

impl From<i64> for Literal {
    fn from(value: i64) -> Self {
        Self::integer(value)
    }
}

impl From<&str> for Literal {
    fn from(text: &str) -> Self {
        Self::string(text)
    }
}

impl Literal {
    /// Creates an `xsd:string`.
    pub fn string(text: &str) -> Self {
        Self::String(text.into())
    }

    /// Creates an `xsd:integer`.
    pub fn integer(value: i64) -> Self {
        Self::Decimal(value.into())
    }

    /// Creates an `xsd:double`. All NaNs are identical, and the two zeros are different.
    pub fn double(value: f64) -> Self {
        Self::Double(if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() })
    }

    /// Creates an `xsd:float`. All NaNs are identical, and the two zeros are different.
    pub fn float(value: f32) -> Self {
        Self::Float(if value.is_nan() { f32::NAN.to_bits() } else { value.to_bits() })
    }

    /// Returns `true` if the lexical form is invalid for the datatype.
    pub fn is_ill_typed(&self) -> bool {
        matches!(self, Self::IllTyped { .. })
    }

    /// Returns the IRI of the datatype of the canonical form, for example `xsd:integer` for an integral
    /// decimal; `rdf:langString` for tagged strings.
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

    /// Returns a lexical form that depends only on the value, or the form as written for an ill-typed literal and for
    /// [`Literal::Opaque`] ones that are not rational numbers.
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

    pub(crate) fn size(&self) -> u64 {
        let size = match self {
            Self::String(text) | Self::Uri(text) | Self::Language { text, .. } | Self::Recurring(text, _) => {
                text.len()
            }
            Self::Hexadecimal(bytes) | Self::Base64(bytes) => bytes.len(),
            Self::Decimal(value) => value.size(),
            Self::Opaque { lexical, .. } | Self::IllTyped { lexical, .. } => lexical.len(),
            Self::Moment(moment) => moment.seconds().size(),
            Self::Duration(duration) => duration.seconds().size(),
            Self::Boolean(_) | Self::Float(_) | Self::Double(_) => 0,
        };
        size as u64
    }

    /// Compares two values, with numeric promotion. Returns `None` if they are incomparable:
    /// - values of different kinds, NaN and ill-typed literals;
    /// - different values of a kind without an order, such as binary data or tagged strings;
    /// - durations whose order depends on the lengths of months;
    /// - moments with and without a time zone whose order depends on the time zone.
    pub fn compare(&self, other: &Self) -> Option<Ordering> {
        match (self, other) {
            (Self::Decimal(a), Self::Decimal(b)) => Some(a.cmp(b)),
            (Self::String(a), Self::String(b)) | (Self::Uri(a), Self::Uri(b)) => Some(a.cmp(b)),
            (Self::Boolean(a), Self::Boolean(b)) => Some(a.cmp(b)),
            (Self::Moment(a), Self::Moment(b)) => a.partial_cmp(b),
            (Self::Duration(a), Self::Duration(b)) => a.partial_cmp(b),
            // A decimal is promoted to float, and with a double, both numbers are promoted to double.
            (Self::Float(_) | Self::Decimal(_), Self::Float(_) | Self::Decimal(_)) => {
                self.as_f32()?.partial_cmp(&other.as_f32()?)
            }
            _ if self.is_numeric() && other.is_numeric() => self.as_f64()?.partial_cmp(&other.as_f64()?),
            (Self::IllTyped { .. }, _) | (_, Self::IllTyped { .. }) => None,
            _ if self == other => Some(Ordering::Equal),
            _ => None,
        }
    }

    /// Returns `true` for a decimal, a float or a double.
    pub fn is_numeric(&self) -> bool {
        matches!(self, Self::Decimal(_) | Self::Float(_) | Self::Double(_))
    }

    /// Returns the exact value of a decimal, a finite float or a finite double; `None` for other literals.
    pub fn as_rational(&self) -> Option<BigRational> {
        match self {
            Self::Decimal(value) => Some(value.to_rational()),
            Self::Float(bits) => BigRational::from_float(f32::from_bits(*bits)),
            Self::Double(bits) => BigRational::from_float(f64::from_bits(*bits)),
            _ => None,
        }
    }

    /// Returns the nearest double of a decimal, float or double; `None` for other literals.
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

/// Formats the literal in N-Triples, for example `"1.5"^^<http://www.w3.org/2001/XMLSchema#decimal>`;
/// strings have no datatype.
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
