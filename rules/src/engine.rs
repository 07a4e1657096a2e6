//! Facts, rules and everything that follows from them, and what can be asked of it.

use std::sync::Arc;

use smallvec::SmallVec;

use crate::equality::Equality;
use crate::fact::{Arguments, Fact};
use crate::limits::Limits;
use crate::network::Network;
use crate::record::Records;
use crate::rule::Program;
use crate::store::{Store, columns, state};
use crate::symbol::{Symbol, Symbols};

/// A change: facts that begin and facts that cease to be stated (input) or to hold (output).
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Delta {
    /// What is new.
    pub insert: Vec<Fact>,
    /// What is gone. A fact that is in both lists of an input is stated afterwards.
    pub delete: Vec<Fact>,
}

/// Facts, rules, and everything that follows from them.
///
/// A clone answers what would be if: it shares everything with its original, and either copies a relation, the bindings
/// recorded for a rule or the symbols when it first changes them.
#[derive(Clone, Debug)]
pub struct Engine {
    pub(crate) symbols: Arc<Symbols>,
    pub(crate) program: Arc<Program>,
    pub(crate) network: Arc<Network>,
    pub(crate) store: Store,
    pub(crate) records: Records,
    pub(crate) limits: Limits,
    /// Where `owl:sameAs` is equality, the names of each individual; the store then knows one of each.
    pub(crate) equality: Option<Arc<Equality>>,
}

impl Engine {
    /// The limits of later updates.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Sets the limits of later updates. Where there is an interrupt, an update keeps what was there before until it ends, which
    /// costs a copy of each relation that changes.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// Everything that is stated.
    pub(crate) fn stated(&self) -> Vec<Fact> {
        match &self.equality {
            Some(equality) => equality.stated(self),
            None => self.rows_with(state::ASSERTED).collect(),
        }
    }

    /// Whether a fact holds.
    pub fn holds(&self, fact: &Fact) -> bool {
        match &self.equality {
            Some(equality) => equality.holds(self, fact),
            None => self.row_state(fact).is_some(),
        }
    }

    /// Whether a fact is stated, whether or not it would also be derived.
    pub fn is_asserted(&self, fact: &Fact) -> bool {
        match &self.equality {
            Some(equality) => equality.is_stated(self, fact),
            None => self.row_state(fact).is_some_and(|state| state & state::ASSERTED != 0),
        }
    }

    /// The state of a row, where it is in the store.
    pub(crate) fn row_state(&self, row: &Fact) -> Option<u8> {
        let relation = self.store.get(self.store.find(row.predicate, row.arguments.len())?);
        Some(relation.state(relation.find(&row.arguments)?))
    }

    /// Everything that holds, in the order of symbols.
    pub fn facts(&self) -> impl Iterator<Item = Fact> {
        let mut facts: Vec<Fact> = match &self.equality {
            Some(equality) => equality.facts(self, usize::MAX),
            None => self.rows_with(0).collect(),
        };
        facts.sort_unstable();
        facts.into_iter()
    }

    /// What holds and is not stated, in the order of the engine's history: equal histories give equal orders. That names stand
    /// for one individual is said of an individual of more than `most` names only by the pairs with its first name, from
    /// which the others follow.
    pub fn inferred_in_brief(&self, most: usize) -> Vec<Fact> {
        match &self.equality {
            Some(equality) => {
                let mut facts = equality.facts(self, most);
                facts.retain(|fact| !equality.is_stated(self, fact));
                facts
            }
            None => self.rows_where(|bits| bits & state::ASSERTED == 0).collect(),
        }
    }

    /// The predicates of all facts that hold, each with the number of its arguments, in no particular order; of some of them
    /// no fact holds any more.
    pub fn predicates(&self) -> impl Iterator<Item = (Symbol, usize)> {
        let relations = self.store.relations.iter();
        relations.filter_map(|relation| Some((relation.predicate?, relation.arity())))
    }

    /// The rows of the store with these state bits, those of constraints and aggregates left out.
    pub(crate) fn rows_with(&self, bits: u8) -> impl Iterator<Item = Fact> {
        self.rows_where(move |state| state & bits == bits)
    }

    fn rows_where(&self, fits: impl Fn(u8) -> bool + Copy) -> impl Iterator<Item = Fact> {
        let named = self.store.relations.iter().filter_map(|relation| Some((relation, relation.predicate?)));
        named.flat_map(move |(relation, predicate)| {
            let rows = relation.scan().filter(move |&row| fits(relation.state(row)));
            rows.map(move |row| Fact { predicate, arguments: SmallVec::from_slice(relation.row(row)) })
        })
    }

    /// The arguments of the facts of a predicate that agree with the pattern where it is given, by index where there
    /// is one. The order is that of the engine's history: equal histories give equal orders.
    pub fn matching<'a>(
        &'a self,
        predicate: Symbol,
        pattern: &'a [Option<Symbol>],
    ) -> impl Iterator<Item = Arguments> {
        let equality = self.equality.as_ref();
        let named = equality.map(|equality| equality.matching(self, predicate, pattern));
        let rows = named.is_none().then(|| self.matching_rows(predicate, pattern));
        let rows = rows.into_iter().flatten().map(Arguments::from_slice);
        named.into_iter().flatten().chain(rows)
    }

    /// As [`Engine::matching`], for rows of the store.
    pub(crate) fn matching_rows<'a>(
        &'a self,
        predicate: Symbol,
        pattern: &[Option<Symbol>],
    ) -> impl Iterator<Item = &'a [Symbol]> {
        let pattern: SmallVec<[Option<Symbol>; 4]> = SmallVec::from_slice(pattern);
        let relation = self.store.find(predicate, pattern.len()).map(|id| self.store.get(id));
        relation.into_iter().flat_map(move |relation| {
            let pattern = pattern.clone();
            let bound = (0..pattern.len()).filter(|&c| pattern[c].is_some()).fold(0, |mask, c| mask | 1 << c);
            let found = relation.best_index(bound).map(|(index, mask)| {
                let key: SmallVec<[Symbol; 4]> = columns(mask).filter_map(|column| pattern[column]).collect();
                relation.lookup(index, &key)
            });
            let scanned = found.is_none().then(|| relation.scan());
            let rows = found.into_iter().flatten().chain(scanned.into_iter().flatten());
            rows.map(|row| relation.row(row))
                .filter(move |row| row.iter().zip(&pattern).all(|(&v, wanted)| wanted.is_none_or(|w| w == v)))
        })
    }

    /// The interner that facts and rules refer to.
    pub fn symbols(&self) -> &Symbols {
        &self.symbols
    }

    /// The interner, to add names and literals for new facts.
    pub fn symbols_mut(&mut self) -> &mut Symbols {
        Arc::make_mut(&mut self.symbols)
    }

    /// Takes the names and values of an engine that began as a clone of this one, and has interned more since.
    pub fn adopt_symbols(&mut self, other: &Self) {
        self.symbols = Arc::clone(&other.symbols);
    }

    /// The rules.
    pub fn program(&self) -> &Program {
        &self.program
    }
}
