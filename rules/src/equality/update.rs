//! A change of what is stated to the change of what holds, where classes of names join and come apart on the way.

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

/// An update in progress.
struct Update<'e> {
    engine: &'e mut Engine,
    equality: Equality,
    /// Rows whose stated facts have changed since the last [`Update::flush`], with these facts.
    open: BTreeMap<Fact, BTreeSet<Fact>>,
    /// Whether rules mention a name whose representative has changed.
    rules_changed: bool,
    /// Rows that came (1) or went (-1) in this update.
    net: FxHashMap<Fact, i8>,
    /// Names whose class has changed, with the class that they had.
    moved: FxHashMap<Symbol, Arc<[Symbol]>>,
    /// Facts that held before, among those that may not any more; not noted where nobody asks for the change.
    before: FxHashSet<Fact>,
    silent: bool,
    /// Concluded pairs that join classes.
    joining: Vec<Fact>,
    /// The rules that replace the engine's with the next [`Update::flush`].
    program: Option<Program>,
}

impl Engine {
    /// As [`Engine::apply`], under equality; on an error also what takes the change back.
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

    /// Joins the classes that the first evaluation asks for; nothing is reported.
    pub(crate) fn settle(&mut self) -> Result<(), Error> {
        let Some(equality) = self.equality.take() else { return Ok(()) };
        let same = equality.same;
        let mut update = Update::new(self, equality);
        update.silent = true;
        let concluded = update.engine.matching_rows(same, &[None, None]);
        update.joining = concluded.map(|row| Fact::new(same, row.iter().copied())).collect();
        let result = update.join_concluded();
        let equality = update.equality;
        self.equality = Some(Arc::new(equality));
        result
    }

