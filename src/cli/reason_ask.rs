//! Queries of `metaplan reason`: entailment of statements, derivations of facts, reasons for
//! missing facts, and the inferred hierarchies of classes and properties.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;

use crate::answers::{AssertionAnswer, EntailmentAnswer, ReasonsAnswer, SchemaAnswer};
use crate::knowledge::Knowledge;
use crate::message::Message;
use crate::visible::visible_json;
use clap::Args;
use ontology::entail::{Answer, Schema, annotations, entailments, schema, tautology};
use ontology::vocab::{local_name, rdf};
use rules::{Atom, Engine, Fact, Literal, Symbol, Term, Value};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::output;
use crate::cli::situation::Imports;

/// Questions; at most one kind at a time.
#[derive(Debug, Args)]
pub struct Questions {
    /// Check whether the statements of a document are entailed, and explain why. Rules and definitions of datatypes
    /// are not checked, and ranges that enumerate literals are not shown (repeatable).
    #[arg(long, value_name = "FILE", group = "question")]
    entails: Vec<PathBuf>,
    /// Show the inferred hierarchies of classes and properties, and empty classes and properties.
    #[arg(long, group = "question")]
    schema: bool,
    /// Explain why an assertion holds: `SUBJECT PROPERTY VALUE` or `SUBJECT a CLASS`. Local names are
    /// allowed (repeatable).
    #[arg(long, value_name = "ASSERTION", group = "question")]
    why: Vec<String>,
    /// Explain why an assertion does not hold: the unsatisfied part of each rule that could infer it (repeatable).
    #[arg(long, value_name = "ASSERTION", group = "question")]
    why_not: Vec<String>,
}

impl Questions {
    pub fn answer(
        &self,
        knowledge: &mut Knowledge,
        imports: &Imports,
        common: &Common,
    ) -> Result<Option<Exit>, Failure> {
        let (text, json, exit) = if !self.entails.is_empty() {
            self.follows(knowledge, imports)?
        } else if self.schema {
            let schema = schema(knowledge.engine(), knowledge.entities())
                .map_err(|error| Message::from_rules(&error))?;
            (schema_text(&schema), output::pretty(&SchemaAnswer::new(&schema)), Exit::Done)
        } else if !self.why.is_empty() {
            reasons(knowledge, &self.why, why)?
        } else if !self.why_not.is_empty() {
            reasons(knowledge, &self.why_not, why_not)?
        } else {
            return Ok(None);
        };
        match common.format {
            Format::Json => output::document(&visible_json(&json)),
            _ => output::answer(&text),
        }
        Ok(Some(exit))
    }

    fn follows(&self, knowledge: &Knowledge, imports: &Imports) -> Result<(String, String, Exit), Failure> {
        let entities = knowledge.entities().to_vec();
        let options = ontology::ReadOptions {
            allow_missing_imports: true,
            documents_before: knowledge.document_count(),
            known: entities,
            ..imports.options()
        };
        let conclusions = ontology::read_files(&self.entails, &options)
            .map_err(|errors| errors.iter().map(Message::from_ontology).collect::<Vec<_>>())?;
        let mut entailments =
            entailments(knowledge.engine(), &conclusions).map_err(|error| Message::from_rules(&error))?;
        entailments.extend(annotations(knowledge.engine(), knowledge.annotations(), &conclusions));
        let (mut text, mut all) = (String::new(), true);
        for entailment in &entailments {
            match &entailment.answer {
                Answer::Follows(reason) => {
                    let _ = writeln!(text, "follows: {}", entailment.statement);
                    for line in reason.lines() {
                        let _ = writeln!(text, "    {line}");
                    }
                }
                Answer::Open(reason) => {
                    all = false;
                    let _ = writeln!(text, "not shown: {} ({reason})", entailment.statement);
                }
            }
        }
        let count =
            entailments.iter().filter(|entailment| matches!(entailment.answer, Answer::Follows(_))).count();
        let verb = if entailments.len() == 1 { "follows" } else { "follow" };
        let _ = writeln!(text, "{count} of {} {verb}", output::counted(entailments.len(), "statement"));
        let json = output::pretty(&EntailmentAnswer::new(&entailments));
        Ok((text, json, if all { Exit::Done } else { Exit::NotProved }))
    }
}

