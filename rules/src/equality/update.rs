//! Incremental updates under equality (`owl:sameAs`): computes the facts that start or cease to hold after a
//! change of the stated facts. A change can merge and split equality classes. The store has one row for all
//! facts that differ only in equal names; the row contains the representatives of the classes.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::classes::{Classes, Edge, EdgeId};
use super::proof::edge_of;
use super::{Equality, constants};
use crate::engine::{Delta, Engine};
use crate::error::Error;
use crate::fact::Fact;
use crate::forest::Forest;
use crate::rule::{Program, Rule};
use crate::store::{Record, state};
use crate::symbol::Symbol;

struct Update<'e> {
    engine: &'e mut Engine,
    equality: Equality,
    /// Maps each row whose stated facts may have changed since the last [`Update::flush`] to the stated
    /// facts that the row represents now.
    pending_rows: BTreeMap<Fact, BTreeSet<Fact>>,
    /// `true` if the class of a name that a rule mentions has changed since the last [`Update::flush`].
    rules_changed: bool,
    /// Net change of each row in this update: inserted (1), removed (-1), or both (0).
    net_change: FxHashMap<Fact, i8>,
    /// Maps each name whose class has changed to the members of its class before the update.
    old_classes: FxHashMap<Symbol, Arc<[Symbol]>>,
    /// Facts that held before the update and may have ceased to hold, except `owl:sameAs` pairs of equal names, which
    /// `old_classes` contains. Not collected if `silent`.
    previous_facts: FxHashSet<Fact>,
    /// `true` during the first evaluation, which reports no changes.
    silent: bool,
    pairs_to_join: Vec<Fact>,
    /// New rules, which the next [`Update::flush`] installs in the engine.
    program: Option<Program>,
}

impl Engine {
    /// Applies a change of the stated facts like [`Engine::apply`], but under equality. Replaces the
    /// rules if `program` is given. Returns the net change of the facts that hold; an error comes with
    /// the delta that restores the stated facts.
    pub(crate) fn apply_equally(
        &mut self,
        equality: Arc<Equality>,
        delta: &Delta,
        program: Option<Program>,
    ) -> Result<Delta, (Error, Delta)> {
        let mut update = Update::new(self, equality);
        update.program = program;
        let result = update.apply(delta);
        let equality = update.equality;
        self.equality = Some(Arc::new(equality));
        result
    }

    /// Merges the classes of all `owl:sameAs` pairs that the first evaluation derived, until no further
    /// pair is derived. Reports no change of facts.
    pub(crate) fn join_derived_pairs(&mut self) -> Result<(), Error> {
        let Some(equality) = self.equality.take() else { return Ok(()) };
        let same_as = equality.same_as;
        let mut update = Update::new(self, equality);
        update.silent = true;
        let concluded = update.engine.matching_rows(same_as, &[None, None]);
        update.pairs_to_join = concluded.map(|row| Fact::new(same_as, row.iter().copied())).collect();
        let result = update.join_concluded();
        let equality = update.equality;
        self.equality = Some(Arc::new(equality));
        result
    }

    /// Adds the stated facts of a new engine to the store and merges the classes of the stated
    /// `owl:sameAs` pairs. Runs no rule.
    pub(crate) fn state_initial_facts(&mut self, facts: Vec<Fact>) {
        let Some(equality) = self.equality.take() else { return };
        let mut update = Update::new(self, equality);
        let facts: BTreeSet<Fact> = facts.into_iter().collect();
        let (pairs, other_facts): (Vec<Fact>, Vec<Fact>) =
            facts.into_iter().partition(|fact| update.equality.is_pair(fact, &update.engine.symbols));
        for pair in &pairs {
            update.state(pair);
        }
        update.join_stated(&pairs);
        let (normal_facts, aliased_facts): (Vec<Fact>, Vec<Fact>) =
            other_facts.into_iter().partition(|fact| update.equality.classes.normal(fact) == *fact);
        // Without an entry in `originals`, an asserted row represents exactly its own fact.
        for fact in normal_facts {
            let relation = update.engine.store.relation(fact.predicate, fact.arguments.len());
            update.engine.store.get_mut(relation).insert(&fact.arguments, state::ASSERTED, Record::NONE);
        }
        for fact in &aliased_facts {
            update.state(fact);
        }
        let pending_rows = std::mem::take(&mut update.pending_rows);
        for (row, facts) in pending_rows {
            if update.update_originals(&row, facts) {
                let relation = update.engine.store.relation(row.predicate, row.arguments.len());
                let relation = update.engine.store.get_mut(relation);
                if relation.find(&row.arguments).is_none() {
                    relation.insert(&row.arguments, state::ASSERTED, Record::NONE);
                }
            }
        }
        let equality = update.equality;
        self.equality = Some(Arc::new(equality));
    }
}

