//! Entailment of each kind of statement, with counterexamples, and the class and property hierarchy.

use ontology::entail::{Answer, annotations, entailments, schema, tautology};
use ontology::{Equality, Ontology, ReadOptions, lower, lower_together, read_text};
use rules::{Engine, Fact, Prefixes, Symbols, parse_rules};

const PREFIXES: &str = "@prefix : <http://e/#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
:A a owl:Class . :B a owl:Class . :C a owl:Class .
:p a owl:ObjectProperty . :q a owl:ObjectProperty . :r a owl:ObjectProperty .
:d a owl:DatatypeProperty . :e a owl:DatatypeProperty .
";

fn read(text: &str) -> Ontology {
    read_text(&format!("{PREFIXES}{text}"), "t", &ReadOptions::default()).expect("well-formed")
}

fn engine(text: &str) -> Engine {
    let mut symbols = Symbols::new();
    let lowered = lower(&read(text), &mut symbols);
    Engine::new(symbols, lowered.program, lowered.facts).expect("safe")
}

fn follows(premise: &str, conclusion: &str) -> bool {
    let conclusion = read(conclusion);
    let mut results = entailments(&engine(premise), &conclusion).expect("it ends");
    results.extend(annotations(&engine(premise), &read(premise).annotations, &conclusion));
    assert!(!results.is_empty(), "{conclusion:?}");
    let answered = |answer: &Answer| match answer {
        Answer::Follows(reason) => {
            assert!(!reason.is_empty(), "{conclusion:?}");
            true
        }
        Answer::Open(_) => false,
    };
    results.iter().all(|entailment| answered(&entailment.answer))
}

#[test]
fn tautologies_need_no_statement() {
    let mut symbols = Symbols::new();
    let names = ["http://e/#a", "http://e/#b"].map(|name| symbols.name(name));
    let value = symbols.literal(1.into());
    let [a, b] = names;
    for (local, arguments, expected) in [
        ("sameAs", vec![a, a], true),
        ("sameAs", vec![a, b], false),
        ("differentFrom", vec![a, a], false),
        ("Thing", vec![a], true),
        ("Thing", vec![value], false),
        ("Nothing", vec![a], false),
        ("topObjectProperty", vec![a, b], true),
        ("topObjectProperty", vec![a, value], false),
        ("topDataProperty", vec![a, value], true),
        ("bottomDataProperty", vec![a, value], false),
    ] {
        let predicate = symbols.name(&format!("http://www.w3.org/2002/07/owl#{local}"));
        let fact = Fact::new(predicate, arguments);
        assert_eq!(tautology(&symbols, &fact).is_some(), expected, "{}", fact.display(&symbols));
    }
}

