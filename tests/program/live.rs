//! `metaplan run --serve`, looked at by a client of TCP.

use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::common::{metaplan_in, root};

/// What is waited for on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A run that is being looked at.
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
        let mut said = String::new();
        let mut stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        stderr.read_line(&mut said).expect("a line");
        let address = said.split("http://").nth(1).and_then(|rest| rest.split('/').next());
        let address = address.unwrap_or_else(|| panic!("no address: {said}")).to_owned();
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

    /// Tells the loop lines; the last answer has to come.
    pub fn tell(&mut self, lines: impl IntoIterator<Item = String>, last: u64) {
        let stdin = self.stdin.as_mut().expect("a pipe");
        for line in lines {
            stdin.write_all(format!("{line}\n").as_bytes()).expect("the loop reads");
        }
        self.handled(last);
    }

    /// All answers until a line is handled.
    fn handled(&mut self, line: u64) -> Vec<Value> {
        let mut answers = Vec::new();
        loop {
            let answer = self.answers.recv_timeout(PATIENCE).expect("the loop goes on");
            let is_last = answer["answer"] == "handled" && answer["line"] == line;
            answers.push(answer);
            if is_last {
                return answers;
            }
        }
    }

    /// A connection on which a path was asked for.
    fn ask(&self, path: &str, headers: &str) -> TcpStream {
        let mut stream = TcpStream::connect(&self.address).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        let host = &self.address;
        let request = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{headers}\r\n");
        stream.write_all(request.as_bytes()).expect("sent");
        stream
    }

    /// The head and the body of an answer that ends.
    pub fn get(&self, path: &str, headers: &str) -> (String, String) {
        let mut text = String::new();
        self.ask(path, headers).read_to_string(&mut text).expect("an answer");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head");
        (head.to_owned(), body.to_owned())
    }

    pub fn events(&self) -> Events {
        let mut reader = BufReader::new(self.ask("/events", ""));
        let mut head = String::new();
        while !head.ends_with("\r\n\r\n") {
            assert!(reader.read_line(&mut head).expect("a head") > 0, "{head}");
        }
        assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{head}");
        assert!(head.contains("Content-Type: text/event-stream\r\n"), "{head}");
        Events(reader)
    }

    /// Ends its input; the program ends well.
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

/// Server-sent events, by their definition: lines up to a blank one.
pub struct Events(BufReader<TcpStream>);

impl Events {
    /// The kind and the data of the next one; none at the end.
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
                Some(other) => panic!("{other:?}"),
                None => {
                    if let Some(data) = data {
                        return Some((kind, data));
                    }
                }
            }
        }
    }

    /// All up to one that has something; none if the page ends before.
    pub fn before_the_end(&mut self, is_last: impl Fn(&Value) -> bool) -> Option<Vec<Value>> {
        let mut all = Vec::new();
        loop {
            let (_, data) = self.next()?;
            let found = is_last(&data);
            all.push(data);
            if found {
                return Some(all);
            }
        }
    }

    /// All up to one that has something.
    pub fn until(&mut self, is_last: impl Fn(&Value) -> bool) -> Vec<Value> {
        self.before_the_end(is_last).expect("it does not end before")
    }
}

fn note(text: &str) -> String {
    json!({"event": "note", "text": text}).to_string()
}

/// The answers among what was seen.
fn said(seen: &[Value]) -> Vec<&Value> {
    seen.iter().filter_map(|news| news.get("said")).filter(|said| said["answer"] != "planning").collect()
}

#[test]
fn what_is_heard_and_answered_is_seen_as_it_comes() {
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
    let seen = events.until(|news| news["said"]["answer"] == "handled" && news["said"]["line"] == 3);
    assert_eq!(said(&seen), answers.iter().collect::<Vec<_>>());
    let heard: Vec<(&Value, &Value)> = seen
        .iter()
        .filter(|news| news.get("heard").is_some())
        .map(|news| (&news["line"], &news["heard"]))
        .collect();
    let expected: Vec<(Value, Value)> = (1..).zip(&lines).map(|(n, line)| (json!(n), json!(line))).collect();
    assert_eq!(heard, expected.iter().map(|(number, line)| (number, line)).collect::<Vec<_>>());
    assert!(seen.iter().all(|news| news["at"].as_f64().is_some_and(|at| at >= 0.0)), "{seen:#?}");
    run.end();
    let rest: Vec<String> = std::iter::from_fn(|| events.next()).map(|(kind, _)| kind).collect();
    assert_eq!(rest, ["end"]);
}

