//! What is wrong with a file, and how it is shown: the source line, a caret, what would be right.
//!
//! Codes are stable. P100 to P119 are about the form of a file, P120 to P149 about names and types.

use codespan_reporting::diagnostic::{self as codespan, Label};
use codespan_reporting::files::{Error as FilesError, Files};
use codespan_reporting::term::{self, termcolor};

use super::ast::Span;
use super::source::Source;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The file can be used.
    Warning,
    /// The file cannot be used.
    Error,
}

impl Severity {
    /// `error` or `warning`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Something wrong or questionable at a place of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// `P1xx`, stable.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// What is wrong, one sentence without full stop.
    pub message: String,
    /// The name of the source.
    pub file: String,
    /// Where, in bytes.
    pub span: Span,
    /// Where: the line, from 1.
    pub line: usize,
    /// Where: the character in the line, from 1.
    pub column: usize,
    /// What would be right.
    pub help: Option<String>,
    /// Another place that matters, for example an earlier declaration.
    pub related: Option<Related>,
}

/// A second place of a diagnostic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Related {
    /// What stands there.
    pub message: String,
    /// The name of the source.
    pub file: String,
    /// Where, in bytes.
    pub span: Span,
    /// Where: the line, from 1.
    pub line: usize,
    /// Where: the character in the line, from 1.
    pub column: usize,
}

impl Diagnostic {
    /// A diagnostic at `span` of `source`.
    pub fn new(
        source: &Source,
        span: Span,
        severity: Severity,
        code: &'static str,
        message: impl Into<String>,
    ) -> Self {
        let place = source.position(span.start);
        Self {
            code,
            severity,
            message: message.into(),
            file: source.name().to_owned(),
            span,
            line: place.line,
            column: place.column,
            help: None,
            related: None,
        }
    }

    /// Says what would be right.
    pub(crate) fn help(&mut self, help: impl Into<String>) -> &mut Self {
        self.help = Some(help.into());
        self
    }

    /// Points at a second place.
    pub(crate) fn related(&mut self, source: &Source, span: Span, message: impl Into<String>) -> &mut Self {
        let place = source.position(span.start);
        let file = source.name().to_owned();
        self.related =
            Some(Related { message: message.into(), file, span, line: place.line, column: place.column });
        self
    }
}

/// The most diagnostics that are kept for one file; a file that is not PDDL at all has no use for more.
const LIMIT: usize = 200;

/// Collects the diagnostics of one source.
#[derive(Debug)]
pub(crate) struct Sink<'s> {
    source: &'s Source,
    diagnostics: Vec<Diagnostic>,
    beyond_limit: usize,
}

impl<'s> Sink<'s> {
    pub(crate) fn new(source: &'s Source) -> Self {
        Self { source, diagnostics: Vec::new(), beyond_limit: 0 }
    }

    pub(crate) fn error(
        &mut self,
        code: &'static str,
        span: Span,
        message: impl Into<String>,
    ) -> &mut Diagnostic {
        self.push(Severity::Error, code, span, message.into())
    }

    pub(crate) fn warning(
        &mut self,
        code: &'static str,
        span: Span,
        message: impl Into<String>,
    ) -> &mut Diagnostic {
        self.push(Severity::Warning, code, span, message.into())
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    fn push(
        &mut self,
        severity: Severity,
        code: &'static str,
        span: Span,
        message: String,
    ) -> &mut Diagnostic {
        // Beyond the limit all share the last slot, whose message `finish` replaces.
        let index = self.diagnostics.len().min(LIMIT);
        if self.is_full() {
            self.beyond_limit += 1;
            return &mut self.diagnostics[index];
        }
        self.diagnostics.push(Diagnostic::new(self.source, span, severity, code, message));
        &mut self.diagnostics[index]
    }

    pub(crate) fn source(&self) -> &'s Source {
        self.source
    }

    /// How many there were so far.
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(crate) fn len(&self) -> usize {
        self.diagnostics.len() + self.beyond_limit
    }

    /// Whether more messages would only be counted, so that no work should go into them.
    pub(crate) fn is_full(&self) -> bool {
        self.diagnostics.len() > LIMIT
    }

    pub(crate) fn has_errors(&self) -> bool {
        self.beyond_limit > 0 || has_errors(&self.diagnostics)
    }

