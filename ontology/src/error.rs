//! Problems of a knowledge base and of requests to it: an [`Error`] ends the operation, a [`Warning`] does not.
//!
//! Codes are stable: `O1xx` for errors, `O2xx` for warnings of the reader, `O3xx` for warnings of lowering,
//! `O4xx` for warnings about the TOMASys model.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::read::syntax::Syntax;

/// A place in a document. Lines and columns count from 1, columns in characters.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Path of the document, or the name given for a text.
    pub file: String,
    /// Line, from 1.
    pub line: u64,
    /// Column, from 1.
    pub column: u64,
}

impl Position {
    pub(crate) fn of_offset(file: &str, text: &[u8], offset: usize) -> Self {
        let before = &text[..offset.min(text.len())];
        let start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |index| index + 1);
        Self {
            file: file.to_owned(),
            line: before.split(|&byte| byte == b'\n').count() as u64,
            // Columns count characters, and the offset may be inside of a character.
            column: String::from_utf8_lossy(&before[start..]).chars().count() as u64 + 1,
        }
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// Errors of a knowledge base.
pub type Errors = diagnostics::Errors<Error>;

/// The reason why a knowledge base cannot be read, or a request to it is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// O101: a file is missing or unreadable.
    #[error("{}: error[O101]: the file cannot be read: {reason}", file.display())]
    Unreadable {
        /// Path of the file.
        file: PathBuf,
        /// Cause, usually a message of the operating system.
        reason: String,
    },
    /// O102: a document is not well-formed.
    #[error("{position}: error[O102]: not well-formed {syntax}: {message}")]
    Malformed {
        /// Position of the syntax error.
        position: Position,
        /// Syntax as which the document was parsed; RDF/XML if its encoding is invalid.
        syntax: Syntax,
        /// Message of the parser.
        message: String,
    },
    /// O113: a document has an unsupported syntax.
    #[error("{position}: error[O113]: this is {what}")]
    OtherSyntax {
        /// Start of the document.
        position: Position,
        /// Detected syntax and a suggestion.
        what: &'static str,
    },
    /// O103: an import is not found.
    #[error(
        "{}: error[O103]: cannot find the import <{import}>; {}, or continue without it \
         (--ignore-missing-imports)", place(file, position.as_ref()), import_remedy(import, target.as_deref())
    )]
    UnresolvedImport {
        /// The importing document.
        file: String,
        /// First occurrence of the imported IRI, if the document contains the IRI literally.
        position: Option<Position>,
        /// The imported IRI.
        import: String,
        /// The missing file that a catalog assigns to the IRI.
        target: Option<PathBuf>,
    },
    /// O104: a catalog is unreadable or malformed.
    #[error("{}: error[O104]: this is not a usable catalog: {reason}", file.display())]
    Catalog {
        /// Path of the catalog.
        file: PathBuf,
        /// Cause of the failure.
        reason: String,
    },
    /// O105: the merged documents do not form an OWL ontology.
    #[error("{}: error[O105]: the documents do not form an OWL ontology: {reason}", place(file, position.as_ref()))]
    NotAnOntology {
        /// First of the merged documents.
        file: String,
        /// Position of an IRI that `reason` mentions, if found.
        position: Option<Position>,
        /// Description of the fault.
        reason: String,
    },
    /// O112: expressions are nested more deeply than the reader accepts.
    #[error(
        "{}: error[O112]: expressions are nested more than {deepest} deep{}",
        place(file, position.as_ref()),
        about.as_ref().map_or_else(String::new, |iri| format!(", in statements about <{iri}>"))
    )]
    TooDeep {
        /// The document.
        file: String,
        /// IRI of the subject of the nested statements, if found.
        about: Option<String>,
        /// Position of the nesting, or of an occurrence of the IRI `about`, if found.
        position: Option<Position>,
        /// Maximum nesting depth.
        deepest: usize,
    },
    /// O106: a name is not in the knowledge base.
    #[error("error[O106]: the knowledge base has no {kind} `{name}`; it has {}", listed(known))]
    Unknown {
        /// Kind of the entity, for example `component`.
        kind: &'static str,
        /// The unknown name.
        name: String,
        /// Existing names of this kind, sorted.
        known: Vec<String>,
    },
    /// O107: a name cannot be part of an IRI.
    #[error("error[O107]: `{name}` cannot name an individual: `{character}` is not allowed in an IRI")]
    BadName {
        /// The rejected name.
        name: String,
        /// The first character that IRIs do not allow.
        character: char,
    },
    /// O108: an objective with this name exists.
    #[error("error[O108]: there is already an objective `{name}`")]
    Exists {
        /// Name of the existing objective.
        name: String,
    },
    /// O110: a measured value is not a number.
    #[error("error[O110]: the value `{value}` of {attribute} is not a number")]
    NotANumber {
        /// The attribute type, as named by the caller.
        attribute: String,
        /// The rejected value.
        value: String,
    },
    /// O111: the output syntax cannot express the knowledge base, or the input of [`crate::turtle`] is not N-Triples.
    #[error("error[O111]: cannot be written in {syntax}: {reason}")]
    Unwritable {
        /// The output syntax.
        syntax: &'static str,
        /// Cause, usually the statement that the syntax cannot express.
        reason: String,
    },
    /// O114: a retracted statement has an anonymous individual.
    #[error(
        "error[O114]: {statement} cannot be retracted: an individual without a name is a different one in each document"
    )]
    Nameless {
        /// The axiom in functional-style syntax, or the rule in SWRL's human-readable syntax.
        statement: String,
    },
    /// O109: an error of the rules or of the rule engine.
    #[error("error[O109]: {0}")]
    Engine(#[from] rules::Error),
}

