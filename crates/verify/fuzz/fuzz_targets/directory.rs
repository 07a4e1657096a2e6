//! The directory of a certificate as a whole: the bytes decide which certificate is changed, and how. The verifier must answer
//! within a stack of 8 MB, as the program has it, and within the memory that `-rss_limit_mb` gives.
//!
//! The certificates are those of `crates/verify/tests/certificates`, and those in the folder that `METAPLAN_CERTIFICATES` names: there
//! can be missions with knowledge bases among them.

#![no_main]

#[path = "../../tests/hostile/mutate.rs"]
mod mutate;

use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use metaplan_verify::{Verifier, json};
use mutate::{Draw, Files, certificates, mutate, write};

/// The stack of the verification, in bytes.
const STACK: usize = 8 << 20;

static CERTIFICATES: OnceLock<Vec<Files>> = OnceLock::new();

fuzz_target!(|bytes: &[u8]| {
    let all = CERTIFICATES.get_or_init(|| {
        let mut all = certificates(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/certificates"));
        if let Some(folder) = std::env::var_os("METAPLAN_CERTIFICATES") {
            all.extend(certificates(Path::new(&folder)));
        }
        all
    });
    let mut draw = Draw::Bytes(bytes);
    let original = &all[draw.below(all.len())];
    let changed = mutate(original, &mut draw);
    let directory = tempfile::tempdir().expect("a directory");
    write(directory.path(), &changed);
    std::thread::scope(|scope| {
        let verify = || {
            let verifier = Verifier::new(directory.path()).time_limit(Duration::from_secs(5));
            let verification = verifier.verify();
            (verification.to_string(), json(&verification))
        };
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, verify);
        thread.expect("a thread").join().expect("no panic");
    });
});
