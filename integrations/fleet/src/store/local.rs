//! Log in a local directory, without a server and for a single process. All streams and buckets are
//! in one file.
//!
//! Concurrent writes are combined into one transaction of the database `redb`. The transaction is
//! on disk before the writes are acknowledged. Expired values are removed by the next write.

use std::collections::{HashMap, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use futures::stream::{self, BoxStream, StreamExt as _};
use metaplan::message::Message as Diagnostic;
use redb::{Database, ReadableDatabase as _, ReadableTable as _, Table, TableDefinition};
use tokio::sync::{broadcast, mpsc, oneshot, watch};

use super::{Bucket, Entry, Fault, Message, Receipt, Store, Stored, Stream};
use crate::wire::Address;

const FILE: &str = "fleet.redb";

/// Maximum number of writes in one transaction.
const BATCH: usize = 4096;

/// Maximum number of messages that a subscriber reads at once.
const PAGE: usize = 512;

/// Cache size of the database in bytes.
const CACHE: usize = 64 << 20;

/// Type of a stored message: (subject, id, time, payload). The key is (stream, sequence number).
type Parts = (&'static str, &'static str, u64, &'static [u8]);
const MESSAGES: TableDefinition<'static, (u8, u64), Parts> = TableDefinition::new("messages");
/// Index of messages by partition: (stream, partition, sequence number).
const OF_PARTITION: TableDefinition<'static, (u8, u32, u64), ()> = TableDefinition::new("of_partition");
/// Sequence number of the last message by (stream, subject).
const LAST: TableDefinition<'static, (u8, &str), u64> = TableDefinition::new("last");
/// Sequence number of a message by (stream, message id).
const IDS: TableDefinition<'static, (u8, &str), u64> = TableDefinition::new("ids");
/// Revision and value by (bucket, key).
const VALUES: TableDefinition<'static, (u8, &str), (u64, &[u8])> = TableDefinition::new("values");
/// Counters by name: the number of partitions, the last sequence number of each stream, and the
/// last revision.
const NUMBERS: TableDefinition<'static, &str, u64> = TableDefinition::new("numbers");

/// A log in a local directory. Clones share the database.
#[derive(Debug, Clone)]
pub struct Local(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    database: Arc<Database>,
    partitions: u32,
    lease: Duration,
    requests: mpsc::UnboundedSender<Request>,
    /// Number of transactions with appends, by which subscribers are notified.
    appended: watch::Receiver<u64>,
    notices: broadcast::Sender<(String, String)>,
}

struct Request {
    write: Write,
    done: oneshot::Sender<Answer>,
}

type Answer = Result<Receipt, Fault>;

enum Write {
    Append { stream: Stream, subject: String, id: String, after: Option<u64>, payload: Vec<u8> },
    Put { bucket: Bucket, key: String, value: Vec<u8>, after: u64 },
    Remove { bucket: Bucket, key: String, revision: u64 },
}

fn written(sequence: u64) -> Receipt {
    Receipt { sequence, is_known: false }
}

fn failed(error: impl std::fmt::Display) -> Fault {
    Fault::Unreachable(error.to_string())
}

impl Local {
    /// Opens or creates a log in a directory. `partitions` applies only on creation. Leases and
    /// statuses of workers expire unless they are renewed within `lease`.
    ///
    /// # Errors
    /// The directory cannot be used, or another process uses it.
    pub fn open(directory: &Path, partitions: u32, lease: Duration) -> Result<Self, Diagnostic> {
        let wrong = |error: &dyn std::fmt::Display| {
            Diagnostic::error("N310", format!("{}: {error}", directory.display()))
        };
        std::fs::create_dir_all(directory).map_err(|error| wrong(&error))?;
        let mut builder = Database::builder();
        builder.set_cache_size(CACHE);
        let database = builder.create(directory.join(FILE)).map_err(|error| wrong(&error))?;
        let partitions = prepare(&database, partitions).map_err(|error| wrong(&error))?;
        let database = Arc::new(database);
        let (requests, waiting) = mpsc::unbounded_channel();
        let (appending, appended) = watch::channel(0);
        let (notices, _) = broadcast::channel(1024);
        let writer = Writer { database: Arc::clone(&database), seen: HashMap::new(), lease };
        std::thread::Builder::new()
            .name("fleet-writer".to_owned())
            .spawn(move || writer.run(waiting, &appending))
            .map_err(|error| wrong(&error))?;
        Ok(Self(Arc::new(Inner { database, partitions, lease, requests, appended, notices })))
    }

    /// Subscribes to notices about refused events and suspended robots: subject (`PARTITION.ROBOT`)
    /// and reason.
    pub fn notices(&self) -> broadcast::Receiver<(String, String)> {
        self.0.notices.subscribe()
    }

    async fn write(&self, write: Write) -> Answer {
        let (done, answer) = oneshot::channel();
        self.0.requests.send(Request { write, done }).map_err(failed)?;
        answer.await.map_err(failed)?
    }

    fn page(&self, stream: Stream, partition: u32, after: u64, most: usize) -> Result<Vec<Stored>, Fault> {
        let (number, transaction) = (stream as u8, self.0.database.begin_read().map_err(failed)?);
        let of_partition = transaction.open_table(OF_PARTITION).map_err(failed)?;
        let messages = transaction.open_table(MESSAGES).map_err(failed)?;
        let range = (number, partition, after + 1)..=(number, partition, u64::MAX);
        let mut found = Vec::new();
        for entry in of_partition.range(range).map_err(failed)?.take(most) {
            let sequence = entry.map_err(failed)?.0.value().2;
            found.extend(message(&messages, number, sequence)?);
        }
        Ok(found)
    }
}

fn message(
    messages: &impl redb::ReadableTable<(u8, u64), Parts>,
    stream: u8,
    sequence: u64,
) -> Result<Option<Stored>, Fault> {
    let entry = messages.get((stream, sequence)).map_err(failed)?;
    Ok(entry.map(|value| {
        let (subject, id, time, payload) = value.value();
        let id = (!id.is_empty()).then(|| id.to_owned());
        Stored { sequence, subject: subject.to_owned(), id, time, payload: payload.to_owned() }
    }))
}

/// Creates missing tables, and removes the leases and statuses of workers of earlier processes.
/// Returns the number of partitions: for a new database `partitions` (at least 1), otherwise the
/// stored number.
fn prepare(database: &Database, partitions: u32) -> Result<u32, redb::Error> {
    let transaction = database.begin_write()?;
    transaction.open_table(MESSAGES)?;
    transaction.open_table(OF_PARTITION)?;
    transaction.open_table(LAST)?;
    transaction.open_table(IDS)?;
    let known = {
        let mut values = transaction.open_table(VALUES)?;
        // Only one process uses the file at a time, so leases and statuses of earlier processes are
        // invalid.
        for bucket in Bucket::ALL.into_iter().filter(|bucket| bucket.expires()) {
            values.retain_in((bucket as u8, "")..(bucket as u8 + 1, ""), |_, _| false)?;
        }
        let mut numbers = transaction.open_table(NUMBERS)?;
        let known = numbers.get("partitions")?.map(|known| known.value());
        let known = known.unwrap_or_else(|| u64::from(partitions.max(1)));
        numbers.insert("partitions", known)?;
        known as u32
    };
    transaction.commit()?;
    Ok(known)
}

struct Writer {
    database: Arc<Database>,
    /// Time of the last write of each value that expires.
    seen: HashMap<(Bucket, String), Instant>,
    lease: Duration,
}

impl Writer {
    fn run(mut self, mut waiting: mpsc::UnboundedReceiver<Request>, appended: &watch::Sender<u64>) {
        let mut batch = Vec::new();
        while waiting.blocking_recv_many(&mut batch, BATCH) > 0 {
            let outcome = self.transaction(&batch);
            let mut last = 0;
            for (position, request) in batch.drain(..).enumerate() {
                let answer = match &outcome {
                    Ok(answers) => answers[position].clone(),
                    Err(error) => Err(failed(error)),
                };
                if let (Write::Append { .. }, Ok(receipt)) = (&request.write, &answer) {
                    last = last.max(receipt.sequence);
                }
                // The requesting task may have been cancelled.
                let _ = request.done.send(answer);
            }
            if last > 0 {
                appended.send_modify(|count| *count += 1);
            }
        }
    }

    fn transaction(&mut self, batch: &[Request]) -> Result<Vec<Answer>, redb::Error> {
        let transaction = self.database.begin_write()?;
        let mut answers = Vec::with_capacity(batch.len());
        {
            let mut tables = Tables {
                messages: transaction.open_table(MESSAGES)?,
                of_partition: transaction.open_table(OF_PARTITION)?,
                last: transaction.open_table(LAST)?,
                ids: transaction.open_table(IDS)?,
                values: transaction.open_table(VALUES)?,
                numbers: transaction.open_table(NUMBERS)?,
            };
            self.expire(&mut tables)?;
            for request in batch {
                answers.push(self.apply(&mut tables, &request.write)?);
            }
        }
        transaction.commit()?;
        Ok(answers)
    }

    fn expire(&mut self, tables: &mut Tables<'_>) -> Result<(), redb::Error> {
        let expired: Vec<(Bucket, String)> = self
            .seen
            .iter()
            .filter(|(_, at)| at.elapsed() > self.lease)
            .map(|(key, _)| key.clone())
            .collect();
        for key in expired {
            tables.values.remove((key.0 as u8, key.1.as_str()))?;
            self.seen.remove(&key);
        }
        Ok(())
    }

    fn apply(&mut self, tables: &mut Tables<'_>, write: &Write) -> Result<Answer, redb::Error> {
        match write {
            Write::Append { stream, subject, id, after, payload } => {
                tables.append(*stream as u8, subject, id, *after, payload)
            }
            Write::Put { bucket, key, value, after } => {
                if tables.revision(*bucket, key)? != *after {
                    return Ok(Err(Fault::Conflict));
                }
                let revision = tables.next("revision")?;
                tables.values.insert((*bucket as u8, key.as_str()), (revision, value.as_slice()))?;
                if bucket.expires() {
                    self.seen.insert((*bucket, key.clone()), Instant::now());
                }
                Ok(Ok(written(revision)))
            }
            Write::Remove { bucket, key, revision } => {
                if tables.revision(*bucket, key)? != *revision {
                    return Ok(Err(Fault::Conflict));
                }
                tables.values.remove((*bucket as u8, key.as_str()))?;
                self.seen.remove(&(*bucket, key.clone()));
                Ok(Ok(written(*revision)))
            }
        }
    }
}

struct Tables<'t> {
    messages: Table<'t, (u8, u64), Parts>,
    of_partition: Table<'t, (u8, u32, u64), ()>,
    last: Table<'t, (u8, &'static str), u64>,
    ids: Table<'t, (u8, &'static str), u64>,
    values: Table<'t, (u8, &'static str), (u64, &'static [u8])>,
    numbers: Table<'t, &'static str, u64>,
}