#[test]
fn entailed_statements_are_proved_and_others_are_not() {
    let restricted = |kind: &str| format!("[ a owl:Restriction ; owl:onProperty :p ; {kind} ]");
    let (some, all) = (restricted("owl:someValuesFrom :B"), restricted("owl:allValuesFrom :B"));
    let most = restricted("owl:maxCardinality 1");
    let below = ":A rdfs:subClassOf :B . :B rdfs:subClassOf :C .";
    for (premise, conclusion, other) in [
        (below.to_owned(), ":A rdfs:subClassOf :C .".to_owned(), ":C rdfs:subClassOf :A .".to_owned()),
        (format!("{below} :i a :A ."), ":i a :C .".into(), ":j a :C .".into()),
        (":A owl:equivalentClass :B .".into(), ":B owl:equivalentClass :A .".into(), ":B owl:equivalentClass :C .".into()),
        (
            ":B owl:disjointWith :C . :A rdfs:subClassOf :B .".into(),
            ":A owl:disjointWith :C .".into(),
            ":A owl:disjointWith :B .".into(),
        ),
        (
            ":B owl:disjointWith :C . :i a :B .".into(),
            ":i a [ a owl:Class ; owl:complementOf :C ] .".into(),
            ":i a [ a owl:Class ; owl:complementOf :A ] .".into(),
        ),
        (
            format!("{some} rdfs:subClassOf :C . :A rdfs:subClassOf :B ."),
            format!("{} rdfs:subClassOf :C .", restricted("owl:someValuesFrom :A")),
            ":A rdfs:subClassOf :C .".into(),
        ),
        (format!(":A rdfs:subClassOf {all} ."), format!(":A rdfs:subClassOf {all} ."), format!(":B rdfs:subClassOf {all} .")),
        (":p a owl:FunctionalProperty .".into(), format!(":A rdfs:subClassOf {most} ."), ":q a owl:FunctionalProperty .".into()),
        (":p rdfs:subPropertyOf :q . :q rdfs:subPropertyOf :r .".into(), ":p rdfs:subPropertyOf :r .".into(), ":r rdfs:subPropertyOf :p .".into()),
        (":p owl:inverseOf :q .".into(), ":q owl:inverseOf :p .".into(), ":q owl:inverseOf :r .".into()),
        (":p a owl:TransitiveProperty .".into(), ":p owl:propertyChainAxiom ( :p :p ) .".into(), ":q a owl:TransitiveProperty .".into()),
        (":p a owl:AsymmetricProperty .".into(), ":p a owl:IrreflexiveProperty .".into(), ":q a owl:IrreflexiveProperty .".into()),
        (":p a owl:SymmetricProperty ; rdfs:domain :A .".into(), ":p rdfs:range :A .".into(), ":p rdfs:range :B .".into()),
        (":d rdfs:subPropertyOf :e . :e rdfs:domain :A .".into(), ":d rdfs:domain :A .".into(), ":e rdfs:subPropertyOf :d .".into()),
        (":e a owl:FunctionalProperty . :d rdfs:subPropertyOf :e .".into(), ":d a owl:FunctionalProperty .".into(), ":e rdfs:subPropertyOf :d .".into()),
        (
            ":p a owl:FunctionalProperty . :i :p :j . :k :p :l . :j owl:differentFrom :l .".into(),
            ":i owl:differentFrom :k .".into(),
            ":i owl:differentFrom :l .".into(),
        ),
        (":A owl:hasKey ( :d ) .".into(), ":A owl:hasKey ( :d :e ) .".into(), ":B owl:hasKey ( :d ) .".into()),
        (
            ":i :p :j . :j a :B .".into(),
            ":i :p [ a :B ] .".into(),
            ":i :p [ a :C ] .".into(),
        ),
        (
            ":p a owl:IrreflexiveProperty . :i a :A .".into(),
            "[] a owl:NegativePropertyAssertion ; owl:sourceIndividual :i ; owl:assertionProperty :p ; owl:targetIndividual :i .".into(),
            ":i :p :i .".into(),
        ),
        (
            ":A owl:equivalentClass [ a owl:Class ; owl:unionOf ( :B :C ) ] .".into(),
            "[ a owl:Class ; owl:unionOf ( :B :C ) ] rdfs:subClassOf :A .".into(),
            ":A rdfs:subClassOf :B .".into(),
        ),
        (":A rdfs:subClassOf :B , :C .".into(), ":A rdfs:subClassOf [ a owl:Class ; owl:intersectionOf ( :B :C ) ] .".into(), ":B rdfs:subClassOf :C .".into()),
        (":A rdfs:subClassOf owl:Nothing .".into(), ":A rdfs:subClassOf :C .".into(), ":C rdfs:subClassOf :A .".into()),
        (
            ":d rdfs:subPropertyOf :e . :e rdfs:range xsd:short , xsd:unsignedInt .".into(),
            ":d rdfs:range xsd:unsignedShort .".into(),
            ":d rdfs:range xsd:byte .".into(),
        ),
        (":d rdfs:range xsd:boolean .".into(), ":d rdfs:range rdfs:Literal .".into(), ":d a owl:FunctionalProperty .".into()),
        (
            ":A owl:equivalentClass :B ; rdfs:comment \"A\" .".into(),
            ":A rdfs:comment \"A\" .".into(),
            ":B rdfs:comment \"A\" .".into(),
        ),
        (":i a :A .".into(), ":i a owl:Thing .".into(), ":l <http://www.w3.org/1999/02/22-rdf-syntax-ns#first> :A .".into()),
    ] {
        assert!(follows(&premise, &conclusion), "{premise} entails {conclusion}");
        assert!(!follows(&premise, &other), "{premise} does not entail {other}");
    }
    assert!(follows(":A owl:disjointWith :B . :i a :A , :B .", ":x :p :y ."), "anything follows");
}

fn follows_by(rule: &str, facts: &str, conclusion: &str) -> bool {
    follows_under(Equality::Owl, rule, facts, conclusion)
}

