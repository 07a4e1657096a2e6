//! Layout of a message: its text, the source line with the marked position, and the suggested correction.
//! Messages about all input languages have this form.

use std::fmt::Write as _;
use std::ops::Range;

use codespan_reporting::diagnostic::{self as codespan, Label, LabelStyle};
use codespan_reporting::files::{Error as FilesError, Files};
use codespan_reporting::term::{self, termcolor};

/// One line of a text, truncated around the marked range because generated files have lines of megabytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excerpt {
    file: String,
    text: String,
    range: Range<usize>,
    line: usize,
    skipped: usize,
    message: String,
}

/// Maximum number of bytes that an excerpt contains on each side of the beginning of the marked range,
/// before it is rounded to character boundaries.
const CONTEXT: usize = 150;

#[expect(
    clippy::arithmetic_side_effects,
    reason = "positions in a text in memory; a mark starts in the part that is shown"
)]
impl Excerpt {
    /// Creates an excerpt of the line in which a byte range begins. `line` is the number of this line.
    /// Offsets are clamped to the text, and the mark to the shown part of the line, so the result is always
    /// `Some`.
    pub(crate) fn new(
        file: &str,
        text: &str,
        line: usize,
        place: Range<usize>,
        message: &str,
    ) -> Option<Self> {
        let floor = |at: usize| (0..=at).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
        let at = floor(place.start.min(text.len()));
        let begin = text[..at].rfind('\n').map_or(0, |at| at + 1);
        let line_end = text[at..].find('\n').map_or(text.len(), |length| at + length);
        // The carriage return of a Windows line end does not belong to the line.
        let line_end = begin + text[begin..line_end].trim_end_matches('\r').len();
        // All limits are rounded down to character boundaries.
        let start = floor(at.saturating_sub(CONTEXT)).max(begin);
        let mark = at.clamp(start, line_end.max(start));
        let end = floor((mark + CONTEXT).min(line_end)).max(mark);
        Some(Self {
            file: file.to_owned(),
            text: text.get(start..end)?.to_owned(),
            range: mark - start..floor(place.end.min(text.len())).clamp(mark, end) - start,
            line,
            skipped: text.get(begin..start)?.chars().count(),
            message: message.to_owned(),
        })
    }

    /// Creates an excerpt with a mark below the word that begins at a column. Line and column count from 1,
    /// columns in characters. Returns `None` if the text has no such line.
    pub fn at(file: &str, text: &str, line: usize, column: usize) -> Option<Self> {
        let begin: usize = text.split_inclusive('\n').take(line.checked_sub(1)?).map(str::len).sum();
        let content = text.get(begin..).filter(|remainder| !remainder.is_empty())?.lines().next()?;
        let place = content.char_indices().nth(column.saturating_sub(1)).map_or(content.len(), |(at, _)| at);
        let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        let word = content[place..].find(|c| !is_part(c)).unwrap_or(content.len() - place);
        let first = content[place..].chars().next().map_or(0, char::len_utf8);
        Self::new(file, text, line, begin + place..begin + place + word.max(first), "")
    }

    /// Returns a copy with `change` applied to the file name, the message and the text. The text before,
    /// inside and after the mark is changed separately, so the mark stays on the same word.
    #[must_use]
    pub fn map(&self, change: impl Fn(&str) -> String) -> Self {
        let (before, remainder) = self.text.split_at(self.range.start);
        let (marked, after) = remainder.split_at(self.range.len());
        let (before, marked, after) = (change(before), change(marked), change(after));
        Self {
            file: change(&self.file),
            range: before.len()..before.len() + marked.len(),
            text: before + &marked + &after,
            message: change(&self.message),
            ..*self
        }
    }
}

/// A message with its source lines and its suggested correction, ready for display.
#[derive(Debug, Clone, Copy)]
pub struct Shown<'a> {
    /// Whether the message is an error; otherwise it is a warning.
    pub is_error: bool,
    /// Stable code of the cause.
    pub code: &'a str,
    /// Description of the problem, in one sentence.
    pub message: &'a str,
    /// File, or `FILE:LINE:COLUMN`. Displayed only if there are no excerpts.
    pub place: Option<&'a str>,
    /// Suggested correction.
    pub help: Option<&'a str>,
    /// Source lines. The first one is the location of the problem.
    pub excerpts: &'a [Excerpt],
}

