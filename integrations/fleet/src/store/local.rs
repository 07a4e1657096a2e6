//! Log in a local directory, without a server and for a single process.
//!
//! All messages are in memory, and in a file of the database `redb`. Concurrent writes are combined into one
//! transaction, which is on disk before the writes are acknowledged and become visible.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use futures::stream::{self, StreamExt as _};
use metaplan::message::Message as Diagnostic;
use redb::{Database, ReadableDatabase as _, ReadableTable as _, Table, TableDefinition};
use tokio::sync::{broadcast, mpsc, oneshot, watch};

use super::{Fault, Message, Receipt, Store, Stored, Stream, Subscription, failed};
use crate::wire::{Address, Presence};

const FILE: &str = "fleet.redb";

/// Version of the tables.
const FORMAT: u64 = 2;

/// Maximum number of writes in one transaction.
const BATCH: usize = 4096;

/// Type of a stored message: (subject, id, time, payload). The key is (stream, sequence number).
type Parts = (&'static str, &'static str, u64, &'static [u8]);
const MESSAGES: TableDefinition<'static, (u8, u64), Parts> = TableDefinition::new("messages");
/// Counters by name: the version of the tables, the number of partitions, and the last sequence number of each
/// stream.
const NUMBERS: TableDefinition<'static, &str, u64> = TableDefinition::new("numbers");

/// A log in a local directory. Clones share the database.
#[derive(Debug, Clone)]
pub struct Local(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    messages: Arc<RwLock<Messages>>,
    partitions: u32,
    lease: Duration,
    requests: mpsc::UnboundedSender<(Write, oneshot::Sender<Answer>)>,
    /// Number of transactions, by which subscribers are notified.
    written: watch::Receiver<u64>,
    notices: broadcast::Sender<(String, String)>,
    /// Status of the workers, all of which are in this process, with the time of its publication.
    workers: Mutex<BTreeMap<String, (Instant, Presence)>>,
}

type Answer = Result<Receipt, Fault>;

#[derive(Debug)]
enum Write {
    Append { stream: Stream, subject: String, id: String, after: Option<u64>, payload: Vec<u8> },
    Discard { subject: String, last: u64 },
}

impl Local {
    /// Opens or creates a log in a directory. `partitions` applies only on creation. The last `history` decisions of
    /// each robot are kept. The status of a worker expires unless it is published again within `lease`.
    ///
    /// # Errors
    /// The directory cannot be used, was created by another version, or is used by another process.
    pub fn open(
        directory: &Path,
        partitions: u32,
        history: usize,
        lease: Duration,
    ) -> Result<Self, Diagnostic> {
        let wrong = |error: &dyn std::fmt::Display| {
            Diagnostic::error("N310", format!("{}: {error}", directory.display()))
        };
        std::fs::create_dir_all(directory).map_err(|error| wrong(&error))?;
        let database = Database::create(directory.join(FILE)).map_err(|error| wrong(&error))?;
        let (partitions, mut messages) = read(&database, partitions)
            .map_err(|error| wrong(&error))?
            .ok_or_else(|| wrong(&"the fleet was created by an earlier version: use another directory"))?;
        messages.history = history.max(1);
        let messages = Arc::new(RwLock::new(messages));
        let (requests, mut waiting) = mpsc::unbounded_channel();
        let (writing, written) = watch::channel(0);
        let (notices, _) = broadcast::channel(1024);
        let written_messages = Arc::clone(&messages);
        let write_all = move || {
            let mut batch = Vec::new();
            while waiting.blocking_recv_many(&mut batch, BATCH) > 0 {
                write(&database, &written_messages, &mut batch);
                writing.send_modify(|count| *count += 1);
            }
        };
        std::thread::Builder::new()
            .name("fleet-writer".to_owned())
            .spawn(write_all)
            .map_err(|error| wrong(&error))?;
        let workers = Mutex::default();
        Ok(Self(Arc::new(Inner { messages, partitions, lease, requests, written, notices, workers })))
    }

    /// Subscribes to notices about refused events and suspended robots: subject (`PARTITION.ROBOT`)
    /// and reason.
    pub fn notices(&self) -> broadcast::Receiver<(String, String)> {
        self.0.notices.subscribe()
    }

    async fn write(&self, write: Write) -> Answer {
        let (done, answer) = oneshot::channel();
        self.0.requests.send((write, done)).map_err(failed)?;
        answer.await.map_err(failed)?
    }

    fn read<T>(&self, read: impl FnOnce(&Messages) -> T) -> Result<T, Fault> {
        let messages = self.0.messages.read().unwrap_or_else(PoisonError::into_inner);
        messages.failure.clone().map_or_else(|| Ok(read(&messages)), |failure| Err(failed(failure)))
    }
}

#[derive(Debug, Default)]
struct Messages {
    /// By stream, partition and sequence number. Messages without an address have the partition [`u32::MAX`].
    by_partition: BTreeMap<(Stream, u32, u64), Arc<Stored>>,
    by_subject: BTreeMap<(Stream, String), BTreeMap<u64, Arc<Stored>>>,
    /// Events by sequence number.
    events: BTreeMap<u64, Arc<Stored>>,
    /// Sequence numbers of events by message id.
    ids: BTreeMap<String, u64>,
    /// Last sequence number of each stream.
    last: [u64; 2],
    /// Number of decisions that are kept of each robot.
    history: usize,
    /// Reason why a transaction could not be written. The database is then not used any longer.
    failure: Option<String>,
}

impl Messages {
    fn insert(&mut self, stream: Stream, message: Stored) {
        let (sequence, message) = (message.sequence, Arc::new(message));
        let partition = Address::parse(&message.subject).map_or(u32::MAX, |address| address.partition);
        self.by_partition.insert((stream, partition, sequence), Arc::clone(&message));
        if stream == Stream::Events {
            self.events.insert(sequence, Arc::clone(&message));
            self.ids.extend(message.id.clone().map(|id| (id, sequence)));
        }
        let subject = self.by_subject.entry((stream, message.subject.clone())).or_default();
        subject.insert(sequence, message);
    }

    fn of_subject(&self, stream: Stream, subject: &str) -> impl DoubleEndedIterator<Item = &Arc<Stored>> {
        self.by_subject.get(&(stream, subject.to_owned())).into_iter().flat_map(BTreeMap::values)
    }

    fn apply(&mut self, tables: &mut Tables<'_>, write: &Write) -> Result<Answer, redb::Error> {
        let (stream, subject, id, after, payload) = match write {
            Write::Append { stream, subject, id, after, payload } => (*stream, subject, id, after, payload),
            Write::Discard { subject, last } => {
                self.remove(tables, Stream::Events, subject, *last)?;
                return Ok(Ok(Receipt { sequence: *last, is_known: true }));
            }
        };
        if let Some(sequence) = self.ids.get(id) {
            return Ok(Ok(Receipt { sequence: *sequence, is_known: true }));
        }
        let last = self.of_subject(stream, subject).next_back().map_or(0, |last| last.sequence);
        if after.is_some_and(|after| after != last) {
            return Ok(Err(Fault::Conflict));
        }
        let sequence = self.last[stream as usize] + 1;
        self.last[stream as usize] = sequence;
        tables.numbers.insert(stream.prefix(), sequence)?;
        let time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let time = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        let parts = (subject.as_str(), id.as_str(), time, payload.as_slice());
        tables.messages.insert((stream as u8, sequence), parts)?;
        self.insert(stream, message((stream as u8, sequence), parts));
        let obsolete = self.of_subject(stream, subject).rev().nth(self.history).map(|own| own.sequence);
        if let (Stream::Decisions, Some(obsolete)) = (stream, obsolete) {
            self.remove(tables, stream, subject, obsolete)?;
        }
        Ok(Ok(Receipt { sequence, is_known: false }))
    }

    /// Removes the messages of a subject up to and including the sequence number `last`.
    fn remove(
        &mut self,
        tables: &mut Tables<'_>,
        stream: Stream,
        subject: &str,
        last: u64,
    ) -> Result<(), redb::Error> {
        let key = (stream, subject.to_owned());
        let Some(messages) = self.by_subject.get_mut(&key) else { return Ok(()) };
        let later = messages.split_off(&(last + 1));
        let removed = std::mem::replace(messages, later);
        if messages.is_empty() {
            self.by_subject.remove(&key);
        }
        let partition = Address::parse(subject).map_or(u32::MAX, |address| address.partition);
        for (sequence, message) in removed {
            self.by_partition.remove(&(stream, partition, sequence));
            if stream == Stream::Events {
                self.events.remove(&sequence);
            }
            self.ids.remove(message.id.as_deref().unwrap_or_default());
            tables.messages.remove((stream as u8, sequence))?;
        }
        Ok(())
    }
}

struct Tables<'t> {
    messages: Table<'t, (u8, u64), Parts>,
    numbers: Table<'t, &'static str, u64>,
}

