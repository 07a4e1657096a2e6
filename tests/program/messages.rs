//! Tests of messages: after random changes to the files of a mission or to the arguments, no message contains
//! internal names or debug output. Also tests when messages are coloured.

use std::path::Path;

use crate::common::{Outcome, metaplan_in};

/// Texts that must not occur in messages: Rust debug output, internal types, and names that exist only in the
/// explicit form of a domain.
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

/// Returns `true` if a text contains a capitalised word followed by a bracket, as Rust debug output does:
/// `Violation { step`, `InvalidUri(`.
fn is_debug_text(text: &str) -> bool {
    text.char_indices().filter(|(_, c)| "({".contains(*c)).any(|(at, c)| {
        let prefix = if c == '{' { text[..at].trim_end() } else { &text[..at] };
        let word = prefix.rsplit(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
        word.starts_with(|c: char| c.is_ascii_uppercase()) && word.chars().any(char::is_lowercase)
    })
}

/// Returns the lines of an outcome that contain internal texts or paths with `..`, and the exit
/// status if it is unexpected. Source lines are excluded, because they are content of the user's
/// files.
fn faults(outcome: &Outcome) -> Vec<String> {
    let output = format!("{}{}", outcome.stdout, outcome.stderr);
    let message_lines = output.lines().filter(|line| !line.contains(" │"));
    let mut faults = Vec::new();
    for line in message_lines {
        // Quoted texts and IRIs are content of the user's files as well.
        let unquoted: String = line.split('`').step_by(2).collect();
        let own_words: String = unquoted
            .split('<')
            .map(|part| part.split_once('>').map_or(part, |(_, after_iri)| after_iri))
            .collect();
        let internal_word =
            INTERNAL.iter().find(|word| own_words.contains(**word) || line.contains("fd_meets_"));
        if internal_word.is_some() || is_debug_text(&own_words) || line.contains("..") && line.contains('/') {
            faults.push(line.to_owned());
        }
    }
    if ![0, 1, 2, 3, 10, 12, 20, 30].contains(&outcome.status) {
        faults.push(format!("status {}", outcome.status));
    }
    faults
}

/// Returns a copy of a text with one changed line. `number` determines the line and the kind of change.
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
    let mut changed_lines: Vec<&str> = lines.clone();
    changed_lines[at] = &changed;
    changed_lines.join("\n") + "\n"
}

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
                    check_error(here, file, *number, commands);
                }
            });
        }
    });
}

fn check_error(here: &Path, file: &str, number: usize, commands: &[&[&str]]) {
    let path = here.join("m").join(file);
    let text = std::fs::read_to_string(&path).expect("text");
    let mangled_text = mangled(&text, number);
    std::fs::write(&path, &mangled_text).expect("written");
    for command in commands {
        let outcome = metaplan_in(here, command, "");
        let faulty_lines = faults(&outcome);
        assert!(
            faulty_lines.is_empty(),
            "{file} {number} {command:?}: {faulty_lines:#?}\n{mangled_text}\n{outcome:#?}"
        );
    }
    std::fs::write(&path, text).expect("written");
}

#[test]
fn messages_about_files_contain_no_internals() {
    let files = ["mission.toml", "domain.pddl", "problem.pddl", "robot.ttl", "places.csv"];
    check(&files, "warehouse", 24, &[&["lint", "m/mission.toml"]]);
    check(&["problem.pddl"], "blank", 10, &[&["plan", "m/mission.toml", "--time-limit", "2"]]);
}

#[test]
fn messages_about_arguments_contain_no_internals() {
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
    let mut failures = Vec::new();
    for command in commands {
        let outcome = metaplan_in(here, command, "");
        let faulty_lines = faults(&outcome);
        if !faulty_lines.is_empty() {
            failures.push(format!("{command:?}: {faulty_lines:#?}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn colours_depend_on_option_and_terminal() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    std::fs::write(here.join("m.prism"), "mdp zzz // \u{1b}[2J\n").expect("written");
    let check = |options: &[&str]| {
        metaplan_in(here, &[&["check", "m.prism", "Pmax=? [ F true ]"], options].concat(), "").stderr
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
fn debug_text_is_detected() {
    for text in ["Violation { step: 1 }", "a (InvalidUri(\"x\"))", "found NoPlan(3)"] {
        assert!(is_debug_text(text), "{text}");
    }
    for text in ["not well-formed Turtle (here)", "OWL 2 RL (rules)", "move (a)", "M104 (x)", "plan {1}"] {
        assert!(!is_debug_text(text), "{text}");
    }
}

#[test]
fn a_metric_that_is_not_minimised_is_named() {
    let directory = tempfile::tempdir().expect("a directory");
    let domain = "(define (domain market) (:requirements :strips :numeric-fluents)
        (:predicates (ready) (bought)) (:functions (amount) (price) (total-cost))
        (:action order :parameters () :effect (and (ready) (increase (amount) 5)))
        (:action return :parameters () :effect (decrease (amount) 6))
        (:action buy :parameters () :precondition (ready)
          :effect (and (bought) (increase (total-cost) (* (amount) (price))))))";
    let problem =
        "(define (problem p) (:domain market) (:init (= (amount) 0) (= (price) 1000) (= (total-cost) 0))
        (:goal (bought)) (:metric minimize (total-cost)))";
    std::fs::write(directory.path().join("domain.pddl"), domain).expect("written");
    std::fs::write(directory.path().join("problem.pddl"), problem).expect("written");
    let outcome = metaplan_in(directory.path(), &["plan", "domain.pddl", "problem.pddl"], "");
    assert!(outcome.stdout.contains("cost 5000: a plan, not proved optimal"), "{outcome:#?}");
    assert!(outcome.stderr.contains("warning[M119]: the metric was not minimised"), "{outcome:#?}");
    assert!(outcome.stderr.contains("total-cost"), "{outcome:#?}");
    // The amount is unbounded, so that only a limit ends the search.
    let limited = ["plan", "domain.pddl", "problem.pddl", "--concurrent", "--time-limit", "1"];
    let outcome = metaplan_in(directory.path(), &limited, "");
    assert!(outcome.stderr.contains("warning[M119]: the metric was not minimised"), "{outcome:#?}");
}
