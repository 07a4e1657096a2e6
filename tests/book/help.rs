//! Generates the tables of commands in the book from the program's help texts.

use std::fmt::Write as _;

use crate::common::metaplan;

/// Options that all commands have. The page describes them only once.
const COMMON: [&str; 4] = ["--format", "-q, --quiet", "-v, --verbose", "-h, --help"];

struct Entry {
    head: String,
    text: String,
}

pub fn commands() -> String {
    let mut text = String::new();
    for (name, _) in subcommands(&help(&[])) {
        let path = [name.as_str()];
        let page = help(&path);
        let inner = subcommands(&page);
        describe(&path, &page, &mut text);
        for (inner, _) in inner {
            let path = [name.as_str(), inner.as_str()];
            describe(&path, &help(&path), &mut text);
        }
    }
    text
}

fn help(command: &[&str]) -> String {
    let outcome = metaplan(&[&["help"], command].concat());
    assert_eq!(outcome.status, 0, "{outcome:?}");
    outcome.stdout
}

fn subcommands(help: &str) -> Vec<(String, String)> {
    let Some((_, command_lines)) = help.split_once("\nCommands:\n") else { return Vec::new() };
    let lines = command_lines.lines().take_while(|line| !line.is_empty());
    // Continuation lines of a description are indented more than the first line.
    let lines = lines.filter_map(|line| line.strip_prefix("  ").filter(|line| !line.starts_with(' ')));
    let entries = lines.filter_map(|line| line.split_once("  "));
    let entries = entries.map(|(name, about)| (name.to_owned(), about.trim().to_owned()));
    entries.filter(|(name, _)| name != "help").collect()
}

fn describe(command: &[&str], help: &str, text: &mut String) {
    let about = help.split("\n\nUsage:").next().unwrap_or_default().replace("\n\n", ". ").replace('\n', " ");
    let usage = help.lines().find_map(|line| line.strip_prefix("Usage: ")).expect("a usage");
    let separator = if text.is_empty() { "" } else { "\n" };
    let _ =
        write!(text, "{separator}### metaplan {}\n\n{about}.\n\n```text\n{usage}\n```\n", command.join(" "));
    let entries: Vec<Entry> = entries(help).into_iter().filter(|entry| !is_common(&entry.head)).collect();
    if !entries.is_empty() {
        text.push_str("\n| argument or option | meaning |\n|---|---|\n");
    }
    for entry in entries {
        let _ = writeln!(text, "| `{}` | {} |", entry.head, entry.text);
    }
}

fn is_common(head: &str) -> bool {
    COMMON.iter().any(|common| head == *common || head.starts_with(&format!("{common} ")))
}

/// Parses the arguments and options in a help text. An entry is indented by less than ten columns, its
/// description by more. Paragraphs are wrapped; an empty line or a value of an enumeration begins a new
/// paragraph.
fn entries(help: &str) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let (mut is_list, mut begins_paragraph) = (false, true);
    for line in help.lines() {
        let indent = line.len() - line.trim_start().len();
        let content = line.trim();
        if line.ends_with(':') && indent == 0 {
            is_list = matches!(content, "Arguments:" | "Options:");
        } else if is_list && (1..10).contains(&indent) && content.starts_with(['-', '<', '[']) {
            entries.push(Entry { head: content.replace('|', "\\|"), text: String::new() });
            begins_paragraph = true;
        } else if content.is_empty() {
            begins_paragraph = true;
        } else if let Some(entry) = entries.last_mut().filter(|_| is_list) {
            let content = content.replace('|', "\\|");
            let begins_paragraph = std::mem::take(&mut begins_paragraph);
            match content.strip_prefix("- ").and_then(|value| value.split_once(':')) {
                Some((value, text)) => {
                    let separator = if entry.text.ends_with(':') { ' ' } else { ';' };
                    let space = if separator == ';' { " " } else { "" };
                    let _ = write!(entry.text, "{separator}{space}`{value}`: {}", text.trim());
                }
                None if content == "Possible values:" => entry.text.push_str(". Values:"),
                None if !begins_paragraph => {
                    let _ = write!(entry.text, " {content}");
                }
                None if content.starts_with('[') => {
                    let _ = write!(entry.text, " {content}");
                }
                None if entry.text.is_empty() => entry.text = content,
                None => {
                    let _ = write!(entry.text, ". {content}");
                }
            }
        }
    }
    entries
}