impl Error {
    /// Returns the stable code of the error, `O1xx`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "O101",
            Self::Malformed { .. } => "O102",
            Self::OtherSyntax { .. } => "O113",
            Self::UnresolvedImport { .. } => "O103",
            Self::Catalog { .. } => "O104",
            Self::NotAnOntology { .. } => "O105",
            Self::Unknown { .. } => "O106",
            Self::BadName { .. } => "O107",
            Self::Exists { .. } => "O108",
            Self::Nameless { .. } => "O114",
            Self::Engine(_) => "O109",
            Self::NotANumber { .. } => "O110",
            Self::TooDeep { .. } => "O112",
            Self::Unwritable { .. } => "O111",
        }
    }

    /// Returns the position in a document, if the error has one.
    pub fn position(&self) -> Option<&Position> {
        match self {
            Self::Malformed { position, .. } | Self::OtherSyntax { position, .. } => Some(position),
            Self::UnresolvedImport { position, .. }
            | Self::TooDeep { position, .. }
            | Self::NotAnOntology { position, .. } => position.as_ref(),
            _ => None,
        }
    }
}

/// A problem that does not prevent the use of a knowledge base: for example a statement that was not read or was
/// read in another way than it is written, an import that was not followed, or a questionable part of the model.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// O201: an entity is used without a declaration.
    #[error("{}warning[O201]: <{iri}> is not declared; read as {kind} because of its use", before(position.as_ref()))]
    Undeclared {
        /// IRI of the entity.
        iri: String,
        /// Kind inferred from the use of the entity.
        kind: &'static str,
        /// Position of the first occurrence of the whole IRI, or of its local name after `:` or `#`. The occurrence can
        /// belong to another prefix. `None` if no document contains either, or if this warning is not among the first
        /// 100.
        position: Option<Position>,
    },
    /// O202: a statement that is not read, usually because it is not part of any OWL axiom or SWRL rule.
    #[error("warning[O202]: not read: {statement} ({reason})")]
    Unread {
        /// The statement or its subject.
        statement: String,
        /// Reason why the statement is not read.
        reason: String,
    },
    /// O203: a rule could not be read.
    #[error("warning[O203]: rule <{ontology}>#{position}{} is left out: {reason}", label_suffix(label.as_deref()))]
    UnreadRule {
        /// IRI of the ontology of the rule, or the name of a document or text without one.
        ontology: String,
        /// Index of the rule in its document, from 0.
        position: u32,
        /// Label of the rule.
        label: Option<String>,
        /// Cause of the failure.
        reason: String,
    },
    /// O204: a rule argument that is neither a declared variable nor a known individual.
    #[error(
        "warning[O204]: <{iri}> in rule <{ontology}>#{position} is neither a declared variable nor an individual \
         of the knowledge base; read as an individual"
    )]
    UnknownArgument {
        /// The argument.
        iri: String,
        /// IRI of the ontology of the rule, or the name of a document or text without one.
        ontology: String,
        /// Index of the rule in its document, from 0.
        position: u32,
    },
    /// O205: two documents declare one ontology IRI, with the same version IRI or both without one.
    #[error("warning[O205]: {first} and {second} both declare the ontology <{iri}>; both are read")]
    SameOntologyTwice {
        /// The ontology IRI.
        iri: String,
        /// The document read first.
        first: String,
        /// The document read second.
        second: String,
    },
    /// O206: an import is not found, and `allow_missing_imports` is set.
    #[error(
        "warning[O206]: {}: the import <{import}> is left out: not found", place(file, position.as_ref())
    )]
    MissingImport {
        /// The importing document.
        file: String,
        /// First occurrence of the imported IRI, if the document contains the IRI literally.
        position: Option<Position>,
        /// The imported IRI.
        import: String,
    },
    /// O207: a document retracts a statement that is not stated.
    #[error(
        "warning[O207]: the knowledge base has no statement {statement} that could be retracted; what other statements \
         say or imply remains"
    )]
    NotStated {
        /// The axiom in functional-style syntax, or the rule in SWRL's human-readable syntax.
        statement: String,
    },
    /// O208: a document that changes a knowledge base has an import.
    #[error(
        "warning[O208]: {}: the import <{import}> is not followed, because the document changes a knowledge base; name \
         its file as a document of the knowledge base", place(file, position.as_ref())
    )]
    ImportOfUpdate {
        /// The importing document.
        file: String,
        /// First occurrence of the imported IRI, if the document contains the IRI literally.
        position: Option<Position>,
        /// The imported IRI.
        import: String,
    },
    /// O301: an axiom, or a part of it, is not used, usually because it is outside the OWL 2 RL profile.
    #[error(
        "warning[O301]: {axiom} is {} ({reason}); conclusions that need {} are not drawn",
        if *partly { "used in part" } else { "left out" }, if *partly { "the rest" } else { "it" }
    )]
    OutsideProfile {
        /// The axiom in functional-style syntax, or a description of the omitted rules.
        axiom: String,
        /// `true` if a part of the axiom is used, `false` if nothing of it is.
        partly: bool,
        /// The unsupported construct.
        reason: String,
    },
    /// O302: a rule cannot be evaluated.
    #[error("warning[O302]: rule <{ontology}>#{position}{} is left out: {reason}", label_suffix(label.as_deref()))]
    UnusableRule {
        /// IRI of the ontology of the rule, or the name of a document or text without one.
        ontology: String,
        /// Index of the rule in its document, from 0.
        position: u32,
        /// Label of the rule.
        label: Option<String>,
        /// Reason why the rule is omitted.
        reason: String,
    },
    /// O303: a rule is disabled in the editor, but evaluated.
    #[error("warning[O303]: rule <{ontology}>#{position}{} has isRuleEnabled false; it is evaluated \
             nevertheless", label_suffix(label.as_deref()))]
    DisabledRule {
        /// IRI of the ontology of the rule, or the name of a document or text without one.
        ontology: String,
        /// Index of the rule in its document, from 0.
        position: u32,
        /// Label of the rule.
        label: Option<String>,
    },
    /// O304: summary of the axioms outside the OWL 2 RL profile.
    #[error(
        "warning[O304]: {outside} of {axioms} axioms are not used in full, because they lie outside OWL 2 RL; all \
         conclusions are sound, but some may be missing"
    )]
    Profile {
        /// Number of axioms that are omitted or used in part.
        outside: usize,
        /// Number of all axioms.
        axioms: usize,
    },
    /// O401: a design solves no function.
    #[error("warning[O401]: the function design <{design}> solves no function, so it is never chosen")]
    DesignWithoutFunction {
        /// IRI of the design.
        design: String,
    },
    /// O402: a function is solved by no design.
    #[error(
        "warning[O402]: no function design solves the function <{function}>, so nothing that needs it can run"
    )]
    FunctionWithoutDesign {
        /// IRI of the function.
        function: String,
    },
    /// O403: a requirement has no value.
    #[error("warning[O403]: the requirement <{requirement}> has no value, so everything meets it")]
    RequirementWithoutValue {
        /// IRI of the requirement.
        requirement: String,
    },
    /// O404: a functional property has several stated values.
    #[error(
        "warning[O404]: <{subject}> has {} values of <{property}>, which is functional: {}; {consequence}",
        values.len(), abbreviated(values)
    )]
    SeveralValues {
        /// IRI of the individual.
        subject: String,
        /// IRI of the property.
        property: String,
        /// The values in N-Triples syntax, sorted.
        values: Vec<String>,
        /// Consequence of the several values.
        consequence: &'static str,
    },
    /// O405: designs compare an attribute with a measurement that does not exist.
    #[error(
        "warning[O405]: <{attribute}> is compared with a measured value, but has none; until it has one, it rules out \
         no design"
    )]
    NothingMeasured {
        /// IRI of the attribute type.
        attribute: String,
    },
    /// O406: a status has an unexpected datatype.
    #[error(
        "warning[O406]: <{subject}> has the status {value} of <{property}>, of which {expected} is expected; rules \
         ignore it"
    )]
    StatusDatatype {
        /// IRI of the individual.
        subject: String,
        /// IRI of the status property.
        property: String,
        /// The value in N-Triples syntax.
        value: String,
        /// Datatype that the property's range or the rules expect.
        expected: &'static str,
    },
}

