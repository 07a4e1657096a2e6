//! Documents in functional-style syntax and OWL/XML mean the same as in Turtle.

use std::collections::BTreeSet;
use std::path::Path;

use ontology::{Error, Ontology, OutputSyntax, ReadOptions, convert_files, lower, read_files, read_text};
use rules::{Engine, Symbols};

use crate::revise::{DECLARATIONS, Random};

const PREFIXES: &str = "Prefix(:=<urn:x#>) Prefix(owl:=<http://www.w3.org/2002/07/owl#>) \
    Prefix(rdfs:=<http://www.w3.org/2000/01/rdf-schema#>) Prefix(xsd:=<http://www.w3.org/2001/XMLSchema#>)";

const OWL: &str = "http://www.w3.org/2002/07/owl#";
const XSD: &str = "http://www.w3.org/2001/XMLSchema#";

fn read(text: &str) -> Ontology {
    read_text(text, "text", &ReadOptions::default()).unwrap_or_else(|errors| panic!("{errors}\n{text}"))
}

fn shown(ontology: &Ontology) -> Vec<String> {
    let rules = ontology.rules().iter().map(ToString::to_string);
    let axioms = ontology.axioms.iter().map(|annotated| annotated.axiom.to_string());
    rules.chain(axioms).map(|text| text.replace("<urn:x#", "<")).collect()
}

