//! Parser of ROS definitions: the texts of `.msg`, `.srv` and `.action` files [1].
//!
//! A message has one part, a service two, an action three. This file and `description.rs` also belong to the
//! build script.
//!
//! [1] ROS 2 design article "Interface definition using .msg / .srv / .action files".

/// A structure of an interface, such as the request of a service.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Suffix that the structure adds to the name of the interface: empty, `_Request`, `_Goal`, …
    pub suffix: &'static str,
    /// Fields in the order of the definition, which is the order of serialisation. A definition without fields gets
    /// one, as in rosidl.
    pub fields: Vec<Field>,
    pub constants: Vec<Constant>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    pub name: String,
    pub kind: FieldType,
    /// Text of the default value.
    pub default: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Constant {
    pub name: String,
    pub kind: Primitive,
    pub value: String,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldType {
    pub base: Base,
    pub count: Count,
    /// Greatest length of a string, in bytes. `None` if there is no limit or the type is no string.
    pub string_bound: Option<u32>,
}

/// Type of a single value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Base {
    Primitive(Primitive),
    /// A message, by its full name, such as `std_msgs/msg/Header`.
    Message(String),
}

/// Number of values of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    One,
    Fixed(u32),
    Bounded(u32),
    Unbounded,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Primitive {
    Bool,
    Byte,
    Char,
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Int64,
    Uint64,
    Float32,
    Float64,
    String,
}

impl Primitive {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Self::Bool,
            "byte" => Self::Byte,
            "char" => Self::Char,
            "int8" => Self::Int8,
            "uint8" => Self::Uint8,
            "int16" => Self::Int16,
            "uint16" => Self::Uint16,
            "int32" => Self::Int32,
            "uint32" => Self::Uint32,
            "int64" => Self::Int64,
            "uint64" => Self::Uint64,
            "float32" => Self::Float32,
            "float64" => Self::Float64,
            "string" => Self::String,
            _ => return None,
        })
    }
}

/// Kinds of interfaces: folder, and suffixes of the parts of each interface in the folder.
pub const FOLDERS: [(&str, &[&str]); 3] =
    [("msg", &[""]), ("srv", &["_Request", "_Response"]), ("action", &["_Goal", "_Result", "_Feedback"])];

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interface {
    /// Distribution or package version to which the definition belongs. `None` for the default.
    pub variant: Option<String>,
    pub package: String,
    /// Folder, which shows the kind of the interface: `msg`, `srv` or `action`.
    pub folder: &'static str,
    pub name: String,
    pub parts: Vec<Part>,
}

impl Interface {
    /// Parses the definition of an interface. `full_name` is its name with package and folder, such
    /// as `std_msgs/msg/String`.
    pub fn parse(full_name: &str, text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{full_name}` is not a valid type name: write package, `msg`, `srv` or `action`, and name, as in \
                 `std_msgs/msg/String`"
            )
        };
        let names: Vec<&str> = full_name.split('/').collect();
        let [package, folder, name] = names[..] else { return Err(wrong()) };
        let kind = FOLDERS.iter().find(|(known, _)| *known == folder);
        let (folder, suffixes) = kind.filter(|_| is_name(package) && is_name(name)).ok_or_else(wrong)?;
        let parts = parts(text, suffixes, package)?;
        Ok(Self { variant: None, package: package.to_owned(), folder, name: name.to_owned(), parts })
    }

    pub fn full_name(&self) -> String {
        format!("{}/{}/{}", self.package, self.folder, self.name)
    }
}

fn parts(text: &str, suffixes: &[&'static str], package: &str) -> Result<Vec<Part>, String> {
    let new_part = |suffix| Part { suffix, fields: Vec::new(), constants: Vec::new() };
    let mut parts: Vec<Part> = suffixes.first().map(|suffix| new_part(suffix)).into_iter().collect();
    for (index, line) in text.lines().enumerate() {
        let line = without_comment(line).trim();
        if line == "---" {
            let suffix = suffixes.get(parts.len()).ok_or("the definition has more parts than its kind")?;
            parts.push(new_part(suffix));
        } else if !line.is_empty()
            && let Some(part) = parts.last_mut()
        {
            add_line(line, part, package).map_err(|because| format!("line {}: {because}", index + 1))?;
        }
    }
    if parts.len() < suffixes.len() {
        let (count, expected) = (parts.len(), suffixes.len());
        return Err(format!(
            "the definition has {count} instead of {expected} parts, which lines `---` separate"
        ));
    }
    for part in parts.iter_mut().filter(|part| part.fields.is_empty()) {
        // rosidl adds the same field, because C structures cannot be empty.
        let kind =
            FieldType { base: Base::Primitive(Primitive::Uint8), count: Count::One, string_bound: None };
        let name = "structure_needs_at_least_one_member".to_owned();
        part.fields.push(Field { name, kind, default: None });
    }
    Ok(parts)
}

/// Removes a comment, which begins with `#` outside of a quoted text.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    for (index, character) in line.char_indices() {
        match (quote, character) {
            (None, '#') => return &line[..index],
            (None, '"' | '\'') => quote = Some(character),
            (Some(open), close) if open == close => quote = None,
            _ => {}
        }
    }
    line
}

