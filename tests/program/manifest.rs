//! Tests of errors in manifests: the commands report the errors with their positions, even in sections that
//! they do not use.

use crate::common::{headlines, metaplan_in, root};

/// Checks that several commands reject a manifest with these lines, which begin at line 9, with the message
/// `expected`.
fn check(lines: &str, expected: &str) {
    let directory = tempfile::tempdir().expect("a directory");
    let root = root().display().to_string();
    let text = format!(
        "name = \"m\"\n\n[knowledge]\nfiles = [\"{root}/ontology/kb/ugv.ttl\"]\n\n[planning]\n\
         domain = \"{root}/encodings/ugv/domain.pddl\"\nproblem = \"{root}/encodings/ugv/problem.pddl\"\n{lines}\n"
    );
    std::fs::write(directory.path().join("m.toml"), text).expect("a file");
    for command in [
        &["plan", "m.toml"][..],
        &["explain", "m.toml"],
        &["compare", "m.toml"],
        &["run", "m.toml"],
        &["simulate", "m.toml", "--scenario", "s"],
        &["export", "m.toml", "--to", "pddl"],
    ] {
        let outcome = metaplan_in(directory.path(), command, "");
        assert_eq!(outcome.status, 3, "{command:?}: {outcome:#?}");
        assert_eq!(headlines(&outcome.stderr), format!("m.toml:{expected}\n"), "{command:?}");
        // Each message shows its source line.
        assert_eq!(outcome.stderr.matches(" │ ").count(), expected.lines().count() * 2, "{outcome:#?}");
        assert!(outcome.stdout.is_empty(), "{command:?}: {outcome:#?}");
    }
}

#[test]
fn invalid_sections_are_refused_even_if_unused() {
    check(
        "[scenaros.s]",
        "9:2: error[M104]: unknown field `scenaros`, expected one of `name`, `description`, `knowledge`, `planning`, \
         `bindings`, `adaptation`, `probabilistic`, `report`, `scenarios`; did you mean `scenarios`?",
    );
    check(
        "[adaptation]\nsetle = 1",
        "10:1: error[M104]: unknown field `setle`, expected one of `minimum_benefit`, `settle`, `time_limit`, \
         `stay_close`, `confirm_time`, `heal_time`, `band`, `components`, `measured`, `safe_reaction`, \
         `deadline`, `deadline_factor`, `unrecorded`; did you mean `settle`?",
    );
    check(
        "[adaptation.measured.ambient_ligth]\nhysteresis = 0.1",
        "9:22: error[M143]: the knowledge base has no quality attribute type `ambient_ligth`; it has: \
         ambient_light, battery_usage, minimum_illuminance, safety; did you mean `ambient_light`?",
    );
    check(
        "[adaptation]\nsettle = -1",
        "10:10: error[M105]: `settle` is -1, but should be a decimal number, not negative",
    );
    check(
        "[probabilistic]\nloss_rate = \"often\"",
        "10:13: error[M104]: invalid type: string \"often\", expected f64",
    );
    check(
        "[probabilistic]\nlocation = \"robot_att\"\nbattery_unit = 0\nloss_component = \"c_kinetc\"\nloss_rate = 2",
        "10:12: error[M105]: `location` is `robot_att`, but the domain has no predicate of this name; \
         did you mean `robot_at`?\n\
         m.toml:11:16: error[M105]: `battery_unit` is 0, but should be at least 1\n\
         m.toml:12:18: error[M125]: no design requires a component `c_kinetc` that could be lost; designs require: \
         c_camera, c_flashlight, c_kinect, c_lidar; did you mean `c_kinect`?\n\
         m.toml:13:13: error[M105]: `loss_rate` is 2, but should be a probability, from 0 to 1",
    );
    check(
        "[probabilistic]\ntime = \"travel_tme\"\nloss_rate = nan",
        "10:8: error[M105]: `time` is `travel_tme`, but the domain has no function of this name; \
         did you mean `travel_time`?\n\
         m.toml:11:13: error[M105]: `loss_rate` is NaN, but should be a probability, from 0 to 1",
    );
    check(
        "[scenarios.s]\nfial = []",
        "10:1: error[M104]: unknown field `fial`, expected one of `description`, `fail`, `set`, `simulation`; \
         did you mean `fail`?",
    );
    check("[scenarios.s.simulation]\nstep = 1.0", "9:1: error[M104]: missing field `time_budget`");
    check(
        "[[scenarios.s.simulation.events]]\nfai = []",
        "10:1: error[M104]: unknown field `fai`, expected one of `at`, `when`, `within`, `fail`, `recover`, `set`; \
         did you mean `fail`?",
    );
}

#[test]
fn all_errors_of_a_manifest_are_reported() {
    // A required field that is present but invalid is not reported as missing. A character of several bytes does not shift the
    // positions of later errors.
    check(
        "[probabilistic]\nbattery_unit = \"größe\"\n[scenaros.s]\nfail = [\"c_kinect\"]\n[adaptation]\nsetle = 1\nsettle = \"x\"\nmin = 2",
        "10:16: error[M104]: invalid type: string \"größe\", expected u32\n\
         m.toml:11:2: error[M104]: unknown field `scenaros`, expected one of `name`, `description`, `knowledge`, `planning`, \
         `bindings`, `adaptation`, `probabilistic`, `report`, `scenarios`; did you mean `scenarios`?\n\
         m.toml:14:1: error[M104]: unknown field `setle`, expected one of `minimum_benefit`, `settle`, `time_limit`, \
         `stay_close`, `confirm_time`, `heal_time`, `band`, `components`, `measured`, `safe_reaction`, \
         `deadline`, `deadline_factor`, `unrecorded`; did you mean `settle`?\n\
         m.toml:16:1: error[M104]: unknown field `min`, expected one of `minimum_benefit`, `settle`, `time_limit`, \
         `stay_close`, `confirm_time`, `heal_time`, `band`, `components`, `measured`, `safe_reaction`, \
         `deadline`, `deadline_factor`, `unrecorded`",
    );
}

#[test]
fn a_manifest_in_another_encoding_is_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    std::fs::write(directory.path().join("m.toml"), b"# a\nname = \"caf\xe9\"\n").expect("a file");
    let outcome = metaplan_in(directory.path(), &["plan", "m.toml"], "");
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    let expected = "m.toml:2:12: error[M101]: this character stands for bytes that are not valid UTF-8; \
                    convert the file to UTF-8\n";
    assert_eq!(headlines(&outcome.stderr), expected);
}
