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

/// All facts that hold, as text, without those about anonymous individuals, whose names may change, and without those of
/// auxiliary relations.
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

/// Annotations of the headers of imported ontologies are not assertions about individuals after the conversion either.
#[test]
fn annotations_of_imported_headers_survive_conversion() {
    let directory = tempfile::tempdir().expect("a folder");
    let head = "@prefix : <http://e.org/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> . \
        @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix dcterms: <http://purl.org/dc/terms/> .";
    let write = |name: &str, text: &str| {
        std::fs::write(directory.path().join(name), format!("{head} {text}")).expect("written");
    };
    write(
        "a.ttl",
        "<http://a> a owl:Ontology ; owl:imports <b.ttl> . :Checked a owl:Class . owl:Thing rdfs:subClassOf :Checked . \
         :i a :Checked ; :p 1 .",
    );
    write(
        "b.ttl",
        "<http://b> a owl:Ontology ; owl:versionInfo \"1\" ; dcterms:title \"B\" ; dcterms:license <http://cc> ; :p 2 .",
    );
    check(&directory.path().join("a.ttl"));
}

/// Blank nodes that are only values of annotations have labels.
#[test]
fn blank_values_of_annotations_are_written() {
    let text = ":p a owl:AnnotationProperty . :C :p [ rdfs:comment \"x\" ] ; rdfs:seeAlso [ rdfs:label \"y\" ] . \
        <http://e.org/> rdfs:seeAlso [ rdfs:label \"manual\" ] .";
    for syntax in ALL {
        let text = written(text, syntax).expect("writable");
        let again =
            read_text(&text, "again", &ReadOptions::default()).unwrap_or_else(|e| panic!("{e:?}: {text}"));
        assert_eq!(again.annotations.len(), 3, "{syntax:?}: {text}");
    }
    let functional = written(text, OutputSyntax::Functional).expect("writable");
    let labels: BTreeSet<&str> = functional.split("_:").skip(1).map(|tail| &tail[..2]).collect();
    assert_eq!(labels.len(), 3, "{functional}");
}

fn written(text: &str, syntax: OutputSyntax) -> Result<String, String> {
    let directory = tempfile::tempdir().expect("a folder");
    let file = directory.path().join("text.ttl");
    let head = "@prefix : <http://e.org/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> . \
        @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix swrl: <http://www.w3.org/2003/11/swrl#> . \
        @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . <http://e.org/> a owl:Ontology . :C a owl:Class . \
        :d a owl:DatatypeProperty . :x a swrl:Variable .\n";
    std::fs::write(&file, format!("{head}{text}")).expect("written");
    convert_files(&[&file], &ReadOptions::default(), syntax)
        .map(|(text, _)| text)
        .map_err(|errors| errors.to_string())
}

#[test]
fn empty_bodies_and_heads_survive_conversion() {
    let atom = "( [ a swrl:ClassAtom ; swrl:classPredicate :C ; swrl:argument1 :x ] )";
    let text = format!(
        "[ a swrl:Imp ; swrl:body {atom} ; swrl:head () ] . \
        [ a swrl:Imp ; swrl:body () ; swrl:head ( [ a swrl:ClassAtom ; swrl:classPredicate :C ; swrl:argument1 :i ] ) ] ."
    );
    for syntax in ALL {
        let text = written(&text, syntax).expect("writable");
        assert!(!text.contains("urn:metaplan"), "{text}");
        let again = read_text(&text, "again", &ReadOptions::default()).expect("readable");
        let rules: BTreeSet<String> = again.rules.iter().map(ToString::to_string).collect();
        let expected = [" -> <http://e.org/#C>(<http://e.org/#i>)", "<http://e.org/#C>(?x) -> "];
        assert!(rules.iter().map(String::as_str).eq(expected), "{syntax:?}: {rules:?}");
        // Documents that were written are converted without a trace of the internal form of the rules.
        let directory = tempfile::tempdir().expect("a folder");
        std::fs::write(directory.path().join("again"), &text).expect("written");
        let files = [directory.path().join("again")];
        let (turtle, _) =
            convert_files(&files, &ReadOptions::default(), OutputSyntax::Turtle).expect("writable");
        assert!(!turtle.contains("urn:metaplan"), "{turtle}");
    }
}

