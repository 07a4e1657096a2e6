//! Test of the line counts of the trusted code base in `crates/verify/README.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::packages::linked;

/// Line counts are rounded up to a multiple of this number.
const ROUNDING_STEP: usize = 100;

/// Returns the number of lines of code, without blank lines, comments and tests.
fn code_lines(text: &str) -> usize {
    let mut lines = text.lines().map(str::trim);
    let mut count = 0;
    while let Some(line) = lines.next() {
        if line == "#[cfg(test)]" {
            // An inline module of tests is the last item of its file. A module in a separate file is only declared here.
            match lines.next() {
                Some(next) if next.starts_with("mod ") && next.ends_with('{') => break,
                _ => continue,
            }
        }
        count += usize::from(!line.is_empty() && !line.starts_with("//"));
    }
    count
}

/// Parses the rows of the table. Each row has folders and files (without extension), and the number of lines.
fn rows(page: &str) -> Vec<(Vec<String>, usize)> {
    let table =
        page.split("| part | lines | checked how | trusted why |\n").nth(1).expect("a table of parts");
    let rows = table.lines().skip(1).take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let paths = cells[0].split('`').skip(1).step_by(2).map(str::to_owned).collect();
        (paths, cells[1].replace(',', "").parse().expect("a number"))
    })
    .collect()
}

/// Returns the row of a file: the row with the longest matching path.
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
fn line_counts_of_the_trusted_code_base_are_up_to_date() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/verify/README.md");
    let rows = rows(&std::fs::read_to_string(page).expect("text"));
    let (total_row, part_rows) = rows.split_last().expect("rows");
    let row_by_path = part_rows
        .iter()
        .zip(0..)
        .flat_map(|((paths, _), row)| paths.iter().map(move |path| (path.as_str(), row)));
    let row_by_path: BTreeMap<&str, usize> = row_by_path.collect();
    let trusted_folders: BTreeSet<String> = linked("metaplan-verify")
        .iter()
        .filter_map(|name| name.strip_prefix("metaplan-").map(|name| format!("{name}/src/")))
        .collect();
    assert!(trusted_folders.len() > 4, "{trusted_folders:?}");
    let is_tests = |path: &str| path.ends_with("/tests.rs") || path.contains("/tests/");
    let mut counts = vec![0; part_rows.len()];
    for (path, text) in super::files() {
        // Texts of error messages do not influence a verdict.
        let is_message_table = path.ends_with("/src/codes.rs");
        let path_in_crates = path.strip_prefix("crates/").unwrap_or(&path);
        if trusted_folders.iter().any(|folder| path_in_crates.starts_with(folder.as_str()))
            && !is_tests(&path)
            && !is_message_table
        {
            let row =
                row_of(&path, &row_by_path).unwrap_or_else(|| panic!("{path} is linked, and in no row"));
            counts[row] += code_lines(&text);
        }
    }
    let differences = part_rows
        .iter()
        .zip(&counts)
        .filter(|((_, documented), count)| *documented != count.div_ceil(ROUNDING_STEP) * ROUNDING_STEP);
    let differences: Vec<String> = differences
        .map(|((paths, documented), count)| {
            format!("{}: {documented}, and there are {count}", paths.join(", "))
        })
        .collect();
    assert!(
        differences.is_empty(),
        "crates/verify/README.md is wrong about lines:\n{}",
        differences.join("\n")
    );
    assert_eq!(total_row.1, part_rows.iter().map(|(_, documented)| documented).sum::<usize>(), "the sum");
}

#[test]
fn comments_and_tests_are_not_counted() {
    let text = "//! Head.\n\n#[cfg(test)]\nmod tests;\n\n/// A function.\nfn f() { // too\n    g()\n}\n\n\
                #[cfg(test)]\nmod more {\n    fn h() {}\n}\n";
    assert_eq!(code_lines(text), 3);
}
