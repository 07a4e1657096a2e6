//! Compares metaplan with `reasonable` (OWL 2 RL in Rust) on generated ontologies: processor time and peak
//! memory of a process, from the file to the number of conclusions. Also measures parsing alone, and both
//! programs with all conclusions written as sorted N-Triples. Most of the writing time of `reasonable` is
//! system time, because its output is unbuffered.
//!
//! `cargo run --release` runs everything. With Turtle (`.ttl`) or N-Triples (`.n3`) files as arguments, it runs
//! these. With `--write DIRECTORY`, it writes the ontologies to the directory, and in addition five universities in
//! RDF/XML, with one file for the schema and one per department.

mod shapes;
mod university;

use std::path::{Path, PathBuf};
use std::process::Command;

use metaplan_rules::{Engine, Symbols};
use ontology::{ReadOptions, lower, ntriples, read_files};

pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, bound: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 33) as u32 % bound
    }
}

/// Maximum number of names of one individual for which all equalities are listed. Of more names, only the
/// equalities with the first name are listed.
const MANY_NAMES: usize = 32;

fn metaplan(files: &[PathBuf], write: bool) -> usize {
    let ontology = read_files(files, &ReadOptions::default()).expect("readable");
    let mut symbols = Symbols::new();
    let lowered = lower(&ontology, &mut symbols);
    drop(ontology);
    let engine = Engine::new(symbols, lowered.program, lowered.facts).expect("safe rules");
    let inferred = engine.inferred_in_brief(MANY_NAMES);
    if write {
        let text = ntriples(engine.symbols(), &inferred);
        std::fs::write(files[0].with_extension("out.nt"), text).expect("written");
    }
    inferred.len()
}

fn reasonable(files: &[PathBuf], write: bool) -> usize {
    let mut reasoner = reasonable::reasoner::Reasoner::new();
    for file in files {
        reasoner.load_file(&file.to_string_lossy()).expect("readable");
    }
    let before = reasoner.get_input().len();
    reasoner.reason();
    if write {
        let out = files[0].with_extension("out.n3");
        reasoner.dump_file(&out.to_string_lossy()).expect("written");
    }
    reasoner.view_output().len().saturating_sub(before)
}

/// Parses the files with oxttl, the parser that metaplan uses, and returns the number of triples. The
/// remaining time of metaplan is the construction of axioms and reasoning.
fn parse(files: &[PathBuf]) -> usize {
    let parse = |file: &PathBuf| {
        let text = std::fs::read(file).expect("readable");
        if text.starts_with(b"@prefix") {
            oxttl::TurtleParser::new().for_slice(&text).count()
        } else {
            oxttl::NTriplesParser::new().lenient().for_slice(&text).count()
        }
    };
    files.iter().map(parse).sum()
}

/// Returns the processor time in seconds and the peak memory in MB of this process.
fn usage() -> (f64, u64) {
    let time = cpu_time::ProcessTime::now().as_duration().as_secs_f64();
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes: u64 = peak.and_then(|peak| peak.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0);
    (time, kilobytes / 1024)
}

/// Number of runs of a program that takes less than a second. The fastest run counts, because other load on the
/// machine only makes runs slower.
const RUNS: usize = 3;

/// Returns processor time in seconds, peak memory in MB and the number of conclusions of a separate process.
fn measure(peer: &str, files: &[PathBuf]) -> Option<(f64, u64, usize)> {
    let program = std::env::current_exe().expect("a program");
    let run = || {
        let output = Command::new(&program).arg("--child").arg(peer).args(files).output().expect("started");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let mut words = text.split_whitespace();
        Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?, words.next()?.parse().ok()?))
    };
    let mut best: (f64, u64, usize) = run()?;
    for _ in 1..RUNS {
        if best.0 < 1.0 {
            best = Some(run()?).filter(|again| again.0 < best.0).unwrap_or(best);
        }
    }
    Some(best)
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
            let count = match arguments[1].as_str() {
                "metaplan" => metaplan(&files, false),
                "metaplan-writes" => metaplan(&files, true),
                "reasonable-writes" => reasonable(&files, true),
                "parse" => parse(&files),
                _ => reasonable(&files, false),
            };
            let (seconds, megabytes) = usage();
            println!("{seconds} {megabytes} {count}");
        }
        Some("--write") => {
            let directory = PathBuf::from(&arguments[1]);
            write_all(&directory);
            for (number, document) in university::universities(5).iter().enumerate() {
                let file = directory.join(format!("university{number}.rdf"));
                std::fs::write(file, university::rdf_xml(document)).expect("written");
            }
        }
        Some(_) => compare(arguments.iter().map(|file| (file.clone(), PathBuf::from(file))).collect()),
        None => {
            let directory = std::env::temp_dir().join(format!("metaplan-peers-{}", std::process::id()));
            std::fs::create_dir_all(&directory).expect("a directory");
            compare(write_all(&directory));
            let _ = std::fs::remove_dir_all(&directory);
        }
    }
}

fn write_all(directory: &Path) -> Vec<(String, PathBuf)> {
    let (one, five) = (university::universities(1), university::universities(5));
    let mut cases = vec![
        ("a department".to_owned(), write(directory, &five[..2], "department")),
        ("5 departments".to_owned(), write(directory, &five[..6], "departments")),
        ("1 university".to_owned(), write(directory, &one, "university")),
        ("5 universities".to_owned(), write(directory, &five, "universities")),
    ];
    for (name, text) in shapes::all() {
        let file = directory.join(format!("{}.ttl", name.replace(' ', "-")));
        std::fs::write(&file, text).expect("written");
        cases.push((name.to_owned(), file));
    }
    cases
}

fn compare(cases: Vec<(String, PathBuf)>) {
    println!("| ontology | metaplan | of which parsing | reasonable | ratio | written, too | conclusions |");
    println!("|---|---|---|---|---|---|---|");
    let (mut ratios, mut ratios_with_writing) = (Vec::new(), Vec::new());
    for (name, file) in cases {
        let files = [file];
        let peers = ["metaplan", "parse", "reasonable", "metaplan-writes", "reasonable-writes"];
        let [
            Some(metaplan_run),
            Some(parse_run),
            Some(reasonable_run),
            Some(metaplan_writing),
            Some(reasonable_writing),
        ] = peers.map(|peer| measure(peer, &files))
        else {
            println!("| {name} | failed | | | | | |");
            continue;
        };
        let (ratio, ratio_all) =
            (reasonable_run.0 / metaplan_run.0, reasonable_writing.0 / metaplan_writing.0);
        ratios.push(ratio);
        ratios_with_writing.push(ratio_all);
        println!(
            "| {name} | {:.3} s, {} MB | {:.3} s | {:.3} s, {} MB | {ratio:.1} | {:.3} / {:.3} s: {ratio_all:.1} | {} / {} |",
            metaplan_run.0,
            metaplan_run.1,
            parse_run.0,
            reasonable_run.0,
            reasonable_run.1,
            metaplan_writing.0,
            reasonable_writing.0,
            metaplan_run.2,
            reasonable_run.2
        );
    }
    println!(
        "median of {}: {:.1}, with writing {:.1}",
        ratios.len(),
        median(&mut ratios),
        median(&mut ratios_with_writing)
    );
}

fn median(ratios: &mut [f64]) -> f64 {
    ratios.sort_by(f64::total_cmp);
    f64::midpoint(ratios[(ratios.len() - 1) / 2], ratios[ratios.len() / 2])
}
