//! What is best by several objectives: label-correcting search over the states that were visited.

use num_traits::Signed as _;

use super::explore::Space;
use super::model::Number;

/// Most labels before it is given up.
const LABELS: usize = 4_000;

/// All values of plans such that no other plan is as good by every objective and better by one; sorted. The objectives are the
/// measures after the first, all minimised. Nothing where states are missing, a step has a negative cost, or there are too many labels.
pub fn front(space: &Space) -> Option<Vec<Vec<Number>>> {
    let negative = |costs: &[Number]| costs[1..].iter().any(Number::is_negative);
    if !space.complete || space.edges.iter().flatten().any(|edge| negative(&edge.costs)) {
        return None;
    }
    let mut labels: Vec<Vec<Vec<Number>>> = vec![Vec::new(); space.edges.len()];
    labels[0].push(space.initial[1..].to_vec());
    let mut waiting = vec![(0, space.initial[1..].to_vec())];
    let mut made = 0;
    while let Some((at, label)) = waiting.pop() {
        if !labels[at].contains(&label) {
            continue;
        }
        for edge in &space.edges[at] {
            let new: Vec<Number> = label.iter().zip(&edge.costs[1..]).map(|(a, b)| a + b).collect();
            if insert(&mut labels[edge.to], &new) {
                made += 1;
                waiting.push((edge.to, new));
            }
        }
        if made > LABELS {
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

/// Adds a label that no other one covers, and removes those that it covers.
fn insert(labels: &mut Vec<Vec<Number>>, new: &[Number]) -> bool {
    let covers = |one: &[Number], other: &[Number]| one.iter().zip(other).all(|(a, b)| a <= b);
    if labels.iter().any(|known| covers(known, new)) {
        return false;
    }
    labels.retain(|known| !covers(new, known));
    labels.push(new.to_vec());
    true
}
