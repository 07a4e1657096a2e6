//! Handling of a single event: loads the robot from its last decision if necessary, runs its loop on a separate thread,
//! and appends the decision if the robot's last decision is still the expected one.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::{Shared, pause, persist};
use crate::robot::{Begun, Faulted, Refused, Robot};
use crate::store::{Fault, Message, Store, Stored, Stream};
use crate::wire::Decided;

/// State of a robot after its last decision, which has the sequence number `chain`; 0 without a decision.
pub(super) struct Loaded {
    pub(super) robot: Box<Robot>,
    pub(super) chain: u64,
}

pub(super) struct Task {
    pub(super) name: String,
    pub(super) loaded: Option<Loaded>,
    pub(super) estimate: Option<Duration>,
}

pub(super) enum Outcome {
    Decided,
    /// The event had been decided before.
    Known,
    Refused(Refused),
    Faulted(String),
}

impl Task {
    /// Handles an event until it is decided by this worker or another one, refused, or the robot cannot continue.
    pub(super) async fn run<S: Store>(mut self, shared: &Arc<Shared<S>>, event: &Stored) -> (Self, Outcome) {
        for attempt in 1.. {
            let Loaded { robot, chain } = match self.loaded.take() {
                Some(loaded) => loaded,
                None => load(shared, &event.subject).await,
            };
            if event.sequence <= robot.event {
                self.loaded = Some(Loaded { robot, chain });
                return (self, Outcome::Known);
            }
            let is_forged = event
                .id
                .as_ref()
                .is_some_and(|id| id.split_once(':').is_none_or(|(robot, _)| robot != self.name));
            if is_forged {
                self.loaded = Some(Loaded { robot, chain });
                return (self, Outcome::Refused(Refused::Forged));
            }
            let Some((robot, decided)) = self.work(shared, robot, event.clone()).await else {
                return (self, Outcome::Faulted("its loop has panicked".to_owned()));
            };
            let mut decided = match decided {
                Err(Faulted(why)) => return (self, Outcome::Faulted(why)),
                Ok(Err(refused)) => {
                    self.loaded = Some(Loaded { robot, chain });
                    return (self, Outcome::Refused(refused));
                }
                Ok(Ok(decided)) => decided,
            };
            decided.worker.clone_from(&shared.worker);
            match publish(shared, event, &decided, chain).await {
                Ok(chain) => {
                    self.loaded = Some(Loaded { robot, chain });
                    return (self, Outcome::Decided);
                }
                Err(Fault::TooLong(length)) => {
                    let why = format!("a decision of {length} bytes is longer than the server accepts");
                    return (self, Outcome::Faulted(why));
                }
                // Another worker has decided, or an unacknowledged attempt has succeeded. The robot is loaded
                // again to find out.
                Err(_) => {
                    metrics::counter!("metaplan_fleet_fenced_total").increment(1);
                    pause(attempt).await;
                }
            }
        }
        (self, Outcome::Known)
    }

    /// Runs the loop of the robot. Returns `None` after a panic.
    async fn work<S: Store>(
        &mut self,
        shared: &Arc<Shared<S>>,
        mut robot: Box<Robot>,
        event: Stored,
    ) -> Option<(Box<Robot>, Result<Result<Decided, Refused>, Faulted>)> {
        let begun = Instant::now();
        let own = Arc::clone(shared);
        let first = move || {
            let begun = Instant::now();
            let outcome = robot.begin(&event, &own.missions);
            count(&own, begun.elapsed());
            (robot, outcome)
        };
        let (mut robot, outcome) = shared.threads.quick(first).await.ok()?;
        let work = match outcome {
            Err(faulted) => (robot, Err(faulted)),
            Ok(Begun::Decided(decided)) => (robot, Ok(Ok(decided))),
            Ok(Begun::Refused(refused)) => (robot, Ok(Err(refused))),
            Ok(Begun::Search(search)) => {
                let own = Arc::clone(shared);
                let mission = robot.mission.clone().unwrap_or_default();
                let second = move || {
                    let begun = Instant::now();
                    let decided = robot.search(search);
                    count(&own, begun.elapsed());
                    (robot, decided.map(Ok))
                };
                let (work, estimate) = shared.threads.search(&mission, self.estimate, second).await.ok()?;
                self.estimate = Some(estimate);
                work
            }
        };
        metrics::histogram!("metaplan_fleet_decision_seconds").record(begun.elapsed());
        Some(work)
    }
}

async fn load<S: Store>(shared: &Shared<S>, subject: &str) -> Loaded {
    let last = persist(|| shared.store.last(Stream::Decisions, subject)).await;
    let chain = last.as_ref().map_or(0, |last| last.sequence);
    let robot = match last.map(|last| Decided::parse(&last.payload)) {
        Some(Some(decided)) => Robot::restore(decided),
        Some(None) => Robot::unreadable(),
        None => Robot::default(),
    };
    Loaded { robot: Box::new(robot), chain }
}

/// Appends a decision if the robot's last decision has the sequence number `chain`. Retries until the result is known.
/// Returns the sequence number of the decision.
async fn publish<S: Store>(
    shared: &Shared<S>,
    event: &Stored,
    decided: &Decided,
    chain: u64,
) -> Result<u64, Fault> {
    let payload = serde_json::to_vec(decided).unwrap_or_default();
    // Without an id, so that the server compares the chain also for a repeated attempt.
    let message = Message { subject: &event.subject, id: "", after: Some(chain), payload: &payload };
    for attempt in 1.. {
        match shared.store.append(Stream::Decisions, message).await {
            Err(Fault::Unreachable(_)) => {}
            result => {
                let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
                let late = now.saturating_sub(Duration::from_micros(event.time));
                metrics::histogram!("metaplan_fleet_latency_seconds").record(late);
                return result.map(|receipt| receipt.sequence);
            }
        }
        metrics::counter!("metaplan_fleet_retries_total").increment(1);
        pause(attempt).await;
    }
    Err(Fault::Conflict)
}

fn count<S>(shared: &Shared<S>, duration: Duration) {
    let micros = u64::try_from(duration.as_micros()).unwrap_or(u64::MAX);
    shared.counts.busy.fetch_add(micros, Ordering::Relaxed);
}
