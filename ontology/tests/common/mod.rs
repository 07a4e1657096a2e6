//! Recorded cases in the directory `shared`, which is outside of the project.

#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};

use ontology::runtime::Runtime;
use serde_json::Value;

pub const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared");

/// Returns the JSON documents of a directory, ordered by file name. Prints a message if the directory does not
/// exist.
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

/// Returns the design that MROS selects for an objective: the design with the greatest utility among those
/// without a rejection. The first one by IRI wins a tie.
#[allow(dead_code)] // not every suite selects
pub fn selected(runtime: &Runtime, objective: &str) -> Option<String> {
    let mut candidates = runtime.candidates(objective, None).expect("known");
    candidates.retain(|candidate| candidate.rejections.is_empty());
    // `max_by` returns the last of several maxima.
    let best = candidates.into_iter().rev().max_by(|first, second| first.utility.cmp(&second.utility));
    best.map(|candidate| candidate.design.name)
}
