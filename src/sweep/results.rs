//! Result files of a parameter study, in JSON Lines format: one file per shard, with a header and one line per
//! finished run.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use fs4::{FileExt, TryLockError};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::study::{Shard, Study};
use crate::message::{Errors, Message};

pub(super) const FORMAT: &str = "metaplan-sweep/1";

const OTHER_STUDY: &str = "it belongs to another study, or the study or its files have changed";

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Header {
    format: String,
    /// Checksum by which files of other studies are rejected.
    study: String,
    runs: usize,
    shard: String,
}

/// Result of a finished run, a line of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Number of the run in the study, from 0.
    pub run: usize,
    /// Varied keys with their values.
    pub vary: Map<String, Value>,
    /// Exit status of the command. `None` if the time limit or a signal ended it, or if the generator of its
    /// files failed.
    pub status: Option<i32>,
    /// `true` if the time limit ended the run.
    pub timed_out: bool,
    /// Duration of the run and of the generator of its files, in seconds.
    pub seconds: f64,
    /// JSON answer of the run; null if the output is not JSON, or is the message of an error.
    pub answer: Value,
    /// If there is no answer: the messages of the error, or the end of the standard error output.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub message: String,
}

/// The file of a shard, open for appending and locked against other processes.
#[derive(Debug)]
pub struct Results {
    file: File,
    /// Path of the file.
    pub path: PathBuf,
    /// Results of finished runs, by the number of the run.
    pub done: BTreeMap<usize, Line>,
}

impl Results {
    /// Opens the file of a shard in a directory. Creates directory and file if they do not exist,
    /// and removes an incomplete last line.
    ///
    /// # Errors
    /// The file cannot be created, read or written, another process writes it, it contains a complete line
    /// and `resume` is `false`, it belongs to another study or shard, or a complete line is damaged.
    pub fn open(directory: &Path, study: &Study, shard: Shard, resume: bool) -> Result<Self, Message> {
        let path = directory.join(format!("shard-{:04}-of-{:04}.jsonl", shard.index, shard.of));
        let failed = |error: io::Error| wrong(&path, &error.to_string());
        std::fs::create_dir_all(directory).map_err(failed)?;
        let mut options = OpenOptions::new();
        let mut file =
            options.create(true).truncate(false).read(true).write(true).open(&path).map_err(failed)?;
        match FileExt::try_lock(&file) {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(wrong(&path, "another process writes it")),
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let whole = whole_lines(&bytes);
        let header = Header {
            format: FORMAT.to_owned(),
            study: study.digest.clone(),
            runs: study.len(),
            shard: shard.to_string(),
        };
        let mut done = BTreeMap::new();
        if whole > 0 {
            if !resume {
                return Err(wrong(
                    &path,
                    "it exists already; continue with `--resume`, or use another directory",
                ));
            }
            let (found, lines) = parse(&path, &bytes[..whole])?;
            if found != header {
                return Err(wrong(&path, OTHER_STUDY));
            }
            done = lines.into_iter().map(|line| (line.run, line)).collect();
        }
        // An incomplete last line, left by a killed process, is cut off; its run is repeated.
        file.set_len(whole as u64).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let mut results = Self { file, path, done };
        if whole == 0 {
            results.write(&header)?;
        }
        Ok(results)
    }

    /// Appends the result of a run and flushes the file to the disk.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, line: Line) -> Result<(), Message> {
        self.write(&line)?;
        self.done.insert(line.run, line);
        Ok(())
    }

    fn write(&mut self, line: &impl Serialize) -> Result<(), Message> {
        let text = serde_json::to_string(line).unwrap_or_default() + "\n";
        let written = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(|error| wrong(&self.path, &error.to_string()))
    }
}

fn wrong(path: &Path, text: &str) -> Message {
    Message::error("M151", format!("{}: {text}", path.display()))
}

/// Returns the length of the complete lines. An incomplete last line may end within a character.
fn whole_lines(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1)
}

fn parse(path: &Path, bytes: &[u8]) -> Result<(Header, Vec<Line>), Message> {
    let text = std::str::from_utf8(bytes).map_err(|error| wrong(path, &error.to_string()))?;
    let mut lines = text.lines();
    let header: Header = lines
        .next()
        .and_then(|line| serde_json::from_str(line).ok())
        .filter(|header: &Header| header.format == FORMAT)
        .ok_or_else(|| wrong(path, "it is not a file of `metaplan sweep`"))?;
    let parsed = lines.enumerate().map(|(number, line)| {
        serde_json::from_str(line)
            .map_err(|error| wrong(path, &format!("line {} is damaged: {error}", number + 2)))
    });
    Ok((header, parsed.collect::<Result<_, _>>()?))
}

/// Reads the results in all shard files of a directory, sorted by run. Omits incomplete last lines
/// and repeated results of a run.
///
/// # Errors
/// The directory cannot be read or has no result file. Otherwise all faults: files that are
/// unreadable, damaged or of another study, and runs with differing answers.
pub fn read_lines(directory: &Path, study: &Study) -> Result<Vec<Line>, Errors> {
    let failed = |error: io::Error| Errors::from(wrong(directory, &error.to_string()));
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|extension| extension == "jsonl") {
            files.push(path);
        }
    }
    files.sort();
    let header_start = format!("{{\"format\":\"{FORMAT}\"");
    let (mut all, mut mistakes) = (BTreeMap::<usize, Line>::new(), Vec::new());
    for path in &files {
        let bytes = match std::fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) => {
                mistakes.push(wrong(path, &error.to_string()));
                continue;
            }
        };
        let whole = whole_lines(&bytes);
        let header_start = header_start.as_bytes();
        if whole == 0 && (bytes.starts_with(header_start) || header_start.starts_with(&bytes)) {
            // The process was killed before it had written the header.
            continue;
        }
        match parse(path, &bytes[..whole]) {
            Err(message) => mistakes.push(message),
            Ok((header, lines)) => {
                if header.study != study.digest {
                    mistakes.push(wrong(path, OTHER_STUDY));
                    continue;
                }
                for line in lines {
                    let first_line = all.entry(line.run).or_insert_with(|| line.clone());
                    if essence(&first_line.answer) != essence(&line.answer) {
                        mistakes.push(wrong(path, &format!("run {} has another answer elsewhere", line.run)));
                    }
                }
            }
        }
    }
    if files.is_empty() {
        mistakes.push(wrong(directory, "there is no file `*.jsonl` of `metaplan sweep` in it"));
    }
    if mistakes.is_empty() { Ok(all.into_values().collect()) } else { Err(mistakes.into()) }
}

/// Returns an answer without the fields that differ between repetitions of a run: times, memory and
/// statistics of a search.
pub(super) fn essence(answer: &Value) -> Value {
    match answer {
        Value::Object(fields) => {
            let reproducible = fields.iter().filter(|(name, _)| !is_measured(name));
            Value::Object(reproducible.map(|(name, value)| (name.clone(), essence(value))).collect())
        }
        Value::Array(values) => values.iter().map(essence).collect(),
        other => other.clone(),
    }
}

fn is_measured(name: &str) -> bool {
    ["statistics", "costs", "milliseconds", "seconds", "elapsed"].contains(&name)
}