/// The plan is drawn as it is now, with names that are only text.
#[test]
fn the_plan_can_be_seen() {
    let mut run = Run::begin(&["--serve=0"]);
    run.handled(0);
    let mut events = run.events();
    let planned = |news: &Value| news.get("planned").is_some();
    assert_eq!(
        events.until(planned).pop().expect("a line")["planned"],
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
    let told = [
        r#"{"event":"action_started","action":1}"#,
        r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#,
    ];
    run.tell(told.map(str::to_owned), 2);
    assert_eq!(
        events.until(planned).pop().expect("a line")["planned"],
        json!({"exists": true, "under_way": 1})
    );
    let (_, changed) = run.get("/plan", "");
    assert!(changed.contains("fd_amcl_lidar") && !changed.contains("fd_amcl_kinect"), "{changed}");
    run.end();
}

#[test]
fn who_comes_late_sees_how_things_are() {
    let mut run = Run::begin(&["--serve=127.0.0.1:0"]);
    run.handled(0);
    let failed = r#"{"event":"component_status","component":"c_flashlight","status":"FALSE"}"#.to_owned();
    run.tell([failed].into_iter().chain((0..3000).map(|_| note("x"))), 3001);
    let begun = Instant::now();
    loop {
        assert!(begun.elapsed() < PATIENCE, "it always ends before something new");
        let is_new = |news: &Value| news.get("heard").is_some() || news.get("left_out").is_some();
        // Who is too slow for what passes is dropped, and comes again.
        let Some(seen) = run.events().before_the_end(is_new) else { continue };
        let words: Vec<&Value> = said(&seen).into_iter().map(|said| &said["answer"]).collect();
        // The first lines are gone once all have been taken.
        if words.len() < 8 {
            assert_eq!(
                words[..5],
                ["ready", "plan_found", "reconfigure", "request_action", "inferred"],
                "{seen:#?}"
            );
            return;
        }
        assert!(begun.elapsed() < PATIENCE, "{words:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The greatest memory of a process so far in kB, where the system tells.
fn memory(run: &Run) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", run.child.id())).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().trim_end_matches(" kB").parse().ok()
}

#[test]
fn who_does_not_read_is_dropped_and_holds_nobody_up() {
    let mut run = Run::begin(&["--serve=0"]);
    run.handled(0);
    let before = memory(&run);
    let mut idle = run.ask("/events", "");
    // So many that neither sockets nor anything else holds them all.
    let text = "x".repeat(4000);
    run.tell((0..20_000).map(|_| note(&text)), 20_000);
    if let (Some(before), Some(after)) = (before, memory(&run)) {
        assert!(after - before < 60_000, "{before} kB and then {after} kB, where 80 MB went through");
    }
    // Who reads now sees what is new.
    run.tell([note("the last")], 20_001);
    let last = note("the last");
    let begun = Instant::now();
    // On a busy machine a reader may be too slow for what was kept, and comes again, as pages do.
    while run.events().before_the_end(|news| news["heard"] == json!(last)).is_none() {
        assert!(begun.elapsed() < PATIENCE, "it always ends before");
    }
    // Who did not read has lost the connection, and what was in it is far from all.
    let mut bytes = Vec::new();
    let ended = idle.read_to_end(&mut bytes);
    assert!(ended.is_ok() || ended.is_err_and(|error| error.kind() == ErrorKind::ConnectionReset));
    assert!(bytes.len() < 40_000_000, "{} bytes", bytes.len());
    assert!(!String::from_utf8_lossy(&bytes).contains("the last"));
    run.end();
}

#[test]
fn who_does_not_read_leaves_room_for_others() {
    let mut run = Run::begin(&["--serve=0"]);
    run.handled(0);
    let idle: Vec<TcpStream> = (0..16).map(|_| run.ask("/events", "")).collect();
    let text = "x".repeat(4000);
    let begun = Instant::now();
    let (mut line, mut refused) = (0, false);
    loop {
        // More than sockets hold: nobody of these reads.
        run.tell((0..2000).map(|_| note(&text)), line + 2000);
        line += 2000;
        let (head, _) = run.get("/", "");
        if head.starts_with("HTTP/1.1 200") && refused {
            break;
        }
        refused |= head.starts_with("HTTP/1.1 503");
        assert!(begun.elapsed() < PATIENCE, "{head}");
        std::thread::sleep(Duration::from_millis(100));
    }
    drop(idle);
    run.end();
}

#[test]
fn the_page_is_made_of_text_only() {
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
        for way in
            ["innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "http:", "https:"]
        {
            assert!(!body.contains(way) && !page.contains(way), "{path}: {way}");
        }
    }
    let (head, _) = run.get("/etc/passwd", "");
    assert!(head.starts_with("HTTP/1.1 404"), "{head}");
    let status = |request: &str| {
        let mut stream = TcpStream::connect(&run.address).expect("a connection");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        stream.write_all(request.as_bytes()).expect("sent");
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("an answer");
        text.split(' ').nth(1).map(ToOwned::to_owned).unwrap_or_default()
    };
    assert_eq!(status("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n"), "405");
    assert_eq!(status("nonsense\r\n\r\n"), "400");
    assert_eq!(status("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"), "200");
    // A page of another site whose name leads here.
    assert_eq!(status("GET /events HTTP/1.1\r\nHost: evil.example\r\n\r\n"), "403");
    assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), "403");
    run.end();
}

#[test]
fn other_machines_need_the_token() {
    let refused = metaplan_in(&root(), &["run", "missions/ugv.toml", "--serve=0.0.0.0:0"], "");
    assert_eq!((refused.status, refused.stdout.as_str()), (3, ""), "{refused:#?}");
    assert!(refused.stderr.contains("M332") && refused.stderr.contains("a token is needed"), "{refused:#?}");
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("token");
    let name = file.display().to_string();
    for wrong in
        ["short", "", "two words of some length", "\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}\u{e4}"]
    {
        std::fs::write(&file, wrong).expect("a file");
        let arguments = ["run", "missions/ugv.toml", "--serve=0.0.0.0:0", "--serve-token", &name];
        let refused = metaplan_in(&root(), &arguments, "");
        assert_eq!(refused.status, 3, "{wrong}: {refused:#?}");
        assert!(refused.stderr.contains("M332"), "{refused:#?}");
        assert!(wrong.is_empty() || !refused.stderr.contains(wrong), "{refused:#?}");
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
    // `me:Zk3-sesame-open-9` and `me:Zk3-sesame-open-8`, by RFC 4648.
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
