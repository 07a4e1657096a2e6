//! Incremental maintenance: computes the change of all facts from a change of the stated facts, stratum by
//! stratum.
//!
//! In each stratum that the change affects: 1. over-delete the rows whose recorded derivation may no longer hold; 2.
//! rederive the over-deleted rows that have another derivation from the remaining facts; 3. insert semi-naively the
//! consequences of new, rederived and removed rows.

use std::cell::RefCell;
use std::sync::Arc;

use rustc_hash::FxHashSet;
use smallvec::SmallVec;

use crate::engine::{Delta, Engine};
use crate::error::Error;
use crate::fact::{Arguments, Fact};
use crate::fixpoint::{Buffers, Matches, PlanId, Round, Seed, Start, resolve, run};
use crate::forest::Forest;
use crate::limits::Budget;
use crate::network::{Network, Stratum};
use crate::plan::HIDDEN;
use crate::store::{Record, RelationId, Row, state};
use crate::symbol::{Symbol, Symbols};

/// Upper limit on the number of starts (pairs of a plan and a start row) per run of the crepe program. It
/// bounds the memory of partial matches.
const CHUNK: usize = 2048;

type Rows = Vec<(RelationId, Row)>;

/// A change of the stated facts that has been applied to the store, with the affected rows.
#[derive(Default)]
pub(crate) struct Stated {
    /// The change without insertions of facts that are already stated, and without deletions of facts that are not
    /// stated.
    effective: Delta,
    added: Rows,
    doomed: Rows,
}

impl Stated {
    pub fn undo(self) -> Delta {
        Delta { insert: self.effective.delete, delete: self.effective.insert }
    }
}

/// Marks the facts of `delta` in the store as stated or no longer stated, without running any rule.
/// Returns the part of the change that had an effect.
pub(crate) fn state_change(engine: &mut Engine, delta: Delta) -> Stated {
    let store = &mut engine.store;
    let mut stated = Stated::default();
    let inserted: FxHashSet<&Fact> = delta.insert.iter().collect();
    for fact in delta.delete.iter().filter(|fact| !inserted.contains(fact)) {
        let Some(id) = store.find(fact.predicate, fact.arguments.len()) else { continue };
        let relation = store.get_mut(id);
        let Some(row) = relation.find(&fact.arguments) else { continue };
        if relation.state(row) & state::ASSERTED == 0 {
            continue;
        }
        relation.clear(row, state::ASSERTED);
        // A row with a recorded derivation is not deleted for now; only its assertion ends.
        if relation.record(row) == Record::NONE {
            relation.set(row, state::DOOMED);
            stated.doomed.push((id, row));
        }
        stated.effective.delete.push(fact.clone());
    }
    for fact in delta.insert {
        let id = store.relation(fact.predicate, fact.arguments.len());
        let relation = store.get_mut(id);
        match relation.find(&fact.arguments) {
            Some(row) if relation.state(row) & state::ASSERTED != 0 => continue,
            Some(row) => relation.set(row, state::ASSERTED),
            None => {
                let bits = state::ASSERTED | state::NEW;
                stated.added.push((id, relation.insert(&fact.arguments, bits, Record::NONE)));
            }
        }
        stated.effective.insert.push(fact);
    }
    stated
}

pub(crate) struct Maintenance<'a> {
    engine: &'a mut Engine,
    network: Arc<Network>,
    /// Rows that did not hold before the update.
    added: Rows,
    /// Rows that held before the update and may no longer hold.
    doomed: Rows,
    /// Rows derived in the current semi-naive round; the rules cannot match them before the next round.
    pending: Rows,
    /// Indexed by stratum: `true` if a change affects the rules of the stratum.
    touched: Vec<bool>,
    /// Names connected by `owl:sameAs` pairs that this update has derived. A further pair of connected names is
    /// not stored.
    joined: Forest,
    budget: Budget,
    buffers: Buffers,
}

