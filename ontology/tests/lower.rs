//! Rules for axioms: conclusions and contradictions of each kind of axiom, and warnings about axioms that are
//! not used in full.

use std::collections::BTreeSet;

use ontology::{
    AXIOM_SOURCE, Equality, ReadOptions, Warning, lower, lower_together, lower_with, ntriples, read_files,
    read_text,
};
use rules::{Engine, Fact, Literal, Prefixes, Symbols, parse_rules};

const PREFIXES: &str = "@prefix : <http://e/#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
:A a owl:Class . :B a owl:Class . :C a owl:Class .
:p a owl:ObjectProperty . :q a owl:ObjectProperty . :r a owl:ObjectProperty .
:d a owl:DatatypeProperty . :e a owl:DatatypeProperty .
";

fn engine(text: &str) -> (Engine, Vec<String>) {
    let ontology =
        read_text(&format!("{PREFIXES}{text}"), "t", &ReadOptions::default()).expect("well-formed");
    assert_eq!(ontology.warnings, [], "{text}");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    // A summary accompanies warnings about axioms that are not used in full, except about single values.
    let (summaries, warnings): (Vec<_>, Vec<_>) = lowered.warnings.iter().partition(|w| w.code() == "O304");
    let is_axiom = |warning: &&Warning| {
        warning.code() == "O301" && !warning.to_string().contains("a value beyond the limits")
    };
    assert_eq!(summaries.is_empty(), !warnings.iter().any(is_axiom), "{text}");
    let warnings = warnings.iter().map(ToString::to_string).collect();
    (Engine::new(symbols, lowered.program, lowered.facts).expect("safe"), warnings)
}

fn derived(engine: &Engine) -> BTreeSet<String> {
    let facts: Vec<Fact> = engine.facts().filter(|fact| !engine.is_asserted(fact)).collect();
    let text = ntriples(engine.symbols(), &facts);
    let short =
        text.replace("http://www.w3.org/1999/02/22-rdf-syntax-ns#type", "a").replace("http://e/#", "");
    let short = short.replace("http://www.w3.org/2002/07/owl#", "owl:");
    short.lines().map(|line| line.trim_end_matches(" .").replace(['<', '>'], "")).collect()
}

#[test]
fn axioms_have_their_conclusions() {
    for (text, expected) in [
        (":A rdfs:subClassOf :B . :B rdfs:subClassOf :C . :i a :A .", &["i a B", "i a C"][..]),
        (":A owl:equivalentClass :B . :i a :A . :j a :B .", &["i a B", "j a A"]),
        (
            ":A rdfs:subClassOf [ a owl:Class ; owl:intersectionOf ( :B :C ) ] . :i a :A .",
            &["i a B", "i a C"],
        ),
        (
            "[ a owl:Class ; owl:intersectionOf ( :B :C ) ] rdfs:subClassOf :A . :i a :B , :C . :j a :B .",
            &["i a A"],
        ),
        (
            "[ a owl:Class ; owl:unionOf ( :B :C ) ] rdfs:subClassOf :A . :i a :B . :j a :C .",
            &["i a A", "j a A"],
        ),
        (
            "[ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom :B ] rdfs:subClassOf :A . :i :p :j . :j a :B .",
            &["i a A"],
        ),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:allValuesFrom :B ] . :i a :A ; :p :j .",
            &["j a B"],
        ),
        (
            ":A owl:equivalentClass [ a owl:Restriction ; owl:onProperty :p ; owl:hasValue :j ] . :i a :A . :k :p :j .",
            &["i p j", "k a A"],
        ),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :d ; owl:hasValue 1 ] . :i a :A .",
            &["i d \"1\"^^http://www.w3.org/2001/XMLSchema#integer"],
        ),
        (
            "[ a owl:Class ; owl:oneOf ( :i :j ) ] rdfs:subClassOf :A . :i a owl:NamedIndividual .",
            &["i a A", "j a A"],
        ),
        (":i a [ a owl:Restriction ; owl:onProperty :p ; owl:hasValue :j ] .", &["i p j"]),
        (":p rdfs:subPropertyOf :q . :i :p :j .", &["i q j"]),
        (":p rdfs:subPropertyOf owl:topObjectProperty . :i :p :j .", &[]),
        (":d rdfs:subPropertyOf :e . :i :d \"v\" .", &["i e \"v\""]),
        (":p owl:equivalentProperty :q . :i :p :j . :j :q :i .", &["i q j", "j p i"]),
        (":p owl:inverseOf :q . :i :p :j .", &["j q i"]),
        (":p a owl:SymmetricProperty . :i :p :j .", &["j p i"]),
        (":p a owl:TransitiveProperty . :i :p :j . :j :p :k .", &["i p k"]),
        (":r owl:propertyChainAxiom ( :p :q ) . :i :p :j . :j :q :k .", &["i r k"]),
        (":p rdfs:domain :A ; rdfs:range :B . :i :p :j .", &["i a A", "j a B"]),
        (":d rdfs:domain :A . :i :d 1 .", &["i a A"]),
        (":p a owl:ReflexiveProperty . :i a owl:NamedIndividual . :j :q :k .", &["i p i", "j p j", "k p k"]),
        ("owl:Thing rdfs:subClassOf :A . :i a owl:NamedIndividual . :j :d 1 .", &["i a A", "j a A"]),
        ("owl:topObjectProperty rdfs:domain :A . :i a owl:Thing .", &["i a A"]),
        (":A owl:sameAs :B . :i a :A .", &["B owl:sameAs A", "i a B"]),
        (":p owl:sameAs :q . :i :p :j .", &["i q j", "q owl:sameAs p"]),
        (
            ":p a owl:FunctionalProperty . :i :p :j , :k . :j a :A .",
            &["j owl:sameAs k", "k a A", "k owl:sameAs j"],
        ),
        (
            ":p a owl:InverseFunctionalProperty . :i :p :k . :j :p :k . :j :d 1 .",
            &["i d \"1\"^^http://www.w3.org/2001/XMLSchema#integer", "i owl:sameAs j", "j owl:sameAs i"],
        ),
        (":i owl:sameAs :j . :i a :A .", &["j a A", "j owl:sameAs i"]),
        (
            ":A owl:hasKey ( :d ) . :i a :A ; :d 1 . :j a :A ; :d 1.0 . :k a :A ; :d 2 .",
            &["i owl:sameAs j", "j owl:sameAs i"],
        ),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:maxCardinality 1 ] . :i a :A ; :p :j , :k . :j a :B .",
            &["j owl:sameAs k", "k a B", "k owl:sameAs j"],
        ),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:maxQualifiedCardinality 1 ; owl:onClass :B ] . :i a :A ; :p :j , :k , :l . :j a :B . :k a :B . :l a :C .",
            &["j owl:sameAs k", "k owl:sameAs j"],
        ),
        (
            "[ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom owl:Thing ] rdfs:subClassOf :A . :i :p :j .",
            &["i a A"],
        ),
    ] {
        let (engine, warnings) = engine(text);
        assert_eq!(engine.violations(), [], "{text}");
        assert_eq!(warnings, [""; 0], "{text}");
        assert_eq!(derived(&engine), expected.iter().map(ToString::to_string).collect(), "{text}");
    }
}

