//! SHA-256 of files and texts, in hexadecimal digits.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use sha2::{Digest as _, Sha256};

/// The size of a file and its SHA-256, read piece by piece.
///
/// # Errors
/// The file cannot be read.
pub fn digest_of(path: &Path) -> std::io::Result<(u64, String)> {
    let mut hasher = Sha256::new();
    let bytes = std::io::copy(&mut fs::File::open(path)?, &mut hasher)?;
    Ok((bytes, hexadecimal(&hasher.finalize())))
}

/// The SHA-256 of a text.
pub fn digest(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
