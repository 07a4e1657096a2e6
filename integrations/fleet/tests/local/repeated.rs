//! Tests of messages that are sent again after the log has forgotten their ids.

use std::time::Duration;

use futures::StreamExt as _;
use futures::stream::BoxStream;
use metaplan_fleet::partition::Settings;
use metaplan_fleet::store::local::Local;
use metaplan_fleet::store::{Bucket, Entry, Fault, Message, Receipt, Store, Stored, Stream};
use metaplan_fleet::wire::Address;

use super::{assert_same, decisions, open, scripts, work};

/// A log that has forgotten the ids of messages: an id is stored with a suffix `#NUMBER`, which readers do not see.
#[derive(Debug, Clone)]
struct Forgetful(Local);

fn without_suffix(mut message: Stored) -> Stored {
    message.id = message.id.map(|id| id.split('#').next().unwrap_or_default().to_owned());
    message
}

impl Store for Forgetful {
    fn partitions(&self) -> u32 {
        self.0.partitions()
    }

    fn lease(&self) -> Duration {
        self.0.lease()
    }

    async fn follow(
        &self,
        stream: Stream,
        partition: u32,
        after: u64,
    ) -> Result<BoxStream<'static, Result<Stored, Fault>>, Fault> {
        let messages = self.0.follow(stream, partition, after).await?;
        Ok(messages.map(|message| message.map(without_suffix)).boxed())
    }

    async fn history(&self, stream: Stream, partition: u32, after: u64) -> Result<Vec<Stored>, Fault> {
        Ok(self.0.history(stream, partition, after).await?.into_iter().map(without_suffix).collect())
    }

    async fn of_subject(
        &self,
        stream: Stream,
        subject: &str,
        after: u64,
        most: usize,
    ) -> Result<Vec<Stored>, Fault> {
        let messages = self.0.of_subject(stream, subject, after, most).await?;
        Ok(messages.into_iter().map(without_suffix).collect())
    }

    async fn end(&self, stream: Stream, partition: u32) -> Result<u64, Fault> {
        self.0.end(stream, partition).await
    }

    async fn append(&self, stream: Stream, message: Message<'_>) -> Result<Receipt, Fault> {
        self.0.append(stream, message).await
    }

    async fn last(&self, stream: Stream, subject: &str) -> Result<Option<Stored>, Fault> {
        self.0.last(stream, subject).await
    }

    async fn at(&self, stream: Stream, sequence: u64) -> Result<Option<Stored>, Fault> {
        self.0.at(stream, sequence).await
    }

    async fn get(&self, bucket: Bucket, key: &str) -> Result<Option<Entry>, Fault> {
        self.0.get(bucket, key).await
    }

    async fn put(&self, bucket: Bucket, key: &str, value: &[u8], after: u64) -> Result<u64, Fault> {
        self.0.put(bucket, key, value, after).await
    }

    async fn remove(&self, bucket: Bucket, key: &str, revision: u64) -> Result<(), Fault> {
        self.0.remove(bucket, key, revision).await
    }

    async fn list(&self, bucket: Bucket, partition: Option<u32>, at_least: u64) -> Result<Vec<Entry>, Fault> {
        self.0.list(bucket, partition, at_least).await
    }

    async fn notice(&self, subject: &str, text: &str) {
        self.0.notice(subject, text).await;
    }
}

/// Sends events of the robot `r` with the ids of their numbers, which are distinguished by `copy` in the log.
async fn send(store: &Forgetful, events: &[(usize, &str)], copy: u32) -> Vec<u64> {
    let subject = Address::of("r", 1).to_string();
    let mut sequences = Vec::new();
    for (number, event) in events {
        let id = format!("r:{number}#{copy}");
        let message = Message { subject: &subject, id: &id, after: None, payload: event.as_bytes() };
        sequences
            .push(store.append(Stream::Events, message).await.expect("it is our own directory").sequence);
    }
    sequences
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_event_is_decided_once_though_the_log_has_forgotten_its_id() {
    let folder = tempfile::tempdir().expect("a directory");
    let store = Forgetful(open(folder.path(), 1));
    let mut notices = store.0.notices();
    let settings = Settings { save_every: 2, look: Duration::from_millis(5), ..Settings::default() };
    let (events, answers) = scripts::play("ugv", "kinect_comes_and_goes", 5, 30);
    let numbered: Vec<(usize, &str)> = events.iter().map(String::as_str).enumerate().collect();
    let mut sequences = send(&store, &numbered[..12], 0).await;
    // An acknowledgement was lost: the same worker sees the event again.
    send(&store, &numbered[7..9], 1).await;
    sequences.extend(send(&store, &numbered[12..20], 0).await);
    work(&store, "one", settings, 20).await;
    // Another worker has only the stored state.
    send(&store, &numbered[3..20], 2).await;
    sequences.extend(send(&store, &numbered[20..], 0).await);
    work(&store, "two", settings, events.len()).await;
    assert_same("r", &decisions(&store).await["r"], &sequences, &answers);
    // A retired robot is not enrolled by a repetition, though nothing is stored about it.
    let number = events.len();
    send(&store, &[(number, r#"{"event": "retire"}"#)], 0).await;
    work(&store, "three", settings, number + 1).await;
    let again = send(&store, &[(0, events[0].as_str()), (number + 1, events[0].as_str())], 3).await;
    work(&store, "four", settings, number + 2).await;
    let made = &decisions(&store).await["r"];
    assert_eq!(made.last().map(|decided| decided.event), again.last().copied());
    let mut repeated = 0;
    while let Ok((_, reason)) = notices.try_recv() {
        repeated += usize::from(reason.contains("decided before"));
    }
    assert_eq!(repeated, 2 + 17 + 1);
}
