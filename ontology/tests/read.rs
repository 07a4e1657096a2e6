//! Reading: syntaxes, imports, repairs of triples that horned-owl would lose, and positions of errors.

use std::path::{Path, PathBuf};

use ontology::{Error, Ontology, ReadOptions, Syntax, Warning, read_files, read_text};

const PREFIXES: &str = "@prefix : <http://e/#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix swrl: <http://www.w3.org/2003/11/swrl#> .
@prefix swrlb: <http://www.w3.org/2003/11/swrlb#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
:C a owl:Class . :D a owl:Class . :p a owl:ObjectProperty . :q a owl:ObjectProperty . :d a owl:DatatypeProperty .
:i a owl:NamedIndividual . :x a swrl:Variable . :y a swrl:Variable .
";

fn turtle(body: &str) -> Ontology {
    read_text(&format!("{PREFIXES}{body}"), "test.ttl", &ReadOptions::default()).expect("well-formed")
}

fn shown(ontology: &Ontology) -> Vec<String> {
    let rules = ontology.rules().iter().map(ToString::to_string);
    let axioms = ontology.axioms.iter().map(|annotated| annotated.axiom.to_string());
    rules.chain(axioms).map(|text| text.replace("<http://e/#", "<")).collect()
}

fn warnings(ontology: &Ontology) -> Vec<String> {
    ontology.warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn every_syntax_gives_the_same_ontology() {
    let documents = [
        (
            Syntax::Turtle,
            "@prefix : <http://e/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
             <http://e/> a owl:Ontology . :C a owl:Class . :i a owl:NamedIndividual , :C .",
        ),
        (
            Syntax::Turtle,
            "<http://e/> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://www.w3.org/2002/07/owl#Ontology> .\n\
             <http://e/#C> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://www.w3.org/2002/07/owl#Class> .\n\
             <http://e/#i> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> \
             <http://www.w3.org/2002/07/owl#NamedIndividual> .\n\
             <http://e/#i> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://e/#C> .",
        ),
        (
            Syntax::RdfXml,
            "<!DOCTYPE rdf:RDF [ <!ENTITY owl \"http://www.w3.org/2002/07/owl#\"> ]>\n\
             <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns:owl=\"&owl;\" xmlns=\"http://e/#\">\n\
             <owl:Ontology rdf:about=\"http://e/\"/><owl:Class rdf:about=\"http://e/#C\"/>\n\
             <C rdf:about=\"http://e/#i\"><rdf:type rdf:resource=\"&owl;NamedIndividual\"/></C></rdf:RDF>",
        ),
        (
            Syntax::OwlXml,
            "<?xml version=\"1.0\"?>\n<Ontology xmlns=\"http://www.w3.org/2002/07/owl#\" ontologyIRI=\"http://e/\">\n\
             <Declaration><Class IRI=\"http://e/#C\"/></Declaration>\n\
             <Declaration><NamedIndividual IRI=\"http://e/#i\"/></Declaration>\n\
             <ClassAssertion><Class IRI=\"http://e/#C\"/><NamedIndividual IRI=\"http://e/#i\"/></ClassAssertion>\n\
             </Ontology>",
        ),
        (
            Syntax::Functional,
            "Prefix(:=<http://e/#>)\nOntology(<http://e/>\nDeclaration(Class(:C))\nDeclaration(NamedIndividual(:i))\n\
             ClassAssertion(:C :i)\n)",
        ),
    ];
    for (syntax, text) in documents {
        let ontology =
            read_text(text, "document", &ReadOptions::default()).unwrap_or_else(|e| panic!("{e:?}"));
        assert_eq!(ontology.sources[0].syntax, syntax);
        assert_eq!(ontology.iri().map(|iri| &**iri), Some("http://e/"), "{syntax}");
        assert_eq!(shown(&ontology), ["ClassAssertion(<C> <i>)"], "{syntax}");
        assert_eq!(ontology.entities.len(), 2, "{syntax}");
        assert_eq!(warnings(&ontology), [""; 0], "{syntax}");
    }
}

/// Forms of rules that horned-owl does not read; see the documentation of `normalize/mod.rs`.
#[test]
fn rules_in_unusual_forms_are_read() {
    let atom = |class: &str, x: &str| {
        format!("[ a swrl:ClassAtom ; swrl:classPredicate {class} ; swrl:argument1 {x} ]")
    };
    let data = |x: &str, v: &str| {
        format!(
            "[ a swrl:DatavaluedPropertyAtom ; swrl:propertyPredicate :d ; swrl:argument1 {x} ; swrl:argument2 {v} ]"
        )
    };
    let rule = |body: &str, head: &str| format!("[] a swrl:Imp ; swrl:body {body} ; swrl:head {head} .");
    let (c, d) = (atom(":C", ":x"), atom(":D", ":x"));
    let cases = [
        // A rule with an IRI, and lists without type.
        (format!(":r a swrl:Imp ; swrl:body ( {c} ) ; swrl:head ( {d} ) ."), "<C>(?x) -> <D>(?x)"),
        // A data atom about an individual, in the body and in the head.
        (
            rule(&format!("( {c} {} )", data(":i", ":y")), &format!("( {d} )")),
            "<C>(?x) ^ <d>(<i>, ?y) -> <D>(?x)",
        ),
        (
            rule(&format!("( {c} )"), &format!("( {} )", data(":i", "1"))),
            "<C>(?x) -> <d>(<i>, \"1\"^^<xsd:integer>)",
        ),
        // Empty body, missing body, empty head.
        (rule("rdf:nil", &format!("( {} )", atom(":C", ":i"))), " -> <C>(<i>)"),
        (format!("[] a swrl:Imp ; swrl:head ( {} ) .", atom(":C", ":i")), " -> <C>(<i>)"),
        (rule(&format!("( {c} {d} )"), "rdf:nil"), "<C>(?x) ^ <D>(?x) -> "),
        // Atoms with an annotation or an IRI.
        (
            format!(
                ":a rdfs:comment \"extra\" ; a swrl:ClassAtom , owl:Thing ; swrl:classPredicate :C ; swrl:argument1 :x . {}",
                rule("( :a )", &format!("( {d} )"))
            ),
            "<C>(?x) -> <D>(?x)",
        ),
        // A list that is the body of one rule and the head of another.
        (format!("{} _:l rdf:first {c} ; rdf:rest rdf:nil .", rule("_:l", "_:l")), "<C>(?x) -> <C>(?x)"),
        // One blank node as individual, another one as variable.
        (
            format!(
                "_:b a :C . _:v a swrl:Variable . {}",
                rule(&format!("( {} )", atom(":C", "_:v")), &format!("( {} )", atom(":D", "_:b")))
            ),
            "<C>(?d0b1) -> <D>(_:d0b0)",
        ),
        // A class expression.
        (
            rule(
                &format!(
                    "( {} )",
                    atom("[ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom :D ]", ":x")
                ),
                &format!("( {c} )"),
            ),
            "ObjectSomeValuesFrom(<p> <D>)(?x) -> <C>(?x)",
        ),
        (
            rule(
                &format!(
                    "( {} [ a swrl:BuiltinAtom ; swrl:builtin swrlb:lessThan ; swrl:arguments ( :y 2 ) ] )",
                    data(":x", ":y")
                ),
                &format!("( {c} )"),
            ),
            "<d>(?x, ?y) ^ <swrlb:lessThan>(?y, \"2\"^^<xsd:integer>) -> <C>(?x)",
        ),
    ];
    for (text, expected) in cases {
        let ontology = turtle(&text);
        let rules = ontology.rules().iter().map(ToString::to_string);
        let rules: Vec<_> = rules
            .map(|rule| {
                rule.replace("<http://e/#", "<").replace("<http://www.w3.org/2001/XMLSchema#", "<xsd:")
            })
            .map(|rule| rule.replace("<http://www.w3.org/2003/11/swrlb#", "<swrlb:"))
            .collect();
        assert_eq!(rules, [expected], "{text}\n{:?}", warnings(&ontology));
    }
}

#[test]
fn axioms_in_unusual_forms_are_read() {
    for (text, expected) in [
        (
            "[] a owl:AllDisjointClasses ; owl:members ( :C :D :E ) . :E a owl:Class .",
            &["DisjointClasses(<C> <D>)", "DisjointClasses(<C> <E>)", "DisjointClasses(<D> <E>)"][..],
        ),
        (
            "[] a owl:AllDisjointProperties ; owl:members ( :p :q ) .",
            &["DisjointObjectProperties(<p> <q>)"],
        ),
        ("_:b a :C ; :p :i .", &[
            "ClassAssertion(<C> _:d0b0)",
            "ObjectPropertyAssertion(<p> _:d0b0 <i>)",
        ]),
        // One enumeration for two ranges.
        (
            ":e a owl:DatatypeProperty . :d rdfs:range _:r . :e rdfs:range [ a rdfs:Datatype ; owl:oneOf _:l ] .
             _:r a rdfs:Datatype ; owl:oneOf _:l . _:l rdf:first \"A\" ; rdf:rest rdf:nil .",
            &["DataPropertyRange(<d> DataOneOf(\"A\"))", "DataPropertyRange(<e> DataOneOf(\"A\"))"],
        ),
        (":r owl:propertyChainAxiom ( :p :q ) . :r a owl:ObjectProperty .", &[
            "SubObjectPropertyOf(ObjectPropertyChain(<p> <q>) <r>)",
        ]),
        // A list that is shared with an n-ary axiom, as a whole and in part.
        (
            "_:l rdf:first :C ; rdf:rest ( :D ) . [] a owl:AllDisjointClasses ; owl:members _:l .
             :E a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:unionOf _:l ] .",
            &["EquivalentClasses(<E> ObjectUnionOf(<C> <D>))", "DisjointClasses(<C> <D>)"],
        ),
        (
            "_:l rdf:first :C ; rdf:rest _:m . _:m rdf:first :D ; rdf:rest ( :E ) .
             [] a owl:AllDisjointClasses ; owl:members _:l . :E a owl:Class .
             :F a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:unionOf _:m ] .",
            &[
                "EquivalentClasses(<F> ObjectUnionOf(<D> <E>))",
                "DisjointClasses(<C> <D>)",
                "DisjointClasses(<C> <E>)",
                "DisjointClasses(<D> <E>)",
            ],
        ),
        // Two lists with a common rest.
        (
            "_:a rdf:first :C ; rdf:rest _:t . _:b rdf:first :D ; rdf:rest _:t . _:t rdf:first :E ; rdf:rest () .
             [] a owl:AllDisjointClasses ; owl:members _:a . :E a owl:Class .
             :F a owl:Class ; owl:equivalentClass [ a owl:Class ; owl:unionOf _:b ] .",
            &["EquivalentClasses(<F> ObjectUnionOf(<D> <E>))", "DisjointClasses(<C> <E>)"],
        ),
    ] {
        let ontology = turtle(text);
        assert_eq!(shown(&ontology), expected, "{text}\n{:?}", warnings(&ontology));
        assert_eq!(warnings(&ontology), [""; 0], "{text}");
    }
}

