//! Tests of `metaplan run --mcap`, and of `--events` with MCAP files, against the reference library and other
//! implementations.

mod crash;
mod others;

use std::path::Path;

use mcap::read::MessageStream;
use serde_json::{Value, json};

use crate::common::{Outcome, metaplan_in, root};

const EVENTS: [&str; 9] = [
    r#"{"event":"measured","attribute":"ambient_light","value":0.50,"time":1.5}"#,
    r#"{"event":"action_succeeded","action":1}"#,
    "nonsense \u{202e} <script>",
    r#"{"event":"component_status","component":"c_kinect","status":"FALSE","seq":7}"#,
    r#"{"event":"component_status","component":"c_kinect","status":"FALSE","seq":7}"#,
    r#"{"event":"tick",   "event":"tick"}"#,
    r#"{"event":"action_cancelled","action":2}"#,
    r#"{"header":{},"status":[{"message":"Component status","values":[{"key":"c_kinect","value":"RECOVERED"}]},
        {"message":"QA status","values":[{"key":"ambient_light","value":"2"}]},{"message":"else"}]}"#,
    r#"{"event":"action_succeeded","action":3}"#,
];

fn input() -> String {
    EVENTS.map(|line| line.replace('\n', " ")).join("\n")
}

/// Returns the answers of a successful run without progress reports and without the field `microseconds`.
fn decisions(outcome: &Outcome) -> Vec<Value> {
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    outcome.stdout.lines().map(decision).filter(|answer| answer["answer"] != "planning").collect()
}

fn decision(line: &str) -> Value {
    let mut answer: Value = serde_json::from_str(line).expect("JSON");
    answer.as_object_mut().expect("an object").remove("microseconds");
    answer
}

fn run(arguments: &[&str], input: &str) -> Outcome {
    let command: Vec<&str> = ["run", "missions/ugv.toml"].iter().chain(arguments).copied().collect();
    metaplan_in(&root(), &command, input)
}

/// A recorded message: topic, name of the schema, log time, and data.
type Recorded = (String, String, u64, Vec<u8>);

fn messages(file: &Path) -> Vec<Recorded> {
    let bytes = std::fs::read(file).expect("the file is read");
    let stream = MessageStream::new(&bytes).expect("an MCAP file");
    let message = |message: mcap::McapResult<mcap::Message>| {
        let message = message.expect("a message");
        let schema = message.channel.schema.as_ref().map_or("", |schema| &schema.name).to_owned();
        (message.channel.topic.clone(), schema, message.log_time, message.data.into_owned())
    };
    stream.map(message).collect()
}

/// Encoder of CDR (little-endian). Numbers are aligned to their size, counted after the encapsulation header
/// of four octets. Strings have a length prefix and a terminating zero.
#[derive(Default)]
struct Cdr(Vec<u8>);

impl Cdr {
    fn number(mut self, value: u32) -> Self {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        self.0.extend(value.to_le_bytes());
        self
    }

    fn octet(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    fn text(self, text: &str) -> Self {
        let mut encoded = self.number(text.len() as u32 + 1);
        encoded.0.extend(text.bytes().chain([0]));
        encoded
    }

    fn bytes(self) -> Vec<u8> {
        [vec![0, 1, 0, 0], self.0].concat()
    }
}

#[test]
fn input_and_answers_are_recorded() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    let name = file.display().to_string();
    let outcome = run(&["--mcap", &name], &input());
    assert_eq!(decisions(&outcome), decisions(&run(&[], &input())), "standard output stays as it is");
    let messages = messages(&file);
    assert!(messages.is_sorted_by_key(|(_, _, time, _)| *time), "time does not go back");

    let text = |data: &[u8]| String::from_utf8(data.to_vec()).expect("text");
    let answers = messages.iter().filter(|(_, schema, ..)| schema == "metaplan.Answer");
    let answers: Vec<String> = answers.map(|(.., data)| text(data)).collect();
    assert_eq!(answers, outcome.stdout.lines().collect::<Vec<_>>());
    let topic = |kind: &str| {
        let beginning = format!("{{\"answer\":\"{kind}\"");
        let of_kind = |data: &[u8]| data.starts_with(beginning.as_bytes());
        let topics: Vec<_> =
            messages.iter().filter(|(.., data)| of_kind(data)).map(|m| m.0.as_str()).collect();
        assert!(!topics.is_empty() && topics.iter().all(|topic| *topic == topics[0]), "{kind}: {topics:?}");
        topics[0]
    };
    assert_eq!(["inferred"].map(topic), ["/metaplan/inferences"]);
    assert_eq!(["plan_requested", "plan_found"].map(topic), ["/metaplan/plans"; 2]);
    assert_eq!(["reconfigure", "request_action", "cancel_action"].map(topic), ["/metaplan/effects"; 3]);
    assert_eq!(["ready", "error", "duplicate", "handled"].map(topic), ["/metaplan/loop"; 4]);