fn add_line(line: &str, part: &mut Part, package: &str) -> Result<(), String> {
    let wrong = || format!("`{line}` is neither a field (`uint8 level`) nor a constant (`uint8 OK=0`)");
    let (kind, declaration) = line.split_once(char::is_whitespace).ok_or_else(wrong)?;
    let declaration = declaration.trim_start();
    let end = declaration.find(|character: char| !is_name_character(character)).unwrap_or(declaration.len());
    let (name, value) = (&declaration[..end], declaration[end..].trim());
    if !is_name(name) {
        return Err(wrong());
    }
    let kind = field_type(kind, package)?;
    if let Some(value) = value.strip_prefix('=') {
        let FieldType { base: Base::Primitive(kind), count: Count::One, .. } = kind else {
            return Err(format!("the constant `{name}` is not a single value"));
        };
        part.constants.push(Constant { name: name.to_owned(), kind, value: value.trim().to_owned() });
    } else {
        if part.fields.iter().any(|field| field.name == name) {
            return Err(format!("there are two fields `{name}`"));
        }
        let default = (!value.is_empty()).then(|| value.to_owned());
        part.fields.push(Field { name: name.to_owned(), kind, default });
    }
    Ok(())
}

fn field_type(text: &str, package: &str) -> Result<FieldType, String> {
    let number = |digits: &str| match digits.parse::<u32>() {
        Ok(number) if number > 0 => Ok(number),
        _ => Err(format!("`{digits}` in `{text}` is not a number of elements, 1 or more")),
    };
    let (single, count) = match text.split_once('[') {
        None => (text, Count::One),
        Some((single, size)) => {
            let size = size.strip_suffix(']').ok_or_else(|| format!("`{text}` has no `]` at its end"))?;
            let count = match (size, size.strip_prefix("<=")) {
                ("", _) => Count::Unbounded,
                (_, Some(most)) => Count::Bounded(number(most)?),
                (size, None) => Count::Fixed(number(size)?),
            };
            (single, count)
        }
    };
    let (single, string_bound) = match single.split_once("<=") {
        None => (single, None),
        Some((single @ "string", most)) => (single, Some(number(most)?)),
        Some(_) => return Err(format!("only a `string` has a greatest length: `{text}`")),
    };
    if let Some(primitive) = Primitive::parse(single) {
        return Ok(FieldType { base: Base::Primitive(primitive), count, string_bound });
    }
    if single == "wstring" {
        return Err("`wstring` is not supported".to_owned());
    }
    let names: Vec<&str> = single.split('/').collect();
    let (package, name) = match names[..] {
        // An abbreviation of ROS 1 that rosidl accepts.
        ["Header"] => ("std_msgs", "Header"),
        [name] => (package, name),
        [package, name] | [package, "msg", name] => (package, name),
        _ => ("", ""),
    };
    if !is_name(package) || !is_name(name) {
        return Err(format!("`{text}` is not a type"));
    }
    Ok(FieldType { base: Base::Message(format!("{package}/msg/{name}")), count, string_bound })
}

