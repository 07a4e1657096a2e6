//! Explanations of facts by recorded derivations, and the list of violations.

use rustc_hash::FxHashMap;

use crate::derivation::{Aggregated, Cause, Derivation, DerivationStep, Reason, Violation};
use crate::engine::Engine;
use crate::fact::Fact;
use crate::fixpoint::resolve;
use crate::literal::Literal;
use crate::plan::Condition;
use crate::rule::{Atom, Rule, Variable};
use crate::safety::bound_variables;
use crate::source::Source;
use crate::store::{Record, RelationId, Row, state};
use crate::symbol::Symbol;
use crate::vocabulary::{DIFFERENT_FROM, SAME_AS};

impl Engine {
    /// Returns the derivation that was recorded when the fact was derived, down to stated facts, or `None` if the
    /// fact does not hold. The rules are not evaluated again. A fact that is both stated and derived is reported as
    /// stated.
    ///
    /// ```
    /// use metaplan_rules::{Engine, Fact};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mut engine = Engine::builder().prefix("", "e:").rules("text", "-> :Wet(:grass) . [slip] :Wet(?x) -> :Slippery(?x) .").build()?;
    /// let [slippery, grass] = ["e:Slippery", "e:grass"].map(|name| engine.name(name));
    /// let derivation = engine.why(&Fact::new(slippery, [grass])).ok_or("it holds")?;
    /// assert_eq!(derivation.steps.len(), 2);
    /// # Ok(())
    /// # }
    /// ```
    pub fn why(&self, fact: &Fact) -> Option<Derivation> {
        if let Some(equality) = &self.equality {
            return equality.holds(self, fact).then(|| equality.why(self, fact));
        }
        let relation = self.store.find(fact.predicate, fact.arguments.len())?;
        let row = self.store.get(relation).find(&fact.arguments)?;
        let mut search = Search { engine: self, positions: FxHashMap::default(), queue: Vec::new() };
        search.position(relation, row);
        let mut steps = Vec::new();
        while let Some(&(relation, row)) = search.queue.get(steps.len()) {
            let fact = self.store.get(relation).fact(row)?;
            steps.push(DerivationStep { fact, reason: search.reason(relation, row) });
        }
        Some(Derivation { steps })
    }

    /// Returns all violations, sorted: the matches of integrity constraints (rules with an empty head), the facts
    /// with ill-typed literals and, under equality, the `owl:sameAs` pairs of a literal with a name or a certainly
    /// different literal. Under equality, a match binds individuals rather than names, and its supports are stated
    /// facts where possible.
    pub fn violations(&self) -> Vec<Violation> {
        let mut violations = Vec::new();
        for &(relation, position) in &self.network.constraints {
            let relation = self.store.get(relation);
            for row in relation.scan() {
                let record = relation.record(row);
                let mut supports = self.body_facts(record, false);
                for (matches, key, _) in self.aggregates(record) {
                    let rows = self.group(matches, &key).map(|(row, _)| self.store.get(matches).record(row));
                    supports.extend(rows.flat_map(|record| self.body_facts(record, false)));
                }
                if let Some(equality) = &self.equality {
                    supports = equality.witnesses(self, supports);
                }
                let cause = Cause::Constraint(self.program.rules[position].identity.clone());
                violations.push(Violation { cause, supports });
            }
        }
        if let Some(equality) = &self.equality {
            let clashes = equality.clashes(self).into_iter();
            violations.extend(clashes.map(|fact| Violation { cause: Cause::Clash, supports: vec![fact] }));
        }
        if self.symbols.any_ill_typed() {
            violations.extend(self.ill_typed());
        }
        violations.sort();
        violations
    }

    fn ill_typed(&self) -> impl Iterator<Item = Violation> {
        let is_bad = |symbol: &Symbol| self.symbols.as_literal(*symbol).is_some_and(Literal::is_ill_typed);
        // Names are never ill-typed, so that the omitted equalities do not matter.
        self.facts_in_brief(1).into_iter().filter_map(move |fact| {
            let bad = fact.arguments.iter().copied().find(is_bad)?;
            Some(Violation { cause: Cause::IllTyped(bad), supports: vec![fact] })
        })
    }

    pub(crate) fn body_facts(&self, record: Record, negated: bool) -> Vec<Fact> {
        let bound = self.records.get(record);
        self.body(record, negated)
            .filter_map(|(relation, sources)| {
                let arguments = sources.iter().map(|&source| resolve(source, bound));
                Some(Fact::new(self.store.get(relation).predicate?, arguments))
            })
            .collect()
    }

    /// Returns the fact that a head atom derives if the variables have the values `bound`; `None` for an atom
    /// that no rule can derive.
    pub(crate) fn concluded(&self, head: &Atom, bound: &[Symbol]) -> Option<Fact> {
        let predicate = match head {
            Atom::Relation { predicate, .. } => *predicate,
            Atom::Same(..) => self.symbols.find_name(SAME_AS)?,
            Atom::Different(..) => self.symbols.find_name(DIFFERENT_FROM)?,
            _ => return None,
        };
        let arguments = head.terms().into_iter().map(|term| resolve(term.into(), bound));
        Some(Fact::new(predicate, arguments))
    }

