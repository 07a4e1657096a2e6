//! The program `metaplan-fleet`.
#![expect(clippy::print_stderr, reason = "a program says there what is wrong")]

use std::io::IsTerminal as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use metaplan::message::{Errors, Message};
use metaplan_fleet::health::Health;
use metaplan_fleet::missions::Missions;
use metaplan_fleet::partition::{Settings, Shared};
use metaplan_fleet::robots::status;
use metaplan_fleet::store::Store;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::nats::{Access, Layout, Nats};
use metaplan_fleet::wire::is_name;
use metaplan_fleet::worker;
use tokio::sync::watch;
use tracing::level_filters::LevelFilter;

mod endpoints;
mod lines;

/// Run the adaptation loops of many robots, on NATS JetStream or in one directory without a server.
///
/// Input lines have the form `ROBOT EVENT`, output lines `ROBOT DECISION`. The first event of a robot is
/// `{"event": "enrol", "mission": NAME}`; the others are those of `metaplan run`.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Set the least severity of messages on standard error: `error`, `warn`, `info`, `debug` or `off`.
    #[arg(long, global = true, default_value = "warn", value_name = "LEVEL")]
    log: LevelFilter,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Take over partitions of robots, run their loops and store the decisions, until SIGTERM.
    Worker {
        #[command(flatten)]
        server: Server,
        #[command(flatten)]
        work: Work,
        /// Set the name of the worker, which must be unique. [default: host name and process id]
        #[arg(long, value_name = "NAME", value_parser = name)]
        name: Option<String>,
    },
    /// Run a whole fleet in one process: events from standard input, decisions to standard output.
    Up {
        /// Store the fleet in this directory instead of on a server.
        #[arg(long, value_name = "DIR", num_args = 0..=1, default_missing_value = "metaplan-fleet", required = true)]
        local: PathBuf,
        /// Also write the stored decisions with higher numbers than this one.
        #[arg(long, value_name = "DECISION")]
        after: Option<u64>,
        #[command(flatten)]
        work: Work,
        #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=65536))]
        /// Set the number of partitions if the directory is created.
        partitions: u32,
        /// Keep this number of decisions of each robot.
        #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..))]
        history: u32,
    },
    /// Store events, which are lines `ROBOT EVENT` from standard input.
    Send {
        #[command(flatten)]
        server: Server,
        /// Set the prefix of message ids. Lines that are sent again with the same prefix are
        /// decided once.
        #[arg(long, value_name = "WORD")]
        session: Option<String>,
    },
    /// Print decisions as they are made.
    Follow {
        #[command(flatten)]
        server: Server,
        /// Print only the decisions for this robot.
        #[arg(value_name = "ROBOT", value_parser = name)]
        robot: Option<String>,
        /// Begin after the decision with this number; 0 begins with the first decision. [default: only new decisions]
        #[arg(long, value_name = "DECISION")]
        after: Option<u64>,
    },
    /// Print the owner of each partition and the load of the workers.
    Status {
        #[command(flatten)]
        server: Server,
        /// Set the format of the answer.
        #[arg(long, default_value = "text", value_parser = ["text", "json"])]
        format: String,
    },
}

/// Options of a worker: its missions, the number of its threads, the robots that it keeps in memory, and the address of
/// its metrics.
#[derive(Debug, Args)]
struct Work {
    /// Read missions from the manifests in this directory. The name of a mission is its file name without `.toml`.
    #[arg(long, value_name = "DIR")]
    missions: PathBuf,
    /// Read former versions of missions from this directory (repeatable). Robots enrolled with one of them keep it.
    #[arg(long, value_name = "DIR")]
    former: Vec<PathBuf>,
    /// Set the number of loops that search for plans at the same time, for each of three classes of
    /// search durations. [default: number of processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Set the number of robots that are kept in memory. Others are loaded from the log when they have events.
    #[arg(long, value_name = "N", default_value_t = Settings::default().warm)]
    ready: usize,
    /// Serve `/metrics` for Prometheus, `/live` and `/ready` at this `HOST:PORT`.
    #[arg(long, value_name = "ADDRESS")]
    metrics: Option<SocketAddr>,
}

/// Options of the connection to the servers.
#[derive(Debug, Args)]
struct Server {
    #[command(flatten)]
    access: Access,
    #[command(flatten)]
    layout: Layout,
    /// Wait this many seconds for servers that are starting. [default: 60 for `worker`, 10 otherwise]
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u64).range(..=86_400))]
    wait: Option<u64>,
}

impl Server {
    async fn open(&self, default_wait: u64) -> Result<Nats, Message> {
        let patience = Duration::from_secs(self.wait.unwrap_or(default_wait));
        Nats::open(&self.access, &self.layout, patience).await
    }
}

impl Work {
    fn settings(&self) -> Settings {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        Settings {
            threads: self.threads.map_or(processors, usize::from),
            warm: self.ready,
            ..Settings::default()
        }
    }

