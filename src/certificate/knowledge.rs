//! Where a mission's problem comes from: its knowledge base and what has changed since, to be reasoned with again.

use std::collections::BTreeMap;

use encodings::pddl::ast::{Domain, Problem};
use encodings::pddl::{Source, print_domain, print_problem};
use ontology::{OutputSyntax, ReadOptions};
use serde::{Deserialize, Serialize};

use crate::knowledge::{Knowledge, Sources, Statements, rule_text};
use crate::message::Message;
use crate::mission::{Bindings, Mission};

/// The knowledge base with all that it imports, as N-Triples.
pub(super) const DOCUMENT: &str = "knowledge.nt";
/// Everything else.
pub(super) const ORIGIN: &str = "origin.json";

/// What joins a knowledge base with PDDL, and what has changed since it was read.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Origin {
    /// The domain as its file has it.
    domain: String,
    /// The problem without what the knowledge base contributes.
    problem: String,
    bindings: BTreeMap<String, String>,
    /// Names and texts of rule files.
    rules: Vec<(String, String)>,
    changes: Statements,
}

/// The files of a mission with a knowledge base.
pub(super) fn files(mission: &Mission) -> Result<Option<[(&'static str, String); 2]>, Message> {
    let Some(knowledge) = mission.knowledge() else { return Ok(None) };
    let sources = knowledge.sources();
    let first = |messages: Vec<Message>| {
        let other = || Message::error("M120", "the knowledge base cannot be read again");
        messages.into_iter().next().unwrap_or_else(other)
    };
    let (document, _) = ontology::convert_files(&sources.documents, &sources.options, OutputSyntax::NTriples)
        .map_err(|errors| first(errors.iter().map(Message::from_ontology).collect()))?;
    let rules = sources.rules.iter().map(|name| Ok((name.clone(), rule_text(name)?)));
    let origin = Origin {
        domain: mission.domain_source().text().to_owned(),
        problem: print_problem(mission.problem()),
        bindings: mission.bindings().written().clone(),
        rules: rules.collect::<Result<_, Message>>()?,
        changes: knowledge.statements(),
    };
    let origin = serde_json::to_string(&origin)
        .map_err(|error| Message::error("M120", format!("no certificate: {error}")))?;
    Ok(Some([(DOCUMENT, document), (ORIGIN, origin)]))
}

/// Reasons again, and fills the problem with what follows. It must be the problem that was planned, but for its metric.
pub(super) fn check(
    document: &str,
    origin: &str,
    domain: &Domain,
    problem: &Problem,
) -> Result<String, String> {
    let origin: Origin = serde_json::from_str(origin).map_err(|error| format!("{ORIGIN}: {error}"))?;
    let directory = tempfile::tempdir().map_err(|error| format!("no temporary directory: {error}"))?;
    let write = |name: &str, text: &str| {
        let file = directory.path().join(name);
        std::fs::write(&file, text).map_err(|error| format!("no temporary file: {error}"))?;
        Ok::<_, String>(file)
    };
    let documents = vec![write(DOCUMENT, document)?];
    let mut rules = Vec::new();
    for ((_, text), number) in origin.rules.iter().zip(1..) {
        rules.push(write(&format!("rules-{number}.swrl"), text)?.display().to_string());
    }
    let sources = Sources { documents, rules, options: ReadOptions::default() };
    let mission = mission(&sources, &origin).map_err(|messages| {
        messages
            .iter()
            .find(|message| message.is_error())
            .map_or_else(String::new, |found| found.message.clone())
    })?;
    let (mut filled, _) = mission
        .filled()
        .map_err(|messages| messages.first().map_or_else(String::new, |message| message.message.clone()))?;
    filled.metric.clone_from(&problem.metric);
    if print_domain(mission.domain()) != print_domain(domain) {
        return Err("the mission's domain is another one".to_owned());
    }
    let (found, expected) = (print_problem(&filled), print_problem(problem));
    if let Some((found, expected)) =
        found.lines().zip(expected.lines()).find(|(found, expected)| found != expected)
    {
        return Err(format!("the knowledge says `{}`, the problem `{}`", found.trim(), expected.trim()));
    }
    if found != expected {
        return Err("the knowledge says more or less than the problem".to_owned());
    }
    let rules = mission.knowledge().map_or(0, Knowledge::rule_count);
    Ok(format!("the problem is what follows: {} triples, {rules} rules", document.lines().count()))
}

fn mission(sources: &Sources, origin: &Origin) -> Result<Mission, Vec<Message>> {
    let mut knowledge = Knowledge::read(sources)?;
    knowledge.restore(&origin.changes).map_err(|message| vec![message])?;
    let bindings = Bindings::with(&origin.bindings).map_err(|text| vec![Message::error("M105", text)])?;
    let source = |name: &str, text: &str| Ok(Source::new(name, text));
    let (domain, problem) = (source("domain", &origin.domain), source("problem", &origin.problem));
    Mission::new("", Some(Ok(knowledge)), bindings, domain, problem)
}