fn message((_, sequence): (u8, u64), (subject, id, time, payload): (&str, &str, u64, &[u8])) -> Stored {
    let id = (!id.is_empty()).then(|| id.to_owned());
    Stored { sequence, subject: subject.to_owned(), id, time, payload: payload.to_owned() }
}

/// Creates missing tables, and reads all messages. Returns the number of partitions: for a new database `partitions` (at
/// least 1), otherwise the stored number. Returns `None` for a database with tables of another version.
fn read(database: &Database, partitions: u32) -> Result<Option<(u32, Messages)>, redb::Error> {
    let transaction = database.begin_write()?;
    let mut numbers = transaction.open_table(NUMBERS)?;
    let number = |name| Ok::<_, redb::Error>(numbers.get(name)?.map(|number| number.value()));
    let (stored, format) = (number("partitions")?, number("format")?);
    if stored.is_some() && format != Some(FORMAT) {
        return Ok(None);
    }
    let mut messages = Messages::default();
    for stream in Stream::ALL {
        messages.last[stream as usize] = number(stream.prefix())?.unwrap_or_default();
    }
    let partitions = stored.unwrap_or_else(|| u64::from(partitions.max(1)));
    numbers.insert("partitions", partitions)?;
    numbers.insert("format", FORMAT)?;
    drop(numbers);
    transaction.open_table(MESSAGES)?;
    transaction.commit()?;
    for entry in database.begin_read()?.open_table(MESSAGES)?.iter()? {
        let (key, value) = entry?;
        let stream = Stream::ALL[usize::from(key.value().0.min(1))];
        messages.insert(stream, message(key.value(), value.value()));
    }
    Ok(Some((partitions as u32, messages)))
}

