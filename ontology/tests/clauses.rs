//! Small documents on which a reader or reasoner of OWL 2 can err, each with the result that the
//! standard requires: OWL 2 Syntax and Direct Semantics, the tables of OWL 2 RL, the mapping from RDF
//! (including the forms of OWL 1).

use std::collections::BTreeSet;

use ontology::{Ontology, ReadOptions, lower, ntriples, read_files, read_text};
use rules::{Engine, Symbols};

const HEAD: &str = "@prefix : <http://e/#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
:A a owl:Class . :B a owl:Class . :C a owl:Class . :p a owl:ObjectProperty . :q a owl:ObjectProperty .
:d a owl:DatatypeProperty . :e a owl:DatatypeProperty . :f a owl:DatatypeProperty , owl:FunctionalProperty .
";

/// Returns the derived facts in short form; `None` if the knowledge is inconsistent.
fn inferred(ontology: &Ontology) -> Option<Vec<String>> {
    let mut symbols = Symbols::new();
    let lowered = lower(ontology, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe");
    let text = ntriples(engine.symbols(), &engine.inferred_in_brief(usize::MAX));
    let short = text
        .replace("http://e/#", "")
        .replace("http://www.w3.org/1999/02/22-rdf-syntax-ns#type", "a")
        .replace("http://www.w3.org/2002/07/owl#", "")
        .replace(['<', '>'], "");
    let lines = short.lines().map(|line| line.trim_end_matches(" .").to_owned());
    engine.violations().is_empty().then(|| lines.collect())
}

fn turtle(text: &str) -> Option<Vec<String>> {
    inferred(&read_text(&format!("{HEAD}{text}"), "t", &ReadOptions::default()).expect("well-formed"))
}

#[test]
fn contradictions_are_detected() {
    let inverse = "[ a owl:Restriction ; owl:onProperty [ owl:inverseOf :p ] ; owl:onClass :A ;";
    for text in [
        ":i a owl:Nothing .",
        "[] a owl:Nothing .",
        ":x owl:differentFrom :x .",
        ":x owl:differentFrom :x . :a owl:sameAs :b .",
        ":i owl:bottomObjectProperty :j .",
        ":i owl:bottomDataProperty 1 .",
        ":p rdfs:subPropertyOf owl:bottomObjectProperty . :i :p :j .",
        ":d rdfs:subPropertyOf owl:bottomDataProperty . :i :d 1 .",
        ":i :f \"0.0\"^^xsd:double , \"-0.0\"^^xsd:double .",
        ":i :f \"2020-01-01T00:00:00Z\"^^xsd:dateTime , \"2020-01-01T01:00:00+01:00\"^^xsd:dateTime .",
        ":i :f \"1/3\"^^owl:rational , \"1/2\"^^owl:rational .",
        ":C owl:complementOf :A . :i a :A , :C .",
        ":A rdfs:subClassOf [ owl:complementOf :B ] . :i a :A , :B .",
        ":x a owl:AllDifferent ; owl:distinctMembers ( :a :b :c ) . :a owl:sameAs :b .",
        ":x a owl:AllDifferent ; owl:members ( :a :b :c ) . :a owl:sameAs :b .",
        ":x a owl:AllDisjointClasses ; owl:members ( :A :B :C ) . :i a :A , :C .",
        ":x a owl:AllDisjointProperties ; owl:members ( :p :q ) . :i :p :j ; :q :j .",
        &format!(
            ":C rdfs:subClassOf {inverse} owl:maxQualifiedCardinality \"0\"^^xsd:nonNegativeInteger ] . :i a :C . :j a :A ; :p :i ."
        ),
    ] {
        assert_eq!(turtle(text), None, "{text}");
    }
}

#[test]
fn equal_and_undecided_values_are_no_contradiction() {
    for text in [
        // One value in two spellings.
        ":i :f \"0A\"^^xsd:hexBinary , \"0a\"^^xsd:hexBinary .",
        ":i :f \"2/6\"^^owl:rational , \"1/3\"^^owl:rational .",
        ":i :f \"1\"^^xsd:int , \"1.0\"^^xsd:decimal .",
        // The values of an undefined datatype, or of XML with another spelling, may be equal.
        ":D a rdfs:Datatype . :i :f \"a\"^^:D , \"b\"^^:D .",
        ":D a rdfs:Datatype . :i :f \"a\"^^:D , \"b\" .",
        ":i :f \"<a/>\"^^rdf:XMLLiteral , \"<a></a>\"^^rdf:XMLLiteral .",
        ":i :f \"<a/>\"^^rdf:XMLLiteral , \"<b/>\"^^rdf:XMLLiteral .",
        ":f rdfs:range :D . :D a rdfs:Datatype . :i :f 5 .",
    ] {
        assert_eq!(turtle(text), Some(Vec::new()), "{text}");
    }
}

#[test]
fn consequences_are_derived() {
    let inverse = "[ a owl:Restriction ; owl:onProperty [ owl:inverseOf :p ] ; owl:onClass :A ;";
    let cardinality_one = "\"1\"^^xsd:nonNegativeInteger ]";
    for (text, expected) in [
        // Definitions in the form of OWL 1.
        (":C owl:intersectionOf ( :A :B ) . :i a :A , :B . :j a :C .", &["i a C", "j a A", "j a B"][..]),
        (":C owl:unionOf ( :A :B ) . :i a :A .", &["i a C"]),
        (":C owl:oneOf ( :i :j ) .", &["i a C", "j a C"]),
        (
            ":C a owl:Restriction ; owl:onProperty :p ; owl:hasValue :v . :i a :C . :j :p :v .",
            &["i p v", "j a C"],
        ),
        // Expressions without a type.
        (
            ":A rdfs:subClassOf [ owl:intersectionOf ( :B [ owl:onProperty :p ; owl:hasValue :v ] ) ] . :i a :A .",
            &["i a B", "i p v"],
        ),
        (
            "[ owl:onProperty :p ; owl:someValuesFrom :A ] rdfs:subClassOf :B . :i :p :j . :j a :A .",
            &["i a B"],
        ),
        ("[ owl:unionOf ( :A :B ) ] rdfs:subClassOf :C . :i a :B .", &["i a C"]),
        (
            &format!(
                ":C rdfs:subClassOf {inverse} owl:maxQualifiedCardinality {cardinality_one} . :i a :C . :j a :A ; :p :i . :k a :A ; :p :i ."
            ),
            &["j sameAs k", "k sameAs j"],
        ),
        (
            &format!(
                "{inverse} owl:minQualifiedCardinality {cardinality_one} rdfs:subClassOf :C . :j a :A ; :p :i ."
            ),
            &["i a C"],
        ),
        // Classes and properties that are the same individual.
        (":A owl:sameAs :B . :i a :A .", &["B sameAs A", "i a B"]),
        (":p owl:sameAs :q . :i :p :j .", &["i q j", "q sameAs p"]),
        (":d owl:sameAs :e . :i :d \"1\" .", &["e sameAs d", "i e \"1\""]),
        // Axioms about all individuals.
        (":p a owl:ReflexiveProperty . :i a owl:NamedIndividual . :k :q :l .", &["i p i", "k p k", "l p l"]),
        (
            "[ a owl:Restriction ; owl:onProperty owl:topObjectProperty ; owl:someValuesFrom owl:Thing ] rdfs:subClassOf :C . :i a owl:Thing .",
            &["i a C"],
        ),
        ("owl:Thing rdfs:subClassOf :C . :i :p :j .", &["i a C", "j a C"]),
    ] {
        let derived = turtle(text).unwrap_or_else(|| panic!("{text} contradicts itself"));
        let lines = derived.iter().map(String::as_str).filter(|line| !line.contains("topObjectProperty"));
        let expected: BTreeSet<&str> = expected.iter().copied().collect();
        assert_eq!(lines.collect::<BTreeSet<_>>(), expected, "{text}");
    }
}

#[test]
fn documents_in_several_encodings_and_spellings_are_read() {
    let xml = |encoding: &str| {
        format!(
            "<?xml version=\"1.0\" encoding=\"{encoding}\"?><rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" \
            xmlns:e=\"http://e/#\"><e:C rdf:about=\"http://e/#\u{e9}\"/></rdf:RDF>"
        )
    };
    let one_byte = |text: &str| -> Vec<u8> {
        text.chars().map(|c| u8::try_from(u32::from(c)).expect("Latin 1")).collect()
    };
    let utf16 =
        |text: &str| -> Vec<u8> { text.encode_utf16().chain([]).flat_map(u16::to_le_bytes).collect() };
    let marked = |text: &str| [b"\xef\xbb\xbf", text.as_bytes()].concat();
    let entities = "<?xml version='1.0'?><!DOCTYPE Ontology [<!ENTITY e 'http://e/#'>]>
        <Ontology xmlns='http://www.w3.org/2002/07/owl#' ontologyIRI='http://e/'>
        <ClassAssertion><Class IRI='&e;C'/><AnonymousIndividual nodeID='_:x'/></ClassAssertion></Ontology>";
    let functional = "Prefix(:=<http://e/#>) Ontology(<http://e/> ClassAssertion(:C _:x))";
    for (name, bytes) in [
        ("latin1.owl", one_byte(&xml("ISO-8859-1"))),
        ("windows.owl", one_byte(&xml("windows-1252"))),
        ("utf16.owl", [&b"\xff\xfe"[..], &utf16(&xml("UTF-16"))].concat()),
        ("utf16.ttl", [&b"\xff\xfe"[..], &utf16("<http://e/#i> a <http://e/#C> .")].concat()),
        ("marked.owl", marked(&xml("UTF-8"))),
        ("marked.ttl", marked("@prefix : <http://e/#> . :i a :C .")),
        (
            "marked.nt",
            marked("<mailto:i> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://e/#C> .\n"),
        ),
        (
            "mail.nt",
            b"<mailto:i> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://e/#C> .\n".to_vec(),
        ),
        ("tag.nt", b"<tag:i> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://e/#C> .\n".to_vec()),
        ("file.nt", b"<file:i> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://e/#C> .\n".to_vec()),
        ("marked.ofn", marked(functional)),
        ("blank.ofn", functional.as_bytes().to_vec()),
        ("entities.owx", entities.as_bytes().to_vec()),
        (
            "entities.owl",
            xml("UTF-8")
                .replace("?><rdf", "?><!DOCTYPE r [<!ENTITY e 'http://e/#'>]><rdf")
                .replace("about=\"http://e/#", "about=\"&e;")
                .into_bytes(),
        ),
    ] {
        let directory = tempfile::tempdir().expect("temporary directory");
        let file = directory.path().join(name);
        std::fs::write(&file, bytes).expect("written");
        let ontology = read_files(&[&file], &ReadOptions::default())
            .unwrap_or_else(|errors| panic!("{name}: {}", errors[0]));
        let axioms: Vec<String> =
            ontology.axioms.iter().map(|annotated| annotated.axiom.to_string()).collect();
        let [axiom] = &axioms[..] else { panic!("{name}: {axioms:?}") };
        assert!(axiom.starts_with("ClassAssertion(<http://e/#C> "), "{name}: {axiom}");
        let latin = ["latin1.owl", "windows.owl", "utf16.owl", "marked.owl", "entities.owl"].contains(&name);
        assert!(!latin || axiom.ends_with("<http://e/#\u{e9}>)"), "{name}: {axiom}");
    }
}

#[test]
fn rejections_name_position_and_cause() {
    let deep =
        format!("{HEAD}\n:A rdfs:subClassOf {}:B{} .", "[ owl:complementOf ".repeat(200), " ]".repeat(200));
    for (name, text, expected) in [
        (
            "deep.ttl",
            deep.as_str(),
            "deep.ttl:6:2: error[O112]: expressions are nested more than 128 deep, in statements about <http://e/#A>",
        ),
        (
            "empty.ttl",
            "",
            "empty.ttl:1:1: error[O113]: this is an empty document; an ontology has at least one statement",
        ),
        (
            "prefix.ofn",
            "Ontology(<http://e/>\nSubClassOf(:A foo:B))",
            "prefix.ofn:2:12: error[O102]: not well-formed functional-style syntax: the prefix `:` is not declared",
        ),
        (
            "part.owx",
            "<?xml version='1.0'?>\n<Ontology xmlns='http://www.w3.org/2002/07/owl#' ontologyIRI='http://e/'>\n<SubClassOf><Class IRI='http://e/#A'/></SubClassOf></Ontology>",
            "part.owx:3:63: error[O102]: not well-formed OWL/XML: an element ends here that lacks a part, or has one that OWL does not know",
        ),
        (
            "manchester.omn",
            "Prefix: : <http://e/#>\nOntology: <http://e/>\nClass: A\n",
            "manchester.omn:1:1: error[O113]: this is Manchester syntax, which is not read",
        ),
        (
            "import.ttl",
            "<http://e/> a <http://www.w3.org/2002/07/owl#Ontology> ;\n <http://www.w3.org/2002/07/owl#imports> <http://nowhere/> .",
            "import.ttl:2:43: error[O103]: cannot find the import <http://nowhere/>; name a directory that contains it (--directory), or a catalog",
        ),
    ] {
        let errors = read_text(text, name, &ReadOptions::default()).expect_err(name);
        let message = errors[0].to_string();
        assert!(message.starts_with(expected), "{message}");
    }
}
