//! Rules that come and go while the engine runs: from a change of the program to the change of what holds.
//!
//! The rules that stay keep their recorded derivations. What a removed rule concluded loses its support, as if a fact
//! of its body had gone, and is rederived where another rule concludes it too; a new rule is evaluated once over
//! everything that holds. Everything is derived again only
//! where the strata of the rules that stay fall apart, or where equality is switched off.

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
    /// Replaces the rules and returns the net change of all facts that hold, sorted. The cost depends on the rules in
    /// which the programs differ and on what follows from them.
    ///
    /// # Errors
    /// As [`Engine::new`]; the engine is then as it was before.
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
        let old = (Arc::clone(&self.network), Arc::clone(&self.program));
        self.program = Arc::new(program);
        self.revise(revision, Delta::default()).map_err(|error| {
            (self.network, self.program) = old;
            self.restore(&Delta::default());
            error.into()
        })
    }

    /// Changes the stated facts and the rules in one step, and returns the net change of all facts that hold, sorted. Where the
    /// program treats `owl:sameAs` as equality and the engine's did not, equality is switched on; it stays on.
    ///
    /// # Errors
    /// As [`Engine::new`] and [`Engine::apply`]; the engine is then as it was before.
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

    /// Deletes first, so that a rule that comes does not see what goes.
    fn change_plainly(&mut self, delta: Delta, program: Program) -> Result<Delta, Errors> {
        let kept: FxHashSet<&Fact> = delta.insert.iter().collect();
        let delete = delta.delete.iter().filter(|fact| !kept.contains(fact)).cloned().collect();
        let gone = self.apply(Delta { insert: Vec::new(), delete })?;
        let changed = self.set_program(program)?;
        let come = self.apply(Delta { insert: delta.insert, delete: Vec::new() })?;
        Ok(net([gone, changed, come]))
    }

    fn change_equally(&mut self, mut delta: Delta, mut program: Program) -> Result<Delta, Errors> {
        program.equality = true;
        let switched = if self.equality.is_none() { self.switch_on(&mut delta)? } else { Delta::default() };
        let Some(equality) = self.equality.take() else { return Ok(switched) };
        let change = self.apply_equally(equality, &delta, Some(program)).map_err(|(error, _)| error)?;
        Ok(net([switched, change]))
    }

    /// Makes `owl:sameAs` equality, of which no rule concludes a pair: stated pairs become part of the change.
    fn switch_on(&mut self, delta: &mut Delta) -> Result<Delta, Error> {
        let same = self.symbols_mut().name(SAME_AS);
        let equality = Equality::new(same, &self.program);
        let gone: FxHashSet<&Fact> = delta.delete.iter().collect();
        let pairs = self.matching_rows(same, &[None, None]).map(|row| Fact::new(same, row.iter().copied()));
        let stated: Vec<Fact> = pairs.filter(|pair| self.is_asserted(pair)).collect();
        let kept: Vec<Fact> = stated.iter().filter(|pair| !gone.contains(pair)).cloned().collect();
        delta.insert.extend(kept);
        let taken = self.apply(Delta { insert: Vec::new(), delete: stated })?;
        let relation = self.store.relation(same, 2);
        Arc::make_mut(&mut self.network).same = Some(relation);
        self.equality = Some(Arc::new(equality));
        Ok(taken)
    }

    /// Adds rules and returns the net change of all facts that hold, sorted.
    ///
    /// # Errors
    /// As [`Engine::new`]; the engine is then as it was before.
    pub fn add_rules(&mut self, rules: impl IntoIterator<Item = Rule>) -> Result<Delta, Errors> {
        let mut program = Program::clone(&self.program);
        program.rules.extend(rules);
        self.set_program(program)
    }

    /// Removes every rule with this identity and returns the net change of all facts that hold, sorted.
    ///
    /// # Errors
    /// R301 where what remains does not follow within the step budget; the engine is then as it was before.
    pub fn remove_rule(&mut self, identity: &RuleIdentity) -> Result<Delta, Errors> {
        let mut program = Program::clone(&self.program);
        program.rules.retain(|rule| rule.identity != *identity);
        self.set_program(program)
    }

    /// Changes the stated rows and the rules over representatives, and returns the net change of rows. After an error the
    /// engine is in no defined state.
    ///
    /// All conclusions are deleted that lose their support before anything is concluded: of pairs that make one class of
    /// names, only as many are stored as connect it, so none of these may be deleted after the others are found.
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
        self.store.state(stated);
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
        // The bindings of removed rules are needed until what they concluded is gone.
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
        let mut stated = self.stated();
        stated.sort_unstable();
        let engine = Self::with_limits(self.symbols().clone(), program, stated, self.limits.clone())?;
        let insert = engine.facts().filter(|fact| !self.holds(fact)).collect();
        let delete = self.facts().filter(|fact| !engine.holds(fact)).collect();
        *self = engine;
        Ok(Delta { insert, delete })
    }
}

/// Changes one after another as one, sorted.
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

/// Rules that were compiled before give at most the error that they no longer fit together.
fn first(errors: Errors) -> Error {
    errors.into_iter().next().unwrap_or(Error::UnknownSymbol { index: 0 })
}
