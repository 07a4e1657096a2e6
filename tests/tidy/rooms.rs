//! The arrows between the rooms of `src` are those that ARCHITECTURE.md lists, no more and no fewer, and they lead downwards in its
//! picture.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::circles::imports;

/// What ARCHITECTURE.md says of the rooms.
struct Listed {
    /// The picture: for each room its line, from the top.
    lines: BTreeMap<String, usize>,
    /// The table: for each room those that it imports from.
    imports: BTreeMap<String, BTreeSet<String>>,
}

/// The names in backticks of a cell, without the ends of paths.
fn names(cell: &str) -> Vec<String> {
    let quoted = cell.split('`').skip(1).step_by(2);
    quoted.map(|name| name.trim_end_matches('/').trim_end_matches(".rs").to_owned()).collect()
}

/// The picture and the table of imports below the heading of `src`.
fn listed(document: &str) -> Listed {
    let section = document.split("\n### src").nth(1).expect("a section on `src`");
    let picture = section.split("```text\n").nth(1).and_then(|rest| rest.split("```").next());
    let picture = picture.expect("a picture of the rooms").lines().enumerate();
    let lines =
        picture.flat_map(|(line, rooms)| rooms.split_whitespace().map(move |room| (room.to_owned(), line)));
    let table = section.split("| imports from |\n").nth(1).expect("a table of what imports from what");
    let rows = table.lines().skip(1).take_while(|line| line.starts_with('|'));
    let imports = rows.flat_map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
        let [rooms, _, from] = cells[..] else { panic!("a row has three cells: {row}") };
        let from: BTreeSet<String> = names(from).into_iter().collect();
        names(rooms).into_iter().map(move |room| (room, from.clone()))
    });
    Listed { lines: lines.collect(), imports: imports.collect() }
}

/// For each room those from which its files import.
fn found(files: &[(String, String)]) -> BTreeMap<String, BTreeSet<String>> {
    let mut rooms: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (file, from) in imports(files, "src") {
        let Some(room) = file.first() else { continue };
        let others = from.iter().filter_map(|file| file.first()).filter(|other| *other != room);
        rooms.entry(room.clone()).or_default().extend(others.cloned());
    }
    rooms
}

/// How the files differ from the page, and the page from itself.
fn differences(listed: &Listed, found: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut differences = Vec::new();
    let none = BTreeSet::new();
    let all: BTreeSet<&String> =
        found.keys().chain(listed.imports.keys()).chain(listed.lines.keys()).collect();
    for room in all {
        if !found.contains_key(room) {
            differences.push(format!("there is no room `{room}`"));
        }
        if !listed.imports.contains_key(room) {
            differences.push(format!("the table lacks `{room}`"));
        }
        let line = listed.lines.get(room);
        if line.is_none() {
            differences.push(format!("the picture lacks `{room}`"));
        }
        let (own, said) = (found.get(room).unwrap_or(&none), listed.imports.get(room).unwrap_or(&none));
        differences.extend(own.difference(said).map(|other| format!("`{room}` imports from `{other}`")));
        differences.extend(said.difference(own).map(|other| format!("`{room}` has nothing of `{other}`")));
        let above = own.iter().filter(|other| listed.lines.get(*other) <= line);
        differences.extend(above.map(|other| format!("`{other}` does not stand below `{room}`")));
    }
    differences
}

#[test]
fn rooms_of_the_facade_import_as_the_architecture_says() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md");
    let page = std::fs::read_to_string(page).expect("text");
    let differences = differences(&listed(&page), &found(&super::files()));
    assert!(differences.is_empty(), "ARCHITECTURE.md and `src` differ:\n{}", differences.join("\n"));
}

/// What lies in a folder knows nothing of the file that stands for the folder.
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
    let page = "# x\n\n### src: order\n\n```text\n  a b\n  c\n```\n\n| files | do | imports from |\n|---|---|---|\n\
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
        "there is no room `c`",
        "the table lacks `d`",
        "the picture lacks `d`",
    ];
    check(&more, &found);
}
