//! A set of facts, and which of them have a symbol at a place.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::fact::Fact;
use crate::symbol::Symbol;

/// A predicate and how many arguments it has.
type Relation = (Symbol, usize);

/// Facts that do not change any more.
pub(super) struct Facts {
    all: FxHashSet<Fact>,
    by_relation: FxHashMap<Relation, Vec<Fact>>,
    /// Positions in `by_relation`, by the symbol at a place.
    by_place: FxHashMap<(Relation, usize, Symbol), Vec<usize>>,
}

impl Facts {
    pub fn new(facts: impl Iterator<Item = Fact>) -> Self {
        let mut known = Self {
            all: FxHashSet::default(),
            by_relation: FxHashMap::default(),
            by_place: FxHashMap::default(),
        };
        for fact in facts {
            if !known.all.insert(fact.clone()) {
                continue;
            }
            let relation = (fact.predicate, fact.arguments.len());
            let rows = known.by_relation.entry(relation).or_default();
            for (place, symbol) in fact.arguments.iter().enumerate() {
                known.by_place.entry((relation, place, *symbol)).or_default().push(rows.len());
            }
            rows.push(fact);
        }
        known
    }

    pub fn contains(&self, fact: &Fact) -> bool {
        self.all.contains(fact)
    }

    /// The facts of a relation with a symbol at a place, or all of them.
    pub fn rows(&self, relation: Relation, place: Option<(usize, Symbol)>) -> Vec<&Fact> {
        let Some(rows) = self.by_relation.get(&relation) else { return Vec::new() };
        match place {
            None => rows.iter().collect(),
            Some((place, symbol)) => {
                let positions = self.by_place.get(&(relation, place, symbol));
                positions.into_iter().flatten().map(|position| &rows[*position]).collect()
            }
        }
    }

    /// How many there are of them.
    pub fn count(&self, relation: Relation, place: Option<(usize, Symbol)>) -> usize {
        match place {
            None => self.by_relation.get(&relation).map_or(0, Vec::len),
            Some((place, symbol)) => self.by_place.get(&(relation, place, symbol)).map_or(0, Vec::len),
        }
    }
}
