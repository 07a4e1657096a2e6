//! Where a mission's problem comes from: its knowledge base, what has changed since, and why what follows from them does.

use std::collections::BTreeMap;

use ontology::ReadOptions;
use pddl::ast::{Domain, Problem};
use pddl::{Source, print_domain, print_problem};
use rules::replay::{Replayed, replay};
use serde::{Deserialize, Serialize};

use crate::derivations::{self, DERIVATIONS};
use crate::digest::digest;
use mission::knowledge::{COADAPTATION, Knowledge, Sources, Stated, Statements, TOMASYS};
use mission::message::Message;
use mission::{Bindings, Mission, Names};

/// The knowledge base with all that it imports, as N-Triples.
pub const DOCUMENT: &str = "knowledge.nt";
/// Everything else.
pub const ORIGIN: &str = "origin.json";

/// What joins a knowledge base with PDDL, and what has changed since it was read.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// The domain as its file has it.
    pub domain: String,
    /// The problem without what the knowledge base contributes.
    pub problem: String,
    /// PDDL symbol to query, beyond the defaults.
    pub bindings: BTreeMap<String, String>,
    /// Names of individuals to names of objects, where they differ.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub names: BTreeMap<String, String>,
    /// Names and texts of rule files.
    pub rules: Vec<(String, String)>,
    /// The SHA-256 of those that the program ships, by name.
    pub shipped: BTreeMap<String, String>,
    /// What has changed since the documents were read.
    pub changes: Statements,
}

/// What a certificate says about knowledge: the documents, what has changed since, and what follows.
pub(crate) struct KnowledgeFiles<'w> {
    pub(crate) document: &'w str,
    pub(crate) origin: &'w str,
    pub(crate) derivations: &'w str,
}

/// Replays the derivations, and fills the problem with what they say. It must be the problem that was planned, but for its
/// metric.
pub(crate) fn check(
    written: &KnowledgeFiles<'_>,
    domain: &Domain,
    problem: &Problem,
) -> [Result<String, String>; 2] {
    let (knowledge, said, origin) = match replayed(written) {
        Ok(replayed) => replayed,
        Err(reason) => return [Err(reason), Err("the derivations do not say what follows".to_owned())],
    };
    [Ok(said), filled(knowledge, &origin, domain, problem)]
}

/// Whether a rule file is the shipped one of that name.
pub fn is_shipped(name: &str, text: &str) -> bool {
    [(COADAPTATION, rules::COADAPTATION_RULES), (TOMASYS, rules::TOMASYS_RULES)].contains(&(name, text))
}

/// Which rules are ours, and which are not whatever they are called.
fn provenance(origin: &Origin) -> Result<String, String> {
    let mut said = Vec::new();
    for (name, text) in &origin.rules {
        let sum = digest(text.as_bytes());
        let short = &sum[..12];
        if let Some(claimed) = origin.shipped.get(name)
            && *claimed != sum
        {
            return Err(format!("the rules `{name}` have the SHA-256 {sum}, where {claimed} is named"));
        }
        said.push(if is_shipped(name, text) {
            format!("`{name}` (shipped)")
        } else if [COADAPTATION, TOMASYS].contains(&name.as_str()) {
            format!("`{name}` (NOT the shipped rules of this version, SHA-256 {short}…)")
        } else {
            format!("`{}` (not shipped, SHA-256 {short}…)", name.rsplit('/').next().unwrap_or(name))
        });
    }
    let other = origin.shipped.keys().find(|name| !origin.rules.iter().any(|(own, _)| own == *name));
    match other {
        Some(name) => Err(format!("the rules `{name}` are named and not there")),
        None if said.is_empty() => Ok("no rule files".to_owned()),
        None => Ok(format!("rules: {}", said.join(", "))),
    }
}

pub(crate) fn said_first(messages: &[Message]) -> String {
    let error = messages.iter().find(|message| message.is_error()).or(messages.first());
    error.map_or_else(String::new, |found| found.message.clone())
}

