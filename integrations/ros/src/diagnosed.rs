//! Converts diagnostics to input lines of the adaptation loop. There are three sources: statuses on `/diagnostics` of
//! the monitors of MROS, ROSA and PLANTA; statuses on `/diagnostics` of drivers, which the rules of `ros.toml`
//! translate; and signals (`[[signals]]` of `ros.toml`), i.e. states and presence of nodes, fields and rates of topics.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use metaplan::mapek::FilterSettings;
use metaplan::message::Message;
use smol::Task;

use crate::diagnostic_rules::{COMPONENT, DiagnosticRule, FAILED, MEASUREMENT};
use crate::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus};
use crate::interfaces::std_msgs::msg::Header;
use crate::node::{Clock, Node, keep_all};
use crate::signals::{self, Signal};

const MAX_UNUSED: usize = 20;

/// Diagnostics and signals that are not handled yet. Only the latest value of each component and attribute is kept, so
/// that a slow loop does not fall behind.
pub(crate) struct Diagnosed {
    queue: Arc<Queue>,
    /// Tasks that observe the signals. They end when this value is dropped.
    _signals: Vec<Task<()>>,
}

impl fmt::Debug for Diagnosed {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Diagnosed").finish_non_exhaustive()
    }
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Sources {
    pub(crate) rules: Vec<DiagnosticRule>,
    pub(crate) signals: Vec<Signal>,
    /// Time after which an equal value is reported again, by attribute (see [`repeats`]).
    pub(crate) repeats: BTreeMap<String, Duration>,
}

/// Returns the time after which an equal value must be reported again, for each attribute whose filter needs
/// repetitions. The time is a quarter of the filter's period or of its debounce time (the shorter one), or zero if
/// every sample counts. Without repetitions, the filter would treat a constant value as silence.
pub(crate) fn repeats(filters: &FilterSettings) -> BTreeMap<String, Duration> {
    let mut repeats = BTreeMap::new();
    for (attribute, measured) in &filters.measured {
        let debounce = Some(measured.debounce).filter(|debounce| !debounce.is_zero());
        let times = [measured.period, debounce].into_iter().flatten().map(|time| time / 4);
        let all_samples = (measured.agree > 0 || measured.jump.is_some()).then_some(Duration::ZERO);
        if let Some(time) = times.chain(all_samples).min() {
            repeats.insert(attribute.clone(), time);
        }
    }
    repeats
}

struct Queue {
    state: Mutex<QueueState>,
    repeats: BTreeMap<String, Duration>,
    waits: Box<dyn Fn() + Send + Sync>,
    clock: Arc<Clock>,
}

/// Message of a status, and the key of one of its values.
type Subject = (String, String);

/// Origin of a status. The statuses of one component by several origins are combined.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Origin {
    /// All monitors of MROS, ROSA and PLANTA, of which the last status counts.
    Monitors,
    /// A driver's diagnostic with this name.
    Diagnostic(String),
    /// The signal with this index in `ros.toml`.
    Signal(usize),
}

/// State of a [`Queue`]. Each of its statuses has one value.
#[derive(Debug, Default)]
struct QueueState {
    header: Header,
    pending: Vec<(Subject, DiagnosticStatus)>,
    statuses: HashMap<Subject, BTreeMap<Origin, DiagnosticStatus>>,
    /// Last value of each subject, with the time of its report.
    last: HashMap<Subject, (String, Duration)>,
}

impl Queue {
    /// Adds statuses, which replace pending ones of their subjects. The last value of a subject is ignored when it is
    /// repeated, unless a filter needs the repetition.
    fn add(&self, header: Header, statuses: impl IntoIterator<Item = (Origin, DiagnosticStatus)>) {
        let now = self.clock.elapsed();
        let mut guard = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let state = &mut *guard;
        let is_first = state.pending.is_empty();
        state.header = header;
        let mut subjects = Vec::new();
        for (origin, status) in statuses {
            subjects.extend(state.note(&origin, status));
        }
        for subject in subjects {
            let Some(status) = state.combined(&subject) else { continue };
            let value = value(&status);
            let repeat = self.repeats.get(&subject.1);
            let is_repeated = state.last.get(&subject).is_some_and(|(last, since)| {
                last == value && repeat.is_none_or(|repeat| now.saturating_sub(*since) < *repeat)
            });
            if !is_repeated {
                state.last.insert(subject.clone(), (value.to_owned(), now));
                state.pending.retain(|(pending, _)| *pending != subject);
                state.pending.push((subject, status));
            }
        }
        let waits = is_first && !state.pending.is_empty();
        drop(guard);
        if waits {
            (self.waits)();
        }
    }