#[test]
fn values_beyond_the_limits_are_no_contradiction() {
    let range = ":d rdfs:range xsd:date . :i :d ";
    let (limited, warnings) = engine(&format!("{range}\"12345678901-01-01\"^^xsd:date ."));
    assert!(limited.violations().is_empty());
    assert!(matches!(&warnings[..], [warning] if warning.contains("beyond the limits")), "{warnings:?}");
    let (invalid, warnings) = engine(&format!("{range}\"12345678901-02-29\"^^xsd:date ."));
    assert!(!invalid.violations().is_empty());
    assert_eq!(warnings, [""; 0]);
}

#[test]
fn axioms_forbid() {
    let restricted = |range: &str| format!(":d rdfs:range {range} . :i :d ");
    let bounded =
        "[ a rdfs:Datatype ; owl:onDatatype xsd:integer ; owl:withRestrictions ( [ xsd:minInclusive 2 ] ) ]";
    for (axioms, consistent, inconsistent) in [
        (":A owl:disjointWith :B . :i a :A . ", ":i a :C .", ":i a :B ."),
        (
            ":d rdfs:range [ a rdfs:Datatype ; owl:unionOf ( xsd:integer [ a rdfs:Datatype ; owl:oneOf ( \"a\" ) ] ) ] . ",
            ":i :d \"a\" , 1 .",
            ":i :d \"b\" .",
        ),
        // NaN is within no bound.
        (
            ":d rdfs:range [ a rdfs:Datatype ; owl:onDatatype xsd:double ; \
             owl:withRestrictions ( [ xsd:maxInclusive \"INF\"^^xsd:double ] ) ] . ",
            ":i :d \"INF\"^^xsd:double .",
            ":i :d \"NaN\"^^xsd:double .",
        ),
        ("[] a owl:AllDisjointClasses ; owl:members ( :A :B :C ) . :i a :A . ", "", ":i a :C ."),
        (":A rdfs:subClassOf [ a owl:Class ; owl:complementOf :B ] . :i a :A . ", "", ":i a :B ."),
        (":A rdfs:subClassOf owl:Nothing . ", ":i a :B .", ":i a :A ."),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:maxCardinality 0 ] . :i a :A . ",
            ":j :p :i .",
            ":i :p :j .",
        ),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:maxQualifiedCardinality 0 ; owl:onClass :B ] . :i a :A ; :p :j . ",
            ":j a :C .",
            ":j a :B .",
        ),
        (":p owl:propertyDisjointWith :q . :i :p :j . ", ":j :q :i .", ":i :q :j ."),
        (":p a owl:IrreflexiveProperty . ", ":i :p :j .", ":i :p :i ."),
        (":p a owl:AsymmetricProperty . :i :p :j . ", ":j :p :k .", ":j :p :i ."),
        (
            "[] a owl:NegativePropertyAssertion ; owl:sourceIndividual :i ; owl:assertionProperty :p ; owl:targetIndividual :j . ",
            ":j :p :i .",
            ":i :p :j .",
        ),
        (
            "[] a owl:NegativePropertyAssertion ; owl:sourceIndividual :i ; owl:assertionProperty :d ; owl:targetValue 1 . ",
            ":i :d 2 .",
            ":i :d 1.0 .",
        ),
        (":d a owl:FunctionalProperty . :i :d 1 . ", ":i :d 1.0 .", ":i :d 2 ."),
        (":d a owl:FunctionalProperty . :i :d 0.2 . ", ":j :d 5 .", ":i :d 5.0 ."),
        (":i owl:differentFrom :j . :p a owl:FunctionalProperty . :k :p :i . ", "", ":k :p :j ."),
        ("[] a owl:AllDifferent ; owl:distinctMembers ( :i :j :k ) . ", "", ":k owl:sameAs :i ."),
        (&restricted("xsd:decimal"), "2 .", "\"2\" ."),
        (&restricted("xsd:decimal"), "2.5 .", "\"2\"^^xsd:float ."),
        (&restricted("xsd:integer"), "2.0 .", "2.5 ."),
        (&restricted("xsd:nonNegativeInteger"), "0 .", "-1 ."),
        (&restricted("xsd:boolean"), "\"0\"^^xsd:boolean .", "\"false\" ."),
        (&restricted("xsd:string"), "\"x\"^^xsd:string .", "true ."),
        (&restricted("[ a rdfs:Datatype ; owl:oneOf ( \"OK\" \"ERROR\" ) ]"), "\"OK\" .", "\"ok\" ."),
        (&restricted(bounded), "2 .", "1 ."),
        (&restricted("[ a rdfs:Datatype ; owl:unionOf ( xsd:integer xsd:string ) ]"), "\"x\" .", "true ."),
        (
            &restricted("[ a rdfs:Datatype ; owl:intersectionOf ( xsd:integer xsd:nonNegativeInteger ) ]"),
            "0 .",
            "-1 .",
        ),
        (&restricted("[ a rdfs:Datatype ; owl:datatypeComplementOf xsd:string ]"), "true .", "\"x\" ."),
        (
            &restricted(
                "[ a rdfs:Datatype ; owl:datatypeComplementOf [ a rdfs:Datatype ; owl:oneOf ( 1 2 ) ] ]",
            ),
            "3 .",
            "2.0 .",
        ),
        (
            &restricted("xsd:dateTime"),
            "\"2026-01-01T00:00:00Z\"^^xsd:dateTime .",
            "\"2026-01-01\"^^xsd:date .",
        ),
        (&restricted("xsd:float"), "\"1.5\"^^xsd:float .", "1.5 ."),
        (&restricted("xsd:double"), "1.5e0 .", "\"1.5\"^^xsd:float ."),
        (&restricted("xsd:byte"), "127 .", "128 ."),
        (&restricted("xsd:unsignedInt"), "4294967295 .", "4294967296 ."),
        (&restricted("xsd:anyURI"), "\"http://x\"^^xsd:anyURI .", "\"http://x\" ."),
        (&restricted("owl:real"), "1.5 .", "1.5e0 ."),
        (&restricted("rdf:PlainLiteral"), "\"x\"@en .", "1 ."),
        (":u a rdfs:Datatype ; owl:equivalentClass xsd:byte . :d rdfs:range :u . :i :d ", "1 .", "1000 ."),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :d ; owl:allValuesFrom xsd:float ] . :i a :A ; :d ",
            "\"1\"^^xsd:float .",
            "1 .",
        ),
        (":d rdfs:range xsd:boolean . :i :d ", "true .", "\"False\"^^xsd:boolean ."),
    ] {
        for (assertion, expected) in [(consistent, true), (inconsistent, false)] {
            let (engine, warnings) = engine(&format!("{axioms}{assertion}"));
            assert_eq!(engine.violations().is_empty(), expected, "{axioms}{assertion}");
            assert_eq!(warnings, [""; 0], "{axioms}");
        }
    }
}

