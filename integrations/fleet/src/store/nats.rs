//! NATS JetStream as a log.
//!
//! The streams are called `FLEET-events` and `FLEET-decisions`, and there is a bucket for each [`Bucket`]. The subjects
//! of the default fleet `fleet` have no prefix (`ev.PARTITION.ROBOT`). Those of another fleet begin with its name
//! (`FLEET.ev.PARTITION.ROBOT`), so that several fleets can share the servers. An existing fleet keeps the subjects and
//! the number of replicas with which it was created.
//!
//! The last message of a subject and the message with a sequence number are read from the leader of the stream. Values
//! of a bucket may be read from a replica that lags behind; conditional writes then fail. Consumers may lag behind,
//! too, so a caller passes the sequence number up to which a consumer has to read.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use async_nats::jetstream::consumer::{AckPolicy, DeliverPolicy, pull};
use async_nats::jetstream::context::{Context, PublishError, PublishErrorKind};
use async_nats::jetstream::kv::{self, CreateErrorKind, Operation, UpdateErrorKind};
use async_nats::jetstream::message::{PublishMessage, StreamMessage};
use async_nats::jetstream::stream::{self, LastRawMessageErrorKind};
use async_nats::jetstream::{self};
use async_nats::{Client, ConnectErrorKind, ConnectOptions};
use futures::stream::BoxStream;
use futures::{StreamExt as _, TryStreamExt as _};
use metaplan::message::Message as Diagnostic;

use super::{Bucket, Entry, Fault, Message, Receipt, Store, Stored, Stream};
use crate::wire::is_name;

/// Settings for the connection to NATS servers.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// URLs of the servers, separated by commas: `nats://HOST:PORT`, `tls://HOST:PORT`.
    pub url: String,
    /// Path of a NATS credentials file with the user's JWT and seed.
    pub credentials: Option<PathBuf>,
    /// Name and password of the user.
    pub user: Option<(String, String)>,
    /// File with certificates of additional trusted authorities.
    pub authorities: Option<PathBuf>,
    /// Files with the client certificate and its key.
    pub certificate: Option<(PathBuf, PathBuf)>,
}

/// Parameters with which missing streams and buckets are created. Existing ones keep their own
/// partitions, replicas and lease.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Name of the fleet, with which the names of its streams and buckets begin: up to 64 letters, digits, `-` and
    /// `_`.
    pub fleet: String,
    /// Number of partitions, which never changes.
    pub partitions: u32,
    /// Number of replicas: 1, 3 or 5.
    pub replicas: usize,
    /// Time after which leases expire unless they are renewed.
    pub lease: Duration,
}

/// Name of the fleet whose subjects have no prefix.
pub const DEFAULT_FLEET: &str = "fleet";

const BATCH: usize = 500;

/// Timeout of a request to the server.
const PATIENCE: Duration = Duration::from_secs(5);

const PAUSE: Duration = Duration::from_millis(500);

/// Period during which a further message with the same id is discarded.
const WINDOW: Duration = Duration::from_secs(600);

/// The log of a fleet in NATS JetStream. Clones share the connection.
#[derive(Debug, Clone)]
pub struct Nats {
    client: Client,
    context: Context,
    partitions: u32,
    lease: Duration,
    fleet: String,
    /// First tokens of all subjects of the fleet: empty, or `FLEET.`.
    prefix: String,
    streams: [stream::Stream<()>; 2],
    buckets: [kv::Store; 4],
}

fn failed(error: impl std::fmt::Display) -> Fault {
    Fault::Unreachable(error.to_string())
}

enum OpenError {
    /// A stream with this name exists and was created by another program.
    ForeignStream(String),
    Store(Fault),
}

impl From<Fault> for OpenError {
    fn from(fault: Fault) -> Self {
        Self::Store(fault)
    }
}

/// Returns `true` if servers that have not finished starting can cause an error of this kind.
fn is_transient(kind: ConnectErrorKind) -> bool {
    match kind {
        ConnectErrorKind::Dns
        | ConnectErrorKind::TimedOut
        | ConnectErrorKind::Io
        | ConnectErrorKind::MaxReconnects => true,
        ConnectErrorKind::ServerParse
        | ConnectErrorKind::Authentication
        | ConnectErrorKind::AuthorizationViolation
        | ConnectErrorKind::Tls => false,
    }
}

