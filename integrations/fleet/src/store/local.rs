//! Log in a local directory, without a server and for a single process.
//!
//! The messages are in a database `redb`. Concurrent writes are combined into one transaction, which is on disk before the
//! writes are acknowledged and become visible.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use futures::stream::{self, StreamExt as _};
use metaplan::message::Message as Diagnostic;
use redb::{
    Database, ReadTransaction, ReadableDatabase as _, ReadableTable, Table, TableDefinition, WriteTransaction,
};
use tokio::sync::{broadcast, mpsc, oneshot, watch};

use super::{Fault, Message, Receipt, Store, Stored, Stream, Subscription, failed};
use crate::wire::{Address, Presence};

const FILE: &str = "fleet.redb";

/// Version of the tables.
const FORMAT: u64 = 3;

/// Maximum number of writes in one transaction.
const BATCH: usize = 4096;

/// Stream, subject and sequence number of a message.
type Key = (u8, &'static str, u64);
/// Id, time and payload of a message.
type Parts = (&'static str, u64, &'static [u8]);
const MESSAGES: TableDefinition<'static, Key, Parts> = TableDefinition::new("messages");
/// Subjects by stream, partition and sequence number. Messages without an address have the partition [`u32::MAX`].
const ORDER: TableDefinition<'static, (u8, u32, u64), &str> = TableDefinition::new("order");
/// Sequence numbers of events by message id.
const IDS: TableDefinition<'static, &str, u64> = TableDefinition::new("ids");
/// Counters by name: the version of the tables, the number of partitions, and the last sequence number of each
/// stream.
const NUMBERS: TableDefinition<'static, &str, u64> = TableDefinition::new("numbers");

/// A log in a local directory. Clones share the database.
#[derive(Debug, Clone)]
pub struct Local(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    database: Arc<Database>,
    /// Reason why a transaction could not be written. The database is then not used any longer. Without this rule, pages in
    /// memory could still be read, so that readers would wait without end for further messages.
    failure: Arc<OnceLock<Fault>>,
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
        let partitions = prepare(&database, partitions)
            .map_err(|error| wrong(&error))?
            .ok_or_else(|| wrong(&"the fleet was created by an earlier version: use another directory"))?;
        let database = Arc::new(database);
        let (requests, mut waiting) = mpsc::unbounded_channel();
        let (writing, written) = watch::channel(0);
        let (notices, _) = broadcast::channel(1024);
        let failure = Arc::<OnceLock<Fault>>::default();
        let (writer, write_failure) = (Arc::clone(&database), Arc::clone(&failure));
        let write_all = move || {
            let mut batch = Vec::new();
            while waiting.blocking_recv_many(&mut batch, BATCH) > 0 {
                write(&writer, &write_failure, history.max(1), &mut batch);
                writing.send_modify(|count| *count += 1);
            }
        };
        std::thread::Builder::new()
            .name("fleet-writer".to_owned())
            .spawn(write_all)
            .map_err(|error| wrong(&error))?;
        let workers = Mutex::default();
        Ok(Self(Arc::new(Inner {
            database,
            failure,
            partitions,
            lease,
            requests,
            written,
            notices,
            workers,
        })))
    }

    /// Subscribes to notices about refused events and suspended robots: subject (`PARTITION.ROBOT`)
    /// and reason.
    pub fn notices(&self) -> broadcast::Receiver<(String, String)> {
        self.0.notices.subscribe()
    }

    /// Waits until a transaction cannot be written. The log is then not usable any longer. Returns the reason.
    pub async fn failure(&self) -> Fault {
        let mut written = self.0.written.clone();
        loop {
            if let Some(fault) = self.0.failure.get() {
                return fault.clone();
            }
            if let Err(error) = written.changed().await {
                return Fault::Failed(error.to_string());
            }
        }
    }

    async fn write(&self, write: Write) -> Answer {
        let (done, answer) = oneshot::channel();
        self.0.requests.send((write, done)).map_err(failed)?;
        answer.await.map_err(failed)?
    }

    fn read<T>(&self, read: impl FnOnce(&ReadTransaction) -> Result<T, redb::Error>) -> Result<T, Fault> {
        if let Some(fault) = self.0.failure.get() {
            return Err(fault.clone());
        }
        self.0.database.begin_read().map_err(redb::Error::from).and_then(|view| read(&view)).map_err(failed)
    }
}

