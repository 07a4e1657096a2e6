//! Sources of a knowledge base: OWL documents and rule files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ontology::{Equality, Ontology, ReadOptions};
use rules::{Fact, Limits, Prefixes, Program, Rule, Symbols, Syntax};

use crate::file::{self, discreet, quoted};
use crate::knowledge::statement::Statements;
use crate::message::{Errors, Message};
use crate::planta::{self, Terms};

/// Name of the shipped co-adaptation rules.
pub const COADAPTATION: &str = "coadaptation";

/// Name of the shipped rules of the TOMASys metamodel.
pub const TOMASYS: &str = "tomasys";

/// Documents, rule files and limits of a knowledge base.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    /// Paths of OWL documents (`-` is standard input). Imports are followed.
    pub documents: Vec<PathBuf>,
    /// Rule files in SWRL's human-readable syntax; `coadaptation` and `tomasys` name the shipped ones.
    pub rules: Vec<String>,
    /// Resolution of imports.
    pub options: ReadOptions,
    /// Limits of inference, initially and for each update.
    pub limits: Limits,
}

impl Sources {
    /// Returns `true` if all sources can be read again, because none of them is standard input.
    pub fn are_repeatable(&self) -> bool {
        self.documents.iter().all(|document| document.as_os_str() != "-")
            && self.rules.iter().all(|rules| rules != "-")
    }
}

/// Contents of documents and rule files, before inference.
pub struct Stated {
    /// Interned names and values.
    pub symbols: Symbols,
    /// Rules and axioms.
    pub program: Program,
    /// Assertions.
    pub facts: Vec<Fact>,
    pub(super) ontology: Ontology,
    pub(super) rules: Vec<Rule>,
    pub(super) equality: Equality,
    /// Number of rules, see [`crate::knowledge::Knowledge::rule_count`].
    pub rule_count: usize,
    pub(super) warnings: Vec<Message>,
    /// Translation of the ontology to PDDL, if the documents were read for a domain in PLANTA's form.
    pub terms: Option<Arc<Terms>>,
}

impl Stated {
    /// Reads documents and rules, without inference.
    ///
    /// # Errors
    /// All errors of the sources.
    pub fn read(sources: &Sources, equality: Equality) -> Result<Self, Errors> {
        Self::of(
            ontology::read_files(&sources.documents, &sources.options),
            |symbols| parse_rule_files(&sources.rules, symbols),
            |_| (equality, None),
        )
    }

    /// Reads documents and rules for the text of a domain, without inference. A domain in PLANTA's
    /// form implies unique names, as in PDDL.
    ///
    /// # Errors
    /// All errors of the sources.
    pub fn read_for(sources: &Sources, domain: &str) -> Result<Self, Errors> {
        Self::of(
            ontology::read_files(&sources.documents, &sources.options),
            |symbols| parse_rule_files(&sources.rules, symbols),
            |ontology| meaning(ontology, domain),
        )
    }

    /// Reads one document and rules like [`Stated::read_for`], but from texts. Each text has a name for messages.
    ///
    /// # Errors
    /// All errors of the texts.
    pub fn of_texts(
        (name, document): (&str, &str),
        rules: &[(&str, &str)],
        options: &ReadOptions,
        domain: &str,
    ) -> Result<Self, Errors> {
        Self::of(
            ontology::read_text(document, name, options),
            |symbols| parse_rule_texts(rules, symbols).map_err(Errors::from),
            |ontology| meaning(ontology, domain),
        )
    }

