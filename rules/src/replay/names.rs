//! Classes of names that are one, each with its first member.

use rustc_hash::FxHashMap;

use crate::fact::Fact;
use crate::symbol::Symbol;

/// By name, a smaller name of the same class; a name that is not there is the first of its class.
#[derive(Default)]
pub(super) struct Names(FxHashMap<Symbol, Symbol>);

impl Names {
    /// The first name of a class.
    pub fn find(&self, mut name: Symbol) -> Symbol {
        while let Some(smaller) = self.0.get(&name) {
            name = *smaller;
        }
        name
    }

    /// Joins two classes; whether they were two.
    pub fn join(&mut self, left: Symbol, right: Symbol) -> bool {
        let (left, right) = (self.find(left), self.find(right));
        if left != right {
            self.0.insert(left.max(right), left.min(right));
        }
        left != right
    }

    /// A fact about first names.
    pub fn normal(&self, fact: &Fact) -> Fact {
        if self.0.is_empty() {
            return fact.clone();
        }
        Fact::new(fact.predicate, fact.arguments.iter().map(|name| self.find(*name)))
    }
}
