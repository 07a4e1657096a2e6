//! Fuzz target: random programs under random scripts of changes, compared with naive evaluation from
//! scratch.

#![no_main]

#[path = "../../tests/oracle/mod.rs"]
mod oracle;
#[path = "../../tests/script/mod.rs"]
mod script;

use libfuzzer_sys::fuzz_target;
use script::{RawChange, RawRule};

type Input = (bool, Vec<RawRule>, Vec<RawChange>, Vec<Vec<RawChange>>);

fuzz_target!(|input: Input| {
    let (equality, mut rules, mut start, mut steps) = input;
    rules.retain(|(heads, _)| !heads.is_empty());
    rules.truncate(6);
    for (heads, body) in &mut rules {
        heads.truncate(2);
        body.truncate(4);
    }
    start.truncate(12);
    steps.truncate(20);
    steps.iter_mut().for_each(|step| step.truncate(4));
    script::check(&rules, &start, &steps, equality);
});
