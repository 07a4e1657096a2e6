//! Ground rules of derived atoms.

use petgraph::algo::kosaraju_scc;
use petgraph::graph::DiGraph;
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
/// after the components on which it depends.
pub fn components(axioms: &[GroundAxiom]) -> Vec<Vec<AtomId>> {
    let mut graph: DiGraph<AtomId, ()> = DiGraph::new();
    let mut nodes: FxHashMap<AtomId, _> = FxHashMap::default();
    for axiom in axioms {
        nodes.entry(axiom.head).or_insert_with(|| graph.add_node(axiom.head));
    }
    for axiom in axioms {
        for atom in axiom.body.atoms() {
            if let Some(node) = nodes.get(&atom) {
                graph.add_edge(nodes[&axiom.head], *node, ());
            }
        }
    }
    // Components without successors come first. Petgraph's version of Tarjan's algorithm is recursive and
    // would overflow the stack on long chains of axioms.
    let sorted = |component: Vec<_>| {
        let mut atoms: Vec<AtomId> = component.into_iter().map(|node| graph[node]).collect();
        atoms.sort_unstable();
        atoms
    };
    kosaraju_scc(&graph).into_iter().map(sorted).collect()
}

#[cfg(test)]
mod tests {
    use super::{GroundAxiom, components};
    use crate::ground::vocabulary::atom::AtomId;
    use crate::ground::vocabulary::condition::GroundCondition;

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
