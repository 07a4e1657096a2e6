//! What can be wrong with a knowledge base: [`Error`] where it cannot be used, [`Warning`] where reading goes on.
//!
//! Codes are stable: `O1xx` errors, `O2xx` warnings of reading, `O3xx` of lowering, `O4xx` about what the model says.

use std::fmt;
use std::path::PathBuf;

use crate::read::syntax::Syntax;

/// A place in a document: lines and columns count from 1, columns in characters.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// The document's path, or the name given for a text.
    pub file: String,
    /// Line, from 1.
    pub line: u64,
    /// Column, from 1.
    pub column: u64,
}

impl Position {
    /// The place `offset` bytes into `text`; the end of the text where it is shorter.
    pub(crate) fn of_offset(file: &str, text: &[u8], offset: usize) -> Self {
        let before = &text[..offset.min(text.len())];
        let start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |index| index + 1);
        Self {
            file: file.to_owned(),
            line: before.split(|&byte| byte == b'\n').count() as u64,
            column: String::from_utf8_lossy(&before[start..]).chars().count() as u64 + 1,
        }
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// Everything that is wrong with a knowledge base.
pub type Errors = diagnostics::Errors<Error>;

/// Why a knowledge base cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// O101: the file is not there or cannot be read.
    #[error("{}: error[O101]: the file cannot be read: {reason}", file.display())]
    Unreadable {
        /// The file asked for.
        file: PathBuf,
        /// What the operating system says.
        reason: String,
    },
    /// O102: the document breaks the grammar of its syntax.
    #[error("{position}: error[O102]: not well-formed {syntax}: {message}")]
    Malformed {
        /// Where.
        position: Position,
        /// The syntax that its content looks like.
        syntax: Syntax,
        /// What the parser says.
        message: String,
    },
    /// O113: the document is in no syntax that is read.
    #[error("{position}: error[O113]: this is {what}")]
    OtherSyntax {
        /// Its start.
        position: Position,
        /// What it looks like, and what would be right.
        what: &'static str,
    },
    /// O103: an import is found nowhere.
    #[error(
        "{}: error[O103]: cannot find the import <{import}>; name a directory that contains it \
         (--directory), or a catalog with <uri name=\"{import}\" uri=\"FILE\"/> (--catalog), or go on without it \
         (--ignore-missing-imports)", place(file, position.as_ref())
    )]
    UnresolvedImport {
        /// The document that imports.
        file: String,
        /// Where it names the import, unless the syntax spells it in another way there.
        position: Option<Position>,
        /// The IRI that it imports.
        import: String,
    },
    /// O104: a catalog cannot be read.
    #[error("{}: error[O104]: this is not a usable catalog: {reason}", file.display())]
    Catalog {
        /// The catalog.
        file: PathBuf,
        /// Why not.
        reason: String,
    },
    /// O105: the merged documents do not form an OWL ontology.
    #[error("{}: error[O105]: the documents do not form an OWL ontology: {reason}", place(file, position.as_ref()))]
    NotAnOntology {
        /// The first document.
        file: String,
        /// Where a document names what is wrong.
        position: Option<Position>,
        /// Why not.
        reason: String,
    },
    /// O112: expressions within expressions, more than the reader takes.
    #[error(
        "{}: error[O112]: expressions are nested more than {deepest} deep{}",
        place(file, position.as_ref()), about.as_ref().map_or_else(String::new, |iri| format!(", in what is said of <{iri}>"))
    )]
    TooDeep {
        /// The document.
        file: String,
        /// Of what the expression is said, where the syntax does not show the place.
        about: Option<String>,
        /// Where, if the syntax shows it.
        position: Option<Position>,
        /// How deep they may be.
        deepest: usize,
    },
    /// O106: a name that the knowledge base does not have.
    #[error("error[O106]: the knowledge base has no {kind} `{name}`; it has {}", listed(known))]
    Unknown {
        /// What was asked for.
        kind: &'static str,
        /// By this name.
        name: String,
        /// The names that there are, sorted.
        known: Vec<String>,
    },
    /// O107: a name that cannot be part of an IRI.
    #[error("error[O107]: `{name}` cannot name an individual: `{character}` is not allowed in an IRI")]
    BadName {
        /// The name.
        name: String,
        /// What is wrong with it.
        character: char,
    },
    /// O108: an individual that is there already.
    #[error("error[O108]: there is already an objective `{name}`")]
    Exists {
        /// Its name.
        name: String,
    },
    /// O110: a measurement that is not a number.
    #[error("error[O110]: the value `{value}` of {attribute} is not a number")]
    NotANumber {
        /// The attribute type.
        attribute: String,
        /// What was given as its value.
        value: String,
    },
    /// O111: a syntax that cannot say what the knowledge base says.
    #[error("error[O111]: cannot be written in {syntax}: {reason}")]
    Unwritable {
        /// The syntax.
        syntax: &'static str,
        /// Why not.
        reason: String,
    },
    /// O114: a retracted statement about an individual without a name.
    #[error(
        "error[O114]: {statement} cannot be retracted: an individual without a name is another one in each document"
    )]
    Nameless {
        /// The statement in functional-style syntax.
        statement: String,
    },
    /// O109: the engine cannot make the change.
    #[error("error[O109]: {0}")]
    Engine(#[from] rules::Error),
}

