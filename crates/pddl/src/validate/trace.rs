//! The facts on which the result of an evaluation depends.

use std::cell::RefCell;

use rustc_hash::FxHashSet;

use crate::ast::Name;

use super::world::{Arguments, Symbol};

/// Facts of a stratum that were missing in an evaluation. If none of them is derived, the result stays as it is.
#[derive(Debug)]
pub(super) struct Trace<'e, 'p> {
    own: &'e FxHashSet<&'p Name>,
    facts: RefCell<Vec<(Symbol, Arguments)>>,
    /// Predicates all of whose facts were read.
    predicates: RefCell<Vec<Symbol>>,
}

impl<'e, 'p> Trace<'e, 'p> {
    /// A trace of the predicates of a stratum.
    pub(super) fn new(own: &'e FxHashSet<&'p Name>) -> Self {
        Self { own, facts: RefCell::default(), predicates: RefCell::default() }
    }

    /// The missing facts, and the predicates all of whose facts were read.
    pub(super) fn into_parts(self) -> (Vec<(Symbol, Arguments)>, Vec<Symbol>) {
        (self.facts.into_inner(), self.predicates.into_inner())
    }

    /// Notes a fact that does not hold.
    pub(super) fn missed(&self, name: &Name, fact: (Symbol, Arguments)) {
        if self.own.contains(name) {
            self.facts.borrow_mut().push(fact);
        }
    }

    /// Notes that all facts of a predicate are read.
    pub(super) fn read(&self, name: &Name, predicate: Symbol) {
        if self.own.contains(name) && !self.predicates.borrow().contains(&predicate) {
            self.predicates.borrow_mut().push(predicate);
        }
    }
}
