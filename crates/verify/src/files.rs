//! Reads the files of a certificate. They must be the files that the manifest lists.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::digest::{digest, digest_of};
use crate::manifest::{
    ARGUMENT, Claim, DOMAIN, FORMAT, FRONT, FRONT_FORMAT, File, FrontManifest, HINTS, Manifest, PLAN,
    PROBLEM, PROOF, PROOF_LIMIT, Refutation, SIZE_LIMIT, STREAMED, TASK, TEXT_LIMIT, WITNESS,
};
use crate::{derivations, knowledge};

/// Returns the text of the file with this name, or the empty string if there is no such file.
pub fn text<'t, N: AsRef<str>>(files: &'t [(N, String)], name: &str) -> &'t str {
    files.iter().find(|(file_name, _)| file_name.as_ref() == name).map_or("", |(_, text)| text.as_str())
}

const MANIFEST: &str = "manifest.json";
const MANIFEST_LIMIT: u64 = 1 << 20;

/// Names and texts of files.
pub(crate) type Contents = Vec<(String, String)>;

pub(crate) fn is_front(directory: &Path) -> bool {
    #[derive(serde::Deserialize)]
    struct Format {
        format: String,
    }
    let manifest = read_file(directory, MANIFEST, MANIFEST_LIMIT);
    let format = manifest.ok().and_then(|text| serde_json::from_str::<Format>(&text).ok());
    format.is_some_and(|manifest| manifest.format == FRONT_FORMAT)
}

/// Reads the manifest and the files that it lists, and checks their names, sizes and digests.
/// Streamed files are checked, but their contents are not returned.
pub(crate) fn read(directory: &Path) -> Result<(Manifest, Contents), String> {
    let manifest: Manifest = read_manifest(directory)?;
    check_format(&manifest.format, FORMAT)?;
    if matches!(manifest.claim, Claim::Front(_)) {
        return Err(format!("{MANIFEST}: the certificate of a single plan cannot claim a front"));
    }
    // These texts are printed. Where line breaks are not escaped, they could imitate the result of a check.
    let printed = match (&manifest.claim, &manifest.refutation) {
        (Claim::Optimal { metric }, _) if metric.contains(char::is_control) => Some("metric"),
        (_, Refutation::None(reason)) if reason.contains(char::is_control) => Some("refutation"),
        _ => None,
    };
    if let Some(field) = printed {
        return Err(format!("{MANIFEST}: `{field}` contains a control character"));
    }
    let mut expected = vec![ARGUMENT, DOMAIN, PROBLEM, TASK, WITNESS];
    if manifest.claim != Claim::Unsolvable {
        expected.push(PLAN);
    }
    if matches!(manifest.refutation, Refutation::Steps(_)) {
        expected.extend(STREAMED);
    }
    let contents = read_files(directory, &manifest.files, expected)?;
    Ok((manifest, contents))
}

/// Reads the manifest of a front and the files that it lists, and checks their names, sizes and digests.
pub(crate) fn read_front(directory: &Path) -> Result<(FrontManifest, Contents), String> {
    let manifest: FrontManifest = read_manifest(directory)?;
    check_format(&manifest.format, FRONT_FORMAT)?;
    let contents = read_files(directory, &manifest.files, vec![DOMAIN, FRONT, PROBLEM])?;
    Ok((manifest, contents))
}

fn read_manifest<M: serde::de::DeserializeOwned>(directory: &Path) -> Result<M, String> {
    let manifest = read_file(directory, MANIFEST, MANIFEST_LIMIT)?;
    serde_json::from_str(&manifest).map_err(|error| format!("{MANIFEST}: {error}"))
}

fn check_format(format: &str, expected: &str) -> Result<(), String> {
    if format == expected {
        Ok(())
    } else {
        Err(format!("{MANIFEST}: format `{format}`, where `{expected}` is expected"))
    }
}

