//! Checks the generated parts of the book, between `<!-- generated: NAME -->` and `<!-- end of NAME -->`. An
//! outdated part fails the test. `METAPLAN_BLESS=1` rewrites it.

use std::fmt::Write as _;
use std::sync::Mutex;

use libtest_mimic::{Failed, Trial};
use metaplan::codes;

use crate::common::{metaplan, root};
use crate::{formats, help, is_blessing};

/// A generated part of the book: page, name of the part, and generator of its content.
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

pub fn trials() -> Vec<Trial> {
    let mut trials: Vec<Trial> = PARTS
        .into_iter()
        .map(|(page, name, make)| {
            Trial::test(format!("{page} ({name})"), move || check(page, name, &make())).with_kind("generated")
        })
        .collect();
    trials.push(Trial::test("docs/pictures/warehouse-timeline.svg", check_picture).with_kind("generated"));
    trials
}

fn check(page: &str, name: &str, content: &str) -> Result<(), Failed> {
    // Several tests can rewrite the same page, each as a whole, so they must not run concurrently.
    static WRITING: Mutex<()> = Mutex::new(());
    let _guard = WRITING.lock();
    let path = root().join(page);
    let text = std::fs::read_to_string(&path).expect("a page");
    let (begin, end) = (format!("<!-- generated: {name} -->\n"), format!("<!-- end of {name} -->"));
    let (text_before, remainder) =
        text.split_once(&begin).ok_or_else(|| format!("{page} has no part {name}"))?;
    let (current, text_after) =
        remainder.split_once(&end).ok_or_else(|| format!("{page}: {name} has no end"))?;
    let content = format!("\n{content}\n");
    if current == content {
        return Ok(());
    }
    if is_blessing() {
        std::fs::write(&path, format!("{text_before}{begin}{content}{end}{text_after}"))
            .expect("the page is written");
    }
    Err("out of date; METAPLAN_BLESS=1 rewrites it".into())
}

fn check_picture() -> Result<(), Failed> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("plan.svg").display().to_string();
    let outcome = metaplan(&["plan", "missions/templates/warehouse/mission.toml", "--svg", &file]);
    assert_eq!(outcome.status, 0, "{outcome:?}");
    let drawn = std::fs::read_to_string(&file).expect("a picture");
    let path = root().join("docs/pictures/warehouse-timeline.svg");
    if std::fs::read_to_string(&path).is_ok_and(|published| published == drawn) {
        return Ok(());
    }
    if is_blessing() {
        std::fs::write(&path, &drawn).expect("the picture is written");
    }
    Err("out of date; METAPLAN_BLESS=1 redraws it".into())
}

fn codes() -> String {
    let mut text = String::new();
    let mut letter = "";
    for code in codes::all() {
        // The codes are sorted, so each new letter begins a table.
        if code.code[..1] != *letter {
            letter = &code.code[..1];
            let _ = write!(
                text,
                "{}### {letter}\n\n| code | meaning | cause | remedy |\n|---|---|---|---|\n",
                if text.is_empty() { "" } else { "\n" }
            );
        }
        let cells = [code.meaning, code.cause, code.remedy].map(|cell| cell.replace('|', "\\|"));
        let _ = writeln!(text, "| {} | {} |", code.code, cells.join(" | "));
    }
    text
}

fn terms(kind: &str) -> String {
    let metamodel = std::fs::read_to_string(root().join("ontology/kb/tomasys.ttl")).expect("the metamodel");
    let is_property = kind != "owl:Class";
    let mut table = if is_property {
        "| term | domain | range | meaning |\n|---|---|---|---|\n".to_owned()
    } else {
        "| term | meaning |\n|---|---|\n".to_owned()
    };
    let mut count = 0;
    for statement in metamodel.split("\n\n").filter(|statement| statement.starts_with(':')) {
        let (head, _) = statement.split_once(" ;").expect("a statement");
        let (term, kinds) = head.split_once(" a ").expect("a type");
        if !kinds.split(" , ").any(|term_kind| term_kind == kind) {
            continue;
        }
        let value_of = |property: &str| {
            let line = statement.lines().find_map(|line| line.trim().strip_prefix(property))?;
            Some(line.trim().trim_end_matches([';', '.']).trim().to_owned())
        };
        let comment = value_of("rdfs:comment").unwrap_or_else(|| panic!("{term} has no comment"));
        let comment = comment.trim_end_matches("@en").trim_matches('"').to_owned();
        let name = term.trim_start_matches(':');
        count += 1;
        if is_property {
            let (domain, range_of_term) =
                (value_of("rdfs:domain").expect("a domain"), value_of("rdfs:range").expect("a range"));
            let _ = writeln!(
                table,
                "| `{name}` | {} | {} | {comment} |",
                classes(&domain),
                range(&range_of_term)
            );
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

fn range(text: &str) -> String {
    let Some((_, values)) = text.split_once("owl:oneOf (") else { return classes(text) };
    let values = values.split(')').next().expect("a list").split_whitespace();
    values.map(|value| format!("`{value}`")).collect::<Vec<_>>().join(", ")
}
