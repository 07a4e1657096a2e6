//! The recorded knowledge bases with what Pellet and an independent closure inferred: ours must infer the same.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use ontology::{ANONYMOUS, INTERNAL, ReadOptions, lower, read_files, vocab};
use rules::{Engine, Fact, Literal, Symbols};
use serde_json::Value;

const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared");

/// Cases that are not compared, each with the reason.
const SKIPPED: [(&str, &str); 3] = [
    ("suave_26_second_cycle_latched", LATCHED),
    ("suave_27_second_cycle_status_removed_latched", LATCHED),
    ("suave_28_second_cycle_visibility_back_latched", LATCHED),
];

const LATCHED: &str = "a second cycle, after the conclusions of a first one were asserted; the case lists neither \
                       those nor what changed between";

#[test]
fn golden_cases_infer_what_the_reference_infers() {
    let directory = Path::new(SHARED).join("golden/kb");
    let Ok(entries) = std::fs::read_dir(&directory) else {
        println!("skipped: {} is not there", directory.display());
        return;
    };
    let mut files: Vec<PathBuf> = entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    files.sort();
    let failures: Vec<String> = files.iter().filter_map(|file| check(file).err()).collect();
    assert!(
        failures.is_empty(),
        "{} of {} cases differ:\n{}",
        failures.len(),
        files.len(),
        failures.join("\n")
    );
}

/// Compares one case; the message says what differs.
fn check(file: &Path) -> Result<(), String> {
    let case: Value = serde_json::from_str(&std::fs::read_to_string(file).expect("readable")).expect("JSON");
    let name = case["case"].as_str().expect("case").to_owned();
    if let Some((_, reason)) = SKIPPED.iter().find(|(skipped, _)| *skipped == name) {
        println!("{name} skipped: {reason}");
        return Ok(());
    }
    let (engine, consistent) = evaluate(&case);
    let reference = &case["reference"];
    if reference["consistent"] != consistent {
        return Err(format!("{name}: consistent {consistent}, expected {}", reference["consistent"]));
    }
    if !consistent {
        return Ok(());
    }
    let ours = inferred(&engine);
    let mut symbols = engine.symbols().clone();
    let expected: BTreeSet<String> = triples(&reference["inferred"])
        .iter()
        .map(|triple| fact(triple, &mut symbols).display(&symbols).to_string())
        .collect();
    let missing: Vec<_> = expected.difference(&ours).collect();
    let extra: Vec<_> = ours.difference(&expected).collect();
    if missing.is_empty() && extra.is_empty() {
        return Ok(());
    }
    Err(format!("{name}: missing {missing:#?}, extra {extra:#?}"))
}

/// The knowledge base of a case with its changes, closed.
fn evaluate(case: &Value) -> (Engine, bool) {
    let real = Path::new(SHARED).join("real/owl");
    let mut files: Vec<PathBuf> = case["kb"]
        .as_array()
        .expect("kb")
        .iter()
        .map(|file| real.join(file.as_str().expect("file")))
        .collect();
    let added = tempfile::Builder::new().suffix(".nt").tempfile().expect("temporary file");
    let text: String = triples(&case["added"]).iter().map(|triple| ntriple(triple)).collect();
    std::fs::write(added.path(), text).expect("written");
    files.push(added.path().to_owned());
    let options = ReadOptions { directories: vec![real], ..ReadOptions::default() };
    let ontology = read_files(&files, &options).expect("the case is readable");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    let removed: Vec<Fact> =
        triples(&case["removed"]).iter().map(|triple| fact(triple, &mut symbols)).collect();
    let facts = lowered.facts.into_iter().filter(|fact| !removed.contains(fact));
    let engine = Engine::new(symbols, lowered.program, facts).expect("the rules are safe");
    let consistent = engine.violations().is_empty();
    (engine, consistent)
}

/// Types and property values of named individuals that follow and are not stated.
fn inferred(engine: &Engine) -> BTreeSet<String> {
    let symbols = engine.symbols();
    let shown = |fact: &Fact| {
        let name = |symbol| symbols.value(symbol).as_name();
        let predicate = name(fact.predicate).unwrap_or_default();
        !engine.is_asserted(fact)
            && !predicate.starts_with(INTERNAL)
            && ![vocab::owl::SAME_AS, vocab::owl::DIFFERENT_FROM].contains(&predicate)
            && !name(fact.arguments[0]).is_none_or(|subject| subject.starts_with(ANONYMOUS))
    };
    engine.facts().filter(shown).map(|fact| fact.display(symbols).to_string()).collect()
}

type Triple = [String; 3];

fn triples(value: &Value) -> Vec<Triple> {
    let text = |term: &Value| term.as_str().expect("term").to_owned();
    let list = value.as_array().map_or(&[][..], Vec::as_slice);
    list.iter().map(|triple| [text(&triple[0]), text(&triple[1]), text(&triple[2])]).collect()
}

fn ntriple([subject, predicate, object]: &Triple) -> String {
    let object = if object.starts_with('"') { object.clone() } else { format!("<{object}>") };
    format!("<{subject}> <{predicate}> {object} .\n")
}

/// A triple of a case as the fact that it becomes.
fn fact([subject, predicate, object]: &Triple, symbols: &mut Symbols) -> Fact {
    let subject = symbols.name(subject);
    if predicate == vocab::rdf::TYPE {
        return Fact::new(symbols.name(object), [subject]);
    }
    let predicate = symbols.name(predicate);
    let Some(quoted) = object.strip_prefix('"') else {
        let object = symbols.name(object);
        return Fact::new(predicate, [subject, object]);
    };
    let (lexical, rest) = quoted.rsplit_once('"').expect("closing quote");
    let datatype = rest.strip_prefix("^^<").and_then(|iri| iri.strip_suffix('>'));
    let literal = symbols.literal(Literal::parse(lexical, datatype, rest.strip_prefix('@')));
    Fact::new(predicate, [subject, literal])
}
