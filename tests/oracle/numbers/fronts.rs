//! Pareto front of several objectives: label-correcting search over the explored states.

use num_traits::Signed as _;

use super::explore::Space;
use super::model::Number;

const MAX_LABELS: usize = 4_000;

/// Returns the values of all Pareto-optimal plans, sorted. The objectives are the measures after the first
/// one, all minimised. Returns `None` if the space is incomplete, if a step has a negative cost, or if there
/// are too many labels.
pub fn front(space: &Space) -> Option<Vec<Vec<Number>>> {
    // The first measure, the metric, is not part of the front.
    let has_negative = |costs: &[Number]| costs[1..].iter().any(Number::is_negative);
    if !space.complete || space.edges.iter().flatten().any(|edge| has_negative(&edge.costs)) {
        return None;
    }
    let mut labels: Vec<Vec<Vec<Number>>> = vec![Vec::new(); space.edges.len()];
    labels[0].push(space.initial[1..].to_vec());
    let mut open = vec![(0, space.initial[1..].to_vec())];
    let mut created = 0;
    while let Some((state, label)) = open.pop() {
        // The label was dominated after it had been added to the open list.
        if !labels[state].contains(&label) {
            continue;
        }
        for edge in &space.edges[state] {
            let new: Vec<Number> = label.iter().zip(&edge.costs[1..]).map(|(a, b)| a + b).collect();
            if insert(&mut labels[edge.to], &new) {
                created += 1;
                open.push((edge.to, new));
            }
        }
        if created > MAX_LABELS {
            return None;
        }
    }
    let mut front = Vec::new();
    for (state, labels) in labels.iter().enumerate() {
        if space.goals[state] {
            for label in labels {
                insert(&mut front, label);
            }
        }
    }
    front.sort();
    Some(front)
}

/// Inserts a label unless a present label dominates or equals it. Removes the labels that the new label
/// dominates. Returns `true` if the label was inserted.
fn insert(labels: &mut Vec<Vec<Number>>, new: &[Number]) -> bool {
    let dominates = |left: &[Number], right: &[Number]| left.iter().zip(right).all(|(a, b)| a <= b);
    if labels.iter().any(|label| dominates(label, new)) {
        return false;
    }
    labels.retain(|label| !dominates(new, label));
    labels.push(new.to_vec());
    true
}
