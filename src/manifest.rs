//! Parses manifests (TOML files of missions, settings and studies) into the sections that the caller defines,
//! and determines the positions of entries for messages.

use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use num_rational::BigRational;
use schemars::{Schema, SchemaGenerator, json_schema};
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::file::{self, Kind, source};
use crate::message::{Errors, Message, did_you_mean};
use crate::number;

/// Maximum number of faults that are reported. Each costs a few passes over the text, and a file of another kind can
/// have thousands.
const MAX_FAULTS: usize = 50;

/// A step in a path to an entry of a manifest: a key of a table, or an index of an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Key {
    /// Key of an entry in a table.
    Name(String),
    /// Index of an entry in an array, from 0.
    Index(usize),
}

impl From<&str> for Key {
    fn from(name: &str) -> Self {
        Self::Name(name.to_owned())
    }
}

impl From<usize> for Key {
    fn from(index: usize) -> Self {
        Self::Index(index)
    }
}

/// Part of an entry to which a message refers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The value of the entry.
    Value,
    /// The key of the entry.
    Key,
    /// Offset in bytes within a string value. If the string is written with escapes or three quotes, its
    /// beginning is used.
    Inside(usize),
}

/// File name, directory and text of a manifest.
#[derive(Debug, Clone, Default)]
pub struct ManifestPath {
    file: String,
    directory: PathBuf,
    text: Arc<str>,
}

/// Reads and parses a manifest. The path `-` denotes standard input; paths in the manifest are then
/// relative to the current directory.
///
/// # Errors
/// The file cannot be read or is not a manifest; otherwise the faults of its sections and keys. If the file does not
/// exist, the message proposes a similar name, if there is one.
pub fn read<S: DeserializeOwned>(file: &Path) -> Result<(S, ManifestPath), Errors> {
    let source = source(file).map_err(|error| {
        let text = error.message.clone() + &file_suggestion(file);
        Message::at(&error.code, &file.display().to_string(), None, text)
    })?;
    parse(source.name(), source.text(), &file.parent().map(Path::to_owned).unwrap_or_default())
}

/// Parses the text of a manifest whose relative paths start at `directory`. Messages use `name` as
/// the file name.
///
/// # Errors
/// The text is not a manifest; otherwise the faults of its sections and keys.
pub fn parse<S: DeserializeOwned>(
    name: &str,
    text: &str,
    directory: &Path,
) -> Result<(S, ManifestPath), Errors> {
    file::expect(Kind::Manifest, name, text)?;
    // `Source` decodes invalid bytes to this character, so different names would become equal.
    if let Some(offset) = text.find(char::REPLACEMENT_CHARACTER) {
        let place = Some(line_and_column(text, offset));
        let text = "this character stands for bytes that are not valid UTF-8; convert the file to UTF-8";
        return Err(Message::at("M101", name, place, text).into());
    }
    let sections = toml::from_str(text).map_err(|error| mistakes::<S>(text, error, name))?;
    let (file, directory, text) = (name.to_owned(), directory.to_owned(), text.into());
    Ok((sections, ManifestPath { file, directory, text }))
}

impl ManifestPath {
    /// Resolves a path that is relative to the manifest's directory. Removes `dir/..` from the result, unless
    /// the result would then name another file.
    pub fn path(&self, path: &Path) -> PathBuf {
        let whole = self.directory.join(path);
        let short = shortened(&whole);
        // After a symbolic link to a directory, `..` leads to another directory than the text
        // suggests.
        match (whole.canonicalize(), short.canonicalize()) {
            (Ok(whole_target), Ok(short_target)) if whole_target != short_target => whole,
            (Ok(_), Err(_)) => whole,
            _ => short,
        }
    }

    /// Adds the source lines of the manifest to those messages that refer to its file.
    pub fn quote(&self, messages: impl IntoIterator<Item = Message>) -> Vec<Message> {
        let is_own = |message: &Message| message.file.as_ref() == Some(&self.file);
        let quoted =
            |message: Message| if is_own(&message) { message.with_source(&self.text) } else { message };
        messages.into_iter().map(quoted).collect()
    }

    /// Returns the name of the manifest's file.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Returns the line and the column, both from 1, of a byte offset in the manifest.
    pub fn place(&self, offset: usize) -> (usize, usize) {
        line_and_column(&self.text, offset)
    }

