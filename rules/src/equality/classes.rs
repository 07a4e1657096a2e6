//! Which names stand for one individual: classes with a representative each, and the edges that connect their names.
//!
//! An edge is a pair of names that is stated to be one individual or was concluded to be. It knows what it rested on when
//! it was made: stated facts and earlier edges. So edges never support each other in a circle, and what becomes of a
//! class when a fact goes can be read off its edges.

use std::collections::BTreeSet;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::derivation::{DerivationStep, Reason};
use crate::fact::{Arguments, Fact};
use crate::rule::RuleIdentity;
use crate::symbol::Symbol;

/// A fact and what makes it hold, where an equality that has a derivation of its own counts as stated.
pub(super) type Step = DerivationStep;

/// Edges in the order in which they were made.
pub(super) type EdgeId = u32;

/// Why two names stand for one individual.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    pub left: Symbol,
    pub right: Symbol,
    /// Stated facts that it rests on.
    pub facts: Vec<Fact>,
    /// Earlier edges that it rests on.
    pub edges: Vec<EdgeId>,
    /// The derivation of the pair at the time, down to stated facts and other pairs; the pair itself comes first. Empty
    /// where the pair is stated.
    pub proof: Vec<Step>,
}

/// All classes of more than one name.
#[derive(Clone, Default, Debug)]
pub(super) struct Classes {
    representatives: FxHashMap<Symbol, Symbol>,
    members: FxHashMap<Symbol, Arc<[Symbol]>>,
    pub edges: FxHashMap<EdgeId, Edge>,
    next: EdgeId,
    /// The edges at each name.
    at: FxHashMap<Symbol, Vec<EdgeId>>,
    by_fact: FxHashMap<Fact, Vec<EdgeId>>,
    by_edge: FxHashMap<EdgeId, Vec<EdgeId>>,
}

impl Classes {
    /// The representative of a name, mostly the name itself.
    pub fn find(&self, name: Symbol) -> Symbol {
        self.representatives.get(&name).copied().unwrap_or(name)
    }

    /// The names of a representative's class in ascending order, `None` where there is only one.
    pub fn members(&self, representative: Symbol) -> Option<&Arc<[Symbol]>> {
        self.members.get(&representative)
    }

    /// The fact about representatives.
    pub fn normal(&self, fact: &Fact) -> Fact {
        Fact::new(fact.predicate, fact.arguments.iter().map(|&name| self.find(name)))
    }

    /// The class of a name, in ascending order.
    pub fn class(&self, name: Symbol) -> Arc<[Symbol]> {
        self.members(self.find(name)).map_or_else(|| Arc::from([name]), Arc::clone)
    }

    /// Adds an edge; the classes change with [`Classes::join`].
    pub fn connect(&mut self, edge: Edge) {
        let id = self.next;
        self.next += 1;
        for name in [edge.left, edge.right] {
            self.at.entry(name).or_default().push(id);
        }
        for fact in &edge.facts {
            self.by_fact.entry(fact.clone()).or_default().push(id);
        }
        for &earlier in &edge.edges {
            self.by_edge.entry(earlier).or_default().push(id);
        }
        self.edges.insert(id, edge);
    }

