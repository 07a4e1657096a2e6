//! Knowledge bases in all five syntaxes, damaged at random: each is read or rejected, soon, and never with a panic.

#![allow(clippy::print_stdout)] // a long run says how far it came

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use ontology::{OutputSyntax, ReadOptions, convert_files, lower, read_text};
use rules::Symbols;

const REAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/real/owl");
const OURS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/kb");

const SYNTAXES: [OutputSyntax; 5] = [
    OutputSyntax::RdfXml,
    OutputSyntax::Turtle,
    OutputSyntax::NTriples,
    OutputSyntax::OwlXml,
    OutputSyntax::Functional,
];

/// Longer than this is a hang: an undamaged one takes milliseconds.
const PATIENCE: Duration = Duration::from_secs(20);

/// A small generator of numbers (xorshift), the same on every machine.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound.max(1) as u64) as usize
    }
}

/// Our own and real knowledge bases, each in every syntax.
fn seeds() -> Vec<Vec<u8>> {
    let ours = ["tomasys.ttl", "ugv.ttl"].map(|file| Path::new(OURS).join(file));
    let real = ["suave/suave.owl", "mros_ontology/mros.owl", "navigation_planta/navigation_with_imports.owl"];
    let real = real.map(|file| Path::new(REAL).join(file));
    let files: Vec<PathBuf> = ours.into_iter().chain(real).filter(|file| file.is_file()).collect();
    let options = ReadOptions { directories: vec![REAL.into()], ..ReadOptions::default() };
    let mut seeds: Vec<Vec<u8>> = files.iter().map(|file| std::fs::read(file).expect("readable")).collect();
    for file in &files {
        for syntax in SYNTAXES {
            seeds.push(convert_files(&[file], &options, syntax).expect("writable").0.into_bytes());
        }
    }
    seeds
}

/// A copy with a few changes, of single bytes up to passages, some taken from another text.
fn damaged(seed: &[u8], other: &[u8], numbers: &mut Numbers) -> Vec<u8> {
    const BYTES: &[u8] = b"<>\"'&;:#@^_.,()[]{}/\\=! \n\0\xff0aZ";
    let mut text = seed.to_vec();
    for _ in 0..=numbers.below(4).saturating_sub(2) {
        let at = numbers.below(text.len());
        let end = (at + 1 + numbers.below(60)).min(text.len());
        match numbers.below(7) {
            0 => text.truncate(at),
            1 => drop(text.drain(at..end)),
            2 => {
                let passage = text[at..end].to_vec();
                let to = numbers.below(text.len());
                text.splice(to..to, passage);
            }
            3 => {
                let from = numbers.below(other.len());
                let passage = &other[from..(from + numbers.below(200)).min(other.len())];
                text.splice(at..end, passage.iter().copied());
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
            _ if at < text.len() => text[at] = BYTES[numbers.below(BYTES.len())],
            _ => {}
        }
    }
    text
}

/// Reads and lowers; whether the text was accepted, and what it took.
fn survives(text: &[u8]) -> (bool, Duration) {
    let start = Instant::now();
    let options = ReadOptions { allow_missing_imports: true, ..ReadOptions::default() };
    let read = read_text(&String::from_utf8_lossy(text), "damaged", &options);
    let accepted = read.is_ok_and(|ontology| !lower(&ontology, &mut Symbols::new()).program.rules.is_empty());
    (accepted, start.elapsed())
}

/// Damages seeds until `enough` is true of the number of cases, and keeps what is wrong in a file.
fn run(mut numbers: Numbers, enough: impl Fn(usize) -> bool) -> (usize, usize) {
    let seeds = seeds();
    let (mut cases, mut accepted) = (0, 0);
    while !enough(cases) {
        let (seed, other) = (&seeds[numbers.below(seeds.len())], &seeds[numbers.below(seeds.len())]);
        let text = damaged(seed, other, &mut numbers);
        let kept = std::env::temp_dir().join(format!("metaplan-damaged-{}", std::process::id()));
        std::fs::write(&kept, &text).expect("written");
        let (was_accepted, took) = survives(&text);
        assert!(took < PATIENCE, "case {cases} took {took:?}, see {}", kept.display());
        std::fs::remove_file(&kept).expect("removed");
        accepted += usize::from(was_accepted);
        cases += 1;
    }
    (cases, accepted)
}

#[test]
fn a_few_damaged_documents() {
    let (cases, accepted) = run(Numbers(0x9E37_79B9_7F4A_7C15), |cases| cases == 60);
    assert!(accepted > cases / 20, "{accepted} of {cases} were still knowledge bases");
}

/// `METAPLAN_SECONDS=900 METAPLAN_SEED=7 cargo test --release -p metaplan-ontology --test all mutations:: -- --ignored --nocapture`
#[test]
#[ignore = "runs as long as METAPLAN_SECONDS says"]
fn many_damaged_documents() {
    let number = |name: &str, default: u64| {
        std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
    };
    let (start, limit) = (Instant::now(), Duration::from_secs(number("METAPLAN_SECONDS", 60)));
    let numbers = Numbers(number("METAPLAN_SEED", 1) | 1 << 40);
    let (cases, accepted) = run(numbers, |_| start.elapsed() >= limit);
    println!("{cases} damaged documents, {accepted} of them still knowledge bases");
}
