//! Tests of commands without a mission: error codes, shell completions, manual pages.

use crate::common::{metaplan, metaplan_in};

#[test]
fn error_codes_are_explained() {
    let outcome = metaplan(&["explain", "M118"]);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (0, ""), "{outcome:#?}");
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert!(
        lines[0].starts_with("M118: ") && lines[1].starts_with("cause: ") && lines[2].starts_with("remedy: ")
    );
    let answer = metaplan(&["explain", "n132", "--format", "json"]).json();
    assert_eq!((answer["format"].as_str(), answer["code"].as_str()), (Some("metaplan-code/1"), Some("N132")));
    assert!(answer["remedy"].as_str().expect("a remedy").contains("[functions.F.modes]"));
    let unknown = metaplan(&["explain", "M999"]);
    assert_eq!(unknown.status, 2, "{unknown:#?}");
    assert!(unknown.stderr.contains("error[M138]: there is no code `M999`"), "{unknown:#?}");
    // A code takes neither a design nor the options of a mission.
    for more in [&["fd_lidar"][..], &["--fail", "c_lidar"], &["--scenario", "night"], &["--kb", "robot.ttl"]]
    {
        let refused = metaplan(&[&["explain", "M118"], more].concat());
        assert_eq!((refused.status, refused.stdout.as_str()), (2, ""), "{more:?}: {refused:#?}");
        assert!(
            refused.stderr.contains("error[M107]: a code has neither a design"),
            "{more:?}: {refused:#?}"
        );
        assert!(refused.stderr.contains("`metaplan explain M118`"), "{more:?}: {refused:#?}");
    }
    // If a file has the name of a code, it is read as a mission.
    let directory = tempfile::tempdir().expect("a directory");
    std::fs::write(directory.path().join("M118"), "name = 1").expect("a file");
    let mission = metaplan_in(directory.path(), &["explain", "M118"], "");
    assert!(mission.status == 3 && mission.stderr.contains("M104"), "{mission:#?}");
}

#[test]
fn shells_complete_commands_and_options() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let outcome = metaplan(&["completions", shell]);
        assert_eq!((outcome.status, outcome.stderr.as_str()), (0, ""), "{shell}");
        for word in ["plan", "lint", "certificate", "ignore-missing-imports"] {
            assert!(outcome.stdout.contains(word), "{shell}: no {word}");
        }
    }
}

#[test]
fn commands_have_manual_pages() {
    let directory = tempfile::tempdir().expect("a directory");
    let outcome = metaplan_in(directory.path(), &["man", "-o", "pages"], "");
    assert_eq!((outcome.status, outcome.stdout.as_str(), outcome.stderr.as_str()), (0, "", ""));
    let page =
        |name: &str| std::fs::read_to_string(directory.path().join("pages").join(name)).expect("a page");
    let main_page = page("metaplan.1");
    for command in ["plan", "init", "lint", "explain", "run", "verify"] {
        assert!(main_page.contains(&format!("metaplan\\-{command}(1)")), "{command}");
        assert!(page(&format!("metaplan-{command}.1")).contains(".SH OPTIONS"), "{command}");
    }
    std::fs::write(directory.path().join("file"), "").expect("a file");
    let refused = metaplan_in(directory.path(), &["man", "-o", "file/pages"], "");
    assert!(refused.status == 3 && refused.stderr.contains("M109"), "{refused:#?}");
}
