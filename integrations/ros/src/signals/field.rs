//! Paths to fields of messages, such as `status.status` or `cell_voltage[0]`.

use metaplan::message::did_you_mean;
use serde_json::Value;

#[derive(Debug, Clone, PartialEq, Eq)]
enum Part {
    Field(String),
    Index(usize),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FieldPath(Vec<Part>);

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

    /// Checks the path against a message with default values, whose lists of variable length are empty.
    ///
    /// # Errors
    /// The message has no such field, or the field has no single value.
    pub(crate) fn check(&self, kind: &str, default: &Value) -> Result<(), String> {
        let mut value = default;
        for part in &self.0 {
            value = match (part, value) {
                (Part::Field(name), Value::Object(fields)) => fields.get(name).ok_or_else(|| {
                    let names: Vec<&str> = fields.keys().map(String::as_str).collect();
                    let suggestion = did_you_mean(name, names.iter().copied());
                    format!("{kind} has no field `{name}`{suggestion}; its fields are {}", names.join(", "))
                })?,
                (Part::Field(name), _) => return Err(format!("there is nothing below a value: `{name}`")),
                // The elements of lists of variable length are unknown here.
                (Part::Index(_), Value::Array(list)) if list.is_empty() => return Ok(()),
                (Part::Index(index), Value::Array(list)) => list
                    .get(*index)
                    .ok_or_else(|| format!("the list of {kind} has {} elements, from 0", list.len()))?,
                (Part::Index(index), _) => return Err(format!("[{index}] is not in a list")),
            };
        }
        match value {
            Value::Array(_) => {
                Err("the field is a list: name one of its elements, as in `values[0]`".to_owned())
            }
            Value::Object(fields) => {
                let names: Vec<&str> = fields.keys().map(String::as_str).collect();
                Err(format!("the field has fields itself: name one of {}", names.join(", ")))
            }
            _ => Ok(()),
        }
    }

    pub(crate) fn find<'v>(&self, message: &'v Value) -> Option<&'v Value> {
        self.0.iter().try_fold(message, |value, part| match part {
            Part::Field(name) => value.get(name),
            Part::Index(index) => value.get(index),
        })
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::FieldPath;

    #[test]
    fn fields_are_found() {
        let message = json!({"a": {"b": [1, 2]}, "c": "x"});
        let find = |path: &str| FieldPath::parse(path).expect(path).find(&message).cloned();
        assert_eq!(find("a.b[1]"), Some(json!(2)));
        assert_eq!(find("c"), Some(json!("x")));
        assert_eq!(find("a.b[2]"), None);
        for wrong in ["", "a.", "a[", "a[x]", "[0]", "a[0]b"] {
            assert!(FieldPath::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn paths_are_checked_against_the_type() {
        let default = json!({"data": 0, "list": [], "fixed": [0, 0], "status": {"status": 0, "service": 0}});
        let check = |path: &str| FieldPath::parse(path).expect(path).check("T", &default);
        for right in ["data", "list[3]", "fixed[1]", "status.service"] {
            assert_eq!(check(right), Ok(()), "{right}");
        }
        for (wrong, part) in [
            ("date", "did you mean `data`?"),
            ("status", "name one of"),
            ("list", "is a list"),
            ("fixed[2]", "2 elements"),
            ("data[0]", "not in a list"),
            ("data.x", "below a value"),
        ] {
            let text = check(wrong).expect_err(wrong);
            assert!(text.contains(part), "{wrong}: {text}");
        }
    }
}
