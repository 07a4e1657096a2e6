//! Tests of the listed examples: they run and print the expected output. A new example has to be added to the list.
//! Three examples are not run: `formulas` of the planner, `cdr` of the ROS package, and `directory` of the fleet package.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use crate::common::root;

/// Returns the folder of the compiled examples. Cargo does not build the examples of other packages for these
/// tests, so they are built here with the same options. This avoids a second compilation of the dependencies.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<std::path::PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let build_folder = Path::new(env!("CARGO_BIN_EXE_metaplan")).parent().expect("a folder");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["build", "--quiet", "--offline", "--locked", "--examples"]);
        if build_folder.ends_with("release") {
            cargo.arg("--release");
        }
        cargo.arg("--target-dir").arg(build_folder.parent().expect("a folder")).current_dir(root());
        let output = cargo.output().expect("cargo runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        build_folder.join("examples")
    })
}

fn printed(example: &str) -> String {
    let program = folder().join(format!("{example}{}", std::env::consts::EXE_SUFFIX));
    let output = Command::new(program).current_dir(root()).output().expect("the example starts");
    assert!(output.status.success(), "{example}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn examples_print_the_expected_output() {
    assert_eq!(
        printed("numbers"),
        "2 errors:\ninvalid digit found in string\nnumber too large to fit in target type\n"
    );
    let text = printed("thermostat");
    let heated: Vec<bool> = text
        .lines()
        .filter(|line| line.contains("heated"))
        .map(|line| line.starts_with("  heated"))
        .collect();
    assert_eq!(heated, [false, true, false], "{text}");
    assert!(printed("availability").contains("without c_kinect: fd_amcl_kinect, fd_mrpt_kinect\n"));
    assert_eq!(printed("judge"), "valid, total time 0\n");
    let text = printed("filled");
    let [before, after] = text.split("; without c_kinect\n").collect::<Vec<_>>()[..] else {
        panic!("{text}")
    };
    assert!(
        before.contains("(fd_available fd_amcl_kinect)") && !after.contains("(fd_available fd_amcl_kinect)")
    );
    let text = printed("anytime");
    assert!(
        text.contains("optimal, proved")
            && (text.ends_with("(move b1 p r)\n") || text.contains("(move b1 q r)")),
        "{text}"
    );
    let text = printed("argument");
    assert!(
        text.starts_with("no plan costs less than 0\nnot proved that no plan costs less than 1"),
        "{text}"
    );
    assert_eq!(printed("directory"), "all verified\n", "there is none");
    assert!(printed("gamble").contains("Pmax=? [ F \"there\" ]: 1 (in [1, 1])\n"));
    assert!(printed("timeline").contains("lidar"));
    let text = printed("adapt");
    assert!(
        text.contains("the certificate is verified\n") && text.contains("\"answer\":\"plan_found\""),
        "{text}"
    );
}
