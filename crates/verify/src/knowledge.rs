//! Checks the origin of a certificate's problem: a knowledge base, later changes, and the
//! derivations of the inferred facts.

use std::collections::BTreeMap;

use ontology::ReadOptions;
use pddl::ast::{Domain, Problem};
use pddl::{Source, print_domain, print_problem};
use rules::replay::{Replayed, replay};
use serde::{Deserialize, Serialize};

use crate::derivations::{self, DERIVATIONS};
use crate::digest::digest;
use mission::knowledge::{COADAPTATION, Knowledge, Stated, Statements, TOMASYS};
use mission::message::Message;
use mission::{Bindings, Mission, Names};

/// Name of the file with the knowledge base and its imports in N-Triples.
pub const DOCUMENT: &str = "knowledge.nt";
/// Name of the file with the other inputs of the mission, see [`Origin`].
pub const ORIGIN: &str = "origin.json";

/// The inputs that connect a knowledge base with PDDL, and the changes since the knowledge base was
/// read.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// Text of the domain file.
    pub domain: String,
    /// The problem as PDDL text, without the parts that the knowledge base contributes.
    pub problem: String,
    /// For each PDDL symbol with a binding other than the default, the query that yields its facts
    /// or values.
    pub bindings: BTreeMap<String, String>,
    /// For each individual whose PDDL object has a different name, the name of the object.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub names: BTreeMap<String, String>,
    /// The rule files: name and text.
    pub rules: Vec<(String, String)>,
    /// SHA-256 digests of the rule files that were shipped with the program, by name.
    pub shipped: BTreeMap<String, String>,
    /// The changes of statements since the knowledge base was read.
    pub changes: Statements,
}

pub(crate) struct KnowledgeFiles<'w> {
    pub(crate) document: &'w str,
    pub(crate) origin: &'w str,
    pub(crate) derivations: &'w str,
}

/// Replays the derivations, and fills the mission's problem with the inferred facts. The filled problem must
/// equal `problem`, the problem of the certificate, except for the metric. The mission's domain must equal
/// `domain`. Returns the results of the replay and of the comparison.
pub(crate) fn check(
    written: &KnowledgeFiles<'_>,
    domain: &Domain,
    problem: &Problem,
) -> [Result<String, String>; 2] {
    let (knowledge, summary, origin) = match replayed(written) {
        Ok(replayed) => replayed,
        Err(reason) => return [Err(reason), Err("the derivations do not say what follows".to_owned())],
    };
    [Ok(summary), filled(knowledge, &origin, domain, problem)]
}

const MISSING_IMPORT: &str = "O103";

/// Returns `true` if a rule file equals the shipped rule file with this name.
pub fn is_shipped(name: &str, text: &str) -> bool {
    [(COADAPTATION, rules::COADAPTATION_RULES), (TOMASYS, rules::TOMASYS_RULES)].contains(&(name, text))
}

/// Describes for each rule file whether it is shipped, a changed version of a shipped file, or
/// another file. Returns an error if the recorded digest of a rule file differs from that of its
/// text, if this file is missing, or if its name contains a backquote or a control character.
fn provenance(origin: &Origin) -> Result<String, String> {
    let mut descriptions = Vec::new();
    for (name, text) in &origin.rules {
        // With a backquote, a name could imitate the description of another file.
        if name.contains(|character: char| character == '`' || character.is_control()) {
            return Err(format!(
                "the name {name:?} of a rule file contains a backquote or a control character"
            ));
        }
        let sum = digest(text.as_bytes());
        let short = &sum[..12];
        if let Some(claimed) = origin.shipped.get(name)
            && *claimed != sum
        {
            return Err(format!("the rules `{name}` have the SHA-256 {sum}, where {claimed} is named"));
        }
        descriptions.push(if is_shipped(name, text) {
            format!("`{name}` (shipped)")
        } else if [COADAPTATION, TOMASYS].contains(&name.as_str()) {
            format!("`{name}` (NOT the shipped rules of this version, SHA-256 {short}…)")
        } else {
            format!("`{}` (not shipped, SHA-256 {short}…)", name.rsplit('/').next().unwrap_or(name))
        });
    }
    let missing =
        origin.shipped.keys().find(|name| !origin.rules.iter().any(|(rule_name, _)| rule_name == *name));
    match missing {
        Some(name) => Err(format!("the rules `{name}` are named, but their file is missing")),
        None if descriptions.is_empty() => Ok("no rule files".to_owned()),
        None => Ok(format!("rules: {}", descriptions.join(", "))),
    }
}

pub(crate) fn first_message(messages: &[Message]) -> String {
    let error = messages.iter().find(|message| message.is_error()).or(messages.first());
    error.map_or_else(String::new, |message| message.message.clone())
}