impl<'e> Update<'e> {
    fn new(engine: &'e mut Engine, equality: Arc<Equality>) -> Self {
        let equality = Arc::unwrap_or_clone(equality);
        let (pending_rows, net_change, old_classes) =
            (BTreeMap::new(), FxHashMap::default(), FxHashMap::default());
        let (previous_facts, pairs_to_join) = (FxHashSet::default(), Vec::new());
        let (rules_changed, silent, program) = (false, false, None);
        Self {
            engine,
            equality,
            pending_rows,
            rules_changed,
            net_change,
            old_classes,
            previous_facts,
            silent,
            pairs_to_join,
            program,
        }
    }

    fn apply(&mut self, delta: &Delta) -> Result<Delta, (Error, Delta)> {
        // A fact in both lists is stated afterwards.
        let inserted: FxHashSet<&Fact> = delta.insert.iter().collect();
        let (mut added, mut removed) = (Vec::new(), Vec::new());
        for fact in delta.delete.iter().filter(|fact| !inserted.contains(fact)) {
            if self.is_stated(fact) {
                self.retract(fact);
                removed.push(fact.clone());
            }
        }
        for fact in &delta.insert {
            if !self.is_stated(fact) {
                self.state(fact);
                added.push(fact.clone());
            }
        }
        let result = self.change_classes(&added, &removed).and_then(|()| self.join_concluded());
        match result {
            Ok(()) => Ok(self.report(&added, &removed)),
            Err(error) => Err((error, Delta { insert: removed, delete: added })),
        }
    }

    /// Splits the classes whose equalities depend on removed facts or rules, merges the classes of the pairs in
    /// `added`, updates the store, and runs the rules.
    fn change_classes(&mut self, added: &[Fact], removed: &[Fact]) -> Result<(), Error> {
        let old_program = Arc::clone(&self.engine.program);
        let mut removed_rules = FxHashSet::default();
        if let Some(program) = &self.program {
            self.equality.constants.extend(constants(program));
            let new_rules: FxHashSet<&Rule> = program.rules.iter().collect();
            removed_rules.extend(
                old_program.rules.iter().filter(|rule| !new_rules.contains(rule)).map(|rule| &rule.identity),
            );
        }
        let invalid = self.equality.classes.depending_on(removed.iter(), &removed_rules);
        self.split_classes(&invalid, added);
        self.join_stated(added);
        self.flush()
    }

    /// Returns the stated facts that a row represents, for modification. The row becomes pending until
    /// the next [`Update::flush`].
    fn originals(&mut self, row: &Fact) -> &mut BTreeSet<Fact> {
        let Self { engine, equality, pending_rows, .. } = self;
        pending_rows.entry(row.clone()).or_insert_with(|| match equality.originals.get(row) {
            Some(facts) => facts.clone(),
            None if equality.is_reflexive(row) => BTreeSet::new(),
            None if engine.row_state(row).is_some_and(|bits| bits & state::ASSERTED != 0) => {
                BTreeSet::from([row.clone()])
            }
            None => BTreeSet::new(),
        })
    }

    fn is_stated(&mut self, fact: &Fact) -> bool {
        if self.equality.is_pair(fact, &self.engine.symbols) {
            return self.equality.is_stated_pair(fact);
        }
        let row = self.equality.classes.normal(fact);
        self.originals(&row).contains(fact)
    }

    fn state(&mut self, fact: &Fact) {
        let row = self.equality.classes.normal(fact);
        if self.equality.is_pair(fact, &self.engine.symbols) {
            for &name in &fact.arguments {
                self.equality.pairs.entry(name).or_default().insert(fact.clone());
            }
            if self.equality.is_reflexive(&row) {
                self.originals(&row);
            }
        } else {
            self.originals(&row).insert(fact.clone());
        }
    }

    fn retract(&mut self, fact: &Fact) {
        let row = self.equality.classes.normal(fact);
        if self.equality.is_pair(fact, &self.engine.symbols) {
            for name in &fact.arguments {
                if let Some(pairs) = self.equality.pairs.get_mut(name) {
                    pairs.remove(fact);
                    if pairs.is_empty() {
                        self.equality.pairs.remove(name);
                    }
                }
            }
            self.originals(&row);
        } else {
            self.originals(&row).remove(fact);
        }
    }

