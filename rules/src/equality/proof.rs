//! Explanations of facts about names, and of equalities (`owl:sameAs`) between names.
//!
//! A recorded derivation contains the representatives of equality classes, which are names, too. A fact
//! with other names of the same individuals follows from the derived fact by equality. Each equality
//! keeps its own derivation, which uses only earlier equalities. If a fact occurs in several
//! derivations, the earliest one explains it, so that no fact supports itself.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::Equality;
use super::classes::{Edge, EdgeId, Step};
use crate::derivation::{Aggregated, Derivation, DerivationStep, Reason};
use crate::engine::Engine;
use crate::fact::Fact;
use crate::fixpoint::resolve;
use crate::rule::{Atom, Rule, Term, Variable};
use crate::safety::bound_variables;
use crate::store::{Record, state};
use crate::symbol::Symbol;

/// Creates the edge (recorded equality) of a derived `owl:sameAs` pair, with the derivation of the pair
/// and the facts and edges on which the derivation depends.
pub(super) fn edge_of(engine: &Engine, equality: &Equality, pair: &Fact) -> Edge {
    let proof = Builder::new(engine, equality).prove_derived(pair);
    let leaves = proof.iter().filter(|step| step.reason == Reason::Asserted).map(|step| &step.fact);
    let (pairs, facts): (Vec<&Fact>, Vec<&Fact>) = leaves
        .partition(|fact| equality.is_pair(fact, &engine.symbols) && fact.arguments[0] != fact.arguments[1]);
    let classes = &equality.classes;
    let edges = pairs
        .iter()
        .flat_map(|pair| classes.path(pair.arguments[0], pair.arguments[1], classes.next_edge_id()));
    let facts = facts.into_iter().cloned().collect();
    Edge { left: pair.arguments[0], right: pair.arguments[1], facts, edges: edges.collect(), proof }
}

/// A reason of a fact; the supports in the reason are indices into `steps`.
#[derive(Clone)]
struct Ground<'a> {
    reason: &'a Reason,
    steps: &'a [Step],
}

impl Equality {
    pub fn why(&self, engine: &Engine, fact: &Fact) -> Derivation {
        let derivation = Builder::new(engine, self).prove(fact);
        let edges = self.edges_in(engine, &derivation);
        if edges.is_empty() {
            return Derivation { steps: derivation };
        }
        let mut grounds: FxHashMap<Fact, Ground> = FxHashMap::default();
        let stated = Reason::Asserted;
        let is_edge = |step: &Step| step.reason == Reason::Asserted && self.is_edge(engine, &step.fact);
        // In the order of edges: a fact keeps the reason of the earliest derivation in which it occurs.
        for edge in edges.values() {
            if edge.proof.is_empty() {
                let pair = Fact::new(self.same_as, [edge.left, edge.right]);
                grounds.entry(pair).or_insert(Ground { reason: &stated, steps: &[] });
            }
            for step in edge.proof.iter().filter(|step| !is_edge(step)) {
                let ground = Ground { reason: &step.reason, steps: &edge.proof };
                grounds.entry(step.fact.clone()).or_insert(ground);
            }
        }
        for step in derivation.iter().filter(|step| !is_edge(step)) {
            grounds.entry(step.fact.clone()).or_insert(Ground { reason: &step.reason, steps: &derivation });
        }
        let mut queue = vec![fact.clone()];
        let mut positions = FxHashMap::from_iter([(fact.clone(), 0)]);
        let mut steps: Vec<Step> = Vec::new();
        while let Some(fact) = queue.get(steps.len()).cloned() {
            let reason = match grounds.get(&fact) {
                Some(ground) => rebased(ground, |fact| {
                    *positions.entry(fact.clone()).or_insert_with(|| {
                        queue.push(fact.clone());
                        queue.len() - 1
                    })
                }),
                None => Reason::Asserted,
            };
            steps.push(DerivationStep { fact, reason });
        }
        Derivation { steps }
    }

    /// Returns all recorded equalities as `owl:sameAs` facts. Each equality comes after the equalities
    /// that its derivation uses.
    pub fn pairs_in_order(&self) -> Vec<Fact> {
        let edges: BTreeMap<EdgeId, &Edge> =
            self.classes.edges.iter().map(|(id, edge)| (*id, edge)).collect();
        edges.into_values().map(|edge| Fact::new(self.same_as, [edge.left, edge.right])).collect()
    }

    fn is_edge(&self, engine: &Engine, fact: &Fact) -> bool {
        self.is_pair(fact, &engine.symbols) && fact.arguments[0] != fact.arguments[1]
    }

