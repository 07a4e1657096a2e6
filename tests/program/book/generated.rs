//! Parts of the book that are made of what they are about, between `<!-- generated: NAME -->` and `<!-- end of NAME -->`.
//! A part that is out of date fails here; with `METAPLAN_BLESS=1` it is written anew.

use std::fmt::Write as _;

use metaplan::codes;

use super::{formats, help};
use crate::common::{metaplan, root};

/// A page, the name of a part of it, and what makes that.
type Part = (&'static str, &'static str, fn() -> String);

const PARTS: [Part; 8] = [
    ("docs/reference/codes.md", "codes", codes),
    ("docs/reference/commands.md", "commands", help::commands),
    ("docs/reference/json.md", "formats", formats::answers),
    ("docs/reference/manifest.md", "keys", formats::manifest),
    ("docs/how-to/study.md", "keys", formats::study),
    ("docs/reference/tomasys.md", "classes", || terms("owl:Class")),
    ("docs/reference/tomasys.md", "relations", || terms("owl:ObjectProperty")),
    ("docs/reference/tomasys.md", "values", || terms("owl:DatatypeProperty")),
];

#[test]
fn generated_parts_are_up_to_date() {
    let mut stale = Vec::new();
    for (page, name, make) in PARTS {
        let path = root().join(page);
        let text = std::fs::read_to_string(&path).expect("a page");
        let (begin, end) = (format!("<!-- generated: {name} -->\n"), format!("<!-- end of {name} -->"));
        let (before, rest) = text.split_once(&begin).unwrap_or_else(|| panic!("{page} has no part {name}"));
        let (shown, after) = rest.split_once(&end).unwrap_or_else(|| panic!("{page}: {name} has no end"));
        let made = format!("\n{}\n", make());
        if shown == made {
            continue;
        }
        if std::env::var_os("METAPLAN_BLESS").is_some() {
            std::fs::write(&path, format!("{before}{begin}{made}{end}{after}")).expect("the page is written");
        }
        stale.push(format!("{page}: {name}"));
    }
    assert!(stale.is_empty(), "out of date (METAPLAN_BLESS=1 writes them): {stale:?}");
}

/// The picture of the tutorial is what the program draws.
#[test]
fn the_picture_of_the_tutorial_is_drawn_by_the_program() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("plan.svg").display().to_string();
    let outcome = metaplan(&["plan", "missions/templates/warehouse/mission.toml", "--svg", &file]);
    assert_eq!(outcome.status, 0, "{outcome:?}");
    let drawn = std::fs::read_to_string(&file).expect("a picture");
    let path = root().join("docs/pictures/warehouse-timeline.svg");
    if std::env::var_os("METAPLAN_BLESS").is_some() {
        std::fs::write(&path, &drawn).expect("the picture is written");
    }
    assert!(std::fs::read_to_string(path).is_ok_and(|shown| shown == drawn), "it is another picture");
}

/// All codes, by their first letter.
fn codes() -> String {
    let mut text = String::new();
    let mut letter = "";
    for code in codes::all() {
        if code.code[..1] != *letter {
            letter = &code.code[..1];
            let _ = write!(
                text,
                "{}### {letter}\n\n| code | says | because | so |\n|---|---|---|---|\n",
                if text.is_empty() { "" } else { "\n" }
            );
        }
        let cells = [code.meaning, code.cause, code.remedy].map(|cell| cell.replace('|', "\\|"));
        let _ = writeln!(text, "| {} | {} |", code.code, cells.join(" | "));
    }
    text
}

/// The terms of the TOMASys metamodel that are of this kind, with what it says of them.
fn terms(kind: &str) -> String {
    let metamodel = std::fs::read_to_string(root().join("ontology/kb/tomasys.ttl")).expect("the metamodel");
    let properties = kind != "owl:Class";
    let mut table = if properties {
        "| term | of | is | means |\n|---|---|---|---|\n".to_owned()
    } else {
        "| term | means |\n|---|---|\n".to_owned()
    };
    let mut count = 0;
    for statement in metamodel.split("\n\n").filter(|statement| statement.starts_with(':')) {
        let (head, _) = statement.split_once(" ;").expect("a statement");
        let (term, kinds) = head.split_once(" a ").expect("a type");
        if !kinds.split(" , ").any(|its| its == kind) {
            continue;
        }
        let said = |property: &str| {
            let line = statement.lines().find_map(|line| line.trim().strip_prefix(property))?;
            Some(line.trim().trim_end_matches([';', '.']).trim().to_owned())
        };
        let comment = said("rdfs:comment").unwrap_or_else(|| panic!("{term} has no comment"));
        let comment = comment.trim_end_matches("@en").trim_matches('"').to_owned();
        let name = term.trim_start_matches(':');
        count += 1;
        if properties {
            let (of, is) = (said("rdfs:domain").expect("a domain"), said("rdfs:range").expect("a range"));
            let _ = writeln!(table, "| `{name}` | {} | {} | {comment} |", classes(&of), range(&is));
        } else {
            let _ = writeln!(table, "| `{name}` | {comment} |");
        }
    }
    assert!(count > 10, "{count} terms of {kind}");
    table
}

fn classes(list: &str) -> String {
    let names = list
        .split(" , ")
        .map(|name| format!("`{}`", name.trim_start_matches(':').trim_start_matches("xsd:")));
    names.collect::<Vec<_>>().join(", ")
}

/// A range as the page says it: classes, a datatype, or the values of an enumeration.
fn range(text: &str) -> String {
    let Some((_, values)) = text.split_once("owl:oneOf (") else { return classes(text) };
    let values = values.split(')').next().expect("a list").split_whitespace();
    values.map(|value| format!("`{value}`")).collect::<Vec<_>>().join(", ")
}
