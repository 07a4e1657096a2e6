//! What a package is linked with.

use std::collections::BTreeSet;
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
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let name = |id: &Value| {
        let packages = list(&metadata["packages"]);
        let own = packages.iter().find(|own| own["id"] == *id).expect("a package").clone();
        own["name"].as_str().expect("a name").to_owned()
    };
    let nodes = list(&metadata["resolve"]["nodes"]);
    let mut open: Vec<Value> =
        nodes.iter().map(|node| node["id"].clone()).filter(|id| name(id) == package).collect();
    assert_eq!(open.len(), 1, "one package has the name {package}");
    let mut seen = BTreeSet::new();
    let mut names = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !seen.insert(id.to_string()) {
            continue;
        }
        names.insert(name(&id));
        let node = nodes.iter().find(|node| node["id"] == id).expect("a node");
        for dependency in list(&node["deps"]) {
            // What only tests need has the kind `dev`.
            if list(&dependency["dep_kinds"]).iter().any(|kind| kind["kind"] != "dev") {
                open.push(dependency["pkg"].clone());
            }
        }
    }
    names
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
