//! Documents in every output syntax have the same consequences as the original when they are read again.

use std::collections::BTreeSet;
use std::path::Path;

use ontology::{
    Equality, Ontology, OutputSyntax, ReadOptions, convert_files, lower_with, read_files, read_text, turtle,
};
use rules::{Engine, Symbols};
use test_resources::data;

use crate::common::real_directory;

const OURS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/kb");

const ALL: [OutputSyntax; 5] = [
    OutputSyntax::RdfXml,
    OutputSyntax::Turtle,
    OutputSyntax::NTriples,
    OutputSyntax::OwlXml,
    OutputSyntax::Functional,
];

/// All conclusions as text, without those about anonymous individuals, whose names may change.
fn conclusions(ontology: &Ontology) -> BTreeSet<String> {
    let mut symbols = Symbols::new();
    let lowered = lower_with(ontology, Equality::Owl, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules");
    let facts = engine.facts().map(|fact| fact.display(engine.symbols()).to_string());
    facts.filter(|fact| !fact.contains("urn:metaplan:")).collect()
}

/// The rules without duplicates: OWL/XML does not record the ontology of a rule, so that equal rules become
/// one.
fn rules(ontology: &Ontology) -> BTreeSet<String> {
    ontology.rules.iter().map(ToString::to_string).collect()
}

fn check(file: &Path) {
    let options = ReadOptions { directories: vec![real_directory(), OURS.into()], ..ReadOptions::default() };
    let original = read_files(&[file], &options).expect("readable");
    let (axioms, rules) = (conclusions(&original), rules(&original));
    for syntax in ALL {
        let (text, _) = convert_files(&[file], &options, syntax).expect("writable");
        let (again, _) = convert_files(&[file], &options, syntax).expect("writable");
        assert!(text == again, "{syntax:?} of {} differs from run to run", file.display());
        let copy = tempfile::NamedTempFile::new().expect("temporary file");
        std::fs::write(copy.path(), &text).expect("written");
        // The written document has no imports.
        let copy_read = read_files(&[copy.path()], &ReadOptions::default())
            .unwrap_or_else(|errors| panic!("{syntax:?} of {}: {errors:?}", file.display()));
        assert_eq!(copy_read.iri(), original.iri(), "{syntax:?} of {}", file.display());
        assert_eq!(self::rules(&copy_read), rules, "rules in {syntax:?} of {}", file.display());
        let copied_axioms = conclusions(&copy_read);
        let differences: Vec<_> = axioms.symmetric_difference(&copied_axioms).take(3).collect();
        assert!(differences.is_empty(), "{syntax:?} of {}: {differences:#?}", file.display());
    }
}

#[test]
fn embedded_knowledge_bases_survive_conversion() {
    for name in ["tomasys", "ugv", "uuv"] {
        check(&Path::new(OURS).join(format!("{name}.ttl")));
    }
}

#[test]
fn real_knowledge_bases_survive_conversion() {
    for file in [
        "suave/suave.owl",
        "suave_planta/suave.owl",
        "mc_mros_reasoner/kb.owl",
        "mros_ontology/urjc_pilot.owl",
        "navigation_planta/navigation.owl",
    ] {
        let Some(file) = data(real_directory().join(file)) else { return };
        check(&file);
    }
}

#[test]
fn ntriples_are_converted_to_turtle() {
    let ntriples = "<http://metacontrol.org/tomasys#a> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> \
                    <http://metacontrol.org/tomasys#B> .\n";
    let text = turtle(ntriples).expect("N-Triples");
    assert_eq!(
        text,
        "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n\
         @prefix tomasys: <http://metacontrol.org/tomasys#> .\ntomasys:a a tomasys:B .\n"
    );
    assert!(turtle("no triple").is_err());
}

#[test]
fn annotations_of_annotations_are_kept() {
    let directory = tempfile::tempdir().expect("a folder");
    let file = directory.path().join("text.ttl");
    let text = "@prefix : <http://e.org/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> . \
        @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . <http://e.org/> a owl:Ontology . \
        :note a owl:AnnotationProperty ; rdfs:subPropertyOf rdfs:comment . :source a owl:AnnotationProperty . \
        :C a owl:Class ; :note \"text\" ; rdfs:label \"c\" . \
        [] a owl:Axiom ; owl:annotatedSource :C ; owl:annotatedProperty :note ; owl:annotatedTarget \"text\" ; \
           :source \"book A\" , \"book B\" . \
        [] a owl:Axiom ; owl:annotatedSource :note ; owl:annotatedProperty rdfs:subPropertyOf ; \
           owl:annotatedTarget rdfs:comment ; :source \"book C\" .";
    std::fs::write(&file, text).expect("written");
    let original = read_text(text, "text", &ReadOptions::default()).expect("legal");
    assert_eq!(original.annotation_annotations.len(), 3, "{original:?}");
    for syntax in [OutputSyntax::Functional, OutputSyntax::OwlXml] {
        let (text, warnings) = convert_files(&[&file], &ReadOptions::default(), syntax).expect("written");
        assert_eq!(warnings, []);
        let again = read_text(&text, "again", &ReadOptions::default()).expect("legal");
        assert_eq!(again.annotation_annotations, original.annotation_annotations, "{text}");
        assert_eq!(again.annotations, original.annotations, "{text}");
    }
}

/// Axioms about annotation properties are written as axioms. An n-ary axiom about a single individual has no
/// form and is omitted.
#[test]
fn functional_documents_are_legal() {
    let directory = tempfile::tempdir().expect("a folder");
    let file = directory.path().join("text.ttl");
    let text = "@prefix : <http://e.org/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> . \
        @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . <http://e.org/> a owl:Ontology . \
        :l a owl:AnnotationProperty ; rdfs:subPropertyOf rdfs:label ; rdfs:domain :C ; rdfs:range rdfs:Literal . \
        :C a owl:Class . :a a owl:NamedIndividual . [] a owl:AllDifferent ; owl:distinctMembers ( :a ) .";
    std::fs::write(&file, text).expect("written");
    for syntax in [OutputSyntax::Functional, OutputSyntax::OwlXml] {
        let (text, _) = convert_files(&[&file], &ReadOptions::default(), syntax).expect("written");
        for axiom in ["SubAnnotationPropertyOf", "AnnotationPropertyDomain", "AnnotationPropertyRange"] {
            assert!(text.contains(axiom), "{axiom}: {text}");
        }
        assert!(!text.contains("DifferentIndividuals") && !text.contains("AnnotationAssertion"), "{text}");
        let again = read_text(&text, "again", &ReadOptions::default()).expect("legal");
        assert_eq!(again.annotations.len(), 3, "{again:?}");
    }
}
