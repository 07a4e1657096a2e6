//! Output of answers, messages and tables, and writing of files.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{ErrorKind, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::answers::ErrorAnswer;
use crate::file;
use crate::message::{Errors, Message};
pub use crate::visible::pretty;
use crate::visible::{visible, visible_json};
use comfy_table::{ColumnConstraint, ContentArrangement, Table, TableStyle, Width};
use console::{Term, measure_text_width};
use serde::Serialize;

use crate::cli::common::{Common, Failure, Format};

static ANSWER_LOST: AtomicBool = AtomicBool::new(false);

static HAS_BEGUN: AtomicBool = AtomicBool::new(false);

const MESSAGE_LIMIT: usize = 20;

const KIND_LIMIT: usize = 10;

/// Writes an answer for people to standard output, with control characters made visible by
/// [`visible`].
pub fn answer(text: &str) {
    document(&visible(text));
}

/// Writes a document unchanged to standard output. A closed pipe is not an error. Any other error is reported on
/// standard error, and [`answer_lost`] then returns `true`.
pub fn document(text: &str) {
    let mut stdout = std::io::stdout().lock();
    HAS_BEGUN.store(true, Ordering::Relaxed);
    if let Err(error) = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush())
        // A closed pipe is the decision of the reader, for example `head`.
        && error.kind() != ErrorKind::BrokenPipe
    {
        ANSWER_LOST.store(true, Ordering::Relaxed);
        let message = Message::error("M109", format!("the answer cannot be written: {error}"));
        let _ = std::io::stderr().write_all(message.text().as_bytes());
    }
}

pub fn answer_lost() -> bool {
    ANSWER_LOST.load(Ordering::Relaxed)
}

/// Returns `true` if an answer, a part of one, or a file is being written or has been written. The result stays
/// valid while the caller holds the lock of standard output.
pub fn has_begun() -> bool {
    HAS_BEGUN.load(Ordering::Relaxed)
}

pub fn json_answer(answer: &impl Serialize) {
    document(&visible_json(&pretty(answer)));
}

pub fn line(answer: &impl Serialize) -> String {
    serde_json::to_string(answer).unwrap_or_default() + "\n"
}

pub fn note(text: &str) {
    let _ = std::io::stderr().write_all(visible(text).as_bytes());
}

/// Formats a message, either with colours, or without colours and with control characters made visible.
pub fn shown(message: &Message, colors: bool) -> Cow<'_, str> {
    if colors { message.colored().into() } else { visible(message.text()) }
}

/// Writes messages to standard error. `--quiet` suppresses warnings. At most [`KIND_LIMIT`]
/// warnings per code are written; further ones are only counted.
pub fn warnings<'a>(common: &Common, messages: impl IntoIterator<Item = &'a Message>) {
    let mut stderr = std::io::stderr().lock();
    let colors = common.colors(&stderr);
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for message in messages.into_iter().filter(|message| message.is_error() || !common.quiet) {
        let count = counts.entry(&message.code).or_default();
        *count += usize::from(!message.is_error());
        if message.is_error() || *count <= KIND_LIMIT {
            let _ = stderr.write_all(shown(message, colors).as_bytes());
        }
    }
    let omitted = counts.into_iter().filter(|(_, count)| *count > KIND_LIMIT);
    for (code, count) in omitted {
        let remedy = "`--format json` of `lint`, `configure` and `reason` lists all";
        let _ = writeln!(stderr, "… and {} more {code}; {remedy}", count - KIND_LIMIT);
    }
}

/// Reports errors: text on standard error, or a JSON object as the answer. As text, at most
/// [`MESSAGE_LIMIT`] messages are written; further ones are only counted. `--quiet` suppresses
/// warnings in the text.
pub fn failure(common: &Common, messages: &[Message]) {
    if common.format == Format::Json {
        json_answer(&ErrorAnswer::new(messages));
        return;
    }
    let mut stderr = std::io::stderr().lock();
    let colors = common.colors(&stderr);
    let visible: Vec<_> = messages.iter().filter(|message| message.is_error() || !common.quiet).collect();
    for message in visible.iter().take(MESSAGE_LIMIT) {
        let _ = stderr.write_all(shown(message, colors).as_bytes());
    }
    if visible.len() > MESSAGE_LIMIT {
        let omitted = visible.len() - MESSAGE_LIMIT;
        let _ = writeln!(stderr, "… and {omitted} more; `--format json` lists all");
    }
}

/// Writes a file, atomically where possible (see [`file::write`]). From then on, the time limit does not end the
/// program.
pub fn write_file(path: &Path, text: &str) -> Result<(), Failure> {
    {
        // The thread of the time limit holds this lock while it decides whether to end the program.
        let _stdout = std::io::stdout().lock();
        HAS_BEGUN.store(true, Ordering::Relaxed);
    }
    file::write(path, text).map_err(Failure::from)
}

