//! Normalises merged triples, so that horned-owl skips as few of them as possible.
//!
//! horned-owl's RDF reader matches exact patterns and skips triples that deviate: rules and axioms whose node
//! is an IRI instead of a blank node, atoms with an annotation, data atoms about an individual, empty bodies,
//! shared lists, `AllDisjointClasses`, undeclared properties, blank nodes as individuals. Real knowledge
//! bases contain most of these. The passes below rewrite such triples, one file each:
//!
//! | pass | rewrites |
//! |---|---|
//! | this file | imports, and headers of all documents but the first (removed) |
//! | `bulk` | nothing: detects statements that the other passes can skip |
//! | `swrl` | every rule to one canonical form |
//! | `forms` | OWL 1 class definitions, expressions without a type, axiom nodes that are IRIs (to blank nodes) |
//! | `lists` | small n-ary disjointness to pairs, large groups to axioms (without horned-owl), shared lists to copies |
//! | `lists` | malformed property chains (removed) |
//! | `anonymous` | blank-node individuals to IRIs |
//! | `annotative` | axioms that use an annotation property as another kind of property (removed) |
//! | `kinds` | undeclared entities to declared ones |
//! | `plain` | plain statements to axioms and annotations, without horned-owl |

mod annotative;
mod anonymous;
mod bulk;
pub(crate) mod depth;
mod forms;
mod kinds;
mod lists;
mod plain;
mod swrl;

use rustc_hash::FxHashSet;

use depth::MAX_NESTING;
pub(crate) use kinds::declare_header_annotations;
pub(crate) use lists::MAX_PAIRED_MEMBERS;
pub(crate) use swrl::{INDIVIDUAL, ORIGIN, Origin, TRUE, VARIABLE};

use crate::contents::Parts;
use crate::error::{Error, Warning};
use crate::graph::Graph;
use crate::names::{Compact, Names, Object};
use crate::owl::{EntityKind, Iri};
use crate::triples::Document;
use crate::vocab::{owl, rdf};

#[derive(Debug)]
pub(crate) struct Normal {
    pub ntriples: Vec<u8>,
    /// Axioms and annotations that horned-owl does not have to read.
    pub plain: Parts,
    pub names: Names,
    pub rules: Vec<Origin>,
    pub warnings: Vec<Warning>,
}

/// The triples of all documents, with the header of the first document only.
pub(crate) struct Merged {
    pub graph: Graph,
    /// Triples that are not in the graph, because no pass before `plain` has to process them.
    pub bulk: Vec<Compact>,
    /// For each document: the index of its first triple in the graph, and its ontology IRI, or its name if it
    /// declares none.
    pub parts: Vec<(usize, Iri)>,
    /// IRIs of the ontologies whose headers were dropped.
    pub dropped_headers: FxHashSet<Iri>,
}

/// Drops imports, and the headers of all documents but the first.
pub(crate) fn merge(documents: Vec<Document>, names: &Names, is_bulk: impl Fn(&Compact) -> bool) -> Merged {
    let (mut graph, mut bulk, mut parts) = (Graph::default(), Vec::new(), Vec::new());
    let mut dropped_headers = FxHashSet::default();
    let [rdf_type, ontology, imports, version] =
        [rdf::TYPE, owl::ONTOLOGY, owl::IMPORTS, owl::VERSION_IRI].map(|iri| names.find(iri));
    for (index, document) in documents.into_iter().enumerate() {
        let name = document.iri.clone().unwrap_or_else(|| document.name.as_str().into());
        let start = graph.len();
        for triple in document.triples {
            let predicate = Some(triple.predicate);
            let is_ontology = matches!(triple.object, Object::Node(class) if Some(class) == ontology);
            let header = predicate == version || (predicate == rdf_type && is_ontology);
            if predicate == imports || (header && index > 0) {
                if is_ontology {
                    dropped_headers.insert(names.text(triple.subject).clone());
                }
                continue;
            }
            if is_bulk(&triple) {
                bulk.push(triple);
            } else {
                graph.add(names.triple(triple));
            }
        }
        parts.push((start, name));
    }
    Merged { graph, bulk, parts, dropped_headers }
}

/// Merges and rewrites documents. Entities of `known_entities` need no declaration.
///
/// # Errors
/// Returns O112 if class expressions are nested too deeply.
pub(crate) fn normalize(
    documents: Vec<Document>,
    mut names: Names,
    known_entities: &[(EntityKind, Iri)],
) -> Result<Normal, Error> {
    let files: Vec<String> = documents.iter().map(|document| document.name.clone()).collect();
    let usage = bulk::Usage::of(&documents, &names);
    let Merged { mut graph, bulk, parts, dropped_headers } =
        merge(documents, &names, |triple| usage.is_bulk(triple));
    let mut undeclared = usage.undeclared(&bulk, &names);
    for (kind, iri) in known_entities {
        if *kind == EntityKind::Class {
            undeclared.remove(&**iri);
        }
    }
    let mut warnings = Vec::new();
    // Later stages are recursive, so expressions that are nested too deeply are rejected here.
    if let Some((index, about)) = depth::too_deep(&graph) {
        // The document that contains the triple.
        let part = parts.partition_point(|(start, _)| *start <= index).saturating_sub(1);
        return Err(Error::TooDeep {
            file: files[part].clone(),
            about,
            position: None,
            deepest: MAX_NESTING,
        });
    }
    kinds::declare_known(&mut graph, known_entities, &names);
    let rules = swrl::rewrite(&mut graph, &parts, &mut warnings);
    forms::rewrite(&mut graph);
    let disjoint = lists::rewrite(&mut graph, &mut warnings);
    anonymous::rewrite(&mut graph, &mut warnings);
    annotative::rewrite(&mut graph, &rules, &mut warnings);
    kinds::declare(&mut graph, undeclared, dropped_headers, &mut warnings);
    let mut plain = plain::take(&mut graph, bulk, &mut names);
    plain.axioms.extend(disjoint);
    Ok(Normal { ntriples: graph.to_ntriples(), plain, names, rules, warnings })
}
