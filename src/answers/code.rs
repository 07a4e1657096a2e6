//! What `metaplan explain CODE` answers.

use schemars::JsonSchema;
use serde::Serialize;

use crate::codes::Code;

/// What a code of a message means.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CodeAnswer {
    format: &'static str,
    code: &'static str,
    meaning: &'static str,
    cause: &'static str,
    remedy: &'static str,
}

impl From<Code> for CodeAnswer {
    fn from(code: Code) -> Self {
        let Code { code, meaning, cause, remedy } = code;
        Self { format: "metaplan-code/1", code, meaning, cause, remedy }
    }
}
