//! Test of the tables of error codes: every code in the source of a crate is listed, and every listed code is used.

use std::collections::{BTreeMap, BTreeSet};

use metaplan::codes::{self, Code};

const TABLES: [&str; 10] =
    ["rules", "ontology", "pddl", "task", "probabilistic", "mission", "verify", "src", "ros", "fleet"];
const LETTERS: &str = "EMNOPQR";

/// Returns the codes in a file, except for those in tests and in lines of comments.
fn codes_in(text: &str) -> BTreeSet<String> {
    let library_part = super::without_tests(text);
    let lines = library_part.lines().filter(|line| !line.trim_start().starts_with("//"));
    let words = lines.flat_map(|line| line.split(|c: char| !(c.is_alphanumeric() || c == '_')));
    let is_code = |word: &&str| codes::is_code(word) && word.starts_with(|c| LETTERS.contains(c));
    words.filter(is_code).map(str::to_owned).collect()
}

fn owner(path: &str) -> Option<&'static str> {
    let folder = path
        .trim_start_matches("crates/")
        .trim_start_matches("integrations/")
        .split('/')
        .next()
        .unwrap_or_default();
    TABLES.into_iter().find(|table| *table == folder)
}

fn is_table(path: &str) -> bool {
    path.ends_with("/codes.rs") || path.contains("/codes/")
}

type ByCrate = BTreeMap<&'static str, BTreeSet<String>>;

/// Returns two maps: the codes in the sources of each crate, and the codes in its table. The facade lists the
/// codes of `metaplan-ros` and `metaplan-fleet`.
fn codes_by_crate() -> (ByCrate, ByCrate) {
    let (mut used, mut listed) = (BTreeMap::new(), BTreeMap::new());
    for (path, text) in super::files() {
        let is_source = path.starts_with("src/") || path.contains("/src/");
        let Some(crate_name) = owner(&path).filter(|_| is_source && !path.contains("/tests")) else {
            continue;
        };
        let crate_name = match path.as_str() {
            "src/codes/ros.rs" => "ros",
            "src/codes/fleet.rs" => "fleet",
            _ => crate_name,
        };
        let codes: &mut BTreeMap<_, BTreeSet<String>> = if is_table(&path) { &mut listed } else { &mut used };
        let quoted = |text: &str| -> BTreeSet<String> {
            let words = text.split('"').skip(1).step_by(2).filter(|word| codes::is_code(word));
            words.map(str::to_owned).collect()
        };
        codes.entry(crate_name).or_default().extend(if is_table(&path) {
            quoted(&text)
        } else {
            codes_in(&text)
        });
    }
    (used, listed)
}

#[test]
fn used_codes_and_listed_codes_agree() {
    let (used, listed) = codes_by_crate();
    let all_listed: BTreeSet<&String> = listed.values().flatten().collect();
    let mut differences = Vec::new();
    for table in TABLES {
        let (used, listed) = (&used[table], &listed[table]);
        let unknown = used.iter().filter(|code| !all_listed.contains(code));
        differences.extend(unknown.map(|code| format!("{table} gives {code}, which is in no table")));
        let unused = listed.difference(used);
        differences
            .extend(unused.map(|code| format!("{code} is in the table of {table}, which never gives it")));
    }
    assert!(differences.is_empty(), "{}", differences.join("\n"));
    let exported_codes: Vec<&str> = codes::all().iter().map(|code| code.code).collect();
    assert_eq!(exported_codes, all_listed.into_iter().collect::<Vec<_>>(), "each code once, in order");
}

#[test]
fn entries_of_tables_are_sentences() {
    for Code { code, meaning, cause, remedy } in codes::all() {
        for text in [meaning, cause, remedy] {
            assert!(text.ends_with('.') || text.ends_with('`'), "{code}: {text}");
            assert!(text.len() > 6 && !text.contains("  "), "{code}: {text}");
            assert_eq!(text.matches('`').count() % 2, 0, "{code}: {text}");
        }
        assert!(meaning != cause && cause != remedy, "{code}");
    }
}

#[test]
fn codes_are_distinguished_from_other_words() {
    let text = "// M999\nlet a = \"M101\"; // no\nuse x::I256; error[O102]: R104 <{name}>\n#[cfg(test)]\nmod tests { \"P100\" }\n\"P101\"";
    let expected: BTreeSet<String> = ["M101", "O102", "P101", "R104"].map(str::to_owned).into();
    assert_eq!(codes_in(text), expected);
}
