//! NATS JetStream as a log.
//!
//! The streams are called `FLEET-events` and `FLEET-decisions`, and the bucket `FLEET-workers` has the status of the
//! workers, whose entries expire. The subjects of the default fleet `fleet` have no prefix (`ev.PARTITION.ROBOT`). Those
//! of another fleet begin with its name (`FLEET.ev.PARTITION.ROBOT`), so that several fleets can share the servers. An
//! existing fleet keeps the settings with which it was created.
//!
//! The last message of a subject and the message with a sequence number are read from the leader of the stream.
//! Consumers may read from a replica that lags behind.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use async_nats::jetstream::consumer::{DeliverPolicy, pull};
use async_nats::jetstream::context::{Context, PublishError, PublishErrorKind};
use async_nats::jetstream::kv;
use async_nats::jetstream::message::{PublishMessage, StreamMessage};
use async_nats::jetstream::stream::{self, LastRawMessageError, LastRawMessageErrorKind};
use async_nats::jetstream::{self};
use async_nats::{Client, ConnectErrorKind, ConnectOptions, HeaderMap};
use futures::{StreamExt as _, TryStreamExt as _};
use metaplan::message::Message as Diagnostic;

use super::{Fault, Message, Receipt, Store, Stored, Stream, Subscription, failed};
use crate::wire::{Presence, is_name};

/// Settings for the connection to NATS servers, which are also options of the program.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Access {
    /// Connect to these servers: `nats://HOST:PORT` or `tls://HOST:PORT`, separated by commas.
    #[arg(long = "nats", value_name = "URL", env = "NATS_URL")]
    pub url: String,
    /// Authenticate with a credentials file of NATS.
    #[arg(long = "creds", value_name = "FILE")]
    pub credentials: Option<PathBuf>,
    /// Authenticate as this user, with the password in the environment variable `NATS_PASSWORD`.
    #[arg(long, value_name = "NAME")]
    pub user: Option<String>,
    /// Password of the user.
    #[arg(skip = std::env::var("NATS_PASSWORD").unwrap_or_default())]
    pub password: String,
    /// Trust only the certificate authorities in this file, instead of those of the system.
    #[arg(long, value_name = "FILE")]
    pub tls_ca: Option<PathBuf>,
    /// Authenticate with the client certificate in the first file and its key in the second file.
    #[arg(long, value_names = ["CERTIFICATE", "KEY"], num_args = 2)]
    pub tls_cert: Vec<PathBuf>,
}

/// Name of the fleet, and the parameters with which it is created if it is missing. An existing
/// fleet keeps its own parameters.
#[derive(Debug, Clone, clap::Args)]
pub struct Layout {
    /// Set the name of the fleet. Its streams, buckets and subjects begin with this name, except for subjects of the fleet `fleet`.
    #[arg(long, value_name = "NAME", default_value = DEFAULT_FLEET)]
    pub fleet: String,
    /// Set the number of partitions if the fleet is created. It cannot be changed later.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub partitions: u32,
    /// Set the number of servers that store the data (1, 3 or 5) if the fleet is created.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub replicas: usize,
    /// Keep this number of decisions of each robot, if the fleet is created.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(i64).range(1..))]
    pub history: i64,
    /// Set the lease time if the fleet is created: the seconds after which a worker that publishes no
    /// status loses its partitions.
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = clap::value_parser!(u64).range(2..=3600))]
    pub lease: u64,
}

/// Name of the fleet whose subjects have no prefix.
pub const DEFAULT_FLEET: &str = "fleet";

/// Start of the descriptions of the streams, with the version of the data format.
const DESCRIPTION: &str = "format=2 partitions=";

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
    /// First tokens of all subjects of the fleet: empty, or `FLEET.`.
    prefix: String,
    streams: Vec<stream::Stream>,
    workers: kv::Store,
}

/// Returns `true` if servers that have not finished starting can cause an error of this kind.
fn is_transient(kind: ConnectErrorKind) -> bool {
    use ConnectErrorKind::{Dns, Io, MaxReconnects, TimedOut};
    matches!(kind, Dns | TimedOut | Io | MaxReconnects)
}

