//! Exit statuses of `metaplan-ros`, from which a supervisor decides whether to restart the program.

#![cfg(unix)]

use std::process::Command;

fn run(files: u32, words: &[&str], domain: &str) -> (Option<i32>, String) {
    let output = Command::new("sh")
        .args(["-c", &format!("ulimit -n {files} && exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_metaplan-ros")])
        .args(words)
        .env("ROS_DOMAIN_ID", domain)
        .env("ROS_LOCALHOST_ONLY", "1")
        .output()
        .expect("the program");
    (output.status.code(), String::from_utf8(output.stderr).expect("text"))
}

#[test]
fn the_status_says_if_a_restart_can_help() {
    // The sockets exceed the limit on descriptors, so no DDS participant is created, as without a
    // network.
    for (files, mission, domain, status, code) in [
        (8, "../../missions/ugv.toml", "77", 75, "error[N120]"),
        (256, "nothing.toml", "77", 2, "error[M101]"),
        (256, "../../missions/ugv.toml", "999", 2, "error[N110]"),
    ] {
        let (found, messages) = run(files, &["--mission", mission], domain);
        assert!(messages.contains(code), "{messages}");
        assert_eq!(found, Some(status), "{messages}");
    }
}

#[test]
fn wrong_settings_are_reported_with_their_positions() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("ros.toml");
    let text = "[[signals]]\nnode = \"/amcl\"\ncomponent = \"c_lidr\"\n\n[[diagnostics]]\nname = \"x\"\nattribute = \"lite\"\nkey = \"k\"\n";
    std::fs::write(&file, text).expect("written");
    let settings = file.to_str().expect("a path");
    let mission = "examples/nav2/mission.toml";
    for role in ["manager", "reasoner"] {
        let words = ["--as", role, "--mission", mission, "--settings", settings];
        let (status, messages) = run(256, &words, "78");
        assert_eq!(status, Some(2), "{messages}");
        for part in ["error[N135]", "ros.toml:1:1", "did you mean `c_lidar`?", "ros.toml:5:1", "`lite`"] {
            assert!(messages.contains(part), "{part} is not in: {messages}");
        }
    }
    let (status, messages) = run(256, &["--as", "planner", "--output", settings], "78");
    assert!(status == Some(2) && messages.contains("error[N100]"), "{messages}");
    let (status, messages) = run(256, &["--as", "discover", "--output", settings], "78");
    assert!(status == Some(2) && messages.contains("not overwritten"), "{messages}");
}
