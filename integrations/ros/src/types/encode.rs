//! Encoding of values to CDR, little endian [1].
//!
//! A number is aligned to its size, counted from the start of the data. A text begins with its length, which includes
//! the final zero. A sequence begins with its number of elements.
//!
//! [1] OMG, Common Object Request Broker Architecture 3.3, part 2, 9.3.

use std::sync::Arc;

use serde_json::Value;

use super::definition::Primitive;
use super::field::{FieldPath, unknown_field};
use super::structure::{Layout, Structure};

impl Structure {
    /// Encodes a message. Fields that the table does not give have their default values. For a
    /// number, the table may contain the name of a constant; for a `Duration` or `Time`, a number
    /// of seconds; and for NaN or an infinite number, the text `nan`, `inf` or `-inf`.
    pub(crate) fn encode(&self, table: &Value) -> Result<Vec<u8>, String> {
        let mut writer = Writer(Vec::new());
        writer.structure(self, Some(table))?;
        Ok(writer.0)
    }

    /// Converts a value of a field to the form in which [`Structure::find`] returns it: the name of
    /// a constant to its value, and a number to the nearest `float32` if this is the type of the
    /// field.
    pub(super) fn single_value(&self, path: &FieldPath, value: &Value) -> Result<Value, String> {
        let (container, layout) = path.resolve(self)?;
        let mut writer = Writer(Vec::new());
        writer
            .layout(container, layout, Some(value), None)
            .map_err(|because| format!("`{path}`: {because}"))?;
        layout.read_single(&writer.0)
    }
}

/// Converts the text of a default value or a constant of a definition. Returns `None` if the text does not have the
/// form of the type. Ranges of integers and lengths are checked only when the value is written.
pub(super) fn parse_value(text: &str, layout: &Layout) -> Option<Value> {
    let text = text.trim();
    match layout {
        Layout::Single(Primitive::Bool) => match text {
            "true" | "True" | "1" => Some(Value::Bool(true)),
            "false" | "False" | "0" => Some(Value::Bool(false)),
            _ => None,
        },
        Layout::Single(Primitive::Float32 | Primitive::Float64) => text.parse::<f64>().ok().map(Value::from),
        Layout::Single(_) => {
            let number = match text.strip_prefix("0x") {
                Some(digits) => i64::from_str_radix(digits, 16).ok().map(Value::from),
                None => text.parse::<i64>().ok().map(Value::from),
            };
            number.or_else(|| text.parse::<u64>().ok().map(Value::from))
        }
        Layout::Text { .. } => Some(unquoted(text).into()),
        Layout::Array(element, _) | Layout::Sequence { element, .. } => {
            let inner = text.strip_prefix('[')?.strip_suffix(']')?.trim();
            let elements = if inner.is_empty() { Vec::new() } else { split(inner) };
            elements.into_iter().map(|text| parse_value(text, element)).collect::<Option<_>>()
        }
        Layout::Structure(_) => None,
    }
}

fn unquoted(text: &str) -> &str {
    let inner = |quote: char| text.strip_prefix(quote)?.strip_suffix(quote);
    inner('"').or_else(|| inner('\'')).unwrap_or(text)
}

/// Splits at commas outside of quoted texts.
fn split(text: &str) -> Vec<&str> {
    let mut quote = None;
    text.split(|character: char| match (quote, character) {
        (None, ',') => true,
        (None, '"' | '\'') => {
            quote = Some(character);
            false
        }
        (Some(open), close) if open == close => {
            quote = None;
            false
        }
        _ => false,
    })
    .collect()
}

struct Writer(Vec<u8>);

impl Writer {
    fn aligned<const N: usize>(&mut self, bytes: [u8; N]) {
        self.0.resize(self.0.len().next_multiple_of(N), 0);
        self.0.extend(bytes);
    }

    fn length(&mut self, length: usize) -> Result<(), String> {
        let length = u32::try_from(length).map_err(|_| format!("{length} elements are too many"))?;
        self.aligned(length.to_le_bytes());
        Ok(())
    }

