//! Parsers for the fields of a JSON line, with messages for missing, wrong and repeated fields.

use std::collections::HashSet;
use std::time::Duration;

use num_rational::BigRational;
use serde_json::{Map, Value};

use crate::number;

/// Reason why an input line, or a part of the line, is rejected. Rejected input has no effect of its own, but its line
/// can advance the time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// Stable code of the message.
    pub code: &'static str,
    /// Message, one sentence.
    pub message: String,
}

impl Refusal {
    pub(crate) fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self { code, message: message.into() }
    }
}

/// Returns the first repeated key of an object. Nested objects are not checked.
pub(super) fn doubled_key(text: &str) -> Option<String> {
    let Keys(keys) = serde_json::from_str(text).ok()?;
    let mut distinct = HashSet::new();
    keys.iter().find(|key| !distinct.insert(*key)).cloned()
}

struct Keys(Vec<String>);

impl<'de> serde::Deserialize<'de> for Keys {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = Keys;

            fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.write_str("an object")
            }

            fn visit_map<M: serde::de::MapAccess<'de>>(self, mut map: M) -> Result<Keys, M::Error> {
                let mut keys = Vec::new();
                while let Some((key, _)) = map.next_entry::<String, serde::de::IgnoredAny>()? {
                    keys.push(key);
                }
                Ok(Keys(keys))
            }
        }
        deserializer.deserialize_map(Visitor)
    }
}

pub(super) fn seconds(value: &Value) -> Option<Duration> {
    number::from_json(value).and_then(|value| Duration::try_from_secs_f64(number::to_f64(&value)).ok())
}

/// Removes a field and parses its value with `read`. Returns `None` if the field is missing. `wanted` describes the
/// expected value in the error message, e.g. "the name of a component".
pub(super) fn take<T>(
    fields: &mut Map<String, Value>,
    name: &str,
    wanted: &str,
    read: impl Fn(&Value) -> Option<T>,
) -> Result<Option<T>, Refusal> {
    match fields.remove(name) {
        None => Ok(None),
        Some(value) => match read(&value) {
            Some(read) => Ok(Some(read)),
            None => Err(Refusal::new("M302", format!("`{name}` is {value}, but should be {wanted}"))),
        },
    }
}

pub(super) fn need<T>(
    fields: &mut Map<String, Value>,
    name: &str,
    wanted: &str,
    read: impl Fn(&Value) -> Option<T>,
) -> Result<T, Refusal> {
    let missing = || Refusal::new("M302", format!("the field `{name}` is missing; it should be {wanted}"));
    take(fields, name, wanted, read)?.ok_or_else(missing)
}

pub(super) fn text(value: &Value) -> Option<String> {
    value.as_str().map(str::trim).filter(|text| !text.is_empty()).map(ToOwned::to_owned)
}

pub(super) fn fraction(value: &Value) -> Option<BigRational> {
    let (zero, one) = (BigRational::from_integer(0.into()), BigRational::from_integer(1.into()));
    let percent = BigRational::from_integer(100.into());
    let fraction = number::from_json(value).filter(|fraction| (zero..=one).contains(fraction))?;
    Some((fraction * &percent).round() / percent)
}

pub(super) fn numbers(value: &Value) -> Option<Vec<(String, BigRational)>> {
    let fields = value.as_object()?.iter();
    fields.map(|(name, value)| Some((name.clone(), number::from_json(value)?))).collect()
}

pub(super) fn word(value: &Value) -> Option<String> {
    match value {
        Value::Bool(truth) => Some(truth.to_string()),
        Value::Number(number) => Some(number.to_string()),
        other => text(other),
    }
}