    /// Returns the aggregates in the body of a recorded derivation: relation of the matches, group and
    /// result.
    pub(crate) fn aggregates(
        &self,
        record: Record,
    ) -> impl Iterator<Item = (RelationId, Vec<Symbol>, Symbol)> {
        let bound = self.records.get(record);
        let rule = self.network.rules.get(record.rule as usize);
        rule.into_iter().flat_map(|rule| &rule.body).filter_map(|condition| match condition {
            Condition::Aggregate { matches, group, result, .. } => {
                let key = group.iter().map(|&source| resolve(source, bound)).collect();
                Some((*matches, key, resolve(*result, bound)))
            }
            _ => None,
        })
    }

    fn body(&self, record: Record, negated: bool) -> impl Iterator<Item = (RelationId, &[Source])> {
        let rule = self.network.rules.get(record.rule as usize);
        rule.into_iter().flat_map(|rule| &rule.body).filter_map(move |condition| match condition {
            Condition::Relation(relation, sources) if !negated => Some((*relation, sources.as_slice())),
            Condition::Not(relation, sources) if negated => Some((*relation, sources.as_slice())),
            _ => None,
        })
    }

    pub(crate) fn group(
        &self,
        relation: RelationId,
        key: &[Symbol],
    ) -> impl Iterator<Item = (Row, &[Symbol])> {
        let relation = self.store.get(relation);
        let bound = (0..key.len()).fold(0, |mask, column| mask | 1 << column);
        let index = relation.best_index(bound).filter(|&(_, columns)| columns == bound);
        let indexed = index.map(|(index, _)| relation.lookup(index, key));
        let scanned = if indexed.is_none() { 0..relation.bound() } else { 0..0 };
        let rows = indexed.into_iter().flatten().chain(scanned);
        let visible = rows.filter(|&row| relation.state(row) & state::FREE == 0);
        // The scan returns all rows, so the key is checked again.
        let key = key.to_vec();
        visible.map(|row| (row, relation.row(row))).filter(move |(_, row)| row[..key.len()] == key[..])
    }

    pub(crate) fn rule_of(&self, record: Record) -> Option<&Rule> {
        Some(&self.program.rules[self.network.rules.get(record.rule as usize)?.rule])
    }
}

struct Search<'a> {
    engine: &'a Engine,
    positions: FxHashMap<(RelationId, Row), usize>,
    queue: Vec<(RelationId, Row)>,
}

impl Search<'_> {
    fn position(&mut self, relation: RelationId, row: Row) -> usize {
        let queue = &mut self.queue;
        *self.positions.entry((relation, row)).or_insert_with(|| {
            queue.push((relation, row));
            queue.len() - 1
        })
    }

    fn reason(&mut self, relation: RelationId, row: Row) -> Reason {
        let engine = self.engine;
        let record = engine.store.get(relation).record(row);
        let asserted = engine.store.get(relation).state(row) & state::ASSERTED != 0;
        let Some(rule) = engine.rule_of(record).filter(|_| !asserted) else { return Reason::Asserted };
        let bound = engine.records.get(record);
        let variables =
            (0..).zip(bound_variables(rule)).filter(|&(_, is_bound)| is_bound).map(|(v, _)| Variable(v));
        let bindings = variables.map(|v| (rule.variable_name(v), bound[usize::from(v.0)])).collect();
        let supports = self.supports(record);
        let absent = engine.body_facts(record, true);
        let aggregates = self.aggregates(record);
        Reason::Rule { identity: rule.identity.clone(), bindings, supports, absent, aggregates }
    }

    fn supports(&mut self, record: Record) -> Vec<usize> {
        let engine = self.engine;
        let bound = engine.records.get(record);
        let mut supports = Vec::new();
        for (relation, sources) in engine.body(record, false) {
            let arguments: Vec<Symbol> = sources.iter().map(|&source| resolve(source, bound)).collect();
            if let Some(row) = engine.store.get(relation).find(&arguments) {
                supports.push(self.position(relation, row));
            }
        }
        supports
    }

    fn aggregates(&mut self, record: Record) -> Vec<Aggregated> {
        let engine = self.engine;
        let mut aggregates = Vec::new();
        for (relation, key, result) in engine.aggregates(record) {
            let mut rows: Vec<(Row, &[Symbol])> = engine.group(relation, &key).collect();
            rows.sort_unstable_by_key(|&(_, row)| row);
            let record = |row: Row| engine.store.get(relation).record(row);
            let matches = rows.into_iter().map(|(row, _)| self.supports(record(row))).collect();
            aggregates.push(Aggregated { result, matches });
        }
        aggregates
    }
}
