//! Tests of the program: endpoints for probes and metrics, and messages on standard error.

use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

struct Program {
    child: Child,
    port: u16,
    folder: tempfile::TempDir,
}

impl Drop for Program {
    fn drop(&mut self) {
        // The process may already have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Program {
    fn start(command: &str, more: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a directory");
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let port = listener.local_addr().expect("it has an address").port();
        drop(listener);
        let log = File::create(folder.path().join("log")).expect("it can be written");
        let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions");
        let child = Command::new(env!("CARGO_BIN_EXE_metaplan-fleet"))
            .args([command, "--log", "info", "--metrics", &format!("127.0.0.1:{port}"), "--missions"])
            .arg(missions)
            .args(more)
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .expect("it can be started");
        Self { child, port, folder }
    }

    fn get(&self, path: &str) -> Option<(u16, String)> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).ok()?;
        stream.set_read_timeout(Some(Duration::from_secs(60))).ok()?;
        write!(stream, "GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").ok()?;
        let mut text = String::new();
        stream.read_to_string(&mut text).ok()?;
        let (head, body) = text.split_once("\r\n\r\n")?;
        Some((head.split(' ').nth(1)?.parse().ok()?, body.to_owned()))
    }

    fn log(&self) -> String {
        fs::read_to_string(self.folder.path().join("log")).expect("it can be read")
    }

    /// Calls `look` until it returns a value, at most for ten minutes.
    fn poll<T>(&mut self, look: impl Fn(&Self) -> Option<T>) -> T {
        for _ in 0..6000 {
            if let Some(value) = look(self) {
                return value;
            }
            assert!(self.child.try_wait().expect("it is a child").is_none(), "it has ended: {}", self.log());
            std::thread::sleep(Duration::from_millis(100));
        }
        panic!("not seen within ten minutes; log: {}", self.log());
    }

    fn wait(&mut self, path: &str, status: u16) -> String {
        self.poll(|program| program.get(path).filter(|page| page.0 == status).map(|(_, body)| body))
    }

    fn wait_for_line(&mut self, text: &str) -> String {
        self.poll(|program| Some(program.log()).filter(|log| log.contains(text)))
    }
}

#[test]
fn a_worker_is_ready_when_it_has_reached_its_log() {
    let mut program = Program::start("up", &["--local", "fleet", "--partitions", "2"]);
    program.wait("/live", 200);
    program.wait("/ready", 200);
    assert!(program.wait("/metrics", 200).contains("metaplan_fleet_partitions"));
    assert_eq!(program.get("/health").map(|page| page.0), Some(200));
    assert_eq!(program.get("/secret").map(|page| page.0), Some(404));
    // A worker is ready as soon as it has reached its log, and takes its partitions afterwards.
    let log = program.wait_for_line("taken");
    assert!(!log.contains('\u{1b}'), "{log:?}");
}

#[test]
fn a_worker_that_waits_for_servers_is_alive_but_not_ready() {
    // Port 9 (discard) has no server.
    let mut program = Program::start("worker", &["--nats", "nats://127.0.0.1:9", "--wait", "600"]);
    program.wait("/live", 200);
    assert!(program.wait("/ready", 503).contains("not reached the log"));
}
