//! Fuzz target: generates domains and problems. The reader must accept them, printing and reading must yield equal
//! trees, and grounding must succeed or return errors. Texts with a few changed words must be read without a crash.

#![no_main]

#[allow(dead_code, reason = "shared with a test and another target")]
#[path = "../../tests/ground_semantics/generate.rs"]
mod generate;
#[path = "../../tests/ground_semantics/interfere.rs"]
mod interfere;
#[allow(dead_code, reason = "shared with a test and another target")]
#[path = "../../tests/ground_semantics/interpret.rs"]
mod interpret;
#[allow(dead_code, reason = "shared with a test and another target")]
#[path = "../../tests/ground_semantics/model.rs"]
mod model;
#[allow(dead_code, reason = "shared with a test and another target")]
#[path = "../../tests/ground_semantics/text.rs"]
mod text;

use libfuzzer_sys::fuzz_target;
use pddl::{Source, read, render};
use metaplan_planner::{GroundConfig, ground};

const WORDS: [&str; 28] = [
    "(",
    ")",
    "-",
    "?v0",
    "?v9",
    "=",
    ">=",
    "not",
    "and",
    "or",
    "when",
    "forall",
    "exists",
    "imply",
    "at",
    "start",
    "over",
    "all",
    "end",
    "?duration",
    "either",
    "increase",
    "1e9",
    "0.1",
    ":effect",
    "(:action",
    "#t",
    "((((",
];

/// Makes at most four changes, which the input bytes determine: words are deleted, inserted,
/// replaced, exchanged or repeated.
fn mutated(text: &str, bytes: &mut &[u8]) -> String {
    let spaced = text.replace('(', " ( ").replace(')', " ) ");
    let mut words: Vec<&str> = spaced.split_whitespace().collect();
    let Some((count, rest)) = bytes.split_first() else { return words.join(" ") };
    *bytes = rest;
    for _ in 0..count % 5 {
        let Some((&[what, high, low, more], rest)) = bytes.split_first_chunk() else { break };
        *bytes = rest;
        if words.is_empty() {
            break;
        }
        let (length, more) = (words.len(), usize::from(more));
        let place = (usize::from(high) * 256 + usize::from(low)) % length;
        match what % 5 {
            0 => drop(words.remove(place)),
            1 => words.insert(place, WORDS[more % WORDS.len()]),
            2 => words[place] = WORDS[more % WORDS.len()],
            3 => words.swap(place, (place + more) % length),
            _ => {
                let piece = words[place..(place + more).min(length)].to_vec();
                words.splice(place..place, piece);
            }
        }
    }
    words.join(" ")
}

fuzz_target!(|bytes: &[u8]| {
    let (changes, bytes) = bytes.split_at(bytes.len().min(40));
    let mut draw = generate::Draw::new(bytes, generate::ALL);
    let task = draw.task();
    let (domain, problem) = text::trees(&task);
    text::check_printing(&domain, &problem);
    let _ = ground(&domain, &problem, &GroundConfig::default());

    let mut changes = changes;
    let domain = Source::new("domain", mutated(&task.domain(), &mut changes));
    let problem = Source::new("problem", mutated(&task.problem(), &mut changes));
    match read(&domain, &problem) {
        Ok((domain, problem, _)) => {
            text::check_printing(&domain, &problem);
            let _ = ground(&domain, &problem, &GroundConfig::default());
        }
        Err(found) => drop(render(&found, &[&domain, &problem], false)),
    }
});
