//! What follows from ontologies of our own making, by metaplan and by `reasonable` (OWL 2 RL in Rust), side by side: user time and
//! peak memory of a process for each, from the file to all conclusions written as N-Triples.
//!
//! `cargo run --release` runs all. `--write DIRECTORY` leaves the universities there, as one document in N-Triples and as one
//! in RDF/XML for each department.

mod shapes;
mod university;

use std::path::{Path, PathBuf};
use std::process::Command;

use metaplan_rules::{Engine, Symbols};
use ontology::{ReadOptions, lower, ntriples, read_files};

/// Xorshift; the same numbers in each run.
pub struct Random(pub u64);

impl Random {
    /// Below a bound.
    pub fn below(&mut self, bound: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 33) as u32 % bound
    }
}

/// From so many names on, equal individuals are listed by pairs with the first.
const MANY_NAMES: usize = 32;

fn metaplan(files: &[PathBuf]) -> usize {
    let ontology = read_files(files, &ReadOptions::default()).expect("readable");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    drop(ontology);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules");
    let inferred: Vec<_> =
        engine.facts_in_brief(MANY_NAMES).filter(|fact| !engine.is_asserted(fact)).collect();
    let text = ntriples(engine.symbols(), &inferred);
    std::fs::write("/dev/null", text).expect("written");
    inferred.len()
}

fn reasonable(files: &[PathBuf]) -> usize {
    let mut reasoner = reasonable::reasoner::Reasoner::new();
    for file in files {
        reasoner.load_file(&file.to_string_lossy()).expect("readable");
    }
    let before = reasoner.get_input().len();
    reasoner.reason();
    let out = files[0].with_extension("out.n3");
    reasoner.dump_file(&out.to_string_lossy()).expect("written");
    reasoner.view_output().len().saturating_sub(before)
}

/// User time in seconds and peak memory in MB of this process.
fn usage() -> (f64, u64) {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = stat.rsplit(") ").next().unwrap_or_default();
    let ticks: f64 = after.split(' ').nth(11).and_then(|ticks| ticks.parse().ok()).unwrap_or(0.0);
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes: u64 = peak.and_then(|peak| peak.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0);
    (ticks / 100.0, kilobytes / 1024)
}

/// User time, memory and number of conclusions in a process of its own.
fn measure(peer: &str, files: &[PathBuf]) -> Option<(f64, u64, usize)> {
    let me = std::env::current_exe().expect("a program");
    let output = Command::new(me).arg("--child").arg(peer).args(files).output().expect("started");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut words = text.split_whitespace();
    Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?, words.next()?.parse().ok()?))
}

fn write(directory: &Path, documents: &[Vec<university::Triple>], name: &str) -> PathBuf {
    let file = directory.join(format!("{name}.ttl"));
    let text: String = documents.iter().map(|document| university::ntriples(document)).collect();
    std::fs::write(&file, text).expect("written");
    file
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map(String::as_str) {
        Some("--child") => {
            let files: Vec<PathBuf> = arguments[2..].iter().map(PathBuf::from).collect();
            let count = if arguments[1] == "metaplan" { metaplan(&files) } else { reasonable(&files) };
            let (seconds, megabytes) = usage();
            println!("{seconds} {megabytes} {count}");
        }
        Some("--write") => {
            let directory = PathBuf::from(&arguments[1]);
            let documents = university::universities(5);
            let text: String = documents.iter().map(|document| university::ntriples(document)).collect();
            std::fs::write(directory.join("universities.nt"), text).expect("written");
            for (number, document) in documents.iter().enumerate() {
                let file = directory.join(format!("university{number}.rdf"));
                std::fs::write(file, university::rdf_xml(document)).expect("written");
            }
        }
        _ => compare(),
    }
}

fn compare() {
    let directory = std::env::temp_dir().join(format!("metaplan-peers-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a directory");
    let (one, five) = (university::universities(1), university::universities(5));
    let mut cases = vec![
        ("a department", write(&directory, &five[..2], "department")),
        ("5 departments", write(&directory, &five[..6], "departments")),
        ("1 university", write(&directory, &one, "university")),
        ("5 universities", write(&directory, &five, "universities")),
    ];
    for (name, text) in shapes::all() {
        let file = directory.join(format!("{}.ttl", name.replace(' ', "-")));
        std::fs::write(&file, text).expect("written");
        cases.push((name, file));
    }
    println!("| ontology | metaplan | reasonable | ratio | conclusions |\n|---|---|---|---|---|");
    let mut ratios = Vec::new();
    for (name, file) in &cases {
        let files = [file.clone()];
        let (Some(own), Some(other)) = (measure("metaplan", &files), measure("reasonable", &files)) else {
            println!("| {name} | failed | | | |");
            continue;
        };
        let ratio = other.0 / own.0.max(0.01);
        ratios.push(ratio);
        println!(
            "| {name} | {:.2} s, {} MB | {:.2} s, {} MB | {ratio:.1} | {} / {} |",
            own.0, own.1, other.0, other.1, own.2, other.2
        );
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "median of {}: {:.1}",
        ratios.len(),
        (ratios[(ratios.len() - 1) / 2] + ratios[ratios.len() / 2]) / 2.0
    );
    let _ = std::fs::remove_dir_all(&directory);
}
