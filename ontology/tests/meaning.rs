//! Semantics of individuals, punned classes and XML literals in rules and axioms: `owl:Thing` of constants,
//! stated and derived equality of classes and properties (eq-rep of OWL 2 RL), and XML literals that may be
//! equal.

use ontology::{Equality, ReadOptions, lower_together, ntriples, read_text};
use rules::{Engine, Fact, Prefixes, Symbols, parse_rules};

const HEAD: &str = "@prefix : <http://e/#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
";

fn engine(document: &str, rules: &str) -> Engine {
    let ontology = read_text(document, "t", &ReadOptions::default()).expect("well-formed");
    let mut symbols = Symbols::new();
    let prefixes = Prefixes::new().with("", "http://e/#");
    let rules = parse_rules(rules, "rules", &mut symbols, &prefixes).expect("rules").rules;
    let lowered = lower_together(&ontology, rules, Equality::Owl, &mut symbols);
    Engine::new(symbols, lowered.program, lowered.facts).expect("safe")
}

fn inferred(engine: &Engine) -> Vec<String> {
    let facts: Vec<Fact> = engine.facts().filter(|fact| !engine.is_asserted(fact)).collect();
    let text = ntriples(engine.symbols(), &facts);
    let short =
        text.replace("http://e/#", "").replace("http://www.w3.org/1999/02/22-rdf-syntax-ns#type", "a");
    let short = short.replace("http://www.w3.org/2002/07/owl#", "").replace(['<', '>'], "");
    short.lines().map(|line| line.trim_end_matches(" .").to_owned()).collect()
}

#[test]
fn every_constant_is_a_thing() {
    let people = format!("{HEAD}:A a owl:Class . :i a :A . :p a owl:NamedIndividual .");
    for (rule, expected) in [
        ("owl:Thing(:p) -> :Hit(:p)", vec!["p a Hit"]),
        // Only the rule contains this name.
        ("owl:Thing(:q) -> :Hit(:q)", vec!["q a Hit"]),
        (":A(?x) ^ owl:Thing(:p) -> :near(?x, :p)", vec!["i near p"]),
        ("owl:Thing(?x) ^ owl:Thing(:p) -> :near(?x, :p)", vec!["i near p", "p near p"]),
        ("owl:Nothing(:p) -> :Hit(:p)", vec![]),
    ] {
        assert_eq!(inferred(&engine(&people, rule)), expected, "{rule}");
    }
    let functional =
        "Prefix(:=<http://e/#>) Prefix(owl:=<http://www.w3.org/2002/07/owl#>) Ontology(<http://e/>
        Declaration(Class(:Hit)) Declaration(NamedIndividual(:p))
        DLSafeRule(Body(ClassAtom(owl:Thing :p)) Head(ClassAtom(:Hit :p))))";
    assert_eq!(inferred(&engine(functional, "")), ["p a Hit"]);
}

#[test]
fn equal_classes_and_properties_have_the_same_members() {
    let head = format!(
        "{HEAD}:A a owl:Class . :B a owl:Class . :C a owl:Class . :p a owl:ObjectProperty . :q a owl:ObjectProperty .
        :d a owl:DatatypeProperty . :e a owl:DatatypeProperty . :of a owl:FunctionalProperty , owl:ObjectProperty .
        :i a :A ; :p :j ; :d \"1\" .\n"
    );
    for (text, expected) in [
        (":A owl:sameAs :B . :p owl:sameAs :q . :d owl:sameAs :e .", vec!["i a B", "i q j", "i e \"1\""]),
        (":x :of :A , :B , :C .", vec!["i a B", "i a C"]),
        (":x :of :p , :q . :y :of :d , :e .", vec!["i q j", "i e \"1\""]),
        (":x :of :A . :y :of :B .", vec![]),
    ] {
        let derived = inferred(&engine(&format!("{head}{text}"), ""));
        let missing: Vec<&str> =
            expected.iter().copied().filter(|fact| !derived.iter().any(|line| line == fact)).collect();
        assert_eq!(missing, [""; 0], "{text}: {derived:?}");
        let is_about_i = |line: &&String| line.starts_with("i ");
        assert_eq!(derived.iter().filter(is_about_i).count(), expected.len(), "{text}: {derived:?}");
    }
    // Retracting the cause of the equality retracts its consequences.
    let mut changing = engine(&format!("{head}:x :of :A , :B ."), "");
    let names = ["http://e/#of", "http://e/#x", "http://e/#B", "http://e/#i"]
        .map(|name| changing.symbols_mut().name(name));
    let (asserted, concluded) = (Fact::new(names[0], [names[1], names[2]]), Fact::new(names[2], [names[3]]));
    assert!(changing.holds(&concluded));
    changing.apply(rules::Delta { insert: Vec::new(), delete: vec![asserted] }).expect("it ends");
    assert!(!changing.holds(&concluded));
}

#[test]
fn xml_literals_are_equal_or_undecided() {
    let xml = |first: &str, second: &str| {
        let property = ":d a owl:FunctionalProperty , owl:DatatypeProperty .";
        let values = [first, second].map(|text| format!("\"{text}\"^^rdf:XMLLiteral")).join(" , ");
        engine(&format!("{HEAD}{property} :i :d {values} ."), "").violations().is_empty()
    };
    assert!(xml("<a x='1' y='2'/>", "<a y='2' x='1'/>"), "one value after canonicalisation");
    assert!(xml("<a/>", "<b/>"), "two values, which is not decided");
    let mixed = format!(
        "{HEAD}:d a owl:FunctionalProperty , owl:DatatypeProperty . :i :d \"<a/>\"^^rdf:XMLLiteral , \"<a/>\" ."
    );
    assert!(!engine(&mixed, "").violations().is_empty(), "no string is a piece of XML");
}

#[test]
fn a_constraint_on_differences_alone_has_derived_differences() {
    let document = format!(
        "{HEAD}:A a owl:Class . :B a owl:Class ; owl:disjointWith :A . :i a :A . :j a :B . :k a owl:NamedIndividual ."
    );
    for (other, consistent) in [("j", false), ("k", true)] {
        let engine = engine(&document, &format!("differentFrom(:i, :{other}) -> ."));
        assert_eq!(engine.violations().is_empty(), consistent, "{other}");
    }
}

#[test]
fn a_value_is_replaced_for_all_names_of_an_individual() {
    let document = format!("{HEAD}:d a owl:DatatypeProperty . :i owl:sameAs :j . :i :d 1 . :j :d 2 .");
    let mut engine = engine(&document, "");
    let [property, subject] = ["http://e/#d", "http://e/#i"].map(|name| engine.symbols_mut().name(name));
    let value = engine.symbols_mut().literal(rules::Literal::integer(3));
    let delta = ontology::tomasys::change::replace(&engine, property, subject, Some(value));
    engine.apply(delta).expect("it ends");
    let pattern = [Some(subject), None];
    let values: Vec<_> = engine.matching(property, &pattern).map(|row| row[1]).collect();
    assert_eq!(values, [value]);
}