async fn options(access: &Access) -> std::io::Result<ConnectOptions> {
    let mut options = ConnectOptions::new()
        .name("metaplan-fleet")
        .request_timeout(Some(PATIENCE))
        .connection_timeout(PATIENCE);
    if let Some(file) = &access.credentials {
        options = options.credentials_file(file).await?;
    }
    if let Some(user) = access.user.clone() {
        options = options.user_and_password(user, access.password.clone());
    }
    if let Some(file) = access.tls_ca.clone() {
        options = options.add_root_certificates(file);
    }
    if let [certificate, key] = access.tls_cert.as_slice() {
        options = options.add_client_certificate(certificate.clone(), key.clone());
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
    /// this name does not belong to a fleet. After `patience`: no server can be reached, it has no JetStream, or it
    /// cannot create the streams, for example because it has fewer servers than replicas.
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
                Ok(client) => match Self::with(client, layout).await {
                    Ok(Ok(store)) => return Ok(store),
                    Ok(Err(name)) => {
                        let text = format!("the stream {name} is not one of a fleet of this version");
                        return Err(wrong(&text));
                    }
                    Err(fault) => wrong(&fault),
                },
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

    /// Opens the streams and the bucket, and creates missing ones. Returns the name of an existing stream that is not one
    /// of a fleet of this version.
    async fn with(client: Client, layout: &Layout) -> Result<Result<Self, String>, Fault> {
        let mut context = jetstream::new(client.clone());
        context.set_timeout(PATIENCE);
        let (mut partitions, mut prefix) = (layout.partitions, subject_prefix(&layout.fleet));
        let mut streams = Vec::new();
        for (kind, suffix) in Stream::ALL.into_iter().zip(["events", "decisions"]) {
            let name = format!("{}-{suffix}", layout.fleet);
            let config = stream::Config {
                name: name.clone(),
                subjects: vec![format!("{prefix}{}.*.*", kind.prefix())],
                num_replicas: layout.replicas,
                duplicate_window: WINDOW,
                max_messages_per_subject: if kind == Stream::Decisions { layout.history } else { -1 },
                // The number of partitions is stored in the description, so that all clients agree on
                // it.
                description: Some(format!("{DESCRIPTION}{partitions}")),
                allow_direct: true,
                ..stream::Config::default()
            };
            let stream = context.get_or_create_stream(config).await.map_err(failed)?;
            let existing = &stream.cached_info().config;
            let settings = || {
                let partitions = existing.description.as_deref()?.strip_prefix(DESCRIPTION)?.parse().ok()?;
                let prefix = existing.subjects.first()?.strip_suffix(&format!("{}.*.*", kind.prefix()))?;
                Some((partitions, prefix.to_owned()))
            };
            let Some(settings) = settings() else { return Ok(Err(name)) };
            (partitions, prefix) = settings;
            streams.push(stream);
        }
        let bucket = format!("{}-workers", layout.fleet);
        let workers = if let Ok(store) = context.get_key_value(&bucket).await {
            store
        } else {
            // This fails if another client has created the bucket in the meantime, and is then retried.
            let (num_replicas, max_age) = (layout.replicas, Duration::from_secs(layout.lease));
            let config = kv::Config { bucket, num_replicas, max_age, ..kv::Config::default() };
            context.create_key_value(config).await.map_err(failed)?
        };
        // The lease time is that of the creation of the bucket, not of `layout`.
        let lease = workers.status().await.map_err(failed)?.max_age();
        Ok(Ok(Self { client, context, partitions, lease, prefix, streams, workers }))
    }

    /// Returns the subject of a stream with this end (`PARTITION.ROBOT`), which may have wildcards.
    fn subject(&self, stream: Stream, end: &str) -> String {
        format!("{}{}.{end}", self.prefix, stream.prefix())
    }

    fn stream(&self, stream: Stream) -> &stream::Stream {
        &self.streams[stream as usize]
    }
}

fn subject_prefix(fleet: &str) -> String {
    if fleet == DEFAULT_FLEET { String::new() } else { format!("{fleet}.") }
}

fn stored(
    sequence: u64,
    subject: &str,
    headers: Option<&HeaderMap>,
    unix_nanos: i128,
    payload: &[u8],
) -> Stored {
    let id = headers.and_then(|headers| headers.get("Nats-Msg-Id")).map(|id| id.as_str().to_owned());
    let time = u64::try_from(unix_nanos / 1000).unwrap_or_default();
    Stored { sequence, subject: tail(subject), id, time, payload: payload.to_vec() }
}

/// Converts a message that was read without a consumer; `None` if it does not exist.
fn raw(message: Result<StreamMessage, LastRawMessageError>) -> Result<Option<Stored>, Fault> {
    match message {
        Ok(StreamMessage { subject, sequence, headers, payload, time }) => {
            Ok(Some(stored(sequence, &subject, Some(&headers), time.unix_timestamp_nanos(), &payload)))
        }
        Err(error) if error.kind() == LastRawMessageErrorKind::NoMessageFound => Ok(None),
        Err(error) => Err(failed(error)),
    }
}

/// Returns the last two tokens of a subject, `PARTITION.ROBOT`.
fn tail(subject: &str) -> String {
    let start = subject.rmatch_indices('.').nth(1).map_or(0, |(dot, _)| dot + 1);
    subject[start..].to_owned()
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

    async fn follow(&self, kind: Stream, partition: u32, after: u64) -> Result<Subscription, Fault> {
        let config = pull::OrderedConfig {
            filter_subject: self.subject(kind, &format!("{partition}.*")),
            deliver_policy: DeliverPolicy::ByStartSequence { start_sequence: after + 1 },
            ..pull::OrderedConfig::default()
        };
        let consumer = self.stream(kind).create_consumer(config).await.map_err(failed)?;
        let messages = consumer.messages().await.map_err(failed)?;
        let read = |message: Result<jetstream::Message, _>| -> Result<Stored, Fault> {
            let message = message.map_err(failed)?;
            let info = message.info().map_err(failed)?;
            let (sequence, nanos) = (info.stream_sequence, info.published.unix_timestamp_nanos());
            Ok(stored(sequence, &message.subject, message.headers.as_ref(), nanos, &message.payload))
        };
        Ok(messages.map(read).boxed())
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
        let publish = async { self.context.send_publish(subject, publish).await?.await };
        let ack = publish.await.map_err(|error| published(&error, message.payload.len()))?;
        Ok(Receipt { sequence: ack.sequence, is_known: ack.duplicate })
    }

    async fn last(&self, kind: Stream, subject: &str) -> Result<Option<Stored>, Fault> {
        raw(self.stream(kind).get_last_raw_message_by_subject(&self.subject(kind, subject)).await)
    }

    async fn next(&self, subject: &str, start: u64) -> Result<Option<Stored>, Fault> {
        let subject = self.subject(Stream::Events, subject);
        raw(self.stream(Stream::Events).get_first_raw_message_by_subject(&subject, start).await)
    }

    async fn discard(&self, subject: &str, last: u64) -> Result<(), Fault> {
        let filter = self.subject(Stream::Events, subject);
        let purge = self.stream(Stream::Events).purge().filter(filter).sequence(last + 1);
        purge.await.map(|_| ()).map_err(failed)
    }

    async fn announce(&self, worker: &str, status: Option<&Presence>) -> Result<(), Fault> {
        match status.map(serde_json::to_vec).transpose().map_err(failed)? {
            Some(text) => self.workers.put(worker, text.into()).await.map(|_| ()).map_err(failed),
            None => self.workers.delete(worker).await.map_err(failed),
        }
    }

    async fn workers(&self) -> Result<BTreeMap<String, Presence>, Fault> {
        let read = async {
            let keys = self.workers.keys().await.map_err(failed)?;
            let names: Vec<String> = keys.try_collect().await.map_err(failed)?;
            let mut workers = BTreeMap::new();
            for name in names {
                // A status may have expired in the meantime.
                let text = self.workers.get(&name).await.map_err(failed)?.unwrap_or_default();
                workers.extend(serde_json::from_slice(&text).ok().map(|status| (name, status)));
            }
            Ok(workers)
        };
        tokio::time::timeout(PATIENCE, read).await.map_err(failed)?
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
