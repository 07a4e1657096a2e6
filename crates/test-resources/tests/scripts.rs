//! Tests of the scripts that fetch test data and reproduce tables.

use std::path::Path;
use std::process::Command;

use test_resources::{Resource, python_with};

/// Runs a script with Python 3.11 or newer, which contains `tomllib`. Fails unless it succeeds.
fn check(arguments: &[&str]) {
    let Some(python) = python_with(Resource::Python, "METAPLAN_PYTHON", "tomllib") else { return };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the root");
    let output = Command::new(python).current_dir(root).args(arguments).output().expect("Python runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Repositories on this machine take the place of public ones.
#[test]
fn public_files_are_fetched_and_verified() {
    check(&["data/test_fetch.py"]);
}

#[test]
fn tables_are_reproduced_and_recorded() {
    check(&["benches/test_reproduce.py"]);
}

#[test]
fn figures_of_the_readme_are_those_of_their_pages() {
    check(&["benches/reproduce.py", "--check"]);
}
