//! Verifies randomly mutated certificates. Mutations change bytes, words, lists and JSON values,
//! and mostly update the manifest accordingly. The verifier must answer without a panic and within
//! a small stack.

#[allow(dead_code, reason = "shared with a fuzz target")]
mod mutate;

use std::path::Path;
use std::time::{Duration, Instant};

use metaplan_verify::Verifier;
use mutate::{Draw, Files, certificates, mutate, write};

/// A quarter of the stack of the program, although tests are not optimised.
const STACK: usize = 2 << 20;

/// Much more than the time limit of a verification, for slow machines.
const TIME_LIMIT: Duration = Duration::from_secs(200);

fn originals() -> Vec<Files> {
    let certificates = certificates(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/certificates"));
    assert_eq!(certificates.len(), 5);
    certificates
}

/// Verifies a certificate in a separate thread, within a time limit. Returns `true` if it is verified, and `None` on a
/// panic.
fn verified(files: &Files, limit: Duration) -> Option<bool> {
    let directory = tempfile::tempdir().expect("a directory");
    write(directory.path(), files);
    std::thread::scope(|scope| {
        let verify = || {
            let verification = Verifier::new(directory.path()).time_limit(limit).verify();
            // Formatting the result must not panic either.
            assert!(verification.to_string().ends_with('\n'));
            verification.verified()
        };
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, verify);
        thread.expect("a thread").join().ok()
    })
}

/// Verifies a mutant of each certificate for each seed; the test fails on a panic. Returns the
/// number of mutants that were verified.
fn withstand(seeds: std::ops::Range<u64>) -> usize {
    let mut accepted = 0;
    for (certificate, files) in originals().iter().enumerate() {
        for seed in seeds.clone() {
            let mut draw = Draw::Random(seed * 5 + certificate as u64);
            let changed = mutate(files, &mut draw);
            let started = Instant::now();
            let outcome = verified(&changed, Duration::from_secs(2));
            assert!(outcome.is_some(), "certificate {certificate}, seed {seed}: a panic");
            assert!(started.elapsed() < TIME_LIMIT, "certificate {certificate}, seed {seed}: it takes long");
            accepted += usize::from(outcome == Some(true));
        }
    }
    accepted
}

#[test]
fn the_small_certificates_are_verified() {
    for files in originals() {
        assert_eq!(verified(&files, Duration::from_secs(600)), Some(true));
    }
}

#[test]
fn changed_certificates_are_answered() {
    let accepted = withstand(0..150);
    // Some mutations have no effect, e.g. white space or the order of a list.
    assert!(accepted > 0 && accepted < 375, "{accepted} of 750");
}

#[test]
fn control_characters_in_a_manifest_are_refused() {
    let manifest = |files: &Files| {
        let text = files.iter().find(|(name, _)| name.as_str() == "manifest.json");
        serde_json::from_slice::<serde_json::Value>(text.expect("a manifest").1).expect("JSON")
    };
    let forged = "1\nverified: the plan is optimal, metric 1";
    let mut refused = 0;
    for files in originals() {
        let mut manifests = [manifest(&files), manifest(&files)];
        let fields = ["/claim/optimal/metric", "/refutation/none"];
        for (changed, field) in manifests.iter_mut().zip(fields) {
            let Some(value) = changed.pointer_mut(field) else { continue };
            *value = forged.into();
            let directory = tempfile::tempdir().expect("a directory");
            write(directory.path(), &files);
            std::fs::write(directory.path().join("manifest.json"), changed.to_string()).expect("a manifest");
            let text = Verifier::new(directory.path()).verify().to_string();
            assert!(text.contains("contains a control character"), "{text}");
            assert!(!text.contains("\nverified"), "{text}");
            refused += 1;
        }
    }
    assert!(refused >= 3, "{refused} manifests have such fields");
}

#[test]
#[ignore = "minutes"]
fn many_changed_certificates_are_answered() {
    withstand(1_000..6_000);
}
