//! JSON answer of `metaplan init`.

use schemars::JsonSchema;
use serde::Serialize;

const FORMAT: &str = "metaplan-init/1";

/// Where a new mission lies, and what it consists of.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct InitAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The directory that was made.
    directory: &'a str,
    /// The template that it was made from.
    template: &'static str,
    /// What was written into it.
    files: Vec<&'static str>,
}

impl<'a> InitAnswer<'a> {
    /// Answer with the files of a template in a directory.
    pub fn new(directory: &'a str, template: &'static str, files: Vec<&'static str>) -> Self {
        Self { format: FORMAT, directory, template, files }
    }
}
