//! Damaged knowledge bases are read or rejected, and never stop the program.

use ontology::{ReadOptions, kb, lower, read_text};
use rules::Symbols;

struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}

fn survives(text: &str) -> bool {
    let Ok(ontology) = read_text(text, "damaged", &ReadOptions::default()) else { return false };
    lower(&ontology, &mut Symbols::new());
    true
}

#[test]
fn texts_with_exchanged_words_do_not_panic() {
    let words: Vec<&str> = kb::TOMASYS.split_inclusive(' ').collect();
    let mut numbers = Numbers(0x2545_F491_4F6C_DD1D);
    let mut accepted = 0;
    for _ in 0..300 {
        let mut damaged = words.clone();
        for _ in 0..=numbers.below(3) {
            let (from, to) = (numbers.below(words.len()), numbers.below(words.len()));
            damaged[to] = words[from];
        }
        accepted += usize::from(survives(&damaged.concat()));
    }
    assert!(accepted > 30, "{accepted} of 300 were still ontologies");
}

#[test]
fn truncated_texts_do_not_panic() {
    for end in (0..kb::TOMASYS.len()).step_by(97) {
        if let Some(text) = kb::TOMASYS.get(..end) {
            survives(text);
        }
    }
}

/// Returns the error message for one line of text that is not a document in any syntax.
fn garbage(length: usize) -> String {
    let text = "x".repeat(length);
    let errors = read_text(&text, "garbage", &ReadOptions::default()).expect_err("no document");
    assert!(errors.len() <= 10, "{} errors", errors.len());
    let longest = errors.iter().map(|error| error.to_string().len()).max().expect("an error");
    assert!(longest < 2_000, "a message of {longest} bytes");
    errors[0].to_string()
}

#[test]
fn a_long_line_of_garbage_is_rejected() {
    assert!(garbage(4_000_000).starts_with("garbage:1:"));
}

#[test]
#[ignore = "takes a gigabyte of memory"]
fn a_very_long_line_of_garbage_is_rejected() {
    assert!(garbage(200_000_000).starts_with("garbage:1:"));
}

#[cfg(unix)]
#[test]
fn cyclic_symbolic_links_terminate() {
    use std::os::unix::fs::symlink;
    let directory = tempfile::tempdir().expect("temporary directory");
    let (root, below) = (directory.path().join("root.ttl"), directory.path().join("below"));
    symlink(directory.path(), &below).expect("link");
    symlink(directory.path().join("b.ttl"), directory.path().join("a.ttl")).expect("link");
    symlink(directory.path().join("a.ttl"), directory.path().join("b.ttl")).expect("link");
    let header = "@prefix owl: <http://www.w3.org/2002/07/owl#> . <http://x> a owl:Ontology ; owl:imports";
    let options =
        ReadOptions { directories: vec![directory.path().to_owned(), below], ..ReadOptions::default() };
    for (import, code) in
        [("below/below/root.ttl", None), ("a.ttl", Some("O103")), ("http://elsewhere/a.ttl", Some("O103"))]
    {
        std::fs::write(&root, format!("{header} <{import}> .")).expect("written");
        let result = ontology::read_files(&[&root], &options);
        let actual = result.map_err(|errors| errors[0].code()).map(|ontology| ontology.sources.len());
        assert_eq!(actual, code.map_or(Ok(1), Err), "{import}");
    }
}

#[test]
fn malformed_documents_are_rejected_with_their_place() {
    let owl_xml = "<Ontology xmlns=\"http://www.w3.org/2002/07/owl#\" ontologyIRI=\"http://x\">\n";
    let functional = "Prefix(:=<http://x#>)\nOntology(<http://x>\n";
    for (text, expected) in [
        ("@prefix : <http://x#> .\n:a a :B .\n:c foo:bar :d .\n".to_owned(), "t:3:4: error[O102]"),
        ("<http://x> <http://y> \"open .\n".to_owned(), "t:1:23: error[O102]"),
        (
            "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n <rdf:Description x\n</rdf:RDF>"
                .to_owned(),
            "t:3:11: error[O102]",
        ),
        (format!("{owl_xml}<Declaration>\n<Class IRI=\"#a\"></Declaration></Ontology>"), "t:3:17: error[O102]"),
        // Regression: the reader allocated all memory.
        (format!("{owl_xml}<Declaration><Class IRI=\"#a>b\"/>"), "t:2:33: error[O102]"),
        (format!("{owl_xml}<Declaration><Klass IRI=\"#a\"/></Declaration></Ontology>"), "t:2:"),
        (format!("{functional}SubClassOf(:A foo:B)\n)"), "t:3:15: error[O102]"),
        (format!("{functional}SubClassOf(:A\n)"), "t:4:1: error[O102]"),
        (
            "@prefix owl: <http://www.w3.org/2002/07/owl#> .\n<http://x> a owl:Ontology ;\n  owl:imports <http://y> ."
                .to_owned(),
            "t:3:16: error[O103]",
        ),
    ] {
        let errors = read_text(&text, "t", &ReadOptions::default()).expect_err("malformed");
        assert!(errors[0].to_string().starts_with(expected), "{text}: {}", errors[0]);
    }
}

#[test]
fn an_undeclared_vocabulary_is_read_with_warnings() {
    let text = "@prefix : <http://x#> .\n:a a :Robot ; :carries :b ; :mass 2.5 .\n:b a :Load .\n";
    let ontology = read_text(text, "undeclared.ttl", &ReadOptions::default()).expect("readable");
    let codes: Vec<_> = ontology.warnings.iter().map(ontology::Warning::code).collect();
    assert_eq!(codes, ["O201"; 4], "{:?}", ontology.warnings);
    let mut shown: Vec<_> = ontology.warnings.iter().map(ToString::to_string).collect();
    shown.sort();
    for (warning, place) in shown.iter().zip(["2:16", "2:30", "2:7", "3:7"]) {
        assert!(
            warning.starts_with(&format!("undeclared.ttl:{place}: warning[O201]")),
            "{warning}, not {place}"
        );
    }
    let facts = lower(&ontology, &mut Symbols::new()).facts;
    assert_eq!(facts.len(), 4);
}
