//! Paths to fields of messages, such as `status.status` or `cell_voltage[0]`.

use std::fmt;

use metaplan::message::did_you_mean;

use super::structure::{Layout, Structure};

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Part {
    Field(String),
    Index(usize),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FieldPath(pub(super) Vec<Part>);

impl FieldPath {
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is not a field: write names with points between them, and indices as in `values[0]`"
            )
        };
        let mut parts = Vec::new();
        for name in text.split('.') {
            let (name, indices) = name.split_at(name.find('[').unwrap_or(name.len()));
            if name.is_empty() {
                return Err(wrong());
            }
            parts.push(Part::Field(name.to_owned()));
            let mut remaining = indices;
            while !remaining.is_empty() {
                let (index, after) =
                    remaining.strip_prefix('[').and_then(|inner| inner.split_once(']')).ok_or_else(wrong)?;
                parts.push(Part::Index(index.parse().map_err(|_| wrong())?));
                remaining = after;
            }
        }
        Ok(Self(parts))
    }

    pub(crate) fn is_text(&self, structure: &Structure) -> Result<bool, String> {
        let (_, layout) = self.resolve(structure)?;
        Ok(matches!(layout, Layout::Text { .. }))
    }

    /// Returns the layout of the field, and the structure that contains it. Fails if the structure
    /// has no such field, or if the field is a list or has fields itself.
    pub(super) fn resolve<'s>(
        &self,
        structure: &'s Structure,
    ) -> Result<(&'s Structure, &'s Layout), String> {
        let mut container = structure;
        let mut layout: Option<&Layout> = None;
        for part in &self.0 {
            layout = Some(match (part, layout) {
                (Part::Field(name), None | Some(Layout::Structure(_))) => {
                    if let Some(Layout::Structure(inner)) = layout {
                        container = inner;
                    }
                    let field = container.field(name).ok_or_else(|| unknown_field(container, name))?;
                    &field.layout
                }
                (Part::Field(name), _) => return Err(format!("there is nothing below a value: `{name}`")),
                (Part::Index(_), Some(Layout::Sequence { element, .. })) => element,
                (Part::Index(index), Some(Layout::Array(element, size))) => {
                    if *index >= *size as usize {
                        let name = &structure.name;
                        return Err(format!("the list of {name} has {size} elements, from 0"));
                    }
                    element
                }
                (Part::Index(index), _) => return Err(format!("[{index}] is not in a list")),
            });
        }
        match layout {
            Some(layout @ (Layout::Single(_) | Layout::Text { .. })) => Ok((container, layout)),
            Some(Layout::Structure(inner)) => Err(format!(
                "the field has fields itself: name one of {}",
                inner.names().collect::<Vec<_>>().join(", ")
            )),
            _ => Err("the field is a list: name one of its elements, as in `values[0]`".to_owned()),
        }
    }
}

impl fmt::Display for FieldPath {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, part) in self.0.iter().enumerate() {
            match part {
                Part::Field(name) if index == 0 => formatter.write_str(name)?,
                Part::Field(name) => write!(formatter, ".{name}")?,
                Part::Index(index) => write!(formatter, "[{index}]")?,
            }
        }
        Ok(())
    }
}

pub(super) fn unknown_field(structure: &Structure, name: &str) -> String {
    if structure.is_empty() {
        return format!("{} has no fields: remove `{name}`", structure.name);
    }
    let names: Vec<&str> = structure.names().collect();
    let suggestion = did_you_mean(name, names.iter().copied());
    format!("{} has no field `{name}`{suggestion}; its fields are {}", structure.name, names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::FieldPath;
    use crate::types::Library;

    #[test]
    fn paths_are_parsed_and_printed() {
        for path in ["a", "a.b[1]", "a[0][2].c"] {
            assert_eq!(FieldPath::parse(path).expect(path).to_string(), path);
        }
        for wrong in ["", "a.", "a[", "a[x]", "[0]", "a[0]b"] {
            assert!(FieldPath::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn paths_are_checked_against_the_type() {
        let check = |kind: &str, path: &str| {
            let message = Library::default().message(kind).expect(kind);
            FieldPath::parse(path).expect(path).is_text(&message.structure)
        };
        for (kind, right) in [
            ("std_msgs/msg/Float64", "data"),
            ("sensor_msgs/msg/NavSatFix", "status.status"),
            ("sensor_msgs/msg/LaserScan", "ranges[3]"),
            ("sensor_msgs/msg/NavSatFix", "position_covariance[8]"),
        ] {
            assert_eq!(check(kind, right), Ok(false), "{right}");
        }
        assert_eq!(check("std_msgs/msg/String", "data"), Ok(true));
        for (kind, wrong, part) in [
            ("std_msgs/msg/Float64", "date", "did you mean `data`?"),
            ("sensor_msgs/msg/NavSatFix", "status", "name one of"),
            ("sensor_msgs/msg/LaserScan", "ranges", "is a list"),
            ("sensor_msgs/msg/NavSatFix", "position_covariance[9]", "9 elements"),
            ("std_msgs/msg/Float64", "data[0]", "not in a list"),
            ("std_msgs/msg/Float64", "data.x", "below a value"),
            ("std_msgs/msg/Empty", "data", "no fields"),
        ] {
            let text = check(kind, wrong).expect_err(wrong);
            assert!(text.contains(part), "{wrong}: {text}");
        }
    }
}