#[test]
fn axioms_without_a_rule_form_are_reported_once() {
    for (text, expected) in [
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom :B ] .",
            "SubClassOf(<http://e/#A> ObjectSomeValuesFrom(<http://e/#p> <http://e/#B>)) is left out \
             (an existential restriction as a conclusion)",
        ),
        (
            ":u a rdfs:Datatype . :d rdfs:range :u .",
            "DataPropertyRange(<http://e/#d> <http://e/#u>) is left out (a datatype whose values are not known)",
        ),
        (
            ":d rdfs:range [ a rdfs:Datatype ; owl:onDatatype xsd:string ; owl:withRestrictions ( [ xsd:pattern \"a*\" ] ) ] .",
            "DataPropertyRange(<http://e/#d> DatatypeRestriction(<http://www.w3.org/2001/XMLSchema#string> \
             <http://www.w3.org/2001/XMLSchema#pattern> \"a*\")) is left out (a facet other than a bound)",
        ),
        (
            ":A owl:disjointUnionOf ( :B :C ) .",
            "DisjointUnion(<http://e/#A> <http://e/#B> <http://e/#C>) is used in part (that the parts cover the class)",
        ),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:qualifiedCardinality \
             \"1\"^^xsd:nonNegativeInteger ; owl:onClass :B ] .",
            "SubClassOf(<http://e/#A> ObjectExactCardinality(1 <http://e/#p> <http://e/#B>)) is used in part \
             (an existential restriction as a conclusion)",
        ),
    ] {
        let (_, warnings) = engine(text);
        let [warning] = &warnings[..] else { panic!("{text}: {warnings:?}") };
        assert!(warning.starts_with(&format!("warning[O301]: {expected}")), "{warning}");
    }
}