    let events: Vec<&Recorded> = messages.iter().filter(|message| message.0 == "/metaplan/events").collect();
    assert!(events.iter().all(|(_, schema, ..)| schema == "metaplan.Event"));
    let input = input();
    assert_eq!(events.len(), input.lines().count());
    for (number, ((.., data), line)) in (1..).zip(events.iter().zip(input.lines())) {
        let event: Value = serde_json::from_slice(data).expect("JSON");
        assert_eq!(event["line"], number);
        assert!(event["nanoseconds"].is_u64(), "{event}");
        if line.starts_with('{') {
            assert!(text(data).contains(line), "{line} is there byte by byte");
            assert_eq!(event["event"], serde_json::from_str::<Value>(line).expect("JSON"));
        } else {
            assert_eq!(event["text"], line);
        }
    }

    let diagnostics: Vec<&Recorded> = messages.iter().filter(|message| message.0 == "/diagnostics").collect();
    let array = |time: &u64| {
        let (seconds, nanoseconds) = (*time / 1_000_000_000, *time % 1_000_000_000);
        Cdr::default().number(seconds as u32).number(nanoseconds as u32).text("")
    };
    let diagnostic_status = |cdr: Cdr, level: u8, message: &str, key: &str, value: &str| {
        cdr.octet(level).text("").text(message).text("").number(1).text(key).text(value)
    };
    let expected: [&[(u8, &str, &str, &str)]; 4] = [
        &[(0, "QA status", "ambient_light", "0.5")],
        &[(2, "Component status", "c_kinect", "FALSE")],
        &[(2, "Component status", "c_kinect", "FALSE")],
        &[(0, "Component status", "c_kinect", "RECOVERED"), (0, "QA status", "ambient_light", "2")],
    ];
    assert_eq!(diagnostics.len(), expected.len());
    for ((_, schema, time, data), statuses) in diagnostics.into_iter().zip(expected) {
        assert_eq!(schema, "diagnostic_msgs/msg/DiagnosticArray");
        let mut cdr = array(time).number(statuses.len() as u32);
        for (level, message, key, value) in statuses {
            cdr = diagnostic_status(cdr, *level, message, key, value);
        }
        assert_eq!(*data, cdr.bytes(), "{statuses:?}");
    }
}

#[test]
fn replayed_recordings_give_the_same_decisions() {
    let original = decisions(&run(&[], &input()));
    for form in ["json", "string"] {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("run.mcap").display().to_string();
        let second_file = directory.path().join("again.mcap").display().to_string();
        let recorded = run(&["--mcap", &file, "--mcap-events", form], &input());
        assert_eq!(decisions(&recorded), original);
        let replayed = run(&["--events", &file, "--mcap", &second_file], "");
        assert_eq!(decisions(&replayed), original, "{form}");
        assert_eq!(replayed.stderr, "");
        assert_eq!(
            decisions(&run(&["--events", &second_file], "")),
            original,
            "{form}: a recording of a replay"
        );
        // The recording is replayed from standard input, which is not seekable in general.
        let bytes = std::fs::File::open(&file).expect("the file");
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_metaplan"));
        let output = child.args(["run", "missions/ugv.toml"]).current_dir(root()).stdin(bytes).output();
        let stdout = String::from_utf8(output.expect("the program runs").stdout).expect("UTF-8");
        let answers: Vec<Value> =
            stdout.lines().map(decision).filter(|a| a["answer"] != "planning").collect();
        assert_eq!(answers, original, "{form}: from standard input");
    }
}

/// A replay must use the recorded times, because decisions depend on time. For example, a recovered component
/// is used only after `heal_time` seconds.
#[test]
fn replays_use_the_recorded_times() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    let name = file.display().to_string();
    run(&["--mcap", &name], "{\"event\":\"tick\"}\n{\"event\":\"tick\"}\n");
    let times = |file: &Path| -> Vec<Value> {
        let events = messages(file).into_iter().filter(|message| message.0 == "/metaplan/events");
        let time =
            |bytes: Vec<u8>| serde_json::from_slice::<Value>(&bytes).expect("JSON")["nanoseconds"].clone();
        events.map(|(.., bytes)| time(bytes)).collect()
    };
    let second_file = directory.path().join("again.mcap");
    run(&["--events", &name, "--mcap", &second_file.display().to_string()], "");
    assert_eq!(times(&file), times(&second_file));
    assert_eq!(times(&file).len(), 2);
}

