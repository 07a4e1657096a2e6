//! Standard input and output of the program: lines with events and decisions.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{self, Write as _};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use comfy_table::{CellAlignment, Table, TableStyle};
use futures::StreamExt as _;
use futures::stream::select_all;
use metaplan::message::Message;
use metaplan_fleet::partition::{Shared, repeat};
use metaplan_fleet::robots::{Sender, Status};
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Fault, Store, Stored, Stream};
use metaplan_fleet::wire::{Address, Decided, Presence, is_name, partition_of};
use metaplan_fleet::worker;
use serde_json::{Map, Value};
use tokio::io::{AsyncBufReadExt as _, BufReader, stdin};
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;

/// Maximum number of input lines of a robot that are read but not stored.
const AHEAD: usize = 1024;

/// Maximum time for which the program writes its last decisions after its worker has ended.
const MAX_WRITING: Duration = Duration::from_secs(5);

fn fault(fault: impl Display) -> Message {
    Message::error("N312", format!("the log cannot be used: {fault}"))
}

fn unwritten(error: impl Display) -> Message {
    Message::error("N313", format!("standard output cannot be written: {error}"))
}

fn unparsed(text: impl Display) -> Message {
    Message::error("N314", text.to_string())
}

fn unstored(text: impl Display) -> Message {
    Message::error("N315", text.to_string())
}

/// Reads lines `ROBOT EVENT` from standard input until the end of input or until `stop` becomes true,
/// and waits until the events are stored. Prints errors about single lines, and fails at the end if a
/// line could not be parsed or its event could not be stored.
async fn feed<S: Store>(store: &S, session: &str, mut stop: watch::Receiver<bool>) -> Result<(), Message> {
    let mut robots: BTreeMap<String, mpsc::Sender<(u64, String)>> = BTreeMap::new();
    let mut senders = tokio::task::JoinSet::new();
    let mut lines = BufReader::new(stdin()).split(b'\n');
    let mut number = 0_u64;
    let mut wrong = 0;
    loop {
        let line = tokio::select! {
            line = lines.next_segment() => line,
            _ = stop.changed() => break,
        };
        let line = line.map_err(|error| unparsed(format_args!("standard input: {error}")))?;
        let Some(line) = line else { break };
        number += 1;
        let line = String::from_utf8_lossy(&line).trim_start_matches('\u{feff}').trim().to_owned();
        if line.is_empty() {
            continue;
        }
        let Some((robot, event)) = line.split_once(' ').filter(|(robot, _)| is_name(robot)) else {
            wrong += 1;
            say(&unparsed(format_args!(
                "line {number}: a line is `ROBOT EVENT`; a robot's name has letters, digits, `-` and `_` only"
            )));
            continue;
        };
        let queue = robots.entry(robot.to_owned()).or_insert_with_key(|robot| {
            let (queue, events) = mpsc::channel(AHEAD);
            senders.spawn(send_all(Sender::new(store.clone(), robot, session), events));
            queue
        });
        // The receiving task ends only after this channel is closed, or if the log has failed.
        let _ = queue.send((number, event.to_owned())).await;
    }
    drop(robots);
    let (mut stored, mut lost) = (0, 0);
    while let Some(counts) = senders.join_next().await {
        let counts = counts.map_err(|error| unstored(format_args!("a sender has failed: {error}")))?;
        (stored, lost) = (stored + counts.0, lost + counts.1);
    }
    match (wrong, lost) {
        (0, 0) => Ok(()),
        (_, 0) => {
            Err(unparsed(format_args!("{wrong} lines could not be parsed; {stored} events were stored")))
        }
        _ => Err(unstored(format_args!(
            "{lost} events were not stored, {wrong} lines could not be parsed; {stored} events were stored"
        ))),
    }
}

/// Sends the events of a robot, which have the numbers of their lines. Prints errors, and returns the numbers of
/// events that were stored and that were not.
async fn send_all<S: Store>(mut sender: Sender<S>, mut events: mpsc::Receiver<(u64, String)>) -> (u64, u64) {
    let (mut stored, mut lost) = (0, 0);
    while let Some((number, event)) = events.recv().await {
        if let Err(fault) = sender.send(&event).await {
            lost += 1;
            if matches!(fault, Fault::Failed(_)) {
                // All further lines are lost for the same reason, which is reported once.
                break;
            }
            let robot = &sender.address().robot;
            say(&unstored(format_args!("line {number}, robot `{robot}`: {fault}")));
        } else {
            stored += 1;
        }
    }
    (stored, lost)
}