#[test]
fn deviations_from_the_text_are_warnings() {
    for (text, expected) in [
        (
            ":i :undeclared 1 .",
            "test.ttl:10:5: warning[O201]: <http://e/#undeclared> is not declared; read as a data property \
             because of its use",
        ),
        (
            ":i :undeclared :i .",
            "test.ttl:10:5: warning[O201]: <http://e/#undeclared> is not declared; read as an object property \
             because of its use",
        ),
        (
            ":i a :Undeclared .",
            "test.ttl:10:7: warning[O201]: <http://e/#Undeclared> is not declared; read as a class because of its use",
        ),
        (
            ":C :undeclared 1 .",
            "test.ttl:10:5: warning[O201]: <http://e/#undeclared> is not declared; read as an annotation \
             property because of its use",
        ),
        (
            ":p owl:propertyChainAxiom ( :q 5 ) .",
            "warning[O202]: not read: property chain of <http://e/#p> (\"5\"^^<http://www.w3.org/2001/XMLSchema#integer> is not a property)",
        ),
        (
            ":i :p 5 .",
            "warning[O202]: not read: <http://e/#i> <http://e/#p> \"5\" (part of no axiom or rule)",
        ),
        (
            "[] rdfs:comment \"of nothing\" .",
            "warning[O202]: not read: <http://www.w3.org/2000/01/rdf-schema#comment> of 1 blank nodes (there \
             are no other statements about them)",
        ),
        (
            "[] a swrl:Imp ; rdfs:label \"R\" ; swrl:body ( 5 ) ; swrl:head rdf:nil .",
            "warning[O203]: rule <test.ttl>#0 (R) is left out: the literal \"5\"^^<http://www.w3.org/2001/XMLSchema#integer> stands where an atom should",
        ),
        (
            "[] a swrl:Imp ; swrl:body _:l ; swrl:head rdf:nil . _:l rdf:first :a ; rdf:rest _:l .",
            "warning[O203]: rule <test.ttl>#0 is left out: the list at _:d0b1 is cyclic",
        ),
        (
            "[] a swrl:Imp ; swrl:body ( [ a swrl:ClassAtom ; swrl:classPredicate :C ; swrl:argument1 :z ] ) ; swrl:head rdf:nil .",
            "warning[O204]: <http://e/#z> in rule <test.ttl>#0 is neither a declared variable nor an individual of the knowledge base; read as an individual",
        ),
    ] {
        let warnings = warnings(&turtle(text));
        assert_eq!(warnings.last().map(String::as_str), Some(expected), "{text}\n{warnings:#?}");
    }
}

