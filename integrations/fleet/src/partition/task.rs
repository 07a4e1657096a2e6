//! Handling of a single event: loads the robot from its last decision if necessary, runs its loop on a separate thread,
//! and appends the decision if the robot's last decision is still the expected one.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use futures::future::{BoxFuture, FutureExt as _};
use metaplan::mapek::{SearchHandle, Thinker, Thoughts};

use super::{Shared, pause, persist};
use crate::missions::Missions;
use crate::robot::{Begun, Faulted, Refused, Robot};
use crate::store::{Fault, Message, Store, Stored, Stream};
use crate::wire::Decided;

/// Reason why a robot is suspended after a panic, and if the thread of a search cannot be started.
pub(super) const PANICKED: &str = "its loop has panicked";

/// State of a robot after its last decision, which has the sequence number `chain`; 0 without a decision.
pub(super) struct Loaded {
    pub(super) robot: Box<Robot>,
    pub(super) chain: u64,
}

pub(super) struct Task {
    pub(super) name: String,
    /// Subject of the robot's messages.
    pub(super) subject: String,
    pub(super) loaded: Option<Loaded>,
    /// `true` if the robot was loaded from its last decision. Its loop then counts the planning problems from 0.
    pub(super) is_restored: bool,
    /// Estimated duration of the robot's next search, if it has searched before.
    pub(super) estimate: Option<Duration>,
}

pub(super) enum Outcome {
    Decided,
    /// Nothing was decided: the event had been decided before, or there was no event and only a search was started.
    Known,
    Refused(Refused),
    Faulted(String),
    /// The robot is suspended, so the event stays in the log.
    Suspended,
    /// The plans cannot be used, because the planning problem has changed.
    Outdated,
}

/// A search for a plan that continues after the decision.
pub(super) struct Planning {
    pub(super) search: SearchHandle,
    /// The plans and the new estimate of the duration of a search. `None` if the search has panicked or could not be
    /// started.
    pub(super) result: BoxFuture<'static, Option<(Thoughts, Duration)>>,
}

/// Result of an event: the outcome, and the search for a plan that continues.
pub(super) type Handled = (Outcome, Option<Planning>);

impl Task {
    /// Handles an event until it is decided by this worker or another one, refused, or the robot cannot continue. Starts
    /// no search if `may_search` is `false`.
    pub(super) async fn run<S: Store>(
        &mut self,
        shared: &Arc<Shared<S>>,
        event: &Stored,
        may_search: bool,
    ) -> Handled {
        for attempt in 1.. {
            let Loaded { robot, chain } = self.load(shared).await;
            let id = event.id.as_ref();
            let is_forged =
                id.is_some_and(|id| id.split_once(':').is_none_or(|(robot, _)| robot != self.name));
            if event.sequence <= robot.event || is_forged {
                let outcome = if is_forged { Outcome::Refused(Refused::Forged) } else { Outcome::Known };
                self.loaded = Some(Loaded { robot, chain });
                return (outcome, None);
            }
            let begun = Instant::now();
            let Some((robot, decided, planning)) = self.decide(shared, robot, event, may_search).await else {
                return (Outcome::Faulted(PANICKED.to_owned()), None);
            };
            metrics::histogram!("metaplan_fleet_decision_seconds").record(begun.elapsed());
            let outcome = match decided {
                Err(Faulted(why)) => Outcome::Faulted(why),
                Ok(Err(refused)) => {
                    self.loaded = Some(Loaded { robot, chain });
                    Outcome::Refused(refused)
                }
                Ok(Ok(decided)) => {
                    match self.publish(shared, decided, robot, chain, Some(event.time)).await {
                        // Another worker has decided, or an unacknowledged attempt has succeeded. The robot is loaded
                        // again to find out.
                        Outcome::Outdated => {
                            pause(attempt).await;
                            continue;
                        }
                        outcome => outcome,
                    }
                }
            };
            return (outcome, planning);
        }
        (Outcome::Known, None)
    }

    /// Starts a search if the last decision lacks a plan.
    pub(super) async fn start_planning<S: Store>(&mut self, shared: &Arc<Shared<S>>) -> Handled {
        let Loaded { robot, chain } = self.load(shared).await;
        let Some((robot, thinker)) = with_robot(shared, robot, Robot::thinker).await else {
            return (Outcome::Faulted(PANICKED.to_owned()), None);
        };
        match thinker {
            Err(Faulted(why)) => (Outcome::Faulted(why), None),
            Ok(thinker) => {
                let planning = thinker.map(|thinker| self.planning(shared, &robot, thinker));
                self.loaded = Some(Loaded { robot, chain });
                (Outcome::Known, planning)
            }
        }
    }

    /// Publishes the decision that completes the last ones with these plans.
    pub(super) async fn conclude<S: Store>(
        &mut self,
        shared: &Arc<Shared<S>>,
        thoughts: Thoughts,
        is_late: bool,
    ) -> Outcome {
        let Some(Loaded { robot, chain }) = self.loaded.take() else { return Outcome::Outdated };
        let conclude = move |robot: &mut Robot, _: &Missions| robot.plan(thoughts, is_late);
        let Some((robot, decided)) = with_robot(shared, robot, conclude).await else {
            return Outcome::Faulted(PANICKED.to_owned());
        };
        let Some(decided) = decided else {
            self.loaded = Some(Loaded { robot, chain });
            return Outcome::Outdated;
        };
        self.publish(shared, decided, robot, chain, None).await
    }