    /// Returns the rows of the store with the argument `name`, the representative of a class, except rows of
    /// constraints and aggregates. Creates the indexes that the look-up needs.
    fn mentions(&mut self, name: Symbol) -> Vec<Fact> {
        let mut rows = Vec::new();
        for relation in &mut self.engine.store.relations {
            // Matches of constraints and aggregates are no facts: they are neither restated nor reported.
            let Some(predicate) = relation.predicate else { continue };
            for column in 0..relation.arity() {
                if !relation.has_index(1 << column) {
                    Arc::make_mut(relation).index(1 << column);
                }
                let index = relation.best_index(1 << column).map(|(index, _)| index);
                for row in index.into_iter().flat_map(|index| relation.lookup(index, &[name])) {
                    let row = relation.row(row);
                    // A row with the name in several columns is reported for the first of them only.
                    if !row[..column].contains(&name) {
                        rows.push(Fact::new(predicate, row.iter().copied()));
                    }
                }
            }
        }
        rows
    }

    /// Saves the class of `representative` before the class changes and, unless the update is silent, the
    /// facts about its names. Each class is saved only once per update. Sets `rules_changed` if a rule
    /// mentions a name of the class.
    fn record_class(&mut self, representative: Symbol) {
        let class = self.equality.classes.class(representative);
        self.rules_changed |= class.iter().any(|name| self.equality.constants.contains(name));
        if self.old_classes.contains_key(&representative) {
            return;
        }
        if !self.silent {
            let mut rows = self.mentions(representative);
            // Rows that this update inserted did not hold before it.
            rows.retain(|row| self.net_change.get(row) != Some(&1));
            let was_removed =
                |&(row, &sign): &(&Fact, &i8)| sign == -1 && row.arguments.contains(&representative);
            rows.extend(self.net_change.iter().filter(was_removed).map(|(row, _)| row.clone()));
            for row in rows {
                if !self.equality.is_reflexive(&row) {
                    let facts = self.facts_before(&row);
                    self.previous_facts.extend(facts);
                }
            }
        }
        for &name in class.iter() {
            self.old_classes.entry(name).or_insert_with(|| Arc::clone(&class));
        }
    }

    fn facts_before(&self, row: &Fact) -> Vec<Fact> {
        let names = |symbol| match self.old_classes.get(&symbol) {
            Some(class) if class.len() > 1 => Some(&**class),
            Some(_) => None,
            None => self.equality.names(symbol),
        };
        self.equality.facts_of(row, &names)
    }

    fn take_originals(&mut self, names: &BTreeSet<Symbol>) -> Vec<Fact> {
        let mut rows: Vec<Fact> = names.iter().flat_map(|&name| self.mentions(name)).collect();
        let pending_rows =
            self.pending_rows.keys().filter(|row| row.arguments.iter().any(|name| names.contains(name)));
        rows.extend(pending_rows.cloned());
        let mut facts = Vec::new();
        for row in rows {
            facts.extend(std::mem::take(self.originals(&row)));
        }
        facts
    }

    /// Removes the equality edges in `invalid` and splits their classes into the components that the
    /// remaining edges and stated pairs connect. Ignores the stated pairs in `added`:
    /// [`Update::join_stated`] merges the classes of these pairs later.
    fn split_classes(&mut self, invalid: &BTreeSet<EdgeId>, added: &[Fact]) {
        let added: FxHashSet<&Fact> = added.iter().collect();
        let classes = &self.equality.classes;
        let broken: BTreeSet<Symbol> = invalid
            .iter()
            .filter_map(|edge| classes.edges.get(edge))
            .map(|edge| classes.find(edge.left))
            .collect();
        for &representative in &broken {
            self.record_class(representative);
        }
        let facts = self.take_originals(&broken);
        self.equality.classes.disconnect(invalid);
        for &representative in &broken {
            let class = self.equality.classes.class(representative);
            self.equality.classes.split(representative);
            let pairs = class.iter().flat_map(|name| self.equality.pairs.get(name).into_iter().flatten());
            let pairs: BTreeSet<Fact> = pairs.filter(|pair| !added.contains(pair)).cloned().collect();
            for pair in &pairs {
                connect_stated(&mut self.equality.classes, pair);
            }
            for &name in class.iter() {
                self.touch_reflexive(name);
            }
        }
        for fact in facts {
            let row = self.equality.classes.normal(&fact);
            self.originals(&row).insert(fact);
        }
    }

    fn touch_reflexive(&mut self, name: Symbol) {
        let row = Fact::new(self.equality.same_as, [name, name]);
        self.originals(&row);
    }