#[test]
fn malformed_documents_are_errors_with_a_place() {
    let rdf = "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n";
    for (text, expected) in [
        ("@prefix : <http://e/#> .\n:a :b owl:Class .", &["f:2:7: error[O102]: not well-formed Turtle"][..]),
        (":a :b", &["f:1:1: error[O102]: not well-formed Turtle"]),
        ("not an ontology at all", &["f:1:1: error[O102]: not well-formed Turtle"]),
        (
            &format!("{rdf}<owl:Class rdf:about=\"x\"/></rdf:RDF>"),
            &["f:2:27: error[O102]: not well-formed RDF/XML"],
        ),
        (&format!("{rdf}<rdf:Description></rdf:RDF>"), &["f:2:28: error[O102]: not well-formed RDF/XML"]),
        (rdf, &["f:2:1: error[O102]: not well-formed RDF/XML"]),
        (
            "Prefix(:=<http://e/#>)\nOntology(<http://e/>\nClassAssertion(:C))",
            &["f:3:18: error[O102]: not well-formed functional"],
        ),
        (
            &format!("Prefix(:=<http://e/#>)\nOntology(<http://e/>\n{}ClassAssertion(:C))", "\n".repeat(9)),
            &["f:12:18: error[O102]: not well-formed functional-style syntax: expected Individual"],
        ),
        (
            "<Ontology xmlns=\"http://www.w3.org/2002/07/owl#\"><Declaration>",
            &["f:1:63: error[O102]: not well-formed OWL/XML"],
        ),
    ] {
        let errors = read_text(text, "f", &ReadOptions::default()).expect_err(text);
        let errors: Vec<String> = errors.iter().map(ToString::to_string).collect();
        for (error, expected) in errors.iter().zip(expected) {
            assert!(error.starts_with(expected), "{text}\n{errors:#?}");
        }
    }
}