async fn options(access: &Access) -> std::io::Result<ConnectOptions> {
    let mut options = ConnectOptions::new()
        .name("metaplan-fleet")
        .request_timeout(Some(PATIENCE))
        .connection_timeout(PATIENCE);
    if let Some(file) = &access.credentials {
        options = options.credentials_file(file).await?;
    }
    if let Some((user, password)) = access.user.clone() {
        options = options.user_and_password(user, password);
    }
    if let Some(file) = access.authorities.clone() {
        options = options.add_root_certificates(file);
    }
    if let Some((certificate, key)) = access.certificate.clone() {
        options = options.add_client_certificate(certificate, key);
    }
    Ok(options)
}

impl Nats {
    /// Connects to the servers, and creates missing streams and buckets.
    ///
    /// Servers that are started together with this program may still refuse connections or have no
    /// JetStream leader, so failures are retried for the duration `patience`, each with a warning.
    ///
    /// # Errors
    /// The name of the fleet is invalid, a file of `access` cannot be read, the servers refuse access, or a stream of
    /// this name does not belong to a fleet. After `patience`: no server can be reached, or it has no JetStream.
    pub async fn open(access: &Access, layout: &Layout, patience: Duration) -> Result<Self, Diagnostic> {
        let wrong =
            |error: &dyn std::fmt::Display| Diagnostic::error("N311", format!("{}: {error}", access.url));
        if !is_name(&layout.fleet) {
            let text = format!(
                "`{}` is not a name of a fleet: use up to 64 letters, digits, `-` and `_`",
                layout.fleet
            );
            return Err(wrong(&text));
        }
        let options = options(access).await.map_err(|error| wrong(&error))?;
        let urls: Vec<&str> = access.url.split(',').map(str::trim).collect();
        let deadline = Instant::now() + patience;
        loop {
            let failure = match async_nats::connect_with_options(urls.as_slice(), options.clone()).await {
                Ok(client) => {
                    let mut context = jetstream::new(client.clone());
                    context.set_timeout(PATIENCE);
                    match Self::with(client, context, layout).await {
                        Ok(store) => return Ok(store),
                        Err(OpenError::ForeignStream(name)) => {
                            return Err(wrong(&format_args!("the stream {name} is not one of a fleet")));
                        }
                        Err(OpenError::Store(fault)) => wrong(&fault),
                    }
                }
                Err(error) if is_transient(error.kind()) => wrong(&error),
                Err(error) => return Err(wrong(&error)),
            };
            if Instant::now() + PAUSE > deadline {
                return Err(failure);
            }
            tracing::warn!("the servers are not ready: {}", failure.message);
            tokio::time::sleep(PAUSE).await;
        }
    }

    async fn with(client: Client, context: Context, layout: &Layout) -> Result<Self, OpenError> {
        let prefix = subject_prefix(&layout.fleet);
        let config = |kind: Stream| stream::Config {
            name: stream_name(&layout.fleet, kind),
            subjects: vec![format!("{prefix}{}.*.*", kind.prefix())],
            num_replicas: layout.replicas,
            duplicate_window: WINDOW,
            // The number of partitions is stored in the description, so that all clients agree on
            // it.
            description: Some(format!("partitions={}", layout.partitions)),
            allow_direct: true,
            ..stream::Config::default()
        };
        let (mut partitions, mut prefix) = (layout.partitions, prefix.clone());
        for kind in Stream::ALL {
            let created = context.get_or_create_stream(config(kind)).await.map_err(failed)?;
            let existing = &created.cached_info().config;
            let layout_of = || {
                let partitions =
                    existing.description.as_deref()?.strip_prefix("partitions=")?.parse().ok()?;
                let prefix = existing.subjects.first()?.strip_suffix(&format!("{}.*.*", kind.prefix()))?;
                Some((partitions, prefix.to_owned()))
            };
            (partitions, prefix) =
                layout_of().ok_or_else(|| OpenError::ForeignStream(stream_name(&layout.fleet, kind)))?;
        }
        let mut buckets = Vec::new();
        for kind in Bucket::ALL {
            let bucket = format!("{}-{}", layout.fleet, kind.name());
            let config = kv::Config {
                bucket: bucket.clone(),
                num_replicas: layout.replicas,
                max_age: if kind.expires() { layout.lease } else { Duration::ZERO },
                ..kv::Config::default()
            };
            let existing = context.get_key_value(&bucket).await;
            buckets.push(match existing {
                Ok(store) => store,
                Err(_) => match context.create_key_value(config).await {
                    Ok(store) => store,
                    // Another client may have created the bucket in the meantime.
                    Err(_) => context.get_key_value(&bucket).await.map_err(failed)?,
                },
            });
        }
        let [events, decisions] = Stream::ALL.map(|kind| stream_name(&layout.fleet, kind));
        let streams = [
            context.get_stream_no_info(events).await.map_err(failed)?,
            context.get_stream_no_info(decisions).await.map_err(failed)?,
        ];
        // The lease time is that of the creation of the bucket, not of `layout`.
        let leases: &kv::Store = &buckets[Bucket::Leases as usize];
        let lease = leases.status().await.map_err(failed)?.max_age();
        let buckets = buckets.try_into().map_err(|_| failed("a bucket is missing"))?;
        Ok(Self { client, context, partitions, lease, fleet: layout.fleet.clone(), prefix, streams, buckets })
    }

