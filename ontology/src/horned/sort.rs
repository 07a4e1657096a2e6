//! Axioms in their order, each once. Most are assertions of three names: these are compared by where the names stand among all
//! names, which are sorted once, instead of by their texts.

use std::cmp::Ordering;

use crate::names::Names;
use crate::owl::{AnnotatedAxiom, Axiom, ClassExpression, Iri, ObjectPropertyExpression};

/// The kind of assertions of values.
const DATA: u8 = 2;

/// Kind, then the places of up to three names.
type Key = (u8, u32, u32, u32);

/// Sorts axioms and takes repetitions out, in place: there may be millions.
pub(super) fn axioms(axioms: &mut Vec<AnnotatedAxiom>, names: &Names) {
    let ranks = names.ranks();
    let rank = |iri: &Iri| ranks.get(&iri.as_ptr()).copied();
    let others: Vec<AnnotatedAxiom> = axioms.extract_if(.., |axiom| key(axiom, rank).is_none()).collect();
    let mut order: Vec<(Key, u32)> =
        axioms.iter().zip(0..).filter_map(|(axiom, at)| Some((key(axiom, rank)?, at))).collect();
    // Names decide, but for the values of data properties.
    order.sort_unstable_by(|(left, a), (right, b)| match left.cmp(right) {
        Ordering::Equal if left.0 == DATA => axioms[*a as usize].cmp(&axioms[*b as usize]),
        order => order,
    });
    arrange(axioms, order.into_iter().map(|(_, at)| at).collect());
    axioms.dedup();
    // The others are few, and most of them come first; two sorted runs are merged.
    let count = others.len();
    axioms.extend(others);
    axioms.rotate_right(count);
    axioms[..count].sort();
    axioms.sort();
    axioms.dedup();
}

/// Puts at each place what is now at the place that `order` has there.
fn arrange<T>(items: &mut [T], mut order: Vec<u32>) {
    for start in 0..order.len() {
        let mut place = start;
        loop {
            let from = order[place] as usize;
            order[place] = place as u32;
            if from == start {
                break;
            }
            items.swap(place, from);
            place = from;
        }
    }
}

/// The key of an assertion of names without annotations, in the order of the variants of [`Axiom`].
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
    fn things_are_arranged() {
        let mut items = ['a', 'b', 'c', 'd', 'e'];
        arrange(&mut items, vec![2, 0, 1, 4, 3]);
        assert_eq!(items, ['c', 'a', 'b', 'e', 'd']);
    }
}
