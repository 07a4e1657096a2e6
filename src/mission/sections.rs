//! What a manifest says of a mission: its sections `planning` and `scenarios`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;

/// The section `planning`; paths are relative to the manifest.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanningSection {
    /// The domain file.
    pub domain: PathBuf,
    /// The problem file.
    pub problem: PathBuf,
}

/// A situation: what has failed, and what has changed; and what a simulated robot meets, of which a mission knows nothing.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario<S> {
    /// What happens, in a sentence.
    #[serde(default)]
    pub description: String,
    /// Components that have failed.
    #[serde(default)]
    pub fail: Vec<String>,
    /// Measured attributes, fluents and facts by name, as for `--set`; strings, numbers or truth values.
    #[serde(default)]
    pub set: BTreeMap<String, toml::Value>,
    /// What a simulated robot meets.
    pub simulation: Option<S>,
}
