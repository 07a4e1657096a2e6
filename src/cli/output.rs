//! Writing: answers, messages, tables, files that are either whole or not there.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{ErrorKind, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use comfy_table::{ContentArrangement, Table, TableStyle};
use metaplan::answers::ErrorAnswer;
use metaplan::message::Message;
use serde::Serialize;

use crate::cli::common::{Common, Failure, Format};

/// Whether an answer could not be written.
static ANSWER_LOST: AtomicBool = AtomicBool::new(false);

/// How many messages are shown before the rest is only counted.
const MESSAGE_LIMIT: usize = 20;

/// How many warnings of one code are shown before the rest is only counted.
const KIND_LIMIT: usize = 10;

/// Writes an answer for people to standard output, see [`visible`].
pub fn answer(text: &str) {
    document(&visible(text));
}

/// The text with everything escaped that would change what a terminal shows, in which order, or without being seen: control
/// characters but line breaks and tabs, marks of bidirectional text, and characters that take no room. Names come from files that
/// may be hostile. Joiners are left, since some languages are written with them.
pub fn visible(text: &str) -> Cow<'_, str> {
    escaped(text, |character, all| {
        let _ = write!(all, "\\u{{{:x}}}", u32::from(character));
    })
}

/// The same for JSON, in which such characters are in strings only.
pub fn visible_json(text: &str) -> Cow<'_, str> {
    escaped(text, |character, all| {
        for unit in character.encode_utf16(&mut [0; 2]) {
            let _ = write!(all, "\\u{unit:04x}");
        }
    })
}

/// Whether a character is not seen as itself.
fn hides(character: char) -> bool {
    let is_unseen = matches!(
        character,
        '\u{ad}' | '\u{180e}' | '\u{200b}' | '\u{2028}' | '\u{2029}' | '\u{2060}'..='\u{2065}'
            | '\u{206a}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}'
    );
    let is_mark = matches!(
        character,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    character.is_control() && !matches!(character, '\n' | '\t') || is_unseen || is_mark
}

fn escaped(text: &str, escape: impl Fn(char, &mut String)) -> Cow<'_, str> {
    let is_plain = |byte: u8| matches!(byte, b' '..=b'~' | b'\n' | b'\t');
    if text.bytes().all(is_plain) || !text.contains(hides) {
        return Cow::Borrowed(text);
    }
    let mut all = String::with_capacity(text.len());
    for character in text.chars() {
        if hides(character) {
            escape(character, &mut all);
        } else {
            all.push(character);
        }
    }
    Cow::Owned(all)
}

/// Writes a document as it is to standard output; a reader that has gone away is no fault, a full disk is.
pub fn document(text: &str) {
    let mut stdout = std::io::stdout().lock();
    if let Err(error) = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush())
        && error.kind() != ErrorKind::BrokenPipe
    {
        ANSWER_LOST.store(true, Ordering::Relaxed);
        let message = Message::error("M109", format!("the answer cannot be written: {error}"));
        let _ = std::io::stderr().write_all(message.text().as_bytes());
    }
}

/// Whether an answer could not be written.
pub fn answer_lost() -> bool {
    ANSWER_LOST.load(Ordering::Relaxed)
}

/// Writes an answer for programs to standard output.
pub fn json_answer(answer: &impl Serialize) {
    document(&visible_json(&pretty(answer)));
}

/// An answer for programs as text, with a line break at its end.
pub fn pretty(answer: &impl Serialize) -> String {
    // Texts, numbers and lists of them are always data.
    serde_json::to_string_pretty(answer).unwrap_or_default() + "\n"
}

/// The same as one line.
pub fn line(answer: &impl Serialize) -> String {
    serde_json::to_string(answer).unwrap_or_default() + "\n"
}

/// A sentence for people beside the answer, on standard error.
pub fn note(text: &str) {
    let _ = std::io::stderr().write_all(visible(text).as_bytes());
}

/// Messages beside the answer, on standard error; warnings only unless asked to be quiet.
pub fn warnings<'a>(common: &Common, messages: impl IntoIterator<Item = &'a Message>) {
    let mut stderr = std::io::stderr().lock();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for message in messages.into_iter().filter(|message| message.is_error() || !common.quiet) {
        let count = counts.entry(&message.code).or_default();
        *count += 1;
        if message.is_error() || *count <= KIND_LIMIT {
            let _ = stderr.write_all(visible(message.text()).as_bytes());
        }
    }
    let more = counts.into_iter().filter(|(_, count)| !common.quiet && *count > KIND_LIMIT);
    for (code, count) in more {
        let _ = writeln!(stderr, "… and {} more {code}; `--format json` lists all", count - KIND_LIMIT);
    }
}

/// Errors: text on standard error, or a JSON object as the answer.
pub fn failure(common: &Common, messages: &[Message]) {
    if common.format == Format::Json {
        json_answer(&ErrorAnswer::new(messages));
        return;
    }
    let mut stderr = std::io::stderr().lock();
    let shown: Vec<_> = messages.iter().filter(|message| message.is_error() || !common.quiet).collect();
    for message in shown.iter().take(MESSAGE_LIMIT) {
        let _ = stderr.write_all(visible(message.text()).as_bytes());
    }
    if shown.len() > MESSAGE_LIMIT {
        let rest = shown.len() - MESSAGE_LIMIT;
        let _ = writeln!(stderr, "… and {rest} more; `--format json` lists all");
    }
}

/// Writes a file so that it is either whole or untouched.
pub fn write_file(path: &Path, text: &str) -> Result<(), Failure> {
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let written = tempfile::NamedTempFile::new_in(directory).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|error| error.error)
    });
    match written {
        Ok(_) => Ok(()),
        Err(error) => Err(Message::at(
            "M109",
            &path.display().to_string(),
            None,
            format!("cannot be written: {}", error.kind()),
        )
        .into()),
    }
}

/// A table without borders.
pub fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table
        .load_style(TableStyle::new())
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(header);
    table.add_rows(rows);
    table.lines().fold(String::new(), |text, line| {
        text + line.trim_end()
            + "
"
    })
}

/// An exact number as decimal text; a fraction that is no decimal is rounded.
pub fn decimal(value: &num_rational::BigRational) -> String {
    rules::Decimal::from_rational(value).to_string()
}

#[cfg(test)]
mod tests {
    use super::{visible, visible_json};

    fn check(text: &str, shown: &str, in_json: &str) {
        assert_eq!((&*visible(text), &*visible_json(text)), (shown, in_json), "{text:?}");
    }

    #[test]
    fn what_is_not_seen_is_escaped() {
        check("a\tb\n", "a\tb\n", "a\tb\n");
        check("naïve Ελλάδα می\u{200c}خواهم", "naïve Ελλάδα می\u{200c}خواهم", "naïve Ελλάδα می\u{200c}خواهم");
        check("\u{1b}[2J", "\\u{1b}[2J", "\\u001b[2J");
        check("\u{202e}x\u{feff}", "\\u{202e}x\\u{feff}", "\\u202ex\\ufeff");
        check("\u{200b}\u{2028}", "\\u{200b}\\u{2028}", "\\u200b\\u2028");
        // Two units of UTF-16.
        check("\u{e0041}", "\\u{e0041}", "\\udb40\\udc41");
    }
}
