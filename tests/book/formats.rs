//! Generates the tables of fields in the documentation of formats, from their JSON Schemas.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use metaplan::schemas::{FORMATS, schema};
use serde_json::{Map, Value};

pub fn answers() -> String {
    let mut text = String::new();
    for (name, about, _) in FORMATS {
        // Inputs, and the events and answers of the MAPE-K loop, have pages of their own.
        if ["manifest", "study", "event", "answer"].contains(&name) {
            continue;
        }
        let schema_of_format = schema(name).expect("a schema");
        let alternatives = match schema_of_format["anyOf"].as_array() {
            Some(alternatives) => alternatives.clone(),
            None => vec![schema_of_format.clone()],
        };
        let mut previous_format = String::new();
        for alternative in alternatives {
            let format = alternative["properties"]["format"]["const"].as_str().expect("a format").to_owned();
            // Without an empty line, Markdown would continue the table of the previous alternative.
            text.push_str(if text.is_empty() { "" } else { "\n" });
            if format != previous_format {
                let _ = writeln!(text, "## {format}\n");
            }
            let source =
                about.strip_prefix("metaplan ").map_or(about.to_owned(), |command| format!("`{command}`"));
            let description = alternative["description"].as_str().expect("a description");
            let _ =
                writeln!(text, "From {source}. {description}\n\n| field | type | meaning |\n|---|---|---|");
            for row in Table::of(&schema_of_format, &alternative, &format, "") {
                let _ = writeln!(text, "| `{}` | {} | {} |", row.path, row.kind, row.means);
            }
            previous_format = format;
        }
    }
    text
}

pub fn manifest() -> String {
    keys("manifest")
}

pub fn study() -> String {
    keys("study")
}

fn keys(format: &str) -> String {
    let root_schema = schema(format).expect("a schema");
    let mut text = "| key | type | meaning | default |\n|---|---|---|---|\n".to_owned();
    for row in Table::of(&root_schema, &root_schema, format, "NAME") {
        let _ = writeln!(text, "| `{}` | {} | {} | {} |", row.path, row.kind, row.means, row.default);
    }
    text
}

struct Row {
    path: String,
    kind: String,
    means: String,
    default: String,
}

struct Table<'a> {
    definitions: &'a Value,
    format: &'a str,
    /// Placeholder for arbitrary field names in paths. Empty if such fields are not listed.
    any: &'a str,
    rows: Vec<Row>,
    seen: BTreeSet<String>,
    /// Names of definitions whose fields are already listed, each with its path.
    listed: Vec<(String, String)>,
}

impl<'a> Table<'a> {
    fn of(root_schema: &'a Value, part: &Value, format: &'a str, any: &'a str) -> Vec<Row> {
        let definitions = &root_schema["$defs"];
        let (rows, seen, listed) = (Vec::new(), BTreeSet::new(), Vec::new());
        let mut table = Self { definitions, format, any, rows, seen, listed };
        table.object(part, "");
        table.rows
    }

    fn object(&mut self, schema: &Value, path: &str) {
        let required: Vec<&str> =
            schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        for (name, field) in schema["properties"].as_object().into_iter().flatten() {
            let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            self.field(field, path, required.contains(&name.as_str()));
        }
        self.kinds(schema, path);
        for variant in variants(schema) {
            let variant = self.resolved(variant).clone();
            self.object(&variant, path);
        }
    }

    /// Adds rows for tag fields, which have a different constant in each variant of an object.
    fn kinds(&mut self, schema: &Value, path: &str) {
        let variants = variants(schema);
        let first = variants.first().and_then(|first| first["properties"].as_object()).into_iter().flatten();
        for (name, _) in first.filter(|(_, field)| field["const"].is_string()) {
            let kind = |variant: &&Value| {
                let value = variant["properties"][name]["const"].as_str().expect("a kind");
                let means =
                    variant["description"].as_str().unwrap_or_else(|| panic!("nothing is said of {value}"));
                format!("`{value}`: {}", means.trim_end_matches('.'))
            };
            let kinds: Vec<String> = variants.iter().map(kind).collect();
            let path = format!("{path}.{name}");
            self.seen.insert(path.clone());
            let (kind, means) = ("string".to_owned(), format!("{}.", kinds.join("; ")));
            self.rows.push(Row { path, kind, means, default: "required".to_owned() });
        }
    }

