//! Messages are for people: whatever is done to the files of a mission, no message shows how the program is made, and each has the one form.

use std::path::Path;

use crate::common::{Outcome, metaplan_in};

/// What no message has: values as Rust prints them, names that only the explicit form of a domain has, and types of the program.
const INTERNAL: [&str; 14] = [
    "Some(",
    "None)",
    "Ok(",
    "Err(",
    "Error(",
    "Span {",
    "Name(",
    "Position {",
    "::",
    "fd_meets_",
    "fd_at_work",
    "f_configured",
    "panicked",
    "{:?}",
];

/// A word as Rust writes a type, followed by what it holds: `Violation { step`, `InvalidUri(`.
fn is_debug_text(text: &str) -> bool {
    text.char_indices().filter(|(_, c)| "({".contains(*c)).any(|(at, c)| {
        let before = if c == '{' { text[..at].trim_end() } else { &text[..at] };
        let word = before.rsplit(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
        word.starts_with(|c: char| c.is_ascii_uppercase()) && word.chars().any(char::is_lowercase)
    })
}

/// What is wrong with the messages of an outcome; source lines and places are the user's own.
fn faults(outcome: &Outcome) -> Vec<String> {
    let all = format!("{}{}", outcome.stdout, outcome.stderr);
    let own = all.lines().filter(|line| !line.contains(" │"));
    let mut faults = Vec::new();
    for line in own {
        // What is quoted, and IRIs, are of the files.
        let quoted: String = line.split('`').step_by(2).collect();
        let spoken: String =
            quoted.split('<').map(|part| part.split_once('>').map_or(part, |(_, rest)| rest)).collect();
        let shown = INTERNAL.iter().find(|word| spoken.contains(**word) || line.contains("fd_meets_"));
        if shown.is_some() || is_debug_text(&spoken) || line.contains("..") && line.contains('/') {
            faults.push(line.to_owned());
        }
    }
    if ![0, 1, 2, 3, 10, 20, 30].contains(&outcome.status) {
        faults.push(format!("status {}", outcome.status));
    }
    faults
}

/// A file with one thing wrong: `number` says which line, and what happens to it.
fn mangled(text: &str, number: usize) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let at = number / 5 * 7 % lines.len();
    let line = lines[at];
    let middle = (line.len() / 2..=line.len()).find(|at| line.is_char_boundary(*at)).unwrap_or(0);
    let changed = match number % 5 {
        0 => String::new(),
        1 => format!("{line} zzz"),
        2 => line.replace(|c: char| c.is_ascii_digit(), "-1e99"),
        3 => format!("{}(\"{}", &line[..middle], &line[middle..]),
        _ => line.replacen('_', "x", 1),
    };
    let mut all: Vec<&str> = lines.clone();
    all[at] = &changed;
    all.join("\n") + "\n"
}

/// Runs a command on every mangled copy, on two threads.
fn check(files: &[&str], template: &str, count: usize, commands: &[&[&str]]) {
    let work: Vec<(&str, usize)> =
        files.iter().flat_map(|file| (0..count).map(move |number| (*file, number))).collect();
    let halves = work.split_at(work.len() / 2);
    std::thread::scope(|scope| {
        for half in [halves.0, halves.1] {
            scope.spawn(move || {
                let directory = tempfile::tempdir().expect("a directory");
                let here = directory.path();
                assert_eq!(metaplan_in(here, &["init", "m", "--from", template], "").status, 0);
                for (file, number) in half {
                    one(here, file, *number, commands);
                }
            });
        }
    });
}

fn one(here: &Path, file: &str, number: usize, commands: &[&[&str]]) {
    let path = here.join("m").join(file);
    let text = std::fs::read_to_string(&path).expect("text");
    let bad = mangled(&text, number);
    std::fs::write(&path, &bad).expect("written");
    for command in commands {
        let outcome = metaplan_in(here, command, "");
        let found = faults(&outcome);
        assert!(found.is_empty(), "{file} {number} {command:?}: {found:#?}\n{bad}\n{outcome:#?}");
    }
    std::fs::write(&path, text).expect("written");
}

#[test]
fn no_message_shows_how_the_program_is_made() {
    let files = ["mission.toml", "domain.pddl", "problem.pddl", "robot.ttl", "places.csv"];
    check(&files, "warehouse", 24, &[&["lint", "m/mission.toml"]]);
    check(&["problem.pddl"], "blank", 10, &[&["plan", "m/mission.toml", "--time-limit", "2"]]);
}

