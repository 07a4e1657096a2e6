//! The test cases of the W3C's OWL working group under the Direct Semantics: consistency, inconsistency and
//! entailment. The files are outside of the project.

#![allow(clippy::print_stdout, clippy::format_push_string)]

use std::collections::{BTreeMap, BTreeSet};

use ontology::entail::{Answer, annotations, entailments};
use ontology::{EntityKind, Equality, Iri, Ontology, ReadOptions, lower_with, read_files};
use oxrdf::{NamedOrBlankNode, Term};
use rules::{Engine, Symbols};
use test_resources::data;

const TEST: &str = "http://www.w3.org/2007/OWL/testOntology#";

/// Cases with another result than the W3C's: identifier, kind of the question, reason. No other case of
/// the profile RL may differ, and no case may entail a statement that does not follow.
const OPEN: [(&str, &str, &str); 3] = [
    ("WebOnt-I4.6-005-Direct", "entailed", ANNOTATIONS),
    ("WebOnt-equivalentClass-008-Direct", "entailed", ANNOTATIONS),
    (
        "WebOnt-Ontology-003",
        "not entailed",
        "it follows from its axioms; OWL 1 DL asked for a header, which OWL 2 does not",
    ),
];
const ANNOTATIONS: &str = "a conclusion has an annotation, which was not stated; the same case with the opposite answer \
    is there for the RDF-based semantics, and is right";

/// The properties of the test cases: subject, local name of the predicate, objects.
struct Suite(BTreeMap<String, BTreeMap<String, Vec<String>>>);

impl Suite {
    /// Reads the suite. Its entity declarations have single quotes, which the RDF/XML parser does not
    /// support.
    fn read(text: &str) -> Self {
        let mut properties: BTreeMap<String, BTreeMap<String, Vec<String>>> = BTreeMap::new();
        let (head, tail) = text.split_once("]>").expect("a document type");
        let text = head.replace('\'', "\"") + "]>" + tail;
        for triple in oxrdfxml::RdfXmlParser::new().for_slice(text.as_bytes()) {
            let triple = triple.expect("well-formed");
            let subject = match &triple.subject {
                NamedOrBlankNode::NamedNode(node) => node.as_str().to_owned(),
                NamedOrBlankNode::BlankNode(node) => format!("_:{}", node.as_str()),
            };
            let object = match &triple.object {
                Term::NamedNode(node) => node.as_str().to_owned(),
                Term::BlankNode(node) => format!("_:{}", node.as_str()),
                Term::Literal(literal) => literal.value().to_owned(),
            };
            let predicate = triple.predicate.as_str().rsplit('#').next().unwrap_or_default().to_owned();
            properties.entry(subject).or_default().entry(predicate).or_default().push(object);
        }
        Self(properties)
    }

    fn all(&self, case: &str, predicate: &str) -> &[String] {
        self.0.get(case).and_then(|properties| properties.get(predicate)).map_or(&[], Vec::as_slice)
    }

    /// Returns the document of a kind (such as `Premise`) that belongs to a case: in RDF/XML, otherwise in
    /// functional-style syntax; `None` without both.
    fn text(&self, case: &str, kind: &str) -> Option<&String> {
        let forms = [format!("rdfXml{kind}Ontology"), format!("fs{kind}Ontology")];
        forms.iter().find_map(|form| self.all(case, form).first())
    }
}

fn read(suite: &Suite, case: &str, text: &str, known: &[(EntityKind, Iri)]) -> Result<Ontology, String> {
    let directory = tempfile::tempdir().expect("temporary directory");
    let file = directory.path().join("premise.owl");
    std::fs::write(&file, text).expect("written");
    let mut catalog = "<catalog xmlns=\"urn:oasis:names:tc:entity:xmlns:xml:catalog\">".to_owned();
    for (number, import) in suite.all(case, "importedOntology").iter().enumerate() {
        let (Some(iri), Some(text)) =
            (suite.all(import, "importedOntologyIRI").first(), suite.text(import, "Input"))
        else {
            continue;
        };
        std::fs::write(directory.path().join(format!("import{number}.owl")), text).expect("written");
        catalog += &format!("<uri name=\"{iri}\" uri=\"import{number}.owl\"/>");
    }
    std::fs::write(directory.path().join("catalog-v001.xml"), catalog + "</catalog>").expect("written");
    let options =
        ReadOptions { allow_missing_imports: true, known: known.to_vec(), ..ReadOptions::default() };
    read_files(&[file], &options).map_err(|errors| errors[0].to_string())
}

