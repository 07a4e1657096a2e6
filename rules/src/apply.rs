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
use tracing::field::Empty;
use tracing::info_span;

use crate::engine::{Delta, Engine};
use crate::equality::Equality;
use crate::error::{Error, Errors};
use crate::fact::Fact;
use crate::limits::Limits;
use crate::maintain::{Maintenance, state_change};
use crate::network::compile;
use crate::record::Records;
use crate::rule::Program;
use crate::store::Store;
use crate::symbol::Symbols;
use crate::vocabulary::SAME_AS;

/// Joins are planned anew when the facts have grown by this factor ...
const REPLAN_FACTOR: usize = 4;
/// ... of at least so many.
const REPLAN_FROM: usize = 32;

impl Engine {
    /// Derives everything that follows.
    ///
    /// # Errors
    /// All errors of all rules: R2xx, R302, R303; or R301 where the rules do not come to an end.
    pub fn new(
        symbols: Symbols,
        program: Program,
        facts: impl IntoIterator<Item = Fact>,
    ) -> Result<Self, Errors> {
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
    ) -> Result<Self, Errors> {
        let facts: Vec<Fact> = facts.into_iter().collect();
        let span =
            info_span!("derive", rules = program.rules.len(), stated = facts.len(), facts = Empty).entered();
        if let Some(error) = facts.iter().find_map(|fact| check_fact(fact, &symbols).err()) {
            return Err(vec![error].into());
        }
        let mut symbols = symbols;
        let same = program.equality.then(|| symbols.name(SAME_AS));
        let (program, symbols) = (Arc::new(program), Arc::new(symbols));
        let equality = same.map(|same| Arc::new(Equality::new(same, &program)));
        let (network, store, records) = (Arc::default(), Store::default(), Records::default());
        let mut engine = Self { symbols, program, network, store, records, limits, equality };
        engine.build(facts)?;
        span.record("facts", engine.store.len());
        Ok(engine)
    }

    /// Derives everything from stated facts, in an engine that holds nothing.
    fn build(&mut self, facts: Vec<Fact>) -> Result<(), Errors> {
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
        let symbols = Arc::make_mut(&mut self.symbols);
        let network = compile(&evaluated, symbols, &mut self.store, &self.limits)?;
        self.records = Records::new(&network);
        self.network = Arc::new(network);
        Maintenance::new(self).derive_all()?;
        self.settle().map_err(Errors::from)
    }

    /// Changes which facts are stated and returns the net change of all facts that hold, stated or derived, sorted.
    ///
    /// Facts that are already stated, and deletions of facts that are not, change nothing.
    ///
    /// # Errors
    /// R301 where the step budget is used up, R304 where the evaluation was interrupted, R302 and R303; the engine is then
    /// as it was before.
    pub fn apply(&mut self, delta: Delta) -> Result<Delta, Error> {
        let span = info_span!("update", stated = delta.insert.len() + delta.delete.len(), changed = Empty);
        let _entered = span.enter();
        for fact in delta.insert.iter().chain(&delta.delete) {
            check_fact(fact, &self.symbols)?;
        }
        // To derive everything anew would take longer than whoever interrupts wants to wait.
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

    /// On an error also what takes the change back.
    pub(crate) fn apply_plainly(&mut self, delta: Delta) -> Result<Delta, (Error, Delta)> {
        self.replan().map_err(|error| (error, Delta::default()))?;
        let stated = state_change(self, delta);
        let mut maintenance = Maintenance::new(self);
        match maintenance.update(&stated) {
            Ok(()) => Ok(maintenance.finish()),
            Err(error) => Err((error, stated.undo())),
        }
    }

    /// As [`Engine::apply`], for rows of the store, which is in no defined state after an error.
    pub(crate) fn apply_rows(&mut self, delta: Delta) -> Result<Delta, Error> {
        self.replan()?;
        let stated = state_change(self, delta);
        let mut maintenance = Maintenance::new(self);
        maintenance.update(&stated)?;
        Ok(maintenance.finish())
    }

    /// Plans the joins anew once there are many more facts than they were planned for.
    fn replan(&mut self) -> Result<(), Error> {
        if self.store.len() <= REPLAN_FACTOR * self.network.planned_for.max(REPLAN_FROM) {
            return Ok(());
        }
        let network = Arc::make_mut(&mut self.network);
        network.plan(&mut self.store, true, (&self.program, &self.limits))
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
}

pub(crate) fn check_fact(fact: &Fact, symbols: &Symbols) -> Result<(), Error> {
    if fact.arguments.len() > 32 {
        return Err(Error::FactArity { count: fact.arguments.len() });
    }
    let mut used = std::iter::once(fact.predicate).chain(fact.arguments.iter().copied());
    match used.find(|symbol| symbol.index() >= symbols.len()) {
        Some(symbol) => Err(Error::UnknownSymbol { index: symbol.index() }),
        None => Ok(()),
    }
}
