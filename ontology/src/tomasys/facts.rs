//! Point queries of an engine by TOMASys term, without iterating over all facts.

use num_rational::BigRational;
use rules::{Engine, Fact, Literal, Symbol};

use super::terms::Term;
use crate::error::Error;
use crate::vocab::local_name;

/// Queries of an engine by TOMASys term. A term can have several IRIs; a query combines the facts of all
/// of them.
#[derive(Clone, Copy)]
pub(crate) struct Facts<'a> {
    engine: &'a Engine,
    only_stated: bool,
}

impl<'a> Facts<'a> {
    pub(crate) fn new(engine: &'a Engine) -> Self {
        Self { engine, only_stated: false }
    }

    pub(crate) fn stated(engine: &'a Engine, only_stated: bool) -> Self {
        Self { engine, only_stated }
    }

    pub(crate) fn name(self, symbol: Symbol) -> Option<&'a str> {
        self.engine.symbols().value(symbol).as_name()
    }

    /// Returns one column of the rows that match a pattern in any relation of a term, sorted and without
    /// duplicates.
    fn column(self, term: Term, pattern: &[Option<Symbol>], column: usize) -> Vec<Symbol> {
        let mut symbols = Vec::new();
        for predicate in term.iter().filter_map(|name| self.engine.symbols().find_name(name)) {
            let rows = self.engine.matching(predicate, pattern);
            let counts = |row: &rules::Arguments| {
                !self.only_stated || self.engine.is_asserted(&Fact::new(predicate, row.iter().copied()))
            };
            symbols.extend(rows.filter(counts).map(|row| row[column]));
        }
        symbols.sort_unstable();
        symbols.dedup();
        symbols
    }

    pub(crate) fn members(self, class: Term) -> Vec<Symbol> {
        self.column(class, &[None], 0)
    }

    pub(crate) fn objects(self, subject: Symbol, property: Term) -> Vec<Symbol> {
        self.column(property, &[Some(subject), None], 1)
    }

    pub(crate) fn subjects(self, object: Symbol, property: Term) -> Vec<Symbol> {
        self.column(property, &[None, Some(object)], 0)
    }

    pub(crate) fn literals(self, subject: Symbol, property: Term) -> Vec<&'a Literal> {
        let symbols = self.engine.symbols();
        let values = self.objects(subject, property).into_iter();
        values.filter_map(|value| symbols.value(value).as_literal()).collect()
    }

    pub(crate) fn is_true(self, subject: Symbol, property: Term) -> bool {
        self.literals(subject, property).contains(&&Literal::Boolean(true))
    }

    pub(crate) fn is_false(self, subject: Symbol, property: Term) -> bool {
        self.literals(subject, property).contains(&&Literal::Boolean(false))
    }

    /// Returns the numeric value of a property; `None` unless the property has exactly one literal as a value, which
    /// is a number.
    pub(crate) fn number(self, subject: Symbol, property: Term) -> Option<BigRational> {
        match self.literals(subject, property)[..] {
            [value] => value.as_rational(),
            _ => None,
        }
    }

    pub(crate) fn texts(self, subject: Symbol, property: Term) -> Vec<String> {
        let mut texts: Vec<_> = self.literals(subject, property).into_iter().map(Literal::lexical).collect();
        texts.sort();
        texts
    }

    /// Finds the member of a class with this IRI or local name. Returns its symbol and the IRI of the
    /// class.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] with the existing names.
    pub(crate) fn find(
        self,
        kind: &'static str,
        term: Term,
        name: &str,
    ) -> Result<(Symbol, &'static str), Error> {
        let symbols = self.engine.symbols();
        for &class in term {
            let Some(class_symbol) = symbols.find_name(class) else { continue };
            let members = self.engine.matching(class_symbol, &[None]).map(|row| row[0]);
            let named = |&symbol: &Symbol| {
                self.name(symbol).is_some_and(|iri| iri == name || local_name(iri) == name)
            };
            // Several individuals can have the local name. The choice must not depend on the history of the
            // engine.
            if let Some(symbol) = members.filter(named).min_by_key(|&symbol| self.name(symbol)) {
                return Ok((symbol, class));
            }
        }
        let members = self.members(term).into_iter().filter_map(|symbol| self.name(symbol));
        let mut known: Vec<String> = members.map(|iri| local_name(iri).to_owned()).collect();
        known.sort();
        known.dedup();
        Err(Error::Unknown { kind, name: name.to_owned(), known })
    }
}