impl Error {
    /// The stable code, `O1xx`.
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

    /// The place in a document, where the error has one.
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

/// What was read differently from how it is written, or not at all. The rest of the knowledge base holds.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// O201: an entity is used and declared nowhere.
    #[error("{}warning[O201]: <{iri}> is declared nowhere; read as {kind} because of its use", before(position.as_ref()))]
    Undeclared {
        /// The entity.
        iri: String,
        /// What it was taken for.
        kind: &'static str,
        /// Where a document spells it for the first time, as far as the text shows that.
        position: Option<Position>,
    },
    /// O202: a statement that is not part of any OWL axiom or SWRL rule.
    #[error("warning[O202]: not read: {statement} ({reason})")]
    Unread {
        /// The statement or its subject.
        statement: String,
        /// Why not.
        reason: String,
    },
    /// O203: a rule that could not be read.
    #[error("warning[O203]: rule <{ontology}>#{position}{} is left out: {reason}", label_suffix(label.as_deref()))]
    UnreadRule {
        /// Ontology of the rule.
        ontology: String,
        /// Place among its rules, from 0.
        position: u32,
        /// The rule's label.
        label: Option<String>,
        /// Why.
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
        /// Ontology of the rule.
        ontology: String,
        /// Place among its rules, from 0.
        position: u32,
    },
    /// O205: two documents declare one ontology IRI.
    #[error("warning[O205]: {first} and {second} both declare the ontology <{iri}>; both are read")]
    SameOntologyTwice {
        /// The ontology IRI.
        iri: String,
        /// The document read first.
        first: String,
        /// The other.
        second: String,
    },
    /// O206: an import is found nowhere, and the reader was told to go on.
    #[error(
        "warning[O206]: {}: the import <{import}> is left out: found nowhere", place(file, position.as_ref())
    )]
    MissingImport {
        /// The document that imports.
        file: String,
        /// Where it names the import, unless the syntax spells it in another way there.
        position: Option<Position>,
        /// The IRI that it imports.
        import: String,
    },
    /// O207: a document takes away what is not stated.
    #[error(
        "warning[O207]: nothing states {statement}, so it cannot be retracted; what follows from other statements stays"
    )]
    NotStated {
        /// The statement in functional-style syntax.
        statement: String,
    },
    /// O208: a document that changes a knowledge base imports another one.
    #[error(
        "warning[O208]: {}: the import <{import}> is not followed, because the document changes a knowledge base; name \
         its file as a document of the knowledge base", place(file, position.as_ref())
    )]
    ImportOfUpdate {
        /// The document that imports.
        file: String,
        /// Where it names the import, unless the syntax spells it in another way there.
        position: Option<Position>,
        /// The IRI that it imports.
        import: String,
    },
    /// O301: an axiom outside the profile that is turned into rules.
    #[error(
        "warning[O301]: {axiom} is {} ({reason}); conclusions that need {} are not drawn",
        if *partly { "used in part" } else { "left out" }, if *partly { "the rest" } else { "it" }
    )]
    OutsideProfile {
        /// The axiom in functional-style syntax.
        axiom: String,
        /// Whether a part of it is used.
        partly: bool,
        /// What is not supported.
        reason: String,
    },
    /// O302: a rule that the engine cannot evaluate.
    #[error("warning[O302]: rule <{ontology}>#{position}{} is left out: {reason}", label_suffix(label.as_deref()))]
    UnusableRule {
        /// Ontology of the rule.
        ontology: String,
        /// Place among its rules, from 0.
        position: u32,
        /// The rule's label.
        label: Option<String>,
        /// Why.
        reason: String,
    },
    /// O303: a rule is disabled in the editor, and evaluated nevertheless.
    #[error("warning[O303]: rule <{ontology}>#{position}{} has isRuleEnabled false; it is evaluated all the same", label_suffix(label.as_deref()))]
    DisabledRule {
        /// Ontology of the rule.
        ontology: String,
        /// Place among its rules, from 0.
        position: u32,
        /// The rule's label.
        label: Option<String>,
    },
    /// O304: how much of the ontology lies outside the profile.
    #[error(
        "warning[O304]: {outside} of {axioms} axioms are not used in full, because they lie outside OWL 2 RL; what is \
         concluded is right, and other things may follow, too"
    )]
    Profile {
        /// Axioms that are left out, or used in part.
        outside: usize,
        /// All axioms.
        axioms: usize,
    },
    /// O401: a design that solves nothing.
    #[error("warning[O401]: the function design <{design}> solves no function, so it is never chosen")]
    DesignWithoutFunction {
        /// The design.
        design: String,
    },
    /// O402: a function that nothing solves.
    #[error(
        "warning[O402]: no function design solves the function <{function}>, so nothing that needs it can run"
    )]
    FunctionWithoutDesign {
        /// The function.
        function: String,
    },
    /// O403: a requirement that says no value.
    #[error("warning[O403]: the requirement <{requirement}> has no value, so everything meets it")]
    RequirementWithoutValue {
        /// The requirement.
        requirement: String,
    },
    /// O404: several stated values of a property that is declared functional.
    #[error(
        "warning[O404]: <{subject}> has {} values of <{property}>, which is functional: {}; {consequence}",
        values.len(), in_short(values)
    )]
    SeveralValues {
        /// The individual.
        subject: String,
        /// The functional property.
        property: String,
        /// The values, sorted, as N-Triples writes them.
        values: Vec<String>,
        /// What follows.
        consequence: &'static str,
    },
    /// O405: an attribute that designs compare with a measurement that does not exist.
    #[error(
        "warning[O405]: <{attribute}> is compared with what is measured, and nothing has been; until then no design is \
         ruled out by it"
    )]
    NothingMeasured {
        /// The attribute type.
        attribute: String,
    },
    /// O406: a status of another datatype than the knowledge base asks for.
    #[error(
        "warning[O406]: <{subject}> has the status {value} of <{property}>, of which {expected} is expected; rules do \
         not see it"
    )]
    StatusDatatype {
        /// The individual.
        subject: String,
        /// The status property.
        property: String,
        /// The value, as N-Triples writes it.
        value: String,
        /// What the property's range or the rules ask for.
        expected: &'static str,
    },
}

/// The position with a colon, if there is one.
fn before(position: Option<&Position>) -> String {
    position.map_or_else(String::new, |position| format!("{position}: "))
}

/// The position, or else the file.
fn place(file: &str, position: Option<&Position>) -> String {
    position.map_or_else(|| file.to_owned(), ToString::to_string)
}

impl Warning {
    /// The stable code, `O2xx` or `O3xx`.
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

fn listed(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn label_suffix(label: Option<&str>) -> String {
    label.map_or_else(String::new, |label| format!(" ({label})"))
}

/// The first of many values.
fn in_short(values: &[String]) -> String {
    match values.get(..MOST_VALUES).filter(|_| values.len() > MOST_VALUES + 1) {
        Some(first) => format!("{} and {} more", first.join(", "), values.len() - MOST_VALUES),
        None => values.join(", "),
    }
}

/// So many values are listed in a message.
const MOST_VALUES: usize = 10;