/// The pairs of the members would fill the memory.
#[test]
fn axioms_with_too_many_pairs_are_reported() {
    let properties: Vec<String> = (0..1_001).map(|number| format!(":p{number}")).collect();
    let declarations: Vec<String> =
        properties.iter().map(|property| format!("{property} a owl:ObjectProperty .")).collect();
    let members = properties.join(" ");
    let axiom = format!("[] a owl:AllDisjointProperties ; owl:members ( {members} ) .");
    let ontology = turtle(&format!("{}\n{axiom}", declarations.join("\n")));
    let [warning] = &warnings(&ontology)[..] else { panic!("{:?}", ontology.warnings.len()) };
    assert!(warning.starts_with("warning[O202]") && warning.contains("more than 1000 members"), "{warning}");
}

#[test]
fn line_ends_of_xml_are_normalised() {
    let read = |text: &str| {
        let ontology = read_text(text, "document", &ReadOptions::default());
        shown(&ontology.unwrap_or_else(|errors| panic!("{errors:?}")))
    };
    let rdf = "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns=\"http://e/#\">\r\n\
        <rdf:Description rdf:about=\"http://e/#i\"><d>a\r\nb\rc&#xD;</d></rdf:Description>\r</rdf:RDF>";
    let owl = "<Ontology xmlns=\"http://www.w3.org/2002/07/owl#\" ontologyIRI=\"http://e/\">\r\n\
        <DataPropertyAssertion><DataProperty IRI=\"http://e/#d\"/><NamedIndividual IRI=\"http://e/#i\"/>\
        <Literal>a\r\nb\rc&#xD;</Literal></DataPropertyAssertion>\r\n</Ontology>";
    for text in [rdf, owl] {
        assert_eq!(read(text), ["DataPropertyAssertion(<d> <i> \"a\nb\nc\r\")"], "{text:?}");
    }
}

#[test]
fn nested_data_ranges_are_read_completely() {
    // The order in which horned-owl visits blank nodes differs from run to run.
    for _ in 0..8 {
        let ontology = turtle(
            ":C rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :d ; owl:someValuesFrom [ a rdfs:Datatype ; \
             owl:intersectionOf ( xsd:integer [ a rdfs:Datatype ; owl:intersectionOf ( xsd:decimal [ a \
             rdfs:Datatype ; owl:unionOf ( xsd:short [ a rdfs:Datatype ; owl:oneOf ( 1 2 ) ] ) ] ) ] ) ] ] .",
        );
        let expected = "SubClassOf(<C> DataSomeValuesFrom(<d> DataIntersectionOf(<xsd:integer> \
            DataIntersectionOf(<xsd:decimal> DataUnionOf(<xsd:short> DataOneOf(\"1\"^^<xsd:integer> \"2\"^^<xsd:integer>))))))";
        assert_eq!(
            shown(&ontology),
            [expected].map(|text| text.replace("xsd:", "http://www.w3.org/2001/XMLSchema#"))
        );
        assert_eq!(warnings(&ontology), [""; 0]);
        assert!(
            ontology.entities.iter().all(|(_, iri)| !iri.contains("urn:metaplan")),
            "{:?}",
            ontology.entities
        );
    }
    // A data range within itself is not a data range, but ends.
    turtle("_:r a rdfs:Datatype ; owl:unionOf ( xsd:integer _:r ) . :d rdfs:range _:r .");
}

#[test]
fn data_ranges_of_datatypes_without_declaration_are_read() {
    for (datatype, kind) in [
        ("owl:real", "a rdfs:Datatype ;"),
        ("owl:rational", ""),
        ("rdf:langString", ""),
        ("rdf:XMLLiteral", ""),
        (":own", "a rdfs:Datatype ;"),
    ] {
        let ontology = turtle(&format!(
            ":C rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :d ; owl:someValuesFrom [ {kind} owl:unionOf ( {datatype} xsd:string ) ] ] ."
        ));
        let [axiom] = &shown(&ontology)[..] else { panic!("{datatype}: {:?}", warnings(&ontology)) };
        assert!(axiom.contains("DataUnionOf("), "{axiom}");
        assert_eq!(warnings(&ontology), [""; 0], "{datatype}");
    }
}

