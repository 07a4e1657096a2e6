//! Recorded cases, which lie beside the project.

#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};

use ontology::runtime::Runtime;
use serde_json::Value;

pub const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared");

/// The JSON documents of a directory by name; none, with a message, where it is absent.
#[allow(dead_code)] // not every suite reads recorded cases
pub fn recorded(directory: &str) -> Vec<Value> {
    let directory = Path::new(SHARED).join(directory);
    let Ok(entries) = std::fs::read_dir(&directory) else {
        println!("skipped: {} is not there", directory.display());
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    files.sort();
    let read = |file: PathBuf| serde_json::from_slice(&std::fs::read(file).expect("readable")).expect("JSON");
    files.into_iter().map(read).collect()
}

/// The design that MROS selects for an objective: the greatest utility among the designs that nothing rules out; of equals, the
/// first by IRI.
#[allow(dead_code)] // not every suite selects
pub fn selected(runtime: &Runtime, objective: &str) -> Option<String> {
    let mut candidates = runtime.candidates(objective, None).expect("known");
    candidates.retain(|candidate| candidate.rejections.is_empty());
    // Of equals, `max_by` returns the last.
    let best = candidates.into_iter().rev().max_by(|one, other| one.utility.cmp(&other.utility));
    best.map(|candidate| candidate.design.name)
}