fn follows_under(equality: Equality, rule: &str, facts: &str, conclusion: &str) -> bool {
    let mut symbols = Symbols::new();
    let prefixes = Prefixes::new().with("", "http://e/#");
    let rules = parse_rules(rule, "rules", &mut symbols, &prefixes).expect(rule).rules;
    let lowered = lower_together(&read(facts), rules, equality, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe");
    let results = entailments(&engine, &read(conclusion)).expect("it ends");
    assert!(!results.is_empty(), "{conclusion}");
    results.iter().all(|result| matches!(result.answer, Answer::Follows(_)))
}

/// The rules conclude something from the absence of facts, or by a built-in that holds of some values only. In each case
/// an individual is a counterexample.
#[test]
fn conclusions_about_some_individuals_are_not_proved_of_all() {
    let negation = ":A(?x) ^ not :B(?x) -> :C(?x) .";
    let below = ":A rdfs:subClassOf :C .";
    for (rule, counterexample, conclusion) in [
        (negation, ":i a :A , :B .", below),
        (":A(?x) ^ 0 = count { :p(?x, ?y) } -> :C(?x) .", ":i a :A ; :p :i .", below),
        (":d(?x, ?v) ^ not swrlb:equal(?v, 5) -> :C(?x) .", ":i :d 5 .", ":d rdfs:domain :C ."),
        (":A(?x) ^ :B(?y) ^ not sameAs(?x, ?y) -> :C(?x) .", ":i a :A , :B .", below),
        (
            ":A(?x) ^ :B(?y) ^ not differentFrom(?x, ?y) -> :C(?x) .",
            ":i a :A . :j a :B . :i owl:differentFrom :j .",
            below,
        ),
        (":d(?x, ?v) ^ swrlb:notEqual(?v, 5) -> :C(?x) .", ":i :d 5 .", ":d rdfs:domain :C ."),
        (
            ":d(?x, ?v) ^ swrlb:stringConcat(?s, ?v, \"\") ^ swrlb:stringLength(?l, ?s) ^ swrlb:lessThan(?l, 3) -> :C(?x) .",
            ":i :d 5000 .",
            ":d rdfs:domain :C .",
        ),
    ] {
        assert!(!follows_by(rule, counterexample, ":i a :C ."), "{rule}");
        assert!(!follows_by(rule, counterexample, conclusion), "{rule}");
    }
    assert!(follows_by(negation, ":i a :A .", ":i a :C ."), "it is looked up");
    assert!(follows_by(":A(?x) -> :C(?x) .", ":i a :A .", below));
}

/// A constraint on the values of one individual is no range of the property.
#[test]
fn ranges_are_not_proved_from_restrictions_of_an_individual() {
    let restriction = ":i a [ a owl:Restriction ; owl:onProperty :d ; owl:allValuesFrom xsd:integer ] .";
    assert!(!follows(restriction, ":d rdfs:range xsd:integer ."));
    assert!(!follows_by(":d(:i, ?v) ^ not xsd:integer(?v) -> .", "", ":d rdfs:range xsd:integer ."));
    assert!(follows(":d rdfs:range xsd:integer .", ":d rdfs:range xsd:integer ."));
}

/// A blank node of a question is not the blank node with the same label in the knowledge base.
#[test]
fn anonymous_individuals_within_expressions_are_not_looked_up() {
    let premise = ":a :p _:x . :e a :A .";
    let value = "[ a owl:Restriction ; owl:onProperty :p ; owl:hasValue _:z ]";
    let absent = "[] a owl:NegativePropertyAssertion ; owl:sourceIndividual :a ; owl:assertionProperty :q ;
        owl:targetIndividual";
    assert!(follows(premise, ":a :p _:z ."));
    assert!(!follows(premise, &format!("_:z a :A . :a a {value} .")));
    assert!(!follows(premise, &format!("_:z a :A . _:y a {value} .")));
    assert!(!follows(&format!("{absent} _:x . :e a :A ."), &format!("_:z a :A . {absent} _:z .")));
    assert!(follows(&format!("{absent} :e ."), &format!("{absent} :e .")));
}

/// Two values of a functional property that are only restricted to datatypes can be one value.
#[test]
fn values_of_restrictions_may_be_equal() {
    let functional = ":d a owl:FunctionalProperty . :e rdfs:subPropertyOf :d .";
    let some = |property: &str, datatype: &str| {
        format!("[ a owl:Restriction ; owl:onProperty {property} ; owl:someValuesFrom {datatype} ]")
    };
    let (integer, decimal) = (some(":d", "xsd:integer"), some(":d", "xsd:decimal"));
    let below = some(":e", "xsd:integer");
    let not = |class: &str| format!("[ a owl:Class ; owl:complementOf {class} ]");
    let both = format!("[ a owl:Class ; owl:intersectionOf ( {integer} {decimal} ) ]");
    for conclusion in [
        format!("{integer} owl:disjointWith {decimal} ."),
        format!("{both} rdfs:subClassOf owl:Nothing ."),
        format!("{both} rdfs:subClassOf :C ."),
        format!(":d rdfs:domain {} .", not(&integer)),
        format!("{below} rdfs:subClassOf {} .", not(&integer)),
        format!(
            "{integer} rdfs:subClassOf [ a owl:Restriction ; owl:onProperty :e ; owl:onDataRange xsd:integer ;
             owl:maxQualifiedCardinality 0 ] ."
        ),
        ":A owl:hasKey ( :d :e ) .".to_owned(),
    ] {
        assert!(!follows(functional, &conclusion), "{conclusion}");
    }
    // Proofs that assume two different values remain.
    let most = "[ a owl:Restriction ; owl:onProperty :e ; owl:maxCardinality 1 ]";
    for conclusion in [format!(":A rdfs:subClassOf {most} ."), ":e a owl:FunctionalProperty .".to_owned()] {
        assert!(follows(functional, &conclusion), "{conclusion}");
    }
}

