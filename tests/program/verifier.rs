//! `metaplan verify` and `metaplan-verify` side by side. All tests of certificates run both, see [`verify_in`].

use crate::certificate::certificate;
use crate::common::{root, verify_in};

/// What is not a certificate at all, what cannot be written, and what takes too long.
#[test]
fn both_programs_refuse_alike() {
    let directory = tempfile::tempdir().expect("a directory");
    let target = certificate(directory.path(), &["plan", "missions/uuv_plain.toml"]);
    let (nowhere, file) = (format!("{target}/nowhere"), format!("{target}/argument.smt2"));
    let unwritable = format!("{nowhere}/argument.smt2");
    let [target, nowhere, file, unwritable] = [&target, &nowhere, &file, &unwritable].map(String::as_str);
    for (arguments, status) in [
        (&[nowhere][..], 30),
        (&[nowhere, "--smt", file], 3),
        (&[nowhere, "--smt", file, "--format", "json"], 3),
        (&[target, "--smt", unwritable], 3),
        (&[target, "--time-limit", "0", "--format", "json"], 30),
        (&[target, "--format", "json"], 0),
        (&["/dev/null"], 30),
    ] {
        let outcome = verify_in(&root(), arguments);
        assert_eq!(outcome.status, status, "{arguments:?}: {outcome:#?}");
    }
}