    /// Forgets the last measurements of the selected attributes, so that a repetition is reported, too.
    fn forget_measurements(&self, is_selected: impl Fn(&str) -> bool) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.last.retain(|(message, attribute), _| message != MEASUREMENT || !is_selected(attribute));
    }

    /// Returns the pending statuses with the last header, and clears them.
    fn take(&self) -> DiagnosticArray {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let pending = std::mem::take(&mut state.pending);
        let status = pending.into_iter().map(|(_, status)| status).collect();
        DiagnosticArray { header: state.header.clone(), status }
    }
}

impl QueueState {
    /// Notes each value of a status as the last one of its subject and origin, and returns the subjects. If a key
    /// occurs several times, its first value counts, as in the loop.
    fn note(&mut self, origin: &Origin, mut status: DiagnosticStatus) -> Vec<Subject> {
        let values = std::mem::take(&mut status.values);
        // The last measurement of an attribute counts, from whichever origin.
        let origin = if status.message == COMPONENT { origin } else { &Origin::Monitors };
        let (mut keys, mut subjects) = (HashSet::new(), Vec::new());
        for pair in values {
            let key = pair.key.trim().to_owned();
            if keys.insert(key.clone()) {
                let subject = (status.message.clone(), key);
                let single = DiagnosticStatus { values: vec![pair], ..status.clone() };
                self.statuses.entry(subject.clone()).or_default().insert(origin.clone(), single);
                subjects.push(subject);
            }
        }
        subjects
    }

    /// Returns the status of a subject: a failure if any origin reports one, otherwise the status of the monitors if
    /// they have reported one, because only they distinguish RECOVERED from TRUE.
    fn combined(&self, subject: &Subject) -> Option<DiagnosticStatus> {
        let statuses = self.statuses.get(subject)?;
        statuses.values().find(|status| value(status) == FAILED).or_else(|| statuses.values().next()).cloned()
    }
}

fn value(status: &DiagnosticStatus) -> &str {
    status.values.first().map_or("", |pair| pair.value.as_str())
}

