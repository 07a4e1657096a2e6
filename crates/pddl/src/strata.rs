//! Stratification of derived predicates: each predicate is in a higher stratum than all derived predicates
//! that its axioms negate.

use rustc_hash::{FxHashMap, FxHashSet};

use super::ast::{Condition, Domain, Name};

#[derive(Debug)]
pub(crate) struct Strata<'d> {
    level: FxHashMap<&'d Name, usize>,
}

/// Error: the derived predicate depends on its own negation.
#[derive(Debug)]
pub(crate) struct NegativeCycle<'d>(pub(crate) &'d Name);

impl<'d> Strata<'d> {
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
        // Longest paths by relaxation. Without a cycle through a negation, levels stay below the number of
        // derived predicates.
        let limit = level.len();
        loop {
            let mut changed = false;
            for (head, body, step) in &edges {
                let required = level[body] + step;
                if level[head] < required {
                    if required > limit {
                        return Err(NegativeCycle(on_negative_cycle(&edges).unwrap_or(head)));
                    }
                    level.insert(head, required);
                    changed = true;
                }
            }
            if !changed {
                return Ok(Self { level });
            }
        }
    }

    pub(crate) fn level(&self, name: &Name) -> Option<usize> {
        self.level.get(name).copied()
    }
}

/// Dependency of a derived predicate (first) on another (second). The number is 1 if the dependency is negated, else 0.
type Dependency<'d> = (&'d Name, &'d Name, usize);

fn on_negative_cycle<'d>(edges: &[Dependency<'d>]) -> Option<&'d Name> {
    let depends = |from: &'d Name, target: &Name| {
        let (mut visited, mut open) = (FxHashSet::from_iter([from]), vec![from]);
        while let Some(name) = open.pop() {
            if name == target {
                return true;
            }
            let bodies = edges.iter().filter(|(head, ..)| *head == name).map(|(_, body, _)| *body);
            open.extend(bodies.filter(|body| visited.insert(*body)));
        }
        false
    };
    edges.iter().find(|(head, body, step)| *step == 1 && depends(body, head)).map(|(head, ..)| *head)
}

/// Calls `visit(predicate, negated)` for each atom of a condition. `negated` is `true` below an odd number of
/// negations; the premise of an implication counts as negated.
fn uses<'d>(condition: &'d Condition, negated: bool, visit: &mut impl FnMut(&'d Name, bool)) {
    match condition {
        Condition::Not(inner) => uses(inner, !negated, visit),
        Condition::Imply(premise, conclusion) => {
            uses(premise, !negated, visit);
            uses(conclusion, negated, visit);
        }
        Condition::Atom(atom) => visit(&atom.predicate.name, negated),
        other => other.parts().for_each(|part| uses(part, negated, visit)),
    }
}