#[expect(clippy::print_stderr, reason = "it is said while the program goes on")]
fn say(message: &Message) {
    eprint!("{}", message.text());
}

/// Stores events from standard input. `session` is that of [`Sender::new`], by default a random word.
pub(crate) async fn send<S: Store>(store: &S, session: Option<String>) -> Result<(), Message> {
    let (_goes_on, stop) = watch::channel(false);
    feed(store, &session.unwrap_or_else(random_session), stop).await
}

fn random_session() -> String {
    format!("{:016x}", fastrand::u64(..))
}

/// Converts a stored decision to the robot's name and the JSON text for the output line. Returns
/// `None` for other messages.
fn line(message: &Stored) -> Option<(String, String)> {
    let address = Address::parse(&message.subject)?;
    Decided::parse(&message.payload)?;
    let mut line: Map<String, Value> = serde_json::from_slice(&message.payload).ok()?;
    line.retain(|name, _| !["format", "now", "worker", "state"].contains(&name.as_str()));
    line.shift_insert(0, "decision".to_owned(), message.sequence.into());
    Some((address.robot, Value::Object(line).to_string()))
}

/// Writes decisions to standard output until it is closed or the log fails. While the log is unreachable, the writer
/// waits for it.
pub(crate) struct Writer<S> {
    store: S,
    /// `None` for the decisions of all robots.
    robot: Option<String>,
    /// Sequence numbers up to which decisions are written, by partition.
    written: Mutex<BTreeMap<u32, u64>>,
}

impl<S: Store> Writer<S> {
    /// Returns a writer that begins after the decision `after`, or with the next new decision if `after` is `None`.
    pub(crate) async fn new(store: S, robot: Option<String>, after: Option<u64>) -> Result<Self, Message> {
        let partitions: Vec<u32> = match &robot {
            Some(robot) => vec![partition_of(robot, store.partitions())],
            None => (0..store.partitions()).collect(),
        };
        let mut written = BTreeMap::new();
        for partition in partitions {
            let start = match after {
                Some(after) => after,
                None => store.end(Stream::Decisions, partition).await.map_err(fault)?,
            };
            written.insert(partition, start);
        }
        Ok(Self { store, robot, written: Mutex::new(written) })
    }

    pub(crate) async fn run(&self) -> Result<(), Message> {
        loop {
            let from = self.written.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let mut streams = Vec::new();
            for (partition, after) in from {
                let stream = repeat(|| self.store.follow(Stream::Decisions, partition, after)).await;
                let stream = stream.map_err(fault)?;
                streams.push(stream.map(move |message| (partition, message)).boxed());
            }
            let mut decisions = select_all(streams);
            while let Some((partition, message)) = decisions.next().await {
                // The subscription was interrupted and is started again.
                let Ok(message) = message else { break };
                if let Some((name, text)) = line(&message)
                    && self.robot.as_ref().is_none_or(|robot| *robot == name)
                {
                    let mut out = io::stdout().lock();
                    match writeln!(out, "{name} {text}").and_then(|()| out.flush()) {
                        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
                        other => other.map_err(unwritten)?,
                    }
                }
                let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
                written.insert(partition, message.sequence);
            }
            tokio::time::sleep(Duration::from_millis(fastrand::u64(50..500))).await;
        }
    }
}

/// Runs a fleet in a directory: events from standard input, decisions to standard output. Ends when
/// `stop` becomes true, or when the input has ended and either all events are decided (except those of
/// suspended robots) or the output is closed. Fails when the directory cannot be written. `after` is as in
/// [`Writer::new`].
pub(crate) async fn up(
    shared: Arc<Shared<Local>>,
    after: Option<u64>,
    stop: watch::Receiver<bool>,
) -> Result<(), Message> {
    let store = shared.store.clone();
    tokio::select! {
        biased;
        reason = store.failure() => Err(fault(reason)),
        outcome = run(shared, after, stop) => outcome,
    }
}