#[test]
fn axioms_are_used_in_part() {
    let some = "[ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom :C ]";
    let not = "[ a owl:Class ; owl:complementOf :C ]";
    for (text, expected) in [
        (
            format!(":A owl:equivalentClass [ a owl:Class ; owl:intersectionOf ( :B {some} ) ] . :i a :A . :j a :B ; :p :k . :k a :C ."),
            &["i a B", "j a A"][..],
        ),
        (format!("[ a owl:Class ; owl:unionOf ( :B {not} ) ] rdfs:subClassOf :A . :i a :B ."), &["i a A"]),
        (
            ":A rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :p ; owl:cardinality \"1\"^^xsd:nonNegativeInteger ] .
             :i a :A ; :p :j , :k ."
                .to_owned(),
            &["j owl:sameAs k", "k owl:sameAs j"],
        ),
    ] {
        let (engine, warnings) = engine(&text);
        assert_eq!(derived(&engine), expected.iter().map(ToString::to_string).collect(), "{text}");
        let [warning] = &warnings[..] else { panic!("{text}: {warnings:?}") };
        assert!(warning.contains("is used in part"), "{warning}");
    }
}

/// An axiom concludes a restriction, whose value has no name, and another axiom has a restriction as a
/// condition. The condition holds exactly if it includes the concluded restriction (rules scm-svf1, -svf2,
/// -avf1, -avf2).
#[test]
fn restrictions_include_restrictions() {
    let restricted = |kind: &str, property: &str, class: &str| {
        format!("[ a owl:Restriction ; owl:onProperty {property} ; owl:{kind} {class} ]")
    };
    let some = |property: &str, class: &str| restricted("someValuesFrom", property, class);
    let every = |property: &str, class: &str| restricted("allValuesFrom", property, class);
    let inverse = |property: &str| format!("[ owl:inverseOf {property} ]");
    let base =
        ":B rdfs:subClassOf :C . :p rdfs:subPropertyOf :q . :D a owl:Class . :E a owl:Class . :i a :A .";
    let not_included = &["i a A2"][..];
    let included = &["i a A2", "i a D"][..];
    for (concluded, condition, expected) in [
        (some(":p", ":B"), some(":p", ":C"), included),
        (some(":p", ":B"), some(":q", ":B"), included),
        (some(":p", ":B"), some(":q", ":C"), included),
        (some(":p", ":B"), some(":p", ":B"), included),
        (some(":p", ":B"), some(":q", "owl:Thing"), included),
        (some(":p", ":C"), some(":p", ":B"), not_included),
        (some(":q", ":B"), some(":p", ":B"), not_included),
        (some(":r", ":B"), some(":p", ":B"), not_included),
        (some(&inverse(":p"), ":B"), some(&inverse(":q"), ":C"), included),
        (some(&inverse(":p"), ":B"), some(":q", ":C"), not_included),
        (some(":p", &some(":p", ":B")), some(":q", &some(":q", ":C")), included),
        (some(":p", &some(":p", ":C")), some(":q", &some(":q", ":B")), not_included),
        (
            some(":p", "[ a owl:Class ; owl:intersectionOf ( :B :E ) ]"),
            some(":p", "[ a owl:Class ; owl:unionOf ( :C :E ) ]"),
            included,
        ),
        (
            restricted("minCardinality", ":p", "\"2\"^^xsd:nonNegativeInteger"),
            some(":q", "owl:Thing"),
            included,
        ),
        (every(":q", ":B"), every(":p", ":C"), included),
        (every(":p", ":B"), every(":p", ":C"), included),
        (every(":p", ":B"), every(":q", ":C"), not_included),
        (every(":p", ":C"), every(":p", ":B"), not_included),
        (every(":p", ":B"), some(":p", ":B"), not_included),
    ] {
        let text = format!(
            "{base} :A2 a owl:Class . :A rdfs:subClassOf :A2 . :A2 rdfs:subClassOf {concluded} . {condition} rdfs:subClassOf :D ."
        );
        let (engine, warnings) = engine(&text);
        assert_eq!(engine.violations(), [], "{text}");
        assert!(warnings.iter().all(|warning| warning.contains("O301")), "{warnings:?}");
        assert_eq!(derived(&engine), expected.iter().map(ToString::to_string).collect(), "{text}");
    }
}

