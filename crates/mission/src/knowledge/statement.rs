//! Assertions that refer to entities by name instead of interned symbol, for snapshots and
//! certificates.

use rules::{Engine, Fact, Literal, Symbols, Value};
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
    /// A literal: its lexical form and the IRI of its datatype.
    Literal(String, String),
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

impl Statement {
    pub(super) fn of(engine: &Engine, fact: &Fact) -> Self {
        let symbols = engine.symbols();
        let part = |symbol| match symbols.value(symbol) {
            Value::Name(name) => Part::Name(name.to_string()),
            Value::Literal(literal) => Part::Literal(literal.lexical(), literal.datatype().to_owned()),
        };
        Self {
            predicate: symbols.value(fact.predicate).as_name().unwrap_or_default().to_owned(),
            arguments: fact.arguments.iter().map(|argument| part(*argument)).collect(),
        }
    }

    pub(super) fn intern(&self, symbols: &mut Symbols) -> Fact {
        let predicate = symbols.name(&self.predicate);
        let arguments: Vec<_> = self
            .arguments
            .iter()
            .map(|part| match part {
                Part::Name(name) => symbols.name(name),
                Part::Literal(lexical, datatype) => {
                    symbols.literal(Literal::parse(lexical, Some(datatype), None))
                }
            })
            .collect();
        Fact::new(predicate, arguments)
    }
}