async fn run(
    shared: Arc<Shared<Local>>,
    after: Option<u64>,
    mut stop: watch::Receiver<bool>,
) -> Result<(), Message> {
    let store = shared.store.clone();
    let writer = Arc::new(Writer::new(store.clone(), None, after).await?);
    let mut notices = store.notices();
    tokio::spawn(async move {
        while let Some(message) = warning(notices.recv().await) {
            say(&message);
        }
    });
    let (order, orders) = watch::channel(false);
    let working = tokio::spawn(worker::run(Arc::clone(&shared), orders));
    let running = Arc::clone(&writer);
    let writing = tokio::spawn(async move { running.run().await });
    let fed = feed(&store, &random_session(), stop.clone()).await;
    // Waits until all stored events are decided and all decisions written, unless the program is
    // stopped or the output is closed.
    while !*stop.borrow_and_update() && !writing.is_finished() && !is_done(&shared, &writer.written).await? {
        tokio::select! {
            _ = stop.changed() => {}
            () = tokio::time::sleep(Duration::from_millis(20)) => {}
        }
    }
    order.send_replace(true);
    // A worker has no result to check.
    let _ = working.await;
    let is_written = write_last(&store, &writing, &writer.written);
    let result = tokio::time::timeout(MAX_WRITING, is_written).await.unwrap_or(Ok(()));
    writing.abort();
    if let Ok(outcome) = writing.await {
        outcome?;
    }
    fed.and(result)
}

/// Returns the warning for a notice, or for notices that were lost because standard error was not read in time.
/// Returns `None` after the last notice.
fn warning(received: Result<(String, String), RecvError>) -> Option<Message> {
    let text = match received {
        Ok((subject, text)) => {
            let robot = Address::parse(&subject).map_or(subject, |address| address.robot);
            format!("robot `{robot}`: {text}")
        }
        Err(RecvError::Lagged(count)) => {
            format!("{count} warnings are missing, because standard error was not read in time")
        }
        Err(RecvError::Closed) => return None,
    };
    Some(Message::warning("N320", text))
}

