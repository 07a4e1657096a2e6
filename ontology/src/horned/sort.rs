//! Sorts axioms and removes duplicates.
//!
//! Most axioms are assertions of two or three names. All names are sorted once, and these assertions are
//! compared by the ranks of their names instead of by text.

use std::cmp::Ordering;

use crate::names::Names;
use crate::owl::{AnnotatedAxiom, Axiom, ClassExpression, Iri, ObjectPropertyExpression};

/// Number of the kind "data property assertion" in a [`Key`].
const DATA: u8 = 2;

/// Sort key: kind of the assertion, then the ranks of up to three names.
type Key = (u8, u32, u32, u32);

/// Sorts axioms and removes duplicates. Works in place, because there may be millions of axioms.
pub(super) fn axioms(axioms: &mut Vec<AnnotatedAxiom>, names: &Names) {
    let ranks = names.ranks();
    let rank = |iri: &Iri| ranks.get(&iri.as_ptr()).copied();
    let unkeyed: Vec<AnnotatedAxiom> = axioms.extract_if(.., |axiom| key(axiom, rank).is_none()).collect();
    let mut order: Vec<(Key, u32)> =
        axioms.iter().zip(0..).filter_map(|(axiom, index)| Some((key(axiom, rank)?, index))).collect();
    // The key leaves out the value of a data property assertion.
    order.sort_unstable_by(|(left, a), (right, b)| match left.cmp(right) {
        Ordering::Equal if left.0 == DATA => axioms[*a as usize].cmp(&axioms[*b as usize]),
        order => order,
    });
    arrange(axioms, order.into_iter().map(|(_, index)| index).collect());
    axioms.dedup();
    // The axioms without a key are usually few, and most of them sort before assertions. The stable sort merges the
    // two sorted runs.
    let count = unkeyed.len();
    axioms.extend(unkeyed);
    axioms.rotate_right(count);
    axioms[..count].sort();
    axioms.sort();
    axioms.dedup();
}

/// Applies a permutation in place: position `i` receives the item at `order[i]`.
fn arrange<T>(items: &mut [T], mut order: Vec<u32>) {
    for start in 0..order.len() {
        let mut target = start;
        loop {
            let source = order[target] as usize;
            order[target] = target as u32;
            if source == start {
                break;
            }
            items.swap(target, source);
            target = source;
        }
    }
}

/// Returns the sort key of an assertion about a named class or property without annotations; `None` for other axioms.
/// The kinds are in the order of the variants of [`Axiom`].
fn key(annotated: &AnnotatedAxiom, rank: impl Fn(&Iri) -> Option<u32>) -> Option<Key> {
    if !annotated.annotations.is_empty() {
        return None;
    }
    Some(match &annotated.axiom {
        Axiom::ClassAssertion(ClassExpression::Class(class), individual) => {
            (0, rank(class)?, rank(individual)?, 0)
        }
        Axiom::ObjectPropertyAssertion(ObjectPropertyExpression::Property(property), from, to) => {
            (1, rank(property)?, rank(from)?, rank(to)?)
        }
        Axiom::DataPropertyAssertion(property, subject, _) => (DATA, rank(property)?, rank(subject)?, 0),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrange_applies_the_permutation() {
        let mut items = ['a', 'b', 'c', 'd', 'e'];
        arrange(&mut items, vec![2, 0, 1, 4, 3]);
        assert_eq!(items, ['c', 'a', 'b', 'e', 'd']);
    }
}
