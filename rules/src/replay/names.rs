//! Equality classes of names, represented by their first names.

use std::cell::Cell;

use rustc_hash::FxHashMap;

use crate::fact::Fact;
use crate::symbol::Symbol;

/// Union-find: maps a name to a smaller name of its class. The first name of a class has no entry.
#[derive(Default)]
pub(super) struct Names(FxHashMap<Symbol, Cell<Symbol>>);

impl Names {
    pub fn find(&self, name: Symbol) -> Symbol {
        let mut first = name;
        while let Some(smaller) = self.0.get(&first) {
            first = smaller.get();
        }
        // Shortens the path, so that later look-ups are fast.
        let mut name = name;
        while let Some(smaller) = self.0.get(&name) {
            name = smaller.replace(first);
        }
        first
    }

    pub fn join(&mut self, left: Symbol, right: Symbol) -> bool {
        let (left, right) = (self.find(left), self.find(right));
        if left != right {
            self.0.insert(left.max(right), Cell::new(left.min(right)));
        }
        left != right
    }

    pub fn normal(&self, fact: &Fact) -> Fact {
        if self.0.is_empty() {
            return fact.clone();
        }
        Fact::new(fact.predicate, fact.arguments.iter().map(|name| self.find(*name)))
    }
}
