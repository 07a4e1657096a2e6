//! The modules of `src` import exactly what ARCHITECTURE.md lists, and only from lower lines of its picture.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::circles::imports;

/// Layers and imports as ARCHITECTURE.md lists them.
struct Listed {
    /// The picture: the line of each module, counted from the top.
    lines: BTreeMap<String, usize>,
    /// The table: the imports of each module.
    imports: BTreeMap<String, BTreeSet<String>>,
}

/// Names in backticks in a table cell, without `/` and `.rs`.
fn names(cell: &str) -> Vec<String> {
    let quoted = cell.split('`').skip(1).step_by(2);
    quoted.map(|name| name.trim_end_matches('/').trim_end_matches(".rs").to_owned()).collect()
}

/// Reads the picture and the table below the heading of `src`.
fn listed(document: &str) -> Listed {
    let section = document.split("\n### src").nth(1).expect("a section on `src`");
    let picture = section.split("```text\n").nth(1).and_then(|rest| rest.split("```").next());
    let picture = picture.expect("a picture of the modules").lines().enumerate();
    let lines = picture
        .flat_map(|(line, modules)| modules.split_whitespace().map(move |module| (module.to_owned(), line)));
    let table = section.split("| imports from |\n").nth(1).expect("a table of what imports from what");
    let rows = table.lines().skip(1).take_while(|line| line.starts_with('|'));
    let imports = rows.flat_map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
        let [modules, _, from] = cells[..] else { panic!("a row has three cells: {row}") };
        let from: BTreeSet<String> = names(from).into_iter().collect();
        names(modules).into_iter().map(move |module| (module, from.clone()))
    });
    Listed { lines: lines.collect(), imports: imports.collect() }
}

/// Imports between the modules, from the source files.
fn found(files: &[(String, String)]) -> BTreeMap<String, BTreeSet<String>> {
    let mut modules: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (file, from) in imports(files, "src") {
        let Some(module) = file.first() else { continue };
        let others = from.iter().filter_map(|file| file.first()).filter(|other| *other != module);
        modules.entry(module.clone()).or_default().extend(others.cloned());
    }
    modules
}

/// Differences between the files and the page, and between the picture and the table.
fn differences(listed: &Listed, found: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut differences = Vec::new();
    let none = BTreeSet::new();
    let all: BTreeSet<&String> =
        found.keys().chain(listed.imports.keys()).chain(listed.lines.keys()).collect();
    for module in all {
        if !found.contains_key(module) {
            differences.push(format!("there is no module `{module}`"));
        }
        if !listed.imports.contains_key(module) {
            differences.push(format!("the table lacks `{module}`"));
        }
        let line = listed.lines.get(module);
        if line.is_none() {
            differences.push(format!("the picture lacks `{module}`"));
        }
        let (own, said) = (found.get(module).unwrap_or(&none), listed.imports.get(module).unwrap_or(&none));
        differences.extend(own.difference(said).map(|other| format!("`{module}` imports from `{other}`")));
        differences.extend(said.difference(own).map(|other| format!("`{module}` has nothing of `{other}`")));
        let above = own.iter().filter(|other| listed.lines.get(*other) <= line);
        differences.extend(above.map(|other| format!("`{other}` does not stand below `{module}`")));
    }
    differences
}

#[test]
fn the_facade_imports_as_the_architecture_says() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md");
    let page = std::fs::read_to_string(page).expect("text");
    let differences = differences(&listed(&page), &found(&super::files()));
    assert!(differences.is_empty(), "ARCHITECTURE.md and `src` differ:\n{}", differences.join("\n"));
}

/// A file in a folder does not import from the module file of that folder.
#[test]
fn no_file_of_the_facade_imports_from_the_file_above_it() {
    let upwards = |(file, from): (Vec<String>, BTreeSet<Vec<String>>)| {
        let above: Vec<_> = from.into_iter().filter(|other| file.starts_with(other)).collect();
        above.into_iter().map(move |other| format!("{} imports from {}", file.join("::"), other.join("::")))
    };
    let found: Vec<String> = imports(&super::files(), "src").into_iter().flat_map(upwards).collect();
    assert!(found.is_empty(), "imports from the file above:\n{}", found.join("\n"));
}

#[test]
fn a_wrong_arrow_is_found() {
    let page = "# x\n\n### src: order\n\n```text\n  a b\n  c\n```\n\n| files | purpose | imports from |\n|---|---|---|\n\
                | `a/`, `b.rs` | x | `c` |\n| `c` | y | |\n\n| `d` | z | `a` |\n";
    let file = |path: &str, text: &str| (format!("src/{path}"), text.to_owned());
    let check = |files: &[(String, String)], expected: &[&str]| {
        assert_eq!(differences(&listed(page), &found(files)), expected);
    };
    let a = file("a/mod.rs", "mod inner; use crate::c::F;");
    let inner = file("a/inner.rs", "use super::Own;");
    let right = [a.clone(), inner.clone(), file("b.rs", "use metaplan::c::F;"), file("c.rs", "")];
    check(&right, &[]);
    let [a, inner, b, _] = right;
    check(
        &[a.clone(), inner.clone(), b, file("c.rs", "use crate::a::F;")],
        &["`c` imports from `a`", "`a` does not stand below `c`"],
    );
    let few = [a, inner, file("b.rs", ""), file("c.rs", "")];
    check(&few, &["`b` has nothing of `c`"]);
    let [a, inner, b, _] = few;
    let more = [a, inner, b, file("d.rs", "")];
    let found = [
        "`a` has nothing of `c`",
        "`b` has nothing of `c`",
        "there is no module `c`",
        "the table lacks `d`",
        "the picture lacks `d`",
    ];
    check(&more, &found);
}