    /// States facts and joins the classes that are stated, before anything is derived.
    pub(crate) fn begin(&mut self, facts: Vec<Fact>) {
        let Some(equality) = self.equality.take() else { return };
        let mut update = Update::new(self, equality);
        let facts: BTreeSet<Fact> = facts.into_iter().collect();
        let (pairs, others): (Vec<Fact>, Vec<Fact>) =
            facts.into_iter().partition(|fact| update.equality.is_pair(fact, &update.engine.symbols));
        for pair in &pairs {
            update.state(pair);
        }
        update.join_stated(&pairs);
        let (plain, renamed): (Vec<Fact>, Vec<Fact>) =
            others.into_iter().partition(|fact| update.equality.classes.normal(fact) == *fact);
        for fact in plain {
            let relation = update.engine.store.relation(fact.predicate, fact.arguments.len());
            update.engine.store.get_mut(relation).insert(&fact.arguments, state::ASSERTED, Record::NONE);
        }
        for fact in &renamed {
            update.state(fact);
        }
        let open = std::mem::take(&mut update.open);
        for (row, facts) in open {
            if update.keep(&row, facts) {
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
        let (open, net, moved) = (BTreeMap::new(), FxHashMap::default(), FxHashMap::default());
        let (before, joining) = (FxHashSet::default(), Vec::new());
        let (rules_changed, silent, program) = (false, false, None);
        Self { engine, equality, open, rules_changed, net, moved, before, silent, joining, program }
    }

    /// The change of what holds; on an error, what takes the change back.
    fn apply(&mut self, delta: &Delta) -> Result<Delta, (Error, Delta)> {
        let kept: FxHashSet<&Fact> = delta.insert.iter().collect();
        let (mut added, mut removed) = (Vec::new(), Vec::new());
        for fact in delta.delete.iter().filter(|fact| !kept.contains(fact)) {
            if self.is_stated(fact) {
                self.unstate(fact);
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

    fn change_classes(&mut self, added: &[Fact], removed: &[Fact]) -> Result<(), Error> {
        let old = Arc::clone(&self.engine.program);
        let mut gone = FxHashSet::default();
        if let Some(program) = &self.program {
            self.equality.constants.extend(constants(program));
            let kept: FxHashSet<&Rule> = program.rules.iter().collect();
            gone.extend(old.rules.iter().filter(|rule| !kept.contains(rule)).map(|rule| &rule.identity));
        }
        let invalid = self.equality.classes.resting_on(removed.iter(), &gone);
        self.take_apart(&invalid, added);
        self.join_stated(added);
        self.flush()
    }

    /// The facts that a row stands for.
    fn originals(&mut self, row: &Fact) -> &mut BTreeSet<Fact> {
        let Self { engine, equality, open, .. } = self;
        open.entry(row.clone()).or_insert_with(|| match equality.originals.get(row) {
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

    fn unstate(&mut self, fact: &Fact) {
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

    /// The rows that mention a representative, in the store.
    fn mentions(&mut self, name: Symbol) -> Vec<Fact> {
        let mut rows = Vec::new();
        for relation in &mut self.engine.store.relations {
            let Some(predicate) = relation.predicate else { continue };
            for column in 0..relation.arity() {
                if !relation.has_index(1 << column) {
                    Arc::make_mut(relation).index(1 << column);
                }
                let index = relation.best_index(1 << column).map(|(index, _)| index);
                for row in index.into_iter().flat_map(|index| relation.lookup(index, &[name])) {
                    let row = relation.row(row);
                    if !row[..column].contains(&name) {
                        rows.push(Fact::new(predicate, row.iter().copied()));
                    }
                }
            }
        }
        rows
    }

    /// Notes the class of a representative and what held of it, before either changes.
    fn note_class(&mut self, representative: Symbol) {
        let class = self.equality.classes.class(representative);
        self.rules_changed |= class.iter().any(|name| self.equality.constants.contains(name));
        if self.moved.contains_key(&representative) {
            return;
        }
        if !self.silent {
            let mut rows = self.mentions(representative);
            rows.retain(|row| self.net.get(row) != Some(&1));
            let is_gone = |&(row, &net): &(&Fact, &i8)| net == -1 && row.arguments.contains(&representative);
            rows.extend(self.net.iter().filter(is_gone).map(|(row, _)| row.clone()));
            for row in rows {
                let facts = self.facts_before(&row);
                self.before.extend(facts);
            }
        }
        for &name in class.iter() {
            self.moved.entry(name).or_insert_with(|| Arc::clone(&class));
        }
    }

    fn facts_before(&self, row: &Fact) -> Vec<Fact> {
        let names = |symbol| match self.moved.get(&symbol) {
            Some(class) if class.len() > 1 => Some(&**class),
            Some(_) => None,
            None => self.equality.names(symbol),
        };
        self.equality.facts_of(row, &names)
    }

    /// Takes the stated facts off all rows that mention any of these names.
    fn collect(&mut self, names: &BTreeSet<Symbol>) -> Vec<Fact> {
        let mut rows: Vec<Fact> = names.iter().flat_map(|&name| self.mentions(name)).collect();
        let open = self.open.keys().filter(|row| row.arguments.iter().any(|name| names.contains(name)));
        rows.extend(open.cloned());
        let mut facts = Vec::new();
        for row in rows {
            facts.extend(std::mem::take(self.originals(&row)));
        }
        facts
    }

    /// Removes edges and takes their classes apart into what the others and stated pairs connect, but for the pairs that
    /// are `added` by this update: [`Update::join_stated`] joins these, and restates the facts of both classes.
    fn take_apart(&mut self, invalid: &BTreeSet<EdgeId>, added: &[Fact]) {
        let added: FxHashSet<&Fact> = added.iter().collect();
        let classes = &self.equality.classes;
        let broken: BTreeSet<Symbol> = invalid
            .iter()
            .filter_map(|edge| classes.edges.get(edge))
            .map(|edge| classes.find(edge.left))
            .collect();
        for &representative in &broken {
            self.note_class(representative);
        }
        let facts = self.collect(&broken);
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
        let row = Fact::new(self.equality.same, [name, name]);
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

    /// Joins the classes of pairs as `connect` does it.
    fn join(&mut self, pairs: &[(Symbol, Symbol)], connect: impl FnOnce(&mut Classes)) {
        let classes = &self.equality.classes;
        let found = pairs.iter().map(|&(left, right)| (classes.find(left), classes.find(right)));
        let apart = found.filter(|(left, right)| left != right);
        let old: BTreeSet<Symbol> = apart.flat_map(|(left, right)| [left, right]).collect();
        for &representative in &old {
            self.note_class(representative);
        }
        connect(&mut self.equality.classes);
        let lost: BTreeSet<Symbol> =
            old.iter().copied().filter(|&name| self.equality.classes.find(name) != name).collect();
        for fact in self.collect(&lost) {
            let row = self.equality.classes.normal(&fact);
            self.originals(&row).insert(fact);
        }
        for name in old {
            self.touch_reflexive(name);
        }
    }

    /// Joins what is concluded to be one, until nothing more is.
    fn join_concluded(&mut self) -> Result<(), Error> {
        loop {
            let mut connected = Forest::default();
            let mut edges: Vec<Edge> = Vec::new();
            for pair in std::mem::take(&mut self.joining) {
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

    /// Keeps what a row stands for; whether the row is stated.
    fn keep(&mut self, row: &Fact, facts: BTreeSet<Fact>) -> bool {
        let equality = &mut self.equality;
        if equality.is_reflexive(row) && equality.is_pair(row, &self.engine.symbols) {
            let class = equality.classes.class(row.arguments[0]);
            let is_stated = |&name: &Symbol| equality.is_stated_pair(&Fact::new(equality.same, [name, name]));
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

    /// Brings the store and the rules up to the stated facts and classes.
    fn flush(&mut self) -> Result<(), Error> {
        let mut delta = Delta::default();
        for (row, facts) in std::mem::take(&mut self.open) {
            let was = self.engine.row_state(&row).is_some_and(|bits| bits & state::ASSERTED != 0);
            match (was, self.keep(&row, facts)) {
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
        self.note(change);
        Ok(())
    }

    fn note(&mut self, change: Delta) {
        for (rows, sign) in [(change.insert, 1), (change.delete, -1)] {
            for row in rows {
                if sign == 1 && row.predicate == self.equality.same && row.arguments.len() == 2 {
                    self.joining.push(row.clone());
                }
                let net = self.net.entry(row).or_default();
                *net += sign;
            }
        }
    }

    /// The change of facts about names, sorted.
    fn report(&mut self, added: &[Fact], removed: &[Fact]) -> Delta {
        let mut after: FxHashSet<Fact> = FxHashSet::default();
        let moved: BTreeSet<Symbol> =
            self.moved.keys().map(|&name| self.equality.classes.find(name)).collect();
        let mut rows: Vec<Fact> = moved.into_iter().flat_map(|name| self.mentions(name)).collect();
        let net = std::mem::take(&mut self.net);
        for (row, net) in net {
            match net {
                1 => rows.push(row),
                -1 => {
                    let facts = self.facts_before(&row);
                    self.before.extend(facts);
                }
                _ => {}
            }
        }
        for row in rows {
            after.extend(self.equality.facts_of(&row, &|symbol| self.equality.names(symbol)));
        }
        let reflexive = |facts: &[Fact]| -> Vec<Fact> {
            let is_reflexive = |fact: &&Fact| {
                self.equality.is_pair(fact, &self.engine.symbols) && self.equality.is_reflexive(fact)
            };
            facts.iter().filter(is_reflexive).cloned().collect()
        };
        let mut insert: Vec<Fact> = after.difference(&self.before).cloned().chain(reflexive(added)).collect();
        let mut delete: Vec<Fact> =
            self.before.difference(&after).cloned().chain(reflexive(removed)).collect();
        insert.sort_unstable();
        delete.sort_unstable();
        Delta { insert, delete }
    }
}

/// Joins the two names of a stated pair, unless they are one already.
fn connect_stated(classes: &mut Classes, pair: &Fact) {
    let (left, right) = (pair.arguments[0], pair.arguments[1]);
    if classes.find(left) != classes.find(right) {
        let (facts, edges, proof) = (vec![pair.clone()], Vec::new(), Vec::new());
        classes.connect(Edge { left, right, facts, edges, proof });
        classes.join(left, right);
    }
}
