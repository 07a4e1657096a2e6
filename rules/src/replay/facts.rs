//! An immutable set of facts with an index on each argument.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::fact::Fact;
use crate::symbol::Symbol;

type Relation = (Symbol, usize);

pub(super) struct Facts {
    members: FxHashSet<Fact>,
    by_relation: FxHashMap<Relation, Vec<Fact>>,
    /// Maps a relation, an argument position and a symbol to the positions in `by_relation` of the facts
    /// with this symbol.
    by_place: FxHashMap<(Relation, usize, Symbol), Vec<usize>>,
}

impl Facts {
    pub fn new(facts: impl Iterator<Item = Fact>) -> Self {
        let mut index = Self {
            members: FxHashSet::default(),
            by_relation: FxHashMap::default(),
            by_place: FxHashMap::default(),
        };
        for fact in facts {
            if !index.members.insert(fact.clone()) {
                continue;
            }
            let relation = (fact.predicate, fact.arguments.len());
            let rows = index.by_relation.entry(relation).or_default();
            for (place, symbol) in fact.arguments.iter().enumerate() {
                index.by_place.entry((relation, place, *symbol)).or_default().push(rows.len());
            }
            rows.push(fact);
        }
        index
    }

    pub fn contains(&self, fact: &Fact) -> bool {
        self.members.contains(fact)
    }

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

    pub fn count(&self, relation: Relation, place: Option<(usize, Symbol)>) -> usize {
        match place {
            None => self.by_relation.get(&relation).map_or(0, Vec::len),
            Some((place, symbol)) => self.by_place.get(&(relation, place, symbol)).map_or(0, Vec::len),
        }
    }
}
