//! Equality classes of names, each with a representative, and the edges that connect the names.
//!
//! An edge is a pair of names that was stated or derived to denote one individual. It records its premises at the
//! time of its derivation: stated facts and earlier edges. Therefore edges never support each other in a circle, and
//! the effect of a deleted fact on a class can be read off its edges.

use std::collections::BTreeSet;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::derivation::{DerivationStep, Reason};
use crate::fact::{Arguments, Fact};
use crate::rule::RuleIdentity;
use crate::symbol::Symbol;

/// Step of a derivation: a fact with its reason. The reason `Asserted` is also given to a premise that an
/// earlier edge supplies; [`Edge::proof`] of that edge has its derivation.
pub(super) type Step = DerivationStep;

/// Numbers edges in the order of creation.
pub(super) type EdgeId = u32;

#[derive(Clone, Debug)]
pub(super) struct Edge {
    pub left: Symbol,
    pub right: Symbol,
    /// Stated facts among the premises of this edge.
    pub facts: Vec<Fact>,
    /// Earlier edges among the premises of this edge.
    pub edges: Vec<EdgeId>,
    /// Derivation of the pair when the edge was created, down to stated facts and other pairs; the first
    /// step is the pair itself. Empty if the pair is stated.
    pub proof: Vec<Step>,
}

/// All equality classes with more than one name, and the edges within the classes.
#[derive(Clone, Default, Debug)]
pub(super) struct Classes {
    representatives: FxHashMap<Symbol, Symbol>,
    members: FxHashMap<Symbol, Arc<[Symbol]>>,
    pub edges: FxHashMap<EdgeId, Edge>,
    next: EdgeId,
    edges_at: FxHashMap<Symbol, Vec<EdgeId>>,
    by_fact: FxHashMap<Fact, Vec<EdgeId>>,
    by_edge: FxHashMap<EdgeId, Vec<EdgeId>>,
}

impl Classes {
    /// Returns the representative of a name. A name without other equal names represents itself.
    pub fn find(&self, name: Symbol) -> Symbol {
        self.representatives.get(&name).copied().unwrap_or(name)
    }

    /// Returns the names in a representative's class in ascending order; `None` for a class of one name.
    pub fn members(&self, representative: Symbol) -> Option<&Arc<[Symbol]>> {
        self.members.get(&representative)
    }

    pub fn normal(&self, fact: &Fact) -> Fact {
        Fact::new(fact.predicate, fact.arguments.iter().map(|&name| self.find(name)))
    }

    pub fn class(&self, name: Symbol) -> Arc<[Symbol]> {
        self.members(self.find(name)).map_or_else(|| Arc::from([name]), Arc::clone)
    }

    /// Adds an edge without changing the classes; see [`Classes::join`].
    pub fn connect(&mut self, edge: Edge) {
        let id = self.next;
        self.next += 1;
        for name in [edge.left, edge.right] {
            self.edges_at.entry(name).or_default().push(id);
        }
        for fact in &edge.facts {
            self.by_fact.entry(fact.clone()).or_default().push(id);
        }
        for &earlier in &edge.edges {
            self.by_edge.entry(earlier).or_default().push(id);
        }
        self.edges.insert(id, edge);
    }

