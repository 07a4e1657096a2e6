//! JSON answer of `metaplan explain CODE`.

use schemars::JsonSchema;
use serde::Serialize;

use crate::codes::Code;

const FORMAT: &str = "metaplan-code/1";

/// What a code of a message means.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CodeAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = FORMAT))]
    format: &'static str,
    /// The code.
    code: &'static str,
    /// What a message with this code says.
    meaning: &'static str,
    /// Why there is such a message.
    cause: &'static str,
    /// What to do.
    remedy: &'static str,
}

impl From<Code> for CodeAnswer {
    fn from(code: Code) -> Self {
        let Code { code, meaning, cause, remedy } = code;
        Self { format: FORMAT, code, meaning, cause, remedy }
    }
}