    fn join_stated(&mut self, facts: &[Fact]) {
        let symbols = Arc::clone(&self.engine.symbols);
        let pairs = facts.iter().filter(|fact| self.equality.is_pair(fact, &symbols));
        let pairs: Vec<&Fact> = pairs.collect();
        self.join(
            &pairs.iter().map(|pair| (pair.arguments[0], pair.arguments[1])).collect::<Vec<_>>(),
            |classes| {
                for pair in pairs {
                    connect_stated(classes, pair);
                }
            },
        );
    }

    /// Merges the classes of the two names of each pair, and moves the stated facts to the rows of the new
    /// representatives. `connect` adds the edges and merges the classes.
    fn join(&mut self, pairs: &[(Symbol, Symbol)], connect: impl FnOnce(&mut Classes)) {
        let classes = &self.equality.classes;
        let representatives = pairs.iter().map(|&(left, right)| (classes.find(left), classes.find(right)));
        let distinct = representatives.filter(|(left, right)| left != right);
        let merged: BTreeSet<Symbol> = distinct.flat_map(|(left, right)| [left, right]).collect();
        for &representative in &merged {
            self.record_class(representative);
        }
        connect(&mut self.equality.classes);
        // Facts move only from classes whose representative is replaced.
        let superseded: BTreeSet<Symbol> =
            merged.iter().copied().filter(|&name| self.equality.classes.find(name) != name).collect();
        for fact in self.take_originals(&superseded) {
            let row = self.equality.classes.normal(&fact);
            self.originals(&row).insert(fact);
        }
        for name in merged {
            self.touch_reflexive(name);
        }
    }

    fn join_concluded(&mut self) -> Result<(), Error> {
        loop {
            let mut connected = Forest::default();
            let mut edges: Vec<Edge> = Vec::new();
            // One spanning tree of edges per class suffices.
            for pair in std::mem::take(&mut self.pairs_to_join) {
                let (left, right) = (pair.arguments[0], pair.arguments[1]);
                if left != right
                    && self.equality.is_pair(&pair, &self.engine.symbols)
                    && self.engine.row_state(&pair).is_some()
                    && connected.connect(left, right)
                {
                    edges.push(edge_of(self.engine, &self.equality, &pair));
                }
            }
            if edges.is_empty() {
                return Ok(());
            }
            let pairs: Vec<(Symbol, Symbol)> = edges.iter().map(|edge| (edge.left, edge.right)).collect();
            self.join(&pairs, |classes| {
                for edge in edges {
                    let (left, right) = (edge.left, edge.right);
                    classes.connect(edge);
                    classes.join(left, right);
                }
            });
            self.flush()?;
        }
    }

    /// Stores the stated facts that a row represents. Returns `true` if the row has to be asserted in
    /// the store.
    fn update_originals(&mut self, row: &Fact, facts: BTreeSet<Fact>) -> bool {
        let equality = &mut self.equality;
        if equality.is_reflexive(row) && equality.is_pair(row, &self.engine.symbols) {
            let class = equality.classes.class(row.arguments[0]);
            let is_stated =
                |&name: &Symbol| equality.is_stated_pair(&Fact::new(equality.same_as, [name, name]));
            return equality.classes.find(row.arguments[0]) == row.arguments[0]
                && (class.len() > 1 || class.iter().any(is_stated));
        }
        let is_stated = !facts.is_empty();
        if !is_stated || (facts.len() == 1 && facts.contains(row)) {
            equality.originals.remove(row);
        } else {
            equality.originals.insert(row.clone(), facts);
        }
        is_stated
    }

    /// Applies the pending changes: states or withdraws rows, rewrites the rules with the current
    /// representatives, and runs the rules.
    fn flush(&mut self) -> Result<(), Error> {
        let mut delta = Delta::default();
        for (row, facts) in std::mem::take(&mut self.pending_rows) {
            let was_stated = self.engine.row_state(&row).is_some_and(|bits| bits & state::ASSERTED != 0);
            match (was_stated, self.update_originals(&row, facts)) {
                (false, true) => delta.insert.push(row),
                (true, false) => delta.delete.push(row),
                _ => {}
            }
        }
        if let Some(program) = self.program.take() {
            self.engine.program = Arc::new(program);
            self.rules_changed = true;
        }
        let normal = std::mem::take(&mut self.rules_changed)
            .then(|| self.equality.normal_program(&self.engine.program))
            .filter(|normal| *normal != *self.equality.program);
        let change = match normal {
            Some(normal) => {
                let old = std::mem::replace(&mut self.equality.program, Arc::new(normal));
                let new = Arc::clone(&self.equality.program);
                self.engine.replace_rules(delta, &old, &new)?
            }
            None => self.engine.apply_rows(delta)?,
        };
        self.record_change(change);
        Ok(())
    }

