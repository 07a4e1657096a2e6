//! SHA-256 digests of files and texts, in hexadecimal.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use sha2::{Digest as _, Sha256};

/// Returns the size of a file in bytes and its SHA-256 digest. The file is read in blocks.
///
/// # Errors
/// The file cannot be read.
pub fn digest_of(path: &Path) -> std::io::Result<(u64, String)> {
    let mut hasher = Sha256::new();
    let bytes = std::io::copy(&mut fs::File::open(path)?, &mut hasher)?;
    Ok((bytes, hexadecimal(&hasher.finalize())))
}

/// Returns the SHA-256 digest of a byte string in hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