/// Long chains of restrictions are compared without recursion along the chain.
#[test]
#[allow(clippy::format_push_string)]
fn chains_of_restrictions_are_lowered() {
    let some =
        |class: usize| format!("[ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom :N{class} ]");
    let size = 3_000;
    let mut text = String::from(":i a :N1 . ");
    for class in 0..size {
        text += &format!(
            ":N{class} a owl:Class ; rdfs:subClassOf :N{} , {} . ",
            class / 2,
            some((class + 1) % size)
        );
    }
    text += &format!("{} rdfs:subClassOf :A . {} rdfs:subClassOf :B . ", some(1), some(1_500));
    text += &format!(
        "[ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom {} ] rdfs:subClassOf :C .",
        some(1)
    );
    let (engine, _) = engine(&text);
    assert_eq!(derived(&engine), BTreeSet::from(["i a A", "i a C", "i a N0"].map(str::to_owned)));
}

#[test]
fn definitions_by_restrictions_have_no_auxiliary_relation() {
    let definition =
        ":A owl:equivalentClass [ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom :B ] .";
    let (engine, _) = engine(&format!("{definition} :i :p :j . :j a :B ."));
    assert_eq!(derived(&engine), BTreeSet::from(["i a A".to_owned()]));
    let texts: Vec<String> = engine.facts().map(|fact| fact.display(engine.symbols()).to_string()).collect();
    assert!(texts.iter().all(|text| !text.contains("restriction")), "{texts:?}");
}

#[test]
fn unusable_rules_are_reported_and_the_others_kept() {
    let prefixes = "@prefix swrl: <http://www.w3.org/2003/11/swrl#> . @prefix swrlb: <http://www.w3.org/2003/11/swrlb#> .
        :x a swrl:Variable . :y a swrl:Variable . :i a :A . ";
    let class = |class: &str, x: &str| {
        format!("[ a swrl:ClassAtom ; swrl:classPredicate {class} ; swrl:argument1 {x} ]")
    };
    let built_in =
        |name: &str| format!("[ a swrl:BuiltinAtom ; swrl:builtin {name} ; swrl:arguments ( :y 2 ) ]");
    let rule =
        |body: &str, head: &str| format!("[] a swrl:Imp ; swrl:body ( {body} ) ; swrl:head ( {head} ) . ");
    let (a, b) = (class(":A", ":x"), class(":B", ":x"));
    let good = rule(&a, &b);
    for (bad, reason) in [
        (rule(&a, &class(":B", ":y")), "is left out: R202"),
        (rule(&format!("{a} {}", built_in("swrlb:lessThan")), &b), "is left out: R203"),
        (
            rule(&format!("{a} {}", built_in("<http://custom/#f>")), &b),
            "is left out: the built-in <http://custom/#f> is not known",
        ),
        (
            rule(&format!("{a} {}", built_in("swrlb:lesThan")), &b),
            "is left out: the built-in <http://www.w3.org/2003/11/swrlb#lesThan> is not known; did you mean `lessThan`?",
        ),
    ] {
        let (engine, warnings) = engine(&format!("{prefixes}{bad}{good}"));
        assert_eq!(derived(&engine), BTreeSet::from(["i a B".to_owned()]));
        let [warning] = &warnings[..] else { panic!("{warnings:?}") };
        assert!(warning.starts_with("warning[O302]: rule <t>#0 ") && warning.contains(reason), "{warning}");
    }
}

