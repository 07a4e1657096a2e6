//! Tests of `metaplan init`: each template can be planned without changes and without warnings, and no
//! existing file is overwritten.

use std::path::Path;

#[cfg(unix)]
use crate::common::program;
use crate::common::{headlines, metaplan_in, root};

fn check(template: &str, cost: &str, scenarios: &[(&str, &str)]) {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    let outcome = metaplan_in(here, &["init", "my-robot", "--from", template], "");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (0, ""), "{outcome:#?}");
    assert!(outcome.stdout.ends_with("next: metaplan plan my-robot/mission.toml\n"), "{outcome:#?}");

    let manifest = "my-robot/mission.toml";
    let mut situations = vec![(vec![], cost)];
    situations.extend(scenarios.iter().map(|(name, cost)| (vec!["--scenario", name], *cost)));
    let text = std::fs::read_to_string(here.join(manifest)).expect("a manifest");
    assert!(text.starts_with("#:schema ./mission.schema.json\n"), "{text}");
    let schema = std::fs::read_to_string(here.join("my-robot/mission.schema.json")).expect("a schema");
    assert_eq!(schema, metaplan_in(here, &["schema", "manifest"], "").stdout);
    let plannable = text.matches("\n[scenarios.").count() - text.matches(".simulation]").count() * 2;
    assert_eq!(scenarios.len(), plannable, "every scenario that is planned is listed");
    for (situation, cost) in situations {
        let planned =
            metaplan_in(here, &[&["plan", manifest, "--format", "json"], &situation[..]].concat(), "");
        assert_eq!((planned.status, planned.stderr.as_str()), (0, ""), "{situation:?}: {planned:#?}");
        let answer = planned.json();
        assert_eq!(answer["mission"], "my-robot");
        assert_eq!(answer["cost"].to_string(), cost, "{situation:?}: {answer:#}");
        let plan =
            metaplan_in(here, &[&["plan", manifest, "--plan-format", "ipc"], &situation[..]].concat(), "");
        let validated =
            metaplan_in(here, &[&["validate", manifest, "-"], &situation[..]].concat(), &plan.stdout);
        assert_eq!(validated.status, 0, "{situation:?}: {validated:#?}");
        assert!(validated.stdout.starts_with(&format!("valid, metric {cost},")), "{validated:#?}");
    }
    if template == "warehouse" {
        let simulated = metaplan_in(
            here,
            &["simulate", manifest, "--scenario", "lidar_under_way", "--strategy", "joint"],
            "",
        );
        assert_eq!((simulated.status, simulated.stderr.as_str()), (0, ""), "{simulated:#?}");
        assert!(simulated.stdout.contains("1 of 1"), "{simulated:#?}");
    }
}

#[test]
fn blank_template_can_be_planned() {
    check("blank", "1", &[("first_fails", "2")]);
}

#[test]
fn ugv_template_can_be_planned() {
    check("ugv", "408", &[("kinect_failure", "412"), ("bright_sun", "516")]);
}

#[test]
fn warehouse_template_can_be_planned() {
    let scenarios =
        [("lidar_fails", "113.2"), ("suction_fails", "118.8"), ("dusty", "118.8"), ("more_battery", "54.8")];
    check("warehouse", "110.8", &scenarios);
}

fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).expect("a directory");
    entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn nothing_is_overwritten() {
    let directory = tempfile::tempdir().expect("a directory");
    let here = directory.path();
    std::fs::create_dir(here.join("empty")).expect("a directory");
    std::fs::write(here.join("file"), "mine").expect("a file");
    for name in ["empty", "file"] {
        let outcome = metaplan_in(here, &["init", name], "");
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        assert!(
            headlines(&outcome.stderr).starts_with(&format!("{name}: error[M133]: this exists already")),
            "{outcome:#?}"
        );
    }
    assert!(names(&here.join("empty")).is_empty());
    assert_eq!(std::fs::read_to_string(here.join("file")).expect("text"), "mine");
    let outcome = metaplan_in(here, &["init", "no/such/place"], "");
    assert_eq!(outcome.status, 3);
    assert!(outcome.stderr.contains("there is no directory `no/such`"), "{outcome:#?}");
    for name in [".", "..", "/"] {
        assert_eq!(metaplan_in(here, &["init", name], "").status, 2, "{name}");
    }
    assert_eq!(names(here).len(), 2, "{:?}", names(here));
}

#[test]
#[cfg(unix)]
fn the_proposed_command_can_be_pasted_into_a_shell() {
    let directory = tempfile::tempdir().expect("a directory");
    for (name, word) in [
        ("étage-2", "étage-2/mission.toml"),
        ("two words", "'two words/mission.toml'"),
        ("it's $HOME", r"'it'\''s $HOME/mission.toml'"),
        ("`id`;*", "'`id`;*/mission.toml'"),
        ("-x", "./-x/mission.toml"),
    ] {
        let outcome = metaplan_in(directory.path(), &["init", "--", name], "");
        let (_, next) = outcome.stdout.split_once("\nnext: ").unwrap_or_else(|| panic!("{outcome:#?}"));
        assert_eq!(next, format!("metaplan plan {word}\n"));
        let mut shell = std::process::Command::new("sh");
        shell.arg("-c").arg(next.replacen("metaplan", "\"$0\"", 1)).arg(program());
        let planned = shell.current_dir(directory.path()).output().expect("a shell");
        assert!(planned.status.success(), "{name}: {planned:?}");
    }
}

#[test]
#[cfg(unix)]
fn directory_names_become_mission_names() {
    let directory = tempfile::tempdir().expect("a directory");
    let name = "robot \"7\" of the 2nd \u{e9}tage";
    let outcome =
        metaplan_in(directory.path(), &["init", name, "--from", "warehouse", "--format", "json"], "");
    let answer = outcome.json();
    assert_eq!(answer["format"], "metaplan-init/1");
    let mut files = names(&directory.path().join(name));
    files.sort();
    let mut reported_files: Vec<_> =
        answer["files"].as_array().expect("files").iter().map(|file| file.as_str()).collect();
    reported_files.sort_unstable();
    assert_eq!(reported_files, files.iter().map(|file| Some(file.as_str())).collect::<Vec<_>>());
    let manifest = directory.path().join(name).join("mission.toml").display().to_string();
    let planned = metaplan_in(&root(), &["plan", &manifest, "--format", "json"], "");
    assert_eq!(planned.json()["mission"], name);
}
