//! Resolved structures, and checks of values against them.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::Value;

use super::definition::Primitive;
use super::field::FieldPath;

/// A message, or a part of a service or an action, with all structures that it refers to.
#[derive(Debug, PartialEq)]
pub(crate) struct Structure {
    /// Full name, such as `std_srvs/srv/SetBool_Request`.
    pub(crate) name: String,
    pub(super) fields: Vec<StructureField>,
    /// Values of the constants, by name. In the settings, such a name can replace a number.
    pub(super) constants: BTreeMap<String, Value>,
}

#[derive(Debug, PartialEq)]
pub(super) struct StructureField {
    pub(super) name: String,
    pub(super) layout: Layout,
    /// Value in messages that do not give the field. `None` selects zero, false or empty.
    pub(super) default: Option<Value>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Layout {
    /// A number or a truth value.
    Single(Primitive),
    Text {
        greatest_length: Option<u32>,
    },
    Structure(Arc<Structure>),
    Array(Box<Layout>, u32),
    Sequence {
        element: Box<Layout>,
        greatest_length: Option<u32>,
    },
}

impl Structure {
    pub(super) fn field(&self, name: &str) -> Option<&StructureField> {
        self.fields.iter().find(|field| field.name == name)
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.fields.iter().map(|field| field.name.as_str())
    }

    pub(crate) fn has_truth_value(&self, name: &str) -> bool {
        self.field(name).is_some_and(|field| field.layout == Layout::Single(Primitive::Bool))
    }

    pub(crate) fn has_text(&self, name: &str) -> bool {
        self.field(name).is_some_and(|field| matches!(field.layout, Layout::Text { .. }))
    }

    /// Returns `true` if the definition has no fields, so that the structure consists of the field that rosidl adds.
    pub(crate) fn is_empty(&self) -> bool {
        self.names().eq(["structure_needs_at_least_one_member"])
    }
}

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Expectation(Vec<(FieldPath, Value)>);

impl Expectation {
    /// Reads an expectation from a table. Its keys are fields or paths to fields.
    pub(crate) fn new(structure: &Structure, table: &Value) -> Result<Self, String> {
        let mut fields = Vec::new();
        collect("", table, &mut fields)?;
        let expected = fields.into_iter().map(|(path, value)| {
            let path = FieldPath::parse(&path)?;
            let value = structure.single_value(&path, &value)?;
            Ok((path, value))
        });
        expected.collect::<Result<_, String>>().map(Self)
    }

    /// Checks received data; `offset` is as for [`Structure::find`].
    pub(crate) fn check(&self, structure: &Structure, data: &[u8], offset: usize) -> Result<(), String> {
        for (path, expected) in &self.0 {
            let present = structure.find(path, data, offset)?;
            if present.as_ref() != Some(expected) {
                let present = present.map_or_else(|| "missing".to_owned(), |value| value.to_string());
                return Err(format!("`{path}` is {present}, and should be {expected}"));
            }
        }
        Ok(())
    }
}

/// Collects the values of a table and of all tables in it, with paths such as `a.b`.
fn collect(prefix: &str, value: &Value, fields: &mut Vec<(String, Value)>) -> Result<(), String> {
    match value {
        Value::Object(table) => table.iter().try_for_each(|(key, value)| {
            let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
            collect(&path, value, fields)
        }),
        Value::Array(_) => Err(format!("`{prefix}`: name single elements of a list, as in `{prefix}[0]`")),
        _ if prefix.is_empty() => Err("expected values are a table of fields".to_owned()),
        _ => {
            fields.push((prefix.to_owned(), value.clone()));
            Ok(())
        }
    }
}