    fn of(
        read: Result<Ontology, ontology::Errors>,
        parse: impl FnOnce(&mut Symbols) -> Result<Vec<Rule>, Errors>,
        meaning: impl FnOnce(&Ontology) -> (Equality, Option<Arc<Terms>>),
    ) -> Result<Self, Errors> {
        let mut errors = Vec::new();
        let mut symbols = Symbols::new();
        let mut rules_of_files = Vec::new();
        match parse(&mut symbols) {
            Ok(rules) => rules_of_files.extend(rules),
            Err(more) => errors.extend(more),
        }
        let ontology = match read {
            Ok(ontology) if errors.is_empty() => ontology,
            Ok(_) => return Err(errors.into()),
            Err(messages) => {
                let messages = messages.iter().map(Message::from_ontology).collect();
                errors.extend(quoted(discreet(messages)));
                return Err(errors.into());
            }
        };
        let rule_count = ontology.rules.len() + rules_of_files.len();
        let (equality, terms) = meaning(&ontology);
        let lowered = ontology::lower_together(&ontology, rules_of_files.clone(), equality, &mut symbols);
        let warnings =
            ontology.warnings.iter().chain(&lowered.warnings).map(Message::from_ontology_warning).collect();
        let (warnings, program, facts) = (quoted(warnings), lowered.program, lowered.facts);
        let rules = rules_of_files;
        Ok(Self { symbols, program, facts, ontology, rules, equality, rule_count, warnings, terms })
    }

    /// Adds and removes assertions as recorded in `statements`.
    pub fn change(&mut self, statements: &Statements) {
        let symbols = &mut self.symbols;
        let removed: BTreeSet<Fact> = statements.removed.iter().map(|own| own.intern(symbols)).collect();
        self.facts.retain(|fact| !removed.contains(fact));
        self.facts.extend(statements.added.iter().map(|own| own.intern(symbols)));
    }
}

fn meaning(ontology: &Ontology, domain: &str) -> (Equality, Option<Arc<Terms>>) {
    match planta::wanted(ontology, domain) {
        Some(terms) => (Equality::UncheckedUniqueNames, Some(Arc::new(terms))),
        None => (Equality::Owl, None),
    }
}

/// Returns the text of a rule file (`-` is standard input), or of shipped rules by their name.
///
/// # Errors
/// The file cannot be read.
pub fn rule_text(file: &str) -> Result<String, Message> {
    let text = match file {
        COADAPTATION => Ok(rules::COADAPTATION_RULES.to_owned()),
        TOMASYS => Ok(rules::TOMASYS_RULES.to_owned()),
        "-" => std::io::read_to_string(std::io::stdin()),
        path => file::read(Path::new(path)).and_then(|bytes| {
            String::from_utf8(bytes).map_err(|_| std::io::Error::other("it is not UTF-8 text"))
        }),
    };
    let text = text.map(|text| text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text));
    text.map_err(|error| Message::at("M101", file, None, format!("the file cannot be read: {error}")))
}

fn parse_rule_files(files: &[String], symbols: &mut Symbols) -> Result<Vec<Rule>, Errors> {
    let (mut texts, mut errors) = (Vec::new(), Vec::new());
    for file in files {
        match rule_text(file) {
            Ok(text) => texts.push((file, text)),
            Err(error) => errors.push(error),
        }
    }
    let texts: Vec<(&str, &str)> = texts.iter().map(|(file, text)| (file.as_str(), text.as_str())).collect();
    match parse_rule_texts(&texts, symbols) {
        Ok(rules) if errors.is_empty() => Ok(rules),
        Ok(_) => Err(errors.into()),
        Err(more) => Err(errors.into_iter().chain(more).collect()),
    }
}

/// Parses all rule texts together, because a rule may use conclusions of another text.
fn parse_rule_texts(texts: &[(&str, &str)], symbols: &mut Symbols) -> Result<Vec<Rule>, Vec<Message>> {
    let program = rules::parse_rules_together(texts, symbols, &Prefixes::default(), &Syntax::default());
    let quoted = |error: &rules::Error| {
        let message = Message::from_rules(error);
        let text = texts.iter().find(|(file, _)| message.file.as_deref() == Some(file));
        text.map_or(message.clone(), |(_, text)| message.with_source(text))
    };
    program.map(|program| program.rules).map_err(|errors| errors.iter().map(quoted).collect())
}
