//! The bytes of files and of standard input.
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Errors};

/// Documents with more bytes are not read.
const LARGEST: u64 = 1 << 30;

/// The bytes of a regular file: a pipe would keep us waiting, and some devices have no end.
pub(super) fn regular_file(path: &Path) -> std::io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    let mut bytes = Vec::with_capacity(metadata.len().min(LARGEST) as usize + 1);
    std::fs::File::open(path)?.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        return Err(std::io::Error::other(format!("it has more than {LARGEST} bytes")));
    }
    Ok(bytes)
}

/// The bytes of standard input.
pub(super) fn standard_input() -> Result<Vec<u8>, Errors> {
    let mut text = Vec::new();
    match std::io::stdin().read_to_end(&mut text) {
        Ok(_) => Ok(text),
        Err(error) => Err(vec![Error::Unreadable { file: "-".into(), reason: error.to_string() }].into()),
    }
}