fn before(position: Option<&Position>) -> String {
    position.map_or_else(String::new, |position| format!("{position}: "))
}

fn place(file: &str, position: Option<&Position>) -> String {
    position.map_or_else(|| file.to_owned(), ToString::to_string)
}

impl Warning {
    /// Returns the stable code of the warning, `O2xx` to `O4xx`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Undeclared { .. } => "O201",
            Self::Unread { .. } => "O202",
            Self::UnreadRule { .. } => "O203",
            Self::UnknownArgument { .. } => "O204",
            Self::SameOntologyTwice { .. } => "O205",
            Self::MissingImport { .. } => "O206",
            Self::NotStated { .. } => "O207",
            Self::ImportOfUpdate { .. } => "O208",
            Self::OutsideProfile { .. } => "O301",
            Self::UnusableRule { .. } => "O302",
            Self::DisabledRule { .. } => "O303",
            Self::Profile { .. } => "O304",
            Self::DesignWithoutFunction { .. } => "O401",
            Self::FunctionWithoutDesign { .. } => "O402",
            Self::RequirementWithoutValue { .. } => "O403",
            Self::SeveralValues { .. } => "O404",
            Self::NothingMeasured { .. } => "O405",
            Self::StatusDatatype { .. } => "O406",
        }
    }
}

fn import_remedy(import: &str, target: Option<&Path>) -> String {
    match target {
        Some(file) => format!(
            "a catalog assigns it to {}, which is not a file; correct the catalog, or name a directory that contains \
             the import (--directory)",
            file.display()
        ),
        None => format!(
            "name a directory that contains it (--directory), or a catalog with <uri name=\"{import}\" \
             uri=\"FILE\"/> (--catalog)"
        ),
    }
}

fn listed(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn label_suffix(label: Option<&str>) -> String {
    label.map_or_else(String::new, |label| format!(" ({label})"))
}

fn abbreviated(values: &[String]) -> String {
    match values.get(..MAX_LISTED_VALUES).filter(|_| values.len() > MAX_LISTED_VALUES + 1) {
        Some(first) => format!("{} and {} more", first.join(", "), values.len() - MAX_LISTED_VALUES),
        None => values.join(", "),
    }
}

const MAX_LISTED_VALUES: usize = 10;
