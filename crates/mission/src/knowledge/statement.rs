//! Assertions that refer to entities by name instead of interned symbol, for snapshots and
//! certificates.

use ontology::vocab::local_name;
use rules::{Engine, Fact, Literal, Symbol, Symbols, Value};
use serde::{Deserialize, Serialize};

/// An assertion with names and literals instead of interned symbols.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Statement {
    /// The IRI of the class or property.
    pub predicate: String,
    /// Names, or literals with lexical form and datatype.
    pub arguments: Vec<Part>,
}

/// An argument of a [`Statement`].
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// An individual.
    Name(String),
    /// A literal: its lexical form and the IRI of its datatype. Text with a language tag has the form `text@tag` and
    /// the datatype `rdf:PlainLiteral`.
    Literal(String, String),
}

impl Part {
    fn of(symbols: &Symbols, symbol: Symbol) -> Self {
        match symbols.value(symbol) {
            Value::Name(name) => Self::Name(name.to_string()),
            Value::Literal(Literal::Language { text, tag }) => {
                let datatype = "http://www.w3.org/1999/02/22-rdf-syntax-ns#PlainLiteral";
                Self::Literal(format!("{text}@{tag}"), datatype.to_owned())
            }
            Value::Literal(literal) => Self::Literal(literal.lexical(), literal.datatype().to_owned()),
        }
    }

    fn intern(&self, symbols: &mut Symbols) -> Symbol {
        match self {
            Self::Name(name) => symbols.name(name),
            Self::Literal(lexical, datatype) => {
                symbols.literal(Literal::parse(lexical, Some(datatype), None))
            }
        }
    }
}

/// Differences between the current assertions and the assertions of the documents.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Statements {
    /// Current assertions that are not in the documents.
    pub added: Vec<Statement>,
    /// Assertions of the documents that are no longer asserted.
    pub removed: Vec<Statement>,
}

/// Local names of the properties with one value that the robot reports: measured values, statuses of components and
/// realisability of designs.
const STATES: [&str; 4] = ["hasValue", "qa_has_value", "c_status", "fd_realisability"];

impl Statement {
    /// Returns `true` if a report replaces the value of this statement.
    pub(super) fn is_state(&self) -> bool {
        STATES.contains(&local_name(&self.predicate))
    }

    pub(super) fn of(engine: &Engine, fact: &Fact) -> Self {
        let symbols = engine.symbols();
        Self {
            predicate: symbols.value(fact.predicate).as_name().unwrap_or_default().to_owned(),
            arguments: fact.arguments.iter().map(|argument| Part::of(symbols, *argument)).collect(),
        }
    }

    pub(super) fn intern(&self, symbols: &mut Symbols) -> Fact {
        let predicate = symbols.name(&self.predicate);
        let arguments: Vec<_> = self.arguments.iter().map(|argument| argument.intern(symbols)).collect();
        Fact::new(predicate, arguments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_stand_for_the_same_values() {
        let mut symbols = Symbols::default();
        let xsd = |local: &str| format!("http://www.w3.org/2001/XMLSchema#{local}");
        let mut values = vec![symbols.name("http://example.org/a")];
        for (lexical, datatype, language) in [
            ("a@b@", None, Some("en-GB")),
            ("a@en", None, None),
            ("", None, Some("de")),
            ("007", Some(xsd("integer")), None),
            ("1.50", Some(xsd("decimal")), None),
            ("1e400", Some(xsd("double")), None),
            ("seven", Some(xsd("integer")), None),
            ("2026-02-29", Some(xsd("date")), None),
            ("x", Some("http://example.org/datatype".to_owned()), None),
        ] {
            values.push(symbols.literal(Literal::parse(lexical, datatype.as_deref(), language)));
        }
        for value in values {
            let part = Part::of(&symbols, value);
            assert_eq!(part.intern(&mut symbols), value, "{part:?}");
        }
    }
}
