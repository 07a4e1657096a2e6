//! Exchange of recordings with other implementations: `mcap` and `mcap-ros2-support` for Python, installed by
//! `.ci/mcap-peers`.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use test_resources::{Resource, python_with};

use super::{decisions, input, run};
use crate::common::root;

fn python() -> Option<String> {
    python_with(Resource::Mcap, "METAPLAN_PYTHON", "mcap.reader, mcap_ros2.decoder")
}

fn peer(python: &str, arguments: &[&str], input: &str) -> Vec<Value> {
    let mut child = Command::new(python)
        .arg(root().join("tests/recording/peer.py"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("Python starts");
    child.stdin.take().expect("a pipe").write_all(input.as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

pub(super) fn assert_readable_by_python(file: &Path, events: usize) {
    let Some(python) = python() else { return };
    let counts = peer(&python, &["salvage", &file.display().to_string()], "");
    assert_eq!(counts[0]["/metaplan/events"], events, "{counts:?}");
    assert_eq!(counts[0]["/diagnostics"], 4, "{counts:?}");
}

#[test]
fn python_reads_recordings() {
    let Some(python) = python() else { return };
    let directory = tempfile::tempdir().expect("a directory");
    for form in ["json", "string"] {
        let file = directory.path().join(form).display().to_string();
        let outcome = run(&["--mcap", &file, "--mcap-events", form], &input());
        let messages = peer(&python, &["read", &file], "");
        let on_topic = |topic: &str| -> Vec<&Value> { messages.iter().filter(|m| m[0] == topic).collect() };
        let unwrapped = |message: &Value| match form {
            "json" => message[3].clone(),
            _ => serde_json::from_str(message[3]["data"].as_str().expect("a text")).expect("JSON"),
        };
        let answers = messages.iter().filter(|m| m[0] != "/diagnostics" && m[0] != "/metaplan/events");
        let answers: Vec<Value> = answers.map(unwrapped).collect();
        let written: Vec<Value> =
            outcome.stdout.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        assert_eq!(answers, written, "{form}");
        let lines: Vec<Value> =
            on_topic("/metaplan/events").into_iter().map(|m| unwrapped(m)["line"].clone()).collect();
        assert_eq!(lines, (1..=input().lines().count()).map(|line| json!(line)).collect::<Vec<_>>());
        let arrays = on_topic("/diagnostics");
        assert_eq!(arrays.len(), 4);
        for array in &arrays {
            let (time, stamp) = (array[2].as_u64().expect("a time"), &array[3]["header"]["stamp"]);
            let (sec, nanosec) = (stamp["sec"].as_u64().expect("s"), stamp["nanosec"].as_u64().expect("ns"));
            assert_eq!(sec * 1_000_000_000 + nanosec, time);
        }
        let status = |level: u8, message: &str, key: &str, value: &str| json!({"level": level, "name": "", "message": message, "hardware_id": "", "values": [{"key": key, "value": value}]});
        assert_eq!(arrays[0][3]["status"], json!([status(0, "QA status", "ambient_light", "0.5")]));
        assert_eq!(arrays[1][3]["status"], json!([status(2, "Component status", "c_kinect", "FALSE")]));
        assert_eq!(
            arrays[3][3]["status"],
            json!([
                status(0, "Component status", "c_kinect", "RECOVERED"),
                status(0, "QA status", "ambient_light", "2")
            ])
        );
    }
}

#[test]
fn recordings_of_other_tools_are_replayed() {
    let Some(python) = python() else { return };
    let directory = tempfile::tempdir().expect("a directory");
    let array = |message: &str, key: &str, value: &str| {
        let status = json!({"level": 0, "name": "", "message": message, "hardware_id": "",
            "values": [{"key": key, "value": value}]});
        json!({"header": {"stamp": {"sec": 5, "nanosec": 7}, "frame_id": ""}, "status": [status]})
    };
    let mut arrays = vec![
        array("QA status", "ambient_light", "0.5"),
        array("Component status", "c_kinect", "FALSE"),
        array("battery", "voltage", "12"),
        array("QA status", "ambient_light", "much"),
    ];
    arrays.extend((0..20).map(|number| array("QA status", "ambient_light", &format!("0.{number}"))));
    let lines: Vec<String> = arrays.iter().map(Value::to_string).collect();
    let lines = lines.join("\n");
    let expected = decisions(&run(&[], &lines));
    assert!(expected.iter().any(|answer| answer["answer"] == "inferred"), "{expected:#?}");
    let time = |number: usize| 1_000_000_000 * (9 + number);
    let timed = arrays.iter().enumerate().map(|(number, array)| json!([time(number), array]).to_string());
    let timed = timed.collect::<Vec<_>>().join("\n");
    for compression in ["NONE", "ZSTD", "LZ4"] {
        let file = directory.path().join(compression).display().to_string();
        peer(&python, &["write", &file, compression], &timed);
        let replayed = run(&["--events", &file], "");
        assert_eq!(decisions(&replayed), expected, "{compression}");
        assert_eq!(replayed.stderr, "");
    }
}