fn is_name_character(character: char) -> bool {
    character.is_ascii_alphanumeric() || character == '_'
}

fn is_name(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_alphabetic()) && text.chars().all(is_name_character)
}

#[cfg(test)]
mod tests {
    use super::{Base, Count, FieldType, Interface, Primitive};

    #[test]
    fn all_kinds_of_lines_are_parsed() {
        let text = "# A comment\nuint8 OK=0 # zero\nstring TEXT = \"a # b\"\n\nint8[] a\nfloat64[3] b [1.0, 2.0, 3.0]\n\
                    string<=5[<=2] c\nHeader header\nPoint p\ngeometry_msgs/Pose q\nstring d \"x = # y\"  # text\n";
        let interface = Interface::parse("p_msgs/msg/M", text).expect("a message");
        let part = &interface.parts[0];
        let constants: Vec<_> =
            part.constants.iter().map(|constant| (&*constant.name, &*constant.value)).collect();
        assert_eq!(constants, [("OK", "0"), ("TEXT", "\"a # b\"")]);
        let names: Vec<&str> = part.fields.iter().map(|field| &*field.name).collect();
        assert_eq!(names, ["a", "b", "c", "header", "p", "q", "d"]);
        let kind = |index: usize| part.fields[index].kind.clone();
        let primitive =
            |kind, count, string_bound| FieldType { base: Base::Primitive(kind), count, string_bound };
        assert_eq!(kind(0), primitive(Primitive::Int8, Count::Unbounded, None));
        assert_eq!(kind(1), primitive(Primitive::Float64, Count::Fixed(3), None));
        assert_eq!(kind(2), primitive(Primitive::String, Count::Bounded(2), Some(5)));
        assert_eq!(kind(3).base, Base::Message("std_msgs/msg/Header".to_owned()));
        assert_eq!(kind(4).base, Base::Message("p_msgs/msg/Point".to_owned()));
        assert_eq!(kind(5).base, Base::Message("geometry_msgs/msg/Pose".to_owned()));
        assert_eq!(part.fields[1].default.as_deref(), Some("[1.0, 2.0, 3.0]"));
        assert_eq!(part.fields[6].default.as_deref(), Some("\"x = # y\""));
    }

    #[test]
    fn parts_are_separated_by_lines() {
        let action = Interface::parse("p/action/A", "int32 a\n---\n---\nint32 b").expect("an action");
        let suffixes: Vec<&str> = action.parts.iter().map(|part| part.suffix).collect();
        assert_eq!(suffixes, ["_Goal", "_Result", "_Feedback"]);
        assert_eq!(action.parts[1].fields[0].name, "structure_needs_at_least_one_member");
    }

    #[test]
    fn wrong_definitions_are_rejected() {
        for (name, text, part) in [
            ("p/msg", "", "not a valid type name"),
            ("p/masg/M", "", "not a valid type name"),
            ("p-q/msg/M", "", "not a valid type name"),
            ("p/srv/S", "int32 a", "1 instead of 2 parts"),
            ("p/srv/S", "---\n---", "more parts"),
            ("p/msg/M", "\nint32", "line 2: `int32` is neither"),
            ("p/msg/M", "int32 4", "neither a field"),
            ("p/msg/M", "int32[ a", "no `]`"),
            ("p/msg/M", "int32[0] a", "1 or more"),
            ("p/msg/M", "int32[<=x] a", "1 or more"),
            ("p/msg/M", "int32<=3 a", "only a `string`"),
            ("p/msg/M", "wstring a", "not supported"),
            ("p/msg/M", "a//b c", "not a type"),
            ("p/msg/M", "int32 a\nint32 a", "two fields `a`"),
            ("p/msg/M", "int32[] A=1", "not a single value"),
            ("p/msg/M", "Header A=1", "not a single value"),
            ("p/msg/M", "\"", "neither"),
        ] {
            let error = Interface::parse(name, text).expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