/// Returns `true` if all stored events are decided, refused, or of a suspended robot, their plans are found, and all
/// decisions are written.
async fn is_done(shared: &Shared<Local>, written: &Mutex<BTreeMap<u32, u64>>) -> Result<bool, Message> {
    let counts = &shared.counts;
    // Events are checked first: once all of them are handled, their decisions are stored.
    for (stream, positions) in [(Stream::Events, &counts.seen), (Stream::Decisions, written)] {
        if !has_reached(&shared.store, stream, positions).await?
            || counts.waiting.load(Ordering::SeqCst) + counts.planning.load(Ordering::SeqCst) > 0
        {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Waits until all stored decisions are written, or `writing` has ended. A further program begins after the stored
/// decisions, so it would not write them.
async fn write_last<T>(
    store: &Local,
    writing: &JoinHandle<T>,
    written: &Mutex<BTreeMap<u32, u64>>,
) -> Result<(), Message> {
    while !writing.is_finished() && !has_reached(store, Stream::Decisions, written).await? {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    Ok(())
}

/// Returns `true` if a position has reached the end of the stream in each partition.
async fn has_reached(
    store: &Local,
    stream: Stream,
    positions: &Mutex<BTreeMap<u32, u64>>,
) -> Result<bool, Message> {
    for partition in 0..store.partitions() {
        let end = store.end(stream, partition).await.map_err(fault)?;
        let positions = positions.lock().unwrap_or_else(PoisonError::into_inner);
        if positions.get(&partition).copied().unwrap_or_default() < end {
            return Ok(false);
        }
    }
    Ok(true)
}

pub(crate) fn status(status: &Status, as_json: bool) -> Result<(), Message> {
    let text = if as_json {
        format!("{}\n", serde_json::to_string(status).unwrap_or_default())
    } else {
        status_text(status)
    };
    io::stdout().write_all(text.as_bytes()).map_err(unwritten)
}

fn status_text(status: &Status) -> String {
    let table = |header: &[&str], rows: Vec<Vec<String>>| {
        let mut table = Table::new();
        table.load_style(TableStyle::new()).set_header(header).add_rows(rows);
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table
    };
    let workers = status.workers.iter().map(|(name, worker)| {
        let Presence { partitions, robots, waiting, decided, refused, load, draining } = worker;
        let counts = [&u64::from(*partitions), robots, waiting, decided, refused].map(u64::to_string);
        let load = format!("{:.0} %", load * 100.0);
        let is_ending = if *draining { "is ending" } else { "" };
        [vec![name.clone()], counts.to_vec(), vec![load, is_ending.to_owned()]].concat()
    });
    let header = ["worker", "partitions", "robots", "waiting", "decided", "refused", "load", ""];
    let workers = table(&header, workers.collect());
    let partitions = status.partitions.iter().map(|partition| {
        let worker = partition.worker.as_deref().unwrap_or("nobody");
        vec![partition.partition.to_string(), worker.to_owned()]
    });
    let partitions = table(&["partition", "worker"], partitions.collect());
    format!("{workers}\n\n{partitions}\n")
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU32;
    use std::time::Instant;

    use delegate::delegate;
    use metaplan_fleet::store::{Message as Appended, Receipt, Subscription};
    use tokio::sync::broadcast;

    use super::*;

    /// A log whose first subscription ends, and which is then unreachable for two attempts.
    #[derive(Clone)]
    struct Interrupted {
        inner: Local,
        subscriptions: Arc<AtomicU32>,
    }

    impl Store for Interrupted {
        delegate! {
            to self.inner {
                fn partitions(&self) -> u32;
                fn lease(&self) -> Duration;
                async fn end(&self, stream: Stream, partition: u32) -> Result<u64, Fault>;
                async fn append(&self, stream: Stream, message: Appended<'_>) -> Result<Receipt, Fault>;
                async fn discard(&self, subject: &str, last: u64) -> Result<(), Fault>;
                async fn last(&self, stream: Stream, subject: &str) -> Result<Option<Stored>, Fault>;
                async fn next(&self, subject: &str, start: u64) -> Result<Option<Stored>, Fault>;
                async fn announce(&self, worker: &str, status: Option<&Presence>) -> Result<(), Fault>;
                async fn workers(&self) -> Result<BTreeMap<String, Presence>, Fault>;
                async fn notice(&self, subject: &str, text: &str);
            }
        }

        async fn follow(&self, stream: Stream, partition: u32, after: u64) -> Result<Subscription, Fault> {
            match self.subscriptions.fetch_add(1, Ordering::SeqCst) {
                0 => Ok(futures::stream::empty().boxed()),
                1 | 2 => Err(Fault::Unreachable("timed out".to_owned())),
                _ => self.inner.follow(stream, partition, after).await,
            }
        }
    }

    #[tokio::test]
    async fn decisions_are_written_after_an_outage() {
        let folder = tempfile::tempdir().expect("a directory");
        let inner = Local::open(folder.path(), 1, 8, Duration::from_secs(1))
            .unwrap_or_else(|message| panic!("{message}"));
        let message = Appended { subject: "0.r", id: "", after: None, payload: b"no decision" };
        let receipt = inner.append(Stream::Decisions, message).await.expect("it is our own directory");
        let store = Interrupted { inner, subscriptions: Arc::default() };
        let writer = Writer::new(store, None, Some(0)).await.unwrap_or_else(|message| panic!("{message}"));
        let is_written = async {
            let begun = Instant::now();
            while writer.written.lock().unwrap_or_else(PoisonError::into_inner)[&0] < receipt.sequence {
                assert!(begun.elapsed() < Duration::from_secs(600));
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        tokio::select! {
            outcome = writer.run() => panic!("it has ended: {outcome:?}"),
            () = is_written => {}
        }
    }

    #[tokio::test]
    async fn the_last_decisions_are_written_before_the_end() {
        let folder = tempfile::tempdir().expect("a directory");
        let store = Local::open(folder.path(), 2, 8, Duration::from_secs(1))
            .unwrap_or_else(|message| panic!("{message}"));
        let message = Appended { subject: "1.r", id: "", after: None, payload: b"a decision" };
        let receipt = store.append(Stream::Decisions, message).await.expect("it is our own directory");
        let written = Mutex::new(BTreeMap::new());
        let writing = tokio::spawn(std::future::pending::<()>());
        let positions = || written.lock().unwrap_or_else(PoisonError::into_inner);
        let write = async {
            tokio::time::sleep(Duration::from_millis(100)).await;
            positions().insert(1, receipt.sequence);
        };
        let end = async {
            write_last(&store, &writing, &written).await.unwrap_or_else(|message| panic!("{message:?}"));
            positions().get(&1).copied()
        };
        assert_eq!(tokio::join!(end, write).0, Some(receipt.sequence));
        // It does not wait for a task that has ended, for example because standard output is closed.
        positions().clear();
        writing.abort();
        write_last(&store, &writing, &written).await.unwrap_or_else(|message| panic!("{message:?}"));
    }

    #[tokio::test]
    async fn warnings_continue_after_a_burst() {
        let (sender, mut notices) = broadcast::channel(2);
        for number in 0..5 {
            sender.send(("0.r".to_owned(), format!("notice {number}"))).expect("there is a receiver");
        }
        drop(sender);
        let mut texts = Vec::new();
        while let Some(message) = warning(notices.recv().await) {
            texts.push(message.text().to_owned());
        }
        assert_eq!(texts.len(), 3, "{texts:?}");
        assert!(texts[0].contains("3 warnings") && texts[2].contains("robot `r`: notice 4"), "{texts:?}");
    }
}
