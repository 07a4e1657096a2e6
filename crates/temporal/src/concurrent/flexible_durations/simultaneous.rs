//! Over-all conditions that hold only because several happenings are simultaneous.
//!
//! At each time, the search orders simultaneous happenings such that no over-all condition is violated in between:
//! the end of an action comes before the happenings that delete a fact of its over-all condition, and
//! its start after the happenings that add one. If these orders are cyclic, no sequence satisfies
//! them, and the happenings are correct only together. Example: two actions end at one time, and each
//! end deletes the over-all condition of the other action.

use task::number::dense;
use task::task::{Fact, OperatorId};

use crate::concurrent::happening::Role;
use crate::concurrent::temporal_task::TemporalTask;

/// Upper limit on the number of orders between happenings that are examined. The table then takes 8 MB.
const MAX_ORDERS: usize = 1_000_000;

/// Returns `true` if simultaneous happenings may violate an over-all condition one after another but not together.
/// Over-all conditions with disjunctions, comparisons or derived facts are not considered.
pub(crate) fn may_repair_over_all(concurrent: &TemporalTask) -> bool {
    orders(concurrent).is_none_or(|orders| is_cyclic(concurrent.task.operators.len(), &orders))
}

/// Pairs of happenings of which the first must precede the second in a sequence if both are
/// simultaneous. Returns `None` if there are too many, or if runs of one action must end together.
fn orders(concurrent: &TemporalTask) -> Option<Vec<(u32, u32)>> {
    let setters = setters(concurrent);
    let mut orders = Vec::new();
    for instance in &concurrent.instances {
        let Some(over_all) = instance.over_all else { continue };
        let facts = &concurrent.task.operators[over_all.index()].condition.facts;
        for fact in facts.iter().filter(|fact| fact.variable.index() < concurrent.task.basic) {
            for (id, value) in &setters[fact.variable.index()] {
                if *value == fact.value {
                    orders.extend((*id != instance.start).then_some((id.0, instance.start.0)));
                } else if *id != instance.end {
                    orders.push((instance.end.0, id.0));
                } else if instance.most > 1 {
                    return None;
                }
            }
            if orders.len() > MAX_ORDERS {
                return None;
            }
        }
    }
    Some(orders)
}

/// By variable: the happenings that set the variable, with the value.
fn setters(concurrent: &TemporalTask) -> Vec<Vec<(OperatorId, u32)>> {
    let task = &concurrent.task;
    let mut setters: Vec<Vec<(OperatorId, u32)>> = vec![Vec::new(); task.variables.len()];
    let happenings = task.operators.iter().zip(&concurrent.happenings).zip((0..).map(OperatorId));
    for ((operator, _), id) in happenings.filter(|((_, happening), _)| happening.role != Role::Never) {
        let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
        for Fact { variable, value } in operator.effects.iter().chain(conditional) {
            setters[variable.index()].push((id, *value));
        }
    }
    setters
}

/// Returns `true` if a directed graph with the given edges has a cycle: removing nodes without
/// predecessors, one after another, does not remove every node.
fn is_cyclic(nodes: usize, edges: &[(u32, u32)]) -> bool {
    let mut successors: Vec<Vec<u32>> = vec![Vec::new(); nodes];
    let mut predecessors = vec![0_u32; nodes];
    for (from, to) in edges {
        successors[*from as usize].push(*to);
        predecessors[*to as usize] = predecessors[*to as usize].saturating_add(1);
    }
    let mut open: Vec<u32> = (0..dense(nodes)).filter(|node| predecessors[*node as usize] == 0).collect();
    let mut removed: usize = 0;
    while let Some(node) = open.pop() {
        removed = removed.saturating_add(1);
        for next in &successors[node as usize] {
            let count = &mut predecessors[*next as usize];
            *count = count.saturating_sub(1);
            if *count == 0 {
                open.push(*next);
            }
        }
    }
    removed < nodes
}
