//! Tests of `--trace`: the trace file contains complete spans with counts, or it is not written.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::common::{metaplan, root};

/// Returns the spans by name, each with its fields at the end of the span.
fn spans(text: &str) -> BTreeMap<String, Vec<Value>> {
    let events: Vec<Value> = serde_json::from_str(text).expect("JSON");
    let mut spans: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    let mut open = 0_i32;
    for event in events {
        let name = event["name"].as_str().expect("a name").to_owned();
        match event["ph"].as_str() {
            Some("B") => {
                open += 1;
                spans.entry(name).or_default();
            }
            Some("E") => {
                open -= 1;
                spans.entry(name).or_default().push(event["args"].clone());
            }
            _ => {}
        }
    }
    assert_eq!(open, 0, "every span ends");
    spans
}

#[test]
fn traces_have_all_stages_with_counts() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("trace.json");
    let file = file.to_str().expect("UTF-8");
    let mission = root().join("missions/ugv.toml");
    let mission = mission.to_str().expect("UTF-8");
    let plain = metaplan(&["plan", mission]);
    let output = metaplan(&["plan", mission, "--trace", file]);
    assert_eq!((output.status, &output.stdout), (0, &plain.stdout));
    let spans = spans(&std::fs::read_to_string(file).expect("a trace"));
    for name in ["knowledge", "parse", "lower", "derive", "fill", "compile", "reach", "instantiate", "ground"]
    {
        assert!(spans.contains_key(name), "{name}: {:?}", spans.keys());
    }
    let count = |name: &str, field: &str| {
        let value = &spans[name].last().expect("it has ended")[field];
        value
            .as_u64()
            .or_else(|| value.as_str()?.parse().ok())
            .unwrap_or_else(|| panic!("{name} {field}: {value}"))
    };
    assert!(count("ground", "operators") > 0);
    assert!(count("derive", "facts") > count("derive", "stated"));
    assert!(spans.contains_key("optimize") && spans.contains_key("search"), "{:?}", spans.keys());
    assert_eq!(std::fs::read_dir(directory.path()).expect("a directory").count(), 1, "nothing else is left");
}

#[test]
fn unwritable_traces_are_errors() {
    let file = root().join("missions/ugv.toml/trace.json");
    let output = metaplan(&["plan", "missions/ugv.toml", "--trace", file.to_str().expect("UTF-8")]);
    assert_eq!(output.status, 3);
    assert!(output.stderr.starts_with("error[M109]: the trace cannot be written"));
}

/// A limit on the size of files has the same effect as a full disk. The trace has several kilobytes.
#[test]
#[cfg(unix)]
fn traces_that_cannot_be_completed_are_errors_and_keep_the_file() {
    use crate::common::{outcome, program};
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("trace.json");
    std::fs::write(&file, "[]\n").expect("written");
    // Without the trap, the signal SIGXFSZ ends the program.
    let script = "trap '' XFSZ; ulimit -f 1; exec \"$@\"";
    let (program, trace) = (program().display().to_string(), file.display().to_string());
    let arguments = ["-c", script, "sh", &program, "plan", "missions/ugv.toml", "-q", "--trace", &trace];
    let outcome = outcome("sh".as_ref(), &root(), &arguments, "");
    assert_eq!(outcome.status, 3, "{outcome:#?}");
    assert!(outcome.stderr.starts_with("error[M109]: the trace cannot be written"), "{outcome:#?}");
    assert!(!outcome.stderr.contains("panicked"), "{outcome:#?}");
    assert_eq!(std::fs::read_to_string(&file).expect("text"), "[]\n");
    assert_eq!(std::fs::read_dir(directory.path()).expect("a directory").count(), 1, "nothing else is left");
}