    /// Returns the number of messages of a stream.
    ///
    /// # Errors
    /// The server cannot be reached.
    pub async fn count(&self, stream: Stream) -> Result<u64, Fault> {
        Ok(self.stream(stream).get_info().await.map_err(failed)?.state.messages)
    }

    /// Subscribes to notices about refused events and suspended robots: subject without `err.`
    /// (`PARTITION.ROBOT`), and reason.
    ///
    /// # Errors
    /// The server cannot be reached.
    pub async fn notices(&self) -> Result<BoxStream<'static, (String, String)>, Fault> {
        let prefix = format!("{}err.", self.prefix);
        let subscriber = self.client.subscribe(format!("{prefix}*.*")).await.map_err(failed)?;
        let refusals = subscriber.map(move |message| {
            let subject = message.subject.strip_prefix(&prefix).unwrap_or_default().to_owned();
            (subject, String::from_utf8_lossy(&message.payload).into_owned())
        });
        Ok(refusals.boxed())
    }

    /// Returns the subject of a stream with this end (`PARTITION.ROBOT`), which may have wildcards.
    fn subject(&self, stream: Stream, end: &str) -> String {
        format!("{}{}.{end}", self.prefix, stream.prefix())
    }

    fn stream(&self, stream: Stream) -> &stream::Stream<()> {
        &self.streams[stream as usize]
    }

    fn bucket(&self, bucket: Bucket) -> &kv::Store {
        &self.buckets[bucket as usize]
    }

    /// Reads the messages of a stream that match `filter`, beginning as `from` requires, as far as the extent states.
    /// Calls `take` with each message and its sequence number.
    async fn read(
        &self,
        name: &str,
        filter: String,
        from: DeliverPolicy,
        Extent { reach, most }: Extent,
        mut take: impl FnMut(jetstream::Message, u64),
    ) -> Result<(), Fault> {
        let config = pull::Config {
            filter_subject: filter,
            deliver_policy: from,
            ack_policy: AckPolicy::None,
            inactive_threshold: PATIENCE * 6,
            memory_storage: true,
            num_replicas: 1,
            ..pull::Config::default()
        };
        let consumer: jetstream::consumer::PullConsumer =
            self.context.create_consumer_on_stream(config, name).await.map_err(failed)?;
        let mut pending = consumer.cached_info().num_pending;
        let (mut last, mut expected, mut total) = (0, 1, 0);
        while (pending > 0 || last < reach) && total < most {
            let wanted = BATCH.min(most - total);
            let mut batch =
                consumer.fetch().max_messages(wanted).expires(PATIENCE).messages().await.map_err(failed)?;
            let mut got = 0;
            while let Some(message) = batch.try_next().await.map_err(failed)? {
                let (sequence, number, rest) = {
                    let info = message.info().map_err(failed)?;
                    (info.stream_sequence, info.consumer_sequence, info.pending)
                };
                if number != expected {
                    return Err(failed("messages were lost"));
                }
                expected += 1;
                got += 1;
                last = sequence;
                pending = rest;
                take(message, sequence);
            }
            total += got;
            if got == 0 {
                return Err(failed("the server lacks messages that it should have"));
            }
        }
        // The server would also remove an unused consumer by itself, but later.
        let _ = self.context.delete_consumer_from_stream(consumer.cached_info().name.as_str(), name).await;
        Ok(())
    }
}

/// Part of a stream to read: to the end, and at least to the sequence number `reach`, but at most `most` messages.
struct Extent {
    reach: u64,
    most: usize,
}

impl Extent {
    fn all(reach: u64) -> Self {
        Self { reach, most: usize::MAX }
    }
}

