//! What a knowledge base is read from: documents and rule files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ontology::{Equality, Ontology, ReadOptions};
use rules::{Fact, Limits, Prefixes, Program, Rule, Symbols, Syntax};

use crate::file::{self, discreet, quoted};
use crate::knowledge::statement::Statements;
use crate::message::{Errors, Message};
use crate::planta::{self, Terms};

/// The name under which the shipped co-adaptation rules are asked for.
pub const COADAPTATION: &str = "coadaptation";

/// The name under which the shipped rules of the TOMASys metamodel are asked for.
pub const TOMASYS: &str = "tomasys";

/// What an engine is built from.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    /// OWL documents (`-` is standard input); their imports are followed.
    pub documents: Vec<PathBuf>,
    /// Rule files in SWRL's human-readable syntax; `coadaptation` and `tomasys` name the shipped ones.
    pub rules: Vec<String>,
    /// Where imports are looked for.
    pub options: ReadOptions,
    /// How far conclusions are drawn, at once and after each update.
    pub limits: Limits,
}

/// What documents and rule files say, before anything is concluded.
pub struct Stated {
    /// Names and values.
    pub symbols: Symbols,
    /// Rules and axioms.
    pub program: Program,
    /// Assertions.
    pub facts: Vec<Fact>,
    pub(super) ontology: Ontology,
    /// The rules of rule files.
    pub(super) rules: Vec<Rule>,
    pub(super) equality: Equality,
    /// As [`crate::knowledge::Knowledge::rule_count`] has it.
    pub rule_count: usize,
    pub(super) warnings: Vec<Message>,
    /// What the documents add to a domain in PLANTA's form, if they were read for one.
    pub terms: Option<Arc<Terms>>,
}

impl Stated {
    /// Reads documents and rules.
    ///
    /// # Errors
    /// All that is wrong with them.
    pub fn read(sources: &Sources, equality: Equality) -> Result<Self, Errors> {
        Self::read_with(sources, |_| (equality, None))
    }

    /// As [`Stated::read`], for a domain. If it is in PLANTA's form, every name is an individual of its own, as in PDDL.
    ///
    /// # Errors
    /// As [`Stated::read`].
    pub fn read_for(sources: &Sources, domain: &str) -> Result<Self, Errors> {
        Self::read_with(sources, |ontology| match planta::wanted(ontology, domain) {
            Some(terms) => (Equality::UniqueNames, Some(Arc::new(terms))),
            None => (Equality::Owl, None),
        })
    }

    fn read_with(
        sources: &Sources,
        meaning: impl FnOnce(&Ontology) -> (Equality, Option<Arc<Terms>>),
    ) -> Result<Self, Errors> {
        let read = ontology::read_files(&sources.documents, &sources.options);
        let mut errors = Vec::new();
        let mut symbols = Symbols::new();
        let mut own = Vec::new();
        match parse_rule_files(&sources.rules, &mut symbols) {
            Ok(rules) => own.extend(rules),
            Err(more) => errors.extend(more),
        }
        let ontology = match read {
            Ok(ontology) if errors.is_empty() => ontology,
            Ok(_) => return Err(errors.into()),
            Err(more) => {
                let more = more.iter().map(Message::from_ontology).collect();
                errors.extend(quoted(discreet(more)));
                return Err(errors.into());
            }
        };
        let rule_count = ontology.rules.len() + own.len();
        let (equality, terms) = meaning(&ontology);
        let lowered = ontology::lower_together(&ontology, own.clone(), equality, &mut symbols);
        let warnings =
            ontology.warnings.iter().chain(&lowered.warnings).map(Message::from_ontology_warning).collect();
        let (warnings, program, facts) = (quoted(warnings), lowered.program, lowered.facts);
        let rules = own;
        Ok(Self { symbols, program, facts, ontology, rules, equality, rule_count, warnings, terms })
    }

    /// Changes what is stated.
    pub fn change(&mut self, statements: &Statements) {
        let symbols = &mut self.symbols;
        let removed: BTreeSet<Fact> = statements.removed.iter().map(|own| own.intern(symbols)).collect();
        self.facts.retain(|fact| !removed.contains(fact));
        self.facts.extend(statements.added.iter().map(|own| own.intern(symbols)));
    }
}

/// The text of a rule file, or of shipped rules by their name.
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

/// The rules of all files. What one file asks for, another may conclude.
fn parse_rule_files(files: &[String], symbols: &mut Symbols) -> Result<Vec<Rule>, Errors> {
    let (mut texts, mut errors) = (Vec::new(), Vec::new());
    for file in files {
        match rule_text(file) {
            Ok(text) => texts.push((file, text)),
            Err(error) => errors.push(error),
        }
    }
    let texts: Vec<(&str, &str)> = texts.iter().map(|(file, text)| (file.as_str(), text.as_str())).collect();
    match rules::parse_rules_together(&texts, symbols, &Prefixes::default(), &Syntax::default()) {
        Ok(program) if errors.is_empty() => Ok(program.rules),
        Ok(_) => Err(errors.into()),
        Err(more) => {
            let quoted = |error: &rules::Error| {
                let message = Message::from_rules(error);
                let text = texts.iter().find(|(file, _)| message.file.as_deref() == Some(file));
                text.map_or(message.clone(), |(_, text)| message.with_source(text))
            };
            Err(errors.into_iter().chain(more.iter().map(quoted)).collect())
        }
    }
}