/// A key identifies only individuals with a name, and a member of a class can have none.
#[test]
fn keys_do_not_identify_arbitrary_individuals() {
    let keyed = ":A owl:hasKey ( :d ) . :i a :A ; :d 1 .";
    let restricted = "[ a owl:Restriction ; owl:onProperty :d ; owl:hasValue 1 ]";
    let one = "[ a owl:Class ; owl:oneOf ( :i ) ]";
    let both = format!("[ a owl:Class ; owl:intersectionOf ( :A {restricted} ) ]");
    assert!(!follows(keyed, &format!("{both} rdfs:subClassOf {one} .")));
    assert!(follows(&format!("{keyed} :j a :A ; :d 1 ."), ":i owl:sameAs :j ."));
    let other = ":j a :A ; owl:differentFrom :i .";
    let absent = "[] a owl:NegativePropertyAssertion ; owl:sourceIndividual :j ; owl:assertionProperty :d ;
        owl:targetValue 1 .";
    assert!(follows(&format!("{keyed} {other}"), absent));
    assert!(!follows(&format!("{keyed} :j a :A ."), absent));
    assert!(follows(keyed, ":A owl:hasKey ( :d :p ) ."));
}

#[test]
fn arbitrary_individuals_may_be_named_under_unique_names() {
    let follows = |rule: &str, facts: &str, conclusion: &str| {
        follows_under(Equality::UniqueNames, rule, facts, conclusion)
    };
    let rule = ":A(?x) ^ differentFrom(?x, :i) -> :B(?x) .";
    // The only member of `A` can be `i`.
    assert!(!follows(rule, ":i a :A .", ":A rdfs:subClassOf :B ."));
    assert!(follows(rule, ":i a :C . :j a :A .", ":j a :B ."));
    let different = ":A(?x) ^ :A(?y) ^ differentFrom(?x, ?y) -> .";
    assert!(!follows(different, "", ":A owl:disjointWith :A ."));
    let least = |n: u8| format!("[ a owl:Restriction ; owl:onProperty :p ; owl:minCardinality {n} ]");
    let pairs = ":p(?x, ?y) ^ :p(?x, ?z) ^ differentFrom(?y, ?z) -> :C(?x) .";
    assert!(follows(pairs, "", &format!("{} rdfs:subClassOf :C .", least(2))));
    assert!(!follows(pairs, "", &format!("{} rdfs:subClassOf :C .", least(1))));
    let twice = format!("[ a owl:Class ; owl:intersectionOf ( {} {} ) ]", least(1), least(1));
    assert!(!follows(pairs, "", &format!("{twice} rdfs:subClassOf :C .")));
    let functional = ":p a owl:FunctionalProperty . :i :p :j .";
    let other = "[] a owl:NegativePropertyAssertion ; owl:sourceIndividual :i ; owl:assertionProperty :p ;
        owl:targetIndividual :k .";
    assert!(follows("", functional, other));
    assert!(follows("", ":i owl:sameAs :j .", ":i a :C ."), "everything follows");
}

