//! How many lines have to be believed by whoever believes a certificate: `crates/verify/README.md` says it, and is right.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::packages::linked;

/// Figures are rounded up to this.
const STEP: usize = 100;

/// The lines of a file that are code and no test.
fn code_lines(text: &str) -> usize {
    let mut lines = text.lines().map(str::trim);
    let mut count = 0;
    while let Some(line) = lines.next() {
        if line == "#[cfg(test)]" {
            // A module of tests is the last in its file, unless it is a file of its own.
            match lines.next() {
                Some(next) if next.starts_with("mod ") && next.ends_with('{') => break,
                _ => continue,
            }
        }
        count += usize::from(!line.is_empty() && !line.starts_with("//"));
    }
    count
}

/// The rows of the table: folders and files without their ending, and the figure.
fn rows(page: &str) -> Vec<(Vec<String>, usize)> {
    let table =
        page.split("| part | lines | checked how | trusted why |\n").nth(1).expect("a table of parts");
    let rows = table.lines().skip(1).take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let rooms = cells[0].split('`').skip(1).step_by(2).map(str::to_owned).collect();
        (rooms, cells[1].replace(',', "").parse().expect("a number"))
    })
    .collect()
}

/// The row of a file: that with the longest path to it.
fn row_of<'a>(path: &'a str, rows: &BTreeMap<&'a str, usize>) -> Option<usize> {
    let mut part = path.strip_suffix(".rs")?;
    loop {
        match rows.get(part) {
            Some(row) => return Some(*row),
            None => part = part.rsplit_once('/')?.0,
        }
    }
}

#[test]
fn the_lines_to_be_believed_are_counted_right() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/verify/README.md");
    let rows = rows(&std::fs::read_to_string(page).expect("text"));
    let (all, rooms) = rows.split_last().expect("rows");
    let listed = rooms
        .iter()
        .zip(0..)
        .flat_map(|((paths, _), row)| paths.iter().map(move |path| (path.as_str(), row)));
    let listed: BTreeMap<&str, usize> = listed.collect();
    let own: BTreeSet<String> = linked("metaplan-verify")
        .iter()
        .filter_map(|name| name.strip_prefix("metaplan-").map(|name| format!("{name}/src/")))
        .collect();
    assert!(own.len() > 4, "{own:?}");
    let is_tests = |path: &str| path.ends_with("/tests.rs") || path.contains("/tests/");
    let mut counts = vec![0; rooms.len()];
    for (path, text) in super::files() {
        // Words about codes decide nothing.
        let is_words = path.ends_with("/src/codes.rs");
        let path_in_crates = path.strip_prefix("crates/").unwrap_or(&path);
        if own.iter().any(|folder| path_in_crates.starts_with(folder.as_str()))
            && !is_tests(&path)
            && !is_words
        {
            let row = row_of(&path, &listed).unwrap_or_else(|| panic!("{path} is linked, and in no row"));
            counts[row] += code_lines(&text);
        }
    }
    let wrong = rooms.iter().zip(&counts).filter(|((_, said), count)| *said != count.div_ceil(STEP) * STEP);
    let wrong: Vec<String> = wrong
        .map(|((paths, said), count)| format!("{}: {said}, and there are {count}", paths.join(", ")))
        .collect();
    assert!(wrong.is_empty(), "crates/verify/README.md is wrong about lines:\n{}", wrong.join("\n"));
    assert_eq!(all.1, rooms.iter().map(|(_, said)| said).sum::<usize>(), "the sum");
}

#[test]
fn what_is_no_code_is_not_counted() {
    let text = "//! Head.\n\n#[cfg(test)]\nmod tests;\n\n/// A function.\nfn f() { // too\n    g()\n}\n\n\
                #[cfg(test)]\nmod more {\n    fn h() {}\n}\n";
    assert_eq!(code_lines(text), 3);
}
