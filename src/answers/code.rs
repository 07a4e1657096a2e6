//! JSON answer of `metaplan explain CODE`.

use schemars::JsonSchema;
use serde::Serialize;

use crate::codes::Code;

const FORMAT: &str = "metaplan-code/1";

/// Explanation of a message code.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CodeAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The code.
    code: &'static str,
    /// Meaning of the code.
    meaning: &'static str,
    /// Cause of the message.
    cause: &'static str,
    /// Remedy.
    remedy: &'static str,
}

impl From<Code> for CodeAnswer {
    fn from(code: Code) -> Self {
        let Code { code, meaning, cause, remedy } = code;
        Self { format: FORMAT, code, meaning, cause, remedy }
    }
}
