//! Every code that a crate's source gives is in a table, with what it means; and every code of a table is given.

use std::collections::{BTreeMap, BTreeSet};

use metaplan::codes::{self, Code};

/// The crates that have a table, and the letters of codes.
const TABLES: [&str; 10] =
    ["rules", "ontology", "pddl", "task", "probabilistic", "mission", "verify", "src", "ros", "fleet"];
const LETTERS: &str = "EMNOPQR";

/// The codes that stand in a text as words, outside of comments and tests.
fn given(text: &str) -> BTreeSet<String> {
    let own = text.split("#[cfg(test)]").next().unwrap_or(text);
    let lines = own.lines().filter(|line| !line.trim_start().starts_with("//"));
    let words = lines.flat_map(|line| line.split(|c: char| !(c.is_alphanumeric() || c == '_')));
    let is_code = |word: &&str| codes::is_code(word) && word.starts_with(|c| LETTERS.contains(c));
    words.filter(is_code).map(str::to_owned).collect()
}

/// The crate that a file belongs to, if it has a table.
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

/// By crate: the codes that its files give, and those of its table. What `metaplan-ros` and `metaplan-fleet` give is listed in the facade, their only neighbour.
fn found() -> (ByCrate, ByCrate) {
    let (mut used, mut listed) = (BTreeMap::new(), BTreeMap::new());
    for (path, text) in super::files() {
        let is_source = path.starts_with("src/") || path.contains("/src/");
        let Some(own) = owner(&path).filter(|_| is_source && !path.contains("/tests")) else { continue };
        let own = match path.as_str() {
            "src/codes/ros.rs" => "ros",
            "src/codes/fleet.rs" => "fleet",
            _ => own,
        };
        let codes: &mut BTreeMap<_, BTreeSet<String>> = if is_table(&path) { &mut listed } else { &mut used };
        let quoted = |text: &str| -> BTreeSet<String> {
            let quoted = text.split('"').skip(1).step_by(2).filter(|word| codes::is_code(word));
            quoted.map(str::to_owned).collect()
        };
        codes.entry(own).or_default().extend(if is_table(&path) { quoted(&text) } else { given(&text) });
    }
    (used, listed)
}

#[test]
fn every_code_has_a_meaning_and_every_meaning_a_code() {
    let (used, listed) = found();
    let all: BTreeSet<&String> = listed.values().flatten().collect();
    let mut wrong = Vec::new();
    for table in TABLES {
        let (used, listed) = (&used[table], &listed[table]);
        let unknown = used.iter().filter(|code| !all.contains(code));
        wrong.extend(unknown.map(|code| format!("{table} gives {code}, which is in no table")));
        let unused = listed.difference(used);
        wrong.extend(unused.map(|code| format!("{code} is in the table of {table}, which never gives it")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let known: Vec<&str> = codes::all().iter().map(|code| code.code).collect();
    assert_eq!(known, all.into_iter().collect::<Vec<_>>(), "each code once, in order");
}

/// Each is a sentence, and says something of its own.
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
fn codes_are_told_from_other_words() {
    let text = "// M999\nlet a = \"M101\"; // no\nuse x::I256; error[O102]: R104 <{name}>\n#[cfg(test)]\nmod tests { \"P100\" }";
    let expected: BTreeSet<String> = ["M101", "O102", "R104"].map(str::to_owned).into();
    assert_eq!(given(text), expected);
}
