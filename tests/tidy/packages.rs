//! What a package is linked with.

use std::collections::BTreeSet;
use std::process::Command;

/// Packages that plan, decide or search, which nothing that has to be believed is linked with.
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

/// What reasons, or reads knowledge. The checker of plans has nothing of it. Who checks derivations, too, is linked with the rule engine for
/// its replay, and with OWL for its reading.
const KNOWLEDGE: [&str; 3] = ["metaplan-ontology", "metaplan-rules", "crepe"];

/// The names of all packages that one is linked with, itself among them, whatever the platform and the features.
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

/// Those of some packages that one is linked with.
fn found(package: &str, others: &[&'static str]) -> Vec<&'static str> {
    let linked = linked(package);
    others.iter().copied().filter(|name| linked.contains(*name)).collect()
}

#[test]
fn who_must_be_believed_links_nothing_that_plans() {
    let none: [&str; 0] = [];
    for package in ["metaplan-pddl", "metaplan-certificate"] {
        assert_eq!(found(package, &PLANNERS), none, "{package}");
        assert_eq!(found(package, &KNOWLEDGE), none, "{package}");
    }
    for package in ["metaplan-mission", "metaplan-verify"] {
        assert_eq!(found(package, &PLANNERS), none, "{package}");
        assert_eq!(found(package, &KNOWLEDGE), KNOWLEDGE, "{package}");
    }
    assert_eq!(found("metaplan-verify", &["metaplan-pddl", "metaplan-certificate"]).len(), 2);
    // Who plans is found where it is linked.
    assert_eq!(found("metaplan", &PLANNERS), PLANNERS);
}

/// Narrowing is a matter of the planner: the facade has it, which no checker is linked with, and only grounding uses it.
#[test]
fn only_grounding_narrows_tasks() {
    let files = crate::files();
    let is_use = |text: &str| text.contains("narrow::");
    let users = files.iter().filter(|(name, text)| name != "tests/tidy/packages.rs" && is_use(text));
    assert_eq!(users.map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["src/mission/planning.rs"]);
    for module in ["clause", "fold", "possible", "settle"] {
        let places = files.iter().filter(|(name, _)| name.ends_with(&format!("/{module}.rs")));
        let places: Vec<&str> = places.map(|(name, _)| name.as_str()).collect();
        assert_eq!(places, [format!("src/narrow/{module}.rs")], "{module}");
    }
}

/// Numbers are exact: what does not fit is a fault, also in a release build, and in packages that are still to come.
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