/// An axiom has the same condition as an unusable rule, and keeps its conclusions.
#[test]
fn unusable_rules_do_not_take_conclusions_of_axioms_with_them() {
    let some = "[ a owl:Restriction ; owl:onProperty :p ; owl:someValuesFrom :C ]";
    let axioms = format!(":B rdfs:subClassOf {some} . {some} rdfs:subClassOf :A . :i :p :j . :j a :C . ");
    let prefixes =
        "@prefix swrl: <http://www.w3.org/2003/11/swrl#> . :x a swrl:Variable . :y a swrl:Variable . ";
    let class = |class: &str, x: &str| {
        format!("[ a swrl:ClassAtom ; swrl:classPredicate {class} ; swrl:argument1 {x} ]")
    };
    let unknown = "[ a swrl:BuiltinAtom ; swrl:builtin <http://custom/#f> ; swrl:arguments ( :x 2 ) ]";
    for (built_in, conclusion) in [(unknown, class(":B", ":x")), ("", class(":B", ":y"))] {
        let condition = class(some, ":x");
        let rule =
            format!("[] a swrl:Imp ; swrl:body ( {condition} {built_in} ) ; swrl:head ( {conclusion} ) .");
        let (engine, warnings) = engine(&format!("{prefixes}{axioms}{rule}"));
        assert_eq!(derived(&engine), BTreeSet::from(["i a A".to_owned()]));
        assert!(warnings.iter().any(|warning| warning.starts_with("warning[O302]")), "{warnings:?}");
    }
}

#[test]
fn rules_for_axioms_are_labelled_with_the_axiom() {
    let (engine, _) = engine(":A rdfs:subClassOf :B . :i a :A .");
    let identity = &engine.program().rules[0].identity;
    assert_eq!(&*identity.source, AXIOM_SOURCE);
    assert_eq!(identity.label.as_deref(), Some("SubClassOf(<http://e/#A> <http://e/#B>)"));
}

/// The number of rules does not grow with the square of the number of alternatives.
#[test]
fn large_unions_are_combined_by_few_rules() {
    let union = |letter: &str| {
        let members: Vec<String> = (0..20).map(|number| format!(":{letter}{number}")).collect();
        let declared: Vec<String> = members.iter().map(|member| format!("{member} a owl:Class .")).collect();
        (declared.join(" "), format!("[ a owl:Class ; owl:unionOf ( {} ) ]", members.join(" ")))
    };
    let ((declared, first), (others, second)) = (union("M"), union("N"));
    let most = "owl:onProperty :p ; owl:maxQualifiedCardinality \"1\"^^xsd:nonNegativeInteger";
    let at_most = format!(":A rdfs:subClassOf [ a owl:Restriction ; {most} ; owl:onClass {first} ] .");
    let text = format!("{declared} {at_most} :i a :A ; :p :j , :k , :l . :j a :M3 . :k a :M15 .");
    let (merging, _) = engine(&text);
    let expected = ["j a M15", "j owl:sameAs k", "k a M3", "k owl:sameAs j"].map(str::to_owned);
    assert_eq!(derived(&merging), BTreeSet::from(expected));
    let text = format!("{declared} {others} {first} owl:disjointWith {second} . :i a :M3 , :N15 .");
    let (contradictory, _) = engine(&text);
    assert_eq!(contradictory.violations().len(), 1);
    for engine in [merging, contradictory] {
        assert!(engine.program().rules.len() < 100, "{}", engine.program().rules.len());
    }
}

#[test]
fn unique_names_do_not_merge() {
    let most = "[ a owl:Restriction ; owl:onProperty :p ; owl:maxCardinality 1 ]";
    for axiom in [
        ":p a owl:FunctionalProperty .".to_owned(),
        format!(":B rdfs:subClassOf {most} . :i a :B ."),
        ":B rdfs:subClassOf [ a owl:Class ; owl:oneOf ( :z ) ] . :i a :B .".to_owned(),
    ] {
        let text = format!("{PREFIXES}{axiom} :i :p :j , :k . :j a :A .");
        let ontology = read_text(&text, "t", &ReadOptions::default()).expect("well-formed");
        let violated = |equality: Equality| {
            let mut symbols = Symbols::new();
            let lowered = lower_with(&ontology, equality, &mut symbols);
            assert!(lowered.warnings.is_empty(), "{axiom}: {:?}", lowered.warnings);
            let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe");
            assert_eq!(derived(&engine), BTreeSet::new(), "{axiom}");
            !engine.violations().is_empty()
        };
        assert!(violated(Equality::UniqueNames), "{axiom}");
        assert!(!violated(Equality::UncheckedUniqueNames), "{axiom}");
    }
}