    fn field(&mut self, field: &Value, mut path: String, required: bool) {
        if !self.seen.insert(path.clone()) {
            return;
        }
        let description = field["description"].as_str().map(ToOwned::to_owned);
        let mut kind = self.kind(field);
        let mut inner = self.inside(field, &mut path);
        let described = inner.as_ref().and_then(|(_, schema)| schema["description"].as_str());
        let mut means = description.or_else(|| described.map(ToOwned::to_owned)).unwrap_or_default();
        if let Some((name, schema)) = &inner {
            let root = schema["properties"]["format"]["const"].as_str();
            let reference = match (root, name.as_str()) {
                (Some(format), _) => Some(format!("As `{format}`.")),
                (_, "Details") if self.format != "metaplan-error/1" => {
                    Some("Each as in `metaplan-error/1`.".to_owned())
                }
                _ => {
                    let earlier = self.listed.iter().find(|(listed, _)| !name.is_empty() && listed == name);
                    earlier.map(|(_, path)| format!("As `{path}`."))
                }
            };
            if let Some(reference) = reference {
                means.extend([if means.is_empty() { "" } else { " " }, &reference]);
                inner = None;
            }
        }
        if let Some(constant) = field["const"].as_str() {
            kind = format!("`{constant}`");
        }
        let has_fields = inner.as_ref().is_some_and(|(_, schema)| has_fields(schema));
        if has_fields && kind == "object" && means.is_empty() {
            kind.clear();
        }
        assert!(!means.is_empty(), "{} has a field {path} that nothing is said about", self.format);
        let default = match &field["default"] {
            _ if required => "required".to_owned(),
            Value::Null | Value::Object(_) => String::new(),
            Value::Array(list) if list.is_empty() => "none".to_owned(),
            Value::String(text) if text.is_empty() => "empty".to_owned(),
            value => format!("`{value}`"),
        };
        let cells = |text: &str| text.replace('|', "\\|").replace('\n', " ");
        self.rows.push(Row { path: path.clone(), kind, means: cells(&means), default });
        if let Some((name, schema)) = inner.filter(|_| has_fields) {
            self.listed.push((name, path.clone()));
            self.object(&schema, &path);
        }
    }

    /// Returns the schema of the object that contains the fields of a value, with the name of its definition
    /// (empty without one). References, lists and nullable types are followed, and `path` is extended
    /// accordingly.
    fn inside(&self, field: &Value, path: &mut String) -> Option<(String, Value)> {
        let (mut name, mut schema) = (String::new(), field.clone());
        loop {
            if let Some(target) = schema["$ref"].as_str() {
                target.rsplit('/').next().unwrap_or_default().clone_into(&mut name);
                schema = self.resolved(&schema).clone();
            } else if schema["items"].is_object() {
                path.push_str("[]");
                schema = schema["items"].clone();
            } else if schema["additionalProperties"].is_object() && !self.any.is_empty() {
                let _ = write!(path, ".{}", self.any);
                schema = schema["additionalProperties"].clone();
            } else {
                let alternatives: Vec<&Value> =
                    variants(&schema).into_iter().filter(|variant| variant["type"] != "null").collect();
                match alternatives[..] {
                    [alternative] if !has_properties(&schema) => schema = alternative.clone(),
                    _ => return Some((name, schema)),
                }
            }
        }
    }

    fn kind(&self, field: &Value) -> String {
        let mut kinds: Vec<String> = Vec::new();
        let mut add = |kind: String| {
            if !kind.is_empty() && !kinds.contains(&kind) {
                kinds.push(kind);
            }
        };
        match &field["type"] {
            Value::String(kind) => add(self.plain(kind, field)),
            Value::Array(types) => {
                types.iter().filter_map(Value::as_str).for_each(|kind| add(self.plain(kind, field)));
            }
            _ => {}
        }
        if field["$ref"].is_string() {
            add(self.kind(self.resolved(field)));
        }
        for variant in variants(field) {
            add(self.kind(variant));
        }
        if kinds.is_empty() { "any".to_owned() } else { kinds.join(" or ") }
    }

    fn plain(&self, kind: &str, field: &Value) -> String {
        match kind {
            "array" if field["items"].is_object() && !self.kind(&field["items"]).contains(" or ") => {
                format!("list of {}", plural(&self.kind(&field["items"])))
            }
            "array" => "list".to_owned(),
            // The path already ends with the placeholder, so the row describes the values.
            "object" if field["additionalProperties"].is_object() && !self.any.is_empty() => {
                self.kind(&field["additionalProperties"])
            }
            "object" if field["additionalProperties"].is_object() => {
                format!("object of {}", plural(&self.kind(&field["additionalProperties"])))
            }
            simple => simple.to_owned(),
        }
    }

    fn resolved<'b>(&self, schema: &'b Value) -> &'b Value
    where
        'a: 'b,
    {
        match schema["$ref"].as_str().and_then(|target| target.rsplit('/').next()) {
            Some(name) => &self.definitions[name],
            None => schema,
        }
    }
}

fn plural(kind: &str) -> String {
    match kind.split_once(' ') {
        Some((noun, qualifier)) => format!("{noun}s {qualifier}"),
        None if kind == "any" => "any".to_owned(),
        None => format!("{kind}s"),
    }
}

fn variants(schema: &Value) -> Vec<&Value> {
    ["anyOf", "oneOf", "allOf"].iter().filter_map(|key| schema[*key].as_array()).flatten().collect()
}

fn has_properties(schema: &Value) -> bool {
    schema["properties"].as_object().is_some_and(|fields: &Map<String, Value>| !fields.is_empty())
}

/// Returns `true` if the fields of a value get rows of their own. Enumerations that also have object variants
/// are described in one row.
fn has_fields(schema: &Value) -> bool {
    if variants(schema).iter().any(|variant| variant["type"] == "string") {
        return false;
    }
    has_properties(schema)
        || variants(schema).into_iter().any(|variant| has_fields(variant) || variant["$ref"].is_string())
}
