//! Merged triples to triples that horned-owl reads without loss.
//!
//! Its RDF reader matches exact shapes and passes over what deviates: rules that have an IRI, atoms with an annotation,
//! data atoms about an individual, empty bodies, lists used twice, `AllDisjointClasses`, undeclared properties, blank
//! nodes as individuals. Real knowledge bases contain most of these. The passes below rewrite them, one file each:
//!
//! | pass | rewrites |
//! |---|---|
//! | here | headers of imported ontologies (taken away) |
//! | `bulk` | nothing: tells which statements no other pass looks at |
//! | `swrl` | every rule into one canonical shape |
//! | `forms` | definitions as OWL 1 writes them, expressions without types, axioms with IRIs |
//! | `lists` | disjointness of many into pairs, shared lists into copies, property chains checked |
//! | `anonymous` | blank-node individuals into IRIs |
//! | `annotative` | axioms that treat an annotation property as another one (taken away) |
//! | `kinds` | undeclared entities into declared ones |
//! | `plain` | statements that need no reader into our own structures |

mod annotative;
mod anonymous;
mod bulk;
pub(crate) mod depth;
mod forms;
mod kinds;
mod lists;
mod plain;
mod swrl;

use depth::DEEPEST;
pub(crate) use swrl::{INDIVIDUAL, ORIGIN, Origin, TRUE, VARIABLE};

use crate::contents::Parts;
use crate::error::{Error, Warning};
use crate::graph::Graph;
use crate::names::{Compact, Names, Object};
use crate::owl::{EntityKind, Iri};
use crate::triples::Document;
use crate::vocab::{owl, rdf};

/// What normalisation yields.
#[derive(Debug)]
pub(crate) struct Normal {
    /// The document for horned-owl.
    pub ntriples: Vec<u8>,
    /// What does not have to go through it.
    pub plain: Parts,
    /// The IRIs in `plain`.
    pub names: Names,
    /// Where each rule comes from; its canonical form is annotated with the index here.
    pub rules: Vec<Origin>,
    pub warnings: Vec<Warning>,
}

/// The triples of all documents, with the header of the first only.
pub(crate) struct Merged {
    pub graph: Graph,
    /// Statements that are left out of the graph.
    pub bulk: Vec<Compact>,
    /// For each document, where it starts in the graph, and the ontology that it is.
    pub parts: Vec<(usize, Iri)>,
}

/// Merges documents; what `is_bulk` holds of stays out of the graph.
pub(crate) fn merge(documents: Vec<Document>, names: &Names, is_bulk: impl Fn(&Compact) -> bool) -> Merged {
    let (mut graph, mut bulk, mut parts) = (Graph::default(), Vec::new(), Vec::new());
    let [kind, ontology, imports, version] =
        [rdf::TYPE, owl::ONTOLOGY, owl::IMPORTS, owl::VERSION_IRI].map(|iri| names.find(iri));
    for (index, document) in documents.into_iter().enumerate() {
        let name = document.iri.clone().unwrap_or_else(|| document.name.as_str().into());
        let start = graph.len();
        for triple in document.triples {
            let predicate = Some(triple.predicate);
            let is_ontology = matches!(triple.object, Object::Node(class) if Some(class) == ontology);
            let header = predicate == version || (predicate == kind && is_ontology);
            if predicate == imports || (header && index > 0) {
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
    Merged { graph, bulk, parts }
}

/// Merges and rewrites; see the module documentation. What is `known` need not be declared.
///
/// # Errors
/// Class expressions are nested too deep.
pub(crate) fn normalize(
    documents: Vec<Document>,
    mut names: Names,
    known_entities: &[(EntityKind, Iri)],
) -> Result<Normal, Error> {
    let files: Vec<String> = documents.iter().map(|document| document.name.clone()).collect();
    let known = bulk::Known::of(&documents, &names);
    let Merged { mut graph, bulk, parts } = merge(documents, &names, |triple| known.is_bulk(triple));
    let mut undeclared = known.undeclared(&bulk, &names);
    for (kind, iri) in known_entities {
        if *kind == EntityKind::Class {
            undeclared.remove(&**iri);
        }
    }
    let mut warnings = Vec::new();
    if let Some((index, about)) = depth::too_deep(&graph) {
        let part = parts.partition_point(|(start, _)| *start <= index).saturating_sub(1);
        return Err(Error::TooDeep { file: files[part].clone(), about, position: None, deepest: DEEPEST });
    }
    kinds::declare_known(&mut graph, known_entities, &names);
    let rules = swrl::rewrite(&mut graph, &parts, &mut warnings);
    forms::rewrite(&mut graph);
    let disjoint = lists::rewrite(&mut graph, &mut warnings);
    anonymous::rewrite(&mut graph, &mut warnings);
    annotative::rewrite(&mut graph, &mut warnings);
    kinds::declare(&mut graph, undeclared, &mut warnings);
    let mut plain = plain::take(&mut graph, bulk, &mut names);
    plain.axioms.extend(disjoint);
    Ok(Normal { ntriples: graph.to_ntriples(), plain, names, rules, warnings })
}
