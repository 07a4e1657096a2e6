//! [`Message`]: errors and warnings of all crates in a single form, printed for users and
//! serialised for programs.

use std::fmt;

use pddl::{self, Diagnostic, Excerpt, Severity, Shown, Source};
use serde::Serialize;

use crate::visible::visible;

/// All errors of an input, possibly with warnings.
pub type Errors = diagnostics::Errors<Message>;

/// A message about an input.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(transparent)]
pub struct Message(Box<Details>);

impl std::ops::Deref for Message {
    type Target = Details;

    fn deref(&self) -> &Details {
        &self.0
    }
}

/// The contents of a message.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Details {
    /// `error` or `warning`.
    pub severity: &'static str,
    /// Stable code of the cause.
    pub code: String,
    /// Message, one sentence.
    pub message: String,
    /// File, if the message is about one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Line, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Column, from 1, in characters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<usize>,
    /// Help: a possible correction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
    /// Source lines: that of the location, and that of a related location, if there are any.
    #[serde(skip)]
    excerpts: Vec<Excerpt>,
    /// The message formatted for a terminal.
    #[serde(skip)]
    text: String,
}

impl Details {
    /// Formats the message for a terminal. `part` is applied to each of its texts first.
    fn shown(&self, color: bool, part: impl Fn(&str) -> String) -> String {
        let place = self.file.as_ref().map(|file| match (self.line, self.column) {
            (Some(line), Some(column)) => format!("{file}:{line}:{column}"),
            _ => file.clone(),
        });
        let [message, place, help] = [Some(&self.message), place.as_ref(), self.help.as_ref()]
            .map(|text| text.map(|text| part(&one_line(text))));
        let excerpts: Vec<Excerpt> = self.excerpts.iter().map(|excerpt| excerpt.map(&part)).collect();
        let shown = Shown {
            is_error: self.severity == "error",
            code: &self.code,
            message: &message.unwrap_or_default(),
            place: place.as_deref(),
            help: help.as_deref(),
            excerpts: &excerpts,
        };
        shown.text(color)
    }
}

impl Message {
    /// Creates an error without a source location.
    pub fn error(code: &str, message: impl Into<String>) -> Self {
        Self::plain("error", code, message.into(), None)
    }

    /// Creates the error that reports a panic as a fault of the program.
    pub fn of_panic(panic: &(dyn std::any::Any + Send)) -> Self {
        let reason = panic.downcast_ref::<String>().map(String::as_str);
        let reason = reason.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or_default();
        let text = format!("this is a fault of metaplan, not of your input; please report it: {reason}");
        Self::error("M170", text)
    }

    /// Creates a warning without a source location.
    pub fn warning(code: &str, message: impl Into<String>) -> Self {
        Self::plain("warning", code, message.into(), None)
    }

    /// Creates a warning at a line and column of a file.
    pub fn warning_at(code: &str, file: &str, place: (usize, usize), message: impl Into<String>) -> Self {
        Self::plain("warning", code, message.into(), Some((file.to_owned(), Some(place))))
    }

    /// Creates an error about a file, optionally at a line and column.
    pub fn at(code: &str, file: &str, place: Option<(usize, usize)>, message: impl Into<String>) -> Self {
        Self::plain("error", code, message.into(), Some((file.to_owned(), place)))
    }

    fn plain(
        severity: &'static str,
        code: &str,
        message: String,
        place: Option<(String, Option<(usize, usize)>)>,
    ) -> Self {
        let (file, place) = place.map_or((None, None), |(file, place)| (Some(file), place));
        let (line, column) = place.unzip();
        Self::of(Details {
            severity,
            code: code.to_owned(),
            message,
            file,
            line,
            column,
            help: None,
            excerpts: Vec::new(),
            text: String::new(),
        })
    }

    fn of(mut details: Details) -> Self {
        details.text = details.shown(false, str::to_owned);
        Self(Box::new(details))
    }

    /// Returns this message as an error.
    #[must_use]
    pub fn into_error(self) -> Self {
        Self::of(Details { severity: "error", ..*self.0 })
    }

    /// Adds the source line of the message as an excerpt, if the message has a line and a column. `text` is the
    /// content of the message's file.
    #[must_use]
    pub fn with_source(mut self, text: &str) -> Self {
        let details = &mut *self.0;
        if let (Some(file), Some(line), Some(column)) = (&details.file, details.line, details.column) {
            details.excerpts = Excerpt::at(file, text, line, column).into_iter().collect();
            details.text = details.shown(false, str::to_owned);
        }
        self
    }

