//! What a manifest says of a mission: its sections `knowledge`, `planning` and `scenarios`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ::mission::Mission;
use ontology::ReadOptions;
use serde::Deserialize;

use crate::knowledge::{COADAPTATION, Sources, TOMASYS};
use crate::manifest::ManifestPath;
use crate::message::Message;

/// The section `knowledge` of a manifest; paths are relative to the manifest.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnowledgeSection {
    files: Vec<PathBuf>,
    #[serde(default = "shipped_rules")]
    rules: Vec<String>,
    #[serde(default)]
    catalogs: Vec<PathBuf>,
    #[serde(default)]
    directories: Vec<PathBuf>,
}

fn shipped_rules() -> Vec<String> {
    vec![COADAPTATION.to_owned()]
}

impl KnowledgeSection {
    /// The files that it names.
    pub fn sources(&self, origin: &ManifestPath) -> Sources {
        let all = |paths: &[PathBuf]| paths.iter().map(|path| origin.path(path)).collect();
        let rule = |name: &String| match name.as_str() {
            COADAPTATION | TOMASYS => name.clone(),
            path => origin.path(Path::new(path)).display().to_string(),
        };
        Sources {
            documents: all(&self.files),
            rules: self.rules.iter().map(rule).collect(),
            options: ReadOptions {
                catalogs: all(&self.catalogs),
                directories: all(&self.directories),
                ..ReadOptions::default()
            },
            ..Sources::default()
        }
    }
}

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

impl<S> Scenario<S> {
    /// Puts the situation into effect.
    ///
    /// # Errors
    /// The first setting that does not fit the mission.
    pub fn apply(&self, mission: &mut Mission) -> Result<(), Message> {
        for component in &self.fail {
            mission.fail(component)?;
        }
        self.set.iter().try_for_each(|(name, value)| match value {
            toml::Value::String(text) => mission.set(name, text),
            other => mission.set(name, &other.to_string()),
        })
    }
}
