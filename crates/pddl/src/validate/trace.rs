//! Records on which missing facts the result of an evaluation depends.

use std::cell::RefCell;

use rustc_hash::FxHashSet;

use crate::ast::Name;

use super::world::{Arguments, Symbol};

/// Facts of a stratum that were missing in an evaluation, and predicates of which all facts were read. The
/// result can change only when one of the missing facts, or a new fact of one of the predicates, is derived.
#[derive(Debug)]
pub(super) struct Trace<'e, 'p> {
    stratum: &'e FxHashSet<&'p Name>,
    facts: RefCell<Vec<(Symbol, Arguments)>>,
    predicates: RefCell<Vec<Symbol>>,
}

impl<'e, 'p> Trace<'e, 'p> {
    pub(super) fn new(stratum: &'e FxHashSet<&'p Name>) -> Self {
        Self { stratum, facts: RefCell::default(), predicates: RefCell::default() }
    }

    pub(super) fn into_parts(self) -> (Vec<(Symbol, Arguments)>, Vec<Symbol>) {
        (self.facts.into_inner(), self.predicates.into_inner())
    }

    pub(super) fn missed(&self, name: &Name, fact: (Symbol, Arguments)) {
        if self.stratum.contains(name) {
            self.facts.borrow_mut().push(fact);
        }
    }

    pub(super) fn read(&self, name: &Name, predicate: Symbol) {
        if self.stratum.contains(name) && !self.predicates.borrow().contains(&predicate) {
            self.predicates.borrow_mut().push(predicate);
        }
    }
}
