//! Rejects deeply nested class expressions: reading and lowering are recursive, and the time of horned-owl
//! grows with the cube of the depth.

use oxrdf::{NamedOrBlankNode, Term};
use rustc_hash::FxHashMap;

use crate::graph::{Graph, subject_of};
use crate::vocab::{owl, rdf};

/// Maximum nesting depth. Expressions of real ontologies stay far below it.
pub(crate) const MAX_NESTING: usize = 128;

/// Properties that lead from a class expression to its parts. The last two are links of lists and do not
/// count as a level.
const NESTING_PROPERTIES: [&str; 10] = [
    owl::SOME_VALUES_FROM,
    owl::ALL_VALUES_FROM,
    owl::ON_CLASS,
    owl::ON_DATA_RANGE,
    owl::COMPLEMENT_OF,
    owl::DATATYPE_COMPLEMENT_OF,
    owl::INTERSECTION_OF,
    owl::UNION_OF,
    rdf::FIRST,
    rdf::REST,
];

/// Returns the index of the first triple by which an expression is nested deeper than [`MAX_NESTING`], and
/// the IRI of an entity that such an expression describes, if there is one.
pub(crate) fn too_deep(graph: &Graph) -> Option<(usize, Option<String>)> {
    let mut depths: FxHashMap<NamedOrBlankNode, usize> = FxHashMap::default();
    for (index, triple) in graph.iter() {
        let Some(root) = nested(&triple.object) else { continue };
        if !NESTING_PROPERTIES[..8].contains(&triple.predicate.as_str()) {
            continue;
        }
        if depth(graph, &root, &mut depths) >= MAX_NESTING {
            return Some((index, described_iri(graph, &mut depths)));
        }
    }
    None
}

fn described_iri(graph: &Graph, depths: &mut FxHashMap<NamedOrBlankNode, usize>) -> Option<String> {
    graph.iter().find_map(|(_, triple)| match (&triple.subject, nested(&triple.object)) {
        (NamedOrBlankNode::NamedNode(iri), Some(root)) if depth(graph, &root, depths) >= MAX_NESTING => {
            Some(iri.as_str().to_owned())
        }
        _ => None,
    })
}

fn nested(object: &Term) -> Option<NamedOrBlankNode> {
    matches!(object, Term::BlankNode(_)).then(|| subject_of(object)).flatten()
}

/// Returns the nesting depth of the expression at a node. Lists do not count. A cycle is followed once.
fn depth(graph: &Graph, root: &NamedOrBlankNode, depths: &mut FxHashMap<NamedOrBlankNode, usize>) -> usize {
    // Iterative depth-first search; recursion could overflow the stack.
    let mut stack = vec![(root.clone(), false)];
    while let Some((node, is_done)) = stack.pop() {
        let parts = || {
            let triples =
                graph.of(&node).filter(|(_, triple)| NESTING_PROPERTIES.contains(&triple.predicate.as_str()));
            triples.filter_map(|(_, triple)| Some((triple.predicate.as_str(), nested(&triple.object)?)))
        };
        if is_done {
            let part = |(predicate, part): (&str, NamedOrBlankNode)| {
                let level = usize::from(!predicate.starts_with(rdf::NS));
                depths.get(&part).copied().unwrap_or(0) + level
            };
            let depth = parts().map(part).max().unwrap_or(0);
            depths.insert(node, depth);
        } else if !depths.contains_key(&node) {
            depths.insert(node.clone(), 0);
            stack.push((node.clone(), true));
            stack.extend(parts().map(|(_, part)| (part, false)));
        }
    }
    depths.get(root).copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use oxrdf::{BlankNode, NamedNode, Triple};

    fn nested(depth: usize, outermost_first: bool) -> Graph {
        let mut levels: Vec<usize> = (0..depth).collect();
        if !outermost_first {
            levels.reverse();
        }
        let (mut graph, node) =
            (Graph::default(), |level: usize| BlankNode::new_unchecked(format!("b{level}")));
        for level in levels {
            let predicate = NamedNode::new_unchecked(owl::COMPLEMENT_OF);
            graph.add(Triple::new(node(level), predicate, node(level + 1)));
        }
        graph
    }

    #[test]
    fn depth_does_not_depend_on_the_order_of_triples() {
        for order in [true, false] {
            assert_eq!(too_deep(&nested(MAX_NESTING, order)), None);
            assert!(too_deep(&nested(MAX_NESTING + 1, order)).is_some());
            assert!(too_deep(&nested(20_000, order)).is_some());
        }
    }
}
