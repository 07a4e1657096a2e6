//! In which order derived predicates can be evaluated: a predicate that another one negates comes before it.

use rustc_hash::FxHashMap;

use super::ast::{Condition, Domain, Name};

/// The layers of the derived predicates of a domain.
#[derive(Debug)]
pub(crate) struct Strata<'d> {
    level: FxHashMap<&'d Name, usize>,
}

/// A derived predicate that depends on its own negation.
#[derive(Debug)]
pub(crate) struct NegativeCycle<'d>(pub(crate) &'d Name);

impl<'d> Strata<'d> {
    /// Finds the layers.
    ///
    /// # Errors
    ///
    /// Where a derived predicate depends on its own negation there are none.
    #[expect(clippy::arithmetic_side_effects, reason = "levels are at most the number of predicates")]
    pub(crate) fn of(domain: &'d Domain) -> Result<Self, NegativeCycle<'d>> {
        let mut level: FxHashMap<&Name, usize> = FxHashMap::default();
        for axiom in &domain.derived {
            level.insert(&axiom.head.identifier.name, 0);
        }
        let mut edges = Vec::new();
        for axiom in &domain.derived {
            let head = &axiom.head.identifier.name;
            uses(&axiom.condition, false, &mut |name, negated| {
                if level.contains_key(name) {
                    edges.push((head, name, usize::from(negated)));
                }
            });
        }
        // Longest paths by relaxation; without a cycle through a negation no level reaches their number.
        let limit = level.len();
        loop {
            let mut changed = false;
            for (head, body, step) in &edges {
                let wanted = level[body] + step;
                if level[head] < wanted {
                    if wanted > limit {
                        return Err(NegativeCycle(head));
                    }
                    level.insert(head, wanted);
                    changed = true;
                }
            }
            if !changed {
                return Ok(Self { level });
            }
        }
    }

    /// The layer of a derived predicate; nothing for a basic one.
    pub(crate) fn level(&self, name: &Name) -> Option<usize> {
        self.level.get(name).copied()
    }
}

/// Calls `found` with each predicate of a condition and whether it stands under an odd number of negations.
fn uses<'d>(condition: &'d Condition, negated: bool, found: &mut impl FnMut(&'d Name, bool)) {
    match condition {
        Condition::Not(inner) => uses(inner, !negated, found),
        Condition::Imply(premise, conclusion) => {
            uses(premise, !negated, found);
            uses(conclusion, negated, found);
        }
        Condition::Atom(atom) => found(&atom.predicate.name, negated),
        other => other.parts().for_each(|part| uses(part, negated, found)),
    }
}
