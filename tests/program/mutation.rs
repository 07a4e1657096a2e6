//! Tests of randomly changed certificates: every claim that is accepted must be true.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::certificate::{MISSIONS, certificate, change, verify};
use crate::common::metaplan;

struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % limit as u64) as usize
    }
}

fn mutate(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let line = random.below(lines.len());
    match random.below(6) {
        0 => drop(lines.remove(line)),
        1 => lines.insert(line, lines[line]),
        2 => {
            let other_line = random.below(lines.len());
            lines.swap(line, other_line);
        }
        _ => {
            let is_part = |c: char| c.is_alphanumeric() || "_-.".contains(c);
            let words: Vec<(usize, &str)> = text
                .match_indices(is_part)
                .filter(|(at, _)| !text[..*at].ends_with(is_part))
                .map(|(at, _)| (at, text[at..].split(|c| !is_part(c)).next().unwrap_or_default()))
                .collect();
            let (at, word) = words[random.below(words.len())];
            let is_number = word.bytes().all(|byte| byte.is_ascii_digit());
            let replacement = words[random.below(words.len())].1.to_owned();
            let numbers = ["0", "1", "7", "-1", "9999"];
            let replacement =
                if is_number { numbers[random.below(numbers.len())].to_owned() } else { replacement };
            return format!("{}{replacement}{}", &text[..at], &text[at + word.len()..]);
        }
    }
    lines.concat()
}

/// Kinds of changes to a certificate. All except the last are targeted; the last one changes a random part of
/// a random file.
const KINDS: [&str; 14] = [
    "literal of the formula",
    "literal of the proof",
    "proof step",
    "hint",
    "legend",
    "cost",
    "potential",
    "plan step",
    "availability fact",
    "derivation step",
    "ground task",
    "hash",
    "claim",
    "anything",
];

struct Original {
    directory: tempfile::TempDir,
    target: PathBuf,
    files: BTreeMap<String, String>,
}

impl Original {
    fn new(arguments: &[&str]) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let target = PathBuf::from(certificate(directory.path(), arguments));
        let entries = std::fs::read_dir(&target).expect("files").map(|entry| entry.expect("an entry").path());
        let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
        let read = |path: PathBuf| (name(&path), std::fs::read_to_string(path).expect("a file"));
        let files = entries.map(read).collect();
        Self { directory, target, files }
    }

    fn restore(&self) {
        for (name, text) in &self.files {
            std::fs::write(self.target.join(name), text).expect("a file");
        }
    }
}

fn change_line(text: &str, random: &mut Random, is_candidate: &dyn Fn(&str) -> bool) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let candidates: Vec<usize> = (0..lines.len()).filter(|at| is_candidate(lines[*at])).collect();
    if candidates.is_empty() {
        return text.to_owned();
    }
    let line = candidates[random.below(candidates.len())];
    match random.below(3) {
        0 => lines.insert(line, lines[line]),
        _ => drop(lines.remove(line)),
    }
    lines.concat()
}

/// Inverts the sign of a random number that is neither in the first line nor the last one of its line.
fn flip(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    if lines.len() < 2 {
        return text.to_owned();
    }
    let line = 1 + random.below(lines.len() - 1);
    let mut words: Vec<String> = lines[line].split(' ').map(str::to_owned).collect();
    if words.len() > 1 {
        let word = random.below(words.len() - 1);
        words[word] =
            words[word].strip_prefix('-').map_or_else(|| format!("-{}", words[word]), str::to_owned);
    }
    lines[line] = words.join(" ");
    lines.join("\n") + "\n"
}

/// Changes a random number under a key of a JSON document: by one, to its double, or to zero.
fn change_number(document: &mut Value, key: &str, random: &mut Random) {
    fn numbers<'v>(value: &'v mut Value, key: &str, inside: bool, values: &mut Vec<&'v mut Value>) {
        match value {
            Value::Array(elements) => {
                for element in elements {
                    numbers(element, key, inside, values);
                }
            }
            Value::Object(fields) => {
                fields
                    .iter_mut()
                    .for_each(|(name, element)| numbers(element, key, inside || name == key, values));
            }
            // A potential is null if no goal state is reachable.
            Value::Number(_) | Value::Null if inside => values.push(value),
            _ => {}
        }
    }
    let mut values = Vec::new();
    numbers(document, key, false, &mut values);
    if !values.is_empty() {
        let position = random.below(values.len());
        let value = &mut *values[position];
        let previous = value.as_i64().unwrap_or_default();
        *value = [json!(previous + 1), json!(previous - 1), json!(2 * previous), json!(0)][random.below(4)]
            .clone();
    }
}

fn edit_json(text: &str, edit: impl FnOnce(&mut Value)) -> String {
    let original: Value = serde_json::from_str(text).expect("JSON");
    let mut document = original.clone();
    edit(&mut document);
    if document == original { text.to_owned() } else { document.to_string() }
}

