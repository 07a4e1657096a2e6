//! Diagnostics and their display: the source line, a caret, and a suggested correction.
//!
//! Codes are stable. P100 to P119 mostly concern the form of a file, P120 to P149 mostly names and types, and P150
//! the text of a plan.

use std::error::Error;
use std::fmt;

use super::ast::Span;
use super::excerpt::{Excerpt, Shown};
use super::source::Source;

/// Diagnostics about PDDL files or a plan, including warnings.
pub type Errors = diagnostics::Errors<Diagnostic>;

/// Severity of a diagnostic.
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
    /// Returns `error` or `warning`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Error or warning at a position of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable code, for example `P121`.
    pub code: &'static str,
    /// Severity: error or warning.
    pub severity: Severity,
    /// Description of the problem: one sentence without full stop.
    pub message: String,
    /// Name of the source.
    pub file: String,
    /// Extent, in bytes.
    pub span: Span,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Suggested correction.
    pub help: Option<String>,
    /// Related position, for example an earlier declaration.
    pub related: Option<Related>,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, column, severity, code, message, .. } = self;
        write!(f, "{file}:{line}:{column}: {severity}[{code}]: {message}")?;
        self.help.iter().try_for_each(|help| write!(f, " ({help})"))
    }
}

impl Error for Diagnostic {}

/// Related position of a diagnostic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Related {
    /// Description of the related position.
    pub message: String,
    /// Name of the source.
    pub file: String,
    /// Extent, in bytes.
    pub span: Span,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Diagnostic {
    /// Creates a diagnostic at `span` of `source`.
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

    /// Returns the excerpts to display: the line of the diagnostic, and the line of its related position if
    /// it has one. A position in a file that is not among `sources` gives no excerpt.
    pub fn excerpts(&self, sources: &[&Source]) -> Vec<Excerpt> {
        let excerpt = |file: &str, span: Span, message: &str| {
            let source = sources.iter().find(|source| source.name() == file)?;
            let line = source.position(span.start).line;
            Excerpt::new(file, source.text(), line, span.start as usize..span.end as usize, message)
        };
        let primary = excerpt(&self.file, self.span, "");
        let related = self.related.as_ref();
        let related = related.and_then(|place| excerpt(&place.file, place.span, &place.message));
        primary.into_iter().chain(related).collect()
    }

    pub(crate) fn help(&mut self, help: impl Into<String>) -> &mut Self {
        self.help = Some(help.into());
        self
    }

    /// Adds a related position, unless the span is empty because no file has it.
    pub(crate) fn related(&mut self, source: &Source, span: Span, message: impl Into<String>) -> &mut Self {
        if span == Span::default() {
            return self;
        }
        let place = source.position(span.start);
        let file = source.name().to_owned();
        self.related =
            Some(Related { message: message.into(), file, span, line: place.line, column: place.column });
        self
    }
}

/// Maximum number of diagnostics of one pass (parsing or checking) over one file. If there is exactly one more,
/// it is reported, too. If there are more, the message P119 with their number replaces them. Otherwise a file in
/// another language would produce very many diagnostics.
const MAX_DIAGNOSTICS: usize = 200;

#[derive(Debug)]
pub(crate) struct Sink<'s> {
    source: &'s Source,
    diagnostics: Vec<Diagnostic>,
    beyond_limit: usize,
    /// `true` if a diagnostic that was only counted is an error.
    omits_error: bool,
}

impl<'s> Sink<'s> {
    pub(crate) fn new(source: &'s Source) -> Self {
        Self { source, diagnostics: Vec::new(), beyond_limit: 0, omits_error: false }
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
        // Beyond the limit, diagnostics are only counted. The caller gets the last stored one, which `finish`
        // replaces by P119.
        let index = self.diagnostics.len().min(MAX_DIAGNOSTICS);
        if self.is_full() {
            self.beyond_limit += 1;
            self.omits_error |= severity == Severity::Error;
            return &mut self.diagnostics[index];
        }
        self.diagnostics.push(Diagnostic::new(self.source, span, severity, code, message));
        &mut self.diagnostics[index]
    }

    pub(crate) fn source(&self) -> &'s Source {
        self.source
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(crate) fn len(&self) -> usize {
        self.diagnostics.len() + self.beyond_limit
    }

    /// Returns `true` if further diagnostics are only counted, so that suggestions for them need not be computed.
    pub(crate) fn is_full(&self) -> bool {
        self.diagnostics.len() > MAX_DIAGNOSTICS
    }

    pub(crate) fn has_errors(&self) -> bool {
        self.omits_error || has_errors(&self.diagnostics)
    }

    /// Returns the collected diagnostics, sorted by position and without successive duplicates. If
    /// some were only counted, P119 with the number of missing diagnostics replaces the last stored one. P119 is a
    /// warning if all missing diagnostics are warnings.
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(crate) fn finish(mut self) -> Vec<Diagnostic> {
        if let (Some(last), true) = (self.diagnostics.get_mut(MAX_DIAGNOSTICS), self.beyond_limit > 0) {
            let severity = if self.omits_error { Severity::Error } else { last.severity };
            *last = Diagnostic::new(
                self.source,
                last.span,
                severity,
                "P119",
                format!("{} more messages about this file are not shown", self.beyond_limit + 1),
            );
        }
        // The checks run by kind of declaration, but readers work through a file by position.
        self.diagnostics.sort_by_key(|diagnostic| (diagnostic.span.start, diagnostic.code));
        // Constructs that are compiled to several forms are checked in each form.
        self.diagnostics.dedup();
        self.diagnostics
    }
}

/// Returns `true` if at least one diagnostic is an error.
pub fn has_errors(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error)
}

/// Formats diagnostics for a terminal, with ANSI escapes if `color` is set. A diagnostic whose file is not
/// among `sources` has no source line.
pub fn render(diagnostics: &[Diagnostic], sources: &[&Source], color: bool) -> String {
    let text = |diagnostic: &Diagnostic| {
        let place = format!("{}:{}:{}", diagnostic.file, diagnostic.line, diagnostic.column);
        let message = Shown {
            is_error: diagnostic.severity == Severity::Error,
            code: diagnostic.code,
            message: &diagnostic.message,
            place: Some(&place),
            help: diagnostic.help.as_deref(),
            excerpts: &diagnostic.excerpts(sources),
        };
        message.text(color)
    };
    diagnostics.iter().map(text).collect()
}
