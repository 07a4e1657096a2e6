//! Missions of a worker. The manifests of directories are read once; each mission has an initial
//! loop, which is cloned for every robot.
//!
//! A mission can have several versions at the same time: the current one, with which robots are enrolled, and former
//! ones, which are kept for the robots that were enrolled with them.
//!
//! Cloned loops share their constant parts, e.g. knowledge base, domain and ground task.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use metaplan::mapek::{Baseline, Loop};
use metaplan::message::{Errors, Message};
use metaplan::setup::Setup;

/// A version of a mission with the initial state of its loop.
#[derive(Debug, Clone)]
pub struct Template {
    /// The loop before its start.
    pub control: Loop,
    /// Checksum of the mission's files and settings, which identifies the version.
    pub digest: String,
    /// State of the loop before its start, from which the differences of snapshots are computed.
    pub baseline: Arc<Baseline>,
}

/// Missions by name. The name is that of the manifest's file without `.toml`.
#[derive(Debug, Clone, Default)]
pub struct Missions {
    current: BTreeMap<String, Template>,
    /// Former versions by name and checksum.
    former: BTreeMap<(String, String), Template>,
}

impl Missions {
    /// Reads all manifests `*.toml` of a directory, as current versions.
    ///
    /// # Errors
    /// The directory cannot be read or has no manifests, or a manifest is faulty; all faults are
    /// reported.
    pub fn read(directory: &Path) -> Result<Self, Errors> {
        Ok(Self { current: templates(directory)?, former: BTreeMap::new() })
    }

    /// Adds all manifests of a directory as former versions.
    ///
    /// # Errors
    /// As for [`Missions::read`].
    pub fn with_former(mut self, directory: &Path) -> Result<Self, Errors> {
        let templates = templates(directory)?;
        let keyed = templates.into_iter().map(|(name, template)| ((name, template.digest.clone()), template));
        self.former.extend(keyed);
        Ok(self)
    }

    /// Returns the current version of the mission with this name, if it exists.
    pub fn get(&self, name: &str) -> Option<&Template> {
        self.current.get(name)
    }

    /// Returns the version of a mission with this checksum, current or former, if it exists.
    pub fn version(&self, name: &str, digest: &str) -> Option<&Template> {
        let current = self.current.get(name).filter(|template| template.digest == digest);
        current.or_else(|| self.former.get(&(name.to_owned(), digest.to_owned())))
    }

    /// Returns the names of the missions with a current version, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.current.keys().map(String::as_str)
    }
}

fn templates(directory: &Path) -> Result<BTreeMap<String, Template>, Errors> {
    let failed = |error: std::io::Error| {
        Errors::from(vec![Message::error("N300", format!("{}: {error}", directory.display()))])
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            files.push(path);
        }
    }
    files.sort();
    let mut templates = BTreeMap::new();
    let mut wrong = Vec::new();
    for path in files {
        let Some(name) = path.file_stem().and_then(|stem| stem.to_str()) else { continue };
        let control = Setup::read(&path).and_then(|setup| Loop::new(setup.mission, setup.settings));
        match control {
            Ok(control) => {
                let digest = control.inputs_digest();
                let baseline = Arc::new(Baseline::new(&control));
                templates.insert(name.to_owned(), Template { control, digest, baseline });
            }
            Err(errors) => wrong.extend(errors),
        }
    }
    if !wrong.is_empty() {
        return Err(wrong.into());
    }
    if templates.is_empty() {
        let text = format!("{}: there is no manifest `*.toml` in it", directory.display());
        return Err(vec![Message::error("N300", text)].into());
    }
    Ok(templates)
}
