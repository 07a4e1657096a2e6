//! JSON answer of `metaplan init`.

use schemars::JsonSchema;
use serde::Serialize;

const FORMAT: &str = "metaplan-init/1";

/// Directory and files of a new mission.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct InitAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The new directory.
    directory: &'a str,
    /// Template of the mission.
    template: &'static str,
    /// Files in the directory.
    files: Vec<&'static str>,
}

impl<'a> InitAnswer<'a> {
    /// Answer with the files of a template in a directory.
    pub fn new(directory: &'a str, template: &'static str, files: Vec<&'static str>) -> Self {
        Self { format: FORMAT, directory, template, files }
    }
}
