//! Tests of output widths: tables and help fit into `COLUMNS`. Without a terminal, tables are not wrapped.

use std::process::Command;

use crate::common::root;

fn answer(arguments: &[&str], columns: Option<&str>) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_metaplan"));
    program.args(arguments).current_dir(root()).env_remove("COLUMNS");
    if let Some(columns) = columns {
        program.env("COLUMNS", columns);
    }
    let output = program.output().expect("the program runs");
    assert!(output.status.code().is_some_and(|code| code < 2), "{arguments:?}: {output:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn width(text: &str) -> usize {
    text.lines().map(|line| line.chars().count()).max().unwrap_or(0)
}

fn words(text: &str) -> Vec<&str> {
    let mut words: Vec<&str> = text.split_whitespace().collect();
    words.sort_unstable();
    words
}

fn characters(text: &str) -> Vec<char> {
    let mut characters: Vec<char> = text.chars().filter(|character| !character.is_whitespace()).collect();
    characters.sort_unstable();
    characters
}

#[test]
fn tables_fit_into_the_terminal_width() {
    for (arguments, columns, keeps_words) in [
        (&["plan", "missions/uuv.toml"][..], 80, true),
        (&["plan", "missions/templates/warehouse/mission.toml"], 80, true),
        (&["plan", "missions/templates/warehouse/mission.toml"], 60, true),
        (&["configure", "ontology/kb/ugv.ttl", "--rules", "coadaptation", "--fail", "c_kinect"], 72, true),
        (&["simulate", "missions/uuv.toml", "--scenario", "suave", "--runs", "1"], 110, true),
        (&["simulate", "missions/uuv.toml", "--scenario", "suave", "--runs", "1"], 80, false),
        (&["plan", "missions/uuv.toml"], 40, false),
        (&["configure", "ontology/kb/ugv.ttl", "--rules", "coadaptation"], 40, false),
    ] {
        let wide = answer(arguments, None);
        let narrow = answer(arguments, Some(&columns.to_string()));
        let table = |text: &str| text.split("\n\n").next().unwrap_or_default().to_owned();
        assert!(width(&table(&wide)) > columns, "{arguments:?} is narrow anyway:\n{wide}");
        assert!(width(&table(&narrow)) <= columns, "{arguments:?}:\n{narrow}");
        // Words are broken only if the longest words of all columns do not fit next to each other.
        if keeps_words {
            assert_eq!(words(&wide), words(&narrow), "{arguments:?}");
        } else {
            assert_eq!(characters(&wide), characters(&narrow), "{arguments:?}");
        }
        assert_eq!(answer(arguments, Some("1000")), wide, "{arguments:?}");
        assert_eq!(answer(arguments, Some("0")), wide, "{arguments:?}: no width");
    }
}

#[test]
fn tables_in_files_are_not_wrapped() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("table").display().to_string();
    let plan = ["plan", "missions/uuv.toml"];
    answer(&[&plan[..], &["--plan-format", "table", "-o", &file]].concat(), Some("60"));
    assert_eq!(std::fs::read_to_string(&file).expect("a file"), answer(&plan, None));
}

#[test]
fn help_fits_into_the_terminal_width() {
    let overview = answer(&["help"], None);
    let (_, commands) = overview.split_once("\nCommands:\n").expect("commands");
    let commands = commands.lines().take_while(|line| !line.is_empty());
    let names: Vec<&str> = commands
        .filter_map(|line| line.strip_prefix("  ").filter(|line| !line.starts_with(' ')))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(names.len() > 15, "{names:?}");
    for name in names.iter().filter(|name| **name != "help") {
        for (columns, max_width) in [(None, 80), (Some("60"), 60), (Some("100"), 100), (Some("300"), 100)] {
            let help = answer(&["help", name], columns);
            // Command lines are not wrapped, so that they can be copied.
            let is_text = |line: &&str| !line.starts_with("Usage:") && !line.starts_with("  metaplan ");
            let overlong_lines: Vec<&str> =
                help.lines().filter(is_text).filter(|line| line.chars().count() > max_width).collect();
            assert!(overlong_lines.is_empty(), "help {name}, {columns:?}: {overlong_lines:#?}");
        }
        let examples = answer(&["help", name], None);
        let examples = examples.split_once("\nExamples:\n").map_or("", |(_, examples)| examples);
        assert!(width(examples) <= 80, "help {name}: {examples}");
    }
}
