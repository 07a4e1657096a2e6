//! Tests of reports about missing resources: this program runs one of its own tests with other environment
//! variables.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use test_resources::{Resource, data, data_path, missing_in, program, python_with};

const ABSENT: &str = "no/such/file";

fn temporary(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()));
    let _ = std::fs::remove_file(&path);
    path
}

fn run(test: &str, variables: &[(&str, &str)]) -> Output {
    Command::new(std::env::current_exe().expect("this program"))
        .args([test, "--exact", "--ignored", "--nocapture"])
        .env_remove("METAPLAN_DATA")
        .env_remove("METAPLAN_REQUIRE")
        .env_remove("XDG_CACHE_HOME")
        .env_remove("METAPLAN_SKIPPED")
        .envs(variables.iter().copied())
        .output()
        .expect("this program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
#[ignore = "part of the other tests"]
fn lacks_data() {
    assert_eq!(data(ABSENT), None);
}

#[test]
#[ignore = "part of the other tests"]
fn lacks_public_data() {
    for path in ["real/owl", "real/owl/suave/suave.owl", "real/owl_w3c/semantics-direct.rdf"] {
        assert_eq!(data(path), None);
    }
    // Not a path of the list, but the beginning of one.
    assert_eq!(data("real/ow"), None);
}

#[test]
#[ignore = "part of the other tests"]
fn lacks_programs() {
    assert_eq!(program(Resource::Browser, &["no-such-browser", "nor-this-one"]), None);
    assert_eq!(python_with(Resource::Stormpy, "METAPLAN_NO_PYTHON", "no_such_module"), None);
}

#[test]
#[ignore = "part of the other tests"]
fn lacks_in_another_thread() {
    missing_in("a page", Resource::Z3, "one\tline\nonly");
}

#[test]
#[ignore = "part of the other tests"]
fn has_data() {
    assert!(data("Cargo.toml").is_some_and(|path| path.is_absolute() && path.is_file()));
}

#[test]
fn required_resources_fail_the_test_with_a_remedy() {
    for required in ["data", "python, data", "data,root"] {
        let output = run("lacks_data", &[("METAPLAN_REQUIRE", required)]);
        assert!(!output.status.success(), "{required}: {output:?}");
        let message = text(&output.stderr) + &text(&output.stdout);
        for part in ["lacks_data needs data", ABSENT, "does not exist", "set METAPLAN_DATA"] {
            assert!(message.contains(part), "{required}: {message}");
        }
    }
    assert!(!run("lacks_programs", &[("METAPLAN_REQUIRE", "browser")]).status.success());
    assert!(!run("lacks_programs", &[("METAPLAN_REQUIRE", "stormpy")]).status.success());
    assert!(run("lacks_programs", &[("METAPLAN_REQUIRE", "data")]).status.success());
}

#[test]
fn unknown_names_are_errors() {
    let output = run("lacks_data", &[("METAPLAN_REQUIRE", "brwoser")]);
    assert!(!output.status.success(), "{output:?}");
    let message = text(&output.stderr) + &text(&output.stdout);
    assert!(
        message.contains("unknown resource brwoser") && message.contains("bash, browser, data"),
        "{message}"
    );
}

#[test]
fn resources_that_are_not_required_are_recorded() {
    let record = temporary("record");
    let file = record.display().to_string();
    for test in ["lacks_data", "lacks_programs", "lacks_in_another_thread"] {
        let output = run(test, &[("METAPLAN_SKIPPED", &file), ("METAPLAN_REQUIRE", "bash")]);
        assert!(output.status.success(), "{output:?}");
        assert!(text(&output.stdout).contains("skipped: needs "), "{output:?}");
    }
    let lines = std::fs::read_to_string(&record).expect("a record");
    let columns: Vec<Vec<&str>> = lines.lines().map(|line| line.split('\t').collect()).collect();
    let package = env!("CARGO_PKG_NAME");
    let names: Vec<(&str, String)> =
        columns.iter().map(|columns| (columns[0], columns[1].replace(&format!("{package} "), ""))).collect();
    let expected = [
        ("data", "lacks_data"),
        ("browser", "lacks_programs"),
        ("stormpy", "lacks_programs"),
        ("z3", "a page"),
    ];
    assert_eq!(names, expected.map(|(name, test)| (name, test.to_owned())), "{lines}");
    assert!(columns.iter().all(|columns| columns.len() == 3), "{lines}");
    assert!(columns[0][2].ends_with("file does not exist"), "{lines}");
    assert_eq!(columns[1][2], "no-such-browser or nor-this-one is not in PATH");
    assert_eq!(columns[3][2], "one line only");
    std::fs::remove_file(record).expect("removed");
}

#[test]
fn records_of_parallel_tests_are_whole_lines() {
    let record = temporary("parallel");
    let file = record.display().to_string();
    let run = || run("lacks_data", &[("METAPLAN_SKIPPED", &file)]);
    std::thread::scope(|scope| {
        for thread in (0..8).map(|_| scope.spawn(run)).collect::<Vec<_>>() {
            assert!(thread.join().expect("it ends").status.success());
        }
    });
    let lines = std::fs::read_to_string(&record).expect("a record");
    assert_eq!(lines.lines().count(), 8, "{lines}");
    assert!(lines.lines().all(|line| line.split('\t').count() == 3 && line.ends_with("does not exist")));
    std::fs::remove_file(record).expect("removed");
}

#[test]
fn a_record_that_cannot_be_written_is_an_error() {
    let output = run("lacks_data", &[("METAPLAN_SKIPPED", "no/such/folder/record")]);
    assert!(!output.status.success(), "{output:?}");
}

#[test]
fn data_are_read_from_the_named_directory() {
    let root =
        Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the root").display().to_string();
    for directory in [root.as_str(), ".", "crates/.."] {
        let output = run("has_data", &[("METAPLAN_DATA", directory), ("METAPLAN_REQUIRE", "data")]);
        assert!(output.status.success(), "{directory}: {output:?}");
    }
}

#[test]
#[ignore = "part of the other tests"]
#[expect(clippy::print_stdout, reason = "another test reads the paths")]
fn prints_paths() {
    for path in ["Cargo.toml", ABSENT] {
        println!("path: {}", data_path(path).display());
    }
}

/// Without `METAPLAN_DATA`, the cache has priority over the directory next to the project.
#[test]
fn data_are_looked_up_in_the_cache_and_next_to_the_project() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the root");
    let home = temporary("home");
    let cache = home.join(".cache/metaplan/data");
    std::fs::create_dir_all(&cache).expect("a directory");
    std::fs::write(cache.join("Cargo.toml"), "").expect("a file");
    let lines = |variables: &[(&str, &str)]| -> Vec<String> {
        let output = text(&run("prints_paths", variables).stdout);
        output.lines().filter_map(|line| line.strip_prefix("path: ")).map(ToOwned::to_owned).collect()
    };
    let (home_text, cache_text) = (home.display().to_string(), home.join(".cache").display().to_string());
    let first = [cache.join("Cargo.toml"), cache.join(ABSENT)].map(|path| path.display().to_string());
    assert_eq!(lines(&[("HOME", &home_text)]), first);
    assert_eq!(lines(&[("HOME", "/"), ("XDG_CACHE_HOME", &cache_text)]), first);
    // An empty variable counts as unset; a directory that the variable names is the only one.
    assert_eq!(lines(&[("HOME", &home_text), ("METAPLAN_DATA", ""), ("XDG_CACHE_HOME", "")]), first);
    let named = [root.join("Cargo.toml"), root.join(ABSENT)].map(|path| path.display().to_string());
    assert_eq!(lines(&[("HOME", &home_text), ("METAPLAN_DATA", &root.display().to_string())]), named);
    std::fs::remove_dir_all(home).expect("removed");
}

#[test]
fn public_data_are_a_resource_of_their_own() {
    let record = temporary("public");
    let file = record.display().to_string();
    let variables = [("METAPLAN_DATA", "/no/such/directory"), ("METAPLAN_SKIPPED", &file)];
    let output = run("lacks_public_data", &variables);
    assert!(output.status.success(), "{output:?}");
    let lines = std::fs::read_to_string(&record).expect("a record");
    let names: Vec<&str> = lines.lines().filter_map(|line| line.split('\t').next()).collect();
    assert_eq!(names, ["public-data", "public-data", "public-data", "data"]);
    let output = run("lacks_public_data", &[variables[0], ("METAPLAN_REQUIRE", "public-data")]);
    assert!(!output.status.success(), "{output:?}");
    assert!((text(&output.stderr) + &text(&output.stdout)).contains("run data/fetch.py"), "{output:?}");
    std::fs::remove_file(record).expect("removed");
}

#[test]
fn names_are_unique_and_lead_back_to_their_resource() {
    for (resource, name, remedy) in Resource::ALL {
        assert_eq!((Resource::named(name), resource.name()), (Some(resource), name));
        assert!(!remedy.is_empty(), "{name}");
    }
    assert_eq!(Resource::named(""), None);
}

/// The script that lists the resources of this machine prints known names only, and at least the shell that
/// runs it.
#[cfg(unix)]
#[test]
fn the_script_of_ci_prints_known_names() {
    if program(Resource::Bash, &["bash"]).is_none() {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the root");
    let output = Command::new("bash").arg(root.join(".ci/resources")).output().expect("bash runs");
    assert!(output.status.success(), "{output:?}");
    let line = text(&output.stdout);
    let names: Vec<&str> = line.trim().split(',').collect();
    assert!(names.contains(&"bash") && names.contains(&"shell"), "{names:?}");
    assert!(names.iter().all(|name| Resource::named(name).is_some()), "{names:?}");
    assert_eq!(names.contains(&"data"), data_path("golden").is_dir());
    assert_eq!(names.contains(&"public-data"), data_path("real").is_dir());
    assert_eq!(names.contains(&"python"), test_resources::in_path(&["python3"]).is_some());
}

/// The line that ends a run of CI: passed, failed and ignored tests, and tests without a resource. A resource
/// that a later stage has supplied does not count.
#[cfg(unix)]
#[test]
fn the_script_of_ci_counts_results_and_records() {
    if program(Resource::Bash, &["bash"]).is_none() {
        return;
    }
    let [log, record] = ["log", "skipped"].map(temporary);
    let log_text = "running 3 tests\n\
        test result: ok. 12 passed; 0 failed; 3 ignored; 0 measured; 5 filtered out; finished in 0.01s\n\
        a line in between\n\
        test result: FAILED. 4 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 9.10s\n";
    let count = |record_text: &str| {
        std::fs::write(&log, log_text).expect("a file");
        std::fs::write(&record, record_text).expect("a file");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.ci/count");
        let output = Command::new("bash").arg(script).args([&log, &record]).output().expect("bash runs");
        assert!(output.status.success(), "{output:?}");
        text(&output.stdout)
    };
    let counts = "16 tests passed, 1 failed, 3 ignored";
    assert_eq!(count(""), format!("{counts}; none lacked a resource\n"));
    let records = "data\ta x\tno f\ndata\ta x\tno g\ndata\ta y\tno f\nbrowser\ta y\tno b\nmcap\ta z\tno m\n";
    let both = format!("{counts}; 3 of the passed lacked a resource: data 2, browser 1, mcap 1\n");
    assert_eq!(count(records), both);
    let later = format!("{counts}; 2 of the passed lacked a resource: data 2, browser 1\n");
    assert_eq!(count(&format!("{records}+mcap\n")), later);
    for file in [log, record] {
        std::fs::remove_file(file).expect("removed");
    }
}