impl<'a> Maintenance<'a> {
    pub fn new(engine: &'a mut Engine) -> Self {
        let network = Arc::clone(&engine.network);
        let touched = vec![false; network.strata.len()];
        let budget = Budget::new(&engine.limits);
        let (added, doomed, pending) = (Vec::new(), Vec::new(), Vec::new());
        let (joined, buffers) = (Forest::default(), Buffers::default());
        Self { engine, network, added, doomed, pending, touched, joined, budget, buffers }
    }

    pub fn derive_all(mut self) -> Result<(), Error> {
        let network = Arc::clone(&self.network);
        for stratum in &network.strata {
            self.run_initial_plans(&stratum.initial)?;
            self.saturate(stratum)?;
        }
        for (relation, row) in self.added {
            self.engine.store.get_mut(relation).clear(row, state::NEW);
        }
        Ok(())
    }

    /// Updates the derived facts after a change of the stated facts. Rows that no longer hold remain
    /// marked as doomed; [`Maintenance::finish`] removes them.
    pub fn update(&mut self, stated: &Stated) -> Result<(), Error> {
        self.start_update(stated);
        self.propagate(&FxHashSet::default())
    }

    fn start_update(&mut self, stated: &Stated) {
        self.added.clone_from(&stated.added);
        self.doomed.clone_from(&stated.doomed);
        for &(relation, _) in stated.added.iter().chain(&stated.doomed) {
            self.touch(relation);
        }
    }

    /// Updates the derived facts after a change of stated facts and rules. `removed` and `added` contain
    /// the numbers of the removed and the new compiled rules, `heads` the head relations of the removed
    /// rules.
    pub fn update_with_rules(
        &mut self,
        stated: &Stated,
        removed: &FxHashSet<u32>,
        heads: &FxHashSet<RelationId>,
        added: &FxHashSet<u32>,
    ) -> Result<(), Error> {
        self.start_update(stated);
        // Relations are visited in a fixed order, so that equal histories give equal results.
        let mut ids: Vec<RelationId> = heads.iter().copied().collect();
        ids.sort_unstable();
        for id in ids {
            let Engine { store, records, .. } = &mut *self.engine;
            let relation = store.get_mut(id);
            let is_from_removed_rule = |&row: &Row| removed.contains(&relation.record(row).rule);
            for row in relation.scan().filter(is_from_removed_rule).collect::<Vec<_>>() {
                if relation.state(row) & state::ASSERTED == 0 {
                    relation.set(row, state::DOOMED);
                    self.doomed.push((id, row));
                } else {
                    records.remove(relation.record(row));
                    relation.set_record(row, Record::NONE);
                }
            }
            self.touch(id);
        }
        self.propagate(added)
    }

    fn propagate(&mut self, new_rules: &FxHashSet<u32>) -> Result<(), Error> {
        let network = Arc::clone(&self.network);
        for (number, stratum) in network.strata.iter().enumerate() {
            let is_new = |plan: PlanId| new_rules.contains(&network.plans[plan as usize].rule);
            let initial = stratum.initial.iter().filter(|_| !new_rules.is_empty());
            let new: Vec<_> = initial.copied().filter(|&(_, plan)| is_new(plan)).collect();
            if self.touched[number] || !new.is_empty() {
                self.over_delete(stratum)?;
                self.rederive(stratum)?;
                self.run_initial_plans(&new)?;
                self.insert(stratum)?;
            }
        }
        Ok(())
    }

    /// Runs each plan from all visible rows of its relation, or from the empty match if the relation is
    /// `None`.
    fn run_initial_plans(&mut self, plans: &[(Option<RelationId>, PlanId)]) -> Result<(), Error> {
        for (relation, plan) in plans {
            if let Some(id) = *relation {
                let relation = self.engine.store.get(id);
                let visible = relation.scan().filter(|&row| relation.state(row) & HIDDEN == 0);
                let rows: Rows = visible.map(|row| (id, row)).collect();
                self.run(&rows, |_| Some(std::slice::from_ref(plan)), false)?;
            } else {
                self.run_chunk(&[Seed { plan: *plan, start: Start::Nothing }], &[], false)?;
            }
        }
        Ok(())
    }