#[test]
fn inverses_of_inverses_are_equivalences() {
    let equivalence = |first: &str, second: &str| format!("EquivalentObjectProperties(<{first}> <{second}>)");
    for (text, expected) in [
        (":p owl:inverseOf [ owl:inverseOf :q ] .", equivalence("p", "q")),
        ("[ owl:inverseOf :q ] owl:inverseOf :p .", equivalence("q", "p")),
        (
            "[ owl:inverseOf :q ] owl:inverseOf [ a owl:ObjectProperty ; owl:inverseOf :p ] .",
            "InverseObjectProperties(<q> <p>)".to_owned(),
        ),
        (":p owl:inverseOf :q .", "InverseObjectProperties(<p> <q>)".to_owned()),
    ] {
        let ontology = turtle(text);
        assert_eq!(shown(&ontology), [expected], "{text}");
        assert_eq!(warnings(&ontology), [""; 0], "{text}");
    }
    let text = "Prefix(:=<http://e/#>)\nOntology(<http://e/>\nDeclaration(ObjectProperty(:p))\n\
        InverseObjectProperties(:p ObjectInverseOf(:q))\n)";
    let ontology = read_text(text, "text", &ReadOptions::default()).unwrap_or_else(|e| panic!("{e:?}"));
    assert_eq!(shown(&ontology), [equivalence("p", "q")]);
    let text = text.replace("ObjectInverseOf(:q)", "\"q\"");
    let errors = read_text(&text, "text", &ReadOptions::default()).expect_err("not in the grammar");
    let message = errors.to_string();
    assert!(message.contains("text:4:") && message.contains("expected"), "{message}");
    assert!(!message.contains("-->"), "{message}");
}

#[test]
fn a_missing_file_is_an_error() {
    let errors =
        read_files(&[Path::new("/nonexistent/kb.owl")], &ReadOptions::default()).expect_err("missing");
    assert!(matches!(&errors[..], [Error::Unreadable { .. }]), "{errors:?}");
}

fn directory(files: &[(&str, &str)]) -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("temporary directory");
    for (name, text) in files {
        let path = directory.path().join(name);
        std::fs::create_dir_all(path.parent().expect("parent")).expect("directory");
        std::fs::write(path, text).expect("written");
    }
    directory
}

fn importing(iri: &str, imports: &[&str]) -> String {
    let imports: Vec<_> = imports.iter().map(|import| format!(" ; owl:imports <{import}>")).collect();
    format!("@prefix owl: <http://www.w3.org/2002/07/owl#> .\n<{iri}> a owl:Ontology{} .", imports.concat())
}

#[test]
fn imports_are_found_on_this_machine() {
    let tomasys = importing("http://metacontrol.example/tomasys", &[]);
    let url = "https://raw.example/acme/mc_mdl/ros2/owl/tomasys.owl";
    let catalog = format!(
        "<catalog xmlns=\"urn:oasis:names:tc:entity:xmlns:xml:catalog\"><uri name=\"{url}\" uri=\"x/t.ttl\"/></catalog>"
    );
    let root = |import: &str| importing("http://e/root", &[import]);
    // Files, `true` if `lib` is searched, `true` if `c.xml` is given as a catalog, expected file.
    let cases = [
        (vec![("a.ttl", root("b.ttl")), ("b.ttl", tomasys.clone())], false, false, Some("b.ttl")),
        (
            vec![("a.ttl", root("http://metacontrol.example/tomasys")), ("b.owl", tomasys.clone())],
            false,
            false,
            Some("b.owl"),
        ),
        (vec![("a.ttl", root(url)), ("tomasys.owl", tomasys.clone())], false, false, Some("tomasys.owl")),
        (
            vec![
                ("a.ttl", root(url)),
                ("lib/mc_mdl/tomasys.owl", tomasys.clone()),
                ("lib/a/tomasys.owl", importing("http://other/", &[])),
            ],
            true,
            false,
            Some("lib/mc_mdl/tomasys.owl"),
        ),
        (
            vec![("a.ttl", root(url)), ("x/t.ttl", tomasys.clone()), ("catalog-v001.xml", catalog.clone())],
            false,
            false,
            Some("x/t.ttl"),
        ),
        (
            vec![("a.ttl", root(url)), ("x/t.ttl", tomasys.clone()), ("c.xml", catalog.clone())],
            false,
            true,
            Some("x/t.ttl"),
        ),
        (vec![("a.ttl", root(url)), ("lib/other.owl", tomasys)], true, false, None),
    ];
    for (files, search, with_catalog, expected) in cases {
        let files: Vec<_> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
        let directory = directory(&files);
        let options = ReadOptions {
            catalogs: if with_catalog { vec![directory.path().join("c.xml")] } else { Vec::new() },
            directories: if search { vec![directory.path().join("lib")] } else { Vec::new() },
            ..ReadOptions::default()
        };
        let result = read_files(&[directory.path().join("a.ttl")], &options);
        if let Some(file) = expected {
            let ontology = result.unwrap_or_else(|errors| panic!("{file}: {errors:?}"));
            assert_eq!(ontology.sources.len(), 2, "{file}");
            assert!(ontology.sources[1].name.ends_with(file), "{}", ontology.sources[1].name);
        } else {
            let errors = result.expect_err("unresolved");
            let [error @ Error::UnresolvedImport { import, .. }] = &errors[..] else { panic!("{errors:?}") };
            assert_eq!(import, url);
            assert!(
                error.to_string().contains("name a directory that contains it (--directory), or a catalog"),
                "{error}"
            );
        }
    }
}