    /// Returns the line and the column of an entry of the manifest. Returns `None` for the empty
    /// path, or if the text cannot be parsed. If the entry does not exist, returns the position of
    /// the last existing entry on the path.
    pub fn place_of(&self, path: &[Key], part: Part) -> Option<(usize, usize)> {
        let document = DeTable::parse(&self.text).ok()?;
        let mut span = document.span();
        let mut value = &DeValue::Table(document.into_inner());
        for (key, is_last) in path.iter().enumerate().map(|(index, key)| (key, index + 1 == path.len())) {
            let next = match (value, key) {
                (DeValue::Table(table), Key::Name(name)) => {
                    let entry = table.get_key_value(name.as_str());
                    entry.map(|(key, value)| {
                        (if is_last && part == Part::Key { key.span() } else { value.span() }, value)
                    })
                }
                (DeValue::Array(array), Key::Index(index)) => {
                    array.get(*index).map(|value| (value.span(), value))
                }
                _ => None,
            };
            let Some((place, next)) = next else { break };
            (span, value) = (place, next.get_ref());
        }
        let is_as_read = |text: &str| {
            let written = self.text.get(span.clone()).unwrap_or_default();
            written.len() == text.len() + 2 && written.get(1..=text.len()) == Some(text)
        };
        let inside = match (value, part) {
            (DeValue::String(text), Part::Inside(offset)) if is_as_read(text) => offset + 1,
            _ => 0,
        };
        (!path.is_empty()).then(|| self.place(span.start + inside))
    }

    /// Creates an error (M105) about the value at a byte offset.
    pub fn wrong(&self, offset: usize, text: impl Into<String>) -> Message {
        Message::at("M105", &self.file, Some(self.place(offset)), text).with_source(&self.text)
    }

    /// Converts a value to an exact number. `key` is the name of the value for messages.
    ///
    /// # Errors
    /// The value is not a non-negative decimal, or its text or exponent is too large.
    pub fn number(&self, key: &str, value: &Spanned<toml::Value>) -> Result<BigRational, Message> {
        let text = match value.get_ref() {
            toml::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let number = number::exact(&text).filter(|number| *number >= BigRational::default());
        let wrong = || {
            let text =
                format!("`{key}` is {}, but should be a decimal number, not negative", value.get_ref());
            self.wrong(value.span().start, text)
        };
        number.ok_or_else(wrong)
    }
}

/// JSON Schema for the values of [`ManifestPath::number`]. It does not restrict the content of strings.
pub fn decimal(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["number", "string"], "minimum": 0 })
}

/// Returns `; did you mean …?` for a file that does not exist: with the same name and the extension `.toml`, or the most
/// similar name of a file `*.toml` in the directory. Returns an empty text if no name is similar.
fn file_suggestion(file: &Path) -> String {
    let completed = file.with_extension("toml");
    let written = if completed.is_file() { &completed } else { file };
    let Some(name) = written.file_name().and_then(OsStr::to_str).filter(|_| !file.exists()) else {
        return String::new();
    };
    let directory = file.parent().filter(|directory| *directory != Path::new(""));
    let entries = std::fs::read_dir(directory.unwrap_or(Path::new("."))).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> =
        names.filter(|name| Path::new(name).extension() == Some(OsStr::new("toml"))).collect();
    // The order of directory entries depends on the file system.
    names.sort_unstable();
    did_you_mean(name, names.iter().map(String::as_str))
}

fn shortened(path: &Path) -> PathBuf {
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (Component::ParentDir, Some(Component::Normal(_))) => drop(parts.pop()),
            (Component::CurDir, _) => {}
            _ => parts.push(part),
        }
    }
    parts.into_iter().collect()
}

/// Returns the faults of a manifest, sorted by position, but not more than [`MAX_FAULTS`]. The parser reports only the
/// first fault, so each faulty entry is overwritten with blanks and the text is parsed again. If the text is not TOML,
/// only the first fault is returned. Faults with equal descriptions are returned once. A missing field is returned only
/// if it is the first fault.
fn mistakes<S: DeserializeOwned>(text: &str, first: toml::de::Error, name: &str) -> Vec<Message> {
    let mut messages: Vec<(Option<(usize, usize)>, Message)> = Vec::new();
    let (mut remaining, mut error) = (text.to_owned(), first);
    for _ in 0..MAX_FAULTS {
        let description = error.message();
        let is_new = messages.iter().all(|(_, message)| !message.message.starts_with(description));
        // An earlier iteration may have blanked the entry that is reported as missing.
        let counts = is_new && (messages.is_empty() || !description.starts_with("missing field"));
        if counts {
            let place = error.span().map(|span| line_and_column(&remaining, span.start));
            let message =
                Message::at("M104", name, place, description.to_owned() + &key_suggestion(description))
                    .with_source(text);
            messages.push((place, message));
        }
        let Some(blanked) = error.span().and_then(|span| without(&remaining, span)) else { break };
        match toml::from_str::<S>(&blanked) {
            Ok(_) => break,
            Err(next) => (remaining, error) = (blanked, next),
        }
    }
    messages.sort_by_key(|(place, _)| *place);
    messages.into_iter().map(|(_, message)| message).collect()
}

