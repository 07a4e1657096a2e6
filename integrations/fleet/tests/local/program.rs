//! Tests of the program: endpoints for probes and metrics, and messages on standard error.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use super::common::{free_port, get};

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
        Self::start_by(Command::new(env!("CARGO_BIN_EXE_metaplan-fleet")), command, more)
    }

    /// Starts the program by a command that ends with the path of the program.
    fn start_by(mut program: Command, command: &str, more: &[&str]) -> Self {
        let (folder, port) = (tempfile::tempdir().expect("a directory"), free_port());
        let log = File::create(folder.path().join("log")).expect("it can be written");
        let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions");
        let child = program
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

    fn log(&self) -> String {
        fs::read_to_string(self.folder.path().join("log")).expect("it can be read")
    }

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

    /// Waits for the end of the program. Returns its status.
    fn join(&mut self) -> Option<i32> {
        for _ in 0..600 {
            if let Some(status) = self.child.try_wait().expect("it is a child") {
                return status.code();
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        panic!("it has not ended within a minute; log: {}", self.log());
    }

    fn wait(&mut self, path: &str, status: u16) -> String {
        self.poll(|program| get(program.port, path).filter(|page| page.0 == status).map(|(_, body)| body))
    }
}

#[test]
fn a_worker_is_ready_when_it_has_reached_its_log() {
    let mut program = Program::start("up", &["--local", "fleet", "--partitions", "2"]);
    program.wait("/live", 200);
    program.wait("/ready", 200);
    assert!(program.wait("/metrics", 200).contains("metaplan_fleet_partitions"));
    assert_eq!(get(program.port, "/health").map(|page| page.0), Some(200));
    assert_eq!(get(program.port, "/secret").map(|page| page.0), Some(404));
    // A worker is ready as soon as it has reached its log, and takes its partitions afterwards.
    let log = program.poll(|program| Some(program.log()).filter(|log| log.contains("taken")));
    assert!(!log.contains('\u{1b}'), "{log:?}");
}

#[test]
fn a_worker_that_waits_for_servers_is_alive_but_not_ready() {
    // Port 9 (discard) has no server.
    let mut program = Program::start("worker", &["--nats", "nats://127.0.0.1:9", "--wait", "600"]);
    program.wait("/live", 200);
    assert!(program.wait("/ready", 503).contains("not reached the log"));
}

/// A limit on the size of files has the same effect as a full disk: a write fails.
#[test]
fn a_fleet_in_a_directory_ends_when_its_disk_is_full() {
    // Without the trap, the signal SIGXFSZ ends the program.
    let script = "trap '' XFSZ; ulimit -f 8192; exec \"$@\"";
    let mut shell = Command::new("sh");
    shell.args(["-c", script, "sh", env!("CARGO_BIN_EXE_metaplan-fleet")]);
    let mut program = Program::start_by(shell, "up", &["--local", "fleet", "--partitions", "2"]);
    let mut input = program.child.stdin.take().expect("a pipe");
    let note = "x".repeat(100_000);
    let lines = (0..200).map(|number| format!("r-{number} {{\"event\": \"tick\", \"note\": \"{note}\"}}\n"));
    // The input stays open, and the program stops reading it.
    let _ = input.write_all(lines.collect::<String>().as_bytes());
    assert_eq!(program.join(), Some(2));
    let log = program.log();
    assert!(log.contains("error[N312]") && !log.contains("N315"), "{log}");
}
