//! Evaluation of a program, and its incremental maintenance under insertion and deletion of facts.
//!
//! Every derived row (stored fact) records one derivation, by which it was found, and the recorded derivations never
//! support each other in a circle. Deletion is delete-and-rederive [1], restricted to the recorded derivations: a row
//! is over-deleted only if a change affects its recorded derivation. The original algorithm over-deletes a row if a
//! change affects *any* of its derivations. Over-deleted rows are rederived stratum by stratum, so that a deletion
//! seldom propagates far.
//!
//! [1] Gupta, Mumick, Subrahmanian, "Maintaining views incrementally", SIGMOD 1993.

use std::sync::Arc;

use rustc_hash::FxHashSet;
use tracing::field::Empty;
use tracing::info_span;

use crate::engine::{Delta, Engine};
use crate::equality::Equality;
use crate::error::{Error, Errors};
use crate::fact::Fact;
use crate::limits::Limits;
use crate::maintain::{Maintenance, state_change};
use crate::network::{compile, without_plans};
use crate::record::Records;
use crate::rule::Program;
use crate::store::Store;
use crate::symbol::Symbols;
use crate::vocabulary::SAME_AS;

/// The joins are planned again if the number of facts exceeds this multiple of the number at the last
/// planning.
const REPLAN_FACTOR: usize = 4;
/// Lower limit on the number of facts that is multiplied by [`REPLAN_FACTOR`], so that small engines are not planned
/// again after every update.
const REPLAN_FROM: usize = 32;

impl Engine {
    /// Creates an engine and derives all facts that follow from stated facts.
    ///
    /// # Errors
    /// Returns one of the following:
    /// - the first invalid fact (R302, R303);
    /// - otherwise the errors of all rules (R2xx, R302), of which R206 and R208 (no stratification) are reported only
    ///   if there is no other error;
    /// - otherwise R301, if the derivation exceeds the step budget.
    pub fn new(
        symbols: Symbols,
        program: Program,
        facts: impl IntoIterator<Item = Fact>,
    ) -> Result<Self, Errors> {
        Self::with_limits(symbols, program, facts, Limits::default())
    }

    /// Checks rules. Neither plans nor evaluates them, so that no budget is necessary.
    ///
    /// # Errors
    /// Returns the errors of all rules (R2xx, R302), of which R206 and R208 are reported only if there is no other
    /// error.
    pub fn check(program: &Program, symbols: &Symbols) -> Result<(), Errors> {
        without_plans(program, &mut symbols.clone(), &mut Store::default()).map(|_| ())
    }

    /// Creates an engine and derives all facts that follow from stated facts. The limits apply to this
    /// derivation and to each later update.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::new`], or R304 if the evaluation was interrupted.
    pub fn with_limits(
        symbols: Symbols,
        program: Program,
        facts: impl IntoIterator<Item = Fact>,
        limits: Limits,
    ) -> Result<Self, Errors> {
        let facts: Vec<Fact> = facts.into_iter().collect();
        let span =
            info_span!("derive", rules = program.rules.len(), stated = facts.len(), facts = Empty).entered();
        if let Some(error) = facts.iter().find_map(|fact| check_fact(fact, &symbols).err()) {
            return Err(vec![error].into());
        }
        let mut symbols = symbols;
        let same_as = program.equality.then(|| symbols.name(SAME_AS));
        let (program, symbols) = (Arc::new(program), Arc::new(symbols));
        let equality = same_as.map(|same_as| Arc::new(Equality::new(same_as, &program)));
        let (network, store, records) = (Arc::default(), Store::default(), Records::default());
        let mut engine = Self { symbols, program, network, store, records, limits, equality };
        engine.build(facts)?;
        span.record("facts", engine.store.len());
        Ok(engine)
    }

    fn build(&mut self, facts: Vec<Fact>) -> Result<(), Errors> {
        let mut evaluated = Arc::clone(&self.program);
        if self.equality.is_some() {
            self.state_initial_facts(facts);
        } else {
            self.store.insert_stated(facts);
        }
        if let Some(equality) = &mut self.equality {
            evaluated = Arc::new(equality.normal_program(&self.program));
            Arc::make_mut(equality).program = Arc::clone(&evaluated);
        }
        let symbols = Arc::make_mut(&mut self.symbols);
        let network = compile(&evaluated, symbols, &mut self.store, &self.limits)?;
        self.records = Records::new(&network);
        self.network = Arc::new(network);
        Maintenance::new(self).derive_all()?;
        self.join_derived_pairs().map_err(Errors::from)
    }