/// Creates missing tables. Returns the number of partitions: for a new database `partitions` (at least 1), otherwise the
/// stored number. Returns `None` for a database with tables of another version.
fn prepare(database: &Database, partitions: u32) -> Result<Option<u32>, redb::Error> {
    let transaction = database.begin_write()?;
    let mut numbers = transaction.open_table(NUMBERS)?;
    let number = |name| Ok::<_, redb::Error>(numbers.get(name)?.map(|number| number.value()));
    let (stored, format) = (number("partitions")?, number("format")?);
    if stored.is_some() && format != Some(FORMAT) {
        return Ok(None);
    }
    let partitions = stored.unwrap_or_else(|| u64::from(partitions.max(1)));
    numbers.insert("partitions", partitions)?;
    numbers.insert("format", FORMAT)?;
    drop(numbers);
    drop(Tables::open(&transaction)?);
    transaction.commit()?;
    Ok(Some(partitions as u32))
}

/// Executes writes in one transaction.
fn write(
    database: &Database,
    failure: &OnceLock<Fault>,
    history: usize,
    batch: &mut Vec<(Write, oneshot::Sender<Answer>)>,
) {
    let transact = || {
        let transaction = database.begin_write()?;
        let mut tables = Tables::open(&transaction)?;
        let answers = batch.iter().map(|(write, _)| tables.apply(write, history));
        let answers = answers.collect::<Result<Vec<_>, redb::Error>>()?;
        drop(tables);
        transaction.commit()?;
        Ok::<_, redb::Error>(answers)
    };
    let transact = || transact().map_err(|error| Fault::Failed(error.to_string()));
    let answers = failure.get().map_or_else(transact, |fault| Err(fault.clone()));
    if let Err(fault) = &answers {
        // The first reason is kept.
        let _ = failure.set(fault.clone());
    }
    for (position, (_, done)) in batch.drain(..).enumerate() {
        let answer = answers.as_ref().map_err(Clone::clone).and_then(|answers| answers[position].clone());
        // The requesting task may have been cancelled.
        let _ = done.send(answer);
    }
}

struct Tables<'t> {
    messages: Table<'t, Key, Parts>,
    order: Table<'t, (u8, u32, u64), &'static str>,
    ids: Table<'t, &'static str, u64>,
    numbers: Table<'t, &'static str, u64>,
}

impl<'t> Tables<'t> {
    fn open(transaction: &'t WriteTransaction) -> Result<Self, redb::Error> {
        Ok(Self {
            messages: transaction.open_table(MESSAGES)?,
            order: transaction.open_table(ORDER)?,
            ids: transaction.open_table(IDS)?,
            numbers: transaction.open_table(NUMBERS)?,
        })
    }

    fn apply(&mut self, write: &Write, history: usize) -> Result<Answer, redb::Error> {
        let (stream, subject, id, after, payload) = match write {
            Write::Append { stream, subject, id, after, payload } => (*stream, subject, id, after, payload),
            Write::Discard { subject, last } => {
                self.remove(Stream::Events, subject, *last)?;
                return Ok(Ok(Receipt { sequence: *last, is_known: true }));
            }
        };
        if let Some(sequence) = self.ids.get(id.as_str())? {
            return Ok(Ok(Receipt { sequence: sequence.value(), is_known: true }));
        }
        let last = of_subject(&self.messages, stream, subject, 0..=u64::MAX)?.next_back().transpose()?;
        if after.is_some_and(|after| after != last.map_or(0, |last| last.sequence)) {
            return Ok(Err(Fault::Conflict));
        }
        let sequence = self.numbers.get(stream.prefix())?.map_or(1, |last| last.value() + 1);
        self.numbers.insert(stream.prefix(), sequence)?;
        if stream == Stream::Events && !id.is_empty() {
            self.ids.insert(id.as_str(), sequence)?;
        }
        let time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let time = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        let parts = (id.as_str(), time, payload.as_slice());
        self.messages.insert((stream as u8, subject.as_str(), sequence), parts)?;
        self.order.insert((stream as u8, partition(subject), sequence), subject.as_str())?;
        let obsolete =
            of_subject(&self.messages, Stream::Decisions, subject, 0..=u64::MAX)?.rev().nth(history);
        if let Some(obsolete) = obsolete.transpose()? {
            self.remove(Stream::Decisions, subject, obsolete.sequence)?;
        }
        Ok(Ok(Receipt { sequence, is_known: false }))
    }