    /// Returns the edges that the steps use, directly or through the derivations of other edges.
    fn edges_in(&self, engine: &Engine, steps: &[Step]) -> BTreeMap<EdgeId, &Edge> {
        let mut used_edges: BTreeMap<EdgeId, &Edge> = BTreeMap::new();
        let mut stack: Vec<EdgeId> = Vec::new();
        for step in
            steps.iter().filter(|step| step.reason == Reason::Asserted && self.is_edge(engine, &step.fact))
        {
            let (left, right) = (step.fact.arguments[0], step.fact.arguments[1]);
            stack.extend(self.classes.path(left, right, self.classes.next_edge_id()));
        }
        while let Some(id) = stack.pop() {
            if let Some(edge) = self.classes.edges.get(&id)
                && used_edges.insert(id, edge).is_none()
            {
                stack.extend(&edge.edges);
            }
        }
        used_edges
    }

    /// Returns a stated fact that equals `row` after its names are replaced by their representatives;
    /// `None` if there is no such fact.
    pub fn witness(&self, engine: &Engine, row: &Fact) -> Option<Fact> {
        match self.originals.get(row) {
            Some(facts) => facts.first().cloned(),
            None => engine.row_state(row).filter(|bits| bits & state::ASSERTED != 0).map(|_| row.clone()),
        }
    }

    /// Converts the rows (facts about representatives) of a violated constraint to facts about names, preferably stated
    /// facts. If the arguments of one fact are different names of one individual, adds the equality of these names.
    /// Equalities between names in different facts are not added.
    pub fn witnesses(&self, engine: &Engine, rows: Vec<Fact>) -> Vec<Fact> {
        let mut facts = Vec::new();
        for row in rows {
            let fact = if self.is_reflexive(&row) {
                let class = self.classes.class(row.arguments[0]);
                let second = class.get(1).copied().unwrap_or(row.arguments[0]);
                Fact::new(self.same_as, [class[0], second])
            } else {
                self.witness(engine, &row).unwrap_or_else(|| row.clone())
            };
            for (at, &name) in fact.arguments.iter().enumerate() {
                let later = fact.arguments[at + 1..].iter().filter(|&&other| other != name);
                let aliases = later.filter(|&&other| self.classes.find(other) == self.classes.find(name));
                facts.extend(aliases.map(|&other| Fact::new(self.same_as, [name, other])));
            }
            facts.push(fact);
        }
        let mut unique = rustc_hash::FxHashSet::default();
        facts.retain(|fact| unique.insert(fact.clone()));
        facts
    }
}

fn rebased(ground: &Ground, mut position: impl FnMut(&Fact) -> usize) -> Reason {
    let mut renumber =
        |supports: &[usize]| supports.iter().map(|&at| position(&ground.steps[at].fact)).collect::<Vec<_>>();
    match ground.reason {
        Reason::Asserted => Reason::Asserted,
        Reason::Equality { supports } => Reason::Equality { supports: renumber(supports) },
        Reason::Rule { identity, bindings, supports, absent, aggregates } => Reason::Rule {
            identity: identity.clone(),
            bindings: bindings.clone(),
            supports: renumber(supports),
            absent: absent.clone(),
            aggregates: aggregates
                .iter()
                .map(|aggregated| Aggregated {
                    result: aggregated.result,
                    matches: aggregated.matches.iter().map(|supports| renumber(supports)).collect(),
                })
                .collect(),
        },
    }
}

struct Builder<'a> {
    engine: &'a Engine,
    equality: &'a Equality,
    positions: FxHashMap<Fact, usize>,
    queue: Vec<Fact>,
}

impl<'a> Builder<'a> {
    fn new(engine: &'a Engine, equality: &'a Equality) -> Self {
        Self { engine, equality, positions: FxHashMap::default(), queue: Vec::new() }
    }

    fn position(&mut self, fact: &Fact) -> usize {
        let queue = &mut self.queue;
        *self.positions.entry(fact.clone()).or_insert_with(|| {
            queue.push(fact.clone());
            queue.len() - 1
        })
    }

    fn prove(mut self, fact: &Fact) -> Vec<Step> {
        self.position(fact);
        self.finish(Vec::new())
    }

    /// Explains a derived `owl:sameAs` pair whose names are not yet in one equality class.
    fn prove_derived(mut self, pair: &Fact) -> Vec<Step> {
        self.position(pair);
        // The pair itself is not stated, so its derivation starts with the recorded rule.
        let reason = self.derived(pair, pair).unwrap_or(Reason::Asserted);
        self.finish(vec![DerivationStep { fact: pair.clone(), reason }])
    }

    fn finish(mut self, mut steps: Vec<Step>) -> Vec<Step> {
        while let Some(fact) = self.queue.get(steps.len()).cloned() {
            let reason = self.reason(&fact);
            steps.push(DerivationStep { fact, reason });
        }
        steps
    }

    fn reason(&mut self, fact: &Fact) -> Reason {
        let (engine, equality) = (self.engine, self.equality);
        if equality.is_stated(engine, fact) {
            return Reason::Asserted;
        }
        let row = equality.classes.normal(fact);
        if equality.is_reflexive(&row) {
            return self.pair(fact);
        }
        match equality.witness(engine, &row) {
            Some(witness) => self.renamed(fact, &witness),
            None => self.derived(fact, &row).unwrap_or(Reason::Asserted),
        }
    }

