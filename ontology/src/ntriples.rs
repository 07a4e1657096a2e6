//! Facts as an N-Triples document: sorted, each once, one triple a line.

use std::fmt::Write;

use rules::{Fact, Symbol, Symbols, Value};

use crate::lower::INTERNAL;
use crate::owl::ANONYMOUS;
use crate::vocab::{owl, rdf};

/// Writes facts about individuals: a fact with one argument as `rdf:type`, one with two as a property.
///
/// Left out are facts that no triple can state (other arities), the relations that [`crate::lower`] invents, and that
/// an individual is one (an `owl:Thing`), or the same as itself. Anonymous individuals become blank nodes again.
pub fn ntriples<'a>(symbols: &Symbols, facts: impl IntoIterator<Item = &'a Fact>) -> String {
    let mut lines: Vec<String> = facts.into_iter().filter_map(|fact| triple(symbols, fact)).collect();
    lines.sort_unstable();
    lines.dedup();
    lines.into_iter().fold(String::new(), |mut text, line| {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{line}");
        text
    })
}

fn triple(symbols: &Symbols, fact: &Fact) -> Option<String> {
    let predicate = symbols.value(fact.predicate).as_name().filter(|name| !name.starts_with(INTERNAL))?;
    match fact.arguments[..] {
        [_] if predicate == owl::THING => None,
        [subject] => Some(format!("{} <{}> <{predicate}> .", node(symbols, subject)?, rdf::TYPE)),
        [subject, object] if subject == object && predicate == owl::SAME_AS => None,
        [subject, object] => {
            let object = match symbols.value(object) {
                Value::Name(_) => node(symbols, object)?,
                Value::Literal(literal) => literal.to_string(),
            };
            Some(format!("{} <{predicate}> {object} .", node(symbols, subject)?))
        }
        _ => None,
    }
}

fn node(symbols: &Symbols, symbol: Symbol) -> Option<String> {
    let name = symbols.value(symbol).as_name()?;
    Some(name.strip_prefix(ANONYMOUS).map_or_else(|| format!("<{name}>"), |label| format!("_:{label}")))
}
