//! Execution of a partition: reads events, refuses those with a wrong address, queues the others for their robots, and
//! unloads robots that were not used recently.

use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError};

use futures::StreamExt as _;
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinSet;

use super::runner::{Count, Queued, Runner};
use super::{Shared, pause};
use crate::robot::Refused;
use crate::store::{Fault, Store, Stored, Stream, Subscription};
use crate::wire::{Address, partition_of};

/// Maximum number of queued events of each robot whose contents are in memory. Further events are queued with their
/// sequence numbers only.
const MAX_QUEUE: usize = 16;

pub(super) struct Partition<S> {
    shared: Arc<Shared<S>>,
    number: u32,
    /// `true` if the partition is given back.
    drain: watch::Receiver<bool>,
    slots: BTreeMap<String, Slot<S>>,
    /// Sequence number of the last event that was read.
    seen: u64,
    /// Robots that work, and discards of refused events.
    running: JoinSet<Option<Box<Runner<S>>>>,
    /// Names of idle robots in the order of their last use, by [`Slot::used`].
    recent: BTreeMap<u64, String>,
    /// Number of times that a robot has become idle.
    clock: u64,
}

struct Slot<S> {
    queue: mpsc::UnboundedSender<Queued>,
    /// One permit for each further event that can be in memory.
    memory: Arc<Semaphore>,
    /// `None` while the robot works.
    idle: Option<Box<Runner<S>>>,
    /// Value of [`Partition::clock`] when the robot was last used.
    used: u64,
}

impl<S: Store> Partition<S> {
    pub(super) fn new(shared: Arc<Shared<S>>, number: u32, drain: watch::Receiver<bool>) -> Self {
        let (slots, running, recent) = (BTreeMap::new(), JoinSet::new(), BTreeMap::new());
        Self { shared, number, drain, slots, seen: 0, running, recent, clock: 0 }
    }

    pub(super) async fn run(mut self) {
        let (mut backoff, mut reached) = (0, 0);
        let mut events: Option<Subscription> = None;
        let mut look = tokio::time::interval(self.shared.settings.look);
        look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let mut drain = self.drain.clone();
        while !*drain.borrow_and_update() {
            // Without running robots, all events that were read are handled.
            if self.running.is_empty() && reached != self.seen {
                reached = self.seen;
                let mut positions = self.shared.counts.reached.lock().unwrap_or_else(PoisonError::into_inner);
                positions.insert(self.number, reached);
            }
            if events.is_none() {
                if let Ok(stream) = self.shared.store.follow(Stream::Events, self.number, self.seen).await {
                    events = Some(stream);
                } else {
                    backoff += 1;
                    pause(backoff).await;
                }
            }
            tokio::select! {
                biased;
                Some(done) = self.running.join_next() => match done {
                    Ok(runner) => self.rest(runner),
                    // The worker starts the partition again.
                    Err(_) => return,
                },
                _ = drain.changed() => {}
                _ = look.tick() => self.discard(false),
                message = next(&mut events) => {
                    if let Some(Ok(event)) = message {
                        backoff = 0;
                        self.read(event);
                    } else {
                        events = None;
                        backoff += 1;
                        pause(backoff).await;
                    }
                }
            }
        }
        self.discard(true);
        let end = async { while self.running.join_next().await.is_some() {} };
        // Tasks that run longer are aborted.
        let _ = tokio::time::timeout(self.shared.settings.drain, end).await;
    }

    /// Queues the next event of the stream for its robot, or refuses it because of its address.
    fn read(&mut self, event: Stored) {
        if event.sequence <= self.seen {
            return;
        }
        self.seen = event.sequence;
        let Some(address) = Address::parse(&event.subject) else {
            self.shared.refuse("wrong_subject", None);
            return self.discard_refused(event);
        };
        if partition_of(&address.robot, self.shared.store.partitions()) != self.number {
            let refused = Refused::Misplaced;
            self.shared.refuse(refused.name(), Some((&event.subject, refused.to_string())));
            return self.discard_refused(event);
        }
        let slot = self.slots.entry(address.robot.clone()).or_insert_with(|| {
            let (queue, events) = mpsc::unbounded_channel();
            let idle = Some(Box::new(Runner::new(Arc::clone(&self.shared), address, events)));
            Slot { queue, memory: Arc::new(Semaphore::new(MAX_QUEUE)), idle, used: 0 }
        });
        let (sequence, waiting) = (event.sequence, Count::new(&self.shared.counts.waiting));
        let permit = Arc::clone(&slot.memory).try_acquire_owned().ok();
        // The slot or the running robot has the receiver.
        let _ = slot.queue.send(Queued { sequence, event: permit.map(|permit| (event, permit)), waiting });
        if let Some(runner) = slot.idle.take() {
            self.start(runner);
        }
    }

    fn start(&mut self, runner: Box<Runner<S>>) {
        let run = runner.run(self.drain.clone());
        self.running.spawn(async { Some(run.await) });
    }

    fn discard_refused(&mut self, Stored { sequence, subject, .. }: Stored) {
        let shared = Arc::clone(&self.shared);
        self.running.spawn(async move {
            // The next owner of the partition refuses an event again that is not discarded.
            let _ = shared.store.discard(&subject, sequence).await;
            None
        });
    }

    /// Starts a runner again that has events, and forgets the robot of an obsolete one. Otherwise, the robot becomes
    /// idle.
    fn rest(&mut self, runner: Option<Box<Runner<S>>>) {
        let Some(runner) = runner else { return };
        let name = &runner.address.robot;
        let Some(slot) = self.slots.get_mut(name) else { return };
        self.recent.remove(&slot.used);
        if runner.has_events() {
            self.start(runner);
        } else if runner.is_obsolete() {
            self.slots.remove(name);
        } else {
            self.clock += 1;
            slot.used = self.clock;
            self.recent.insert(self.clock, name.clone());
            slot.idle = Some(runner);
            self.unload();
        }
    }

    /// Unloads idle robots of this partition, the least recently used ones first, while the worker has more loaded
    /// robots than its limit.
    fn unload(&mut self) {
        while self.shared.has_too_many_robots()
            && let Some((_, name)) = self.recent.pop_first()
        {
            let Some(runner) = self.slots.get_mut(&name).and_then(|slot| slot.idle.as_mut()) else {
                continue;
            };
            runner.unload();
            if runner.is_obsolete() {
                self.slots.remove(&name);
            }
        }
    }

    /// Starts to discard the handled events of idle robots whose first handled event is at least
    /// [`Settings::discard_within`](super::Settings::discard_within) old. With `all`, of all idle robots that have
    /// handled events.
    fn discard(&mut self, all: bool) {
        let within = self.shared.settings.discard_within;
        let is_due =
            |runner: &mut Box<Runner<S>>| runner.since.is_some_and(|since| all || since.elapsed() >= within);
        let due: Vec<_> = self.slots.values_mut().filter_map(|slot| slot.idle.take_if(is_due)).collect();
        for runner in due {
            self.start(runner);
        }
    }
}

async fn next(events: &mut Option<Subscription>) -> Option<Result<Stored, Fault>> {
    match events {
        Some(events) => events.next().await,
        None => std::future::pending().await,
    }
}