    fn pair(&mut self, pair: &Fact) -> Reason {
        let (classes, same_as) = (&self.equality.classes, self.equality.same_as);
        let (from, mut to) = (pair.arguments[0], pair.arguments[1]);
        if from == to {
            // Rule bodies match `x sameAs x` because `x` has another name. The equalities that lead to this
            // name explain the match.
            to = classes.class(from).iter().copied().find(|&name| name != from).unwrap_or(to);
        }
        let path = classes.path(from, to, classes.next_edge_id());
        let pairs: Vec<Fact> = path
            .iter()
            .filter_map(|edge| classes.edges.get(edge))
            .map(|edge| Fact::new(same_as, [edge.left, edge.right]))
            .collect();
        if pairs.as_slice() == std::slice::from_ref(pair) {
            return Reason::Asserted;
        }
        Reason::Equality { supports: pairs.iter().map(|pair| self.position(pair)).collect() }
    }

    fn renamed(&mut self, fact: &Fact, other: &Fact) -> Reason {
        let mut supports = vec![self.position(other)];
        for (&name, &other) in fact.arguments.iter().zip(&other.arguments) {
            if name != other {
                let position = self.position(&Fact::new(self.equality.same_as, [name, other]));
                if !supports.contains(&position) {
                    supports.push(position);
                }
            }
        }
        Reason::Equality { supports }
    }

    /// Explains a fact by the rule recorded for `row`, i.e. for the fact with each name replaced by the
    /// representative of its equality class. `None` if the row is not stored, or if no rule is recorded.
    fn derived(&mut self, fact: &Fact, row: &Fact) -> Option<Reason> {
        let engine = self.engine;
        let relation = engine.store.get(engine.store.find(row.predicate, row.arguments.len())?);
        let record = relation.record(relation.find(&row.arguments)?);
        let rule = engine.rule_of(record)?;
        let bound = &*self.as_written(rule, engine.records.get(record));
        let heads = rule.head.iter().filter_map(|head| engine.concluded(head, bound));
        let concluded = heads.into_iter().find(|head| self.equality.classes.normal(head) == *row)?;
        if concluded != *fact {
            return Some(self.renamed(fact, &concluded));
        }
        let variables =
            (0..).zip(bound_variables(rule)).filter(|&(_, is_bound)| is_bound).map(|(v, _)| Variable(v));
        let bindings = variables.map(|v| (rule.variable_name(v), bound[usize::from(v.0)])).collect();
        let atoms = |negated: bool| {
            let ground = rule.body.iter().filter_map(move |atom| match atom {
                Atom::Relation { predicate, arguments } if !negated => Some((*predicate, arguments)),
                Atom::Not { predicate, arguments } if negated => Some((*predicate, arguments)),
                _ => None,
            });
            let value = |&term: &Term| resolve(term.into(), bound);
            ground.map(|(predicate, terms)| Fact::new(predicate, terms.iter().map(value))).collect::<Vec<_>>()
        };
        let supports = atoms(false).iter().map(|fact| self.position(fact)).collect();
        let aggregates = self.aggregates(record);
        Some(Reason::Rule {
            identity: rule.identity.clone(),
            bindings,
            supports,
            absent: atoms(true),
            aggregates,
        })
    }

    /// Returns the values `bound` of a rule's variables, as explanations show them. If the rule compares a
    /// variable with a constant by `sameAs`, the recorded value is the representative of the constant. The
    /// constant is returned instead, because no atom of the rule supports that the two are equal.
    fn as_written(&self, rule: &Rule, bound: &[Symbol]) -> Vec<Symbol> {
        let mut values = bound.to_vec();
        for atom in &rule.body {
            let (Atom::Same(Term::Variable(variable), Term::Constant(name))
            | Atom::Same(Term::Constant(name), Term::Variable(variable))) = atom
            else {
                continue;
            };
            let value = &mut values[usize::from(variable.0)];
            if self.equality.classes.find(*value) == self.equality.classes.find(*name) {
                *value = *name;
            }
        }
        values
    }

    fn aggregates(&mut self, record: Record) -> Vec<Aggregated> {
        let engine = self.engine;
        let mut aggregates = Vec::new();
        for (relation, key, result) in engine.aggregates(record) {
            let mut rows: Vec<_> = engine.group(relation, &key).map(|(row, _)| row).collect();
            rows.sort_unstable();
            let matches = rows.into_iter().map(|row| {
                let facts = engine.body_facts(engine.store.get(relation).record(row), false);
                facts.iter().map(|fact| self.position(fact)).collect()
            });
            aggregates.push(Aggregated { result, matches: matches.collect() });
        }
        aggregates
    }
}