    fn structure(&mut self, structure: &Structure, value: Option<&Value>) -> Result<(), String> {
        let seconds;
        let table = match value {
            None => None,
            Some(Value::Object(table)) => Some(table),
            Some(number) => {
                seconds = of_seconds(structure, number)?;
                Some(&seconds)
            }
        };
        let names = table.into_iter().flat_map(|table| table.keys());
        for name in names {
            structure.field(name).ok_or_else(|| unknown_field(structure, name))?;
        }
        for field in &structure.fields {
            let value = table.and_then(|table| table.get(&field.name));
            self.layout(structure, &field.layout, value, field.default.as_ref())
                .map_err(|because| format!("`{}`: {because}", field.name))?;
        }
        Ok(())
    }

    /// Writes `value`; if it is missing, the default; and without a default, zero, false or empty. Names of constants
    /// are looked up in `container`.
    fn layout(
        &mut self,
        container: &Structure,
        layout: &Layout,
        value: Option<&Value>,
        default: Option<&Value>,
    ) -> Result<(), String> {
        let value = value.or(default);
        match layout {
            Layout::Single(primitive) => self.primitive(*primitive, value, container),
            Layout::Text { greatest_length } => {
                let text = match value {
                    None => "",
                    Some(Value::String(text)) => text,
                    Some(other) => return Err(format!("{other} is not a text")),
                };
                if text.contains('\0') {
                    return Err("a text cannot contain the character 0".to_owned());
                }
                if greatest_length.is_some_and(|greatest| text.len() > greatest as usize) {
                    return Err(format!("the text is longer than {} bytes", greatest_length.unwrap_or(0)));
                }
                self.length(text.len() + 1)?;
                self.0.extend(text.bytes());
                self.0.push(0);
                Ok(())
            }
            Layout::Structure(inner) => self.structure(inner, value),
            Layout::Array(element, size) => {
                let elements = list(value)?;
                if value.is_some() && elements.len() != *size as usize {
                    return Err(format!("{} elements are given, {size} are needed", elements.len()));
                }
                (0..*size as usize).try_for_each(|index| {
                    self.layout(container, element, elements.get(index), None)
                        .map_err(|because| format!("[{index}]: {because}"))
                })
            }
            Layout::Sequence { element, greatest_length } => {
                let elements = list(value)?;
                if greatest_length.is_some_and(|greatest| elements.len() > greatest as usize) {
                    return Err(format!("more than {} elements are given", greatest_length.unwrap_or(0)));
                }
                self.length(elements.len())?;
                elements.iter().enumerate().try_for_each(|(index, value)| {
                    self.layout(container, element, Some(value), None)
                        .map_err(|because| format!("[{index}]: {because}"))
                })
            }
        }
    }

    fn primitive(
        &mut self,
        primitive: Primitive,
        value: Option<&Value>,
        container: &Structure,
    ) -> Result<(), String> {
        let zero = Value::from(0);
        let value = match value {
            Some(Value::String(name)) => container.constants.get(name).or(value).unwrap_or(&zero),
            Some(value) => value,
            None if primitive == Primitive::Bool => &Value::Bool(false),
            None => &zero,
        };
        macro_rules! integer {
            ($kind:ty) => {{
                let number = value.as_i64().map(i128::from).or_else(|| value.as_u64().map(i128::from));
                let number = number.and_then(|number| <$kind>::try_from(number).ok());
                let (least, greatest) = (<$kind>::MIN, <$kind>::MAX);
                let wrong =
                    || wrong_number(value, &format!("an integer from {least} to {greatest}"), container);
                self.aligned(number.ok_or_else(wrong)?.to_le_bytes());
            }};
        }
        match primitive {
            Primitive::Bool => {
                let truth = value.as_bool().ok_or_else(|| format!("{value} is neither true nor false"))?;
                self.aligned([u8::from(truth)]);
            }
            Primitive::Byte | Primitive::Char | Primitive::Uint8 => integer!(u8),
            Primitive::Int8 => integer!(i8),
            Primitive::Int16 => integer!(i16),
            Primitive::Uint16 => integer!(u16),
            Primitive::Int32 => integer!(i32),
            Primitive::Uint32 => integer!(u32),
            Primitive::Int64 => integer!(i64),
            Primitive::Uint64 => integer!(u64),
            Primitive::Float32 => {
                let number = float(value).ok_or_else(|| wrong_number(value, "a number", container))?;
                self.aligned((number as f32).to_le_bytes());
            }
            Primitive::Float64 => {
                let number = float(value).ok_or_else(|| wrong_number(value, "a number", container))?;
                self.aligned(number.to_le_bytes());
            }
            // Texts have their own layout.
            Primitive::String => return Err("a text is not a number".to_owned()),
        }
        Ok(())
    }
}