    fn open_endpoints(&self) -> Result<Arc<Health>, Errors> {
        let health = Arc::<Health>::default();
        if let Some(address) = self.metrics {
            endpoints::open(address, Arc::clone(&health))?;
        }
        Ok(health)
    }

    fn shared<S: Store>(
        &self,
        store: S,
        name: String,
        health: Arc<Health>,
    ) -> Result<Arc<Shared<S>>, Errors> {
        let mut missions = Missions::read(&self.missions)?;
        for directory in &self.former {
            missions = missions.with_former(directory)?;
        }
        Ok(Arc::new(Shared::new(store, missions, name, self.settings()).with_health(health)))
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_ansi(has_colours())
        .with_max_level(arguments.log)
        .with_target(false)
        .init();
    let signals = Signals::default();
    // A process 1, as in a container, is not ended by signals without a handler.
    if std::process::id() == 1
        && let Err(message) = signals.handle()
    {
        eprint!("{}", message.text());
        return ExitCode::from(2);
    }
    let runtime = match tokio::runtime::Runtime::new() {
        Ok(runtime) => runtime,
        Err(error) => {
            eprint!("{}", Message::error("N302", format!("threads cannot be started: {error}")).text());
            return ExitCode::from(2);
        }
    };
    let outcome = runtime.block_on(Box::pin(run(arguments.command, signals)));
    // A search that still runs has no effect any more.
    runtime.shutdown_background();
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(messages) => {
            for message in &messages {
                eprint!("{}", message.text());
            }
            ExitCode::from(2)
        }
    }
}

fn has_colours() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

async fn run(command: Command, signals: Signals) -> Result<(), Errors> {
    match command {
        Command::Worker { server, work, name } => {
            // The endpoints are opened first, so that probes can distinguish a worker that waits for its servers from
            // one that hangs.
            let health = work.open_endpoints()?;
            let store = server.open(60).await?;
            let shared = work.shared(store, name.unwrap_or_else(own_name), health)?;
            worker::run(shared, signals.stop()?).await;
        }
        Command::Up { local, after, work, partitions, history } => {
            let store = Local::open(&local, partitions, history as usize, Duration::from_secs(10))?;
            let health = work.open_endpoints()?;
            let shared = work.shared(store, own_name(), health)?;
            lines::up(shared, after, signals.stop()?).await?;
        }
        Command::Send { server, session } => {
            lines::send(&server.open(10).await?, session).await?;
        }
        Command::Follow { server, robot, after } => {
            let writer = lines::Writer::new(server.open(10).await?, robot, after).await?;
            let mut stop = signals.stop()?;
            tokio::select! {
                done = writer.run() => done?,
                _ = stop.changed() => {}
            }
        }
        Command::Status { server, format } => {
            let status = status(&server.open(10).await?).await.map_err(|fault| {
                Message::error("N312", format!("the status of the fleet cannot be read: {fault}"))
            })?;
            lines::status(&status, format == "json")?;
        }
    }
    Ok(())
}

/// Parses the name of a robot, or of a worker, under which the server stores its status.
fn name(text: &str) -> Result<String, String> {
    let name = is_name(text).then(|| text.to_owned());
    name.ok_or_else(|| "a name has up to 64 letters, digits, `-` and `_`".to_owned())
}

fn own_name() -> String {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let host: String =
        host.trim().chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').take(40).collect();
    format!("{host}-{}-{:04x}", std::process::id(), fastrand::u16(..))
}

/// SIGINT, SIGTERM and SIGHUP.
#[derive(Default)]
struct Signals {
    stop: watch::Sender<bool>,
    /// `true` if the first signal sets `stop`. Otherwise it ends the program.
    is_orderly: Arc<AtomicBool>,
}

impl Signals {
    /// Returns a flag that becomes true on the first signal. A second signal ends the program immediately.
    fn stop(&self) -> Result<watch::Receiver<bool>, Message> {
        let stop = self.stop.subscribe();
        self.is_orderly.store(true, Ordering::Relaxed);
        self.handle()?;
        Ok(stop)
    }

    /// Installs the handler of signals, if it is not installed yet.
    fn handle(&self) -> Result<(), Message> {
        let (stop, is_orderly) = (self.stop.clone(), Arc::clone(&self.is_orderly));
        let handler = move || {
            if !is_orderly.load(Ordering::Relaxed) || stop.send_replace(true) {
                std::process::exit(130);
            }
        };
        match ctrlc::set_handler(handler) {
            Ok(()) | Err(ctrlc::Error::MultipleHandlers) => Ok(()),
            Err(error) => {
                let text = format!("the signal handler cannot be installed: {error}");
                Err(Message::error("N302", text))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_workers_and_robots_can_be_keys() {
        let parse = |words: &[&str]| Arguments::try_parse_from(words).is_ok();
        let worker = ["metaplan-fleet", "worker", "--nats", "nats://h", "--missions", "m", "--name"];
        let follow = ["metaplan-fleet", "follow", "--nats", "nats://h"];
        for command in [&worker[..], &follow] {
            assert!(parse(&[command, &["a-b_1"]].concat()) && !parse(&[command, &["a b"]].concat()));
        }
    }
}