#[test]
fn conclusions_use_the_declarations_of_the_knowledge_base() {
    let asks = |text: &str, known: &Ontology| {
        let prefixes: Vec<&str> = PREFIXES.lines().filter(|line| line.starts_with("@prefix")).collect();
        let text = format!("{}\n{text}", prefixes.join("\n"));
        let options = ReadOptions { known: known.entities.clone(), ..ReadOptions::default() };
        read_text(&text, "question", &options).expect("well-formed")
    };
    let premise = ":p a owl:FunctionalProperty ; rdfs:range :A . :d a owl:FunctionalProperty .";
    for (conclusion, expected) in [
        (":p a owl:FunctionalProperty .", true),
        (":d a owl:FunctionalProperty .", true),
        (":q a owl:FunctionalProperty .", false),
        (":p rdfs:range :A .", true),
        (":p rdfs:range :B .", false),
    ] {
        let results = entailments(&engine(premise), &asks(conclusion, &read(premise))).expect("it ends");
        assert!(!results.is_empty(), "{conclusion}");
        let entailed = results.iter().all(|result| matches!(result.answer, Answer::Follows(_)));
        assert_eq!(entailed, expected, "{conclusion}: {results:?}");
    }
}

#[test]
fn the_schema_is_the_hierarchy_of_classes_and_properties() {
    let text = ":A rdfs:subClassOf :B . :B rdfs:subClassOf :C . :C owl:disjointWith :D . :D a owl:Class .
        :E rdfs:subClassOf :C , :D . :E a owl:Class . :p rdfs:subPropertyOf :q . :q owl:equivalentProperty :r .";
    let hierarchy = schema(&engine(text), &read(text).entities).expect("it ends");
    let local = |iris: &[String]| -> String {
        iris.iter().map(|iri| iri.trim_start_matches("http://e/#")).collect::<Vec<_>>().join(" ")
    };
    let shown: Vec<String> = hierarchy
        .classes
        .iter()
        .chain(&hierarchy.object_properties)
        .map(|entity| {
            let empty = if entity.empty.is_some() { " empty" } else { "" };
            let iri = std::slice::from_ref(&entity.iri);
            format!("{}: {} < {}{empty}", local(iri), local(&entity.direct), local(&entity.above))
        })
        .collect();
    let expected = [
        "A: B < B C",
        "B: C < C",
        "C:  < ",
        "D:  < ",
        "E: C D < C D empty",
        "p: q r < q r",
        "q: r < r",
        "r: q < q",
    ];
    assert_eq!(shown, expected);
}

#[test]
fn assumed_intersections_of_unions_do_not_multiply_without_limit() {
    let list = |item: fn(u32) -> String| (0..20).map(item).collect::<Vec<_>>().concat();
    let declared = list(|i| format!(":L{i} a owl:Class . :R{i} a owl:Class .\n"));
    let unions = list(|i| format!("[ a owl:Class ; owl:unionOf ( :L{i} :R{i} ) ] "));
    let conclusion = |last: &str| {
        format!("{declared}[ a owl:Class ; owl:intersectionOf ( {unions} {last} ) ] rdfs:subClassOf :B .")
    };
    let premise = format!("{declared}:A rdfs:subClassOf :B .");
    assert!(follows(&premise, &conclusion(":A")));
    assert!(!follows(&premise, &conclusion(":C")));
    // The cases of a small union are still complete.
    let premise = format!("{declared}:L0 rdfs:subClassOf :B . :R0 rdfs:subClassOf :B .");
    assert!(follows(&premise, &conclusion(":C")));
}

#[test]
fn queries_can_be_interrupted() {
    let mut engine = engine(":a :p :b . :b :q :c .");
    let query = read("_:x :p _:y . _:y :q _:z .");
    assert_eq!(entailments(&engine, &query).map(|results| results.len()), Ok(1));
    let interrupt = Some(rules::Interrupt::new(|| true));
    engine.set_limits(rules::Limits { interrupt, ..rules::Limits::default() });
    assert_eq!(entailments(&engine, &query).map_err(|error| error.code()), Err("R304"));
}
