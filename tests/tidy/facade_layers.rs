//! Test that each module of `src` imports exactly the modules that ARCHITECTURE.md lists, and only from lower
//! lines of its picture.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::circles::imports;

struct Documented {
    /// Line of each module in the picture, counted from the top.
    lines: BTreeMap<String, usize>,
    imports: BTreeMap<String, BTreeSet<String>>,
}

/// Returns the names in backticks in a table cell, without `/` and `.rs`.
fn names(cell: &str) -> Vec<String> {
    let quoted = cell.split('`').skip(1).step_by(2);
    quoted.map(|name| name.trim_end_matches('/').trim_end_matches(".rs").to_owned()).collect()
}

fn documented(document: &str) -> Documented {
    let section = document.split("\n### src").nth(1).expect("a section on `src`");
    let picture = section.split("```text\n").nth(1).and_then(|block| block.split("```").next());
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
    Documented { lines: lines.collect(), imports: imports.collect() }
}

fn actual_imports(files: &[(String, String)]) -> BTreeMap<String, BTreeSet<String>> {
    let mut modules: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (file, from) in imports(files, "src") {
        let Some(module) = file.first() else { continue };
        let imported_modules =
            from.iter().filter_map(|file| file.first()).filter(|imported| *imported != module);
        modules.entry(module.clone()).or_default().extend(imported_modules.cloned());
    }
    modules
}

fn differences(documented: &Documented, actual: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut differences = Vec::new();
    let no_modules = BTreeSet::new();
    let modules: BTreeSet<&String> =
        actual.keys().chain(documented.imports.keys()).chain(documented.lines.keys()).collect();
    for module in modules {
        if !actual.contains_key(module) {
            differences.push(format!("there is no module `{module}`"));
        }
        if !documented.imports.contains_key(module) {
            differences.push(format!("the table lacks `{module}`"));
        }
        let line = documented.lines.get(module);
        if line.is_none() {
            differences.push(format!("the picture lacks `{module}`"));
        }
        let (imported, listed_imports) = (
            actual.get(module).unwrap_or(&no_modules),
            documented.imports.get(module).unwrap_or(&no_modules),
        );
        differences.extend(
            imported.difference(listed_imports).map(|target| format!("`{module}` imports from `{target}`")),
        );
        differences.extend(
            listed_imports.difference(imported).map(|target| format!("`{module}` has nothing of `{target}`")),
        );
        let misplaced = imported.iter().filter(|target| documented.lines.get(*target) <= line);
        differences.extend(misplaced.map(|target| format!("`{target}` does not stand below `{module}`")));
    }
    differences
}

#[test]
fn facade_imports_match_the_architecture() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md");
    let page = std::fs::read_to_string(page).expect("text");
    let differences = differences(&documented(&page), &actual_imports(&super::files()));
    assert!(differences.is_empty(), "ARCHITECTURE.md and `src` differ:\n{}", differences.join("\n"));
}

#[test]
fn facade_files_do_not_import_from_their_parent_module() {
    let upwards = |(file, from): (Vec<String>, BTreeSet<Vec<String>>)| {
        let parents: Vec<_> = from.into_iter().filter(|parent| file.starts_with(parent)).collect();
        parents
            .into_iter()
            .map(move |parent| format!("{} imports from {}", file.join("::"), parent.join("::")))
    };
    let upward_imports: Vec<String> = imports(&super::files(), "src").into_iter().flat_map(upwards).collect();
    assert!(upward_imports.is_empty(), "imports from the file above:\n{}", upward_imports.join("\n"));
}

#[test]
fn differences_from_the_architecture_are_detected() {
    let page = "# x\n\n### src: order\n\n```text\n  a b\n  c\n```\n\n| files | purpose | imports from |\n|---|---|---|\n\
                | `a/`, `b.rs` | x | `c` |\n| `c` | y | |\n\n| `d` | z | `a` |\n";
    let file = |path: &str, text: &str| (format!("src/{path}"), text.to_owned());
    let check = |files: &[(String, String)], expected: &[&str]| {
        assert_eq!(differences(&documented(page), &actual_imports(files)), expected);
    };
    let a = file("a/mod.rs", "mod inner; use crate::c::F;");
    let inner = file("a/inner.rs", "use super::Own;");
    let conforming = [a.clone(), inner.clone(), file("b.rs", "use metaplan::c::F;"), file("c.rs", "")];
    check(&conforming, &[]);
    let [a, inner, b, _] = conforming;
    check(
        &[a.clone(), inner.clone(), b, file("c.rs", "use crate::a::F;")],
        &["`c` imports from `a`", "`a` does not stand below `c`"],
    );
    let missing_imports = [a, inner, file("b.rs", ""), file("c.rs", "")];
    check(&missing_imports, &["`b` has nothing of `c`"]);
    let [a, inner, b, _] = missing_imports;
    let missing_module = [a, inner, b, file("d.rs", "")];
    let expected = [
        "`a` has nothing of `c`",
        "`b` has nothing of `c`",
        "there is no module `c`",
        "the table lacks `d`",
        "the picture lacks `d`",
    ];
    check(&missing_module, &expected);
}