#[test]
fn nested_data_ranges_survive_conversion() {
    let text = ":d rdfs:range [ a rdfs:Datatype ; owl:unionOf ( xsd:integer [ a rdfs:Datatype ; owl:intersectionOf ( \
        xsd:string [ a rdfs:Datatype ; owl:datatypeComplementOf [ a rdfs:Datatype ; owl:oneOf ( \"a\" ) ] ] ) ] ) ] .";
    for syntax in ALL {
        let text = written(text, syntax).expect("writable");
        assert!(!text.contains("urn:metaplan"), "{text}");
        let again = read_text(&text, "again", &ReadOptions::default()).expect("readable");
        let axioms: Vec<String> = again.axioms.iter().map(|annotated| annotated.axiom.to_string()).collect();
        let expected = "DataPropertyRange(<http://e.org/#d> \
            DataUnionOf(<http://www.w3.org/2001/XMLSchema#integer> \
            DataIntersectionOf(<http://www.w3.org/2001/XMLSchema#string> DataComplementOf(DataOneOf(\"a\")))))";
        assert_eq!(axioms, [expected], "{syntax:?}");
    }
}

#[test]
fn xml_that_is_not_well_formed_is_not_written() {
    for iri in ["http://x/#1", "http://x/p/", "urn:uuid:12-34"] {
        let error = written(&format!(":i <{iri}> 1 ."), OutputSyntax::RdfXml).expect_err(iri);
        assert!(error.contains("O111") && error.contains(iri) && error.contains("Turtle"), "{error}");
        let error = written(&format!(":i a <{iri}> ."), OutputSyntax::RdfXml).expect_err(iri);
        assert!(error.contains(&format!("class <{iri}>")), "{error}");
        assert!(written(&format!(":i a :C , <{iri}> ."), OutputSyntax::RdfXml).is_ok(), "{iri}");
        assert!(written(&format!(":i <{iri}> 1 ."), OutputSyntax::Turtle).is_ok(), "{iri}");
    }
    for (text, code) in [("\\u0001", "U+0001"), ("\\uFFFE", "U+FFFE")] {
        for syntax in [OutputSyntax::RdfXml, OutputSyntax::OwlXml] {
            let error = written(&format!(":i :d \"a{text}\" ."), syntax).expect_err(text);
            assert!(error.contains("O111") && error.contains(code), "{error}");
        }
    }
}

/// The readers of the functional-style syntax accept only literals and variables as arguments of data properties.
#[test]
fn rules_that_readers_refuse_are_not_written() {
    let atom = "[ a swrl:ClassAtom ; swrl:classPredicate :C ; swrl:argument1 :x ]";
    let text = |subject: &str| {
        format!(
            ":i a owl:NamedIndividual . [ a swrl:Imp ; swrl:head ( {atom} ) ; swrl:body ( {atom} \
            [ a swrl:DatavaluedPropertyAtom ; swrl:propertyPredicate :d ; swrl:argument1 {subject} ; swrl:argument2 1 ] ) ] ."
        )
    };
    for syntax in ALL {
        let text_of_rule = written(&text(":x"), syntax).expect("writable");
        read_text(&text_of_rule, "again", &ReadOptions::default()).expect("readable");
        match (syntax, written(&text(":i"), syntax)) {
            (OutputSyntax::Functional | OutputSyntax::OwlXml, outcome) => {
                let error = outcome.expect_err("not readable");
                let atom = "DataPropertyAtom(<http://e.org/#d> <http://e.org/#i>";
                assert!(error.contains("O111") && error.contains(atom), "{syntax:?}: {error}");
            }
            (_, outcome) => {
                read_text(&outcome.expect("writable"), "again", &ReadOptions::default()).expect("readable");
            }
        }
    }
}

#[test]
fn carriage_returns_survive_conversion() {
    for syntax in ALL {
        let text = written(":i :d \"a\\r\\nb\\rc\" .", syntax).expect("writable");
        let again = read_text(&text, "again", &ReadOptions::default()).expect("readable");
        let axioms: Vec<String> = again.axioms.iter().map(|annotated| annotated.axiom.to_string()).collect();
        let value = axioms[0].replace('\r', "\\r").replace('\n', "\\n");
        assert!(value.contains("a\\r\\nb\\rc"), "{syntax:?}: {text}");
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