/// Reads the knowledge base and the rules of a certificate and applies the later changes.
///
/// # Errors
/// A description of the first error.
pub fn stated(document: &str, origin: &Origin) -> Result<Stated, String> {
    // Several files may have one name, so the texts get other names until they are parsed.
    let names: Vec<String> = (1..=origin.rules.len()).map(|number| format!("rules-{number}.swrl")).collect();
    let rules = names.iter().zip(&origin.rules).map(|(name, (_, text))| (name.as_str(), text.as_str()));
    let rules: Vec<_> = rules.collect();
    // Imports would refer to documents outside of the certificate, so they are not loaded.
    let options = ReadOptions { closed: true, ..ReadOptions::default() };
    let stated = Stated::of_texts((DOCUMENT, document), &rules, &options, &origin.domain);
    let mut stated = stated.map_err(|messages| {
        // The message of the reader names options that the verifier does not have.
        if messages.iter().any(|message| message.code == MISSING_IMPORT) {
            return format!("{DOCUMENT}: contains owl:imports; a certificate may not import other documents");
        }
        first_message(&messages)
    })?;
    for rule in &mut stated.program.rules {
        let file = names.iter().position(|name| **name == *rule.identity.source);
        if let Some(position) = file {
            rule.identity.source = origin.rules[position].0.as_str().into();
        }
    }
    stated.change(&origin.changes);
    Ok(stated)
}

/// Replays the derivations, without the inference engine. Returns the knowledge, a summary, and the
/// origin.
fn replayed(written: &KnowledgeFiles<'_>) -> Result<(Knowledge, String, Origin), String> {
    let origin: Origin =
        serde_json::from_str(written.origin).map_err(|error| format!("{ORIGIN}: {error}"))?;
    let mut stated = stated(written.document, &origin)?;
    let derivation = derivations::read(written.derivations, &mut stated.symbols)?;
    let Replayed { facts, derived, matches } =
        replay(&stated.program, &mut stated.symbols, &stated.facts, &derivation)
            .map_err(|fault| format!("{DERIVATIONS}: {fault}"))?;
    let summary = format!(
        "{facts} facts hold, {derived} of them by rules, and nothing else follows: {} rules and axioms, {matches} matches",
        stated.program.rules.len()
    );
    let facts = derivation.steps.into_iter().map(|step| step.fact).collect();
    let Stated { symbols, program, facts: stated_facts, terms, .. } = stated;
    let knowledge = Knowledge::closed(symbols, facts, program.equality);
    let knowledge = knowledge.map_err(|messages| first_message(&messages))?.with_terms(terms, &stated_facts);
    let summary = format!("{summary}; {}", provenance(&origin)?);
    Ok((knowledge, summary, origin))
}

/// Describes the trusted translation from knowledge to PDDL, whose code the planner uses, too.
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
    let mission = mission.map_err(|messages| first_message(&messages))?;
    let (mut filled, _) = mission.filled().map_err(|messages| first_message(&messages))?;
    let unchanged_metric = print_problem(&filled);
    filled.metric.clone_from(&problem.metric);
    if print_domain(mission.domain()) != print_domain(domain) {
        return Err("the domain differs from that of the mission".to_owned());
    }
    let (actual, expected) = (print_problem(&filled), print_problem(problem));
    if let Some((actual, expected)) =
        actual.lines().zip(expected.lines()).find(|(actual, expected)| actual != expected)
    {
        return Err(format!(
            "the knowledge implies `{}`, but the problem states `{}`",
            actual.trim(),
            expected.trim()
        ));
    }
    if actual != expected {
        return Err("the knowledge implies more or fewer facts than the problem states".to_owned());
    }
    // The metric is the only part of a problem that a user chooses for each plan.
    let metric = if unchanged_metric == expected { "" } else { ", with another metric than the mission's" };
    Ok(format!(
        "the problem follows from the knowledge{metric}; trusted without a check: {}",
        shared(&mission)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn origin(rules: &[&str]) -> Origin {
        let changes = serde_json::to_value(Statements::default()).expect("no statements");
        let rules: Vec<_> = rules.iter().map(|name| (name, "")).collect();
        let origin = serde_json::json!({
            "domain": "(define (domain d))",
            "problem": "(define (problem p) (:domain d))",
            "bindings": {},
            "rules": rules,
            "shipped": {},
            "changes": changes,
        });
        serde_json::from_value(origin).expect("an origin")
    }

    #[test]
    fn names_of_rule_files_do_not_imitate_descriptions() {
        let summary = provenance(&origin(&["mine.swrl", "folder/other rules.swrl"])).expect("harmless names");
        assert!(summary.starts_with("rules: `mine.swrl` (not shipped, SHA-256 "), "{summary}");
        for name in ["coadaptation` (shipped), `x", "a\nb.swrl", "a\u{1b}.swrl"] {
            assert!(provenance(&origin(&[name])).is_err(), "{name:?}");
        }
    }

    #[test]
    fn a_certificate_may_not_import() {
        let document = "<http://e.org/o> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://www.w3.org/2002/07/owl#Ontology> .\n";
        assert!(stated(document, &origin(&[])).is_ok());
        let import = "<http://e.org/o> <http://www.w3.org/2002/07/owl#imports> <http://e.org/other> .\n";
        let result = stated(&format!("{document}{import}"), &origin(&[])).map(|_| ());
        assert_eq!(
            result,
            Err("knowledge.nt: contains owl:imports; a certificate may not import other documents".to_owned())
        );
    }
}