/// Names and values that do not fit, in every place that takes one.
#[test]
fn no_message_about_an_argument_does_either() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    assert_eq!(metaplan_in(here, &["init", "m", "--from", "warehouse"], "").status, 0);
    std::fs::write(here.join("plan"), "(move near_rack fd_meets crossing)\n(zzz)\n").expect("written");
    std::fs::write(here.join("short"), "(pick box near_rack fd_suction)\n(put box near_rack)\n")
        .expect("written");
    std::fs::write(
        here.join("m.prism"),
        "mdp\nmodule m\n s : [0..2] init 5;\n [] s=0 -> 0.4:(s'=7);\nendmodule\n",
    )
    .expect("written");
    std::fs::write(here.join("r.swrl"), "p(?x) -> q(?y) .\nswrlb:lessThn(?x, 1) -> (").expect("written");
    let mission = "m/mission.toml";
    let commands: [&[&str]; 23] = [
        &["plan", mission, "--set", "bogus=1"],
        &["plan", mission, "--set", "needed_lihgt=1"],
        &["plan", mission, "--set", "battery=much"],
        &["plan", mission, "--fail", "c_lidra"],
        &["plan", mission, "--scenario", "lidar_fail"],
        &["plan", mission, "--minimize", "(+ (battery) (zzz))"],
        &["plan", mission, "--minimize", "(meets"],
        &["plan", mission, "--solver", "no such solver"],
        &["plan", mission, "--fail", "c_arm"],
        &["plan", "m/robot.ttl"],
        &["plan", "m/problem.pddl", "m/domain.pddl"],
        &["plan", "m/domain.pddl", "m/problem.pddl", "--kb", "m/domain.pddl"],
        &["explain", mission, "fd_lidra"],
        &["explain", "Q999"],
        &["validate", mission, "plan"],
        &["validate", mission, "short"],
        &["validate", mission, "dark"],
        &["check", "m.prism", "Pmax=? [ F \"x\" ]"],
        &["check", "m.prism", "Pmax=? [ F ]"],
        &["reason", "m/robot.ttl", "--rules", "r.swrl"],
        &["reason", "m/robot.ttl", "--why", "zzz a zzz"],
        &["configure", "m/robot.ttl", "--objective", "f_grsp"],
        &["simulate", mission, "--scenario", "dusty"],
    ];
    let mut wrong = Vec::new();
    for command in commands {
        let outcome = metaplan_in(here, command, "");
        let found = faults(&outcome);
        if !found.is_empty() {
            wrong.push(format!("{command:?}: {found:#?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The same sentence with colours or without; without a terminal there are none, unless asked for.
#[test]
fn colours_are_asked_for_or_of_a_terminal() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    std::fs::write(here.join("m.prism"), "mdp zzz // \u{1b}[2J\n").expect("written");
    let check = |more: &[&str]| {
        metaplan_in(here, &[&["check", "m.prism", "Pmax=? [ F true ]"], more].concat(), "").stderr
    };
    let plain = check(&[]);
    assert!(plain.starts_with("error[Q102]: ") && !plain.contains('\u{1b}'), "{plain:?}");
    assert!(plain.contains("┌─ m.prism:1:5\n") && plain.contains("1 │ mdp zzz // \\u{1b}[2J"), "{plain}");
    assert_eq!(plain, check(&["--color", "never"]));
    let colored = check(&["--color=always"]);
    assert!(colored.contains("\u{1b}[") && !colored.contains("\u{1b}[2J"), "{colored:?}");
    let usage = metaplan_in(here, &["plan", "--color", "always", "--bogus"], "").stderr;
    assert!(usage.contains("\u{1b}["), "{usage:?}");
}

#[test]
fn debug_text_is_found() {
    for text in ["Violation { step: 1 }", "a (InvalidUri(\"x\"))", "found NoPlan(3)"] {
        assert!(is_debug_text(text), "{text}");
    }
    for text in ["not well-formed Turtle (here)", "OWL 2 RL (rules)", "move (a)", "M104 (x)", "plan {1}"] {
        assert!(!is_debug_text(text), "{text}");
    }
}
