//! Recorded cases, which lie beside the project.

#![allow(clippy::print_stdout)]

use std::path::{Path, PathBuf};

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