    /// Removes the messages of a subject up to and including the sequence number `last`.
    fn remove(&mut self, stream: Stream, subject: &str, last: u64) -> Result<(), redb::Error> {
        let messages: Vec<_> =
            of_subject(&self.messages, stream, subject, 0..=last)?.collect::<Result<_, _>>()?;
        for Stored { sequence, id, .. } in messages {
            self.messages.remove((stream as u8, subject, sequence))?;
            self.order.remove((stream as u8, partition(subject), sequence))?;
            self.ids.remove(id.unwrap_or_default().as_str())?;
        }
        Ok(())
    }
}

/// Returns the messages of a subject with sequence numbers in a range.
fn of_subject(
    messages: &impl ReadableTable<Key, Parts>,
    stream: Stream,
    subject: &str,
    range: RangeInclusive<u64>,
) -> Result<impl DoubleEndedIterator<Item = Result<Stored, redb::Error>>, redb::Error> {
    let range = (stream as u8, subject, *range.start())..=(stream as u8, subject, *range.end());
    Ok(messages.range(range)?.map(|entry| {
        let (key, value) = entry?;
        let ((_, subject, sequence), (id, time, payload)) = (key.value(), value.value());
        let id = (!id.is_empty()).then(|| id.to_owned());
        Ok(Stored { sequence, subject: subject.to_owned(), id, time, payload: payload.to_owned() })
    }))
}

fn partition(subject: &str) -> u32 {
    Address::parse(subject).map_or(u32::MAX, |address| address.partition)
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
        let messages = stream::try_unfold(state, move |(store, mut written, after)| async move {
            loop {
                written.borrow_and_update();
                let range = (stream as u8, partition, after + 1)..=(stream as u8, partition, u64::MAX);
                let first = store.read(|view| {
                    let Some(entry) = view.open_table(ORDER)?.range(range)?.next() else { return Ok(None) };
                    let (key, subject) = entry?;
                    let messages = view.open_table(MESSAGES)?;
                    of_subject(&messages, stream, subject.value(), key.value().2..=u64::MAX)?
                        .next()
                        .transpose()
                })?;
                if let Some(message) = first {
                    let after = message.sequence;
                    return Ok(Some((message, (store, written, after))));
                }
                written.changed().await.map_err(failed)?;
            }
        });
        Ok(messages.boxed())
    }

    async fn end(&self, stream: Stream, partition: u32) -> Result<u64, Fault> {
        let range = (stream as u8, partition, 0)..=(stream as u8, partition, u64::MAX);
        self.read(|view| {
            let last = view.open_table(ORDER)?.range(range)?.next_back().transpose()?;
            Ok(last.map_or(0, |(key, _)| key.value().2))
        })
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
        self.read(|view| {
            of_subject(&view.open_table(MESSAGES)?, stream, subject, 0..=u64::MAX)?.next_back().transpose()
        })
    }

    async fn next(&self, subject: &str, start: u64) -> Result<Option<Stored>, Fault> {
        self.read(|view| {
            of_subject(&view.open_table(MESSAGES)?, Stream::Events, subject, start..=u64::MAX)?
                .next()
                .transpose()
        })
    }

    async fn announce(&self, worker: &str, status: Option<&Presence>) -> Result<(), Fault> {
        if let Some(fault) = self.0.failure.get() {
            return Err(fault.clone());
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robots::Sender;

    #[tokio::test]
    async fn a_log_is_not_used_after_a_failed_transaction() {
        let folder = tempfile::tempdir().expect("a directory");
        let store = Local::open(folder.path(), 1, 8, Duration::from_secs(1))
            .unwrap_or_else(|message| panic!("{message}"));
        let fault = Fault::Failed("no space left on device".to_owned());
        store.0.failure.set(fault.clone()).expect("there is no other failure");
        let message = Message { subject: "0.r", id: "", after: None, payload: b"x" };
        assert_eq!(store.append(Stream::Events, message).await, Err(fault.clone()));
        assert_eq!(store.end(Stream::Events, 0).await, Err(fault.clone()));
        // Otherwise the worker would be ready.
        assert_eq!(store.announce("w", Some(&Presence::default())).await, Err(fault.clone()));
        assert_eq!(Sender::new(store.clone(), "r", "").send("{}").await, Err(fault.clone()));
        assert_eq!(store.failure().await, fault);
    }
}
