//! A program and its facts in, consequences out, and kept so under insertion and deletion.
//!
//! Every derived row records the derivation by which it was first concluded, and these derivations never support each
//! other in a circle. Deletion is delete-and-rederive [1] restricted to them: a row loses its support only when its
//! recorded derivation loses an atom, where the original algorithm over-deletes whatever *some* derivation loses. What
//! is over-deleted is rederived stratum by stratum, so that a deletion seldom spreads.
//!
//! [1] Gupta, Mumick, Subrahmanian, "Maintaining views incrementally", SIGMOD 1993.

use std::sync::Arc;

use rustc_hash::FxHashSet;
use smallvec::SmallVec;

use crate::equality::Equality;
use crate::error::Error;
use crate::fact::{Arguments, Fact};
use crate::limits::Limits;
use crate::maintain::{Maintenance, state_change};
use crate::network::{Network, SAME_AS, compile};
use crate::record::Records;
use crate::rule::{Program, Rule};
use crate::store::{Store, columns, state};
use crate::symbol::{Symbol, Symbols};

/// Joins are planned anew when the facts have grown by this factor ...
const REPLAN_FACTOR: usize = 4;
/// ... of at least so many.
const REPLAN_FROM: usize = 32;

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
    /// Rules that are switched off.
    pub(crate) disabled: Vec<Rule>,
    /// Where `owl:sameAs` is equality, the names of each individual; the store then knows one of each.
    pub(crate) equality: Option<Arc<Equality>>,
}

impl Engine {
    /// Derives everything that follows.
    ///
    /// # Errors
    /// All errors of all rules: R2xx, R302, R303; or R301 where the rules do not come to an end.
    pub fn new(
        symbols: Symbols,
        program: Program,
        facts: impl IntoIterator<Item = Fact>,
    ) -> Result<Self, Vec<Error>> {
        Self::with_limits(symbols, program, facts, Limits::default())
    }

    /// As [`Engine::new`], within limits for this derivation and each later update.
    ///
    /// # Errors
    /// As [`Engine::new`]; or R304 where the evaluation was interrupted.
    pub fn with_limits(
        symbols: Symbols,
        program: Program,
        facts: impl IntoIterator<Item = Fact>,
        limits: Limits,
    ) -> Result<Self, Vec<Error>> {
        let facts: Vec<Fact> = facts.into_iter().collect();
        if let Some(error) = facts.iter().find_map(|fact| check_fact(fact, &symbols).err()) {
            return Err(vec![error]);
        }
        let mut symbols = symbols;
        let same = program.equality.then(|| symbols.name(SAME_AS));
        let (program, symbols) = (Arc::new(program), Arc::new(symbols));
        let equality = same.map(|same| Arc::new(Equality::new(same, &program)));
        let (network, store, records) = (Arc::default(), Store::default(), Records::default());
        let mut engine =
            Self { symbols, program, network, store, records, limits, disabled: Vec::new(), equality };
        engine.build(facts)?;
        Ok(engine)
    }

    /// Derives everything from stated facts, in an engine that holds nothing.
    fn build(&mut self, facts: Vec<Fact>) -> Result<(), Vec<Error>> {
        let mut evaluated = Arc::clone(&self.program);
        if self.equality.is_some() {
            self.begin(facts);
        } else {
            self.store.state(facts);
        }
        if let Some(equality) = &mut self.equality {
            evaluated = Arc::new(equality.normal_program(&self.program));
            Arc::make_mut(equality).program = Arc::clone(&evaluated);
        }
        let network = compile(&evaluated, Arc::make_mut(&mut self.symbols), &mut self.store)?;
        self.records = Records::new(&network);
        self.network = Arc::new(network);
        Maintenance::new(self).derive_all().map_err(|error| vec![error])?;
        self.settle().map_err(|error| vec![error])
    }

    /// The limits of later updates.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Sets the limits of later updates. Where there is an interrupt, an update keeps what was there before until it ends, which
    /// costs a copy of each relation that changes.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// Changes which facts are stated and returns the net change of all facts that hold, stated or derived, sorted.
    ///
    /// Facts that are already stated, and deletions of facts that are not, change nothing.
    ///
    /// # Errors
    /// R301 where the step budget is used up, R304 where the evaluation was interrupted, R302 and R303; the engine is then
    /// as it was before.
    pub fn apply(&mut self, delta: Delta) -> Result<Delta, Error> {
        for fact in delta.insert.iter().chain(&delta.delete) {
            check_fact(fact, &self.symbols)?;
        }
        // To derive everything anew would take longer than whoever interrupts wants to wait.
        let before = self.limits.interrupt.is_some().then(|| self.clone());
        let result = match self.equality.take() {
            Some(equality) => self.apply_equally(equality, &delta),
            None => self.apply_plainly(delta),
        };
        result.map_err(|(error, undo)| {
            match before {
                Some(before) => *self = before,
                None => self.restore(&undo),
            }
            error
        })
    }

    /// On an error also what takes the change back.
    fn apply_plainly(&mut self, delta: Delta) -> Result<Delta, (Error, Delta)> {
        self.replan();
        let stated = state_change(self, delta);
        let mut maintenance = Maintenance::new(self);
        match maintenance.update(&stated) {
            Ok(()) => Ok(maintenance.finish()),
            Err(error) => Err((error, stated.undo())),
        }
    }

    /// As [`Engine::apply`], for rows of the store, which is in no defined state after an error.
    pub(crate) fn apply_rows(&mut self, delta: Delta) -> Result<Delta, Error> {
        self.replan();
        let stated = state_change(self, delta);
        let mut maintenance = Maintenance::new(self);
        maintenance.update(&stated)?;
        Ok(maintenance.finish())
    }

    /// Plans the joins anew once there are many more facts than they were planned for.
    fn replan(&mut self) {
        if self.store.len() > REPLAN_FACTOR * self.network.planned_for.max(REPLAN_FROM) {
            Arc::make_mut(&mut self.network).plan(&mut self.store, true);
        }
    }

    /// Derives everything anew after an update that was stopped, from what was stated before.
    pub(crate) fn restore(&mut self, undo: &Delta) {
        let (stated, gone) = (self.stated(), FxHashSet::from_iter(&undo.delete));
        let kept = stated.into_iter().filter(|fact| !gone.contains(fact));
        let facts: Vec<Fact> = kept.chain(undo.insert.iter().cloned()).collect();
        let without = Limits { steps: u64::MAX, interrupt: None };
        let limits = std::mem::replace(&mut self.limits, without);
        if let Some(equality) = &mut self.equality {
            *equality = Arc::new(equality.emptied(&self.program));
            self.store = Store::default();
            // It was without errors and ended within the budget before, and so does now without one.
            let _ = self.build(facts);
        } else {
            for relation in &mut self.store.relations {
                Arc::make_mut(relation).clear_all();
            }
            self.records = Records::new(&self.network);
            self.store.state(facts);
            let _ = Maintenance::new(self).derive_all();
        }
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

    /// The rules.
    pub fn program(&self) -> &Program {
        &self.program
    }
}

fn check_fact(fact: &Fact, symbols: &Symbols) -> Result<(), Error> {
    if fact.arguments.len() > 32 {
        return Err(Error::FactArity { count: fact.arguments.len() });
    }
    let mut used = std::iter::once(fact.predicate).chain(fact.arguments.iter().copied());
    match used.find(|symbol| symbol.index() >= symbols.len()) {
        Some(symbol) => Err(Error::UnknownSymbol { index: symbol.index() }),
        None => Ok(()),
    }
}