fn mutant(kind: &str, original: &Original, random: &mut Random) -> (String, String) {
    let name = match kind {
        "literal of the formula" => "formula.cnf",
        "literal of the proof" | "proof step" => "proof.drat",
        "hint" => "hints.txt",
        "legend" => "legend.txt",
        "cost" | "ground task" => "task.json",
        "potential" => "argument.json",
        "plan step" => "plan.txt",
        "availability fact" => ["problem.pddl", "knowledge.nt"][random.below(2)],
        "derivation step" => "derivations.json",
        "hash" | "claim" => "manifest.json",
        _ => original.files.keys().nth(random.below(original.files.len())).map_or("", String::as_str),
    };
    let text = &original.files[name];
    let changed = match kind {
        "literal of the formula" | "literal of the proof" => flip(text, random),
        "proof step" => change_line(text, random, &|_| true),
        "availability fact" => {
            change_line(text, random, &|line| line.contains("available") || line.contains("status"))
        }
        "cost" => edit_json(text, |task| {
            let tables = random.below(2) == 0;
            change_number(task, if tables { "tables" } else { "cost" }, random);
        }),
        "potential" => edit_json(text, |argument| change_number(argument, "potentials", random)),
        "derivation step" => edit_json(text, |document| {
            let steps = document["steps"].as_array_mut().expect("steps");
            drop(steps.remove(random.below(steps.len())));
        }),
        "hash" => edit_json(text, |manifest| {
            let files = manifest["files"].as_array_mut().expect("files");
            let position = random.below(files.len());
            let hash = files[position]["sha256"].as_str().expect("a hash").to_owned();
            let at = random.below(hash.len());
            let digit = if hash[at..].starts_with('0') { "1" } else { "0" };
            files[position]["sha256"] = json!(format!("{}{digit}{}", &hash[..at], &hash[at + 1..]));
        }),
        "claim" => edit_json(text, |manifest| {
            let claims =
                [json!("unsolvable"), json!({ "optimal": { "metric": random.below(500).to_string() } })];
            manifest["claim"] = claims[random.below(2)].clone();
        }),
        _ => mutate(text, random),
    };
    (name.to_owned(), changed)
}

fn is_true(claim: &Value, target: &Path) -> bool {
    let files = ["domain.pddl", "problem.pddl"].map(|name| target.join(name).display().to_string());
    let answer = metaplan(&["plan", &files[0], &files[1], "--format", "json", "--quiet"]).json();
    if answer["status"] == "unsolvable" {
        return claim == "unsolvable";
    }
    let metric = claim["optimal"]["metric"].as_str();
    answer["status"] == "optimal" && metric == Some(answer["cost"].to_string().as_str())
}

/// Changes the certificate of each mission once per seed, usually with a matching manifest. Asserts that
/// accepted claims are true. Returns, for each kind of change, the number of changes and the number of
/// accepted changes.
fn check_mutants(
    missions: &[&[&str]],
    seeds: std::ops::Range<u64>,
) -> BTreeMap<&'static str, (usize, usize)> {
    let mut counts: BTreeMap<_, (usize, usize)> = BTreeMap::new();
    for arguments in missions {
        let original = Original::new(arguments);
        let target = original.target.display().to_string();
        for seed in seeds.clone() {
            let mut random = Random(seed);
            let kind = KINDS[seed as usize % KINDS.len()];
            let (name, text) = mutant(kind, &original, &mut random);
            if text == original.files[&name] {
                continue;
            }
            if name == "manifest.json" || kind == "anything" && random.below(8) == 0 {
                std::fs::write(original.target.join(&name), &text).expect("a file");
            } else {
                change(&target, &name, &|_| text.clone());
            }
            let outcome = verify(&target);
            let description = || format!("{arguments:?}, seed {seed}, {kind}, {name}: {outcome:#?}");
            assert!([0, 30].contains(&outcome.status), "{}", description());
            let accepted = outcome.status == 0;
            if accepted {
                let manifest =
                    std::fs::read_to_string(original.target.join("manifest.json")).expect("a file");
                let manifest: Value = serde_json::from_str(&manifest).expect("JSON");
                assert!(is_true(&manifest["claim"], &original.target), "{}", description());
            }
            // Every change of these kinds must be rejected, even if the claim remains true.
            let always_rejected = ["literal of the formula", "legend", "hash", "derivation step"];
            assert!(!accepted || !always_rejected.contains(&kind), "{}", description());
            let count = counts.entry(kind).or_default();
            *count = (count.0 + 1, count.1 + usize::from(accepted));
            original.restore();
        }
        assert!(original.directory.path().is_dir());
    }
    counts
}

#[test]
fn accepted_claims_of_mutated_certificates_are_true() {
    let counts = check_mutants(&MISSIONS[3..], 0..42);
    assert_eq!(counts.len(), KINDS.len(), "{counts:?}");
}

#[test]
#[ignore = "minutes"]
#[allow(clippy::print_stdout)]
fn accepted_claims_of_many_mutated_certificates_are_true() {
    let counts = check_mutants(&MISSIONS, 1_000..1_280);
    println!("kind of change: how many, how many accepted (all of them true): {counts:#?}");
    assert_eq!(counts.len(), KINDS.len(), "{counts:?}");
    assert!(counts.values().map(|(changes, _)| changes).sum::<usize>() >= 1_000, "{counts:?}");
}