/// Under the unique name assumption, knowledge is inconsistent if it states or implies that two names are equal.
#[test]
fn unique_names_are_not_equal() {
    for (text, is_violated) in [
        (":i owl:sameAs :j .", true),
        (":i owl:sameAs :i .", false),
        (":A owl:hasKey ( :d ) . :i a :A ; :d 1 . :j a :A ; :d 1.0 .", true),
        (":A owl:hasKey ( :d ) . :i a :A ; :d 1 . :j a :A ; :d 2 .", false),
        (":p a owl:InverseFunctionalProperty . :i :p :k . :j :p :k .", true),
        (":p a owl:FunctionalProperty . :i :p :j .", false),
        (":B rdfs:subClassOf [ a owl:Class ; owl:oneOf ( :y :z ) ] . :i a :B .", true),
        (":B rdfs:subClassOf [ a owl:Class ; owl:oneOf ( :y :z ) ] . :z a :B .", false),
        ("owl:Thing rdfs:subClassOf [ a owl:Class ; owl:oneOf ( :y :z ) ] . :i a :A .", true),
        ("owl:Thing rdfs:subClassOf [ a owl:Class ; owl:oneOf ( :y :z ) ] . :y a :A .", false),
    ] {
        let text = format!("{PREFIXES}{text}");
        let ontology = read_text(&text, "t", &ReadOptions::default()).expect("well-formed");
        let mut symbols = Symbols::new();
        let lowered = lower_with(&ontology, Equality::UniqueNames, &mut symbols);
        let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe");
        assert_eq!(!engine.violations().is_empty(), is_violated, "{text}");
    }
}

/// Derived differences count for negated comparisons and in aggregates, too.
#[test]
fn differences_are_derived_for_rule_files() {
    let text = ":A owl:disjointWith :B . :i a :A . :j a :B .";
    assert_eq!(values_by(text, ":A(?x) ^ :B(?y) ^ not differentFrom(?x, ?y) -> :e(?x, 1) .").0, [""; 0]);
    let count = ":A(?x) ^ ?n = count { :B(?y) ^ differentFrom(?x, ?y) } -> :e(?x, ?n) .";
    assert_eq!(values_by(text, count).0, ["1"]);
}

/// Returns the values of `:e` by a rule of a rule file, and the warnings.
fn values_by(text: &str, rule: &str) -> (Vec<String>, Vec<String>) {
    let text = format!("{PREFIXES}{text}");
    let ontology = read_text(&text, "t", &ReadOptions::default()).expect("well-formed");
    let mut symbols = Symbols::new();
    let prefixes = Prefixes::new().with("", "http://e/#");
    let rules = parse_rules(rule, "rules", &mut symbols, &prefixes).expect(rule).rules;
    let lowered = lower_together(&ontology, rules, Equality::Owl, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe");
    let e = engine.symbols().find_name("http://e/#e");
    let facts = engine.facts().filter(|fact| Some(fact.predicate) == e);
    let value = |fact: Fact| engine.symbols().value(fact.arguments[1]).as_literal().map(Literal::lexical);
    (facts.filter_map(value).collect(), lowered.warnings.iter().map(ToString::to_string).collect())
}

/// A datatype that the ontology defines is a test in rule files, too.
#[test]
fn datatypes_of_the_ontology_are_tests_in_rule_files() {
    let small = ":T a rdfs:Datatype ; owl:equivalentClass [ a rdfs:Datatype ; owl:onDatatype xsd:integer ;
        owl:withRestrictions ( [ xsd:maxInclusive 5 ] ) ] . :i :d 3 , 9 , \"x\" .";
    let listed =
        ":T a rdfs:Datatype ; owl:equivalentClass [ a rdfs:Datatype ; owl:oneOf ( 3 4 ) ] . :i :d 3 , 9 .";
    let opaque = ":T a rdfs:Datatype . :i :d 3 .";
    for (text, rule, expected, warning) in [
        (small, ":d(?x, ?n) ^ :T(?n) -> :e(?x, ?n) .", &["3"][..], None),
        (small, ":d(?x, ?n) ^ not :T(?n) -> :e(?x, ?n) .", &["9", "x"], None),
        (small, ":d(?x, ?n) ^ ?k = count { :d(?x, ?m) ^ :T(?m) } -> :e(?x, ?k) .", &["1"], None),
        (listed, ":d(?x, ?n) ^ :T(?n) -> :e(?x, ?n) .", &["3"], None),
        (listed, ":d(?x, ?n) ^ not :T(?n) -> :e(?x, ?n) .", &["9"], None),
        (
            small,
            ":d(?x, ?n) ^ ?k = count { :d(?x, ?m) ^ not :T(?m) } -> :e(?x, ?k) .",
            &[],
            Some("a data range of several alternatives in an aggregate"),
        ),
        (small, ":d(?x, ?n) -> :T(?n) .", &[], Some("a data range as a conclusion")),
        (
            opaque,
            ":d(?x, ?n) ^ not :T(?n) -> :e(?x, ?n) .",
            &[],
            Some("a datatype whose values are not known"),
        ),
    ] {
        let (values, warnings) = values_by(text, rule);
        assert_eq!(warnings.len(), usize::from(warning.is_some()), "{rule}: {warnings:?}");
        assert!(warnings.iter().zip(warning).all(|(shown, reason)| shown.contains(reason)), "{warnings:?}");
        assert_eq!(values, expected, "{rule}");
    }
}