#[test]
fn catalogs_have_a_base_and_may_name_missing_files() {
    let catalog = |attributes: &str, uri: &str| {
        format!(
            "<?xml version=\"1.0\"?><catalog prefer=\"public\" {attributes} \
             xmlns=\"urn:oasis:names:tc:entity:xmlns:xml:catalog\"><uri name=\"http://e/b\" uri=\"{uri}\"/></catalog>"
        )
    };
    let files = [
        ("a.ttl", importing("http://e/a", &["http://e/b"])),
        ("x/y/t.ttl", importing("http://e/b", &[])),
        ("catalog-v001.xml", catalog("xml:base = 'x/y/'", "t.ttl")),
    ];
    let files = files.each_ref().map(|(name, text)| (*name, text.as_str()));
    let directory = directory(&files);
    let ontology =
        read_files(&[directory.path().join("a.ttl")], &ReadOptions::default()).expect("in the catalog");
    assert_eq!(ontology.sources.len(), 2);
    std::fs::write(directory.path().join("catalog-v001.xml"), catalog("", "missing.ttl")).expect("written");
    let errors = read_files(&[directory.path().join("a.ttl")], &ReadOptions::default()).expect_err("missing");
    let message = errors.to_string();
    assert!(message.contains("a catalog assigns it to ") && message.contains("missing.ttl"), "{message}");
    assert!(!message.contains("<uri"), "{message}");
}

#[test]
fn our_tomasys_is_found_without_any_file() {
    let text = importing("http://e/root", &["http://metacontrol.org/tomasys"]);
    let ontology = read_text(&text, "root", &ReadOptions::default()).expect("embedded");
    assert_eq!(ontology.sources[1].name, "http://metacontrol.org/tomasys");
}

/// A file or text does not import itself only because the imported URL ends with its name.
#[test]
fn documents_do_not_import_themselves_by_name() {
    let text = importing("http://me/robot", &["http://vendor.example/robot.owl"]);
    let files = directory(&[("kb/robot.owl", &text)]);
    for directories in [Vec::new(), vec![files.path().to_owned()]] {
        let options = ReadOptions { directories, ..ReadOptions::default() };
        let file = read_files(&[files.path().join("kb/robot.owl")], &options);
        for result in [file, read_text(&text, "robot.owl", &ReadOptions::default())] {
            let errors = result.expect_err("unresolved");
            assert!(matches!(&errors[..], [Error::UnresolvedImport { .. }]), "{errors:?}");
        }
    }
    // A copy of the document, for example an installed one, is not the import either.
    let files = directory(&[("kb/robot.owl", &text), ("share/robot.owl", &text)]);
    let options = ReadOptions { directories: vec![files.path().to_owned()], ..ReadOptions::default() };
    let errors = read_files(&[files.path().join("kb/robot.owl")], &options).expect_err("unresolved");
    assert!(matches!(&errors[..], [Error::UnresolvedImport { .. }]), "{errors:?}");
    let url = "https://raw.githubusercontent.com/meta-control/mc_mdl_tomasys/ros2/owl/tomasys.owl";
    let files = directory(&[("tomasys.owl", &importing("http://me/tomasys", &[url]))]);
    let ontology =
        read_files(&[files.path().join("tomasys.owl")], &ReadOptions::default()).expect("embedded");
    assert_eq!(ontology.sources[1].name, "http://metacontrol.org/tomasys");
    // Another document with this name is the import.
    let files = directory(&[("kb/robot.owl", &text), ("robot.owl", &importing("http://other/", &[]))]);
    let paths = ["kb/robot.owl", "robot.owl"].map(|name| files.path().join(name));
    assert_eq!(read_files(&paths, &ReadOptions::default()).expect("named alike").sources.len(), 2);
}

/// Two directories contain a document with equal bytes, but its relative IRIs denote other things.
#[test]
fn equal_texts_with_relative_iris_are_several_documents() {
    let main = "@prefix owl: <http://www.w3.org/2002/07/owl#> . <> a owl:Ontology ; owl:imports <parts.ttl> .\n\
        <http://e/Robot> a owl:Class . <#base> a <http://e/Robot> . [] a <http://e/Robot> .";
    let part = |name: &str| format!("<http://e/#{name}> a <http://e/Robot> .");
    let files = directory(&[
        ("r1/main.ttl", main),
        ("r2/main.ttl", main),
        ("r1/parts.ttl", &part("x")),
        ("r2/parts.ttl", &part("y")),
    ]);
    let paths = ["r1/main.ttl", "r2/main.ttl"].map(|name| files.path().join(name));
    let ontology = read_files(&paths, &ReadOptions::default()).expect("readable");
    let axioms = shown(&ontology).join("\n");
    for individual in ["/r1/main.ttl#base>", "/r2/main.ttl#base>", "<x>", "<y>"] {
        assert!(axioms.contains(individual), "{individual}: {axioms}");
    }
    assert_eq!(ontology.sources.len(), 4);
    // Without relative IRIs, the documents are copies, also of their blank nodes.
    let copy = "<http://e/Robot> a <http://www.w3.org/2002/07/owl#Class> . [] a <http://e/Robot> .";
    let files = directory(&[("r1/main.ttl", copy), ("r2/main.ttl", copy)]);
    let paths = ["r1/main.ttl", "r2/main.ttl"].map(|name| files.path().join(name));
    assert_eq!(read_files(&paths, &ReadOptions::default()).expect("readable").sources.len(), 1);
}

