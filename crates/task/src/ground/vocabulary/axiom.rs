//! Ground rules of derived atoms.

use petgraph::algo::kosaraju_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use petgraph::visit::DfsPostOrder;
use rustc_hash::FxHashMap;

use crate::ground::vocabulary::atom::AtomId;
use crate::ground::vocabulary::condition::GroundCondition;

/// A ground rule: the head is true if the body is true. The body has no clauses (disjunctions).
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct GroundAxiom {
    pub(crate) head: AtomId,
    pub(crate) body: GroundCondition,
}

/// Returns the strongly connected components of the dependency graph of derived atoms. Each component comes
/// after the components on which it depends: the order is that of Tarjan's algorithm, whose version in
/// petgraph is recursive and would overflow the stack on long chains of axioms.
pub fn components(axioms: &[GroundAxiom]) -> Vec<Vec<AtomId>> {
    let mut graph: DiGraph<AtomId, ()> = DiGraph::new();
    let mut nodes: FxHashMap<AtomId, _> = FxHashMap::default();
    for axiom in axioms {
        nodes.entry(axiom.head).or_insert_with(|| graph.add_node(axiom.head));
    }
    for axiom in axioms.iter().rev() {
        for atom in axiom.body.atoms().collect::<Vec<_>>().into_iter().rev() {
            if let Some(node) = nodes.get(&atom) {
                graph.add_edge(nodes[&axiom.head], *node, ());
            }
        }
    }
    // The first visited atom of a component finishes last, and finishes after all atoms on which it depends.
    let mut finished = vec![0; graph.node_count()];
    let mut search = DfsPostOrder::empty(&graph);
    let mut count = 0_usize;
    for start in graph.node_indices() {
        search.move_to(start);
        while let Some(node) = search.next(&graph) {
            count = count.saturating_add(1);
            finished[node.index()] = count;
        }
    }
    let mut components = kosaraju_scc(&graph);
    components.sort_by_cached_key(|component| component.iter().map(|node| finished[node.index()]).max());
    let sorted = |component: Vec<NodeIndex>| {
        let mut atoms: Vec<AtomId> = component.into_iter().map(|node| graph[node]).collect();
        atoms.sort_unstable();
        atoms
    };
    components.into_iter().map(sorted).collect()
}

#[cfg(test)]
mod tests {
    use petgraph::algo::tarjan_scc;
    use petgraph::graph::DiGraph;
    use proptest::prelude::*;
    use rustc_hash::FxHashMap;

    use super::{GroundAxiom, components};
    use crate::ground::vocabulary::atom::AtomId;
    use crate::ground::vocabulary::condition::GroundCondition;

    proptest! {
        #[test]
        fn components_have_the_order_of_tarjans_algorithm(
            rules in proptest::collection::vec((0..30_u32, 0..30_u32, 0..30_u32), 1..50)
        ) {
            let axiom = |(head, first, second): &(u32, u32, u32)| GroundAxiom {
                head: AtomId(*head),
                body: GroundCondition {
                    literals: vec![(AtomId(*first), true), (AtomId(*second), false)],
                    ..GroundCondition::default()
                },
            };
            let axioms: Vec<GroundAxiom> = rules.iter().map(axiom).collect();
            let mut graph = DiGraph::new();
            let mut nodes = FxHashMap::default();
            for axiom in &axioms {
                nodes.entry(axiom.head).or_insert_with(|| graph.add_node(axiom.head));
            }
            for axiom in &axioms {
                for atom in axiom.body.atoms() {
                    if let Some(node) = nodes.get(&atom) {
                        graph.add_edge(nodes[&axiom.head], *node, ());
                    }
                }
            }
            let mut expected: Vec<Vec<AtomId>> = Vec::new();
            for component in tarjan_scc(&graph) {
                expected.push(component.into_iter().map(|node| graph[node]).collect());
                expected.last_mut().expect("a component").sort_unstable();
            }
            prop_assert_eq!(components(&axioms), expected);
        }
    }

    #[test]
    fn long_chains_do_not_overflow_the_stack() {
        let axiom = |number: u32| GroundAxiom {
            head: AtomId(number + 1),
            body: GroundCondition { literals: vec![(AtomId(number), true)], ..GroundCondition::default() },
        };
        let axioms: Vec<GroundAxiom> = (0..100_000).map(axiom).collect();
        let thread = std::thread::Builder::new().stack_size(256 * 1024);
        let components =
            thread.spawn(move || components(&axioms)).expect("a thread").join().expect("no panic");
        let expected: Vec<Vec<AtomId>> = (1..=100_000).map(|number| vec![AtomId(number)]).collect();
        assert_eq!(components, expected);
    }
}
