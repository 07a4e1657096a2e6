//! Queries about facts with any names of individuals. The engine stores each fact only with the representatives
//! of the equality classes.

use smallvec::SmallVec;

use super::Equality;
use super::classes::expand;
use crate::engine::Engine;
use crate::fact::{Arguments, Fact};
use crate::store::state;
use crate::symbol::Symbol;

impl Equality {
    /// Returns `true` if a fact holds. Its arguments may be any names of the individuals, not only
    /// representatives. An `owl:sameAs` pair of a name with itself holds only if it is stated.
    pub fn holds(&self, engine: &Engine, fact: &Fact) -> bool {
        let row = self.classes.normal(fact);
        match self.is_pair(fact, &engine.symbols) && self.is_reflexive(&row) {
            true if fact.arguments[0] == fact.arguments[1] => self.is_stated_pair(fact),
            true => true,
            false => engine.row_state(&row).is_some(),
        }
    }

    /// Returns `true` if a fact is stated with exactly these names. Facts about other names of the same
    /// individuals do not count.
    pub fn is_stated(&self, engine: &Engine, fact: &Fact) -> bool {
        if self.is_pair(fact, &engine.symbols) {
            return self.is_stated_pair(fact);
        }
        let row = self.classes.normal(fact);
        match self.originals.get(&row) {
            Some(facts) => facts.contains(fact),
            None => row == *fact && engine.row_state(&row).is_some_and(|bits| bits & state::ASSERTED != 0),
        }
    }

    pub fn stated(&self, engine: &Engine) -> Vec<Fact> {
        // A stated `owl:sameAs` pair is stored under both of its names; the filter selects it once.
        let pairs = self
            .pairs
            .iter()
            .flat_map(|(name, pairs)| pairs.iter().filter(|pair| pair.arguments[0] == *name));
        let mut facts: Vec<Fact> = pairs.cloned().collect();
        for row in engine.rows_with(state::ASSERTED) {
            match self.originals.get(&row) {
                Some(originals) => facts.extend(originals.iter().cloned()),
                None if self.is_reflexive(&row) => {}
                None => facts.push(row),
            }
        }
        facts
    }

    /// Returns the facts about names that a row represents; `names` returns the names in the class of a
    /// representative. The `owl:sameAs` row of an individual with itself represents only pairs of different
    /// names.
    pub(super) fn facts_of<'n>(
        &'n self,
        row: &Fact,
        names: &impl Fn(Symbol) -> Option<&'n [Symbol]>,
    ) -> Vec<Fact> {
        let (predicate, is_reflexive) = (row.predicate, self.is_reflexive(row));
        let rows = expand(&row.arguments, |_, symbol| names(symbol)).into_iter();
        let rows = rows.filter(move |row| !is_reflexive || row[0] != row[1]);
        rows.map(|arguments| Fact { predicate, arguments }).collect()
    }

    /// Returns all facts that hold, in no particular order. For a class of more than `max_names` names, the only
    /// equalities are the pairs of the first name with each other name, and stated pairs of a name with itself.
    pub fn facts(&self, engine: &Engine, max_names: usize) -> Vec<Fact> {
        let names = |symbol| self.names(symbol);
        let mut facts: Vec<Fact> = Vec::new();
        for row in engine.rows_with(0) {
            match row.arguments.first().and_then(|&name| self.names(name)) {
                Some(class) if class.len() > max_names && self.is_reflexive(&row) => {
                    facts.extend(class[1..].iter().map(|&name| Fact::new(self.same_as, [class[0], name])));
                }
                None if row.arguments.iter().all(|&name| self.names(name).is_none())
                    && !self.is_reflexive(&row) =>
                {
                    facts.push(row);
                }
                _ => facts.extend(self.facts_of(&row, &names)),
            }
        }
        facts.extend(self.reflexive_pairs(None).map(|arguments| Fact { predicate: self.same_as, arguments }));
        facts
    }

    fn reflexive_pairs(&self, name: Option<Symbol>) -> impl Iterator<Item = Arguments> {
        let fits = move |at: Symbol| name.is_none_or(|name| name == at);
        let pairs = self.pairs.values().flatten().filter(|pair| pair.arguments[0] == pair.arguments[1]);
        pairs.map(|pair| pair.arguments.clone()).filter(move |pair| fits(pair[0]))
    }

    /// Returns the arguments of the facts that match a pattern. `None` in the pattern matches every symbol.
    pub fn matching(&self, engine: &Engine, predicate: Symbol, pattern: &[Option<Symbol>]) -> Vec<Arguments> {
        let normal: SmallVec<[Option<Symbol>; 4]> =
            pattern.iter().map(|wanted| wanted.map(|name| self.classes.find(name))).collect();
        let fits =
            |row: &Arguments| row.iter().zip(pattern).all(|(&v, wanted)| wanted.is_none_or(|w| w == v));
        let mut results = Vec::new();
        for row in engine.matching_rows(predicate, &normal) {
            if predicate != self.same_as && row.iter().all(|&symbol| self.names(symbol).is_none()) {
                let row = Arguments::from_slice(row);
                results.extend(Some(row).filter(&fits));
                continue;
            }
            // A name in the pattern belongs to the class of the symbol in its column.
            let names = |column: usize, symbol| match &pattern[column] {
                Some(name) => Some(std::slice::from_ref(name)),
                None => self.names(symbol),
            };
            // The pairs of names with themselves follow.
            let is_reflexive = predicate == self.same_as && row.len() == 2 && row[0] == row[1];
            let rows = expand(row, names).into_iter();
            results.extend(rows.filter(|row| !is_reflexive || row[0] != row[1]));
        }
        if predicate == self.same_as && pattern.len() == 2 {
            results.extend(self.reflexive_pairs(pattern[0]).filter(fits));
        }
        results
    }

    pub fn clashes(&self, engine: &Engine) -> Vec<Fact> {
        let rows = engine.matching_rows(self.same_as, &[None, None]);
        let clashes = rows.filter(|row| engine.symbols.differ(row[0], row[1]));
        clashes.map(|row| Fact::new(self.same_as, row.iter().copied())).collect()
    }
}