/// All facts that hold, except those of auxiliary relations, and `true` if they are consistent.
fn conclusions(ontology: &Ontology) -> (BTreeSet<String>, bool) {
    let mut symbols = Symbols::new();
    let lowered = lower(ontology, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules");
    let facts = engine.facts().map(|fact| fact.display(engine.symbols()).to_string());
    (facts.filter(|fact| !fact.contains("urn:metaplan:")).collect(), engine.violations().is_empty())
}

/// A term of functional-style syntax: a name or literal, or a list with a name, which may be empty.
enum Term<'t> {
    Word(&'t str),
    List(&'t str, Vec<Term<'t>>),
}

/// Reads terms up to the end of the text or the closing parenthesis. Returns them with the remaining text.
fn terms(mut text: &str) -> (Vec<Term<'_>>, &str) {
    let mut terms = Vec::new();
    loop {
        text = text.trim_start();
        if let Some(tail) = text.strip_prefix(')') {
            return (terms, tail);
        }
        if text.is_empty() {
            return (terms, text);
        }
        let quoted = text.strip_prefix('"').map_or(0, |tail| tail.find('"').expect("closed") + 2);
        let ends = |c: char| c.is_whitespace() || "()".contains(c);
        let end = text[quoted..].find(ends).map_or(text.len(), |end| quoted + end);
        let (word, tail) = text.split_at(end);
        text = tail;
        match tail.strip_prefix('(') {
            Some(tail) => {
                let (arguments, tail) = self::terms(tail);
                terms.push(Term::List(word, arguments));
                text = tail;
            }
            None => terms.push(Term::Word(word)),
        }
    }
}

/// Writes a term of the documents of this file as OWL/XML. The first letter of a name determines its kind.
fn xml(term: &Term) -> String {
    let all = |terms: &[Term]| -> String { terms.iter().map(xml).collect() };
    match term {
        Term::List("Variable", variable) => {
            let [Term::Word(name)] = &variable[..] else { panic!("a variable has one name") };
            let iri = name.strip_prefix(':').map(|name| format!("urn:x#{name}"));
            format!("<Variable IRI=\"{}\"/>", iri.as_deref().unwrap_or(name.trim_matches(['<', '>'])))
        }
        Term::List("Annotation", parts) => match &parts[..] {
            [Term::Word(property), value] => format!(
                "<Annotation><AnnotationProperty IRI=\"{}\"/>{}</Annotation>",
                property.trim_matches(['<', '>']),
                xml(value)
            ),
            _ => panic!("an annotation has a property and a value"),
        },
        Term::List("", terms) => all(terms),
        Term::List("Declaration", terms) => match &terms[..] {
            [Term::List(_, name)] => format!("<Declaration>{}</Declaration>", all(name)),
            _ => panic!("a declaration has one entity"),
        },
        Term::List(name, terms) => match &terms[..] {
            [Term::Word(number), terms @ ..] if name.ends_with("Cardinality") => {
                format!("<{name} cardinality=\"{number}\">{}</{name}>", all(terms))
            }
            terms => format!("<{name}>{}</{name}>", all(terms)),
        },
        Term::Word(word) if word.starts_with('"') => match word.trim_matches('"').split_once("\"^^") {
            Some((value, datatype)) => {
                let datatype = datatype.replace("xsd:", XSD);
                format!("<Literal datatypeIRI=\"{}\">{value}</Literal>", datatype.trim_matches(['<', '>']))
            }
            None => format!("<Literal>{}</Literal>", word.trim_matches('"')),
        },
        Term::Word(word) => {
            let (prefix, name) = word.split_once(':').expect("a prefixed name");
            let (namespace, kind) = match (prefix, name.chars().next()) {
                ("owl", _) => (OWL, "Class"),
                ("xsd", _) => (XSD, "Datatype"),
                (_, Some('A'..='Z')) => ("urn:x#", "Class"),
                (_, Some('p'..='r')) => ("urn:x#", "ObjectProperty"),
                (_, Some('m'..='n')) => ("urn:x#", "DataProperty"),
                _ => ("urn:x#", "NamedIndividual"),
            };
            format!("<{kind} IRI=\"{namespace}{name}\"/>")
        }
    }
}

fn functional(iri: &str, import: &str, axioms: &str) -> String {
    let [iri, import] = [("", iri, ""), ("Import(", import, ")")].map(|(start, iri, end)| match iri {
        "" => String::new(),
        iri => format!("{start}<{iri}>{end}\n"),
    });
    format!("{PREFIXES} Ontology({iri}{import}{axioms}\n)")
}

fn owl_xml(iri: &str, import: &str, axioms: &str) -> String {
    let iri = if iri.is_empty() { String::new() } else { format!(" ontologyIRI=\"{iri}\"") };
    let import = if import.is_empty() { String::new() } else { format!("<Import>{import}</Import>\n") };
    let axioms: Vec<String> = terms(axioms).0.iter().map(xml).collect();
    format!("<Ontology xmlns=\"{OWL}\"{iri}>\n{import}{}\n</Ontology>", axioms.join("\n"))
}

/// Returns an axiom about two to four classes, properties or individuals, and the axioms about all pairs of them.
fn group(random: &mut Random) -> (String, Vec<String>) {
    let classes = [":A", ":B", ":C", ":D", ":E", ":F", ":G"];
    let (name, items) = match random.below(7) {
        0..=1 => ("DisjointClasses", &classes[..]),
        2 => ("EquivalentClasses", &classes[..]),
        3 => ("DifferentIndividuals", &[":a", ":b", ":c", ":d", ":e"][..]),
        4 => ("SameIndividual", &[":a", ":b", ":c", ":d", ":e"][..]),
        5 => ("DisjointObjectProperties", &[":p", ":q", ":r"][..]),
        _ => ("EquivalentObjectProperties", &[":p", ":q", ":r"][..]),
    };
    let start = random.below(items.len());
    let count = (2 + random.below(3)).min(items.len());
    let mut members: Vec<String> =
        items.iter().cycle().skip(start).take(count).map(|&item| item.to_owned()).collect();
    if name.ends_with("Classes") && random.below(3) == 0 {
        members.push(random.condition(1));
    }
    let pairs = members.iter().enumerate().flat_map(|(index, first)| {
        members[index + 1..].iter().map(move |second| format!("{name}({first} {second})"))
    });
    (format!("{name}({})", members.join(" ")), pairs.collect())
}

/// Compares documents with random statements with the Turtle document in which each axiom about several classes,
/// properties or individuals is written as pairs. The documents import some of the statements. Half of them have no
/// ontology IRI.
fn check(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut random = Random((seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        let number = 4 + random.below(12);
        let statements: Vec<String> = (0..number).map(|_| random.statement()).collect();
        let groups: Vec<(String, Vec<String>)> = (0..3).map(|_| group(&mut random)).collect();
        let (imported, direct) = statements.split_at(random.below(number));
        let groups_only: Vec<String> = groups.iter().map(|(axiom, _)| axiom.clone()).collect();
        let pairs = groups.into_iter().flat_map(|(_, pairs)| pairs);
        let whole: Vec<String> = statements.iter().cloned().chain(pairs).collect();
        let base = "http://e/base";
        let imported = functional(base, "", &format!("{DECLARATIONS}{}", imported.join("\n")));
        let whole = functional("", "", &format!("{DECLARATIONS}{}", whole.join("\n")));
        let directory = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let path = directory.path().join(name);
            std::fs::write(&path, text).expect("written");
            path
        };
        write("base.ofn", &imported);
        let turtle = |file: &Path| {
            convert_files(&[file], &ReadOptions::default(), OutputSyntax::Turtle).expect("writable").0
        };
        let whole_text = turtle(&write("whole.ofn", &whole));
        let expected = conclusions(&read(&whole_text));
        let iri = ["", "http://e/main"][random.below(2)];
        let axioms = [direct, &groups_only[..]].concat().join("\n");
        for (name, text) in
            [("main.ofn", functional(iri, base, &axioms)), ("main.owx", owl_xml(iri, base, &axioms))]
        {
            let file = write(name, &text);
            let ontology = read_files(&[&file], &ReadOptions::default());
            let ontology = ontology.unwrap_or_else(|errors| panic!("seed {seed}: {errors}\n{text}"));
            for (way, actual) in
                [("read", conclusions(&ontology)), ("converted", conclusions(&read(&turtle(&file))))]
            {
                let missing: Vec<_> = expected.0.difference(&actual.0).collect();
                let spurious: Vec<_> = actual.0.difference(&expected.0).collect();
                assert!(
                    expected == actual,
                    "seed {seed}, {name} {way}\n{imported}\n{text}\nmissing {missing:#?}\nspurious {spurious:#?}\n{whole_text}\n\
                     consistent: {} instead of {}",
                    actual.1,
                    expected.1
                );
            }
        }
    }
}

#[test]
fn every_syntax_means_the_same() {
    check(0..100);
}

#[test]
#[ignore = "takes minutes"]
fn every_syntax_means_the_same_for_many_documents() {
    check(1_000_000..1_003_000);
}

/// Axioms of up to 16 classes become pairs with the annotations of the axiom, larger ones remain one axiom.
#[test]
fn all_pairs_of_disjoint_classes_are_disjoint() {
    let axiom = |count: usize, annotation: &str| {
        let classes: Vec<String> = (10..10 + count).map(|number| format!(":C{number}")).collect();
        let declarations = classes.iter().map(|class| format!("Declaration(Class({class}))"));
        let declarations = declarations.collect::<Vec<_>>().join(" ");
        format!("{declarations} DisjointClasses({annotation} {})", classes.join(" "))
    };
    let annotation = "Annotation(<http://www.w3.org/2000/01/rdf-schema#comment> \"why\")";
    for document in [functional, owl_xml] {
        for annotation in ["", annotation] {
            let ontology = read(&document("http://e/", "", &axiom(3, annotation)));
            let pairs = ["<C10> <C11>", "<C10> <C12>", "<C11> <C12>"];
            assert_eq!(shown(&ontology), pairs.map(|pair| format!("DisjointClasses({pair})")));
            let annotations = ontology.axioms.iter().map(|axiom| axiom.annotations.len());
            assert!(annotations.eq([usize::from(!annotation.is_empty()); 3]), "{:?}", ontology.axioms);
            assert_eq!(ontology.warnings, []);
            let ontology = read(&document("http://e/", "", &axiom(16, annotation)));
            assert_eq!(ontology.axioms.len(), 16 * 15 / 2);
            let ontology = read(&document("http://e/", "", &axiom(17, annotation)));
            let [axiom] = &shown(&ontology)[..] else { panic!("{:?}", ontology.axioms) };
            assert!(axiom.starts_with("DisjointClasses(<C10> ") && axiom.ends_with(" <C26>)"), "{axiom}");
            assert_eq!(ontology.warnings, []);
            assert_eq!(ontology.entities.len(), 17, "{:?}", ontology.entities);
        }
    }
    // Large axioms survive conversion, also with class expressions as members.
    let directory = tempfile::tempdir().expect("a folder");
    let file = directory.path().join("text.ofn");
    let restriction = "Declaration(ObjectProperty(:p)) DisjointClasses(ObjectSomeValuesFrom(:p :C10)";
    let mixed = axiom(17, "").replace("DisjointClasses(", restriction);
    for (text, members) in [(axiom(20, annotation), 20), (mixed, 18)] {
        std::fs::write(&file, functional("http://e/", "", &text)).expect("written");
        for syntax in [OutputSyntax::Turtle, OutputSyntax::Functional, OutputSyntax::OwlXml] {
            let (text, _) = convert_files(&[&file], &ReadOptions::default(), syntax).expect("writable");
            assert!(!text.contains("urn:metaplan"), "{text}");
            let pairs = if members == 20 { 1 } else { members * (members - 1) / 2 };
            assert_eq!(read(&text).axioms.len(), pairs, "{text}");
        }
    }
}

#[test]
fn documents_without_an_ontology_iri_have_imports() {
    let directory = tempfile::tempdir().expect("a folder");
    let annotation = "Annotation(<http://www.w3.org/2000/01/rdf-schema#comment> \"why\")";
    for (name, document) in
        [("main.ofn", functional as fn(&str, &str, &str) -> String), ("main.owx", owl_xml)]
    {
        let file = directory.path().join(name);
        let text = document("", "http://e/base", &format!("{annotation} ClassAssertion(:A :a)"));
        std::fs::write(&file, text).expect("written");
        let _ = std::fs::remove_file(directory.path().join("base.ofn"));
        let errors = read_files(&[&file], &ReadOptions::default()).expect_err("missing");
        let [Error::UnresolvedImport { import, position, .. }] = &errors[..] else { panic!("{errors}") };
        assert_eq!(import, "http://e/base");
        assert!(position.is_some());
        let base = functional("http://e/base", "", "ClassAssertion(:B :a)");
        std::fs::write(directory.path().join("base.ofn"), base).expect("written");
        let ontology = read_files(&[&file], &ReadOptions::default()).expect("readable");
        assert_eq!(shown(&ontology), ["ClassAssertion(<A> <a>)", "ClassAssertion(<B> <a>)"]);
        assert_eq!(ontology.iri(), None);
        let warnings: Vec<String> = ontology.warnings.iter().map(ToString::to_string).collect();
        assert!(warnings.iter().all(|warning| warning.contains("O201")), "{warnings:?}");
    }
}

/// In these syntaxes, variables and individuals cannot be confused.
#[test]
fn variables_and_individuals_may_have_one_iri() {
    let axioms = "DLSafeRule(Body(ClassAtom(:A Variable(:a))) Head(ClassAtom(:B Variable(:a))))
        DLSafeRule(Body(ClassAtom(:A :a)) Head(ClassAtom(:C :a)))
        Declaration(Class(:A)) Declaration(Class(:B)) Declaration(Class(:C))
        Declaration(NamedIndividual(:a)) ClassAssertion(:A :b)";
    for document in [functional, owl_xml] {
        let ontology = read(&document("http://e/", "", axioms));
        let mut rules: Vec<String> = shown(&ontology)[..2].to_vec();
        rules.sort();
        assert_eq!(rules, ["<A>(<a>) -> <C>(<a>)", "<A>(?a) -> <B>(?a)"]);
        assert_eq!(ontology.warnings, []);
        let facts = ["<urn:x#A>(<urn:x#b>)", "<urn:x#B>(<urn:x#b>)"].map(str::to_owned);
        assert_eq!(conclusions(&ontology), (BTreeSet::from(facts), true));
    }
    // A variable of one document is an individual of another one.
    let variable = "Declaration(Class(:A)) Declaration(Class(:B))
        DLSafeRule(Body(ClassAtom(:A Variable(:a))) Head(ClassAtom(:B Variable(:a))))";
    let individual = "Declaration(Class(:A)) Declaration(Class(:C)) Declaration(NamedIndividual(:a))
        DLSafeRule(Body(ClassAtom(:A :a)) Head(ClassAtom(:C :a))) ClassAssertion(:A :b)";
    let directory = tempfile::tempdir().expect("a folder");
    let files = ["a.owl", "b.owl"].map(|name| directory.path().join(name));
    for document in [functional, owl_xml] {
        std::fs::write(&files[0], document("http://e/a", "", variable)).expect("written");
        std::fs::write(&files[1], document("http://e/b", "", individual)).expect("written");
        let ontology = read_files(&files, &ReadOptions::default()).expect("readable");
        let facts = ["<urn:x#A>(<urn:x#b>)", "<urn:x#B>(<urn:x#b>)"].map(str::to_owned);
        assert_eq!(conclusions(&ontology), (BTreeSet::from(facts), true));
    }
}

#[test]
fn annotations_of_rules_are_read() {
    let declarations = "Declaration(Class(:A)) Declaration(Class(:B))";
    let annotations = "Annotation(rdfs:label \"R\") Annotation(<http://swrl.stanford.edu/ontologies/3.3/swrla.owl#isRuleEnabled> \"false\"^^xsd:boolean)";
    let rule = |head: &str| {
        format!(
            "DLSafeRule({annotations} Body(ClassAtom(:A Variable(:x))) Head(ClassAtom({head} Variable(:x))))"
        )
    };
    let text = functional("http://e/", "", &[declarations, &rule(":A"), &rule(":B")].join("\n"));
    let directory = tempfile::tempdir().expect("a folder");
    let file = directory.path().join("text.ofn");
    std::fs::write(&file, &text).expect("written");
    let mut texts = vec![text];
    for syntax in [OutputSyntax::Turtle, OutputSyntax::Functional, OutputSyntax::OwlXml] {
        texts.push(convert_files(&[&file], &ReadOptions::default(), syntax).expect("writable").0);
    }
    for text in texts {
        let ontology = read(&text);
        assert_eq!(ontology.rules().len(), 2, "{text}");
        for rule in ontology.rules() {
            assert_eq!((rule.label.as_deref(), rule.enabled), (Some("R"), Some(false)), "{text}");
            assert_eq!(rule.annotations.len(), 2);
        }
        assert_eq!(ontology.warnings, [], "{text}");
    }
}

/// OWL declares these prefixes, and tools assume that the others are declared, too.
#[test]
fn standard_prefixes_need_no_declaration() {
    let text = "Ontology(<http://e/> Declaration(NamedIndividual(<urn:x#a>))
        DataPropertyAssertion(<urn:x#n> <urn:x#a> \"1\"^^xsd:integer) ClassAssertion(owl:Thing <urn:x#a>)
        AnnotationAssertion(rdfs:label <urn:x#a> \"a\"))";
    let axioms = shown(&read(text));
    assert!(
        axioms.contains(&"ClassAssertion(<http://www.w3.org/2002/07/owl#Thing> <a>)".to_owned()),
        "{axioms:?}"
    );
    // Positions of errors do not count the added declarations.
    let errors = read_text("Ontology(<http://e/>\nClassAssertion(owl:Thing))", "f", &ReadOptions::default());
    let message = errors.expect_err("no individual").to_string();
    assert!(message.starts_with("f:2:25: error[O102]"), "{message}");
    let errors =
        read_text("Ontology(<http://e/>\nClassAssertion(owl:Thing e:i))", "f", &ReadOptions::default());
    let message = errors.expect_err("undeclared").to_string();
    assert!(message.contains("f:2:26") && message.contains("`e:` is not declared"), "{message}");
}
