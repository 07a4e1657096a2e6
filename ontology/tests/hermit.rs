//! Checks that HermiT entails a sample of at most 60 conclusions about each real knowledge base, and about the
//! premises of each test case of the W3C.
//!
//! HermiT is a complete reasoner for OWL 2 DL and reads documents with the OWL API. Documents with imports or
//! undeclared entities are converted first, because the OWL API reads undeclared properties as annotation
//! properties. A conclusion that HermiT does not entail is unsound, unless the OWL API reads the document
//! differently (see `DIFFERENT`). A contradiction that only HermiT finds may be outside of OWL 2 RL.
//!
//! ```sh
//! apt-get install openjdk-17-jdk-headless
//! python3 -m venv hermit && hermit/bin/pip install owlready2
//! METAPLAN_PYTHON=$PWD/hermit/bin/python cargo test -p metaplan-ontology hermit -- --ignored --nocapture
//! ```

#![allow(clippy::print_stdout, clippy::doc_markdown, clippy::format_push_string)] // counts are printed; HermiT is a name

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use ontology::{EntityKind, INTERNAL, OutputSyntax, ReadOptions, convert_files, lower, ntriples, read_files};
use rules::{Engine, Fact, Symbols};
use test_resources::data_path;

use crate::w3c::premises;

const MAX_CONCLUSIONS: usize = 60;

/// Documents that are inconsistent according to the W3C and consistent according to HermiT, with the reason.
const DIFFERENT: [(&str, &str); 2] = [
    (
        "rdfbased-sem-eqdis-different-irrflxv",
        "the OWL API reads DifferentIndividuals(x x) as an axiom about one individual",
    ),
    (
        "rdfbased-sem-eqdis-disprop-irrflxv",
        "the OWL API reads DisjointObjectProperties(p p) as an axiom about one property",
    ),
];

fn class_path() -> String {
    let python = std::env::var("METAPLAN_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = "import owlready2.reasoning as r; print(r._HERMIT_CLASSPATH)";
    let output = Command::new(python).args(["-c", script]).output().expect("Python");
    let class_path = String::from_utf8(output.stdout).expect("UTF-8").trim().to_owned();
    assert!(!class_path.is_empty(), "METAPLAN_PYTHON has no owlready2; see the head of this file");
    class_path
}

fn documents(folder: &Path, paths: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        if path.is_dir() {
            documents(&path, paths);
        } else if ["owl", "ttl", "rdf"].contains(&extension) {
            paths.push(path);
        }
    }
}

struct Conclusions {
    is_consistent: bool,
    /// A Turtle document of conclusions with declarations.
    text: String,
    /// The document with declarations and imports, if it lacks some of them.
    declared: Option<String>,
}

fn conclusions(document: &Path) -> Option<Conclusions> {
    let options = ReadOptions { allow_missing_imports: true, ..ReadOptions::default() };
    let ontology = read_files(&[document], &options).ok()?;
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).ok()?;
    let facts: Vec<Fact> = engine.facts().filter(|fact| !engine.is_asserted(fact)).collect();
    let text = ntriples(engine.symbols(), &facts);
    let named: Vec<&str> = text.lines().filter(|line| !line.contains(INTERNAL)).collect();
    let every = named.len().div_ceil(MAX_CONCLUSIONS).max(1);
    let mut text = named.into_iter().step_by(every).collect::<Vec<_>>().join("\n") + "\n";
    let owl = "http://www.w3.org/2002/07/owl#";
    for (kind, iri) in &ontology.entities {
        let class = match kind {
            EntityKind::Class => "Class",
            EntityKind::ObjectProperty => "ObjectProperty",
            EntityKind::DataProperty => "DatatypeProperty",
            _ => continue,
        };
        if !iri.starts_with(owl) {
            text += &format!("<{iri}> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <{owl}{class}> .\n");
        }
    }
    let imports = ontology.sources.len() > 1;
    let declared =
        if imports || ontology.warnings.iter().any(|warning| ["O201", "O202"].contains(&warning.code())) {
            Some(convert_files(&[document], &options, OutputSyntax::Functional).ok()?.0)
        } else {
            None
        };
    Some(Conclusions { is_consistent: engine.violations().is_empty(), text, declared })
}

#[test]
#[ignore = "needs HermiT and Java, and takes minutes"]
fn sampled_conclusions_are_entailed() {
    let class_path = class_path();
    let directory = tempfile::tempdir().expect("a folder");
    let mut files = Vec::new();
    for folder in ["owl", "owl_field"] {
        documents(&data_path("real").join(folder), &mut files);
    }
    files.sort();
    for (name, text) in premises() {
        let file = directory.path().join(format!("{name}.owl"));
        std::fs::write(&file, text).expect("written");
        files.push(file);
    }
    let mut input = String::new();
    let mut asked: Vec<(PathBuf, bool)> = Vec::new();
    for (number, file) in files.iter().enumerate() {
        let Some(found) = conclusions(file) else { continue };
        let conclusion = directory.path().join(format!("conclusion{number}.ttl"));
        std::fs::write(&conclusion, found.text).expect("written");
        let mut premise = file.clone();
        if let Some(text) = found.declared {
            premise = directory.path().join(format!("declared{number}.ofn"));
            std::fs::write(&premise, text).expect("written");
        }
        input += &format!("{}\t{}\n", premise.display(), conclusion.display());
        asked.push((file.clone(), found.is_consistent));
    }
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hermit/Entailed.java");
    let mut hermit = Command::new("java")
        .args(["-Xmx1500m", "-cp", &class_path, source])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("Java");
    let mut stdin = hermit.stdin.take().expect("piped");
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
    let output = hermit.wait_with_output().expect("Java");
    writer.join().expect("written").expect("written");
    let answers = String::from_utf8_lossy(&output.stdout).into_owned();
    let answers: Vec<&str> = answers.lines().collect();
    assert_eq!(answers.len(), asked.len(), "an answer for each document");
    let (mut counts, mut entailed, mut wrong) = (BTreeMap::<&str, usize>::new(), 0, Vec::new());
    for ((file, is_consistent), answer) in asked.iter().zip(answers) {
        let mut parts = answer.split('\t');
        let first = parts.next().unwrap_or_default();
        let kind = match (first, is_consistent) {
            ("inconsistent", true) => "inconsistent for HermiT only",
            ("inconsistent", false) => "inconsistent for both",
            (error, _) if error.starts_with("error ") => "refused by HermiT",
            (_, false) => "inconsistent for us only",
            _ => "compared",
        };
        *counts.entry(kind).or_default() += 1;
        if kind == "inconsistent for us only" {
            wrong.push(format!("{}: consistent", file.display()));
        } else if kind == "compared" {
            entailed += first.parse::<usize>().expect("a number");
            wrong.extend(parts.map(|axiom| format!("{}: {axiom}", file.display())));
        } else if kind != "inconsistent for both" {
            println!("{}: {answer}", file.display());
        }
    }
    println!("{} documents: {counts:?}; {entailed} conclusions entailed", asked.len());
    wrong.retain(|text| !DIFFERENT.iter().any(|(part, _)| text.contains(part)));
    assert!(wrong.is_empty(), "not entailed:\n{}", wrong.join("\n"));
    assert!(counts["compared"] >= 300, "documents are missing: {counts:?}");
}