/// Returns the file given by `--output`, or `None` for standard output (no option, or `-`).
pub fn file_named(output: Option<&PathBuf>) -> Option<&Path> {
    output.map(PathBuf::as_path).filter(|path| !file::is_stdout(path))
}

pub fn make_directory(path: &Path) -> Result<(), Failure> {
    require_directory(path)?;
    std::fs::create_dir_all(path).map_err(|error| {
        let text = format!("the directory cannot be created: {}", error.kind());
        Message::at("M109", &path.display().to_string(), None, text).into()
    })
}

pub fn require_directory(path: &Path) -> Result<(), Failure> {
    if path.as_os_str() != "-" {
        return Ok(());
    }
    let text = "`-` is standard output, but several files are written; name a directory (`./-` for a directory \
                with this name)";
    Err(Failure::usage(Message::error("M107", text)))
}

/// Checks that [`file::create_directory`] can start a new directory, before its files are computed.
pub fn require_new_directory(path: &Path) -> Result<(), Failure> {
    require_directory(path)?;
    file::create_directory(path).map(drop).map_err(|error| {
        let text = format!("the directory cannot be written: {}", error.kind());
        Message::at("M109", &path.display().to_string(), None, text).into()
    })
}

/// Checks that none of the files, given by path and new content, exists with another content.
pub fn require_unchanged<'f>(files: impl IntoIterator<Item = (PathBuf, &'f str)>) -> Result<(), Failure> {
    let is_changed = |path: &Path, text: &str| {
        path.symlink_metadata().is_ok()
            && !(path.is_file() && std::fs::read(path).is_ok_and(|content| content == text.as_bytes()))
    };
    let changed = files.into_iter().filter(|(path, text)| is_changed(path, text));
    Ok(Errors::unless_empty(changed.map(|(path, _)| exists(&path)))?)
}

/// Returns the error that a file exists and would be overwritten.
pub fn exists(path: &Path) -> Message {
    let text = "this file exists already and is not overwritten; choose another directory";
    Message::at("M133", &path.display().to_string(), None, text)
}

/// Returns the number of columns for answers: the environment variable `COLUMNS`, or the width of the terminal. Returns
/// `None` if neither is known, or if the number is 0.
pub fn columns() -> Option<u16> {
    let requested = std::env::var("COLUMNS").ok().and_then(|columns| columns.trim().parse().ok());
    let of_terminal = || {
        let size = std::io::stdout().is_terminal().then(|| Term::stdout().size_checked()).flatten();
        size.map(|(_, columns)| columns)
    };
    requested.or_else(of_terminal).filter(|columns| *columns > 0)
}

pub fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    table_within(columns(), header, rows)
}

pub fn table_within(
    columns: Option<u16>,
    header: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
) -> String {
    let mut table = Table::new();
    table.load_style(TableStyle::new()).set_header(header);
    table.add_rows(rows);
    match columns {
        Some(columns) => {
            table.set_content_arrangement(ContentArrangement::Dynamic).set_width(columns);
            keep_words(&mut table, columns);
        }
        None => {
            table.set_content_arrangement(ContentArrangement::Disabled);
        }
    }
    table.lines().fold(String::new(), |text, line| {
        text + line.trim_end()
            + "
"
    })
}

/// Breaks cells only between words, if the width suffices for the longest words.
fn keep_words(table: &mut Table, columns: u16) {
    let mut longest = vec![0; table.column_count()];
    for row in table.header().into_iter().chain(table.row_iter()) {
        for (cell, longest) in row.cell_iter().zip(&mut longest) {
            let content = cell.content();
            let words = content.split_whitespace().map(measure_text_width);
            *longest = words.max().unwrap_or(0).max(*longest);
        }
    }
    let widths: Vec<u16> = table
        .column_iter()
        .zip(longest)
        .map(|(column, longest)| {
            u16::try_from(longest).unwrap_or(u16::MAX).saturating_add(column.padding_width())
        })
        .collect();
    // A narrow terminal has to break words.
    if widths.iter().copied().fold(0, u16::saturating_add) > columns {
        return;
    }
    for (column, width) in table.column_iter_mut().zip(widths) {
        column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(width)));
    }
}

/// Formats an exact number as decimal text, rounded to at most 34 fractional digits.
pub fn decimal(value: &num_rational::BigRational) -> String {
    rules::Decimal::from_rational(value).to_string()
}

pub fn counted<N: Copy + std::fmt::Display + PartialEq + From<u8>>(count: N, noun: &str) -> String {
    let ending = if count == N::from(1) { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use super::counted;

    #[test]
    fn a_count_of_one_is_singular() {
        let texts = [0_usize, 1, 2].map(|count| counted(count, "solver call"));
        assert_eq!(texts, ["0 solver calls", "1 solver call", "2 solver calls"]);
    }
}
