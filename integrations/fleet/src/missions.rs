//! Missions of a worker. The manifests of a directory are read once; each mission has an initial
//! loop, which is cloned for every robot.
//!
//! Cloned loops share their constant parts, e.g. knowledge base, domain and ground task.

use std::collections::BTreeMap;
use std::path::Path;

use metaplan::mapek::Loop;
use metaplan::message::{Errors, Message};
use metaplan::setup::Setup;

/// A mission with the initial state of its loop.
#[derive(Debug, Clone)]
pub struct Template {
    /// The loop before its start.
    pub control: Loop,
    /// Checksum of the mission's files and settings.
    pub digest: String,
}

/// Missions by name. The name is that of the manifest's file without `.toml`.
#[derive(Debug, Clone, Default)]
pub struct Missions(BTreeMap<String, Template>);

impl Missions {
    /// Reads all manifests `*.toml` of a directory.
    ///
    /// # Errors
    /// The directory cannot be read or has no manifests, or a manifest is faulty; all faults are
    /// reported.
    pub fn read(directory: &Path) -> Result<Self, Errors> {
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
        let mut missions = BTreeMap::new();
        let mut wrong = Vec::new();
        for path in files {
            let Some(name) = path.file_stem().and_then(|stem| stem.to_str()) else { continue };
            let control = Setup::read(&path).and_then(|setup| Loop::new(setup.mission, setup.settings));
            match control {
                Ok(control) => {
                    let digest = control.digest();
                    missions.insert(name.to_owned(), Template { control, digest });
                }
                Err(errors) => wrong.extend(errors),
            }
        }
        if !wrong.is_empty() {
            return Err(wrong.into());
        }
        if missions.is_empty() {
            let text = format!("{}: there is no manifest `*.toml` in it", directory.display());
            return Err(vec![Message::error("N300", text)].into());
        }
        Ok(Self(missions))
    }

    /// Returns the mission with this name, if it exists.
    pub fn get(&self, name: &str) -> Option<&Template> {
        self.0.get(name)
    }

    /// Returns the names of the missions, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }
}
