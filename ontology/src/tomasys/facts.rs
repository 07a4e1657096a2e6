//! Point look-ups in an engine by notion: what is said of one individual, without a pass over all facts.

use num_rational::BigRational;
use rules::{Engine, Fact, Literal, Symbol};

use super::terms::Term;
use crate::error::Error;
use crate::vocab::local_name;

/// Reads an engine by the vocabulary table.
#[derive(Clone, Copy)]
pub(crate) struct Facts<'a> {
    engine: &'a Engine,
    /// Whether only stated facts count, and not what follows from them.
    stated: bool,
}

impl<'a> Facts<'a> {
    /// Everything that holds.
    pub(crate) fn new(engine: &'a Engine) -> Self {
        Self { engine, stated: false }
    }

    /// What is stated, or everything that holds.
    pub(crate) fn stated(engine: &'a Engine, stated: bool) -> Self {
        Self { engine, stated }
    }

    pub(crate) fn name(self, symbol: Symbol) -> Option<&'a str> {
        self.engine.symbols().value(symbol).as_name()
    }

    /// One column of the rows of the notion's relations that fit, sorted, each once.
    fn column(self, term: Term, pattern: &[Option<Symbol>], column: usize) -> Vec<Symbol> {
        let mut found = Vec::new();
        for predicate in term.iter().filter_map(|name| self.engine.symbols().find_name(name)) {
            let rows = self.engine.matching(predicate, pattern);
            let counts = |row: &rules::Arguments| {
                !self.stated || self.engine.is_asserted(&Fact::new(predicate, row.iter().copied()))
            };
            found.extend(rows.filter(counts).map(|row| row[column]));
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The members of a class.
    pub(crate) fn members(self, class: Term) -> Vec<Symbol> {
        self.column(class, &[None], 0)
    }

    /// The values of a property.
    pub(crate) fn objects(self, subject: Symbol, property: Term) -> Vec<Symbol> {
        self.column(property, &[Some(subject), None], 1)
    }

    /// What has a value of a property.
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

    /// The numeric value of a property, if it has just one.
    pub(crate) fn number(self, subject: Symbol, property: Term) -> Option<BigRational> {
        match self.literals(subject, property)[..] {
            [value] => value.as_rational(),
            _ => None,
        }
    }

    /// The texts of the values of a property, sorted.
    pub(crate) fn texts(self, subject: Symbol, property: Term) -> Vec<String> {
        let mut texts: Vec<_> = self.literals(subject, property).into_iter().map(Literal::lexical).collect();
        texts.sort();
        texts
    }

    /// The individual with that IRI or local name among the members of a class, and the class by its IRI.
    ///
    /// # Errors
    /// [`Error::Unknown`] with the names that there are.
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
            // Where several individuals have the local name, the same one is taken in every history.
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