/// Answers a query about each assertion. Returns the answers as text and as JSON, and the exit status. `answer`
/// returns the text for one assertion, and `true` if the query applies: the assertion holds (`--why`) or does
/// not hold (`--why-not`).
fn reasons(
    knowledge: &mut Knowledge,
    assertions: &[String],
    answer: impl Fn(&Engine, &Fact) -> (bool, String),
) -> Result<(String, String, Exit), Failure> {
    let (mut text, mut answers, mut all) = (String::new(), Vec::new(), true);
    for assertion in assertions {
        let fact = read(knowledge, assertion).map_err(Failure::usage)?;
        let (is_answer, reason) = answer(knowledge.engine(), &fact);
        all &= is_answer;
        text += &reason;
        answers.push(AssertionAnswer { assertion: assertion.clone(), answered: is_answer, reason });
    }
    let json = output::pretty(&ReasonsAnswer::new(answers));
    Ok((text, json, if all { Exit::Done } else { Exit::NotProved }))
}

fn why(engine: &Engine, fact: &Fact) -> (bool, String) {
    let text_of_fact = fact.display(engine.symbols());
    match engine.why(fact) {
        Some(derivation) => (true, derivation.display(engine.symbols()).to_string()),
        None => match tautology(engine.symbols(), fact) {
            Some(reason) => (true, format!("{text_of_fact} holds: {reason}\n")),
            None => (false, format!("{text_of_fact} does not hold; `--why-not` says what is missing\n")),
        },
    }
}

fn why_not(engine: &Engine, fact: &Fact) -> (bool, String) {
    let text_of_fact = fact.display(engine.symbols());
    if engine.holds(fact) || tautology(engine.symbols(), fact).is_some() {
        return (false, format!("{text_of_fact} holds; `--why` says why\n"));
    }
    let mut text = format!("{text_of_fact} does not hold\n");
    let misses = engine.why_not(fact);
    if misses.is_empty() {
        text += "    no rule or axiom could conclude it\n";
    }
    for miss in misses {
        let _ = writeln!(text, "    by rule {}", miss.identity);
        for obstacle in &miss.obstacles {
            let _ = writeln!(text, "        {}", obstacle.display(engine.symbols()));
        }
    }
    (true, text)
}

/// Splits an assertion into IRIs in brackets, quoted literals with their suffix, and names.
fn words(text: &str) -> Vec<&str> {
    let (mut words, mut start, mut inside) = (Vec::new(), None::<usize>, None::<char>);
    for (at, character) in text.char_indices() {
        match (inside, character) {
            (Some(end), _) if character == end => inside = None,
            (None, '<') => inside = Some('>'),
            (None, '"') => inside = Some('"'),
            (None, _) if character.is_whitespace() => {
                words.extend(start.take().map(|start| &text[start..at]));
                continue;
            }
            _ => {}
        }
        start = start.or(Some(at));
    }
    words.extend(start.map(|start| &text[start..]));
    words.retain(|word| *word != ".");
    words
}

fn read(knowledge: &mut Knowledge, assertion: &str) -> Result<Fact, Message> {
    let words = words(assertion.trim().trim_end_matches(" ."));
    let [subject, predicate, object] = words[..] else {
        let text = format!("`{assertion}` is not of the form SUBJECT PROPERTY VALUE, or SUBJECT a CLASS");
        return Err(Message::error("M134", text));
    };
    let names = names(knowledge.engine());
    let subject = name(subject, &names)?;
    let is_type =
        predicate == "a" || predicate.trim_matches(['<', '>']) == rdf::TYPE || predicate == "rdf:type";
    let symbols = knowledge.runtime_mut().engine_mut().symbols_mut();
    if is_type {
        let class = name(object, &names)?;
        return Ok(Fact::new(symbols.name(&class), [symbols.name(&subject)]));
    }
    let predicate = name(predicate, &names)?;
    let object = match literal(object) {
        Some(literal) => symbols.literal(literal),
        None => symbols.name(&name(object, &names)?),
    };
    Ok(Fact::new(symbols.name(&predicate), [symbols.name(&subject), object]))
}

