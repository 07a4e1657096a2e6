//! What a package is linked with.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

/// Packages that plan, decide or search, which nothing that has to be believed is linked with.
const PLANNERS: [&str; 9] = [
    "metaplan",
    "metaplan-encodings",
    "metaplan-ontology",
    "metaplan-probabilistic",
    "batsat",
    "cadical",
    "crepe",
    "rustsat",
    "varisat",
];

/// The names of all packages that one is linked with, itself among them, whatever the platform and the features.
fn linked(package: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--offline", "--locked", "--all-features"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = &metadata["packages"];
    let names: BTreeMap<_, _> =
        list(packages).iter().map(|own| (text(&own["id"]), text(&own["name"]))).collect();
    let nodes = &metadata["resolve"]["nodes"];
    let nodes: BTreeMap<_, _> = list(nodes).iter().map(|node| (text(&node["id"]), node)).collect();
    let mut open: Vec<_> = nodes.keys().copied().filter(|id| names[id] == package).collect();
    assert_eq!(open.len(), 1, "one package has the name {package}");
    let mut seen = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !seen.insert(id) {
            continue;
        }
        // What only tests need has the kind `dev`.
        let needed =
            |dependency: &&Value| list(&dependency["dep_kinds"]).iter().any(|kind| kind["kind"] != "dev");
        open.extend(
            list(&nodes[id]["deps"]).iter().filter(needed).map(|dependency| text(&dependency["pkg"])),
        );
    }
    seen.iter().map(|id| names[id].to_owned()).collect()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn text(value: &Value) -> &str {
    value.as_str().expect("a text")
}

#[test]
fn who_must_be_believed_links_nothing_that_plans() {
    let linked = linked("metaplan-certificate");
    let planners: Vec<_> = PLANNERS.iter().filter(|name| linked.contains(**name)).collect();
    assert!(planners.is_empty(), "the checker is linked with {planners:?}");
    assert!(linked.contains("metaplan-pddl"), "{linked:?}");
}

#[test]
fn the_language_links_no_planner_either() {
    let linked = linked("metaplan-pddl");
    let planners: Vec<_> = PLANNERS.iter().filter(|name| linked.contains(**name)).collect();
    assert!(planners.is_empty(), "the language is linked with {planners:?}");
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