    /// Removes the doomed rows, i.e. the over-deleted rows that were not rederived. Returns the net change of
    /// the facts.
    pub fn finish(self) -> Delta {
        let Engine { store, records, .. } = self.engine;
        let mut delta = Delta::default();
        for (id, row) in self.added {
            let relation = store.get_mut(id);
            relation.clear(row, state::NEW);
            delta.insert.extend(relation.fact(row));
        }
        for (id, row) in self.doomed {
            let relation = store.get_mut(id);
            if relation.state(row) & state::DOOMED != 0 {
                delta.delete.extend(relation.fact(row));
                records.remove(relation.record(row));
                relation.remove(row);
            }
        }
        delta.insert.sort_unstable();
        delta.delete.sort_unstable();
        delta
    }

    fn touch(&mut self, relation: RelationId) {
        touch(&mut self.touched, &self.network, relation);
    }

    /// Over-deletes rows by marking them as doomed. These are the rows whose recorded derivation depends on a
    /// doomed row, on the absence of a new row, or on a changed group of an aggregate. Stated rows only lose
    /// their recorded derivation.
    fn over_delete(&mut self, stratum: &Stratum) -> Result<(), Error> {
        // A new row invalidates derivations that depend on its absence.
        let appeared = self.added.clone();
        self.run(&appeared, |relation| stratum.negative.get(&relation).map(Vec::as_slice), true)?;
        self.run_groups(stratum, true)?;
        let mut processed = 0;
        while processed < self.doomed.len() {
            let front = self.doomed[processed..].to_vec();
            processed = self.doomed.len();
            self.run(&front, |relation| stratum.positive.get(&relation).map(Vec::as_slice), true)?;
        }
        Ok(())
    }

    /// Runs the plans of aggregates, once for each group with a new or doomed row.
    fn run_groups(&mut self, stratum: &Stratum, retracting: bool) -> Result<(), Error> {
        if stratum.aggregated.is_empty() {
            return Ok(());
        }
        let mut groups: FxHashSet<(RelationId, Arguments)> = FxHashSet::default();
        // The plans need only the group of a row, so the first changed row of each group suffices.
        let is_first = |&(id, row): &(RelationId, Row)| {
            let Some(&plan) = stratum.aggregated.get(&id).and_then(|plans| plans.first()) else {
                return false;
            };
            let seed = &self.network.plans[plan as usize].seed;
            let group = seed.binds.len() + seed.checks.len();
            groups.insert((id, SmallVec::from_slice(&self.engine.store.get(id).row(row)[..group])))
        };
        let changed: Rows = self.added.iter().chain(&self.doomed).copied().filter(is_first).collect();
        self.run(&changed, |relation| stratum.aggregated.get(&relation).map(Vec::as_slice), retracting)
    }

    fn rederive(&mut self, stratum: &Stratum) -> Result<(), Error> {
        let doomed = self.still_doomed();
        self.run(&doomed, |relation| stratum.rederive.get(&relation).map(Vec::as_slice), false)
    }

    fn still_doomed(&self) -> Rows {
        let is_doomed =
            |&&(id, row): &&(RelationId, Row)| self.engine.store.get(id).state(row) & state::DOOMED != 0;
        self.doomed.iter().filter(is_doomed).copied().collect()
    }

    /// Derives the consequences of new rows, of rederived rows, of the absence of removed rows, and of changed groups
    /// of aggregates in a stratum.
    fn insert(&mut self, stratum: &Stratum) -> Result<(), Error> {
        let disappeared = self.still_doomed();
        let relevant = |&&(id, row): &&(RelationId, Row)| {
            let is_pending = self.engine.store.get(id).state(row) & state::PENDING != 0;
            stratum.positive.contains_key(&id) && !is_pending
        };
        let front: Rows = self.added.iter().filter(relevant).copied().collect();
        let revived = std::mem::take(&mut self.pending);
        // Rederived rows become visible only now, so that rederivation uses no row of its own round.
        self.promote(&revived);
        let front = [front, revived].concat();
        self.mark(&front, true);
        self.run(&front, |relation| stratum.positive.get(&relation).map(Vec::as_slice), false)?;
        self.mark(&front, false);
        self.run(&disappeared, |relation| stratum.negative.get(&relation).map(Vec::as_slice), false)?;
        self.run_groups(stratum, false)?;
        self.saturate(stratum)
    }

