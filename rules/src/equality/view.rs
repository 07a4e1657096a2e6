//! What holds, for each name of each individual.

use smallvec::SmallVec;

use super::Equality;
use super::classes::expand;
use crate::engine::Engine;
use crate::fact::{Arguments, Fact};
use crate::store::state;
use crate::symbol::Symbol;

impl Equality {
    /// Whether a fact about names holds.
    pub fn holds(&self, engine: &Engine, fact: &Fact) -> bool {
        let row = self.classes.normal(fact);
        match self.is_pair(fact, &engine.symbols) && self.is_reflexive(&row) {
            true if fact.arguments[0] == fact.arguments[1] => self.is_stated_pair(fact),
            true => true,
            false => engine.row_state(&row).is_some(),
        }
    }

    /// Whether a fact about names is stated.
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

    /// Everything that is stated.
    pub fn stated(&self, engine: &Engine) -> Vec<Fact> {
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

    /// The facts about names that a row stands for; of pairs of equal names those that differ.
    pub(super) fn facts_of<'n>(
        &'n self,
        row: &Fact,
        names: &impl Fn(Symbol) -> Option<&'n [Symbol]>,
    ) -> Vec<Fact> {
        let (predicate, is_reflexive) = (row.predicate, self.is_reflexive(row));
        let rows = expand(&row.arguments, names).into_iter();
        let rows = rows.filter(move |row| !is_reflexive || row[0] != row[1]);
        rows.map(|arguments| Fact { predicate, arguments }).collect()
    }

    /// Everything that holds, in no order; of a class of more than `most` names, only the pairs with the first.
    pub fn facts(&self, engine: &Engine, most: usize) -> Vec<Fact> {
        let names = |symbol| self.names(symbol);
        let mut facts: Vec<Fact> = Vec::new();
        for row in engine.rows_with(0) {
            match row.arguments.first().and_then(|&name| self.names(name)) {
                Some(class) if class.len() > most && self.is_reflexive(&row) => {
                    facts.extend(class[1..].iter().map(|&name| Fact::new(self.same, [class[0], name])));
                }
                None if row.arguments.iter().all(|&name| self.names(name).is_none())
                    && !self.is_reflexive(&row) =>
                {
                    facts.push(row);
                }
                _ => facts.extend(self.facts_of(&row, &names)),
            }
        }
        facts.extend(self.reflexive_pairs(None).map(|arguments| Fact { predicate: self.same, arguments }));
        facts
    }

    /// The stated pairs of a name with itself.
    fn reflexive_pairs(&self, name: Option<Symbol>) -> impl Iterator<Item = Arguments> {
        let fits = move |at: Symbol| name.is_none_or(|name| name == at);
        let pairs = self.pairs.values().flatten().filter(|pair| pair.arguments[0] == pair.arguments[1]);
        pairs.map(|pair| pair.arguments.clone()).filter(move |pair| fits(pair[0]))
    }

    /// The arguments of the facts of a predicate that agree with a pattern.
    pub fn matching(&self, engine: &Engine, predicate: Symbol, pattern: &[Option<Symbol>]) -> Vec<Arguments> {
        let normal: SmallVec<[Option<Symbol>; 4]> =
            pattern.iter().map(|wanted| wanted.map(|name| self.classes.find(name))).collect();
        let fits =
            |row: &Arguments| row.iter().zip(pattern).all(|(&v, wanted)| wanted.is_none_or(|w| w == v));
        let mut found = Vec::new();
        for row in engine.matching_rows(predicate, &normal) {
            if predicate != self.same && row.iter().all(|&symbol| self.names(symbol).is_none()) {
                let row = Arguments::from_slice(row);
                found.extend(Some(row).filter(&fits));
                continue;
            }
            let row = Fact::new(predicate, row.iter().copied());
            let facts = self.facts_of(&row, &|symbol| self.names(symbol));
            found.extend(facts.into_iter().map(|fact| fact.arguments).filter(&fits));
        }
        if predicate == self.same && pattern.len() == 2 {
            found.extend(self.reflexive_pairs(pattern[0]).filter(fits));
        }
        found
    }

    /// Pairs with a literal that is not the other side.
    pub fn clashes(&self, engine: &Engine) -> Vec<Fact> {
        let rows = engine.matching_rows(self.same, &[None, None]);
        let clashes = rows.filter(|row| engine.symbols.differ(row[0], row[1]));
        clashes.map(|row| Fact::new(self.same, row.iter().copied())).collect()
    }
}
