//! Randomly damaged knowledge bases in all five syntaxes: each document is read or rejected within a time limit
//! and without a panic.

#![allow(clippy::print_stdout)] // a long run says how far it came

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use ontology::{OutputSyntax, ReadOptions, convert_files, lower, read_text};
use rules::Symbols;
use test_resources::data;

const OURS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/kb");

const SYNTAXES: [OutputSyntax; 5] = [
    OutputSyntax::RdfXml,
    OutputSyntax::Turtle,
    OutputSyntax::NTriples,
    OutputSyntax::OwlXml,
    OutputSyntax::Functional,
];

/// Time limit for one document; an undamaged one takes milliseconds.
const TIME_LIMIT: Duration = Duration::from_secs(20);

struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound.max(1) as u64) as usize
    }
}

fn seeds() -> Vec<Vec<u8>> {
    let ours = ["tomasys.ttl", "ugv.ttl"].map(|file| Path::new(OURS).join(file));
    let real = ["suave/suave.owl", "mros_ontology/mros.owl", "navigation_planta/navigation_with_imports.owl"];
    let directory = data("real/owl");
    let real = directory.iter().flat_map(|directory| real.map(|file| directory.join(file)));
    let files: Vec<PathBuf> = ours.into_iter().chain(real).collect();
    let options = ReadOptions { directories: directory.iter().cloned().collect(), ..ReadOptions::default() };
    let mut seeds: Vec<Vec<u8>> = files.iter().map(|file| std::fs::read(file).expect("readable")).collect();
    for file in &files {
        for syntax in SYNTAXES {
            seeds.push(convert_files(&[file], &options, syntax).expect("writable").0.into_bytes());
        }
    }
    seeds
}

/// Returns a copy with one or two changes, from single bytes to passages. A passage can come from the other
/// text.
fn damaged(seed: &[u8], other: &[u8], numbers: &mut Numbers) -> Vec<u8> {
    const BYTES: &[u8] = b"<>\"'&;:#@^_.,()[]{}/\\=! \n\0\xff0aZ";
    let mut text = seed.to_vec();
    for _ in 0..=numbers.below(4).saturating_sub(2) {
        let position = numbers.below(text.len());
        let end = (position + 1 + numbers.below(60)).min(text.len());
        match numbers.below(7) {
            0 => text.truncate(position),
            1 => drop(text.drain(position..end)),
            2 => {
                let passage = text[position..end].to_vec();
                let to = numbers.below(text.len());
                text.splice(to..to, passage);
            }
            3 => {
                let from = numbers.below(other.len());
                let passage = &other[from..(from + numbers.below(200)).min(other.len())];
                text.splice(position..end, passage.iter().copied());
            }
            4 => {
                let lines: Vec<&[u8]> = text.split_inclusive(|&byte| byte == b'\n').collect();
                let (first, second) = (numbers.below(lines.len()), numbers.below(lines.len()));
                let mut lines = lines.clone();
                if !lines.is_empty() {
                    lines.swap(first, second);
                }
                text = lines.concat();
            }
            _ if position < text.len() => text[position] = BYTES[numbers.below(BYTES.len())],
            _ => {}
        }
    }
    text
}

fn survives(text: &[u8]) -> (bool, Duration) {
    let start = Instant::now();
    let options = ReadOptions { allow_missing_imports: true, ..ReadOptions::default() };
    let read = read_text(&String::from_utf8_lossy(text), "damaged", &options);
    let accepted = read.is_ok_and(|ontology| !lower(&ontology, &mut Symbols::new()).program.rules.is_empty());
    (accepted, start.elapsed())
}

/// Damages random seeds until `enough` returns `true` for the number of cases. Returns the numbers of
/// cases and of accepted texts. A failing text remains in a file.
fn run(mut numbers: Numbers, enough: impl Fn(usize) -> bool) -> (usize, usize) {
    let seeds = seeds();
    let (mut cases, mut accepted) = (0, 0);
    while !enough(cases) {
        let (seed, other) = (&seeds[numbers.below(seeds.len())], &seeds[numbers.below(seeds.len())]);
        let text = damaged(seed, other, &mut numbers);
        let file = std::env::temp_dir().join(format!("metaplan-damaged-{}", std::process::id()));
        std::fs::write(&file, &text).expect("written");
        let (was_accepted, elapsed) = survives(&text);
        assert!(elapsed < TIME_LIMIT, "case {cases} took {elapsed:?}, see {}", file.display());
        std::fs::remove_file(&file).expect("removed");
        accepted += usize::from(was_accepted);
        cases += 1;
    }
    (cases, accepted)
}

#[test]
fn damaged_documents_do_not_panic() {
    let (cases, accepted) = run(Numbers(0x9E37_79B9_7F4A_7C15), |cases| cases == 60);
    assert!(accepted > cases / 20, "{accepted} of {cases} were still knowledge bases");
}

/// Command: `METAPLAN_CASES=100000 METAPLAN_SEED=7 cargo test --release -p metaplan-ontology --test all
/// mutations:: -- --ignored --nocapture`
#[test]
#[ignore = "the number of cases is METAPLAN_CASES"]
fn many_damaged_documents_do_not_panic() {
    let number = |name: &str, default: u64| {
        std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
    };
    let limit = number("METAPLAN_CASES", 5_000);
    let numbers = Numbers(number("METAPLAN_SEED", 1) | 1 << 40);
    let (cases, accepted) = run(numbers, |cases| cases as u64 >= limit);
    println!("{cases} damaged documents, {accepted} of them still knowledge bases");
}
