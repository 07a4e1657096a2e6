//! What `metaplan init` answers.

use schemars::JsonSchema;
use serde::Serialize;

/// Where a new mission lies, and what it consists of.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct InitAnswer<'a> {
    format: &'static str,
    directory: &'a str,
    template: &'static str,
    files: Vec<&'static str>,
}

impl<'a> InitAnswer<'a> {
    /// The files of a template in a directory.
    pub fn new(directory: &'a str, template: &'static str, files: Vec<&'static str>) -> Self {
        Self { format: "metaplan-init/1", directory, template, files }
    }
}
