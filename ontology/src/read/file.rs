//! Reads files and standard input.
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Errors};

/// Maximum size of a file in bytes. Standard input has no limit.
const MAX_BYTES: u64 = 1 << 30;

/// Reads a regular file of at most [`MAX_BYTES`] bytes. Other files are rejected: a pipe could block, and
/// some devices have no end.
pub(super) fn regular_file(path: &Path) -> std::io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    let mut bytes = Vec::with_capacity(metadata.len().min(MAX_BYTES) as usize + 1);
    // The file may grow while it is read.
    std::fs::File::open(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(std::io::Error::other(format!("it has more than {MAX_BYTES} bytes")));
    }
    Ok(bytes)
}

pub(super) fn standard_input() -> Result<Vec<u8>, Errors> {
    let mut text = Vec::new();
    match std::io::stdin().read_to_end(&mut text) {
        Ok(_) => Ok(text),
        Err(error) => Err(vec![Error::Unreadable { file: "-".into(), reason: error.to_string() }].into()),
    }
}
