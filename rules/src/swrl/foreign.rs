//! Atoms of rule texts that cannot belong to an ontology: by its arguments, such an atom denotes neither a class nor
//! a property. If no rule derives its relation, the author probably meant a built-in that does not exist.

use crate::error::Error;
use crate::rule::{Program, Term};
use crate::symbol::Symbols;

#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct ForeignAtom {
    name: String,
    count: usize,
    /// Line and column, counted from 1.
    place: (u32, u32),
}

impl ForeignAtom {
    /// Creates a foreign atom if the number of arguments is neither one nor two, or if the first
    /// argument is a literal. Returns `None` for other atoms.
    pub fn from_atom(name: &str, arguments: &[Term], place: (u32, u32), symbols: &Symbols) -> Option<Self> {
        let is_literal = |term: &Term| match term {
            Term::Constant(symbol) => symbols.as_literal(*symbol).is_some(),
            Term::Variable(_) => false,
        };
        let is_foreign = !(1..=2).contains(&arguments.len()) || arguments.first().is_some_and(is_literal);
        is_foreign.then(|| Self { name: name.to_owned(), count: arguments.len(), place })
    }

    pub fn error(self, file: &str) -> Error {
        let Self { name, count, place: (line, column) } = self;
        Error::UnknownRelation { file: file.to_owned(), line, column, name, count }
    }
}

pub(super) fn unknown(atoms: Vec<(&str, ForeignAtom)>, program: &Program, symbols: &Symbols) -> Vec<Error> {
    let (queried, derived) = (program.queried(symbols), program.concluded(symbols));
    let is_unknown = |(_, atom): &(&str, ForeignAtom)| {
        let key = (atom.name.clone(), atom.count);
        queried.contains(&key) && !derived.contains(&key)
    };
    atoms.into_iter().filter(is_unknown).map(|(source, atom)| atom.error(source)).collect()
}