fn stream_name(fleet: &str, stream: Stream) -> String {
    match stream {
        Stream::Events => format!("{fleet}-events"),
        Stream::Decisions => format!("{fleet}-decisions"),
    }
}

fn subject_prefix(fleet: &str) -> String {
    if fleet == DEFAULT_FLEET { String::new() } else { format!("{fleet}.") }
}

fn stored(message: &jetstream::Message) -> Result<Stored, Fault> {
    let info = message.info().map_err(failed)?;
    let time = micros(info.published.unix_timestamp_nanos());
    let id = message.headers.as_ref().and_then(|headers| headers.get("Nats-Msg-Id"));
    Ok(Stored {
        sequence: info.stream_sequence,
        subject: tail(&message.subject),
        id: id.map(|id| id.as_str().to_owned()),
        time,
        payload: message.payload.to_vec(),
    })
}

fn raw(message: &StreamMessage) -> Stored {
    Stored {
        sequence: message.sequence,
        subject: tail(&message.subject),
        id: message.headers.get("Nats-Msg-Id").map(|id| id.as_str().to_owned()),
        time: micros(message.time.unix_timestamp_nanos()),
        payload: message.payload.to_vec(),
    }
}

/// Returns the last two tokens of a subject, `PARTITION.ROBOT`.
fn tail(subject: &str) -> String {
    let start = subject.rmatch_indices('.').nth(1).map_or(0, |(dot, _)| dot + 1);
    subject[start..].to_owned()
}

fn micros(nanos: i128) -> u64 {
    u64::try_from(nanos / 1000).unwrap_or_default()
}

fn published(error: &PublishError, bytes: usize) -> Fault {
    match error.kind() {
        PublishErrorKind::WrongLastSequence | PublishErrorKind::WrongLastMessageId => Fault::Conflict,
        PublishErrorKind::MaxPayloadExceeded => Fault::TooLong(bytes),
        _ => failed(error),
    }
}

impl Store for Nats {
    fn partitions(&self) -> u32 {
        self.partitions
    }

    fn lease(&self) -> Duration {
        self.lease
    }

