//! Rewrites axioms with lists. `AllDisjointClasses` and `AllDisjointProperties` become pairs. Large sets of
//! disjoint classes or different individuals become axioms without horned-owl. A list that several axioms
//! share is copied, and malformed property chains are removed.

use std::collections::HashSet;

use oxrdf::{BlankNode, NamedNode, NamedOrBlankNode, Term, Triple};

use crate::error::Warning;
use crate::graph::{Graph, iri_of, subject_of};
use crate::owl::{AnnotatedAxiom, Axiom, ClassExpression, Iri};
use crate::vocab::{owl, rdf};

/// Rewrites the axioms with lists in the graph. Returns the axioms with many members, which horned-owl does not have
/// to read.
pub(crate) fn rewrite(graph: &mut Graph, warnings: &mut Vec<Warning>) -> Vec<AnnotatedAxiom> {
    // The other steps remove lists, also those of other axioms if lists are shared.
    unshare(graph);
    let groups = groups(graph);
    pairs(graph, owl::ALL_DISJOINT_CLASSES, owl::DISJOINT_WITH, warnings);
    pairs(graph, owl::ALL_DISJOINT_PROPERTIES, owl::PROPERTY_DISJOINT_WITH, warnings);
    check_chains(graph, warnings);
    groups
}

/// Number of named members above which [`groups`] removes a set from the graph.
pub(crate) const MAX_PAIRED_MEMBERS: usize = 16;

/// Removes and returns axioms about more than [`MAX_PAIRED_MEMBERS`] disjoint named classes or different
/// named individuals. Pairs would be too many, and the time of horned-owl grows with the square of the length
/// of a list.
fn groups(graph: &mut Graph) -> Vec<AnnotatedAxiom> {
    let mut axioms = Vec::new();
    for (kind, class) in
        [(owl::ALL_DISJOINT_CLASSES, owl::CLASS), (owl::ALL_DIFFERENT, owl::NAMED_INDIVIDUAL)]
    {
        for (_, node) in graph.instances(kind) {
            let members = [owl::MEMBERS, owl::DISTINCT_MEMBERS];
            let Some(list) = members
                .iter()
                .find_map(|members| graph.object(&node, members).and_then(|head| graph.list(head)).ok())
            else {
                continue;
            };
            let named: Option<Vec<Iri>> = list.items.iter().map(|item| iri_of(item).map(Iri::from)).collect();
            let Some(named) = named.filter(|named| named.len() > MAX_PAIRED_MEMBERS) else { continue };
            for item in list.items.iter().filter_map(subject_of) {
                graph.state(&item, rdf::TYPE, NamedNode::new_unchecked(class));
            }
            let axiom = match class {
                owl::CLASS => Axiom::DisjointClasses(named.into_iter().map(ClassExpression::Class).collect()),
                _ => Axiom::DifferentIndividuals(named),
            };
            axioms.push(AnnotatedAxiom { axiom, annotations: Vec::new() });
            let indices = graph.of(&node).map(|(index, _)| index).chain(list.spine.iter().copied()).collect();
            take(graph, indices);
        }
    }
    axioms
}

/// Maximum number of members of an axiom that [`pairs`] expands. Without a limit, a small document would fill the
/// memory.
const MAX_EXPANDED_MEMBERS: usize = 1_000;

/// Replaces each n-ary axiom of the type `class` by one triple with `predicate` for each pair of members.
/// Removes an axiom that is malformed or has too many members, with a warning.
fn pairs(graph: &mut Graph, class: &str, predicate: &str, warnings: &mut Vec<Warning>) {
    for (_, node) in graph.instances(class) {
        let members = graph.object(&node, owl::MEMBERS).and_then(|head| graph.list(head));
        let axiom_triples: Vec<usize> = graph.of(&node).map(|(index, _)| index).collect();
        match members {
            Ok(list) if list.items.len() > MAX_EXPANDED_MEMBERS => {
                take(graph, list.spine);
                let reason = format!("it has more than {MAX_EXPANDED_MEMBERS} members");
                warnings.push(Warning::Unread { statement: format!("{node} a <{class}>"), reason });
            }
            Ok(list) => {
                let members: Vec<_> = list.items.iter().filter_map(subject_of).collect();
                for (index, first) in members.iter().enumerate() {
                    for second in &members[index + 1..] {
                        graph.state(first, predicate, Term::from(second.clone()));
                    }
                }
                take(graph, list.spine);
            }
            Err(reason) => {
                warnings.push(Warning::Unread { statement: format!("{node} a <{class}>"), reason });
            }
        }
        take(graph, axiom_triples);
    }
}

