//! Knowledge bases that other reasoners evaluate wrongly, and documents that stop them, with the expected
//! verdicts. The files are outside of the project.

#![allow(clippy::needless_for_each, clippy::case_sensitive_file_extension_comparisons)]

use std::path::Path;
use std::time::{Duration, Instant};

use cpu_time::ThreadTime;

use ontology::{Equality, ReadOptions, lower_together, ntriples, read_files};
use rules::{Engine, Fact, Prefixes, Symbols, parse_rules};
use test_resources::{data, data_path};

enum Verdict {
    /// Consistent; the conclusions include these ones (in short form).
    Follows(&'static [&'static str]),
    Nothing,
    Inconsistent,
    /// Rejected with a message that contains all of these texts.
    Refused(&'static [&'static str]),
    /// A rule exceeds its budget, and a message reports it.
    Endless,
}

use Verdict::{Endless, Follows, Inconsistent, Nothing, Refused};

/// The files of `field/ontology` with their verdicts. The verdicts follow from OWL 2 (Direct Semantics if it
/// applies, otherwise the rules of OWL 2 RL), XSD 1.1, and the grammars of the syntaxes.
const FILES: [(&str, Verdict); 62] = [
    ("alldifferent-iri.ttl", Inconsistent),
    ("anonymous-header.ttl", Nothing),
    ("anyuri.ttl", Inconsistent),
    ("asym.ttl", Inconsistent),
    ("bnode.ofn", Nothing),
    ("bottom-property.ttl", Inconsistent),
    ("chain.ttl", Follows(&["a u c"])),
    ("dangling-restriction.ttl", Nothing),
    ("datarange-empty.ttl", Inconsistent),
    ("datetime-tz.ttl", Inconsistent),
    ("differs-from-itself.ttl", Inconsistent),
    ("differs-with-equality.ttl", Inconsistent),
    ("disjointunion.ttl", Inconsistent),
    ("entity-single-quote.owl", Nothing),
    ("entity.owx", Nothing),
    ("float-decimal.ttl", Inconsistent),
    ("funcdata-lang.ttl", Nothing),
    ("gyear-functional.ttl", Inconsistent),
    ("gyear.ttl", Nothing),
    ("header-type.ttl", Nothing),
    ("hexbinary.ttl", Nothing),
    ("illtyped.ttl", Inconsistent),
    ("inverse-anon.ttl", Follows(&["b p a"])),
    ("key.ttl", Follows(&["a sameAs b"])),
    ("langstring.ttl", Inconsistent),
    ("latin1.owl", Nothing),
    ("manchester.omn", Refused(&["manchester.omn:1:1", "O113", "Manchester"])),
    ("maxqcard.ttl", Follows(&["b sameAs c"])),
    ("metaclass.ttl", Follows(&["Eagle a Taxon"])),
    ("nan.ttl", Inconsistent),
    ("negprop.ttl", Inconsistent),
    // "a  b" is not a token. Collapsing white space changes only lexical forms, so the string is a value
    // outside of the datatype.
    ("normalized.ttl", Inconsistent),
    ("nothing-rule.ttl", Inconsistent),
    ("nothing.ttl", Inconsistent),
    ("owl1-complement.ttl", Inconsistent),
    ("owl1-intersection.ttl", Follows(&["i a C", "j a A", "j a B"])),
    ("owl1-oneof.ttl", Follows(&["i a C", "j a C"])),
    ("owl1-onerestriction.ttl", Follows(&["i a C"])),
    ("owl1-union.ttl", Follows(&["i a C"])),
    ("plainliteral.ttl", Nothing),
    ("propertychain3.ttl", Follows(&["a p c", "c p a", "a p a"])),
    ("punned-sameas-class.ttl", Follows(&["i a B"])),
    ("punned-subject.ttl", Follows(&["i q C"])),
    ("rational.ttl", Nothing),
    ("reflexive.ttl", Follows(&["i p i"])),
    ("restriction-inverse-maxqc.ttl", Follows(&["j sameAs k"])),
    ("restriction-inverse.ttl", Follows(&["j a C"])),
    ("shared-restriction-inverse-card.ttl", Follows(&["i a D"])),
    ("sniff-mailto-iri.nt", Nothing),
    ("sniff-tag-iri.nt", Nothing),
    ("subbottom.ttl", Inconsistent),
    ("subdata.ttl", Follows(&["i q \"5\"^^integer", "i a C"])),
    ("swrl-ind.ofn", Nothing),
    ("thing-body.ttl", Follows(&["p1 a Hit", "p2 a Hit"])),
    ("thing-equivalent-nothing.ttl", Inconsistent),
    ("thing-rule.ttl", Follows(&["p1 a Hit", "p2 a Hit"])),
    ("thing-sub.ttl", Follows(&["i a C"])),
    ("top-property.ttl", Follows(&["i a C"])),
    ("untyped-intersection.ttl", Follows(&["i a A", "i a B"])),
    ("untyped-restriction.ttl", Follows(&["i p v"])),
    // The value space of an undefined datatype is unknown.
    ("user-datatype.ttl", Nothing),
    ("user-datatype2.ttl", Inconsistent),
];