fn engine(ontology: &Ontology) -> Result<Engine, String> {
    let mut symbols = Symbols::new();
    let lowered = lower_with(ontology, Equality::Owl, &mut symbols);
    Engine::new(symbols, lowered.program, lowered.facts).map_err(|errors| errors[0].to_string())
}

pub fn premises() -> Vec<(String, String)> {
    let Some(path) = data("real/owl_w3c/semantics-direct.rdf") else { return Vec::new() };
    let text = std::fs::read_to_string(path).expect("readable");
    let suite = Suite::read(&text);
    let cases = suite.0.iter().filter(|(_, properties)| properties.contains_key("identifier"));
    let premises = cases.filter_map(|(case, properties)| {
        let text = suite.text(case, "Premise").or_else(|| suite.text(case, "Input"))?;
        Some((properties["identifier"][0].replace('/', "-"), text.clone()))
    });
    premises.collect()
}

/// Evaluates the questions of a case. Returns the kind of each question, and `true` if the result is the W3C's.
fn decide(suite: &Suite, case: &str) -> Result<Vec<(&'static str, bool)>, String> {
    let kinds: BTreeSet<&str> =
        suite.all(case, "type").iter().filter_map(|kind| kind.strip_prefix(TEST)).collect();
    let premise = suite.text(case, "Premise").or_else(|| suite.text(case, "Input"));
    let Some(premise) = premise else { return Ok(Vec::new()) };
    let premise = read(suite, case, premise, &[])?;
    let engine = engine(&premise)?;
    let consistent = engine.violations().is_empty();
    let follows = |kind: &str| -> Result<Option<bool>, String> {
        let Some(text) = suite.text(case, kind) else { return Ok(None) };
        let conclusion = read(suite, case, text, &premise.entities)?;
        let mut results = entailments(&engine, &conclusion).map_err(|error| error.to_string())?;
        results.extend(annotations(&engine, &premise.annotations, &conclusion));
        Ok(Some(results.iter().all(|result| matches!(result.answer, Answer::Follows(_)))))
    };
    let mut answers = Vec::new();
    if kinds.contains("ConsistencyTest") {
        answers.push(("consistent", consistent));
    }
    if kinds.contains("InconsistencyTest") {
        answers.push(("inconsistent", !consistent));
    }
    if kinds.contains("PositiveEntailmentTest") {
        answers.extend(follows("Conclusion")?.map(|follows| ("entailed", follows)));
    }
    if kinds.contains("NegativeEntailmentTest") {
        answers.extend(follows("NonConclusion")?.map(|follows| ("not entailed", !follows)));
    }
    Ok(answers)
}

#[test]
#[ignore = "takes minutes without optimisation"]
fn results_agree_with_the_w3c_test_cases() {
    let Some(path) = data("real/owl_w3c/semantics-direct.rdf") else { return };
    let text = std::fs::read_to_string(path).expect("readable");
    let suite = Suite::read(&text);
    let mut open: BTreeSet<(&str, &str)> = OPEN.iter().map(|(name, kind, _)| (*name, *kind)).collect();
    let (mut counts, mut wrong) = (BTreeMap::<(bool, &str, bool), usize>::new(), Vec::new());
    let cases = suite.0.iter().filter(|(_, properties)| properties.contains_key("identifier"));
    for (case, properties) in cases {
        let name = &properties["identifier"][0];
        let rl = suite.all(case, "profile").iter().any(|profile| profile == &format!("{TEST}RL"));
        match decide(&suite, case) {
            Ok(answers) => {
                for (kind, right) in answers {
                    *counts.entry((rl, kind, right)).or_default() += 1;
                    if !right {
                        println!("{name}: {kind}: open");
                    }
                    let must = rl || ["consistent", "not entailed"].contains(&kind);
                    if !right && must && !open.remove(&(name.as_str(), kind)) {
                        wrong.push(format!("{name}: {kind}"));
                    }
                }
            }
            Err(error) => {
                *counts.entry((rl, "not read", false)).or_default() += 1;
                if rl {
                    wrong.push(format!("{name}: {error}"));
                } else {
                    println!("{name}: {error}");
                }
            }
        }
    }
    for ((rl, kind, right), count) in counts {
        let (profile, verdict) = (if rl { "RL" } else { "other" }, if right { "right" } else { "open" });
        println!("{profile}, {kind}, {verdict}: {count}");
    }
    assert_eq!(wrong, [""; 0]);
    // Exceptions that now have the W3C's result must be removed from `OPEN`.
    assert_eq!(open, BTreeSet::new());
}
