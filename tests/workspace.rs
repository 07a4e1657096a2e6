//! Checks that [`COMMANDS`] lists each workspace member outside of the default members, which `cargo test` in the root
//! skips, with its test command.
//!
//! The program prints one line with these members and the commands that test them.

#![expect(clippy::print_stdout, reason = "the line is the purpose of this program")]

use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};

/// Members that are not default members, with the commands that test them.
const COMMANDS: [(&str, &str); 4] = [
    ("integrations/ros", "cargo test -p metaplan-ros"),
    ("integrations/fleet", "cargo test -p metaplan-fleet"),
    ("integrations/python", ".ci/python"),
    // No code, so there is nothing to test.
    (".ci/features", ""),
];

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let trial = Trial::test("members that are not default have a command that tests them", check);
    let conclusion = libtest_mimic::run(&arguments, vec![trial]);
    if !arguments.list && arguments.filter.is_none() {
        let members = COMMANDS.iter().filter(|(_, command)| !command.is_empty());
        let members: Vec<String> =
            members.map(|(member, command)| format!("{member} (`{command}`)")).collect();
        println!("NOT tested by `cargo test` in the root: {}\n", members.join(", "));
    }
    conclusion.exit_code()
}

fn check() -> Result<(), Failed> {
    let manifest = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"))?;
    let manifest: toml::Table = manifest.parse()?;
    let list = |key: &str| -> Vec<String> {
        let list = manifest["workspace"][key].as_array().expect("a list");
        list.iter().map(|member| member.as_str().expect("a path").to_owned()).collect()
    };
    let default = list("default-members");
    let mut nondefault: Vec<String> =
        list("members").into_iter().filter(|member| !default.contains(member)).collect();
    nondefault.sort();
    let mut listed = COMMANDS.map(|(member, _)| member);
    listed.sort_unstable();
    if nondefault == listed { Ok(()) } else { Err(format!("{nondefault:?} are not default members").into()) }
}