/// Two more files with verdicts, and files that stop other readers and reasoners.
const HOSTILE_FILES: [(&str, Verdict); 16] = [
    ("userdt-functional.ttl", Nothing),
    ("zeros.ttl", Inconsistent),
    ("hostile/01-lol.owl", Refused(&["01-lol.owl:1:", "O102", "entit"])),
    ("hostile/06b.ofn", Refused(&["06b.ofn:3:", "O112", "128"])),
    ("hostile/07b.ttl", Refused(&["07b.ttl", "O112", "128"])),
    ("hostile/12-cyc1.ttl", Nothing),
    ("hostile/12-cyc2.ttl", Nothing),
    ("hostile/14-utf16.ttl", Nothing),
    ("hostile/17-bom.ofn", Nothing),
    ("hostile/26-empty.owl", Refused(&["26-empty.owl:1:1", "O113", "empty"])),
    ("hostile/28-ws.ttl", Refused(&["28-ws.ttl:1:1", "O113", "empty"])),
    ("hostile/36-product.ttl", Nothing),
    ("hostile/37-alldiff.ttl", Inconsistent),
    ("hostile/38-disjoint.ttl", Inconsistent),
    ("hostile/43-badprefix.ofn", Refused(&["43-badprefix.ofn:2:", "O102", "`foo:`"])),
    ("hostile/47-regex.ttl", Nothing),
];

const EXPENSIVE_FILES: [(&str, Verdict); 3] = [
    ("hostile/40-trans.ttl", Follows(&["i0 p i1500", "i1 p i3"])),
    ("hostile/41-maxcard.ttl", Follows(&["i0 sameAs i1", "i7 sameAs i1000"])),
    ("hostile/42-swrl-runaway.ttl", Endless),
];

fn rules_of(path: &Path) -> Option<String> {
    let name = path.file_stem()?.to_str()?;
    let number = name.split('-').next()?;
    let candidates = [name, number].map(|stem| path.with_file_name(format!("{stem}.swrl")));
    candidates.iter().find_map(|file| std::fs::read_to_string(file).ok())
}

fn engine(path: &Path) -> Result<Engine, String> {
    let join = |errors: &[String]| errors.join("\n");
    let ontology = read_files(&[path], &ReadOptions::default())
        .map_err(|errors| join(&errors.iter().map(ToString::to_string).collect::<Vec<_>>()))?;
    let mut symbols = Symbols::new();
    let prefixes = Prefixes::default().with("", "http://x#");
    let rules = match rules_of(path) {
        Some(text) => {
            let prefixes =
                if path.ends_with("thing-rule.ttl") { prefixes.with("", "http://e#") } else { prefixes };
            parse_rules(&text, "rules", &mut symbols, &prefixes).expect("rules").rules
        }
        None => Vec::new(),
    };
    let lowered = lower_together(&ontology, rules, Equality::Owl, &mut symbols);
    Engine::new(symbols, lowered.program, lowered.facts)
        .map_err(|errors| join(&errors.iter().map(ToString::to_string).collect::<Vec<_>>()))
}

