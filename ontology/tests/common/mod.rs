//! Recorded cases and real knowledge bases, which are not part of the project.

use std::path::PathBuf;

use ontology::runtime::Runtime;
use serde_json::Value;
use test_resources::{data, data_path};

pub fn real_directory() -> PathBuf {
    data_path("real/owl")
}

/// Returns the JSON documents of a directory of the test data, ordered by file name. Returns no document if
/// the directory does not exist.
pub fn recorded(directory: &str) -> Vec<Value> {
    let Some(directory) = data(directory) else { return Vec::new() };
    let entries = std::fs::read_dir(directory).expect("readable");
    let mut files: Vec<PathBuf> = entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    files.sort();
    let read = |file: PathBuf| serde_json::from_slice(&std::fs::read(file).expect("readable")).expect("JSON");
    files.into_iter().map(read).collect()
}

/// Returns the design that MROS selects for an objective: the design with the greatest utility among those
/// without a rejection. The first one by IRI wins a tie.
pub fn selected(runtime: &Runtime, objective: &str) -> Option<String> {
    let mut candidates = runtime.candidates(objective, None).expect("known");
    candidates.retain(|candidate| candidate.rejections.is_empty());
    // `max_by` returns the last of several maxima.
    let best = candidates.into_iter().rev().max_by(|first, second| first.utility.cmp(&second.utility));
    best.map(|candidate| candidate.design.name)
}
