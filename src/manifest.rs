//! A manifest's text to data, read once. Which sections there are, and what stands in them, is known to whoever asks.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use num_rational::BigRational;
use serde::de::DeserializeOwned;

use crate::file::{self, Kind, source};
use crate::message::{Message, did_you_mean};
use crate::number;

/// Where a manifest was read from.
#[derive(Debug, Clone, Default)]
pub struct ManifestPath {
    file: String,
    directory: PathBuf,
    text: Arc<str>,
}

/// Reads a manifest; `-` is standard input, and paths are relative to the current directory then.
///
/// # Errors
/// The file cannot be read, is no manifest, or has other sections or keys.
pub fn read<S: DeserializeOwned>(file: &Path) -> Result<(S, ManifestPath), Message> {
    let source = source(file)?;
    let (name, text) = (source.name().to_owned(), source.text());
    file::expect(Kind::Manifest, &name, text)?;
    let sections = toml::from_str(text).map_err(|error| {
        let place = error.span().map(|span| line_and_column(text, span.start));
        Message::at("M104", &name, place, error.message().to_owned() + &meant(error.message()))
    })?;
    Ok((
        sections,
        ManifestPath {
            file: name,
            directory: file.parent().map(Path::to_owned).unwrap_or_default(),
            text: text.into(),
        },
    ))
}

impl ManifestPath {
    /// A path of the manifest, from the current directory: in the manifest it is relative to the manifest.
    pub fn path(&self, path: &Path) -> PathBuf {
        self.directory.join(path)
    }

    /// The manifest's own name.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Line and column, both from 1, of what stands at an offset in bytes.
    pub fn place(&self, offset: usize) -> (usize, usize) {
        line_and_column(&self.text, offset)
    }

    /// That a value of the manifest is wrong.
    pub fn wrong(&self, text: impl Into<String>) -> Message {
        Message::at("M105", &self.file, None, text)
    }

    /// The value of a key as an exact number: a decimal, not negative.
    ///
    /// # Errors
    /// It is none.
    pub fn number(&self, key: &str, value: &toml::Value) -> Result<BigRational, Message> {
        let text = match value {
            toml::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let number = number::exact(&text).filter(|number| *number >= BigRational::default());
        let wrong = || format!("`{key}` is {value}, but should be a decimal number, not negative");
        number.ok_or_else(|| self.wrong(wrong()))
    }
}

/// Which key was meant, where the message of the parser lists those that there are.
fn meant(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    match (message.starts_with("unknown field"), quoted.next()) {
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
