//! Tests of the dependencies of packages, of the files that use narrowing, and of overflow checks in the
//! workspace's manifest.

use std::collections::BTreeSet;
use std::process::Command;

/// Packages that plan, decide or search. The trusted packages must not depend on any of them.
const PLANNERS: [&str; 11] = [
    "metaplan",
    "metaplan-task",
    "metaplan-search",
    "metaplan-temporal",
    "metaplan-encodings",
    "metaplan-planner",
    "metaplan-probabilistic",
    "batsat",
    "cadical",
    "rustsat",
    "varisat",
];

/// Packages that reason or read knowledge bases. The checker of plans does not depend on them. The checker of
/// derivations does depend on them: it replays derivations with the rule engine, and reads OWL.
const KNOWLEDGE: [&str; 3] = ["metaplan-ontology", "metaplan-rules", "crepe"];

/// Returns the names of all packages in the dependency tree of a package, including the package itself, for
/// all platforms and features.
pub fn linked(package: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--package", package, "--edges", "normal,build", "--all-features", "--target", "all"])
        .args(["--prefix", "none", "--format", "{p}", "--locked", "--quiet"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).expect("text");
    lines.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

fn linked_of(package: &str, candidates: &[&'static str]) -> Vec<&'static str> {
    let linked = linked(package);
    candidates.iter().copied().filter(|name| linked.contains(*name)).collect()
}

#[test]
fn trusted_packages_do_not_depend_on_planners() {
    let no_packages: [&str; 0] = [];
    for package in ["metaplan-pddl", "metaplan-certificate"] {
        assert_eq!(linked_of(package, &PLANNERS), no_packages, "{package}");
        assert_eq!(linked_of(package, &KNOWLEDGE), no_packages, "{package}");
    }
    for package in ["metaplan-mission", "metaplan-verify"] {
        assert_eq!(linked_of(package, &PLANNERS), no_packages, "{package}");
        assert_eq!(linked_of(package, &KNOWLEDGE), KNOWLEDGE, "{package}");
    }
    assert_eq!(linked_of("metaplan-verify", &["metaplan-pddl", "metaplan-certificate"]).len(), 2);
    // The facade depends on all of them, so the check is not vacuous.
    assert_eq!(linked_of("metaplan", &PLANNERS), PLANNERS);
}

/// Narrowing belongs to the facade, on which no checker depends. Only grounding uses narrowing.
#[test]
fn only_grounding_narrows_tasks() {
    let files = crate::files();
    let is_use = |text: &str| text.contains("narrow::");
    // This file contains the text that it searches for.
    let users = files.iter().filter(|(name, text)| name != "tests/tidy/packages.rs" && is_use(text));
    assert_eq!(users.map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["src/mission/planning.rs"]);
    for module in ["clause", "fold", "possible", "settle"] {
        let places = files.iter().filter(|(name, _)| name.ends_with(&format!("/{module}.rs")));
        let places: Vec<&str> = places.map(|(name, _)| name.as_str()).collect();
        assert_eq!(places, [format!("src/narrow/{module}.rs")], "{module}");
    }
}

/// Arithmetic must be exact, so overflows are also errors in release builds, including those of future
/// packages.
#[test]
fn own_packages_check_for_overflows_in_releases() {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")).expect("the manifest");
    let manifest: toml::Table = text.parse().expect("TOML");
    let release = &manifest["profile"]["release"];
    assert_eq!(release["overflow-checks"].as_bool(), Some(true));
    for (package, settings) in release["package"].as_table().expect("packages") {
        let is_own = package.starts_with("metaplan");
        assert!(!is_own || settings.get("overflow-checks").is_none(), "{package}");
    }
}