#[test]
fn axioms_with_more_variables_than_a_rule_can_have_are_reported() {
    let text = format!("{PREFIXES}:a :p :b . :b :q :c .");
    let mut ontology = read_text(&text, "t", &ReadOptions::default()).expect("well-formed");
    let property =
        |name: &str| ontology::ObjectPropertyExpression::Property(format!("http://e/#{name}").into());
    // The first property has the variables 0 and 1, and the last one the variables 65,535 and 65,536.
    let chain = (0..65_536).map(|position| property(if position == 65_535 { "q" } else { "p" })).collect();
    let axiom = ontology::Axiom::SubPropertyChainOf(chain, property("r"));
    ontology.axioms.push(ontology::AnnotatedAxiom { axiom, annotations: Vec::new() });
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    let warned =
        |warning: &Warning| warning.code() == "O301" && warning.to_string().contains("65,536 variables");
    assert!(lowered.warnings.iter().any(warned), "{:?}", lowered.warnings.len());
    let r = symbols.name("http://e/#r");
    let concludes = |rule: &rules::Rule| {
        rule.body.len() > 1000
            && rule
                .head
                .iter()
                .any(|atom| matches!(atom, rules::Atom::Relation { predicate, .. } if *predicate == r))
    };
    assert!(!lowered.program.rules.iter().any(concludes));
}

/// Two documents with one ontology IRI each contain a rule, and the rules have the same position and no label.
#[test]
fn an_unusable_rule_does_not_remove_rules_of_other_documents() {
    let rule = |head: &str| {
        format!(
            "@prefix swrl: <http://www.w3.org/2003/11/swrl#> .\n{PREFIXES}<http://e/> a owl:Ontology . :x a swrl:Variable .
            :y a swrl:Variable . [ a swrl:Imp ; swrl:head ( {head} ) ; swrl:body ( [ a swrl:ClassAtom ;
            swrl:classPredicate [ a owl:Class ; owl:unionOf ( :A :C ) ] ; swrl:argument1 :x ] ) ] . :i a :A ."
        )
    };
    let usable = rule("[ a swrl:ClassAtom ; swrl:classPredicate :B ; swrl:argument1 :x ]");
    let unusable = rule(
        "[ a swrl:IndividualPropertyAtom ; swrl:propertyPredicate :p ; swrl:argument1 :x ; swrl:argument2 :y ]",
    );
    // Only the second of its two alternatives does not bind ?y.
    let partly_unusable = format!(
        "{PREFIXES}@prefix swrl: <http://www.w3.org/2003/11/swrl#> . <http://e/> a owl:Ontology . :x a swrl:Variable .
        :y a swrl:Variable . :n a owl:DatatypeProperty . [ a swrl:Imp ; swrl:head ( [ a swrl:DatavaluedPropertyAtom ;
        swrl:propertyPredicate :n ; swrl:argument1 :x ; swrl:argument2 :y ] ) ; swrl:body ( [ a swrl:ClassAtom ;
        swrl:classPredicate :A ; swrl:argument1 :x ] [ a swrl:DataRangeAtom ; swrl:argument1 :y ; swrl:dataRange
        [ a rdfs:Datatype ; owl:unionOf ( [ a rdfs:Datatype ; owl:oneOf ( 1 2 ) ] xsd:boolean ) ] ] ) ] . :i a :A ."
    );
    let directory = tempfile::tempdir().expect("a folder");
    let files = ["a.ttl", "b.ttl"].map(|name| directory.path().join(name));
    for texts in
        [[&usable, &unusable], [&unusable, &usable], [&usable, &partly_unusable], [&partly_unusable, &usable]]
    {
        for (file, text) in files.iter().zip(texts) {
            std::fs::write(file, text).expect("written");
        }
        let ontology = read_files(&files, &ReadOptions::default()).expect("readable");
        let mut symbols = Symbols::new();
        let lowered = lower(&ontology, &mut symbols);
        let warnings: Vec<String> = lowered.warnings.iter().map(ToString::to_string).collect();
        let [warning] = &warnings[..] else { panic!("{warnings:?}") };
        assert!(warning.contains("rule http://e/#0: variable ?y"), "{warning}");
        let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe");
        assert_eq!(derived(&engine), BTreeSet::from(["i a B".to_owned()]));
    }
}
