//! JSON answers of `metaplan export` and `metaplan import`.

use schemars::JsonSchema;
use serde::Serialize;

const EXPORT: &str = "metaplan-export/1";

const IMPORT: &str = "metaplan-import/1";

/// A mission as PDDL for other planners.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct MissionExport {
    /// Name and version of this format.
    #[schemars(extend("const" = EXPORT))]
    format: &'static str,
    /// The text of the domain.
    domain: String,
    /// The text of the problem.
    problem: String,
}

/// The co-adaptation process of a mission as a model for model checkers.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ModelExport {
    /// Name and version of this format.
    #[schemars(extend("const" = EXPORT))]
    format: &'static str,
    /// Text of the model.
    model: String,
}

/// The mission imported from the files of another tool.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ImportAnswer {
    /// Name and version of this format.
    #[schemars(extend("const" = IMPORT))]
    format: &'static str,
    /// Path of the new manifest.
    mission: String,
}

impl MissionExport {
    /// Creates the answer from the PDDL text of a domain and of a problem.
    pub fn new(domain: String, problem: String) -> Self {
        Self { format: EXPORT, domain, problem }
    }
}

impl ModelExport {
    /// Creates the answer from the text of the model.
    pub fn new(model: String) -> Self {
        Self { format: EXPORT, model }
    }
}

impl ImportAnswer {
    /// Creates the answer from the path of the new manifest.
    pub fn new(mission: String) -> Self {
        Self { format: IMPORT, mission }
    }
}