impl Diagnosed {
    /// Subscribes to diagnostics and signals, and calls `waits` when the first status becomes
    /// pending. An unused status of another node at level WARN or above is reported once, with a
    /// rule that would use it. At most [`MAX_UNUSED`] statuses are reported.
    pub(crate) fn subscribe(
        node: &Arc<Node>,
        sources: Sources,
        waits: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, Message> {
        let Sources { rules, signals, repeats } = sources;
        let clock = node.clock();
        let queue = Arc::new(Queue { state: Mutex::default(), repeats, waits: Box::new(waits), clock });
        let weak = Arc::downgrade(node);
        let own_name = node.full_name().trim_start_matches('/').to_owned();
        let mut unused: Vec<String> = Vec::new();
        let of_topic = Arc::clone(&queue);
        node.subscribe::<DiagnosticArray>("/diagnostics", keep_all(), move |array| {
            let mut statuses = Vec::new();
            for status in array.status {
                let translated = translated(&rules, &status);
                let is_new = translated.is_empty()
                    && status.level >= DiagnosticStatus::WARN
                    && !status.name.starts_with(&own_name)
                    && unused.len() < MAX_UNUSED
                    && !unused.contains(&status.name);
                if is_new && let Some(node) = weak.upgrade() {
                    node.warn_once(&suggestion(&status));
                    unused.push(status.name.clone());
                }
                statuses.extend(translated);
            }
            of_topic.add(array.header, statuses);
        })?;
        let (of_signals, clock) = (Arc::clone(&queue), node.clock());
        let report: signals::Report = Arc::new(move |index, status| {
            let header = Header { stamp: clock.stamp(), ..Header::default() };
            of_signals.add(header, [(Origin::Signal(index), status)]);
        });
        let signals = signals::watch(node, &signals, &report)?;
        Ok(Self { queue, _signals: signals })
    }

    /// Forgets the last measurements of the selected attributes, whose believed values may have changed otherwise. The
    /// next measurement is then reported even if it repeats the last one.
    pub(crate) fn forget_measurements(&self, is_selected: impl Fn(&str) -> bool) {
        self.queue.forget_measurements(is_selected);
    }

    /// Returns the pending statuses as an input line and clears them.
    pub(crate) fn line(&self) -> String {
        // Serialisation cannot fail: the message consists of texts and numbers.
        serde_json::to_string(&self.queue.take()).unwrap_or_default()
    }
}

/// Translates a status to statuses that the loop can read: the results of matching rules, and the status itself if
/// its message is one of MROS's monitors.
fn translated(rules: &[DiagnosticRule], status: &DiagnosticStatus) -> Vec<(Origin, DiagnosticStatus)> {
    let mut results: Vec<DiagnosticStatus> = rules.iter().filter_map(|rule| rule.translate(status)).collect();
    // The last result for a component replaces the earlier ones of the same diagnostic.
    results.sort_by_key(|result| value(result) == FAILED);
    let mut statuses: Vec<(Origin, DiagnosticStatus)> =
        results.into_iter().map(|result| (Origin::Diagnostic(status.name.clone()), result)).collect();
    let spelling =
        [MEASUREMENT, COMPONENT].into_iter().find(|message| status.message.eq_ignore_ascii_case(message));
    let of_monitor = |message: &str| DiagnosticStatus { message: message.to_owned(), ..status.clone() };
    statuses.extend(spelling.map(|message| (Origin::Monitors, of_monitor(message))));
    statuses
}

fn suggestion(status: &DiagnosticStatus) -> String {
    let level = match status.level {
        DiagnosticStatus::WARN => "WARN",
        DiagnosticStatus::ERROR => "ERROR",
        _ => "STALE",
    };
    format!(
        "the diagnostic `{name}` ({level}: {message}) changes nothing; a rule in ros.toml makes it the status of a component: \
         [[diagnostics]] name = {name:?}, component = \"COMPONENT\"",
        name = status.name,
        message = status.message
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Mutex;

    use super::{
        COMPONENT, DiagnosticRule, DiagnosticStatus, Header, MEASUREMENT, Origin, Queue, translated,
    };
    use crate::interfaces::diagnostic_msgs::msg::KeyValue;
    use crate::node::Clock;

    const RULE: &str = "name = \"lidar: *\"\ncomponent = \"c_lidar\"";

    /// A queue whose statuses are handled at once, with the last values that the loop has received.
    struct Handled {
        rules: Vec<DiagnosticRule>,
        queue: Queue,
        values: BTreeMap<String, String>,
    }

    impl Handled {
        fn new(rules: &[&str]) -> Self {
            let rules = rules.iter().map(|rule| toml::from_str(rule).expect("a rule")).collect();
            let queue = Queue {
                state: Mutex::default(),
                repeats: BTreeMap::new(),
                waits: Box::new(|| {}),
                clock: Clock::new(),
            };
            Self { rules, queue, values: BTreeMap::new() }
        }

        /// Adds the statuses of an array, and returns the number of values that the loop receives.
        fn publish(&mut self, array: &[DiagnosticStatus]) -> usize {
            let translated = array.iter().flat_map(|status| translated(&self.rules, status));
            self.queue.add(Header::default(), translated);
            self.handle()
        }

        fn signal(&mut self, index: usize, status: DiagnosticStatus) -> usize {
            self.queue.add(Header::default(), [(Origin::Signal(index), status)]);
            self.handle()
        }

        fn handle(&mut self) -> usize {
            let pairs: Vec<KeyValue> =
                self.queue.take().status.into_iter().flat_map(|status| status.values).collect();
            let count = pairs.len();
            self.values.extend(pairs.into_iter().map(|KeyValue { key, value }| (key, value)));
            count
        }

        fn value(&self, key: &str) -> &str {
            self.values.get(key).map_or("", String::as_str)
        }
    }

    fn driver(name: &str, level: u8) -> DiagnosticStatus {
        DiagnosticStatus { name: name.to_owned(), level, ..DiagnosticStatus::default() }
    }

    fn monitor(message: &str, pairs: &[(&str, &str)]) -> DiagnosticStatus {
        let pair = |(key, value): &(&str, &str)| KeyValue { key: (*key).into(), value: (*value).into() };
        DiagnosticStatus {
            message: message.to_owned(),
            values: pairs.iter().map(pair).collect(),
            ..DiagnosticStatus::default()
        }
    }

    /// Returns all sequences of `length` items.
    fn sequences<T: Copy>(items: &[T], length: usize) -> Vec<Vec<T>> {
        (0..length).fold(vec![Vec::new()], |shorter, _| {
            let longer = |sequence: &Vec<T>| {
                items.iter().map(|item| [sequence.as_slice(), &[*item]].concat()).collect::<Vec<_>>()
            };
            shorter.iter().flat_map(longer).collect()
        })
    }

    #[test]
    fn a_component_has_failed_while_one_of_its_diagnostics_reports_a_failure() {
        let mut robot = Handled::new(&[RULE]);
        let array = [driver("lidar: connection", 2), driver("lidar: frequency", 0)];
        assert_eq!((robot.publish(&array), robot.value("c_lidar")), (1, "FALSE"));
        assert_eq!(robot.publish(&array), 0, "the next period repeats the values");
        // One array in which the failure moves from one status to the other.
        let array = [driver("lidar: connection", 0), driver("lidar: frequency", 2)];
        assert_eq!(robot.publish(&array), 0);
        let items: Vec<(&str, u8)> =
            ["lidar: a", "lidar: b"].into_iter().flat_map(|name| [(name, 0), (name, 2)]).collect();
        for sequence in sequences(&items, 4) {
            let (mut robot, mut levels) = (Handled::new(&[RULE]), BTreeMap::new());
            for (name, level) in &sequence {
                robot.publish(&[driver(name, *level)]);
                levels.insert(*name, *level);
                let expected = if levels.values().any(|level| *level == 2) { "FALSE" } else { "TRUE" };
                assert_eq!(robot.value("c_lidar"), expected, "{sequence:?}");
            }
        }
    }

    #[test]
    fn the_rules_for_a_component_are_combined_for_each_diagnostic() {
        let strict = "name = \"*front\"\ncomponent = \"c_lidar\"\nfails_at = \"WARN\"";
        for rules in [[strict, RULE], [RULE, strict]] {
            let mut robot = Handled::new(&rules);
            robot.publish(&[driver("lidar: front", 1)]);
            assert_eq!(robot.value("c_lidar"), "FALSE", "{rules:?}");
            robot.publish(&[driver("lidar: front", 0)]);
            assert_eq!(robot.value("c_lidar"), "TRUE", "{rules:?}");
        }
        // Two rules for two texts of one diagnostic: the last text counts.
        let by_text = ["message = \"*lost\"\ncomponent = \"c\"", "message = \"found\"\ncomponent = \"c\""];
        let mut robot = Handled::new(&by_text);
        for (message, level, expected) in [("lost", 2, "FALSE"), ("found", 0, "TRUE")] {
            robot.publish(&[DiagnosticStatus { message: message.to_owned(), ..driver("lidar", level) }]);
            assert_eq!(robot.value("c"), expected);
        }
    }

    #[test]
    fn the_sources_of_a_component_are_combined() {
        let status = |value| monitor(COMPONENT, &[("c_lidar", value)]);
        let mut robot = Handled::new(&[RULE]);
        robot.signal(0, status("TRUE"));
        robot.signal(1, status("FALSE"));
        assert_eq!((robot.signal(0, status("TRUE")), robot.value("c_lidar")), (0, "FALSE"));
        robot.signal(1, status("TRUE"));
        assert_eq!(robot.value("c_lidar"), "TRUE");
        robot.publish(&[driver("lidar: driver", 3)]);
        assert_eq!((robot.publish(&[status("RECOVERED")]), robot.value("c_lidar")), (0, "FALSE"));
        robot.publish(&[driver("lidar: driver", 0)]);
        assert_eq!(robot.value("c_lidar"), "RECOVERED", "only monitors distinguish it from TRUE");
        robot.publish(&[status("ERROR")]);
        assert_eq!((robot.signal(0, status("TRUE")), robot.value("c_lidar")), (0, "ERROR"));
    }

    #[test]
    fn a_measurement_is_repeated_after_its_believed_value_may_have_changed() {
        let mut robot = Handled::new(&[]);
        let statuses = [
            monitor(MEASUREMENT, &[("battery", "0.2"), ("light", "9")]),
            monitor(COMPONENT, &[("battery", "TRUE")]),
        ];
        assert_eq!((robot.publish(&statuses), robot.publish(&statuses)), (3, 0));
        robot.queue.forget_measurements(|attribute| attribute == "battery");
        assert_eq!(robot.publish(&statuses), 1, "only the measurement of the battery");
        assert_eq!(robot.publish(&statuses), 0);
    }

    #[test]
    fn the_last_value_of_each_key_counts_whichever_keys_its_status_has() {
        for (message, values) in [(COMPONENT, ["FALSE", "TRUE"]), (MEASUREMENT, ["0.2", "0.9"])] {
            let [low, high] = values;
            let statuses: [&[(&str, &str)]; 6] = [
                &[("a", low)],
                &[("a", high)],
                &[("b", low)],
                &[("a", high), ("b", high)],
                &[("b", low), ("a", low)],
                // The loop ignores a second value of a key.
                &[("a", low), ("a ", high)],
            ];
            for sequence in sequences(&statuses, 3) {
                let (mut robot, mut expected) = (Handled::new(&[]), BTreeMap::new());
                for pairs in &sequence {
                    robot.publish(&[monitor(message, pairs)]);
                    expected.extend(pairs.iter().rev().map(|(key, value)| (key.trim(), *value)));
                    for (key, value) in &expected {
                        assert_eq!(robot.value(key), *value, "{sequence:?}");
                    }
                    assert_eq!(robot.publish(&[monitor(message, pairs)]), 0, "{sequence:?}");
                }
            }
        }
    }
}
