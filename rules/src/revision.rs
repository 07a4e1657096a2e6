//! Revision of the rules of a running engine: computes the change of all facts from a change of the
//! program.
//!
//! Unchanged rules keep their recorded derivations. The conclusions of a removed rule lose their
//! support, as if a fact of its body was deleted, and are rederived if another rule derives them. A new
//! rule is evaluated once over all facts. Without an error, all facts are derived again only if the heads of an
//! unchanged rule no longer lie in one stratum, if equality is switched off, or if [`Engine::set_program`] switches
//! equality on.

use std::collections::BTreeMap;
use std::sync::Arc;

use rustc_hash::FxHashSet;

use crate::apply::check_fact;
use crate::engine::{Delta, Engine};
use crate::equality::Equality;
use crate::error::{Error, Errors};
use crate::fact::Fact;
use crate::maintain::{Maintenance, state_change};
use crate::network::{Revision, compile, revise};
use crate::record::Records;
use crate::rule::{Program, Rule, RuleIdentity};
use crate::store::{RelationId, Store, state};
use crate::vocabulary::SAME_AS;

impl Engine {
    /// Replaces the rules and returns the net change of all facts that hold, sorted. Unless equality is
    /// switched on or off, usually only consequences of the difference between the programs are derived again.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::with_limits`]. After an error, the engine is in its previous state.
    pub fn set_program(&mut self, program: Program) -> Result<Delta, Errors> {
        if self.equality.is_some() && program.equality {
            return self.change(Delta::default(), program);
        }
        if self.equality.is_some() || program.equality {
            return self.rebuild(program);
        }
        let symbols = Arc::make_mut(&mut self.symbols);
        let revision =
            revise(&self.network, &self.program, &program, symbols, &mut self.store, &self.limits)?;
        let Some(revision) = revision else { return self.rebuild(program) };
        let previous = (Arc::clone(&self.network), Arc::clone(&self.program));
        self.program = Arc::new(program);
        self.revise(revision, Delta::default()).map_err(|error| {
            (self.network, self.program) = previous;
            self.restore(&Delta::default());
            error.into()
        })
    }

    /// Changes the stated facts and the rules in one step, and returns the net change of all facts that
    /// hold, sorted. If the program has equality and the engine does not, equality is switched on. It then
    /// remains on.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::with_limits`] and [`Engine::apply`]. After an error, the engine is in its
    /// previous state.
    pub fn change(&mut self, delta: Delta, program: Program) -> Result<Delta, Errors> {
        for fact in delta.insert.iter().chain(&delta.delete) {
            check_fact(fact, &self.symbols)?;
        }
        let before = self.clone();
        let change = if self.equality.is_some() || program.equality {
            self.change_equally(delta, program)
        } else {
            self.change_plainly(delta, program)
        };
        if change.is_err() {
            *self = before;
        }
        change
    }

    /// Changes the stated facts and the rules of an engine without equality; the new rules may have it.
    /// Deletes facts first, so that new rules do not match deleted facts.
    fn change_plainly(&mut self, delta: Delta, program: Program) -> Result<Delta, Errors> {
        let inserted: FxHashSet<&Fact> = delta.insert.iter().collect();
        let delete = delta.delete.iter().filter(|fact| !inserted.contains(fact)).cloned().collect();
        let deletions = self.apply(Delta { insert: Vec::new(), delete })?;
        let changed = self.set_program(program)?;
        let insertions = self.apply(Delta { insert: delta.insert, delete: Vec::new() })?;
        Ok(net([deletions, changed, insertions]))
    }

    fn change_equally(&mut self, mut delta: Delta, mut program: Program) -> Result<Delta, Errors> {
        program.equality = true;
        if self.equality.is_none() && self.derives_pairs() {
            return self.change_plainly(delta, program);
        }
        let switched = if self.equality.is_none() { self.switch_on(&mut delta)? } else { Delta::default() };
        let Some(equality) = self.equality.take() else { return Ok(switched) };
        let change = self.apply_equally(equality, &delta, Some(program)).map_err(|(error, _)| error)?;
        Ok(net([switched, change]))
    }

    fn derives_pairs(&mut self) -> bool {
        let same_as = self.symbols_mut().name(SAME_AS);
        let mut pairs = self.matching_rows(same_as, &[None, None]);
        pairs.any(|row| !self.is_asserted(&Fact::new(same_as, row.iter().copied())))
    }

    /// Switches equality on, under the condition that no rule derives an `owl:sameAs` pair yet. The stated pairs are
    /// retracted and, unless `delta` deletes them, added to the insertions of `delta`. Returns the change of the
    /// facts.
    fn switch_on(&mut self, delta: &mut Delta) -> Result<Delta, Error> {
        let same_as = self.symbols_mut().name(SAME_AS);
        let equality = Equality::new(same_as, &self.program);
        let deleted: FxHashSet<&Fact> = delta.delete.iter().collect();
        let pairs =
            self.matching_rows(same_as, &[None, None]).map(|row| Fact::new(same_as, row.iter().copied()));
        let stated: Vec<Fact> = pairs.filter(|pair| self.is_asserted(pair)).collect();
        let remaining_pairs: Vec<Fact> =
            stated.iter().filter(|pair| !deleted.contains(pair)).cloned().collect();
        delta.insert.extend(remaining_pairs);
        let retracted = self.apply(Delta { insert: Vec::new(), delete: stated })?;
        let relation = self.store.relation(same_as, 2);
        Arc::make_mut(&mut self.network).same_as = Some(relation);
        self.equality = Some(Arc::new(equality));
        Ok(retracted)
    }