fn names(engine: &Engine) -> BTreeSet<String> {
    let mut symbols: BTreeSet<Symbol> = BTreeSet::new();
    for fact in engine.facts_in_brief(1) {
        symbols.insert(fact.predicate);
        symbols.extend(fact.arguments);
    }
    for atom in engine.program().rules.iter().flat_map(|rule| rule.head.iter().chain(&rule.body)) {
        if let Atom::Relation { predicate, .. } | Atom::Not { predicate, .. } = atom {
            symbols.insert(*predicate);
        }
        symbols.extend(atom.terms().into_iter().filter_map(|term| match term {
            Term::Constant(symbol) => Some(symbol),
            Term::Variable(_) => None,
        }));
    }
    let text = |symbol| match engine.symbols().value(symbol) {
        Value::Name(name) => Some(name.to_string()),
        Value::Literal(_) => None,
    };
    symbols.into_iter().filter_map(text).collect()
}

/// Resolves a word to an IRI: an IRI in angle brackets, a full IRI in `names`, or a local name with any prefix.
/// Returns an error for a local name that no IRI or several IRIs in `names` have.
fn name(word: &str, names: &BTreeSet<String>) -> Result<String, Message> {
    if let Some(iri) = word.strip_prefix('<').and_then(|rest| rest.strip_suffix('>')) {
        return Ok(iri.to_owned());
    }
    if names.contains(word) {
        return Ok(word.to_owned());
    }
    let local = word.rsplit(':').next().unwrap_or(word);
    let matches: Vec<&String> = names.iter().filter(|iri| local_name(iri) == local).collect();
    match matches[..] {
        [iri] => Ok(iri.clone()),
        [] => Err(Message::error("M134", format!("nothing has the name `{word}`; write an IRI as <IRI>"))),
        _ => {
            let candidates: Vec<String> = matches.iter().map(|iri| format!("<{iri}>")).collect();
            Err(Message::error(
                "M134",
                format!("`{word}` may be {}; write one of them", candidates.join(" or ")),
            ))
        }
    }
}

/// Parses `"text"`, `"text"@en`, `"5"^^xsd:int`, a number, `true` or `false`. Returns `None` for other words.
fn literal(word: &str) -> Option<Literal> {
    const XSD: &str = ontology::vocab::xsd::NS;
    if let Some(rest) = word.strip_prefix('"') {
        let (text, kind) = rest.rsplit_once('"')?;
        if let Some(language) = kind.strip_prefix('@') {
            return Some(Literal::parse(text, None, Some(language)));
        }
        let datatype = kind.strip_prefix("^^").map(|datatype| match datatype.strip_prefix("xsd:") {
            Some(local) => format!("{XSD}{local}"),
            None => datatype.trim_matches(['<', '>']).to_owned(),
        });
        return Some(Literal::parse(text, datatype.as_deref(), None));
    }
    let kind = match word {
        "true" | "false" => "boolean",
        _ if !word.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+') => return None,
        _ if word.contains(['e', 'E']) => "double",
        _ if word.contains('.') => "decimal",
        _ => "integer",
    };
    let literal = Literal::parse(word, Some(&format!("{XSD}{kind}")), None);
    (!literal.is_ill_typed()).then_some(literal)
}

fn schema_text(schema: &Schema) -> String {
    let mut text = String::new();
    let kinds = [
        ("classes", &schema.classes),
        ("object properties", &schema.object_properties),
        ("data properties", &schema.data_properties),
    ];
    for (title, entities) in kinds.iter().filter(|(_, entities)| !entities.is_empty()) {
        let _ = writeln!(text, "{title}");
        for entity in *entities {
            let above: Vec<String> = entity.direct.iter().map(|iri| format!("<{iri}>")).collect();
            match (&entity.empty, above.is_empty()) {
                (Some(reason), _) => {
                    let _ = writeln!(text, "    <{}> is always empty: {reason}", entity.iri);
                }
                (None, true) => {
                    let _ = writeln!(text, "    <{}>", entity.iri);
                }
                (None, false) => {
                    let _ = writeln!(text, "    <{}> below {}", entity.iri, above.join(", "));
                }
            }
        }
    }
    text
}
