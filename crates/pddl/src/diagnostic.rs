//! What is wrong with a file, and how it is shown: the source line, a caret, what would be right.
//!
//! Codes are stable. P100 to P119 are about the form of a file, P120 to P149 about names and types.

use std::error::Error;
use std::fmt;

use super::ast::Span;
use super::excerpt::{Excerpt, Shown};
use super::source::Source;

/// Everything that is wrong with PDDL files or a plan, warnings among it.
pub type Errors = diagnostics::Errors<Diagnostic>;

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The file can be used.
    Warning,
    /// The file cannot be used.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
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

impl fmt::Display for Diagnostic {
    /// One line: place, severity, code, message, and what would be right.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, column, severity, code, message, .. } = self;
        write!(f, "{file}:{line}:{column}: {severity}[{code}]: {message}")?;
        self.help.iter().try_for_each(|help| write!(f, " ({help})"))
    }
}

impl Error for Diagnostic {}

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

    /// The lines that it shows: its own, and that of its related place, as far as their files are among the sources.
    pub fn excerpts(&self, sources: &[&Source]) -> Vec<Excerpt> {
        let excerpt = |file: &str, span: Span, message: &str| {
            let source = sources.iter().find(|source| source.name() == file)?;
            let line = source.position(span.start).line;
            Excerpt::new(file, source.text(), line, span.start as usize..span.end as usize, message)
        };
        let own = excerpt(&self.file, self.span, "");
        let related = self.related.as_ref();
        let related = related.and_then(|place| excerpt(&place.file, place.span, &place.message));
        own.into_iter().chain(related).collect()
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
    let text = |diagnostic: &Diagnostic| {
        let place = format!("{}:{}:{}", diagnostic.file, diagnostic.line, diagnostic.column);
        let shown = Shown {
            is_error: diagnostic.severity == Severity::Error,
            code: diagnostic.code,
            message: &diagnostic.message,
            place: Some(&place),
            help: diagnostic.help.as_deref(),
            excerpts: &diagnostic.excerpts(sources),
        };
        shown.text(color)
    };
    diagnostics.iter().map(text).collect()
}