fn wrong_number(value: &Value, wanted: &str, container: &Structure) -> String {
    let constants: Vec<&str> = container.constants.keys().map(String::as_str).collect();
    let constants = match value {
        Value::String(_) if !constants.is_empty() => format!(", nor one of {}", constants.join(", ")),
        Value::Null => "; write NaN and infinite numbers as texts: \"nan\", \"inf\", \"-inf\"".to_owned(),
        _ => String::new(),
    };
    format!("{value} is not {wanted}{constants}")
}

fn float(value: &Value) -> Option<f64> {
    match value.as_str() {
        Some("nan") => Some(f64::NAN),
        Some("inf") => Some(f64::INFINITY),
        Some("-inf") => Some(f64::NEG_INFINITY),
        Some(_) => None,
        None => value.as_f64(),
    }
}

fn list(value: Option<&Value>) -> Result<&[Value], String> {
    match value {
        None => Ok(&[]),
        Some(Value::Array(elements)) => Ok(elements),
        Some(other) => Err(format!("{other} is not a list")),
    }
}

/// Converts a number of seconds to the fields of `builtin_interfaces/msg/Duration` or `Time`.
fn of_seconds(structure: &Structure, value: &Value) -> Result<serde_json::Map<String, Value>, String> {
    let is_time =
        ["builtin_interfaces/msg/Duration", "builtin_interfaces/msg/Time"].contains(&&*structure.name);
    let number = value.as_f64().filter(|number| number.abs() < f64::from(i32::MAX));
    let (true, Some(number)) = (is_time, number) else {
        let hint = if is_time { ", or a number of seconds" } else { "" };
        return Err(format!("{value} is not a table with the fields of {}{hint}", structure.name));
    };
    // The field `nanosec` is unsigned. For a negative time, `sec` is rounded down, and `nanosec` is added to it.
    let nanoseconds = (number * 1e9).round() as i64;
    let (seconds, nanoseconds) =
        (nanoseconds.div_euclid(1_000_000_000), nanoseconds.rem_euclid(1_000_000_000));
    Ok([("sec".to_owned(), seconds.into()), ("nanosec".to_owned(), nanoseconds.into())].into_iter().collect())
}

/// Returns the number of single values in a structure, or `None` if it exceeds `limit`. A sequence counts as one
/// value.
pub(super) fn least_size(structure: &Arc<Structure>, limit: u64) -> Option<u64> {
    structure.fields.iter().try_fold(0, |sum: u64, field| {
        sum.checked_add(layout_size(&field.layout, limit)?).filter(|sum| *sum <= limit)
    })
}

fn layout_size(layout: &Layout, limit: u64) -> Option<u64> {
    let size = match layout {
        Layout::Single(_) | Layout::Text { .. } | Layout::Sequence { .. } => 1,
        Layout::Structure(inner) => least_size(inner, limit)?,
        Layout::Array(element, size) => layout_size(element, limit)?.checked_mul((*size).into())?,
    };
    (size <= limit).then_some(size)
}