fn take(graph: &mut Graph, indices: Vec<usize>) {
    for index in indices {
        graph.take(index);
    }
}

/// Removes property chains that are malformed lists, have fewer than two members or have members other than
/// properties, with a warning: horned-owl panics on them.
fn check_chains(graph: &mut Graph, warnings: &mut Vec<Warning>) {
    let chains: Vec<_> = graph
        .iter()
        .filter(|(_, triple)| triple.predicate.as_str() == owl::PROPERTY_CHAIN_AXIOM)
        .map(|(index, triple)| (index, triple.object.clone(), triple.subject.to_string()))
        .collect();
    for (index, head, property) in chains {
        let (fault, spine) = match graph.list(&head) {
            Ok(list) if list.items.len() < 2 => {
                (Some("a property chain has two members or more".to_owned()), list.spine)
            }
            Ok(list) => (list.items.iter().find_map(|item| chain_fault(graph, item)), list.spine),
            Err(reason) => (Some(reason), Vec::new()),
        };
        if let Some(reason) = fault {
            take(graph, spine);
            warnings.push(Warning::Unread { statement: format!("property chain of {property}"), reason });
            graph.take(index);
        }
    }
}

fn chain_fault(graph: &Graph, item: &Term) -> Option<String> {
    match item {
        Term::NamedNode(_) => None,
        Term::BlankNode(node) => graph.object(&node.clone().into(), owl::INVERSE_OF).err(),
        Term::Literal(_) => Some(format!("{item} is not a property")),
    }
}

/// Replaces a list by a copy in every triple that refers to it, except the first, because horned-owl consumes lists. A list
/// that has a node in common with an earlier list is also copied. Removes the types `rdf:List` of list nodes.
fn unshare(graph: &mut Graph) {
    let references = graph.references();
    let is_shared = |node: &BlankNode| references.get(node).is_some_and(|&count| count > 1);
    let shares_tails = graph.iter().any(|(_, triple)| {
        triple.predicate.as_str() == rdf::REST
            && matches!(&triple.object, Term::BlankNode(node) if is_shared(node))
    });
    let refers_to_list = |triple: &Triple| match &triple.object {
        Term::BlankNode(node) if triple.predicate.as_str() != rdf::REST => {
            (shares_tails || is_shared(node))
                && graph.objects(&NamedOrBlankNode::from(node.clone()), rdf::FIRST).next().is_some()
        }
        _ => false,
    };
    let heads = graph.iter().filter(|(_, triple)| refers_to_list(triple));
    let heads: Vec<(usize, Term)> = heads.map(|(index, triple)| (index, triple.object.clone())).collect();
    let mut visited: HashSet<BlankNode> = HashSet::new();
    for (index, head) in heads {
        let Ok(list) = graph.list(&head) else { continue };
        let shared_node = |&index: &usize| match &graph.get(index)?.subject {
            NamedOrBlankNode::BlankNode(node) if is_shared(node) => Some(node.clone()),
            _ => None,
        };
        let shared: Vec<BlankNode> = list.spine.iter().filter_map(shared_node).collect();
        if !shared.iter().any(|node| visited.contains(node)) {
            visited.extend(shared);
            continue;
        }
        // No other list has the nodes before the first shared one.
        let replaced = list.spine.iter().copied().take_while(|index| shared_node(index).is_none()).collect();
        let copy = graph.add_list(list.items, None);
        if let Some(triple) = graph.get_mut(index) {
            triple.object = copy;
        }
        take(graph, replaced);
    }
    for (index, _) in graph.instances(rdf::LIST) {
        graph.take(index);
    }
}
