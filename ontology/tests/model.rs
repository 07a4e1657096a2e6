//! Lints for models: reported mistakes, and models without mistakes.

use ontology::{Equality, Ontology, ReadOptions, kb, lower, read_files, read_text, tomasys};
use rules::{Engine, Symbols};
use test_resources::data;

const HEAD: &str = "@prefix t: <http://metacontrol.org/tomasys#> .\n\
    @prefix owl: <http://www.w3.org/2002/07/owl#> .\n@prefix : <http://x#> .\n\
    @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n\
    @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n\
    @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n\
    <urn:model> a owl:Ontology ; owl:imports <http://metacontrol.org/tomasys> .\n\
    :f a t:Function . :fd a t:FunctionDesign ; t:solvesF :f .\n";

fn warnings(ontology: &Ontology) -> Vec<String> {
    let mut symbols = Symbols::new();
    let lowered = lower(ontology, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules");
    tomasys::check(ontology, &engine, Equality::Owl).iter().map(ToString::to_string).collect()
}

fn check(model: &str, expected: &[&str]) {
    let text = format!("{HEAD}{model}");
    let reported = warnings(&read_text(&text, "model.ttl", &ReadOptions::default()).expect("well-formed"));
    assert_eq!(reported.len(), expected.len(), "{model}: {reported:#?}");
    for (reported, expected) in reported.iter().zip(expected) {
        assert!(reported.starts_with(expected), "{model}: {reported}");
    }
}

#[test]
fn mistakes_are_reported() {
    check("", &[]);
    check(
        ":fe a t:FunctionDesign .",
        &["warning[O401]: the function design <http://x#fe> solves no function"],
    );
    check(":g a t:Function .", &["warning[O402]: no function design solves the function <http://x#g>"]);
    check(":r a t:Requirement .", &["warning[O403]: the requirement <http://x#r> has no value"]);
    check(":r a t:Requirement ; t:hasMinimum 1 .", &[]);
    check(
        ":o a t:Objective ; t:hasNFR :n . :n a t:QAvalue .",
        &["warning[O403]: the requirement <http://x#n>"],
    );
    check(":o a t:Objective ; t:hasNFR :n . :n a t:QAvalue ; t:hasValue 1 .", &[]);
    check(
        ":v a t:QAvalue ; t:hasValue 1 , 2.5 .",
        &[
            "warning[O404]: <http://x#v> has 2 values of <http://metacontrol.org/tomasys#hasValue>, which is functional",
        ],
    );
    check(":v a t:QAvalue ; t:hasValue 1 , 1.0 .", &[]);
    // The values of an undefined datatype, or of XML, may be equal.
    for (values, contradict) in [
        ("\"a\" , \"b\"", true),
        ("\"a\"^^:D , \"b\"^^:D", false),
        ("\"a\"^^:D , \"b\"^^:D , 1 , 2", true),
        ("\"<a/>\"^^rdf:XMLLiteral , \"<b/>\"^^rdf:XMLLiteral", false),
    ] {
        let text = format!("{HEAD}:d a owl:DatatypeProperty , owl:FunctionalProperty . :i :d {values} .");
        let reported =
            warnings(&read_text(&text, "model.ttl", &ReadOptions::default()).expect("well-formed"));
        let [warning] = &reported[..] else { panic!("{reported:?}") };
        assert!(warning.starts_with("warning[O404]"), "{warning}");
        let end = if contradict {
            "; this is a contradiction"
        } else {
            "; whether these are one value is not decided"
        };
        assert!(warning.ends_with(end), "{warning}");
    }
    check(
        ":g a t:Function . :fd t:solvesF :g .",
        &["warning[O404]: <http://x#fd> has 2 values of <http://metacontrol.org/tomasys#solvesF>"],
    );
    let attribute = ":q a t:QualityAttributeType ; t:qa_comparison_operator \"<\" .
        :e a t:QAvalue ; t:isQAtype :q ; t:hasValue 2 . :fd t:hasQAestimation :e .";
    check(":q a t:QualityAttributeType ; t:qa_comparison_operator \"<\" .", &[]);
    check(attribute, &["warning[O405]: <http://x#q> is compared with a measured value"]);
    check(&format!("{attribute} :obs_q a t:QAvalue ; t:isQAtype :q ; t:hasValue 1 ."), &[]);
    check(
        ":q a t:QualityAttributeType . :r a t:Requirement ; t:isQAtype :q ; t:hasMinimum 1 . :fd t:hasRequirement :r .",
        &["warning[O405]: <http://x#q>"],
    );
    check(
        ":c a t:Component ; t:c_status false .",
        &["warning[O406]: <http://x#c> has the status \"false\"^^<http://www.w3.org/2001/XMLSchema#boolean>"],
    );
    check(":c a t:Component ; t:c_status \"FALSE\" .", &[]);
}

/// The metamodel declares a boolean, and the model states a string, as in the first generation of knowledge
/// bases.
#[test]
fn a_string_status_instead_of_a_boolean_is_reported() {
    let model = "@prefix t: <http://metacontrol.org/tomasys#> .\n\
        @prefix owl: <http://www.w3.org/2002/07/owl#> .\n\
        @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n\
    @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n\
        @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n\
        <urn:model> a owl:Ontology . t:Component a owl:Class .\n\
        t:c_status a owl:DatatypeProperty ; rdfs:range xsd:boolean .\n\
        <http://x#c> a t:Component ; t:c_status \"FALSE\" .";
    let reported = warnings(&read_text(model, "model.ttl", &ReadOptions::default()).expect("well-formed"));
    let [warning] = &reported[..] else { panic!("{reported:?}") };
    assert!(warning.contains("\"FALSE\"") && warning.contains("a boolean is expected"), "{warning}");
    for (range, count) in
        [("xsd:token", 0), ("xsd:anyURI", 0), ("xsd:dateTime", 0), ("t:custom", 0), ("xsd:byte", 1)]
    {
        let model = format!("{} t:custom a rdfs:Datatype .", model.replace("xsd:boolean", range));
        let reported =
            warnings(&read_text(&model, "model.ttl", &ReadOptions::default()).expect("well-formed"));
        assert_eq!(reported.len(), count, "{range}: {reported:?}");
    }
}

#[test]
fn our_own_models_have_no_mistakes() {
    for (text, name) in [(kb::TOMASYS, "tomasys.ttl"), (kb::UGV, "ugv.ttl"), (kb::UUV, "uuv.ttl")] {
        let ontology = read_text(text, name, &ReadOptions::default()).expect("well-formed");
        assert_eq!(warnings(&ontology), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn models_in_use_have_only_known_warnings() {
    let Some(real) = data("real/owl") else { return };
    for (file, expected) in [
        ("suave/suave.owl", &["O405"][..]),
        ("navigation_planta/navigation.owl", &[]),
        ("mc_mros_reasoner/kb.owl", &[]),
    ] {
        let options = ReadOptions { directories: vec![real.clone()], ..ReadOptions::default() };
        let reported = warnings(&read_files(&[real.join(file)], &options).expect("readable"));
        let codes: Vec<_> = reported.iter().map(|warning| &warning[8..12]).collect();
        assert_eq!(codes, expected, "{file}: {reported:#?}");
    }
}