/// Overwrites the lines of a byte range with blanks, or the whole section if the first line is a section heading. If
/// the remainder is not TOML, overwrites the lines of the smallest possible entry with this range instead. Line numbers
/// do not change. Returns `None` if the text is not TOML, or if nothing can be overwritten.
fn without(text: &str, place: std::ops::Range<usize>) -> Option<String> {
    let begin = text.get(..place.start)?.rfind('\n').map_or(0, |at| at + 1);
    let document = DeTable::parse(text).ok()?;
    let line_end =
        |from: usize| text.get(from..).and_then(|rest| rest.find('\n')).map_or(text.len(), |at| from + at);
    let mut end = line_end(place.end.max(begin));
    if text.get(begin..)?.trim_start().starts_with('[') {
        let next = text.get(end..)?.match_indices("\n[").next();
        end = next.map_or(text.len(), |(at, _)| end + at);
    }
    let mut entries = Vec::new();
    add_enclosing(&DeValue::Table(document.into_inner()), place.start, &mut entries);
    entries.sort_by_key(ExactSizeIterator::len);
    let line_begin = |at: usize| text.get(..at).and_then(|before| before.rfind('\n')).map_or(0, |at| at + 1);
    let of_entries = entries.iter().map(|entry| line_begin(entry.start)..line_end(entry.end));
    let is_toml = |blanked: &String| *blanked != text && DeTable::parse(blanked).is_ok();
    std::iter::once(begin..end).chain(of_entries).filter_map(|range| blanked(text, range)).find(is_toml)
}

/// Adds the ranges of all entries, from key to value, that contain the byte offset `at`.
fn add_enclosing(value: &DeValue<'_>, at: usize, entries: &mut Vec<std::ops::Range<usize>>) {
    match value {
        DeValue::Table(table) => {
            for (key, value) in table {
                let entry = key.span().start..value.span().end;
                entries.extend(entry.contains(&at).then_some(entry));
                add_enclosing(value.get_ref(), at, entries);
            }
        }
        DeValue::Array(array) => array.iter().for_each(|value| add_enclosing(value.get_ref(), at, entries)),
        _ => {}
    }
}

/// Overwrites a byte range of a text with blanks.
fn blanked(text: &str, range: std::ops::Range<usize>) -> Option<String> {
    let (begin, end) = (range.start, range.end);
    let blank: String = text.get(begin..end)?.chars().map(|c| if c == '\n' { c } else { ' ' }).collect();
    // Each character becomes one blank, so lines and columns stay as they are. Byte offsets change if a
    // character has several bytes.
    Some(format!("{}{blank}{}", text.get(..begin)?, text.get(end..)?))
}

fn key_suggestion(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    match (["unknown field", "unknown variant"].iter().any(|start| message.starts_with(start)), quoted.next())
    {
        (true, Some(written)) => did_you_mean(written, quoted),
        _ => String::new(),
    }
}

fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |last| last.chars().count()) + 1;
    (line, column)
}

#[cfg(test)]
mod tests {
    use super::{MAX_FAULTS, mistakes};

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Empty {}

    #[test]
    fn a_limited_number_of_faults_is_looked_for() {
        for (keys, expected) in [(3, 3), (200, MAX_FAULTS)] {
            let text: Vec<String> = (0..keys).map(|number| format!("key{number} = 1\n")).collect();
            let text = text.concat();
            let error = toml::from_str::<Empty>(&text).expect_err("unknown keys");
            assert_eq!(mistakes::<Empty>(&text, error, "m.toml").len(), expected);
        }
    }

    #[test]
    fn values_of_several_lines_are_one_fault() {
        for value in
            ["[\n 1,\n]", "{ a = [\n 1,\n], b = 2 }", "'''\nb\n'''", "[\n { a = 1 },\n { b = 2 },\n]"]
        {
            let text = format!("first = {value}\nsecond = 1\nthird = {value}\n");
            let error = toml::from_str::<Empty>(&text).expect_err("unknown keys");
            let faults: Vec<String> = mistakes::<Empty>(&text, error, "m.toml")
                .into_iter()
                .map(|message| format!("{:?} {}", message.line, message.message))
                .collect();
            let lines = value.matches('\n').count();
            let expected = [(1, "first"), (lines + 2, "second"), (lines + 3, "third")]
                .map(|(line, name)| format!("Some({line}) unknown field `{name}`, there are no fields"));
            assert_eq!(faults, expected, "{text}");
        }
    }
}
