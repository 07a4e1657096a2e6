//! Tests of `metaplan run --serve` with a plain TCP client.

use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::common::{metaplan_in, root};

/// Timeout for each expected event, which is generous for busy machines.
const TIMEOUT: Duration = Duration::from_secs(60);

pub struct Run {
    child: Child,
    stdin: Option<ChildStdin>,
    answers: Receiver<Value>,
    address: String,
}

impl Run {
    pub fn begin(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_metaplan"))
            .args(["run", "missions/ugv.toml"])
            .args(arguments)
            .current_dir(root())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut first_line = String::new();
        let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        stderr.read_line(&mut first_line).expect("a line");
        let address = first_line.split("http://").nth(1).and_then(|remainder| remainder.split('/').next());
        let address = address.unwrap_or_else(|| panic!("no address: {first_line}")).to_owned();
        let (sender, answers) = channel();
        let stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        std::thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                let answer = serde_json::from_str(&line).expect("JSON");
                let _ = sender.send(answer);
            }
        });
        Self { stdin: child.stdin.take(), child, answers, address }
    }

    /// Sends lines to the loop and waits until line `last` is handled.
    pub fn send(&mut self, lines: impl IntoIterator<Item = String>, last: u64) {
        let stdin = self.stdin.as_mut().expect("a pipe");
        for line in lines {
            stdin.write_all(format!("{line}\n").as_bytes()).expect("the loop reads");
        }
        self.handled(last);
    }

    fn handled(&mut self, line: u64) -> Vec<Value> {
        let mut answers = Vec::new();
        loop {
            let answer = self.answers.recv_timeout(TIMEOUT).expect("the loop goes on");
            let is_last = answer["answer"] == "handled" && answer["line"] == line;
            answers.push(answer);
            if is_last {
                return answers;
            }
        }
    }

    fn request(&self, path: &str, headers: &str) -> TcpStream {
        let mut stream = TcpStream::connect(&self.address).expect("a connection");
        stream.set_read_timeout(Some(TIMEOUT)).expect("a timeout");
        let host = &self.address;
        let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{headers}\r\n");
        stream.write_all(request.as_bytes()).expect("sent");
        stream
    }

    pub fn get(&self, path: &str, headers: &str) -> (String, String) {
        let mut text = String::new();
        self.request(path, headers).read_to_string(&mut text).expect("an answer");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        (head.to_owned(), body.to_owned())
    }

    pub fn events(&self) -> Events {
        let mut reader = BufReader::new(self.request("/events", ""));
        let mut head = String::new();
        while !head.ends_with("\r\n\r\n") {
            assert!(reader.read_line(&mut head).expect("a head") > 0, "{head}");
        }
        assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{head}");
        assert!(head.contains("Content-Type: text/event-stream\r\n"), "{head}");
        Events(reader)
    }

    pub fn end(mut self) {
        drop(self.stdin.take());
        assert!(self.child.wait().expect("it ends").success());
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub struct Events(BufReader<TcpStream>);

impl Events {
    fn next(&mut self) -> Option<(String, Value)> {
        let (mut kind, mut data) = ("message".to_owned(), None);
        loop {
            let mut line = String::new();
            match self.0.read_line(&mut line) {
                Ok(0) => return None,
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::ConnectionReset => return None,
                Err(error) => panic!("{error}"),
            }
            match line.trim_end_matches('\n').split_once(':') {
                Some(("event", value)) => value.trim_start().clone_into(&mut kind),
                Some(("data", value)) => data = Some(serde_json::from_str(value).expect("JSON")),
                Some(("", _)) => {}
                Some(unexpected) => panic!("{unexpected:?}"),
                None => {
                    if let Some(data) = data {
                        return Some((kind, data));
                    }
                }
            }
        }
    }

    /// Returns the events up to the first one that satisfies the predicate; `None` if the stream ends before.
    pub fn until_or_end(&mut self, is_last: impl Fn(&Value) -> bool) -> Option<Vec<Value>> {
        let mut received = Vec::new();
        loop {
            let (_, data) = self.next()?;
            let is_found = is_last(&data);
            received.push(data);
            if is_found {
                return Some(received);
            }
        }
    }

    pub fn until(&mut self, is_last: impl Fn(&Value) -> bool) -> Vec<Value> {
        self.until_or_end(is_last).expect("it does not end before")
    }
}

fn note(text: &str) -> String {
    json!({"event": "note", "text": text}).to_string()
}

fn answers_in(messages: &[Value]) -> Vec<&Value> {
    messages
        .iter()
        .filter_map(|news| news.get("said"))
        .filter(|answer| answer["answer"] != "planning")
        .collect()
}

#[test]
fn input_and_answers_are_streamed_as_they_come() {
    let mut run = Run::begin(&["--serve=0"]);
    let mut answers = run.handled(0);
    let mut events = run.events();
    assert_eq!(events.next(), Some(("begin".to_owned(), json!({}))));
    let hostile = "<script>alert(1)</script>\u{2028}</table>";
    let lines = [
        note(hostile),
        r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#.to_owned(),
        "nonsense".to_owned(),
    ];
    let stdin = run.stdin.as_mut().expect("a pipe");
    for line in &lines {
        stdin.write_all(format!("{line}\n").as_bytes()).expect("the loop reads");
    }
    answers.extend(run.handled(3));
    answers.retain(|answer| answer["answer"] != "planning");
    let messages = events.until(|news| news["said"]["answer"] == "handled" && news["said"]["line"] == 3);
    assert_eq!(answers_in(&messages), answers.iter().collect::<Vec<_>>());
    let inputs: Vec<(&Value, &Value)> = messages
        .iter()
        .filter(|news| news.get("heard").is_some())
        .map(|news| (&news["line"], &news["heard"]))
        .collect();
    let expected: Vec<(Value, Value)> = (1..).zip(&lines).map(|(n, line)| (json!(n), json!(line))).collect();
    assert_eq!(inputs, expected.iter().map(|(number, line)| (number, line)).collect::<Vec<_>>());
    assert!(messages.iter().all(|news| news["at"].as_f64().is_some_and(|at| at >= 0.0)), "{messages:#?}");
    run.end();
    let remaining_kinds: Vec<String> = std::iter::from_fn(|| events.next()).map(|(kind, _)| kind).collect();
    assert_eq!(remaining_kinds, ["end"]);
}

#[test]
fn current_plan_is_drawn() {
    let mut run = Run::begin(&["--serve=0"]);
    run.handled(0);
    let mut events = run.events();
    let has_plan = |news: &Value| news.get("planned").is_some();
    assert_eq!(
        events.until(has_plan).pop().expect("a line")["planned"],
        json!({"exists": true, "under_way": 1})
    );
    let (head, plan) = run.get("/plan", "");
    assert!(head.contains("Content-Type: text/html; charset=utf-8"), "{head}");
    assert!(plan.starts_with("<div id=\"drawn\" data-first=\"1\">"), "{plan}");
    for text in [
        "data-lane=\"f_localization\"",
        "fd_amcl_kinect",
        "data-step=\"4\"",
        "data-place=\"wp9\"",
        "data-curve=\"battery\"",
    ] {
        assert!(plan.contains(text), "{text}: {plan}");
    }
    assert!(!plan.contains("style="), "the policy of the page forbids it");
    assert_eq!(run.get("/plan", "").1, plan);
    let input_lines = [
        r#"{"event":"action_started","action":1}"#,
        r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#,
    ];
    run.send(input_lines.map(str::to_owned), 2);
    assert_eq!(
        events.until(has_plan).pop().expect("a line")["planned"],
        json!({"exists": true, "under_way": 1})
    );
    let (_, changed) = run.get("/plan", "");
    assert!(changed.contains("fd_amcl_lidar") && !changed.contains("fd_amcl_kinect"), "{changed}");
    run.end();
}

#[test]
fn late_clients_receive_the_current_state() {
    let mut run = Run::begin(&["--serve=127.0.0.1:0"]);
    run.handled(0);
    let failure = r#"{"event":"component_status","component":"c_flashlight","status":"FALSE"}"#.to_owned();
    run.send([failure].into_iter().chain((0..3000).map(|_| note("x"))), 3001);
    let started = Instant::now();
    loop {
        assert!(started.elapsed() < TIMEOUT, "it always ends before something new");
        let is_new = |news: &Value| news.get("heard").is_some() || news.get("left_out").is_some();
        // A client that is too slow is disconnected and must connect again.
        let Some(messages) = run.events().until_or_end(is_new) else { continue };
        let kinds: Vec<&Value> = answers_in(&messages).into_iter().map(|answer| &answer["answer"]).collect();
        // The first lines are discarded once the server has processed all lines.
        if kinds.len() < 8 {
            assert_eq!(
                kinds[..5],
                ["ready", "plan_found", "reconfigure", "request_action", "inferred"],
                "{messages:#?}"
            );
            return;
        }
        assert!(started.elapsed() < TIMEOUT, "{kinds:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Returns the peak resident memory of a run in kB.
fn memory(run: &Run) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", run.child.id())).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().trim_end_matches(" kB").parse().ok()
}

#[test]
fn clients_that_do_not_read_are_disconnected_and_do_not_block() {
    let mut run = Run::begin(&["--serve=0"]);
    run.handled(0);
    let before = memory(&run);
    let mut idle = run.request("/events", "");
    // The amount of data exceeds the capacity of the socket buffers.
    let text = "x".repeat(4000);
    run.send((0..20_000).map(|_| note(&text)), 20_000);
    if let (Some(before), Some(after)) = (before, memory(&run)) {
        assert!(after - before < 60_000, "{before} kB and then {after} kB, where 80 MB went through");
    }
    // A client that connects now receives new events.
    run.send([note("the last")], 20_001);
    let last = note("the last");
    let started = Instant::now();
    // On a busy machine the client can be too slow and must connect again, as the page does.
    while run.events().until_or_end(|news| news["heard"] == json!(last)).is_none() {
        assert!(started.elapsed() < TIMEOUT, "it always ends before");
    }
    // The client that did not read was disconnected before it had received half of the data.
    let mut bytes = Vec::new();
    let ended = idle.read_to_end(&mut bytes);
    assert!(ended.is_ok() || ended.is_err_and(|error| error.kind() == ErrorKind::ConnectionReset));
    assert!(bytes.len() < 40_000_000, "{} bytes", bytes.len());
    assert!(!String::from_utf8_lossy(&bytes).contains("the last"));
    run.end();
}

#[test]
fn clients_that_do_not_read_release_their_connections() {
    let mut run = Run::begin(&["--serve=0"]);
    run.handled(0);
    let idle: Vec<TcpStream> = (0..16).map(|_| run.request("/events", "")).collect();
    let text = "x".repeat(4000);
    let started = Instant::now();
    let (mut line, mut refused) = (0, false);
    loop {
        // The amount of data exceeds the capacity of the socket buffers, because no client reads.
        run.send((0..2000).map(|_| note(&text)), line + 2000);
        line += 2000;
        let (head, _) = run.get("/", "");
        if head.starts_with("HTTP/1.1 200") && refused {
            break;
        }
        refused |= head.starts_with("HTTP/1.1 503");
        assert!(started.elapsed() < TIMEOUT, "{head}");
        std::thread::sleep(Duration::from_millis(100));
    }
    drop(idle);
    run.end();
}

#[test]
fn page_inserts_data_as_text_only() {
    let run = Run::begin(&["--serve=0"]);
    let (head, page) = run.get("/", "");
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{head}");
    assert!(head.contains("Content-Type: text/html; charset=utf-8"), "{head}");
    assert!(head.contains("Content-Security-Policy: default-src 'none'; script-src 'self';"), "{head}");
    assert!(head.contains("X-Content-Type-Options: nosniff"), "{head}");
    assert!(
        page.starts_with("<!DOCTYPE html>") && !page.contains("onclick") && !page.contains("<script>"),
        "{page}"
    );
    for (path, kind) in [("/live.js", "text/javascript"), ("/live.css", "text/css")] {
        assert!(page.contains(path), "{path}");
        let (head, body) = run.get(path, "");
        assert!(head.contains(kind) && !body.is_empty(), "{head}");
        for forbidden in
            ["innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "http:", "https:"]
        {
            assert!(!body.contains(forbidden) && !page.contains(forbidden), "{path}: {forbidden}");
        }
    }
    let (head, _) = run.get("/etc/passwd", "");
    assert!(head.starts_with("HTTP/1.1 404"), "{head}");
    let status = |request: &str| {
        let mut stream = TcpStream::connect(&run.address).expect("a connection");
        stream.set_read_timeout(Some(TIMEOUT)).expect("a timeout");
        stream.write_all(request.as_bytes()).expect("sent");
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("an answer");
        text.split(' ').nth(1).map(ToOwned::to_owned).unwrap_or_default()
    };
    assert_eq!(status("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n"), "405");
    assert_eq!(status("nonsense\r\n\r\n"), "400");
    assert_eq!(status("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"), "200");
    // Protection against DNS rebinding: a foreign host name that resolves to this address.
    assert_eq!(status("GET /events HTTP/1.1\r\nHost: evil.example\r\n\r\n"), "403");
    assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), "403");
    run.end();
}

#[test]
fn remote_clients_need_the_token() {
    let refused = metaplan_in(&root(), &["run", "missions/ugv.toml", "--serve=0.0.0.0:0"], "");
    assert_eq!((refused.status, refused.stdout.as_str()), (3, ""), "{refused:#?}");
    assert!(
        refused.stderr.contains("M332") && refused.stderr.contains("a token is required"),
        "{refused:#?}"
    );
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("token");
    let name = file.display().to_string();
    for invalid_token in
        ["short", "", "two words of some length", "\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}"]
    {
        std::fs::write(&file, invalid_token).expect("a file");
        let arguments = ["run", "missions/ugv.toml", "--serve=0.0.0.0:0", "--serve-token", &name];
        let refused = metaplan_in(&root(), &arguments, "");
        assert_eq!(refused.status, 3, "{invalid_token}: {refused:#?}");
        assert!(refused.stderr.contains("M332"), "{refused:#?}");
        assert!(invalid_token.is_empty() || !refused.stderr.contains(invalid_token), "{refused:#?}");
    }
    std::fs::write(&file, "Zk3-sesame-open-9\n").expect("a file");
    let mut run = Run::begin(&["--serve=0.0.0.0:0", "--serve-token", &name]);
    run.address = run.address.replace("0.0.0.0", "127.0.0.1");
    let status = |headers: &str| run.get("/", headers).0.split(' ').nth(1).unwrap_or_default().to_owned();
    let (head, _) = run.get("/", "");
    assert!(head.starts_with("HTTP/1.1 401") && head.contains("WWW-Authenticate: Basic"), "{head}");
    assert_eq!(status("Authorization: Bearer Zk3-sesame-open-9\r\n"), "200");
    assert_eq!(status("Authorization: Bearer Zk3-sesame-open-8\r\n"), "401");
    assert_eq!(status("Authorization: Bearer Zk3-sesame-open-\r\n"), "401");
    // Base64 (RFC 4648) of `me:Zk3-sesame-open-9` and `me:Zk3-sesame-open-8`.
    assert_eq!(status("Authorization: Basic bWU6WmszLXNlc2FtZS1vcGVuLTk=\r\n"), "200");
    assert_eq!(status("Authorization: Basic bWU6WmszLXNlc2FtZS1vcGVuLTg=\r\n"), "401");
    assert!(run.get("/events", "").0.starts_with("HTTP/1.1 401"));
    for answer in run.handled(0) {
        assert!(!answer.to_string().contains("sesame"), "{answer}");
    }
    run.end();
    for address in ["missions/ugv.toml", "127.0.0.1:x"] {
        let refused = metaplan_in(&root(), &["run", "missions/ugv.toml", &format!("--serve={address}")], "");
        assert_eq!(refused.status, 3, "{refused:#?}");
        assert!(refused.stderr.contains("M332") && refused.stderr.contains("HOST:PORT"), "{refused:#?}");
    }
}