/// What the documents say, with what has changed since.
///
/// # Errors
/// What is wrong with them, as a sentence.
pub fn stated(document: &str, origin: &Origin) -> Result<Stated, String> {
    let directory = tempfile::tempdir().map_err(|error| format!("no temporary directory: {error}"))?;
    let write = |name: &str, text: &str| {
        let file = directory.path().join(name);
        std::fs::write(&file, text).map_err(|error| format!("no temporary file: {error}"))?;
        Ok::<_, String>(file)
    };
    let documents = vec![write(DOCUMENT, document)?];
    let rules = origin.rules.iter().zip(1..);
    let rules = rules
        .map(|((_, text), number)| Ok(write(&format!("rules-{number}.swrl"), text)?.display().to_string()));
    let rules = rules.collect::<Result<Vec<_>, String>>()?;
    // What the document imports would lie outside of the certificate.
    let options = ReadOptions { closed: true, ..ReadOptions::default() };
    let sources = Sources { documents, rules, options, ..Sources::default() };
    let mut stated = Stated::read_for(&sources, &origin.domain).map_err(|messages| said_first(&messages))?;
    for rule in &mut stated.program.rules {
        let file = sources.rules.iter().position(|file| **file == *rule.identity.source);
        if let Some(position) = file {
            rule.identity.source = origin.rules[position].0.as_str().into();
        }
    }
    stated.change(&origin.changes);
    Ok(stated)
}

/// What follows, by its derivations alone.
fn replayed(written: &KnowledgeFiles<'_>) -> Result<(Knowledge, String, Origin), String> {
    let origin: Origin =
        serde_json::from_str(written.origin).map_err(|error| format!("{ORIGIN}: {error}"))?;
    let mut stated = stated(written.document, &origin)?;
    let derivation = derivations::read(written.derivations, &mut stated.symbols)?;
    let Replayed { facts, derived, matches } =
        replay(&stated.program, &mut stated.symbols, &stated.facts, &derivation)
            .map_err(|fault| format!("{DERIVATIONS}: {fault}"))?;
    let said = format!(
        "{facts} facts hold, {derived} of them by rules, and nothing else follows: {} rules and axioms, {matches} matches",
        stated.program.rules.len()
    );
    let facts = derivation.steps.into_iter().map(|step| step.fact).collect();
    let Stated { symbols, program, facts: told, terms, .. } = stated;
    let knowledge = Knowledge::closed(symbols, facts, program.equality);
    let knowledge = knowledge.map_err(|messages| said_first(&messages))?.with_terms(terms, &told);
    let said = format!("{said}; {}", provenance(&origin)?);
    Ok((knowledge, said, origin))
}

/// The code that joins knowledge and PDDL, which the planner runs, too.
fn shared(mission: &Mission) -> &'static str {
    match (mission.adaptation(), mission.completed_predicates()) {
        (Some(_), _) => "the bindings, and the explicit form of the plain domain",
        (None, Some(_)) => "the completion of PLANTA's form",
        (None, None) => "the bindings",
    }
}

fn filled(
    knowledge: Knowledge,
    origin: &Origin,
    domain: &Domain,
    problem: &Problem,
) -> Result<String, String> {
    let bindings = Bindings::with(&origin.bindings)?.naming(Names::from(&origin.names));
    let source = |name: &str, text: &str| Ok(Source::new(name, text));
    let (own_domain, own_problem) = (source("domain", &origin.domain), source("problem", &origin.problem));
    let mission = Mission::new("", Some(Ok(knowledge)), bindings, own_domain, own_problem);
    let mission = mission.map_err(|messages| said_first(&messages))?;
    let (mut filled, _) = mission.filled().map_err(|messages| said_first(&messages))?;
    let own = print_problem(&filled);
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
    // The metric is the only thing that a user chooses with each plan.
    let metric = if own == expected { "" } else { ", with another metric than the mission's" };
    Ok(format!("the problem is what follows{metric}; on trust: {}", shared(&mission)))
}
