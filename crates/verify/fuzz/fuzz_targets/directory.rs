//! Fuzzes a certificate directory: the bytes select a certificate and its mutations. The verifier
//! must answer within a stack of 8 MB, as the program has, and within the memory limit
//! `-rss_limit_mb`.
//!
//! The original certificates are in `crates/verify/tests/certificates` and in the folder named by
//! the environment variable `METAPLAN_CERTIFICATES`. That folder may contain certificates of
//! missions with knowledge bases.

#![no_main]

#[path = "../../tests/hostile/mutate.rs"]
mod mutate;

use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use metaplan_verify::{Verifier, json};
use mutate::{Draw, Files, certificates, mutate, write};

/// The stack size for the verification, in bytes.
const STACK: usize = 8 << 20;

static CERTIFICATES: OnceLock<Vec<Files>> = OnceLock::new();

fuzz_target!(|bytes: &[u8]| {
    let corpus = CERTIFICATES.get_or_init(|| {
        let mut certificates_and_files = certificates(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/certificates"));
        if let Some(folder) = std::env::var_os("METAPLAN_CERTIFICATES") {
            certificates_and_files.extend(certificates(Path::new(&folder)));
        }
        certificates_and_files
    });
    let mut draw = Draw::Bytes(bytes);
    let original = &corpus[draw.below(corpus.len())];
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