    fn record_change(&mut self, change: Delta) {
        for (rows, sign) in [(change.insert, 1), (change.delete, -1)] {
            for row in rows {
                if sign == 1 && row.predicate == self.equality.same_as && row.arguments.len() == 2 {
                    self.pairs_to_join.push(row.clone());
                }
                let net_change = self.net_change.entry(row).or_default();
                *net_change += sign;
            }
        }
    }

    /// Returns the change of the facts since the start of the update, sorted. The facts are about all
    /// names of a class, not only about its representative. `added` and `removed` are the changed stated
    /// facts.
    fn report(&mut self, added: &[Fact], removed: &[Fact]) -> Delta {
        let mut after: FxHashSet<Fact> = FxHashSet::default();
        let representatives: BTreeSet<Symbol> =
            self.old_classes.keys().map(|&name| self.equality.classes.find(name)).collect();
        let mut rows: Vec<Fact> = representatives.into_iter().flat_map(|name| self.mentions(name)).collect();
        let net_change = std::mem::take(&mut self.net_change);
        for (row, net_change) in net_change {
            match net_change {
                1 => rows.push(row),
                -1 if !self.equality.is_reflexive(&row) => {
                    let facts = self.facts_before(&row);
                    self.previous_facts.extend(facts);
                }
                _ => {}
            }
        }
        for row in rows.iter().filter(|row| !self.equality.is_reflexive(row)) {
            after.extend(self.equality.facts_of(row, &|symbol| self.equality.names(symbol)));
        }
        // A pair of a name with itself holds only if it is stated, so its change is taken from the
        // input.
        let reflexive = |facts: &[Fact]| -> Vec<Fact> {
            let is_reflexive = |fact: &&Fact| {
                self.equality.is_pair(fact, &self.engine.symbols) && self.equality.is_reflexive(fact)
            };
            facts.iter().filter(is_reflexive).cloned().collect()
        };
        let (joined, separated) = self.changed_pairs();
        let new = after.difference(&self.previous_facts).cloned();
        let mut insert: Vec<Fact> = new.chain(joined).chain(reflexive(added)).collect();
        let old = self.previous_facts.difference(&after).cloned();
        let mut delete: Vec<Fact> = old.chain(separated).chain(reflexive(removed)).collect();
        insert.sort_unstable();
        delete.sort_unstable();
        Delta { insert, delete }
    }

    /// Returns the `owl:sameAs` pairs of different names that hold only after the update, and those that held only
    /// before it. The time is linear in the number of names and of returned pairs.
    fn changed_pairs(&self) -> (Vec<Fact>, Vec<Fact>) {
        // The names that are in one class both before and after the update, by these two classes. The first name
        // identifies an old class, the representative a new one.
        let mut blocks: BTreeMap<(Symbol, Symbol), Vec<Symbol>> = BTreeMap::new();
        for (&name, class) in &self.old_classes {
            blocks.entry((class[0], self.equality.classes.find(name))).or_default().push(name);
        }
        let (mut old, mut new) = (BTreeMap::<_, Vec<_>>::new(), BTreeMap::<_, Vec<_>>::new());
        for ((before, after), names) in &blocks {
            old.entry(before).or_default().push(names);
            new.entry(after).or_default().push(names);
        }
        let pairs = |classes: BTreeMap<&Symbol, Vec<&Vec<Symbol>>>| {
            let mut pairs = Vec::new();
            for blocks in classes.values() {
                for (index, block) in blocks.iter().enumerate() {
                    for &left in *block {
                        for &right in blocks[index + 1..].iter().copied().flatten() {
                            let directions = [[left, right], [right, left]];
                            pairs.extend(directions.map(|pair| Fact::new(self.equality.same_as, pair)));
                        }
                    }
                }
            }
            pairs
        };
        (pairs(new), pairs(old))
    }
}

fn connect_stated(classes: &mut Classes, pair: &Fact) {
    let (left, right) = (pair.arguments[0], pair.arguments[1]);
    if classes.find(left) != classes.find(right) {
        let (facts, edges, proof) = (vec![pair.clone()], Vec::new(), Vec::new());
        classes.connect(Edge { left, right, facts, edges, proof });
        classes.join(left, right);
    }
}