    /// Adds rules and returns the net change of all facts that hold, sorted.
    ///
    /// # Errors
    /// Returns the errors of [`Engine::with_limits`]. After an error, the engine is in its previous state.
    pub fn add_rules(&mut self, rules: impl IntoIterator<Item = Rule>) -> Result<Delta, Errors> {
        let mut program = Program::clone(&self.program);
        program.rules.extend(rules);
        self.set_program(program)
    }

    /// Removes every rule with this identity and returns the net change of all facts that hold, sorted.
    ///
    /// # Errors
    /// Returns R301 if the derivation exceeds the step budget, and R304 if the evaluation was interrupted.
    /// After an error, the engine is in its previous state.
    pub fn remove_rule(&mut self, identity: &RuleIdentity) -> Result<Delta, Errors> {
        let mut program = Program::clone(&self.program);
        program.rules.retain(|rule| rule.identity != *identity);
        self.set_program(program)
    }

    /// Changes the stated rows by `delta`, and replaces the rules `old` by `new`. Both programs contain representatives
    /// in place of other names. Returns the net change of rows. After an error, the engine is in an undefined state.
    ///
    /// In each stratum, unsupported conclusions are deleted before any rule derives new ones. The reason is that only a
    /// spanning tree of the pairs of an equality class is stored. No pair of the tree may be deleted after
    /// the other pairs have been derived and dropped. If the rules cannot be revised, all facts are derived again.
    pub(crate) fn replace_rules(
        &mut self,
        delta: Delta,
        old: &Program,
        new: &Program,
    ) -> Result<Delta, Error> {
        let symbols = Arc::make_mut(&mut self.symbols);
        let revision =
            revise(&self.network, old, new, symbols, &mut self.store, &self.limits).map_err(first)?;
        if let Some(revision) = revision {
            return self.revise(revision, delta);
        }
        let before: FxHashSet<Fact> = self.rows_with(0).collect();
        state_change(self, delta);
        let stated = self.rows_with(state::ASSERTED).collect();
        self.store = Store::default();
        self.store.insert_stated(stated);
        let symbols = Arc::make_mut(&mut self.symbols);
        let network = compile(new, symbols, &mut self.store, &self.limits).map_err(first)?;
        self.records = Records::new(&network);
        self.network = Arc::new(network);
        Maintenance::new(self).derive_all()?;
        let after: FxHashSet<Fact> = self.rows_with(0).collect();
        let insert = after.difference(&before).cloned().collect();
        Ok(Delta { insert, delete: before.difference(&after).cloned().collect() })
    }

    fn revise(&mut self, revision: Revision, delta: Delta) -> Result<Delta, Error> {
        let Revision { network, removed, added } = revision;
        let heads: FxHashSet<RelationId> = removed
            .iter()
            .flat_map(|&number| &self.network.rules[number as usize].heads)
            .map(|head| head.relation)
            .collect();
        // The bindings of removed rules are needed until their conclusions are deleted.
        self.records.revise(&network, |_| false);
        self.network = Arc::new(network);
        let stated = state_change(self, delta);
        let mut maintenance = Maintenance::new(self);
        maintenance.update_with_rules(&stated, &removed, &heads, &added)?;
        let change = maintenance.finish();
        let network = Arc::clone(&self.network);
        self.records.revise(&network, |number| removed.contains(&number));
        Ok(change)
    }

    fn rebuild(&mut self, program: Program) -> Result<Delta, Errors> {
        // Sorted, so that the order does not depend on the history.
        let stated = self.stated_facts();
        let engine = Self::with_limits(self.symbols().clone(), program, stated, self.limits.clone())?;
        let insert = engine.facts().filter(|fact| !self.holds(fact)).collect();
        let delete = self.facts().filter(|fact| !engine.holds(fact)).collect();
        *self = engine;
        Ok(Delta { insert, delete })
    }
}

fn net(changes: impl IntoIterator<Item = Delta>) -> Delta {
    let mut signs: BTreeMap<Fact, i8> = BTreeMap::new();
    for Delta { insert, delete } in changes {
        for (facts, sign) in [(insert, 1), (delete, -1)] {
            for fact in facts {
                *signs.entry(fact).or_default() += sign;
            }
        }
    }
    let mut net = Delta::default();
    for (fact, sign) in signs {
        match sign {
            1 => net.insert.push(fact),
            -1 => net.delete.push(fact),
            _ => {}
        }
    }
    net
}

/// Returns the first of several errors. A change under equality reports only one error.
fn first(errors: Errors) -> Error {
    errors.into_iter().next().unwrap_or(Error::UnknownSymbol { index: 0 })
}