#[test]
fn channels_declare_their_encoding_and_schema() {
    let directory = tempfile::tempdir().expect("a directory");
    for (form, encoding, schemas) in [
        ("json", "json", [("metaplan.Event", "jsonschema"), ("metaplan.Answer", "jsonschema")]),
        ("string", "cdr", [("std_msgs/msg/String", "ros2msg"), ("std_msgs/msg/String", "ros2msg")]),
    ] {
        let file = directory.path().join(form);
        run(&["--mcap", &file.display().to_string(), "--mcap-events", form], &input());
        let bytes = std::fs::read(&file).expect("the file");
        let summary = mcap::Summary::read(&bytes).expect("a summary").expect("there is one");
        assert_eq!(summary.channels.len(), 6);
        assert!(!summary.chunk_indexes.is_empty());
        assert!(summary.chunk_indexes.iter().all(|chunk| chunk.message_start_time > 0));
        for channel in summary.channels.values() {
            let schema = channel.schema.as_ref().expect("a schema");
            let declared =
                (channel.message_encoding.as_str(), schema.name.as_str(), schema.encoding.as_str());
            let expected = match channel.topic.as_str() {
                "/diagnostics" => ("cdr", "diagnostic_msgs/msg/DiagnosticArray", "ros2msg"),
                "/metaplan/events" => (encoding, schemas[0].0, schemas[0].1),
                _ => (encoding, schemas[1].0, schemas[1].1),
            };
            assert_eq!(declared, expected, "{}", channel.topic);
            if schema.encoding == "jsonschema" {
                let definition: Value = serde_json::from_slice(&schema.data).expect("JSON");
                assert_eq!(definition["type"], "object");
                assert_eq!(definition["title"], json!(schema.name));
            }
        }
    }
}

#[test]
fn message_definitions_match_the_ros_interfaces() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    run(&["--mcap", &file.display().to_string()], "");
    let bytes = std::fs::read(&file).expect("the file");
    let summary = mcap::Summary::read(&bytes).expect("a summary").expect("there is one");
    let schema = summary.schemas.values().find(|schema| schema.encoding == "ros2msg").expect("a schema");
    let text = String::from_utf8(schema.data.to_vec()).expect("text");
    let rule = format!("{}\nMSG: ", "=".repeat(80));
    let mut parts = text.split(&rule);
    let main_definition = ("diagnostic_msgs/DiagnosticArray", parts.next().expect("the array"));
    let dependencies = parts.map(|part| part.split_once('\n').expect("a name and a definition"));
    let definitions: Vec<(&str, &str)> = std::iter::once(main_definition).chain(dependencies).collect();
    assert_eq!(definitions.len(), 5);
    for (name, definition) in definitions {
        let (package, message) = name.split_once('/').expect("a package");
        let file = root().join(format!("integrations/ros/interfaces/{package}/msg/{message}.msg"));
        let interface = std::fs::read_to_string(&file).expect("the definition");
        let plain = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(plain(definition), plain(&interface), "{name}");
    }
}

#[test]
fn files_are_not_overwritten_and_invalid_recordings_are_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("run.mcap");
    let name = file.display().to_string();
    std::fs::write(&file, "mine").expect("a file");
    let refused = run(&["--mcap", &name], "");
    assert_eq!((refused.status, refused.stdout.as_str()), (3, ""), "{refused:#?}");
    assert!(
        refused.stderr.contains("M331") && refused.stderr.contains("recordings are never overwritten"),
        "{refused:#?}"
    );
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), "mine");
    let nowhere = run(&["--mcap", "nowhere/run.mcap"], "");
    assert_eq!(nowhere.status, 3, "{nowhere:#?}");

    let replay = |bytes: &[u8], reason: &str| {
        std::fs::write(&file, bytes).expect("a file");
        let outcome = run(&["--events", &name], "");
        assert_eq!(outcome.status, 3, "{outcome:#?}");
        assert!(outcome.stderr.contains("M101") && outcome.stderr.contains(reason), "{reason}: {outcome:#?}");
    };
    replay(b"\x89PNG\r\n\x1a\n and more that is a picture", "it is not an MCAP file");
    let mut empty = std::io::Cursor::new(Vec::new());
    mcap::Writer::new(&mut empty).expect("a writer").finish().expect("a file");
    replay(empty.get_ref(), "neither /metaplan/events nor diagnostic_msgs/msg/DiagnosticArray");
    let complete = directory.path().join("whole.mcap");
    run(&["--mcap", &complete.display().to_string()], &input());
    let mut damaged = std::fs::read(&complete).expect("the file");
    let place = damaged.windows(10).position(|bytes| bytes == b"ambient_li").expect("an event");
    damaged[place] = b'A';
    replay(&damaged, "CRC");
}
