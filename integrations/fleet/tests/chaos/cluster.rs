//! Three NATS servers and several workers as processes, and the injected faults.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use test_resources::{Resource, missing};

use super::common::{free_port, get};
use super::wires::Wire;

const PAIRS: [[usize; 2]; 3] = [[1, 2], [0, 2], [0, 1]];

const DISK: &str = "64m";

fn program() -> String {
    std::env::var("NATS_SERVER").unwrap_or_else(|_| "nats-server".to_owned())
}

pub(super) fn is_possible() -> bool {
    let program = program();
    let status = Command::new(&program).arg("--version").stdout(Stdio::null()).status();
    let is_possible = status.is_ok_and(|status| status.success());
    if !is_possible {
        missing(Resource::Nats, &format!("{program} does not start"));
    }
    is_possible
}

#[derive(Clone)]
pub(super) struct Cluster(Arc<Inner>);

struct Inner {
    directory: tempfile::TempDir,
    clients: [u16; 3],
    monitors: [u16; 3],
    /// For each of the three servers, the proxy for the connections between the two other servers.
    wires: [Wire; 3],
    own_disk: bool,
    processes: Mutex<BTreeMap<String, Child>>,
}

impl Drop for Inner {
    fn drop(&mut self) {
        for child in self.processes.get_mut().unwrap_or_else(PoisonError::into_inner).values_mut() {
            // The process may already have ended.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn can_mount() -> bool {
    let script = "mount -t tmpfs -o size=1m tmpfs /mnt";
    let status = Command::new("unshare").args(["-rm", "sh", "-c", script]).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

impl Cluster {
    pub(super) async fn begin(seed: u64) -> Self {
        let directory =
            tempfile::Builder::new().prefix(&format!("chaos-{seed}-")).tempdir().expect("a directory");
        let clients: [u16; 3] = std::array::from_fn(|_| free_port());
        let routes: [u16; 3] = std::array::from_fn(|_| free_port());
        let monitors: [u16; 3] = std::array::from_fn(|_| free_port());
        let wires: [Wire; 3] = std::array::from_fn(|_| Wire::default());
        // Servers announce further addresses to each other, which would bypass a cut connection.
        // The announced addresses are unused.
        let nobody = free_port();
        for own in 0..3 {
            let mut list = Vec::new();
            for other in (0..3).filter(|other| *other != own) {
                let port = wires[3 - own - other].lead(routes[other]).await;
                list.push(format!("nats://127.0.0.1:{port}"));
            }
            let folder = directory.path().join(format!("s{own}"));
            fs::create_dir_all(&folder).expect("it can be made");
            let text = format!(
                "server_name: s{own}\nlisten: \"127.0.0.1:{}\"\nhttp: \"127.0.0.1:{}\"\n\
                 jetstream {{ store_dir: \"{}\", sync_interval: always, max_file_store: 4GB }}\n\
                 cluster {{ name: chaos, listen: \"127.0.0.1:{}\", advertise: \"127.0.0.1:{nobody}\", routes: [{}] }}\n",
                clients[own],
                monitors[own],
                folder.display(),
                routes[own],
                list.join(", ")
            );
            fs::write(directory.path().join(format!("s{own}.conf")), text).expect("it can be written");
        }
        let own_disk = can_mount();
        let processes = Mutex::default();
        let cluster = Self(Arc::new(Inner { directory, clients, monitors, wires, own_disk, processes }));
        if own_disk {
            cluster.begin_disk();
        }
        for own in 0..3 {
            cluster.begin_server(own);
        }
        cluster
    }

    fn processes(&self) -> MutexGuard<'_, BTreeMap<String, Child>> {
        self.0.processes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.directory.path().join(name)
    }

    pub(super) fn url(&self) -> String {
        self.0.clients.map(|port| format!("nats://127.0.0.1:{port}")).join(",")
    }

    fn log(&self, name: &str) -> File {
        let path = self.path(&format!("{name}.log"));
        File::options().create(true).append(true).open(path).expect("it can be written")
    }

    fn begin_process(&self, name: &str, mut command: Command) {
        let child = command.stdin(Stdio::null()).stdout(self.log(name)).stderr(self.log(name)).spawn();
        self.processes().insert(name.to_owned(), child.expect("it can be begun"));
    }

    /// Mounts a small disk for the third server, by a process that keeps the disk mounted while it
    /// runs.
    fn begin_disk(&self) {
        let (folder, ready) = (self.path("s2"), self.path("s2").join("ready"));
        let mount = format!(
            "mount -t tmpfs -o size={DISK} tmpfs {0} && touch {0}/ready && exec sleep infinity",
            folder.display()
        );
        let mut command = Command::new("unshare");
        command.args(["-rm", "sh", "-c", &mount]);
        self.begin_process("disk", command);
        let pid = self.processes().get("disk").map(Child::id).expect("it has begun");
        let seen = PathBuf::from(format!("/proc/{pid}/root{}", ready.display()));
        for _ in 0..200 {
            if seen.exists() {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("{}", self.logs());
    }

    fn begin_server(&self, own: usize) {
        let configuration = self.path(&format!("s{own}.conf"));
        let mut command = Command::new(program());
        if own == 2 && self.0.own_disk {
            let disk =
                self.processes().get("disk").map(|child| child.id().to_string()).expect("it has begun");
            command = Command::new("nsenter");
            command.args(["--preserve-credentials", "-U", "-m", "-t", &disk, &program()]);
        }
        command.arg("-c").arg(configuration);
        self.begin_process(&format!("s{own}"), command);
    }

    pub(super) fn begin_worker(&self, own: usize, partitions: u32, lease: u64) {
        let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../missions");
        let mut command = Command::new(env!("CARGO_BIN_EXE_metaplan-fleet"));
        command.arg("worker").args(["--nats", &self.url(), "--replicas", "3", "--threads", "2"]);
        command.args(["--partitions", &partitions.to_string(), "--lease", &lease.to_string()]);
        command.arg("--missions").arg(missions);
        self.begin_process(&format!("w{own}"), command);
    }

    fn signal(&self, name: &str, signal: &str) {
        let pid = self.processes().get(name).map(|child| child.id().to_string());
        if let Some(pid) = pid {
            // The process may already have ended.
            let _ = Command::new("kill").args([signal, &pid]).stderr(Stdio::null()).status();
        }
    }

    fn kill(&self, name: &str) {
        self.signal(name, "-KILL");
        if let Some(mut child) = self.processes().remove(name) {
            let _ = child.wait();
        }
    }

    fn fill(&self, full: bool) {
        let pid = self.processes().get("disk").map(Child::id);
        let Some(pid) = pid else { return };
        let folder = self.path("s2");
        let inside = PathBuf::from(format!("/proc/{pid}/root{}", folder.display())).join("filler");
        if full {
            if let Ok(mut file) = File::create(&inside) {
                // Writes until the disk is full.
                let _ = std::io::copy(&mut std::io::repeat(0), &mut file);
            }
        } else {
            let _ = fs::remove_file(inside);
        }
    }

    /// Cuts the connection between two servers for `millis` milliseconds. Both remain connected to
    /// the server `third`.
    fn part(&self, third: usize, millis: u64) {
        let [one, other] = PAIRS[third];
        self.0.wires[third].0.send_replace(true);
        std::thread::sleep(Duration::from_millis(millis));
        for (own, lost) in [(one, other), (other, one)] {
            // A busy server does not reply.
            if let Some((200, routes)) = get(self.0.monitors[own], "/routez") {
                assert!(
                    !routes.contains(&format!("\"remote_name\": \"s{lost}\"")),
                    "s{own} still hears s{lost}: {routes}"
                );
            }
        }
        self.0.wires[third].0.send_replace(false);
    }

    /// Injects random faults, one at a time, until `over` is true, and restores all processes.
    /// Returns a description with the number of faults of each kind.
    pub(super) fn trouble(&self, seed: u64, over: &AtomicBool, partitions: u32, lease: u64) -> String {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut counts: BTreeMap<&str, u32> = BTreeMap::new();
        let wait = |millis: u64| std::thread::sleep(Duration::from_millis(millis));
        while !over.load(Ordering::Relaxed) {
            wait(random.u64(200..2500));
            let worker = random.usize(0..super::WORKERS);
            let server = random.usize(0..3);
            let what = match random.u8(0..if self.0.own_disk { 13 } else { 12 }) {
                0..=3 => {
                    self.kill(&format!("w{worker}"));
                    wait(random.u64(0..3000));
                    self.begin_worker(worker, partitions, lease);
                    "workers killed"
                }
                4..=6 => {
                    self.signal(&format!("w{worker}"), "-STOP");
                    wait(lease * 1000 + random.u64(500..2500));
                    self.signal(&format!("w{worker}"), "-CONT");
                    "workers paused beyond their lease"
                }
                7..=8 => {
                    self.kill(&format!("s{server}"));
                    wait(random.u64(500..4000));
                    self.begin_server(server);
                    wait(1500);
                    "servers killed"
                }
                9 => {
                    self.signal(&format!("s{server}"), "-STOP");
                    wait(random.u64(1000..5000));
                    self.signal(&format!("s{server}"), "-CONT");
                    wait(1000);
                    "servers cut off"
                }
                10..=11 => {
                    self.part(server, random.u64(1000..5000));
                    wait(1000);
                    "connections between two servers cut"
                }
                _ => {
                    self.fill(true);
                    wait(random.u64(1000..3000));
                    self.fill(false);
                    self.kill("s2");
                    self.begin_server(2);
                    wait(2000);
                    "disks filled"
                }
            };
            *counts.entry(what).or_default() += 1;
        }
        counts.iter().map(|(what, count)| format!("{count} {what}")).collect::<Vec<_>>().join(", ")
    }

    /// Returns the resident memory of a process in megabytes.
    pub(super) fn memory(&self, name: &str) -> u64 {
        let pid = self.processes().get(name).map(Child::id).unwrap_or_default();
        let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
        line.split_whitespace().next().and_then(|text| text.parse::<u64>().ok()).unwrap_or_default() / 1024
    }

    pub(super) fn logs(&self) -> String {
        let mut text = String::new();
        for entry in fs::read_dir(self.0.directory.path()).into_iter().flatten().flatten() {
            if entry.path().extension().is_some_and(|extension| extension == "log") {
                let log = fs::read_to_string(entry.path()).unwrap_or_default();
                let lines: Vec<&str> = log.lines().collect();
                let last = lines[lines.len().saturating_sub(6)..].join("\n");
                text.extend(["\n--- ", &entry.path().to_string_lossy(), "\n", &last]);
            }
        }
        text
    }
}
