//! JSON answer of `metaplan lint`.

use schemars::JsonSchema;
use serde::Serialize;

use crate::message::Message;

const FORMAT: &str = "metaplan-lint/1";

/// Errors and warnings of a mission.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct LintAnswer<'a> {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// Number of errors.
    errors: usize,
    /// Number of warnings.
    warnings: usize,
    /// Errors, then warnings, each in the order of the files.
    messages: &'a [Message],
}

impl<'a> LintAnswer<'a> {
    /// Answer with all messages.
    pub fn new(messages: &'a [Message]) -> Self {
        let errors = messages.iter().filter(|message| message.is_error()).count();
        Self { format: FORMAT, errors, warnings: messages.len() - errors, messages }
    }

    /// Returns the number of errors and the number of warnings.
    pub fn counts(&self) -> (usize, usize) {
        (self.errors, self.warnings)
    }
}
