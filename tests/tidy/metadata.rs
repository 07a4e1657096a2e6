//! Tests of the data about the software: manifests of published packages, `CITATION.cff`, `codemeta.json`, and
//! commands that install the program.

use std::path::{Path, PathBuf};

use serde_json::Value;
use toml::Table;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn manifest(folder: &Path) -> Table {
    text(&folder.join("Cargo.toml").display().to_string()).parse().expect("TOML")
}

fn published() -> Vec<(PathBuf, Table)> {
    let workspace = manifest(Path::new(""));
    let mut folders = vec![PathBuf::new()];
    for member in workspace["workspace"]["members"].as_array().expect("members") {
        let member = member.as_str().expect("a path");
        match member.strip_suffix("/*") {
            Some(parent) => {
                let entries = std::fs::read_dir(root().join(parent)).expect("a folder");
                folders.extend(
                    entries.map(|entry| Path::new(parent).join(entry.expect("an entry").file_name())),
                );
            }
            None => folders.push(member.into()),
        }
    }
    folders.sort();
    let packages = folders.into_iter().map(|folder| (folder.clone(), manifest(&folder)));
    let is_published = |manifest: &Table| manifest["package"].get("publish").is_none();
    packages.filter(|(_, manifest)| is_published(manifest)).collect()
}

fn version() -> String {
    let workspace = manifest(Path::new(""));
    workspace["workspace"]["package"]["version"].as_str().expect("a version").to_owned()
}

#[test]
fn citations_name_the_version_of_the_workspace() {
    let citation = text("CITATION.cff");
    let versions: Vec<&str> = citation.lines().filter_map(|line| line.strip_prefix("version: ")).collect();
    assert_eq!(versions, [version()], "CITATION.cff");
    let codemeta: Value = serde_json::from_str(&text("codemeta.json")).expect("JSON");
    assert_eq!(codemeta["version"], version(), "codemeta.json");
}

#[test]
fn citations_name_the_authors_of_the_workspace() {
    let workspace = manifest(Path::new(""));
    let authors = workspace["workspace"]["package"]["authors"].as_array().expect("authors");
    let authors: Vec<&str> = authors.iter().filter_map(toml::Value::as_str).collect();
    let citation = text("CITATION.cff");
    let cited: Vec<&str> = citation.lines().filter_map(|line| line.strip_prefix("  - name: ")).collect();
    assert_eq!(cited, authors, "CITATION.cff");
    let codemeta: Value = serde_json::from_str(&text("codemeta.json")).expect("JSON");
    let named = codemeta["author"].as_array().expect("authors").iter();
    let named: Vec<&str> = named.filter_map(|author| author["name"].as_str()).collect();
    assert_eq!(named, authors, "codemeta.json");
}

/// The address of the repository has a single place, the manifest of the workspace.
#[test]
fn published_packages_have_metadata() {
    let mut missing = Vec::new();
    let packages = published();
    assert!(packages.len() > 15, "{}", packages.len());
    for (folder, manifest) in &packages {
        let package = manifest["package"].as_table().expect("a table");
        let mut keys = vec!["description", "keywords", "categories", "license", "repository"];
        if root().join(folder).join("README.md").is_file() {
            keys.push("readme");
        }
        let absent = keys.into_iter().filter(|key| !package.contains_key(*key));
        missing.extend(absent.map(|key| format!("{}: no {key}", folder.display())));
        for key in ["version", "license", "repository", "authors"] {
            if package.get(key).is_some_and(|value| value.get("workspace").is_none()) {
                missing.push(format!("{}: {key} is not that of the workspace", folder.display()));
            }
        }
    }
    assert!(missing.is_empty(), "{missing:#?}");
}

#[test]
fn published_packages_do_not_need_unpublished_ones() {
    let names: Vec<String> = published()
        .iter()
        .map(|(_, manifest)| manifest["package"]["name"].as_str().expect("a name").to_owned())
        .collect();
    let workspace = manifest(Path::new(""));
    let dependencies = workspace["workspace"]["dependencies"].as_table().expect("dependencies");
    for (folder, manifest) in published() {
        for (name, _) in manifest.get("dependencies").and_then(toml::Value::as_table).into_iter().flatten() {
            let Some(dependency) = dependencies.get(name).filter(|entry| entry.get("path").is_some()) else {
                continue;
            };
            let package = dependency.get("package").and_then(toml::Value::as_str).unwrap_or(name);
            assert!(names.iter().any(|name| name == package), "{}: {package}", folder.display());
            // Without a version, cargo does not package the crate.
            assert_eq!(dependency["version"].as_str(), Some(version().as_str()), "{package}");
        }
    }
}

/// Without `--locked`, cargo ignores `Cargo.lock` and installs versions that no test has seen.
#[test]
fn commands_that_install_from_a_path_respect_the_lock_file() {
    let mut paths: Vec<PathBuf> = super::pages::pages(root());
    paths.push("integrations/ros/examples/deploy/metaplan-ros.service".into());
    paths.push("integrations/ros/examples/deploy/Containerfile".into());
    paths.push("integrations/fleet/examples/Containerfile".into());
    paths.push("Containerfile".into());
    let mut violations = Vec::new();
    for path in paths {
        let text = text(&path.display().to_string());
        let commands = text.lines().filter(|line| line.contains("cargo install") && line.contains("--path"));
        let unlocked = commands.filter(|line| !line.contains("--locked"));
        violations.extend(unlocked.map(|line| format!("{}: {line}", path.display())));
    }
    assert!(violations.is_empty(), "{violations:#?}");
}