fn short(text: &str) -> Vec<String> {
    let term = |term: &str| match term.split_once("^^") {
        Some((value, datatype)) => format!("{value}^^{}", local(datatype)),
        None => local(term).to_owned(),
    };
    let line =
        |line: &str| line.trim_end_matches(" .").splitn(3, ' ').map(term).collect::<Vec<_>>().join(" ");
    text.lines().map(|text| line(text).replacen(" type ", " a ", 1)).collect()
}

fn local(term: &str) -> &str {
    let term = term.trim_matches(['<', '>']);
    term.rsplit(['#', '/']).next().unwrap_or(term)
}

fn check(file: &str, verdict: &Verdict) {
    let path = data_path("field/ontology").join(file);
    let (start, wall_start) = (ThreadTime::now(), Instant::now());
    let engine = engine(&path);
    match (verdict, engine) {
        (Refused(parts), Err(message)) => {
            assert!(parts.iter().all(|part| message.contains(part)), "{file}: {message}");
        }
        (Endless, Err(message)) => {
            assert!(message.contains("R301") && message.contains("#0 (r)"), "{message}");
        }
        (Inconsistent, Ok(engine)) => assert_ne!(engine.violations(), [], "{file}"),
        (Follows(_) | Nothing, Ok(engine)) => {
            assert_eq!(engine.violations(), [], "{file}");
            let derived: Vec<Fact> = engine.facts().filter(|fact| !engine.is_asserted(fact)).collect();
            let derived = short(&ntriples(engine.symbols(), &derived));
            match verdict {
                Follows(expected) => {
                    let missing = expected
                        .iter()
                        .find(|line| !derived.iter().any(|derived_line| derived_line == *line));
                    assert_eq!(missing, None, "{file}: {derived:?}");
                }
                _ => assert_eq!(derived, [""; 0], "{file}"),
            }
        }
        (_, Ok(_)) => panic!("{file} is not refused"),
        (_, Err(message)) => panic!("{file}: {message}"),
    }
    // Debug builds are ten times as slow. The wall-clock limit is generous because other processes may use the
    // machine.
    let (cpu_limit, wall_limit) =
        (Duration::from_secs(if cfg!(debug_assertions) { 60 } else { 5 }), Duration::from_secs(60));
    assert!(start.elapsed() < cpu_limit, "{file} took {:?} of processor time", start.elapsed());
    assert!(wall_start.elapsed() < wall_limit, "{file} took {:?}", wall_start.elapsed());
}

#[test]
fn every_file_has_its_verdict() {
    if data("field/ontology").is_none() {
        return;
    }
    for (file, verdict) in FILES.iter().chain(&HOSTILE_FILES) {
        check(file, verdict);
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "takes a minute without optimisation")]
fn expensive_files_finish_in_time() {
    if data("field/ontology").is_some() {
        EXPENSIVE_FILES.iter().for_each(|(file, verdict)| check(file, verdict));
    }
}

#[test]
fn every_file_is_in_the_table() {
    let Some(root) = data("field/ontology") else { return };
    for (directory, prefix) in [(root.clone(), ""), (root.join("hostile"), "hostile/")] {
        for entry in std::fs::read_dir(directory).expect("readable").filter_map(Result::ok) {
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if name.ends_with(".swrl") || name == "hostile" {
                continue;
            }
            assert!(
                FILES.iter().chain(&HOSTILE_FILES).chain(&EXPENSIVE_FILES).any(|(file, _)| *file == name),
                "{name}"
            );
        }
    }
}

/// Real files that were once rejected or misread, with their available imports.
#[test]
fn real_files_are_read() {
    let Some(root) = data("real/owl_field") else { return };
    let mut count = 0;
    for directory in std::fs::read_dir(root).expect("readable").filter_map(Result::ok) {
        for file in std::fs::read_dir(directory.path()).expect("readable").filter_map(Result::ok) {
            let options = ReadOptions { allow_missing_imports: true, ..ReadOptions::default() };
            let ontology = read_files(&[file.path()], &options);
            let ontology =
                ontology.unwrap_or_else(|errors| panic!("{}: {}", file.path().display(), errors[0]));
            assert!(!ontology.sources.is_empty());
            count += 1;
        }
    }
    assert!(count >= 16, "{count} files");
}