    /// Lets the robot decide an event. Returns `None` after a panic.
    async fn decide<S: Store>(
        &mut self,
        shared: &Arc<Shared<S>>,
        robot: Box<Robot>,
        event: &Stored,
        may_search: bool,
    ) -> Option<(Box<Robot>, Result<Result<Decided, Refused>, Faulted>, Option<Planning>)> {
        let event = event.clone();
        let begin = move |robot: &mut Robot, missions: &Missions| {
            let outcome = robot.begin(&event, missions);
            let thinker = match &outcome {
                Ok(Begun::Search(_)) if may_search => robot.thinker(missions).ok().flatten(),
                _ => None,
            };
            (outcome, thinker)
        };
        let (robot, (outcome, thinker)) = with_robot(shared, robot, begin).await?;
        let search = match outcome {
            Err(faulted) => return Some((robot, Err(faulted), None)),
            Ok(Begun::Decided(decided)) => return Some((robot, Ok(Ok(decided)), None)),
            Ok(Begun::Refused(refused)) => return Some((robot, Ok(Err(refused)), None)),
            Ok(Begun::Search(search)) => search,
        };
        let mut planning = thinker.map(|thinker| self.planning(shared, &robot, thinker));
        let mut thoughts = None;
        let patience = shared.settings.patience;
        if let Some(Planning { result, .. }) = &mut planning
            // `timeout` with zero would accept the result of a search that ends within its first millisecond.
            && !patience.is_zero()
            && let Ok(result) = tokio::time::timeout(patience, result).await
        {
            let (plans, estimate) = result?;
            (thoughts, self.estimate, planning) = (Some(plans), Some(estimate), None);
        }
        let finish = move |robot: &mut Robot, _: &Missions| robot.finish(search, thoughts);
        let (robot, decided) = with_robot(shared, robot, finish).await?;
        Some((robot, Ok(Ok(decided)), planning))
    }

    fn planning<S: Store>(&self, shared: &Arc<Shared<S>>, robot: &Robot, thinker: Thinker) -> Planning {
        let (shared, estimate) = (Arc::clone(shared), self.estimate);
        let mission = robot.mission().unwrap_or_default().to_owned();
        let (search, own) = (thinker.handle(), Arc::clone(&shared));
        let think = move || {
            let begun = Instant::now();
            let thoughts = thinker.think();
            count(&own, begun.elapsed());
            thoughts
        };
        let result = async move { shared.threads.search(&mission, estimate, think).await.ok() };
        Planning { search, result: result.boxed() }
    }

    /// Takes the robot from memory, or loads it from its last decision.
    async fn load<S: Store>(&mut self, shared: &Shared<S>) -> Loaded {
        if let Some(loaded) = self.loaded.take() {
            return loaded;
        }
        self.is_restored = true;
        let last = persist(|| shared.store.last(Stream::Decisions, &self.subject)).await;
        let chain = last.as_ref().map_or(0, |last| last.sequence);
        let robot = match last.map(|last| Decided::parse(&last.payload)) {
            Some(Some(decided)) => Robot::restore(decided),
            Some(None) => Robot::unreadable(),
            None => Robot::default(),
        };
        Loaded { robot: Box::new(robot), chain }
    }

    /// Appends a decision if the robot's last decision has the sequence number `chain`. Retries until the result is
    /// known, which is [`Outcome::Outdated`] if another decision is the last one. `time` is that of the event in
    /// microseconds since 1970, if the decision is about an event.
    async fn publish<S: Store>(
        &mut self,
        shared: &Shared<S>,
        mut decided: Decided,
        robot: Box<Robot>,
        chain: u64,
        time: Option<u64>,
    ) -> Outcome {
        decided.worker.clone_from(&shared.worker);
        let payload = serde_json::to_vec(&decided).unwrap_or_default();
        // Without an id, so that the server compares the chain also for a repeated attempt.
        let message = Message { subject: &self.subject, id: "", after: Some(chain), payload: &payload };
        for attempt in 1.. {
            match shared.store.append(Stream::Decisions, message).await {
                Ok(receipt) => {
                    if let Some(time) = time {
                        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
                        let late = now.saturating_sub(Duration::from_micros(time));
                        metrics::histogram!("metaplan_fleet_latency_seconds").record(late);
                    }
                    self.loaded = Some(Loaded { robot, chain: receipt.sequence });
                    return Outcome::Decided;
                }
                Err(Fault::TooLong(length)) => {
                    let why = format!("a decision of {length} bytes is longer than the server accepts");
                    return Outcome::Faulted(why);
                }
                Err(Fault::Conflict) => {
                    metrics::counter!("metaplan_fleet_fenced_total").increment(1);
                    return Outcome::Outdated;
                }
                Err(Fault::Unreachable(_)) => {}
            }
            metrics::counter!("metaplan_fleet_retries_total").increment(1);
            pause(attempt).await;
        }
        Outcome::Outdated
    }
}

/// Runs work without a search on a robot, on a thread for such work. Returns `None` after a panic.
async fn with_robot<S: Store, T: Send + 'static>(
    shared: &Arc<Shared<S>>,
    mut robot: Box<Robot>,
    work: impl FnOnce(&mut Robot, &Missions) -> T + Send + 'static,
) -> Option<(Box<Robot>, T)> {
    let own = Arc::clone(shared);
    let timed = move || {
        let begun = Instant::now();
        let result = work(&mut robot, &own.missions);
        count(&own, begun.elapsed());
        (robot, result)
    };
    shared.threads.quick(timed).await.ok()
}

fn count<S>(shared: &Shared<S>, duration: Duration) {
    let micros = u64::try_from(duration.as_micros()).unwrap_or(u64::MAX);
    shared.counts.busy.fetch_add(micros, Ordering::Relaxed);
}