    /// Returns the edges whose derivations depend on any of these facts or rules, directly or through other
    /// edges.
    pub fn depending_on<'f>(
        &self,
        facts: impl Iterator<Item = &'f Fact>,
        rules: &FxHashSet<&RuleIdentity>,
    ) -> BTreeSet<EdgeId> {
        let mut dependent: BTreeSet<EdgeId> =
            facts.flat_map(|fact| self.by_fact.get(fact).into_iter().flatten()).copied().collect();
        if !rules.is_empty() {
            let uses = |step: &Step| matches!(&step.reason, Reason::Rule { identity, .. } if rules.contains(identity));
            let derived = self.edges.iter().filter(|(_, edge)| edge.proof.iter().any(uses));
            dependent.extend(derived.map(|(&id, _)| id));
        }
        let mut stack: Vec<EdgeId> = dependent.iter().copied().collect();
        while let Some(edge) = stack.pop() {
            let dependents = self.by_edge.get(&edge).into_iter().flatten().copied();
            stack.extend(dependents.filter(|&edge| dependent.insert(edge)));
        }
        dependent
    }

    /// Removes edges without changing the classes; see [`Classes::split`].
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
                forget(&mut self.edges_at, &name, id);
            }
            edge.facts.iter().for_each(|fact| forget(&mut self.by_fact, fact, id));
            edge.edges.iter().for_each(|earlier| forget(&mut self.by_edge, earlier, id));
            self.by_edge.remove(&id);
        }
    }

    /// Makes two names equal. The representative of the larger class remains.
    pub fn join(&mut self, left: Symbol, right: Symbol) {
        let (left, right) = (self.find(left), self.find(right));
        if left == right {
            return;
        }
        // Equal sizes: the smaller symbol is kept, so that the result does not depend on the order of the
        // arguments.
        let size = |name| self.members(name).map_or(1, |members| members.len());
        let representative = if (size(left), right) >= (size(right), left) { left } else { right };
        let mut members: Vec<Symbol> =
            [left, right].iter().flat_map(|&name| self.class(name).to_vec()).collect();
        // The list consists of two ascending runs, which a stable sort merges in linear time.
        members.sort();
        self.members.remove(&left);
        self.members.remove(&right);
        self.representatives.extend(members.iter().map(|&name| (name, representative)));
        self.members.insert(representative, members.into());
    }

    /// Splits the class of `representative` into the connected components of its remaining edges.
    pub fn split(&mut self, representative: Symbol) {
        let Some(members) = self.members.remove(&representative) else { return };
        for name in members.iter() {
            self.representatives.remove(name);
        }
        for name in members.iter() {
            for edge in self.edges_at.get(name).cloned().unwrap_or_default() {
                if let Some((left, right)) = self.edges.get(&edge).map(|edge| (edge.left, edge.right)) {
                    self.join(left, right);
                }
            }
        }
    }

    /// Returns a shortest path between two names by breadth-first search over the edges with a number below
    /// `before`. Empty if there is no path, or if both names are the same.
    pub fn path(&self, from: Symbol, to: Symbol, before: EdgeId) -> Vec<EdgeId> {
        let mut predecessors: FxHashMap<Symbol, (EdgeId, Symbol)> = FxHashMap::default();
        let (mut visited, mut front) = (FxHashSet::from_iter([from]), vec![from]);
        while !front.is_empty() && !visited.contains(&to) {
            let mut next = Vec::new();
            for name in front {
                for &id in self.edges_at.get(&name).into_iter().flatten().filter(|&&id| id < before) {
                    let edge = &self.edges[&id];
                    let other = if edge.left == name { edge.right } else { edge.left };
                    if visited.insert(other) {
                        predecessors.insert(other, (id, name));
                        next.push(other);
                    }
                }
            }
            front = next;
        }
        let (mut path, mut current) = (Vec::new(), to);
        while let Some(&(edge, previous)) = predecessors.get(&current) {
            path.push(edge);
            current = previous;
        }
        path.reverse();
        path
    }

    pub fn next_edge_id(&self) -> EdgeId {
        self.next
    }
}

/// Returns the arguments of all facts that a row about representatives represents. `names` returns the names of a
/// symbol in a column that the facts can have there, or `None` if the symbol represents only itself.
pub(super) fn expand<'n>(
    row: &[Symbol],
    names: impl Fn(usize, Symbol) -> Option<&'n [Symbol]>,
) -> Vec<Arguments> {
    let mut rows: Vec<Arguments> = vec![Arguments::with_capacity(row.len())];
    for (column, &symbol) in row.iter().enumerate() {
        match names(column, symbol) {
            None => rows.iter_mut().for_each(|row| row.push(symbol)),
            Some(names) => {
                let append = |row: &Arguments, name: Symbol| row.iter().copied().chain([name]).collect();
                rows = rows.iter().flat_map(|row| names.iter().map(move |&name| append(row, name))).collect();
            }
        }
    }
    rows
}