    async fn follow(
        &self,
        kind: Stream,
        partition: u32,
        after: u64,
    ) -> Result<BoxStream<'static, Result<Stored, Fault>>, Fault> {
        let config = pull::OrderedConfig {
            filter_subject: self.subject(kind, &format!("{partition}.*")),
            deliver_policy: DeliverPolicy::ByStartSequence { start_sequence: after + 1 },
            ..pull::OrderedConfig::default()
        };
        let consumer = self.stream(kind).create_consumer(config).await.map_err(failed)?;
        let messages = consumer.messages().await.map_err(failed)?;
        Ok(messages.map(move |message| stored(&message.map_err(failed)?)).boxed())
    }

    async fn history(&self, kind: Stream, partition: u32, after: u64) -> Result<Vec<Stored>, Fault> {
        let filter = self.subject(kind, &format!("{partition}.*"));
        let reach = self.end(kind, partition).await?;
        if reach <= after {
            return Ok(Vec::new());
        }
        let mut messages = Vec::new();
        let from = DeliverPolicy::ByStartSequence { start_sequence: after + 1 };
        let name = stream_name(&self.fleet, kind);
        self.read(&name, filter, from, Extent::all(reach), |message, _| messages.push(stored(&message)))
            .await?;
        messages.into_iter().collect()
    }

    async fn of_subject(
        &self,
        kind: Stream,
        subject: &str,
        after: u64,
        most: usize,
    ) -> Result<Vec<Stored>, Fault> {
        let reach = self.last(kind, subject).await?.map_or(0, |last| last.sequence);
        if reach <= after {
            return Ok(Vec::new());
        }
        let mut messages = Vec::new();
        let from = DeliverPolicy::ByStartSequence { start_sequence: after + 1 };
        let (name, filter) = (stream_name(&self.fleet, kind), self.subject(kind, subject));
        let limits = Extent { reach, most };
        self.read(&name, filter, from, limits, |message, _| messages.push(stored(&message))).await?;
        messages.into_iter().collect()
    }

    async fn end(&self, kind: Stream, partition: u32) -> Result<u64, Fault> {
        let last = self.last(kind, &format!("{partition}.*")).await?;
        Ok(last.map_or(0, |last| last.sequence))
    }

    async fn append(&self, kind: Stream, message: Message<'_>) -> Result<Receipt, Fault> {
        let mut publish = PublishMessage::build().payload(message.payload.to_vec().into());
        if !message.id.is_empty() {
            publish = publish.message_id(message.id);
        }
        if let Some(after) = message.after {
            publish = publish.expected_last_subject_sequence(after);
        }
        let subject = self.subject(kind, message.subject);
        let bytes = message.payload.len();
        let ack = self
            .context
            .send_publish(subject, publish)
            .await
            .map_err(|error| published(&error, bytes))?
            .await
            .map_err(|error| published(&error, bytes))?;
        Ok(Receipt { sequence: ack.sequence, is_known: ack.duplicate })
    }

    async fn last(&self, kind: Stream, subject: &str) -> Result<Option<Stored>, Fault> {
        let name = self.subject(kind, subject);
        match self.stream(kind).get_last_raw_message_by_subject(&name).await {
            Ok(message) => Ok(Some(raw(&message))),
            Err(error) if matches!(error.kind(), LastRawMessageErrorKind::NoMessageFound) => Ok(None),
            Err(error) => Err(failed(error)),
        }
    }

    async fn at(&self, kind: Stream, sequence: u64) -> Result<Option<Stored>, Fault> {
        match self.stream(kind).get_raw_message(sequence).await {
            Ok(message) => Ok(Some(raw(&message))),
            Err(error) if matches!(error.kind(), LastRawMessageErrorKind::NoMessageFound) => Ok(None),
            Err(error) => Err(failed(error)),
        }
    }

    async fn get(&self, bucket: Bucket, key: &str) -> Result<Option<Entry>, Fault> {
        let found = self.bucket(bucket).entry(key).await.map_err(failed)?;
        Ok(found.filter(|entry| entry.operation == Operation::Put).map(|entry| Entry {
            key: key.to_owned(),
            value: entry.value.to_vec(),
            revision: entry.revision,
        }))
    }

    async fn put(&self, bucket: Bucket, key: &str, value: &[u8], after: u64) -> Result<u64, Fault> {
        let value = value.to_vec().into();
        if after == 0 {
            return self.bucket(bucket).create(key, value).await.map_err(|error| match error.kind() {
                CreateErrorKind::AlreadyExists => Fault::Conflict,
                _ => failed(error),
            });
        }
        self.bucket(bucket).update(key, value, after).await.map_err(|error| match error.kind() {
            UpdateErrorKind::WrongLastRevision => Fault::Conflict,
            _ => failed(error),
        })
    }

    async fn remove(&self, bucket: Bucket, key: &str, revision: u64) -> Result<(), Fault> {
        let removed = self.bucket(bucket).delete_expect_revision(key, Some(revision)).await;
        removed.map_err(|error| match error.kind() {
            UpdateErrorKind::WrongLastRevision => Fault::Conflict,
            _ => failed(error),
        })
    }

    async fn list(&self, bucket: Bucket, partition: Option<u32>, at_least: u64) -> Result<Vec<Entry>, Fault> {
        let name = format!("KV_{}-{}", self.fleet, bucket.name());
        let prefix = format!("$KV.{}-{}.", self.fleet, bucket.name());
        let filter =
            partition.map_or_else(|| format!("{prefix}>"), |partition| format!("{prefix}{partition}.*"));
        let mut entries = Vec::new();
        let extent = Extent::all(at_least);
        self.read(&name, filter, DeliverPolicy::LastPerSubject, extent, |message, revision| {
            let is_gone = message.headers.as_ref().is_some_and(|headers| {
                headers.get("KV-Operation").is_some() || headers.get("Nats-Marker-Reason").is_some()
            });
            if let Some(key) = message.subject.strip_prefix(&prefix).filter(|_| !is_gone) {
                entries.push(Entry { key: key.to_owned(), value: message.payload.to_vec(), revision });
            }
        })
        .await?;
        Ok(entries)
    }

    async fn notice(&self, subject: &str, text: &str) {
        // The message is not persistent, and there may be no subscriber.
        let _ = self.client.publish(format!("{}err.{subject}", self.prefix), text.to_owned().into()).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_default_fleet_has_subjects_without_prefix() {
        assert_eq!((subject_prefix("fleet").as_str(), subject_prefix("north").as_str()), ("", "north."));
        for subject in ["ev.3.ugv-1", "north.ev.3.ugv-1", "3.ugv-1"] {
            assert_eq!(tail(subject), "3.ugv-1");
        }
    }
}