    /// Sets the hint that describes a remedy.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self.0.text = self.0.shown(false, str::to_owned);
        self
    }

    /// Converts diagnostics of the PDDL front end, with their source lines.
    pub fn from_pddl(diagnostics: &[Diagnostic], sources: &[&Source]) -> Vec<Self> {
        let details = |diagnostic: &Diagnostic| Details {
            severity: if diagnostic.severity == Severity::Error { "error" } else { "warning" },
            code: diagnostic.code.to_owned(),
            message: diagnostic.message.clone(),
            file: Some(diagnostic.file.clone()),
            line: Some(diagnostic.line),
            column: Some(diagnostic.column),
            help: diagnostic.help.clone(),
            excerpts: diagnostic.excerpts(sources),
            text: String::new(),
        };
        diagnostics.iter().map(|diagnostic| Self::of(details(diagnostic))).collect()
    }

    /// Converts an error of the ontology crate to a message.
    pub fn from_ontology(error: &ontology::Error) -> Self {
        match error {
            ontology::Error::Engine(error) => Self::from_rules(error),
            ontology::Error::Unknown { name, known, .. } => {
                let suggestion = did_you_mean(name, known.iter().map(String::as_str));
                Self::from_text("error", error.code(), &(error.to_string() + &suggestion))
            }
            _ => Self::from_text("error", error.code(), &error.to_string()),
        }
    }

    /// Converts a warning of the ontology crate to a message.
    pub fn from_ontology_warning(warning: &ontology::Warning) -> Self {
        Self::from_text("warning", warning.code(), &warning.to_string())
    }

    /// Converts an error of the rules crate to a message.
    pub fn from_rules(error: &rules::Error) -> Self {
        let (text, code) = (error.to_string(), error.code());
        let sentence = text.split_once(&format!("{code} ")).map_or(text.as_str(), |(_, sentence)| sentence);
        let place = error.place().map(|(file, line, column)| (file.to_owned(), Some((line, column))));
        Self::plain("error", code, sentence.to_owned(), place)
    }

    /// Parses the text of an error or warning of a library: `[FILE:[LINE:COLUMN:]]
    /// [SEVERITY[CODE]:] SENTENCE`.
    fn from_text(severity: &'static str, code: &str, text: &str) -> Self {
        let marks = [format!("{severity}[{code}]: "), format!("{code} ")];
        let cut = marks.iter().find_map(|mark| text.find(mark.as_str()).map(|at| (at, at + mark.len())));
        let (place, message) = cut.map_or(("", text), |(start, end)| (&text[..start], &text[end..]));
        let place = place.trim().trim_end_matches(':');
        // File names may contain colons, so the parts are split from the right.
        let mut parts = place.rsplitn(3, ':');
        let (column, line, file) = (parts.next(), parts.next(), parts.next());
        let number = |part: Option<&str>| part.and_then(|part| part.parse::<usize>().ok());
        let (file, line, column) = match (file, number(line), number(column)) {
            (Some(file), Some(line), Some(column)) => (Some(file.to_owned()), Some(line), Some(column)),
            _ => ((!place.is_empty()).then(|| place.to_owned()), None, None),
        };
        let place = file.map(|file| (file, line.zip(column)));
        Self::plain(severity, code, message.to_owned(), place)
    }

    /// Returns `true` for an error, `false` for a warning.
    pub fn is_error(&self) -> bool {
        self.severity == "error"
    }

    /// Returns the message formatted for a terminal, with a line break at its end.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Formats the message with ANSI colours. Control characters in its texts are escaped as in
    /// [`visible`].
    pub fn colored(&self) -> String {
        self.shown(true, |part| visible(part).into_owned())
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text().trim_end())
    }
}

impl std::error::Error for Message {}

const ERROR_FORMAT: &str = "metaplan-error/1";

/// Answer of a failed command.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ErrorAnswer<'a> {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = ERROR_FORMAT)))]
    format: &'static str,
    /// All errors and warnings.
    messages: &'a [Message],
}

impl<'a> ErrorAnswer<'a> {
    /// Creates an answer with all messages.
    pub fn new(messages: &'a [Message]) -> Self {
        Self { format: ERROR_FORMAT, messages }
    }
}

/// Escapes line breaks. Otherwise a name or a value with a line break could imitate another
/// message.
fn one_line(text: &str) -> String {
    text.replace('\r', "\\r").replace('\n', "\\n")
}

/// Returns `; did you mean ...?` with the known name that is most similar to `written`, or an empty
/// text.
pub fn did_you_mean<'n>(written: &str, known: impl IntoIterator<Item = &'n str>) -> String {
    diagnostics::nearest(written, known).map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}
