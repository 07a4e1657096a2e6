//! Facts: predicates applied to interned arguments.

use std::fmt;

use smallvec::SmallVec;

use crate::symbol::{Symbol, Symbols};

/// Arguments of a fact. Up to three are stored inline.
pub type Arguments = SmallVec<[Symbol; 3]>;

/// A ground atom: a class assertion with one argument, a property assertion with two, or a fact of any other
/// relation.
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct Fact {
    /// Class, property or relation.
    pub predicate: Symbol,
    /// Subject, object and so on, in order.
    pub arguments: Arguments,
}

impl Fact {
    /// Creates a fact from its parts.
    pub fn new(predicate: Symbol, arguments: impl IntoIterator<Item = Symbol>) -> Self {
        Self { predicate, arguments: arguments.into_iter().collect() }
    }

    /// Formats the fact as `predicate(argument, …)`, with full names in angle brackets.
    pub fn display<'a>(&'a self, symbols: &'a Symbols) -> impl fmt::Display + 'a {
        DisplayFact { fact: self, symbols }
    }
}

struct DisplayFact<'a> {
    fact: &'a Fact,
    symbols: &'a Symbols,
}

impl fmt::Display for DisplayFact<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}(", self.symbols.value(self.fact.predicate))?;
        for (position, &argument) in self.fact.arguments.iter().enumerate() {
            let separator = if position == 0 { "" } else { ", " };
            write!(f, "{separator}{}", self.symbols.value(argument))?;
        }
        f.write_str(")")
    }
}