    /// All that was collected, in the order of the file.
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(crate) fn finish(mut self) -> Vec<Diagnostic> {
        if let (Some(last), true) = (self.diagnostics.get_mut(LIMIT), self.beyond_limit > 0) {
            *last = Diagnostic::new(
                self.source,
                last.span,
                Severity::Error,
                "P119",
                format!("{} more messages about this file are not shown", self.beyond_limit + 1),
            );
        }
        self.diagnostics.sort_by_key(|diagnostic| (diagnostic.span.start, diagnostic.code));
        // What is compiled to several forms is checked in each.
        self.diagnostics.dedup();
        self.diagnostics
    }
}

/// Whether one of them is an error.
pub fn has_errors(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error)
}

/// The diagnostics as text for a terminal, `color` with ANSI escapes. A diagnostic whose file is not among
/// the sources is shown without its source line.
pub fn render(diagnostics: &[Diagnostic], sources: &[&Source], color: bool) -> String {
    let config = term::Config::default();
    let mut buffer = if color { termcolor::Buffer::ansi() } else { termcolor::Buffer::no_color() };
    for diagnostic in diagnostics {
        let excerpts = Excerpts::of(diagnostic, sources);
        // Writing to memory does not fail, and the labels lie in the excerpts by construction.
        let _ = term::emit_to_write_style(&mut buffer, &config, &excerpts, &excerpts.rendered(diagnostic));
    }
    String::from_utf8_lossy(buffer.as_slice()).into_owned()
}

/// One line of a source, cut around the place in question: generated files have lines of megabytes.
struct Excerpt {
    file: String,
    text: String,
    range: std::ops::Range<usize>,
    line: usize,
    skipped: usize,
    message: String,
}

/// The lines that a diagnostic shows: its own, and that of its related place.
struct Excerpts(Vec<Excerpt>);

/// How many bytes of a long line are shown before and after the place in question.
const CONTEXT: usize = 150;

impl Excerpt {
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions in a text in memory; the label starts in the part that is shown"
    )]
    fn of(sources: &[&Source], file: &str, span: Span, message: &str) -> Option<Self> {
        let source = sources.iter().find(|source| source.name() == file)?;
        let line = source.line_span(span.start);
        let floor = |at: usize| (0..=at).rev().find(|at| source.text().is_char_boundary(*at)).unwrap_or(0);
        let start = floor((span.start as usize).saturating_sub(CONTEXT)).max(line.start as usize);
        let label_start = (span.start as usize).clamp(start, line.end as usize);
        let end = floor((label_start + CONTEXT).min(line.end as usize)).max(label_start);
        let label_end = (span.end as usize).clamp(label_start, end);
        Some(Self {
            file: file.to_owned(),
            text: source.text().get(start..end)?.to_owned(),
            range: label_start - start..label_end - start,
            line: source.position(span.start).line,
            skipped: source.text().get(line.start as usize..start)?.chars().count(),
            message: message.to_owned(),
        })
    }
}

impl Excerpts {
    fn of(diagnostic: &Diagnostic, sources: &[&Source]) -> Self {
        let own = Excerpt::of(sources, &diagnostic.file, diagnostic.span, "");
        let related = diagnostic.related.as_ref();
        let related = related.and_then(|place| Excerpt::of(sources, &place.file, place.span, &place.message));
        Self(own.into_iter().chain(related).collect())
    }

    fn rendered(&self, diagnostic: &Diagnostic) -> codespan::Diagnostic<usize> {
        let severity = match diagnostic.severity {
            Severity::Warning => codespan::Severity::Warning,
            Severity::Error => codespan::Severity::Error,
        };
        let labels = self.0.iter().enumerate().map(|(id, excerpt)| {
            let style = if excerpt.message.is_empty() {
                codespan::LabelStyle::Primary
            } else {
                codespan::LabelStyle::Secondary
            };
            Label::new(style, id, excerpt.range.clone()).with_message(&excerpt.message)
        });
        let place = format!("{}:{}:{}", diagnostic.file, diagnostic.line, diagnostic.column);
        let notes = self.0.is_empty().then_some(format!("at {place}")).into_iter();
        let help = diagnostic.help.iter().map(|help| format!("help: {help}"));
        codespan::Diagnostic::new(severity)
            .with_code(diagnostic.code)
            .with_message(&diagnostic.message)
            .with_labels(labels.collect())
            .with_notes(notes.chain(help).collect())
    }
}

impl<'a> Files<'a> for Excerpts {
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

    fn line_range(&'a self, id: usize, _: usize) -> Result<std::ops::Range<usize>, FilesError> {
        self.0.get(id).map(|excerpt| 0..excerpt.text.len()).ok_or(FilesError::FileMissing)
    }
}