/// The header of a document is annotated, whether the document is the first one or another one.
#[test]
fn headers_of_all_documents_are_annotated() {
    let header = "<http://e/b> a <http://www.w3.org/2002/07/owl#Ontology> ; <http://d/license> <http://cc/> ; \
        <http://d/title> \"title\" .";
    let files = directory(&[("a.ttl", &importing("http://e/a", &[])), ("b.ttl", header)]);
    let paths = ["a.ttl", "b.ttl"].map(|name| files.path().join(name));
    let [first, second] = [[&paths[0], &paths[1]], [&paths[1], &paths[0]]]
        .map(|files| read_files(&files, &ReadOptions::default()).expect("readable"));
    assert_eq!(shown(&first), [""; 0]);
    assert_eq!(first.annotations.len(), 2, "{:?}", first.annotations);
    assert_eq!((&first.annotations, &first.entities), (&second.annotations, &second.entities));
}

/// IRIs contain some characters of paths only in percent-encoded form.
#[test]
fn imports_in_directories_with_special_characters_are_found() {
    let outside = directory(&[("c.ttl", &importing("http://e/c", &[]))]);
    let inside = outside.path().join("my robots, 100% [ü] #1");
    std::fs::create_dir(&inside).expect("a directory");
    let files = [
        ("a.ttl", importing("http://e/a", &["b d.ttl", "../c.ttl"])),
        ("b d.ttl", importing("http://e/b", &[])),
    ];
    for (name, text) in &files {
        std::fs::write(inside.join(name), text.replace("b d.ttl", "b%20d.ttl")).expect("a file");
    }
    let ontology = read_files(&[inside.join("a.ttl")], &ReadOptions::default()).expect("readable");
    let names: Vec<&str> =
        ontology.sources.iter().map(|source| source.name.rsplit(['/', '\\']).next().unwrap()).collect();
    assert_eq!(names, ["a.ttl", "b d.ttl", "c.ttl"]);
}

#[test]
fn cyclic_and_repeated_imports_terminate() {
    let (a, b) =
        (importing("http://e/a", &["b.ttl"]), importing("http://e/b", &["a.ttl", "http://e/a", "b.ttl"]));
    let directory = directory(&[("a.ttl", &a), ("b.ttl", &b)]);
    #[cfg(unix)]
    std::os::unix::fs::symlink(directory.path(), directory.path().join("loop")).expect("link");
    let files: Vec<PathBuf> =
        ["a.ttl", "b.ttl", "a.ttl"].iter().map(|name| directory.path().join(name)).collect();
    let options = ReadOptions { directories: vec![directory.path().to_owned()], ..ReadOptions::default() };
    let ontology = read_files(&files, &options).expect("finite");
    assert_eq!(ontology.sources.len(), 2);
}

#[test]
fn one_ontology_iri_twice_is_reported() {
    let text =
        |comment: &str| format!("{}\n<http://e/a#x> a owl:Class . # {comment}", importing("http://e/a", &[]));
    let directory = directory(&[("a.ttl", &text("one")), ("b.ttl", &text("two")), ("c.ttl", &text("two"))]);
    let files: Vec<PathBuf> =
        ["a.ttl", "b.ttl", "c.ttl"].iter().map(|name| directory.path().join(name)).collect();
    let ontology = read_files(&files, &ReadOptions::default()).expect("readable");
    assert_eq!(ontology.sources.len(), 2, "equal texts are one document");
    let [warning] = &warnings(&ontology)[..] else { panic!("{:?}", ontology.warnings) };
    assert!(warning.contains("both declare the ontology <http://e/a>; both are read"), "{warning}");
}

#[test]
fn owl_xml_literals_may_contain_comments_and_cdata_sections() {
    let text = "<Ontology xmlns=\"http://www.w3.org/2002/07/owl#\" ontologyIRI=\"http://e/\">\n\
        <Declaration><NamedIndividual IRI=\"http://e/#i\"/></Declaration><!-- <Declaration> -->\n\
        <Declaration><DataProperty IRI=\"http://e/#d\"/></Declaration>\n\
        <DataPropertyAssertion><DataProperty IRI=\"http://e/#d\"/><NamedIndividual IRI=\"http://e/#i\"/>\
        <Literal>a &amp; <![CDATA[</b> ]> & 'c]]><!-- no --> d</Literal></DataPropertyAssertion>\n</Ontology>";
    let ontology = read_text(text, "document", &ReadOptions::default()).unwrap_or_else(|e| panic!("{e:?}"));
    assert_eq!(shown(&ontology), ["DataPropertyAssertion(<d> <i> \"a & </b> ]> & 'c d\")"]);
}