impl Tables<'_> {
    fn next(&mut self, name: &str) -> Result<u64, redb::Error> {
        let next = self.numbers.get(name)?.map_or(0, |last| last.value()) + 1;
        self.numbers.insert(name, next)?;
        Ok(next)
    }

    fn revision(&self, bucket: Bucket, key: &str) -> Result<u64, redb::Error> {
        Ok(self.values.get((bucket as u8, key))?.map_or(0, |entry| entry.value().0))
    }

    fn append(
        &mut self,
        stream: u8,
        subject: &str,
        id: &str,
        after: Option<u64>,
        payload: &[u8],
    ) -> Result<Answer, redb::Error> {
        if let Some(known) = self.ids.get((stream, id))?
            && !id.is_empty()
        {
            return Ok(Ok(Receipt { sequence: known.value(), is_known: true }));
        }
        let last = self.last.get((stream, subject))?.map_or(0, |last| last.value());
        if after.is_some_and(|after| after != last) {
            return Ok(Err(Fault::Conflict));
        }
        let sequence = self.next(if stream == Stream::Events as u8 { "events" } else { "decisions" })?;
        let time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let time = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        self.messages.insert((stream, sequence), (subject, id, time, payload))?;
        if let Some(address) = Address::parse(subject) {
            self.of_partition.insert((stream, address.partition, sequence), ())?;
        }
        self.last.insert((stream, subject), sequence)?;
        if !id.is_empty() {
            self.ids.insert((stream, id), sequence)?;
        }
        Ok(Ok(written(sequence)))
    }
}