    /// Changes the set of stated facts. Returns the net change of all facts that hold, stated or derived,
    /// sorted.
    ///
    /// Insertions of facts that are already stated and deletions of facts that are not stated have no
    /// effect.
    ///
    /// # Errors
    /// Returns R301 if the step budget is exhausted, R302 for an unknown symbol, R303 for a fact with too
    /// many arguments, and R304 if the evaluation was interrupted.
    /// After an error, the stated facts and all conclusions are the same as before.
    pub fn apply(&mut self, delta: Delta) -> Result<Delta, Error> {
        let span = info_span!("update", stated = delta.insert.len() + delta.delete.len(), changed = Empty);
        let _entered = span.enter();
        for fact in delta.insert.iter().chain(&delta.delete) {
            check_fact(fact, &self.symbols)?;
        }
        // After an interrupt, the caller expects a prompt return. Restoring a copy is faster than deriving all facts
        // again.
        let before = self.limits.interrupt.is_some().then(|| self.clone());
        let result = match self.equality.take() {
            Some(equality) => self.apply_equally(equality, &delta, None),
            None => self.apply_plainly(delta),
        };
        if let Ok(changed) = &result {
            span.record("changed", changed.insert.len() + changed.delete.len());
        }
        result.map_err(|(error, undo)| {
            match before {
                Some(before) => *self = before,
                None => self.restore(&undo),
            }
            error
        })
    }

    /// Applies an update in an engine without equality, and returns the changes of all facts. An error comes with the
    /// delta that restores the stated facts.
    pub(crate) fn apply_plainly(&mut self, delta: Delta) -> Result<Delta, (Error, Delta)> {
        self.replan().map_err(|error| (error, Delta::default()))?;
        let stated = state_change(self, delta);
        let mut maintenance = Maintenance::new(self);
        match maintenance.update(&stated) {
            Ok(()) => Ok(maintenance.finish()),
            Err(error) => Err((error, stated.undo())),
        }
    }

    /// Applies a change of the stated facts like [`Engine::apply`], but with rows of the store instead of facts. With
    /// equality, a row contains the representatives of the classes of equal names. Returns the change of rows. After
    /// an error, the store is in an undefined state.
    pub(crate) fn apply_rows(&mut self, delta: Delta) -> Result<Delta, Error> {
        self.replan()?;
        let stated = state_change(self, delta);
        let mut maintenance = Maintenance::new(self);
        maintenance.update(&stated)?;
        Ok(maintenance.finish())
    }

    fn replan(&mut self) -> Result<(), Error> {
        if self.store.len() <= REPLAN_FACTOR * self.network.planned_for.max(REPLAN_FROM) {
            return Ok(());
        }
        let network = Arc::make_mut(&mut self.network);
        network.plan(&mut self.store, true, (&self.program, &self.limits))
    }

    pub(crate) fn restore(&mut self, undo: &Delta) {
        let (stated, undone) = (self.stated(), FxHashSet::from_iter(&undo.delete));
        let previous = stated.into_iter().filter(|fact| !undone.contains(fact));
        let facts: Vec<Fact> = previous.chain(undo.insert.iter().cloned()).collect();
        let unlimited = Limits { steps: u64::MAX, interrupt: None };
        let limits = std::mem::replace(&mut self.limits, unlimited);
        if let Some(equality) = &mut self.equality {
            *equality = Arc::new(equality.without_facts(&self.program));
            self.store = Store::default();
            // The previous rules and facts were accepted before, so their evaluation can fail only by a limit. No limit
            // applies here.
            let _ = self.build(facts);
        } else {
            for relation in &mut self.store.relations {
                Arc::make_mut(relation).clear_all();
            }
            self.records = Records::new(&self.network);
            self.store.insert_stated(facts);
            let _ = Maintenance::new(self).derive_all();
        }
        self.limits = limits;
    }
}

pub(crate) fn check_fact(fact: &Fact, symbols: &Symbols) -> Result<(), Error> {
    // An index holds the set of its columns as the bits of a `u32`.
    if fact.arguments.len() > 32 {
        return Err(Error::FactArity { count: fact.arguments.len() });
    }
    let mut used = std::iter::once(fact.predicate).chain(fact.arguments.iter().copied());
    match used.find(|symbol| symbol.index() >= symbols.len()) {
        Some(symbol) => Err(Error::UnknownSymbol { index: symbol.index() }),
        None => Ok(()),
    }
}