/// Reads the listed files, and checks their sizes and digests. The list must contain exactly the `expected` files,
/// and either all or none of the files of the knowledge base. Streamed files are checked, but their contents are not
/// returned.
fn read_files(directory: &Path, files: &[File], mut expected: Vec<&str>) -> Result<Contents, String> {
    if files.iter().any(|file| file.name == knowledge::ORIGIN) {
        expected.extend([knowledge::DOCUMENT, knowledge::ORIGIN, derivations::DERIVATIONS]);
    }
    expected.sort_unstable();
    let mut names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    names.sort_unstable();
    if names != expected {
        // The list may be long; its beginning suffices to show the difference.
        names.truncate(expected.len() + 1);
        return Err(format!(
            "{MANIFEST}: lists {}, where {} are expected",
            names.join(", "),
            expected.join(", ")
        ));
    }
    let is_streamed = |file: &&File| STREAMED.contains(&file.name.as_str());
    let (streamed, whole): (Vec<&File>, Vec<&File>) = files.iter().partition(is_streamed);
    for (files, limit) in [(whole, TEXT_LIMIT), (streamed, SIZE_LIMIT)] {
        let total = files.iter().try_fold(0_u64, |sum, file| sum.checked_add(file.bytes));
        if total.is_none_or(|total| total > limit) {
            return Err(format!("{MANIFEST}: the files are larger than {limit} bytes"));
        }
    }
    let mut contents = Vec::new();
    for file in files {
        if STREAMED.contains(&file.name.as_str()) {
            check_streamed(directory, file)?;
            continue;
        }
        let text = read_file(directory, &file.name, file.bytes)?;
        if text.len() as u64 != file.bytes {
            return Err(format!(
                "{}: has {} bytes, where {} are expected",
                file.name,
                text.len(),
                file.bytes
            ));
        }
        let sha256 = digest(text.as_bytes());
        if sha256 != file.sha256 {
            return Err(format!("{}: SHA-256 is {sha256}, where {} is expected", file.name, file.sha256));
        }
        contents.push((file.name.clone(), text));
    }
    Ok(contents)
}

fn check_streamed(directory: &Path, file: &File) -> Result<(), String> {
    let File { name, bytes, sha256 } = file;
    let wrong = |what: String| format!("{name}: {what}");
    let limit = if [PROOF, HINTS].contains(&name.as_str()) { PROOF_LIMIT.min(*bytes) } else { *bytes };
    let path = plain_file(directory, name, limit)?;
    let (size, digest) =
        digest_of(&path).map_err(|error| wrong(format!("cannot be read: {}", error.kind())))?;
    if size != *bytes {
        return Err(wrong(format!("has {size} bytes, where {bytes} are expected")));
    }
    if digest != *sha256 {
        return Err(wrong(format!("SHA-256 is {digest}, where {sha256} is expected")));
    }
    Ok(())
}

/// Returns the path of a regular file of at most `limit` bytes. A symbolic link is rejected,
/// because it could point outside of the certificate.
fn plain_file(directory: &Path, name: &str, limit: u64) -> Result<PathBuf, String> {
    let path = directory.join(name);
    let wrong = |what: String| format!("{name}: {what}");
    let kind =
        fs::symlink_metadata(&path).map_err(|error| wrong(format!("cannot be read: {}", error.kind())))?;
    if !kind.is_file() {
        return Err(wrong("is not a plain file".to_owned()));
    }
    if kind.len() > limit {
        return Err(wrong(format!("has {} bytes, more than {limit}", kind.len())));
    }
    Ok(path)
}

fn read_file(directory: &Path, name: &str, limit: u64) -> Result<String, String> {
    let path = plain_file(directory, name, limit)?;
    let wrong = |what: String| format!("{name}: {what}");
    let mut text = String::new();
    fs::File::open(&path)
        // At most `limit` bytes are read, because the file may have grown since its size was
        // checked.
        .and_then(|file| file.take(limit).read_to_string(&mut text))
        .map_err(|error| wrong(format!("cannot be read: {error}")))?;
    Ok(text)
}
