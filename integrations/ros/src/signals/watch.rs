//! Observation of signals, reported to the loop as statuses.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::Message;
use serde_json::Value;
use smol::{Task, Timer};

use crate::diagnostic_rules::{COMPONENT, MEASUREMENT};
use crate::interfaces::diagnostic_msgs::msg::{DiagnosticStatus, KeyValue};
use crate::interfaces::lifecycle_msgs::msg::{State, TransitionEvent};
use crate::interfaces::lifecycle_msgs::srv::{GetState, GetStateRequest};
use crate::interfaces::lyrical::lifecycle_msgs::msg as lyrical;
use crate::interfaces::rcl_interfaces::srv::GetParameters;
use crate::node::{Caller, Clock, Node, PrimaryState, depth, is_lyrical};
use crate::signals::settings::{Condition, Signal, Source, Target, number};

/// Period of checks whether nodes exist and topics are silent.
const CHECK_PERIOD: Duration = Duration::from_millis(250);

/// Minimum period of checks for skipped messages.
const MIN_SKIPPED_PERIOD: Duration = Duration::from_millis(10);

/// Time after the start during which nodes and topics that were never seen do not count as missing: DDS may
/// not have discovered them yet.
const DISCOVERY_TIME: Duration = Duration::from_secs(3);

const STATE_TIMEOUT: Duration = Duration::from_secs(2);

pub(crate) type Report = Arc<dyn Fn(DiagnosticStatus) + Send + Sync>;

/// Observes signals. Polling lasts until the returned tasks are dropped, subscriptions last as long
/// as the node.
pub(crate) fn watch(node: &Arc<Node>, signals: &[Signal], report: &Report) -> Result<Vec<Task<()>>, Message> {
    let mut tasks = Vec::new();
    for signal in signals {
        let Signal { source, target, every, .. } = signal;
        let reporter = Reporter { target: target.clone(), report: Arc::clone(report) };
        match source {
            Source::State { node: name, state } => tasks.push(watch_state(node, name, *state, reporter)?),
            Source::Presence { node: name } => tasks.push(watch_presence(node, name, reporter)),
            Source::Field { topic, kind, field, period } => {
                let clock = node.clock();
                let started = clock.elapsed();
                let last = Arc::new(Mutex::new(None));
                let (noted, field) = (Arc::clone(&last), field.clone());
                let of_message = reporter.clone();
                let structure = Arc::clone(&kind.structure);
                let read = Arc::new(move |message: Vec<u8>| {
                    // Data of another definition measure nothing; their type hash has been reported.
                    if let Ok(Some(value)) = structure.find(&field, &message, 0) {
                        of_message.value(&value);
                    }
                });
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
    target: Target,
    report: Report,
}

impl Reporter {
    fn works(&self, works: bool) {
        if let Target::Component { component, .. } = &self.target {
            self.send(COMPONENT, component, if works { "TRUE" } else { "FALSE" }.to_owned());
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
        (self.report)(DiagnosticStatus {
            message: message.to_owned(),
            values: vec![KeyValue { key: key.to_owned(), value }],
            ..DiagnosticStatus::default()
        });
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
    let arrivals: Arc<Mutex<VecDeque<Duration>>> = Arc::default();
    let (noted, of_arrivals) = (Arc::clone(&arrivals), node.clock());
    node.subscribe_any(topic, move || {
        noted.lock().unwrap_or_else(PoisonError::into_inner).push_back(of_arrivals.elapsed());
    })?;
    let started = clock.elapsed();
    let mut first_arrival = None;
    Ok(repeat(every.max(CHECK_PERIOD.min(period)), move || {
        let now = clock.elapsed();
        let mut arrivals = arrivals.lock().unwrap_or_else(PoisonError::into_inner);
        while arrivals.front().is_some_and(|arrival| now.saturating_sub(*arrival) > period) {
            arrivals.pop_front();
        }
        let count = arrivals.len();
        first_arrival = first_arrival.or(arrivals.front().copied());
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

/// Reports whether a lifecycle node has a state: at the start and the end of each transition, and when
/// its service appears or disappears.
fn watch_state(
    node: &Arc<Node>,
    name: &str,
    state: PrimaryState,
    reporter: Reporter,
) -> Result<Task<()>, Message> {
    let of_event = reporter.clone();
    let take = move |goal: &State| {
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
    let mut last_servers = None;
    Ok(smol::spawn(async move {
        loop {
            let servers = service.servers();
            if last_servers.as_ref() != Some(&servers) {
                if servers.is_empty() {
                    if last_servers.is_some() || started.elapsed() > DISCOVERY_TIME {
                        reporter.works(false);
                        last_servers = Some(servers);
                    }
                } else if let Ok(answer) = service.call(GetStateRequest::default(), STATE_TIMEOUT).await {
                    reporter.works(PrimaryState::of(&answer.current_state) == Some(state));
                    last_servers = Some(servers);
                }
            }
            Timer::after(CHECK_PERIOD).await;
        }
    }))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::Samples;

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
