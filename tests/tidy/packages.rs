//! What a package is linked with.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

/// Packages that plan, decide or search, which nothing that has to be believed is linked with.
const PLANNERS: [&str; 7] =
    ["metaplan", "metaplan-encodings", "metaplan-probabilistic", "batsat", "cadical", "rustsat", "varisat"];

/// What reasons, or reads knowledge. The checker of plans has nothing of it. Who checks derivations, too, is linked with the rule engine for
/// its replay, and with OWL for its reading.
const KNOWLEDGE: [&str; 3] = ["metaplan-ontology", "metaplan-rules", "crepe"];

/// What cargo says of all packages.
fn metadata() -> &'static Value {
    static METADATA: OnceLock<Value> = OnceLock::new();
    METADATA.get_or_init(|| {
        let output = Command::new(env!("CARGO"))
            .args(["metadata", "--format-version", "1", "--offline", "--locked", "--all-features"])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()
            .expect("cargo");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).expect("JSON")
    })
}

/// The names of all packages that one is linked with, itself among them, whatever the platform and the features.
pub fn linked(package: &str) -> BTreeSet<String> {
    let metadata = metadata();
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
