//! Stratification: orders relations such that each is complete before a rule negates it. The strata are the strongly
//! connected components of the dependency graph of the relations, dependencies first.
//!
//! Every component is a stratum, even without negation. Thus rows that are over-deleted in a component are rederived
//! before later components see them.

use petgraph::algo::kosaraju_scc;
use petgraph::graph::{DiGraph, NodeIndex};

/// Returns the strongly connected component of each node. Components are numbered such that every edge
/// leads to the same or a larger number.
pub(crate) fn components(successors: &[Vec<usize>]) -> Vec<usize> {
    let mut graph: DiGraph<(), ()> = DiGraph::with_capacity(successors.len(), 0);
    for _ in successors {
        graph.add_node(());
    }
    for (node, successors) in successors.iter().enumerate() {
        for successor in successors {
            graph.add_edge(NodeIndex::new(node), NodeIndex::new(*successor), ());
        }
    }
    // Components without successors come first. Petgraph's version of Tarjan's algorithm is recursive and
    // would overflow the stack on long chains of rules.
    let sinks_first = kosaraju_scc(&graph);
    let mut numbers = vec![0; successors.len()];
    for (number, component) in sinks_first.iter().rev().enumerate() {
        for node in component {
            numbers[node.index()] = number;
        }
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::components;

    #[test]
    fn edges_lead_to_the_same_or_a_later_component() {
        assert_eq!(components(&[vec![1], vec![0, 2], vec![], vec![2]])[2], 2);
        let components = components(&[vec![1], vec![2], vec![1, 3], vec![]]);
        assert_eq!(components, [0, 1, 1, 2]);
    }

    #[test]
    fn long_chains_do_not_overflow_the_stack() {
        let successors: Vec<Vec<usize>> = (1..=100_000).map(|next| vec![next]).chain([vec![]]).collect();
        let thread = std::thread::Builder::new().stack_size(256 * 1024);
        let numbers =
            thread.spawn(move || components(&successors)).expect("a thread").join().expect("no panic");
        assert!(numbers.iter().copied().eq(0..=100_000));
    }
}