/// Executes writes in one transaction. Readers see none of them before the transaction is on disk.
fn write(
    database: &Database,
    messages: &RwLock<Messages>,
    batch: &mut Vec<(Write, oneshot::Sender<Answer>)>,
) {
    let mut messages = messages.write().unwrap_or_else(PoisonError::into_inner);
    let failure = messages.failure.clone();
    let mut transact = || {
        let transaction = database.begin_write()?;
        let mut tables =
            Tables { messages: transaction.open_table(MESSAGES)?, numbers: transaction.open_table(NUMBERS)? };
        let answers = batch.iter().map(|(write, _)| messages.apply(&mut tables, write));
        let answers = answers.collect::<Result<Vec<_>, redb::Error>>()?;
        drop(tables);
        transaction.commit()?;
        Ok::<_, redb::Error>(answers)
    };
    let answers = match failure {
        Some(failure) => Err(failure),
        None => transact().map_err(|error| error.to_string()),
    };
    messages.failure = answers.as_ref().err().cloned();
    for (position, (_, done)) in batch.drain(..).enumerate() {
        let answer = match &answers {
            Ok(answers) => answers[position].clone(),
            Err(failure) => Err(failed(failure)),
        };
        // The requesting task may have been cancelled.
        let _ = done.send(answer);
    }
}

impl Store for Local {
    fn partitions(&self) -> u32 {
        self.0.partitions
    }

    fn lease(&self) -> Duration {
        self.0.lease
    }

    async fn follow(&self, stream: Stream, partition: u32, after: u64) -> Result<Subscription, Fault> {
        let state = (self.clone(), self.0.written.clone(), after);
        let next = move |(store, mut written, after): (Self, watch::Receiver<u64>, u64)| async move {
            loop {
                written.borrow_and_update();
                let range = (stream, partition, after + 1)..=(stream, partition, u64::MAX);
                let first = |messages: &Messages| {
                    messages
                        .by_partition
                        .range(range.clone())
                        .next()
                        .map(|(_, message)| Stored::clone(message))
                };
                match store.read(first) {
                    Ok(Some(message)) => {
                        let after = message.sequence;
                        return Some((Ok(message), (store, written, after)));
                    }
                    Ok(None) => written.changed().await.ok()?,
                    Err(fault) => return Some((Err(fault), (store, written, after))),
                }
            }
        };
        Ok(stream::unfold(state, next).boxed())
    }

    async fn end(&self, stream: Stream, partition: u32) -> Result<u64, Fault> {
        let range = (stream, partition, 0)..=(stream, partition, u64::MAX);
        self.read(|messages| messages.by_partition.range(range).next_back().map_or(0, |(key, _)| key.2))
    }

    async fn append(&self, stream: Stream, message: Message<'_>) -> Result<Receipt, Fault> {
        let Message { subject, id, after, payload } = message;
        let (subject, id, payload) = (subject.to_owned(), id.to_owned(), payload.to_owned());
        self.write(Write::Append { stream, subject, id, after, payload }).await
    }

    async fn discard(&self, subject: &str, last: u64) -> Result<(), Fault> {
        self.write(Write::Discard { subject: subject.to_owned(), last }).await.map(|_| ())
    }

    async fn last(&self, stream: Stream, subject: &str) -> Result<Option<Stored>, Fault> {
        self.read(|messages| {
            messages.of_subject(stream, subject).next_back().map(|message| Stored::clone(message))
        })
    }

    async fn event(&self, sequence: u64) -> Result<Option<Stored>, Fault> {
        self.read(|messages| messages.events.get(&sequence).map(|message| Stored::clone(message)))
    }

    async fn announce(&self, worker: &str, status: Option<&Presence>) -> Result<(), Fault> {
        let mut workers = self.0.workers.lock().unwrap_or_else(PoisonError::into_inner);
        workers.remove(worker);
        workers.extend(status.map(|status| (worker.to_owned(), (Instant::now(), status.clone()))));
        Ok(())
    }

    async fn workers(&self) -> Result<BTreeMap<String, Presence>, Fault> {
        let mut workers = self.0.workers.lock().unwrap_or_else(PoisonError::into_inner);
        workers.retain(|_, (at, _)| at.elapsed() <= self.0.lease);
        Ok(workers.iter().map(|(name, (_, status))| (name.clone(), status.clone())).collect())
    }

    async fn notice(&self, subject: &str, text: &str) {
        // There may be no subscriber.
        let _ = self.0.notices.send((subject.to_owned(), text.to_owned()));
    }
}
