//! The engine: facts, rules and all consequences, with queries.

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

/// A change: facts to insert and delete (input), or facts that start and cease to hold (output).
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Delta {
    /// Facts that are added (to the stated facts, or to the facts that hold).
    pub insert: Vec<Fact>,
    /// Facts that are removed. A fact in both lists of an input is stated afterwards.
    pub delete: Vec<Fact>,
}

/// Rule engine: stated facts, rules, and all facts that follow from them.
///
/// A clone answers hypothetical queries. The clone shares all data with its original. Original and clone
/// copy a relation, the recorded bindings of a rule or the symbols only before their first change of
/// these data.
#[derive(Clone, Debug)]
pub struct Engine {
    pub(crate) symbols: Arc<Symbols>,
    pub(crate) program: Arc<Program>,
    pub(crate) network: Arc<Network>,
    pub(crate) store: Store,
    pub(crate) records: Records,
    pub(crate) limits: Limits,
    /// Equality classes, if `owl:sameAs` is equality. The store then contains representatives only.
    pub(crate) equality: Option<Arc<Equality>>,
}

impl Engine {
    /// Returns the limits of later updates.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Sets the limits of later updates. With an interrupt, an update keeps the previous state until it
    /// ends, which costs a copy of each relation that changes.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
    }

    pub(crate) fn stated(&self) -> Vec<Fact> {
        match &self.equality {
            Some(equality) => equality.stated(self),
            None => self.rows_with(state::ASSERTED).collect(),
        }
    }

    /// Returns `true` if a fact holds.
    pub fn holds(&self, fact: &Fact) -> bool {
        match &self.equality {
            Some(equality) => equality.holds(self, fact),
            None => self.row_state(fact).is_some(),
        }
    }

    /// Returns `true` if a fact is stated, even if it also follows from other facts.
    pub fn is_asserted(&self, fact: &Fact) -> bool {
        match &self.equality {
            Some(equality) => equality.is_stated(self, fact),
            None => self.row_state(fact).is_some_and(|state| state & state::ASSERTED != 0),
        }
    }

    pub(crate) fn row_state(&self, row: &Fact) -> Option<u8> {
        let relation = self.store.get(self.store.find(row.predicate, row.arguments.len())?);
        Some(relation.state(relation.find(&row.arguments)?))
    }

    /// Returns the facts that are stated, in the order of symbols. With many equal names, this is much faster than
    /// filtering [`Engine::facts`].
    pub fn stated_facts(&self) -> Vec<Fact> {
        let mut facts = self.stated();
        facts.sort_unstable();
        facts
    }

    /// Returns all facts that hold, in the order of symbols.
    pub fn facts(&self) -> impl Iterator<Item = Fact> {
        let mut facts = self.facts_in_brief(usize::MAX);
        facts.sort_unstable();
        facts.into_iter()
    }

    /// Returns all facts that hold, in the order of the engine's history: equal histories give equal orders. Of the
    /// equalities of an individual with more than `max_names` names, the result contains only the pairs of its first
    /// name with each other name; the other equalities follow from them.
    pub fn facts_in_brief(&self, max_names: usize) -> Vec<Fact> {
        match &self.equality {
            Some(equality) => equality.facts(self, max_names),
            None => self.rows_with(0).collect(),
        }
    }

    /// Returns the facts of [`Engine::facts_in_brief`] that are not stated.
    pub fn inferred_in_brief(&self, max_names: usize) -> Vec<Fact> {
        match &self.equality {
            Some(equality) => {
                let mut facts = equality.facts(self, max_names);
                facts.retain(|fact| !equality.is_stated(self, fact));
                facts
            }
            None => self.rows_where(|bits| bits & state::ASSERTED == 0).collect(),
        }
    }

    /// Returns the predicates of all facts that hold, each with its number of arguments, in no particular
    /// order. The result may also contain predicates without facts.
    pub fn predicates(&self) -> impl Iterator<Item = (Symbol, usize)> {
        let relations = self.store.relations.iter();
        relations.filter_map(|relation| Some((relation.predicate?, relation.arity())))
    }

    pub(crate) fn rows_with(&self, bits: u8) -> impl Iterator<Item = Fact> {
        self.rows_where(move |state| state & bits == bits)
    }

    fn rows_where(&self, fits: impl Fn(u8) -> bool + Copy) -> impl Iterator<Item = Fact> {
        // Relations of constraints and aggregates have no predicate.
        let named = self.store.relations.iter().filter_map(|relation| Some((relation, relation.predicate?)));
        named.flat_map(move |(relation, predicate)| {
            let rows = relation.scan().filter(move |&row| fits(relation.state(row)));
            rows.map(move |row| Fact { predicate, arguments: SmallVec::from_slice(relation.row(row)) })
        })
    }

    /// Returns the arguments of the facts of a predicate that agree with the pattern in all columns that
    /// are not `None`. Uses an index if one exists. The order is that of the engine's history: equal
    /// histories give equal orders.
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
            let indexed = relation.best_index(bound).map(|(index, mask)| {
                let key: SmallVec<[Symbol; 4]> = columns(mask).filter_map(|column| pattern[column]).collect();
                relation.lookup(index, &key)
            });
            let scanned = indexed.is_none().then(|| relation.scan());
            let rows = indexed.into_iter().flatten().chain(scanned.into_iter().flatten());
            // The index may cover only some of the bound columns.
            rows.map(|row| relation.row(row))
                .filter(move |row| row.iter().zip(&pattern).all(|(&v, wanted)| wanted.is_none_or(|w| w == v)))
        })
    }

    /// Returns the interner of names and literals to which facts and rules refer.
    pub fn symbols(&self) -> &Symbols {
        &self.symbols
    }

    /// Returns the interner, to add names and literals for new facts.
    pub fn symbols_mut(&mut self) -> &mut Symbols {
        Arc::make_mut(&mut self.symbols)
    }

    /// Adopts the interner of `other`, a clone of this engine that has interned more symbols since.
    pub fn adopt_symbols(&mut self, other: &Self) {
        self.symbols = Arc::clone(&other.symbols);
    }

    /// Returns the rules.
    pub fn program(&self) -> &Program {
        &self.program
    }
}
