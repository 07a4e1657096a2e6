//! How deep class expressions are nested: what reads and lowers them is recursive, and horned-owl takes time that grows with
//! the cube of the depth.

use oxrdf::{NamedOrBlankNode, Term};
use rustc_hash::FxHashMap;

use crate::graph::{Graph, subject_of};
use crate::vocab::{owl, rdf};

/// Deeper expressions are refused. Real ones are nested less than 20 deep.
pub(crate) const DEEPEST: usize = 128;

const NESTS: [&str; 10] = [
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

/// The index of a triple at which an expression begins that is nested deeper than [`DEEPEST`], and the IRI of which it is said.
pub(crate) fn too_deep(graph: &Graph) -> Option<(usize, Option<String>)> {
    let mut depths: FxHashMap<NamedOrBlankNode, usize> = FxHashMap::default();
    for (index, triple) in graph.iter() {
        let Some(root) = nested(&triple.object) else { continue };
        if !NESTS[..8].contains(&triple.predicate.as_str()) {
            continue;
        }
        if depth(graph, &root, &mut depths) >= DEEPEST {
            return Some((index, said_of(graph, &mut depths)));
        }
    }
    None
}

/// The first IRI of which an expression is said that is nested too deep.
fn said_of(graph: &Graph, depths: &mut FxHashMap<NamedOrBlankNode, usize>) -> Option<String> {
    graph.iter().find_map(|(_, triple)| match (&triple.subject, nested(&triple.object)) {
        (NamedOrBlankNode::NamedNode(iri), Some(root)) if depth(graph, &root, depths) >= DEEPEST => {
            Some(iri.as_str().to_owned())
        }
        _ => None,
    })
}

fn nested(object: &Term) -> Option<NamedOrBlankNode> {
    matches!(object, Term::BlankNode(_)).then(|| subject_of(object)).flatten()
}

/// The depth of the expression at a node; lists add nothing. A circle counts once round.
fn depth(graph: &Graph, root: &NamedOrBlankNode, depths: &mut FxHashMap<NamedOrBlankNode, usize>) -> usize {
    let mut open = vec![(root.clone(), false)];
    while let Some((node, is_done)) = open.pop() {
        let parts = || {
            let said = graph.of(&node).filter(|(_, triple)| NESTS.contains(&triple.predicate.as_str()));
            said.filter_map(|(_, triple)| Some((triple.predicate.as_str(), nested(&triple.object)?)))
        };
        if is_done {
            let part = |(predicate, part): (&str, NamedOrBlankNode)| {
                let own = usize::from(!predicate.starts_with(rdf::NS));
                depths.get(&part).copied().unwrap_or(0) + own
            };
            let depth = parts().map(part).max().unwrap_or(0);
            depths.insert(node, depth);
        } else if !depths.contains_key(&node) {
            depths.insert(node.clone(), 0);
            open.push((node.clone(), true));
            open.extend(parts().map(|(_, part)| (part, false)));
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
    fn depth_is_counted_in_any_order() {
        for order in [true, false] {
            assert_eq!(too_deep(&nested(DEEPEST, order)), None);
            assert!(too_deep(&nested(DEEPEST + 1, order)).is_some());
            assert!(too_deep(&nested(20_000, order)).is_some());
        }
    }
}