#[test]
fn the_fast_path_for_ntriples_checks_the_grammar() {
    let read = |subject: &str, object: &str| {
        read_text(&format!("{subject} <http://e/p> {object} .\n"), "t.nt", &ReadOptions::default())
    };
    for (subject, object) in [
        ("<http://e/a b>", "<http://e/b>"),
        ("<http://e/a>", "<http://e/b|c>"),
        ("<http://e/a>", "<_:b>"),
        ("<_:a>", "<http://e/b>"),
        ("<http://e/a>", "\"x\"@toolonglanguage"),
        ("<http://e/a>", "\"x\"^^<http://www.w3.org/1999/02/22-rdf-syntax-ns#langString>"),
        ("<http://e/a>", "\"x\ny\""),
        ("<http://e/a>", "\"x\\uD800\""),
        ("<http://e/a>", "\"x\"^^<http://e/ b>"),
    ] {
        let errors = read(subject, object).expect_err(object);
        assert!(errors[0].to_string().starts_with("t.nt:1:"), "{subject} {object}: {}", errors[0]);
    }
    for (object, expected) in [
        ("\"x\"@en", "DataPropertyAssertion(<http://e/p> <http://e/a> \"x\"@en)"),
        ("\"x\\ny\"", "DataPropertyAssertion(<http://e/p> <http://e/a> \"x\ny\")"),
        ("<http://e/\\u0041>", "ObjectPropertyAssertion(<http://e/p> <http://e/a> <http://e/A>)"),
        ("<b>", "ObjectPropertyAssertion(<http://e/p> <http://e/a> <file:///b>)"),
    ] {
        let ontology = read("<http://e/a>", object).expect(object);
        let axioms: Vec<String> =
            ontology.axioms.iter().map(|annotated| annotated.axiom.to_string()).collect();
        assert_eq!(axioms, [expected]);
    }
}

#[test]
fn annotation_properties_have_no_logical_axioms() {
    let head = "@prefix : <http://e.org/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> . \
        @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . \
        <http://e.org/> a owl:Ontology . :n a owl:AnnotationProperty . :C a owl:Class . :D a owl:Class . :i a :C .\n";
    let restriction = "[ a owl:Restriction ; owl:onProperty :n ; owl:allValuesFrom xsd:string ]";
    for text in [
        ":n owl:equivalentProperty :m . :m a owl:AnnotationProperty . :C rdfs:subClassOf :D .".to_owned(),
        format!(":C rdfs:subClassOf :D , {restriction} ."),
        format!(
            ":C rdfs:subClassOf :D ; owl:equivalentClass [ a owl:Class ; owl:intersectionOf ( :D {restriction} ) ] ."
        ),
    ] {
        let ontology = read_text(&format!("{head}{text}"), "text.ttl", &ReadOptions::default());
        let ontology = ontology.unwrap_or_else(|errors| panic!("{errors}\n{text}"));
        let axioms: Vec<String> =
            ontology.axioms.iter().map(|annotated| annotated.axiom.to_string()).collect();
        assert_eq!(axioms.len(), 2, "{axioms:?}");
        let warned =
            |warning: &Warning| warning.to_string().contains("annotation property has no logical axioms");
        assert!(ontology.warnings.iter().any(warned), "{text}: {:?}", ontology.warnings);
    }
}

#[test]
fn rules_with_a_restriction_of_an_annotation_property_are_reported() {
    let head = "@prefix : <http://e.org/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> . \
        @prefix swrl: <http://www.w3.org/2003/11/swrl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . \
        @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . <http://e.org/> a owl:Ontology . :n a owl:AnnotationProperty . :C a owl:Class . :D a owl:Class . \
        :x a swrl:Variable .\n";
    let restriction = "[ a owl:Restriction ; owl:onProperty :n ; owl:allValuesFrom xsd:string ]";
    let atom =
        |class: &str| format!("[ a swrl:ClassAtom ; swrl:classPredicate {class} ; swrl:argument1 :x ]");
    let (plain, annotative) = (atom(":C"), atom(restriction));
    for (body, conclusion) in [(&annotative, &plain), (&plain, &annotative)] {
        for rule in
            [":rule a swrl:Imp, owl:NamedIndividual ; rdfs:label \"R\"", "[] a swrl:Imp ; rdfs:label \"R\""]
        {
            let text = format!("{head}{rule} ; swrl:body ( {plain} {body} ) ; swrl:head ( {conclusion} ) .");
            let ontology = read_text(&text, "text.ttl", &ReadOptions::default());
            let ontology = ontology.unwrap_or_else(|errors| panic!("{errors}\n{text}"));
            assert!(ontology.rules.is_empty(), "{text}: {:?}", ontology.rules);
            let warned = |warning: &&Warning| {
                let shown = warning.to_string();
                shown.starts_with("warning[O203]: rule <http://e.org/>#0 (R) is left out")
                    && shown.contains("a restriction of an annotation property")
            };
            assert_eq!(ontology.warnings.iter().filter(warned).count(), 1, "{text}: {:?}", ontology.warnings);
        }
    }
}