    /// The edges that rest on any of these facts or rules, directly or by other edges.
    pub fn resting_on<'f>(
        &self,
        facts: impl Iterator<Item = &'f Fact>,
        rules: &FxHashSet<&RuleIdentity>,
    ) -> BTreeSet<EdgeId> {
        let mut found: BTreeSet<EdgeId> =
            facts.flat_map(|fact| self.by_fact.get(fact).into_iter().flatten()).copied().collect();
        if !rules.is_empty() {
            let uses = |step: &Step| matches!(&step.reason, Reason::Rule { identity, .. } if rules.contains(identity));
            let concluded = self.edges.iter().filter(|(_, edge)| edge.proof.iter().any(uses));
            found.extend(concluded.map(|(&id, _)| id));
        }
        let mut open: Vec<EdgeId> = found.iter().copied().collect();
        while let Some(edge) = open.pop() {
            let further = self.by_edge.get(&edge).into_iter().flatten().copied();
            open.extend(further.filter(|&edge| found.insert(edge)));
        }
        found
    }

    /// Removes edges; the classes change with [`Classes::split`].
    pub fn disconnect(&mut self, edges: &BTreeSet<EdgeId>) {
        fn forget<K: std::hash::Hash + Eq>(index: &mut FxHashMap<K, Vec<EdgeId>>, key: &K, edge: EdgeId) {
            if let Some(edges) = index.get_mut(key) {
                edges.retain(|&other| other != edge);
                if edges.is_empty() {
                    index.remove(key);
                }
            }
        }
        for &id in edges {
            let Some(edge) = self.edges.remove(&id) else { continue };
            for name in [edge.left, edge.right] {
                forget(&mut self.at, &name, id);
            }
            edge.facts.iter().for_each(|fact| forget(&mut self.by_fact, fact, id));
            edge.edges.iter().for_each(|earlier| forget(&mut self.by_edge, earlier, id));
            self.by_edge.remove(&id);
        }
    }

    /// Makes one class of the classes of two names. The representative of the larger class stays.
    pub fn join(&mut self, left: Symbol, right: Symbol) {
        let (left, right) = (self.find(left), self.find(right));
        if left == right {
            return;
        }
        let size = |name| self.members(name).map_or(1, |members| members.len());
        let keeps = if (size(left), right) >= (size(right), left) { left } else { right };
        let mut members: Vec<Symbol> =
            [left, right].iter().flat_map(|&name| self.class(name).to_vec()).collect();
        // Two ascending runs, which a stable sort merges.
        members.sort();
        self.members.remove(&left);
        self.members.remove(&right);
        self.representatives.extend(members.iter().map(|&name| (name, keeps)));
        self.members.insert(keeps, members.into());
    }

    /// Takes a class apart into what its remaining edges connect.
    pub fn split(&mut self, representative: Symbol) {
        let Some(members) = self.members.remove(&representative) else { return };
        for name in members.iter() {
            self.representatives.remove(name);
        }
        for name in members.iter() {
            for edge in self.at.get(name).cloned().unwrap_or_default() {
                if let Some((left, right)) = self.edges.get(&edge).map(|edge| (edge.left, edge.right)) {
                    self.join(left, right);
                }
            }
        }
    }

    /// The edges between two names of a class, among those before a given one.
    pub fn path(&self, from: Symbol, to: Symbol, before: EdgeId) -> Vec<EdgeId> {
        let mut came_by: FxHashMap<Symbol, (EdgeId, Symbol)> = FxHashMap::default();
        let (mut seen, mut front) = (FxHashSet::from_iter([from]), vec![from]);
        while !front.is_empty() && !seen.contains(&to) {
            let mut next = Vec::new();
            for name in front {
                for &id in self.at.get(&name).into_iter().flatten().filter(|&&id| id < before) {
                    let edge = &self.edges[&id];
                    let other = if edge.left == name { edge.right } else { edge.left };
                    if seen.insert(other) {
                        came_by.insert(other, (id, name));
                        next.push(other);
                    }
                }
            }
            front = next;
        }
        let (mut path, mut at) = (Vec::new(), to);
        while let Some(&(edge, previous)) = came_by.get(&at) {
            path.push(edge);
            at = previous;
        }
        path.reverse();
        path
    }

    /// The number that the next edge gets.
    pub fn now(&self) -> EdgeId {
        self.next
    }
}

/// All rows that a row about representatives stands for, given the names of each.
pub(super) fn expand<'n>(row: &[Symbol], names: impl Fn(Symbol) -> Option<&'n [Symbol]>) -> Vec<Arguments> {
    let mut rows: Vec<Arguments> = vec![Arguments::with_capacity(row.len())];
    for &symbol in row {
        match names(symbol) {
            None => rows.iter_mut().for_each(|row| row.push(symbol)),
            Some(names) => {
                let with = |row: &Arguments, name: Symbol| row.iter().copied().chain([name]).collect();
                rows = rows.iter().flat_map(|row| names.iter().map(move |&name| with(row, name))).collect();
            }
        }
    }
    rows
}
