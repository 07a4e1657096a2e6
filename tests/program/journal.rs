//! Tests of `metaplan journal`: showing the content of a journal and checking the journal.

use crate::common::{metaplan, metaplan_in, root};

#[test]
fn journals_are_checked_and_shown() {
    let directory = tempfile::tempdir().expect("a directory");
    let journal = directory.path().display().to_string();
    let lines = "{\"event\":\"tick\"}\n{\"event\":\"component_status\",\"component\":\"c_kinect\",\"status\":\"FALSE\"}\n";
    let run = ["run", "missions/ugv.toml", "--journal", &journal];
    assert_eq!(metaplan_in(&root(), &run, lines).status, 0);
    let check = metaplan(&["journal", "check", &journal]);
    assert_eq!(check.status, 0, "{check:#?}");
    assert!(check.stdout.ends_with("the journal can be used\n"), "{check:#?}");
    // The same mission can resume the journal, but another mission cannot.
    let resumed = metaplan(&["journal", "check", &journal, "--mission", "missions/ugv.toml"]);
    assert_eq!(resumed.status, 0, "{resumed:#?}");
    let other_mission = metaplan(&["journal", "check", &journal, "--mission", "missions/uuv.toml"]);
    assert_eq!(other_mission.status, 3, "{other_mission:#?}");
    assert!(other_mission.stderr.contains("it belongs to another mission"), "{other_mission:#?}");
    let show = metaplan(&["journal", "show", &journal]);
    assert!(
        show.stdout.contains("c_kinect") && show.stdout.contains("inferred, plan_requested"),
        "{show:#?}"
    );
    let json = metaplan(&["journal", "show", &journal, "--format", "json"]).json();
    assert_eq!(json["format"], "metaplan-journal-report/1");
    assert_eq!(json["sound"], true);
    let kinds: Vec<&str> =
        json["records"].as_array().expect("records").iter().filter_map(|r| r["kind"].as_str()).collect();
    assert_eq!(kinds, ["decision", "event", "decision", "event", "decision"]);
    assert_eq!(json["records"][0]["answers"][0]["answer"], "plan_requested");

    // Carriage returns, as inserted by an editor, make the journal unusable. The journal is neither changed
    // nor restarted.
    let file = directory.path().join("journal-000000");
    let text = std::fs::read_to_string(&file).expect("text").replace('\n', "\r\n");
    std::fs::write(&file, &text).expect("written");
    let refused = metaplan_in(&root(), &run, "");
    assert_eq!(refused.status, 3, "{refused:#?}");
    assert!(refused.stderr.contains("nothing was changed"), "{refused:#?}");
    assert_eq!(std::fs::read_to_string(&file).expect("text"), text);
    let check = metaplan(&["journal", "check", &journal]);
    assert_eq!(check.status, 3, "{check:#?}");
    assert!(check.stdout.ends_with("the journal cannot be used\n"), "{check:#?}");
    let no_journal = metaplan(&["journal", "check", "missions"]);
    assert_eq!(no_journal.status, 3, "{no_journal:#?}");
}