    fn saturate(&mut self, stratum: &Stratum) -> Result<(), Error> {
        self.budget.recursive.set(true);
        while !self.pending.is_empty() {
            let front = std::mem::take(&mut self.pending);
            self.promote(&front);
            self.mark(&front, true);
            self.run(&front, |relation| stratum.positive.get(&relation).map(Vec::as_slice), false)?;
            self.mark(&front, false);
        }
        self.budget.recursive.set(false);
        Ok(())
    }

    fn promote(&mut self, rows: &Rows) {
        for &(relation, row) in rows {
            self.engine.store.get_mut(relation).clear(row, state::PENDING);
        }
    }

    fn mark(&mut self, rows: &Rows, fresh: bool) {
        for &(relation, row) in rows {
            let relation = self.engine.store.get_mut(relation);
            if fresh { relation.set(row, state::FRESH) } else { relation.clear(row, state::FRESH) }
        }
    }

    /// Starts from each row the plans that `plans` returns for its relation, in chunks of [`CHUNK`] starts.
    /// The matches derive their heads; if `retracting`, they mark the heads of which they are the recorded
    /// derivation as doomed (over-deleted).
    fn run<'p>(
        &mut self,
        rows: &[(RelationId, Row)],
        plans: impl Fn(RelationId) -> Option<&'p [PlanId]>,
        retracting: bool,
    ) -> Result<(), Error> {
        let mut starts: SmallVec<[(PlanId, RelationId, Row); 16]> = SmallVec::new();
        for &(relation, row) in rows {
            let values = self.engine.store.get(relation).row(row);
            let plan_ids = plans(relation).unwrap_or(&[]).iter().copied();
            let plan_ids = plan_ids.filter(|&plan| self.network.plans[plan as usize].seed.may_fit(values));
            starts.extend(plan_ids.map(|plan| (plan, relation, row)));
        }
        // Starts of one plan become adjacent, and form one seed per chunk.
        starts.sort_by_key(|&(plan, ..)| plan);
        for chunk in starts.chunks(CHUNK) {
            let rows: SmallVec<[Row; 16]> = chunk.iter().map(|&(.., row)| row).collect();
            let mut seeds: SmallVec<[Seed; 8]> = SmallVec::new();
            for (position, &(plan, relation, _)) in chunk.iter().enumerate() {
                let position = position as u32;
                match seeds.last_mut() {
                    Some(Seed { plan: last, start: Start::Rows { to, .. } }) if *last == plan => {
                        *to = position + 1;
                    }
                    _ => {
                        let start = Start::Rows { relation, from: position, to: position + 1 };
                        seeds.push(Seed { plan, start });
                    }
                }
            }
            self.run_chunk(&seeds, &rows, retracting)?;
        }
        Ok(())
    }

    /// Runs seeds (plans with their start rows), then the partial matches that these runs deferred.
    /// Depth-first order (last in, first out) bounds the memory.
    fn run_chunk(&mut self, seeds: &[Seed], rows: &[Row], retracting: bool) -> Result<(), Error> {
        let mut deferred = self.run_once(seeds, rows, retracting)?;
        while let Some(seed) = deferred.pop() {
            deferred.extend(self.run_once(&[seed], rows, retracting)?);
        }
        Ok(())
    }

    fn run_once(&mut self, seeds: &[Seed], rows: &[Row], retracting: bool) -> Result<Vec<Seed>, Error> {
        let round = Round {
            store: &self.engine.store,
            plans: &self.network.plans,
            widths: &self.network.widths,
            symbols: RefCell::new(&mut self.engine.symbols),
            rows,
            retracting,
            budget: &self.budget,
            blocks: RefCell::default(),
            buffers: &self.buffers,
            deferred: RefCell::default(),
        };
        let matches = run(&round, seeds);
        let deferred = round.deferred.into_inner();
        let identity =
            |rule: u32| self.engine.program.rules[self.network.rules[rule as usize].rule].identity.clone();
        if let Some(error) = self.budget.error(identity) {
            return Err(error);
        }
        for matches in matches {
            if retracting {
                self.retract(&matches);
            } else {
                self.conclude(&matches);
            }
            self.buffers.put(matches.bindings);
        }
        Ok(deferred)
    }

    /// Inserts or rederives the heads of complete matches, unless the heads already hold. Under equality,
    /// skips an `owl:sameAs` pair of identical names, or of names already connected in this update.
    fn conclude(&mut self, matches: &Matches) {
        let network = Arc::clone(&self.network);
        let number = network.plans[matches.plan as usize].rule;
        let rule = &network.rules[number as usize];
        let Engine { store, records, symbols, .. } = &mut *self.engine;
        let mut arguments: SmallVec<[Symbol; 16]> = SmallVec::new();
        for bound in matches.bindings.chunks_exact(rule.width) {
            for head in &rule.heads {
                arguments.clear();
                arguments.extend(head.arguments.iter().map(|&source| resolve(source, bound)));
                if Some(head.relation) == network.same_as
                    && (arguments[0] == arguments[1] || !joins(&mut self.joined, symbols, &arguments))
                {
                    continue;
                }
                let relation = store.get_mut(head.relation);
                match relation.find(&arguments) {
                    None => {
                        let record = records.add(number, bound);
                        let row = relation.insert(&arguments, state::PENDING | state::NEW, record);
                        self.added.push((head.relation, row));
                        self.pending.push((head.relation, row));
                        touch(&mut self.touched, &network, head.relation);
                    }
                    Some(row) if relation.state(row) & state::DOOMED != 0 => {
                        records.remove(relation.record(row));
                        relation.set_record(row, records.add(number, bound));
                        relation.clear(row, state::DOOMED);
                        relation.set(row, state::PENDING);
                        self.pending.push((head.relation, row));
                        touch(&mut self.touched, &network, head.relation);
                    }
                    Some(_) => {}
                }
            }
        }
    }

    /// Marks the heads of the matches as doomed (over-deleted) if the match is the recorded derivation of the
    /// head. Stated rows only lose the record.
    fn retract(&mut self, matches: &Matches) {
        let network = Arc::clone(&self.network);
        let number = network.plans[matches.plan as usize].rule;
        let rule = &network.rules[number as usize];
        let Engine { store, records, .. } = &mut *self.engine;
        let mut arguments: SmallVec<[Symbol; 16]> = SmallVec::new();
        for bound in matches.bindings.chunks_exact(rule.width) {
            for head in &rule.heads {
                arguments.clear();
                arguments.extend(head.arguments.iter().map(|&source| resolve(source, bound)));
                let relation = store.get_mut(head.relation);
                let Some(row) = relation.find(&arguments) else { continue };
                let record = relation.record(row);
                let bits = relation.state(row);
                if bits & state::DOOMED != 0 || record.rule != number || records.get(record) != bound {
                    continue;
                }
                if bits & state::ASSERTED == 0 {
                    relation.set(row, state::DOOMED);
                    self.doomed.push((head.relation, row));
                    touch(&mut self.touched, &network, head.relation);
                } else {
                    records.remove(record);
                    relation.set_record(row, Record::NONE);
                }
            }
        }
    }
}

fn touch(touched: &mut [bool], network: &Network, relation: RelationId) {
    for &stratum in network.readers.get(relation.0 as usize).into_iter().flatten() {
        touched[stratum as usize] = true;
    }
}

/// Returns `true` if a pair of equal names connects two names that this update has not connected yet. A
/// pair with a literal always counts as new, because it can be a contradiction, which must be reported.
fn joins(joined: &mut Forest, symbols: &Symbols, pair: &[Symbol]) -> bool {
    pair.iter().any(|&symbol| symbols.as_literal(symbol).is_some()) || joined.connect(pair[0], pair[1])
}
