//! Observation of signals, reported to the loop as statuses.

use std::collections::{BTreeSet, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::Message;
use serde_json::Value;
use smol::{Task, Timer};

use crate::diagnostic_rules::{COMPONENT, FAILED, MEASUREMENT, WORKING};
use crate::interfaces::diagnostic_msgs::msg::{DiagnosticStatus, KeyValue};
use crate::interfaces::lifecycle_msgs::msg::{State, TransitionEvent};
use crate::interfaces::lifecycle_msgs::srv::{GetState, GetStateRequest};
use crate::interfaces::lyrical::lifecycle_msgs::msg as lyrical;
use crate::interfaces::rcl_interfaces::srv::GetParameters;
use crate::node::{Caller, Clock, Node, PrimaryState, depth, is_lyrical};
use crate::signals::settings::{Condition, Signal, Source, Target, number};
use crate::types::{FieldPath, MessageType};

/// Period of checks whether nodes exist and topics are silent.
const CHECK_PERIOD: Duration = Duration::from_millis(250);

/// Minimum period of checks for skipped messages.
const MIN_SKIPPED_PERIOD: Duration = Duration::from_millis(10);

/// Time after the start during which nodes and topics that were never seen do not count as missing: DDS may
/// not have discovered them yet.
const DISCOVERY_TIME: Duration = Duration::from_secs(3);

/// Time without an advance of the clock after which simulated time counts as paused.
const PAUSE_TIME: Duration = Duration::from_secs(1);

const STATE_TIMEOUT: Duration = Duration::from_secs(2);

/// Period of the queries of a lifecycle node's state. They correct lost transition events.
const STATE_PERIOD: Duration = Duration::from_secs(5);

/// Number of successive queries without a valid answer after which a lifecycle node with a new server has failed. The
/// first query may be lost before the server has discovered this node.
const MAX_UNANSWERED: u32 = 2;

/// Number of successive queries without a valid answer after which a lifecycle node has failed whose server has answered
/// before (about 14 s). A node with one thread does not answer while it works in a callback.
const MAX_UNANSWERED_LATER: u32 = 6;

/// Receives the index of a signal and its status.
pub(crate) type Report = Arc<dyn Fn(usize, DiagnosticStatus) + Send + Sync>;

/// Observes signals. Polling lasts until the returned tasks are dropped, subscriptions last as long
/// as the node.
pub(crate) fn watch(node: &Arc<Node>, signals: &[Signal], report: &Report) -> Result<Vec<Task<()>>, Message> {
    let mut tasks = Vec::new();
    for (index, Signal { source, target, every, .. }) in signals.iter().enumerate() {
        let reporter = Reporter { index, target: target.clone(), report: Arc::clone(report) };
        match source {
            Source::State { node: name, state } => tasks.push(watch_state(node, name, *state, reporter)?),
            Source::Presence { node: name } => tasks.push(watch_presence(node, name, reporter)),
            Source::Field { topic, kind, field, period } => {
                let clock = node.clock();
                let started = clock.elapsed();
                let last = Arc::new(Mutex::new(None));
                let (noted, field) = (Arc::clone(&last), field.clone());
                let of_message = reporter.clone();
                let of_topic = Arc::clone(kind);
                let read = Arc::new(move |message: Vec<u8>| of_message.field(&of_topic, &field, &message));
                let samples = Arc::new(Mutex::new(Samples { every: *every, reported: None, skipped: None }));
                tasks.extend(watch_skipped(node.clock(), &samples, Arc::clone(&read)));
                let take = move |message: Vec<u8>, _| {
                    let now = clock.elapsed();
                    *noted.lock().unwrap_or_else(PoisonError::into_inner) = Some(now);
                    let mut samples = samples.lock().unwrap_or_else(PoisonError::into_inner);
                    if let Some(message) = samples.next(message, now) {
                        read(message);
                    }
                };
                node.subscribe_when_published(topic, kind, take)?;
                if let (Some(period), Target::Component { .. }) = (period, target) {
                    let last_message = move || *last.lock().unwrap_or_else(PoisonError::into_inner);
                    tasks.push(watch_silence(node.clock(), started, last_message, *period, reporter));
                }
            }
            Source::Rate { topic, period } => tasks.push(watch_rate(node, topic, *period, *every, reporter)?),
        }
    }
    Ok(tasks)
}

/// Messages of a topic, of which at most one per `every` is read. Of the others, only the last one is kept, so that the
/// last value of a topic is never lost.
#[derive(Debug)]
struct Samples {
    every: Duration,
    reported: Option<Duration>,
    skipped: Option<Vec<u8>>,
}

impl Samples {
    /// Returns the message if it must be read now.
    fn next(&mut self, message: Vec<u8>, now: Duration) -> Option<Vec<u8>> {
        self.skipped = Some(message);
        self.due(now)
    }

    /// Returns the last skipped message once `every` has passed since the last report.
    fn due(&mut self, now: Duration) -> Option<Vec<u8>> {
        if self.reported.is_some_and(|reported| now.saturating_sub(reported) < self.every) {
            return None;
        }
        let message = self.skipped.take()?;
        self.reported = Some(now);
        Some(message)
    }
}

/// Periodically reads the last message of a topic if it was skipped. Returns `None` if `every` is zero: then no
/// message is skipped.
fn watch_skipped(
    clock: Arc<Clock>,
    samples: &Arc<Mutex<Samples>>,
    read: Arc<impl Fn(Vec<u8>) + Send + Sync + 'static>,
) -> Option<Task<()>> {
    let samples = Arc::clone(samples);
    let every = samples.lock().unwrap_or_else(PoisonError::into_inner).every;
    let period = every.clamp(MIN_SKIPPED_PERIOD, CHECK_PERIOD);
    (!every.is_zero()).then(|| {
        repeat(period, move || {
            // The lock is held while the message is read, so that a newer one is not reported before it.
            let mut samples = samples.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(message) = samples.due(clock.elapsed()) {
                read(message);
            }
        })
    })
}

fn repeat(period: Duration, mut work: impl FnMut() + Send + 'static) -> Task<()> {
    smol::spawn(async move {
        loop {
            Timer::after(period).await;
            work();
        }
    })
}

#[derive(Clone)]
struct Reporter {
    index: usize,
    target: Target,
    report: Report,
}

impl Reporter {
    fn works(&self, works: bool) {
        if let Target::Component { component, .. } = &self.target {
            self.send(COMPONENT, component, if works { WORKING } else { FAILED }.to_owned());
        }
    }

    /// Reports the value of a field of a message. An element that a list does not have is treated as a number that is not
    /// measured.
    fn field(&self, kind: &MessageType, field: &FieldPath, message: &[u8]) {
        // Data of another definition measure nothing; their type hash has been reported.
        if let Ok(value) = kind.structure.find(field, message, 0) {
            self.value(&value.unwrap_or_default());
        }
    }

    /// Reports a value: that of the attribute, or whether it meets the condition of the component.
    fn value(&self, value: &Value) {
        match &self.target {
            Target::Component { condition, .. } => self.works(condition.holds(value)),
            Target::Attribute { attribute, scale, offset } => {
                // A value that is not a number, such as the NaN of an unmeasured field, measures nothing.
                let Some(number) = number(value) else { return };
                let converted = number * scale + offset;
                if converted.is_finite() {
                    let is_same = (*scale, *offset) == (1.0, 0.0) && value.is_number();
                    // The digits are copied unchanged, because a conversion would round them.
                    let text = if is_same { value.to_string() } else { converted.to_string() };
                    self.send(MEASUREMENT, attribute, text);
                }
            }
        }
    }

    fn send(&self, message: &str, key: &str, value: String) {
        let values = vec![KeyValue { key: key.to_owned(), value }];
        let status = DiagnosticStatus { message: message.to_owned(), values, ..DiagnosticStatus::default() };
        (self.report)(self.index, status);
    }
}

/// Reports a component as failed while no message has arrived for `period`, before the first message
/// for at least the discovery time. Messages themselves are reported by the subscription.
fn watch_silence(
    clock: Arc<Clock>,
    started: Duration,
    last_message: impl Fn() -> Option<Duration> + Send + 'static,
    period: Duration,
    reporter: Reporter,
) -> Task<()> {
    repeat(CHECK_PERIOD.min(period), move || {
        let silent_from = match last_message() {
            Some(last) => last + period,
            None => started + period.max(DISCOVERY_TIME),
        };
        if clock.elapsed() > silent_from {
            reporter.works(false);
        }
    })
}

/// Arrivals of messages by the clock of the node.
#[derive(Debug)]
struct Arrivals {
    times: VecDeque<Duration>,
    /// Time of the last count, and the instant since which the clock has had this time.
    counted: (Duration, Instant),
}

impl Arrivals {
    /// Returns the number of arrivals within the last `period`. Returns `None` while simulated time is paused: then no
    /// rate exists, and arrivals are not kept.
    fn count(&mut self, period: Duration, now: Duration, instant: Instant) -> Option<usize> {
        if now > self.counted.0 {
            self.counted = (now, instant);
        } else if instant.saturating_duration_since(self.counted.1) >= PAUSE_TIME {
            self.times.retain(|arrival| *arrival < now);
            return None;
        }
        while self.times.front().is_some_and(|arrival| now.saturating_sub(*arrival) > period) {
            self.times.pop_front();
        }
        Some(self.times.len())
    }
}

/// Reports the messages per second within the last period. Without a condition, a component works if there
/// was any message.
fn watch_rate(
    node: &Arc<Node>,
    topic: &str,
    period: Duration,
    every: Duration,
    reporter: Reporter,
) -> Result<Task<()>, Message> {
    let clock = node.clock();
    let started = clock.elapsed();
    let arrivals = Arrivals { times: VecDeque::new(), counted: (started, Instant::now()) };
    let arrivals = Arc::new(Mutex::new(arrivals));
    let (noted, of_arrivals) = (Arc::clone(&arrivals), node.clock());
    node.subscribe_any(topic, move || {
        noted.lock().unwrap_or_else(PoisonError::into_inner).times.push_back(of_arrivals.elapsed());
    })?;
    let mut first_arrival = None;
    Ok(repeat(every.max(CHECK_PERIOD.min(period)), move || {
        let now = clock.elapsed();
        let mut arrivals = arrivals.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(count) = arrivals.count(period, now, Instant::now()) else { return };
        first_arrival = first_arrival.or(arrivals.times.front().copied());
        drop(arrivals);
        // The rate is known a period after the first message. A topic without messages may not be discovered yet.
        let known_from = match first_arrival {
            Some(first) => first + period,
            None => started + period.max(DISCOVERY_TIME),
        };
        if now < known_from {
            return;
        }
        let rate = count as f64 / period.as_secs_f64();
        match &reporter.target {
            Target::Component { condition, .. } if *condition == Condition::default() => {
                reporter.works(count > 0);
            }
            _ => reporter.value(&Value::from((rate * 100.0).round() / 100.0)),
        }
    }))
}

/// Reports whether a node exists, that is, whether its parameter service does. Nothing is reported during the
/// discovery time, unless the node was seen.
fn watch_presence(node: &Arc<Node>, name: &str, reporter: Reporter) -> Task<()> {
    let service: Caller<GetParameters> = node.caller(&format!("{name}/get_parameters"));
    let started = Instant::now();
    let mut was_seen = false;
    repeat(CHECK_PERIOD, move || {
        let exists = !service.servers().is_empty();
        was_seen |= exists;
        if was_seen || started.elapsed() > DISCOVERY_TIME {
            reporter.works(exists);
        }
    })
}

/// Queries of the state of a lifecycle node.
#[derive(Debug)]
struct StateQueries {
    /// Servers at the last answer.
    servers: BTreeSet<[u8; 16]>,
    answered: Instant,
    /// Number of queries since the last answer.
    unanswered: u32,
}

impl StateQueries {
    /// Returns `true` if the servers have changed since the last answer, or if [`STATE_PERIOD`] has passed.
    fn is_due(&self, servers: &BTreeSet<[u8; 16]>, now: Instant) -> bool {
        self.servers != *servers || now.saturating_duration_since(self.answered) >= STATE_PERIOD
    }

    /// Notes whether the node has the required state, or `None` if it has not answered. Returns the status to report.
    fn note(&mut self, servers: BTreeSet<[u8; 16]>, answer: Option<bool>, now: Instant) -> Option<bool> {
        if answer.is_some() {
            *self = Self { servers, answered: now, unanswered: 0 };
            return answer;
        }
        self.unanswered += 1;
        let limit = if self.servers == servers { MAX_UNANSWERED_LATER } else { MAX_UNANSWERED };
        (self.unanswered >= limit).then_some(false)
    }
}

/// Reports whether a lifecycle node has a state: at the start and the end of each transition, when its service appears
/// or disappears, and periodically. A node whose service does not answer does not have the state.
fn watch_state(
    node: &Arc<Node>,
    name: &str,
    state: PrimaryState,
    reporter: Reporter,
) -> Result<Task<()>, Message> {
    let of_event = reporter.clone();
    let events = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&events);
    let take = move |goal: &State| {
        counter.fetch_add(1, Ordering::Relaxed);
        // A node in a transition has neither the former nor the next state.
        of_event.works(PrimaryState::of(goal) == Some(state));
    };
    let topic = format!("{name}/transition_event");
    if is_lyrical() {
        node.subscribe::<lyrical::TransitionEvent>(&topic, depth(10), move |event| take(&event.goal_state))?;
    } else {
        node.subscribe::<TransitionEvent>(&topic, depth(10), move |event| take(&event.goal_state))?;
    }
    let service: Caller<GetState> = node.caller(&format!("{name}/get_state"));
    let started = Instant::now();
    let mut queries = StateQueries { servers: BTreeSet::new(), answered: started, unanswered: 0 };
    let mut was_seen = false;
    Ok(smol::spawn(async move {
        loop {
            let servers = service.servers();
            was_seen |= !servers.is_empty();
            if servers.is_empty() {
                if was_seen || started.elapsed() > DISCOVERY_TIME {
                    reporter.works(false);
                }
                queries.servers = servers;
            } else if queries.is_due(&servers, Instant::now()) {
                let event_count = events.load(Ordering::Relaxed);
                let answer = service.call(GetStateRequest::default(), STATE_TIMEOUT).await;
                let answer = answer.ok().map(|answer| PrimaryState::of(&answer.current_state) == Some(state));
                // An event during the query shows that the node works, and may be newer than the answer, which is ignored.
                if events.load(Ordering::Relaxed) != event_count {
                    queries.unanswered = 0;
                } else if let Some(works) = queries.note(servers, answer, Instant::now()) {
                    reporter.works(works);
                }
            }
            Timer::after(CHECK_PERIOD).await;
        }
    }))
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeSet, VecDeque};
    use std::sync::{Arc, Mutex};
    use std::time::{Duration, Instant};

    use serde_json::json;

    use super::{Arrivals, Reporter, Samples, Signal, Source, StateQueries};

    #[test]
    fn an_element_that_a_list_does_not_have_meets_no_condition() {
        let text = "topic = \"/scan\"\ntype = \"sensor_msgs/msg/LaserScan\"\nfield = \"ranges[0]\"\n";
        for (target, expected) in [
            ("component = \"c\"\nat_least = 0.05", vec!["TRUE", "FALSE", "FALSE"]),
            ("component = \"c\"\nperiod = 1.0", vec!["TRUE", "TRUE", "TRUE"]),
            ("attribute = \"q\"", vec!["1.5"]),
        ] {
            let Signal { source, target, .. } = toml::from_str(&format!("{text}{target}")).expect("a signal");
            let Source::Field { kind, field, .. } = source else { panic!("{source:?} is no field") };
            let values = Arc::new(Mutex::new(Vec::new()));
            let list = Arc::clone(&values);
            let report = Arc::new(move |_: usize, status: super::DiagnosticStatus| {
                list.lock().expect("no panic").extend(status.values.into_iter().map(|pair| pair.value));
            });
            let reporter = Reporter { index: 0, target, report };
            for ranges in [json!([1.5]), json!([]), json!(["nan"])] {
                let message = kind.structure.encode(&json!({"ranges": ranges})).expect("a message");
                reporter.field(&kind, &field, &message);
            }
            assert_eq!(*values.lock().expect("no panic"), expected);
        }
    }

    #[test]
    fn arrivals_are_counted_within_the_period() {
        let (start, period) = (Instant::now(), Duration::from_secs(2));
        let mut arrivals = Arrivals { times: VecDeque::new(), counted: (Duration::ZERO, start) };
        // The clock runs at five times the real time, with 20 messages per second of the clock.
        for step in 1..=400_u32 {
            let now = Duration::from_millis(50) * step;
            arrivals.times.push_back(now);
            let expected = usize::try_from(step.min(41)).expect("a number");
            assert_eq!(arrivals.count(period, now, start + now / 5), Some(expected));
        }
    }

    #[test]
    fn messages_have_no_rate_while_simulated_time_is_paused() {
        let (start, period) = (Instant::now(), Duration::from_secs(2));
        let seconds = Duration::from_secs;
        let mut arrivals = Arrivals { times: VecDeque::new(), counted: (seconds(0), start) };
        for millis in (8100..=10_000).step_by(100) {
            arrivals.times.push_back(Duration::from_millis(millis));
        }
        assert_eq!(arrivals.count(period, seconds(10), start), Some(20));
        // 20 messages per second arrive during an hour, and are counted every 250 ms.
        for step in 1..=4 * 3600 {
            arrivals.times.extend([seconds(10); 5]);
            let count = arrivals.count(period, seconds(10), start + Duration::from_millis(250) * step);
            assert_eq!(count.is_none(), step >= 4, "{step}");
            assert!(arrivals.times.len() <= 20 + 15, "{}", arrivals.times.len());
        }
        // Time continues, but the sensor has stopped: of 8.1 to 9.9 s, the last five arrivals are within the period.
        let resumed = start + seconds(3601);
        assert_eq!(arrivals.count(period, Duration::from_millis(11_500), resumed), Some(5));
        assert_eq!(arrivals.count(period, seconds(12), resumed), Some(0));
    }

    #[test]
    fn a_lifecycle_node_that_does_not_answer_has_failed() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let (first, second) = (BTreeSet::from([[1; 16]]), BTreeSet::from([[2; 16]]));
        let mut queries = StateQueries { servers: BTreeSet::new(), answered: start, unanswered: 0 };
        assert!(queries.is_due(&first, at(0)));
        assert_eq!(queries.note(first.clone(), None, at(2)), None, "the first query may be lost");
        assert_eq!(queries.note(first.clone(), Some(true), at(3)), Some(true));
        assert!(!queries.is_due(&first, at(7)));
        assert!(queries.is_due(&first, at(8)), "an event may be lost");
        assert_eq!(queries.note(first.clone(), Some(false), at(8)), Some(false));
        assert_eq!(queries.note(first.clone(), Some(true), at(13)), Some(true));
        // The node works in a callback for ten seconds, and stops later.
        for (seconds, answer, expected) in [
            (20, None, None),
            (22, None, None),
            (24, None, None),
            (26, None, None),
            (28, Some(true), Some(true)),
            (35, None, None),
            (37, None, None),
            (39, None, None),
            (41, None, None),
            (43, None, None),
            (45, None, Some(false)),
        ] {
            assert!(queries.is_due(&first, at(seconds)));
            assert_eq!(queries.note(first.clone(), answer, at(seconds)), expected, "{seconds}");
        }
        assert_eq!(queries.note(first, Some(true), at(46)), Some(true));
        // The node has been started again and does not answer.
        for (seconds, expected) in [(47, None), (49, Some(false)), (51, Some(false))] {
            assert!(queries.is_due(&second, at(seconds)));
            assert_eq!(queries.note(second.clone(), None, at(seconds)), expected);
        }
        assert_eq!(queries.note(second, Some(true), at(53)), Some(true));
    }

    #[test]
    fn the_last_message_is_read_even_if_it_follows_a_report_at_once() {
        let every = Duration::from_millis(100);
        let mut samples = Samples { every, reported: None, skipped: None };
        let at = Duration::from_millis;
        assert_eq!(samples.next(vec![1], at(0)), Some(vec![1]));
        assert_eq!(samples.next(vec![2], at(40)), None);
        assert_eq!(samples.next(vec![3], at(50)), None);
        assert_eq!(samples.due(at(90)), None);
        assert_eq!(samples.due(at(100)), Some(vec![3]));
        assert_eq!(samples.due(at(300)), None, "it is read once");
        assert_eq!(samples.next(vec![4], at(310)), Some(vec![4]));
    }
}
