//! Exports the part of a certificate about the knowledge base: a document with its axioms, its
//! origin, and the derivations of all facts. The origin consists of domain, problem, bindings,
//! rules, and the changes since the knowledge base was read.

use ontology::OutputSyntax;
use pddl::print_problem;
use planner::Limits;
use rules::Engine;

use ::verify::derivations::DERIVATIONS;
use ::verify::digest::digest;
use ::verify::knowledge::{DOCUMENT, ORIGIN, Origin, is_shipped, stated};

use super::derivations;
use crate::knowledge::{Stated, rule_text};
use crate::message::Message;
use crate::mission::Mission;

/// Returns the names and texts of the three files, or `None` without a knowledge base.
///
/// # Errors
/// The knowledge base cannot be read again, or a limit was reached (M120).
pub(super) fn files(
    mission: &Mission,
    limits: &Limits,
) -> Result<Option<[(&'static str, String); 3]>, Message> {
    let Some(knowledge) = mission.knowledge() else { return Ok(None) };
    let sources = knowledge.sources();
    if !sources.are_repeatable() {
        return Err(unrepeatable());
    }
    let first = |messages: Vec<Message>| {
        let unreadable = || Message::error("M120", "no certificate: the knowledge base cannot be read again");
        messages.into_iter().next().unwrap_or_else(unreadable)
    };
    let (document, _) = ontology::convert_files(&sources.documents, &sources.options, OutputSyntax::NTriples)
        .map_err(|errors| first(errors.iter().map(Message::from_ontology).collect()))?;
    let rules = sources.rules.iter().map(|name| Ok((name.clone(), rule_text(name)?)));
    let rules: Vec<(String, String)> = rules.collect::<Result<_, Message>>()?;
    let shipped = rules.iter().filter(|(name, text)| is_shipped(name, text));
    let shipped = shipped.map(|(name, text)| (name.clone(), digest(text.as_bytes()))).collect();
    let origin = Origin {
        domain: mission.domain_source().text().to_owned(),
        problem: print_problem(mission.problem()),
        bindings: mission.bindings().written().clone(),
        names: mission.bindings().names().written(),
        rules,
        shipped,
        changes: knowledge.statements(),
    };
    let wrong = |error: &dyn std::fmt::Display| Message::error("M120", format!("no certificate: {error}"));
    let late =
        |_| Message::error("M120", "no certificate: a limit was reached before its knowledge was derived");
    limits.check().map_err(late)?;
    // Derivations refer to rules by their positions in this document, so the engine is built from the document.
    let Stated { symbols, program, facts, .. } = stated(&document, &origin).map_err(|error| wrong(&error))?;
    limits.check().map_err(late)?;
    let interruptible = rules::Limits { interrupt: Some(limits.into()), ..rules::Limits::default() };
    let engine = Engine::with_limits(symbols, program, facts, interruptible);
    limits.check().map_err(late)?;
    let engine = engine.map_err(|errors| first(errors.iter().map(Message::from_rules).collect()))?;
    let derivations = derivations::write(&engine).map_err(|error| wrong(&error))?;
    let origin = serde_json::to_string(&origin).map_err(|error| wrong(&error))?;
    Ok(Some([(DOCUMENT, document), (ORIGIN, origin), (DERIVATIONS, derivations)]))
}

/// Returns the error that a knowledge base of a certificate comes from standard input.
pub fn unrepeatable() -> Message {
    let text = "no certificate: the knowledge base comes from standard input, which cannot be read again";
    Message::error("M120", text).with_help("use files for `--kb` and `--rules`")
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Duration;

    use super::*;
    use crate::setup::Setup;

    #[test]
    fn nothing_is_derived_after_the_deadline() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        let mission = Setup::read(&manifest).expect("the mission is read").mission;
        assert!(files(&mission, &Limits::none()).is_ok_and(|files| files.is_some()));
        let error = files(&mission, &Limits::none().with_time(Duration::ZERO)).expect_err("too late");
        assert!(error.code == "M120" && error.message.contains("a limit was reached"), "{error}");
    }
}
