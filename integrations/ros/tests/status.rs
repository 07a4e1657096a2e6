//! Exit statuses of `metaplan-ros`, from which a supervisor decides whether to restart the program.

#![cfg(unix)]

use std::process::Command;

/// Runs the program with an upper limit on open files. Returns the exit status and the messages.
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
