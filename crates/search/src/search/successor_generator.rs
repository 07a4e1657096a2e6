//! Successor generator: a decision tree over required values that returns the applicable operators \[1\].
//! Numeric conditions are not tested.
//!
//! A node stores the operators that have no further preconditions. It tests one variable and has a child for
//! each required value, and one child for operators that do not require the variable.
//!
//! \[1\] M. Helmert: The Fast Downward planning system, JAIR 26, 2006, section 5.3.

use task::number::dense;
use task::task::{OperatorId, State, Task};

const NONE: u32 = u32::MAX;

#[derive(Default)]
struct Node {
    /// Operators without further preconditions, as a range of `operators`.
    complete: (u32, u32),
    variable: u32,
    /// Children by ascending value, as a range of `children`.
    children: (u32, u32),
    /// Child node for operators that do not require the tested variable, or `NONE`.
    others: u32,
}

/// Index that finds the operators of a task whose propositional conditions hold in a state.
pub struct SuccessorGenerator {
    nodes: Vec<Node>,
    operators: Vec<OperatorId>,
    children: Vec<(u32, u32)>,
}

/// Required values as pairs (variable, value) in ascending order, and the operator.
type Precondition = (Vec<(u32, u32)>, OperatorId);

struct PendingSubtree {
    from: usize,
    to: usize,
    depth: usize,
    place: Place,
}

#[derive(Clone, Copy)]
enum Place {
    Root,
    Others(usize),
    Child(usize),
}

impl SuccessorGenerator {
    pub fn new<N>(task: &Task<N>) -> Self {
        Self::over(task, OperatorId::all(task.operators.len()))
    }

    /// Builds a generator for a subset of the operators, in any order.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub fn over<N>(task: &Task<N>, operators: impl Iterator<Item = OperatorId>) -> Self {
        let required = |id: OperatorId| {
            let facts = &task.operators[id.index()].condition.facts;
            let mut facts: Vec<_> = facts.iter().map(|fact| (fact.variable.0, fact.value)).collect();
            facts.sort_unstable();
            facts.dedup();
            (facts, id)
        };
        let mut preconditions: Vec<Precondition> = operators.map(required).collect();
        preconditions.sort_unstable();
        let mut index = Self { nodes: Vec::new(), operators: Vec::new(), children: Vec::new() };
        let mut open =
            vec![PendingSubtree { from: 0, to: preconditions.len(), depth: 0, place: Place::Root }];
        while let Some(PendingSubtree { mut from, to, depth, place }) = open.pop() {
            let id = index.nodes.len();
            match place {
                Place::Root => {}
                Place::Others(node) => index.nodes[node].others = dense(id),
                Place::Child(child) => index.children[child].1 = dense(id),
            }
            let begin = dense(index.operators.len());
            while from < to && preconditions[from].0.len() == depth {
                index.operators.push(preconditions[from].1);
                from += 1;
            }
            let mut node =
                Node { complete: (begin, dense(index.operators.len())), others: NONE, ..Node::default() };
            if from < to {
                let variable = preconditions[from].0[depth].0;
                node.variable = variable;
                let first = dense(index.children.len());
                while from < to && preconditions[from].0[depth].0 == variable {
                    let value = preconditions[from].0[depth].1;
                    let end = from
                        + preconditions[from..to]
                            .partition_point(|precondition| precondition.0[depth] <= (variable, value));
                    let child = index.children.len();
                    index.children.push((value, NONE));
                    open.push(PendingSubtree { from, to: end, depth: depth + 1, place: Place::Child(child) });
                    from = end;
                }
                node.children = (first, dense(index.children.len()));
            }
            index.nodes.push(node);
            if from < to {
                open.push(PendingSubtree { from, to, depth, place: Place::Others(id) });
            }
        }
        index
    }

    /// Returns the operators whose propositional conditions hold in a state, in ascending order. Numeric
    /// conditions are not tested.
    pub fn applicable<N>(&self, task: &Task<N>, state: &State<N>) -> Vec<OperatorId> {
        let mut operators = Vec::new();
        let mut stack = vec![0_u32];
        while let Some(mut at) = stack.pop() {
            while at != NONE {
                let Node { complete, variable, children, others } = &self.nodes[at as usize];
                operators.extend_from_slice(&self.operators[complete.0 as usize..complete.1 as usize]);
                let children = &self.children[children.0 as usize..children.1 as usize];
                if !children.is_empty() {
                    let value = state.values[*variable as usize];
                    if let Ok(child) = children.binary_search_by_key(&value, |(value, _)| *value) {
                        stack.push(children[child].1);
                    }
                }
                at = *others;
            }
        }
        // The tree tests required facts only; clauses are tested here.
        operators.retain(|id| {
            let clauses = &task.operators[id.index()].condition.clauses;
            clauses.iter().all(|clause| clause.iter().any(|literal| literal.holds(&state.values)))
        });
        operators.sort_unstable();
        operators
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testing::{depot, fleet, ground_text};

    #[test]
    fn the_generator_returns_the_operators_whose_propositional_condition_holds() {
        for text in (0..30).flat_map(|seed| [fleet(seed), depot(seed)]) {
            let task = ground_text(text);
            let index = SuccessorGenerator::new(&task);
            let mut state = task.initial.clone();
            for step in 0..40 {
                let expected: Vec<OperatorId> = OperatorId::all(task.operators.len())
                    .filter(|id| task.operators[id.index()].condition.holds_propositionally(&state.values))
                    .collect();
                assert_eq!(index.applicable(&task, &state), expected);
                let Some(id) = expected.get((step * 7) % expected.len().max(1)) else { break };
                let operator = &task.operators[id.index()];
                let Some(choice) = operator.admitted_combinations().next() else { break };
                let Some(next) = task.successor(operator, &state, &choice) else { break };
                state = next;
            }
        }
    }
}
