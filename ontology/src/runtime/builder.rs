//! Builds a [`Runtime`] from documents and rules.

use std::path::PathBuf;

use rules::{Engine, Limits, Prefixes, Symbols, Syntax, parse_rules_together};

use crate::error::{Error, Errors, Warning};
use crate::lower::{Equality, lower_together};
use crate::read::{ReadOptions, read_files};
use crate::runtime::knowledge::{Mode, Runtime};

/// Builder of a [`Runtime`]; see [`Runtime::builder`].
///
/// ```
/// use ontology::runtime::Runtime;
/// use ontology::tomasys::change::Status;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (mut runtime, warnings) =
///     Runtime::builder().file("kb/ugv.ttl").rules("coadaptation", rules::COADAPTATION_RULES).build()?;
/// assert!(warnings.is_empty());
/// assert!(runtime.view().function_designs().iter().all(|design| design.available));
///
/// runtime.report_component("c_kinect", Status::Failed)?;
/// let designs = runtime.view().function_designs();
/// let lost = designs.iter().filter(|design| !design.available).map(|design| &design.individual.name);
/// assert_eq!(lost.collect::<Vec<_>>(), ["fd_amcl_kinect", "fd_mrpt_kinect"]);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Default)]
pub struct RuntimeBuilder {
    files: Vec<PathBuf>,
    options: ReadOptions,
    rules: Vec<(String, String)>,
    equality: Equality,
    mode: Mode,
    limits: Limits,
}

impl RuntimeBuilder {
    /// Adds a document in any supported syntax; its imports are read, too.
    #[must_use]
    pub fn file(mut self, file: impl Into<PathBuf>) -> Self {
        self.files.push(file.into());
        self
    }

    /// Sets the options of the reader.
    #[must_use]
    pub fn options(self, options: ReadOptions) -> Self {
        Self { options, ..self }
    }

    /// Adds rules in SWRL's human-readable syntax to the rules of the documents. Errors name the text `source`.
    /// Rules of one text can use conclusions of another text.
    #[must_use]
    pub fn rules(mut self, source: &str, text: &str) -> Self {
        self.rules.push((source.to_owned(), text.to_owned()));
        self
    }

    /// Sets the semantics of names. Default: OWL, where two names can denote the same individual.
    #[must_use]
    pub fn equality(self, equality: Equality) -> Self {
        Self { equality, ..self }
    }

    /// Sets the treatment of derived facts whose premises no longer hold. Default: [`Mode::Retract`].
    #[must_use]
    pub fn mode(self, mode: Mode) -> Self {
        Self { mode, ..self }
    }

    /// Sets the limits of the initial derivation and of each update.
    #[must_use]
    pub fn limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// Reads all documents and rules, and derives the consequences. Returns the runtime and the
    /// warnings.
    ///
    /// # Errors
    /// Returns the errors of the documents and rules: the errors of [`read_files`], and [`Error::Engine`] for errors
    /// of rules and of the engine.
    pub fn build(self) -> Result<(Runtime, Vec<Warning>), Errors> {
        let mut symbols = Symbols::new();
        let texts: Vec<(&str, &str)> =
            self.rules.iter().map(|(source, text)| (source.as_str(), text.as_str())).collect();
        let rules = parse_rules_together(&texts, &mut symbols, &Prefixes::default(), &Syntax::default());
        let read = read_files(&self.files, &self.options);
        let (ontology, rules) = match (read, rules) {
            (Ok(ontology), Ok(rules)) => (ontology, rules),
            (read, rules) => {
                let rule_errors = rules.err().into_iter().flatten().map(Error::Engine);
                return Err(read.err().into_iter().flatten().chain(rule_errors).collect());
            }
        };
        let lowered = lower_together(&ontology, rules.rules, self.equality, &mut symbols);
        let engine = Engine::with_limits(symbols, lowered.program, lowered.facts, self.limits)
            .map_err(|errors| errors.map(Error::Engine))?;
        let warnings = ontology.warnings.into_iter().chain(lowered.warnings).collect();
        Ok((Runtime::new(engine, self.mode), warnings))
    }
}

impl Runtime {
    /// Starts building a runtime from documents and rules.
    pub fn builder() -> RuntimeBuilder {
        RuntimeBuilder::default()
    }
}
