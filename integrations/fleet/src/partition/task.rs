//! Handling of a single event: a separate thread runs the loop, then the decision is appended if
//! the robot's last decision is the expected one. A replayed decision is not appended again.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::Shared;
use super::asking::{bytes, pause};
use super::slot::{Done, Outcome};
use crate::robot::{Faulted, Robot};
use crate::store::{Fault, Message, Store, Stored, Stream};
use crate::wire::Decided;

pub(super) struct Task<S> {
    pub(super) shared: Arc<Shared<S>>,
    pub(super) name: String,
    pub(super) epoch: u64,
    pub(super) chain: u64,
    pub(super) before: Option<(u64, Decided)>,
    /// `true` if a former owner has decided later events of the robot but not this one, i.e. has
    /// refused it.
    pub(super) was_refused: bool,
}

impl<S: Store> Task<S> {
    pub(super) async fn run(self, robot: Box<Robot>, event: Stored) -> Done {
        let Ok(permit) = self.shared.threads.acquire().await else {
            return Done::Taken { robot: self.name, own: robot, event, outcome: Outcome::Fenced };
        };
        let shared = Arc::clone(&self.shared);
        let before = self.before.as_ref().map(|(_, decided)| decided.clone());
        let work = tokio::task::spawn_blocking(move || {
            let (mut robot, begun) = (robot, Instant::now());
            let decided = robot.decide(&event, &shared.missions, before.as_ref());
            let micros = u64::try_from(begun.elapsed().as_micros()).unwrap_or(u64::MAX);
            shared.counts.busy.fetch_add(micros, Ordering::Relaxed);
            metrics::histogram!("metaplan_fleet_decision_seconds").record(begun.elapsed());
            (robot, event, decided)
        });
        let Ok((own, event, decided)) = work.await else {
            // A panic loses the state of the robot. The next recovery starts from its last
            // snapshot.
            let event =
                Stored { sequence: 0, subject: String::new(), id: None, time: 0, payload: Vec::new() };
            return Done::Taken { robot: self.name, own: Box::default(), event, outcome: Outcome::Fenced };
        };
        drop(permit);
        let outcome = match decided {
            Err(Faulted(why)) => Outcome::Faulted(why),
            Ok(Err(refused)) => Outcome::Refused(refused),
            Ok(Ok(_)) if self.was_refused => Outcome::Faulted(format!(
                "event {} was refused by a former owner, and would not be now",
                event.sequence
            )),
            Ok(Ok(mut decided)) => {
                if let Some((sequence, _)) = &self.before {
                    Outcome::Decided(*sequence)
                } else {
                    (decided.worker, decided.epoch) = (self.shared.worker.clone(), self.epoch);
                    self.publish(&event, &decided).await
                }
            }
        };
        Done::Taken { robot: self.name, own, event, outcome }
    }

    /// Appends a decision if the robot's last decision has the sequence number `chain`. Retries until the
    /// result is known. Returns [`Outcome::Fenced`] if the robot has another last decision, and
    /// [`Outcome::Faulted`] if the decision is too long for the server.
    async fn publish(&self, event: &Stored, decided: &Decided) -> Outcome {
        let (store, payload) = (&self.shared.store, bytes(decided));
        let id = format!("{}:{}:{}:{}", self.name, event.sequence, self.epoch, self.shared.worker);
        let message =
            Message { subject: &event.subject, id: &id, after: Some(self.chain), payload: &payload };
        for attempt in 1.. {
            match store.append(Stream::Decisions, message).await {
                Ok(receipt) => {
                    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
                    let late = now.saturating_sub(Duration::from_micros(event.time));
                    metrics::histogram!("metaplan_fleet_latency_seconds").record(late);
                    return Outcome::Decided(receipt.sequence);
                }
                Err(Fault::Conflict) => match store.last(Stream::Decisions, &event.subject).await {
                    Ok(Some(last)) if last.id.as_deref() == Some(&id) => {
                        return Outcome::Decided(last.sequence);
                    }
                    Ok(last) if last.as_ref().map_or(0, |last| last.sequence) != self.chain => {
                        return Outcome::Fenced;
                    }
                    // An earlier attempt may still be on its way to the server.
                    _ => {}
                },
                Err(Fault::TooLong(length)) => {
                    return Outcome::Faulted(format!(
                        "a decision of {length} bytes is longer than the server takes"
                    ));
                }
                Err(Fault::Unreachable(_)) => {}
            }
            metrics::counter!("metaplan_fleet_retries_total").increment(1);
            pause(attempt).await;
        }
        Outcome::Fenced
    }
}