struct Reader {
    store: Local,
    stream: Stream,
    partition: u32,
    after: u64,
    page: VecDeque<Stored>,
    appended: watch::Receiver<u64>,
}

impl Reader {
    async fn next(mut self) -> Option<(Result<Stored, Fault>, Self)> {
        loop {
            if let Some(message) = self.page.pop_front() {
                self.after = message.sequence;
                return Some((Ok(message), self));
            }
            self.appended.borrow_and_update();
            match self.store.page(self.stream, self.partition, self.after, PAGE) {
                Ok(page) if page.is_empty() => self.appended.changed().await.ok()?,
                Ok(page) => self.page = page.into(),
                Err(fault) => return Some((Err(fault), self)),
            }
        }
    }
}

impl Store for Local {
    fn partitions(&self) -> u32 {
        self.0.partitions
    }

    fn lease(&self) -> Duration {
        self.0.lease
    }

    async fn follow(
        &self,
        stream: Stream,
        partition: u32,
        after: u64,
    ) -> Result<BoxStream<'static, Result<Stored, Fault>>, Fault> {
        let appended = self.0.appended.clone();
        let reader =
            Reader { store: self.clone(), stream, partition, after, page: VecDeque::new(), appended };
        Ok(stream::unfold(reader, Reader::next).boxed())
    }

    async fn history(&self, stream: Stream, partition: u32, after: u64) -> Result<Vec<Stored>, Fault> {
        self.page(stream, partition, after, usize::MAX)
    }

    async fn of_subject(
        &self,
        stream: Stream,
        subject: &str,
        after: u64,
        most: usize,
    ) -> Result<Vec<Stored>, Fault> {
        let partition = Address::parse(subject).map_or(0, |address| address.partition);
        let (number, transaction) = (stream as u8, self.0.database.begin_read().map_err(failed)?);
        let of_partition = transaction.open_table(OF_PARTITION).map_err(failed)?;
        let messages = transaction.open_table(MESSAGES).map_err(failed)?;
        let mut found = Vec::new();
        for entry in of_partition
            .range((number, partition, after + 1)..=(number, partition, u64::MAX))
            .map_err(failed)?
        {
            let message = message(&messages, number, entry.map_err(failed)?.0.value().2)?;
            found.extend(message.filter(|message| message.subject == subject));
            if found.len() >= most {
                break;
            }
        }
        Ok(found)
    }

    async fn end(&self, stream: Stream, partition: u32) -> Result<u64, Fault> {
        let transaction = self.0.database.begin_read().map_err(failed)?;
        let of_partition = transaction.open_table(OF_PARTITION).map_err(failed)?;
        let range = (stream as u8, partition, 0)..=(stream as u8, partition, u64::MAX);
        let last = of_partition.range(range).map_err(failed)?.next_back().transpose().map_err(failed)?;
        Ok(last.map_or(0, |(key, _)| key.value().2))
    }

    async fn append(&self, stream: Stream, message: Message<'_>) -> Result<Receipt, Fault> {
        let Message { subject, id, after, payload } = message;
        let (subject, id, payload) = (subject.to_owned(), id.to_owned(), payload.to_owned());
        self.write(Write::Append { stream, subject, id, after, payload }).await
    }

    async fn last(&self, stream: Stream, subject: &str) -> Result<Option<Stored>, Fault> {
        let transaction = self.0.database.begin_read().map_err(failed)?;
        let last = transaction.open_table(LAST).map_err(failed)?;
        let Some(sequence) = last.get((stream as u8, subject)).map_err(failed)? else { return Ok(None) };
        message(&transaction.open_table(MESSAGES).map_err(failed)?, stream as u8, sequence.value())
    }

    async fn at(&self, stream: Stream, sequence: u64) -> Result<Option<Stored>, Fault> {
        let transaction = self.0.database.begin_read().map_err(failed)?;
        message(&transaction.open_table(MESSAGES).map_err(failed)?, stream as u8, sequence)
    }

    async fn get(&self, bucket: Bucket, key: &str) -> Result<Option<Entry>, Fault> {
        let transaction = self.0.database.begin_read().map_err(failed)?;
        let values = transaction.open_table(VALUES).map_err(failed)?;
        let stored = values.get((bucket as u8, key)).map_err(failed)?;
        Ok(stored.map(|stored| {
            let (revision, value) = stored.value();
            Entry { key: key.to_owned(), value: value.to_owned(), revision }
        }))
    }

    async fn put(&self, bucket: Bucket, key: &str, value: &[u8], after: u64) -> Result<u64, Fault> {
        self.write(Write::Put { bucket, key: key.to_owned(), value: value.to_owned(), after })
            .await
            .map(|own| own.sequence)
    }

    async fn remove(&self, bucket: Bucket, key: &str, revision: u64) -> Result<(), Fault> {
        self.write(Write::Remove { bucket, key: key.to_owned(), revision }).await.map(|_| ())
    }

    async fn list(&self, bucket: Bucket, partition: Option<u32>, _: u64) -> Result<Vec<Entry>, Fault> {
        let prefix = partition.map(|partition| format!("{partition}.")).unwrap_or_default();
        let transaction = self.0.database.begin_read().map_err(failed)?;
        let values = transaction.open_table(VALUES).map_err(failed)?;
        let mut entries = Vec::new();
        for entry in values.range((bucket as u8, prefix.as_str())..).map_err(failed)? {
            let (key, value) = entry.map_err(failed)?;
            let (own, name) = key.value();
            if own != bucket as u8 || !name.starts_with(&prefix) {
                break;
            }
            let (revision, value) = value.value();
            entries.push(Entry { key: name.to_owned(), value: value.to_owned(), revision });
        }
        Ok(entries)
    }

    async fn notice(&self, subject: &str, text: &str) {
        // There may be no subscriber.
        let _ = self.0.notices.send((subject.to_owned(), text.to_owned()));
    }
}
