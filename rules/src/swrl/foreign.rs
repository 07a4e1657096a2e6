//! Atoms of rule text that no ontology can have: they are about neither class nor property, and if no rule concludes them, who
//! wrote them meant a built-in that there is not.

use crate::error::Error;
use crate::rule::{Program, Term};
use crate::symbol::Symbols;

/// An atom that can be about neither class nor property, and its place.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct ForeignAtom {
    name: String,
    count: usize,
    at: (u32, u32),
}

impl ForeignAtom {
    /// The atom, if classes and properties cannot have it: it has not one or two arguments, or is about a literal.
    pub fn of(name: &str, arguments: &[Term], at: (u32, u32), symbols: &Symbols) -> Option<Self> {
        let is_literal = |term: &Term| match term {
            Term::Constant(symbol) => symbols.as_literal(*symbol).is_some(),
            Term::Variable(_) => false,
        };
        let is_foreign = !(1..=2).contains(&arguments.len()) || arguments.first().is_some_and(is_literal);
        is_foreign.then(|| Self { name: name.to_owned(), count: arguments.len(), at })
    }

    /// R104.
    pub fn error(self, file: &str) -> Error {
        let Self { name, count, at: (line, column) } = self;
        Error::UnknownRelation { file: file.to_owned(), line, column, name, count }
    }
}

/// The errors of those of some atoms that a program asks for and does not conclude.
pub(super) fn unknown(atoms: Vec<(&str, ForeignAtom)>, program: &Program, symbols: &Symbols) -> Vec<Error> {
    let (asked, concluded) = (program.asked(symbols), program.concluded(symbols));
    let is_unknown = |(_, atom): &(&str, ForeignAtom)| {
        let key = (atom.name.clone(), atom.count);
        asked.contains(&key) && !concluded.contains(&key)
    };
    atoms.into_iter().filter(is_unknown).map(|(source, atom)| atom.error(source)).collect()
}
