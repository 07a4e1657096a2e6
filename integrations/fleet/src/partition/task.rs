//! Handling of a single event: separate threads run the loop, then the decision is appended if the
//! robot's last decision is the expected one. A replayed decision is not appended again.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::Shared;
use super::asking::{bytes, pause, persist};
use super::slot::{Done, Outcome};
use crate::robot::{Begun, Faulted, Refused, Robot};
use crate::store::{Bucket, Fault, Message, Store, Stored, Stream};
use crate::wire::{Decided, Progress};

pub(super) struct Task<S> {
    pub(super) shared: Arc<Shared<S>>,
    pub(super) name: String,
    pub(super) partition: u32,
    pub(super) epoch: u64,
    pub(super) chain: Option<u64>,
    pub(super) recovered: u64,
    pub(super) before: Option<(u64, Decided)>,
    /// `true` if a former owner has decided later events of the robot but not this one, i.e. has
    /// refused it.
    pub(super) was_refused: bool,
    pub(super) is_suspended: bool,
    pub(super) estimate: Option<Duration>,
}

type Work = (Box<Robot>, Stored, Result<Result<Decided, Refused>, Faulted>);

impl<S: Store> Task<S> {
    pub(super) async fn run(mut self, mut robot: Box<Robot>, event: Stored) -> Done {
        let chain = match self.chain {
            Some(chain) => Some(chain),
            None => self.last_decision(&mut robot, &event).await,
        };
        let Some(chain) = chain else {
            return Done::Taken {
                robot: self.name,
                own: robot,
                event,
                outcome: Outcome::Fenced,
                search: None,
            };
        };
        let Some((own, event, decided)) = self.work(robot, event).await else {
            // A panic loses the state of the robot. The next recovery starts from its last
            // snapshot.
            let event =
                Stored { sequence: 0, subject: String::new(), id: None, time: 0, payload: Vec::new() };
            let (own, outcome) = (Box::default(), Outcome::Fenced);
            return Done::Taken { robot: self.name, own, event, outcome, search: None };
        };
        let outcome = match decided {
            Err(Faulted(why)) => Outcome::Faulted(why),
            Ok(Err(refused)) => Outcome::Refused(refused),
            Ok(Ok(_)) if self.was_refused => Outcome::Faulted(format!(
                "event {} was refused by a former owner, but would be accepted now",
                event.sequence
            )),
            Ok(Ok(mut decided)) => {
                if let Some((sequence, _)) = &self.before {
                    Outcome::Decided(*sequence)
                } else {
                    (decided.worker, decided.epoch) = (self.shared.worker.clone(), self.epoch);
                    self.publish(&event, &decided, chain).await
                }
            }
        };
        Done::Taken { robot: self.name, own, event, outcome, search: self.estimate }
    }

    /// Looks up the robot's last decision. If it has retired the robot, restores the ids of decided
    /// events. Returns the sequence number of the decision, or 0 without a decision. Returns `None`
    /// if another worker may have decided this event or a later one.
    async fn last_decision(&self, robot: &mut Robot, event: &Stored) -> Option<u64> {
        let store = &self.shared.store;
        let last = persist(|| store.last(Stream::Decisions, &event.subject)).await.ok()?;
        let Some(last) = last else { return Some(0) };
        match Decided::parse(&last.payload) {
            Some(decided) if decided.event >= event.sequence => return None,
            Some(decided) if decided.retired && robot.mission.is_none() => robot.ids = decided.ids,
            // A message that is not a decision does not show whether this event is decided.
            None if last.sequence > self.recovered => return None,
            Some(_) | None => {}
        }
        Some(last.sequence)
    }

    /// Runs the loop of the robot. Returns `None` after a panic.
    async fn work(&mut self, mut robot: Box<Robot>, event: Stored) -> Option<Work> {
        if self.is_suspended {
            if self.before.is_none() && event.id.as_ref().is_some_and(|id| robot.ids.contains(id)) {
                return Some((robot, event, Ok(Err(Refused::Repeated))));
            }
            let decided = robot.retire_suspended(&event);
            return Some((robot, event, Ok(Ok(decided))));
        }
        let begun = Instant::now();
        let shared = Arc::clone(&self.shared);
        let before = self.before.as_ref().map(|(_, decided)| decided.clone());
        let first = move || {
            let begun = Instant::now();
            let outcome = robot.begin(&event, &shared.missions, before.as_ref());
            count(&shared, begun.elapsed());
            (robot, event, outcome)
        };
        let (mut robot, event, outcome) = self.shared.threads.quick(first).await.ok()?;
        let work = match outcome {
            Err(faulted) => (robot, event, Err(faulted)),
            Ok(Begun::Decided(decided)) => (robot, event, Ok(Ok(decided))),
            Ok(Begun::Refused(refused)) => (robot, event, Ok(Err(refused))),
            Ok(Begun::Search(search)) => {
                let shared = Arc::clone(&self.shared);
                let mission = robot.mission.clone().unwrap_or_default();
                let second = move || {
                    let begun = Instant::now();
                    let decided = robot.search(search);
                    count(&shared, begun.elapsed());
                    (robot, event, decided.map(Ok))
                };
                let (work, estimate) =
                    self.shared.threads.search(&mission, self.estimate, second).await.ok()?;
                self.estimate = Some(estimate);
                work
            }
        };
        metrics::histogram!("metaplan_fleet_decision_seconds").record(begun.elapsed());
        Some(work)
    }

    /// Appends a decision if the robot's last decision has the sequence number `chain`. Retries until the
    /// result is known. Returns [`Outcome::Fenced`] if the robot has another last decision, and
    /// [`Outcome::Faulted`] if the decision is too long for the server.
    async fn publish(&self, event: &Stored, decided: &Decided, mut chain: u64) -> Outcome {
        let (store, payload) = (&self.shared.store, bytes(decided));
        let id = format!("{}:{}:{}:{}", self.name, event.sequence, self.epoch, self.shared.worker);
        for attempt in 1.. {
            let message = Message { subject: &event.subject, id: &id, after: Some(chain), payload: &payload };
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
                    // The stream has a maximum age, and the robot was silent for longer. Then the order of decisions
                    // no longer shows whether another worker has taken over the partition.
                    Ok(None) if chain > 0 => {
                        if !self.is_owner().await {
                            return Outcome::Fenced;
                        }
                        chain = 0;
                    }
                    Ok(last) if last.as_ref().map_or(0, |last| last.sequence) != chain => {
                        return Outcome::Fenced;
                    }
                    // An earlier attempt may still be on its way to the server.
                    _ => {}
                },
                Err(Fault::TooLong(length)) => {
                    return Outcome::Faulted(format!(
                        "a decision of {length} bytes is longer than the server accepts"
                    ));
                }
                Err(Fault::Unreachable(_)) => {}
            }
            metrics::counter!("metaplan_fleet_retries_total").increment(1);
            pause(attempt).await;
        }
        Outcome::Fenced
    }

    /// Returns `true` if no other worker has recovered the partition since this one has.
    async fn is_owner(&self) -> bool {
        let (store, key) = (&self.shared.store, self.partition.to_string());
        let entry = persist(|| store.get(Bucket::Progress, &key)).await.ok().flatten();
        let progress = entry.and_then(|entry| serde_json::from_slice::<Progress>(&entry.value).ok());
        progress.is_some_and(|progress| progress.epoch == self.epoch)
    }
}

fn count<S>(shared: &Shared<S>, duration: Duration) {
    let micros = u64::try_from(duration.as_micros()).unwrap_or(u64::MAX);
    shared.counts.busy.fetch_add(micros, Ordering::Relaxed);
}