impl Shown<'_> {
    /// Formats the message for a terminal, with ANSI escapes if `color` is set. The text ends with a line
    /// break.
    pub fn text(&self, color: bool) -> String {
        let config = term::Config::default();
        let mut buffer = if color { termcolor::Buffer::ansi() } else { termcolor::Buffer::no_color() };
        let excerpts = Excerpts(self.excerpts);
        // Writing to memory does not fail, and the labels lie within the excerpts by construction.
        let _ = term::emit_to_write_style(&mut buffer, &config, &excerpts, &self.diagnostic());
        let mut text = String::from_utf8_lossy(buffer.as_slice()).into_owned();
        if self.excerpts.is_empty() {
            text.truncate(text.trim_end().len());
            let (blue, plain) = if color { ("\u{1b}[34m", "\u{1b}[0m") } else { ("", "") };
            if let Some(place) = self.place {
                let _ = write!(text, "\n  {blue}┌─{plain} {place}");
            }
            if let Some(help) = self.help {
                let _ = write!(text, "\n  {blue}={plain} help: {help}");
            }
            text.push('\n');
        }
        text
    }

    fn diagnostic(&self) -> codespan::Diagnostic<usize> {
        let severity = if self.is_error { codespan::Severity::Error } else { codespan::Severity::Warning };
        let labels = self.excerpts.iter().enumerate().map(|(id, excerpt)| {
            let style = if excerpt.message.is_empty() { LabelStyle::Primary } else { LabelStyle::Secondary };
            Label::new(style, id, excerpt.range.clone()).with_message(&excerpt.message)
        });
        let help = self.help.filter(|_| !self.excerpts.is_empty());
        codespan::Diagnostic::new(severity)
            .with_code(self.code)
            .with_message(self.message)
            .with_labels(labels.collect())
            .with_notes(help.iter().map(|help| format!("help: {help}")).collect())
    }
}

struct Excerpts<'e>(&'e [Excerpt]);

impl<'a> Files<'a> for Excerpts<'_> {
    type FileId = usize;
    type Name = &'a str;
    type Source = &'a str;

    fn name(&'a self, id: usize) -> Result<&'a str, FilesError> {
        self.0.get(id).map(|excerpt| excerpt.file.as_str()).ok_or(FilesError::FileMissing)
    }

    fn source(&'a self, id: usize) -> Result<&'a str, FilesError> {
        self.0.get(id).map(|excerpt| excerpt.text.as_str()).ok_or(FilesError::FileMissing)
    }

    fn line_index(&'a self, _: usize, _: usize) -> Result<usize, FilesError> {
        Ok(0)
    }

    fn line_number(&'a self, id: usize, _: usize) -> Result<usize, FilesError> {
        self.0.get(id).map(|excerpt| excerpt.line).ok_or(FilesError::FileMissing)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    fn column_number(&'a self, id: usize, _: usize, byte: usize) -> Result<usize, FilesError> {
        let excerpt = self.0.get(id).ok_or(FilesError::FileMissing)?;
        let before = excerpt.text.get(..byte).unwrap_or(&excerpt.text);
        Ok(excerpt.skipped + before.chars().count() + 1)
    }

    fn line_range(&'a self, id: usize, _: usize) -> Result<Range<usize>, FilesError> {
        self.0.get(id).map(|excerpt| 0..excerpt.text.len()).ok_or(FilesError::FileMissing)
    }
}

#[cfg(test)]
mod tests {
    use super::{Excerpt, Shown};

    fn check(text: &str, (line, column): (usize, usize), expected: &str) {
        let excerpt = Excerpt::at("f", text, line, column);
        let message = Shown {
            is_error: true,
            code: "X100",
            message: "wrong",
            place: Some("f:1:1"),
            help: Some("right"),
            excerpts: excerpt.as_slice(),
        };
        assert_eq!(message.text(false), expected);
        assert!(message.text(true).contains("\u{1b}["));
    }

    #[test]
    fn a_word_is_marked_in_its_line() {
        check(
            "one\r\n a two-3 b\r\n",
            (2, 4),
            "error[X100]: wrong\n  ┌─ f:2:4\n  │\n2 │  a two-3 b\n  │    ^^^^^\n  │\n  = help: right\n\n",
        );
        check(
            "é (",
            (1, 3),
            "error[X100]: wrong\n  ┌─ f:1:3\n  │\n1 │ é (\n  │   ^\n  │\n  = help: right\n\n",
        );
    }

    #[test]
    fn a_message_without_a_source_line_shows_its_position() {
        check("one", (2, 1), "error[X100]: wrong\n  ┌─ f:1:1\n  = help: right\n");
        check("", (0, 0), "error[X100]: wrong\n  ┌─ f:1:1\n  = help: right\n");
    }

    #[test]
    fn marks_stay_on_their_part_when_the_text_before_them_grows() {
        let excerpt = Excerpt::at("f", "a\u{1b} b c", 1, 4).expect("a place");
        let grown = excerpt.map(|part| part.replace('\u{1b}', "<escape>"));
        assert_eq!((&grown.text[..], &grown.text[grown.range.clone()]), ("a<escape> b c", "b"));
    }
}
