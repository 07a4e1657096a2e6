//! Converts diagnostics to input lines of the adaptation loop. There are three sources: statuses on `/diagnostics` of
//! the monitors of MROS, ROSA and PLANTA; statuses on `/diagnostics` of drivers, which the rules of `ros.toml`
//! translate; and signals (`[[signals]]` of `ros.toml`), i.e. states and presence of nodes, fields and rates of topics.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use metaplan::mapek::FilterSettings;
use metaplan::message::Message;
use smol::Task;

use crate::diagnostic_rules::{COMPONENT, DiagnosticRule, MEASUREMENT};
use crate::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::interfaces::std_msgs::msg::Header;
use crate::node::{Clock, Node, keep_all};
use crate::signals::{self, Signal};

const MAX_UNUSED: usize = 20;

/// Diagnostics and signals that are not handled yet. Only the latest status of each subject (message and keys of the
/// status) is kept, so that a slow loop does not fall behind.
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

#[derive(Debug, Default)]
struct QueueState {
    header: Header,
    statuses: Vec<(String, DiagnosticStatus)>,
    /// Last values by subject (message and keys of a status), with the time of their report.
    last: HashMap<String, (Vec<KeyValue>, Duration)>,
}

impl Queue {
    /// Adds statuses, which replace pending ones of their subjects. A status with the last values of its
    /// subject is ignored, unless a filter needs the repetition.
    fn add(&self, header: Header, statuses: impl IntoIterator<Item = DiagnosticStatus>) {
        let now = self.clock.elapsed();
        let mut guard = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let state = &mut *guard;
        let is_first = state.statuses.is_empty();
        state.header = header;
        for status in statuses {
            let keys: Vec<&str> = status.values.iter().map(|pair| pair.key.as_str()).collect();
            let subject = format!("{}\u{0}{}", status.message, keys.join("\u{0}"));
            let repeat = keys.iter().filter_map(|key| self.repeats.get(*key)).min();
            let is_known = state.last.get(&subject).is_some_and(|(values, since)| {
                *values == status.values && repeat.is_none_or(|repeat| now.saturating_sub(*since) < *repeat)
            });
            if !is_known {
                state.last.insert(subject.clone(), (status.values.clone(), now));
                state.statuses.retain(|(known, _)| *known != subject);
                state.statuses.push((subject, status));
            }
        }
        let waits = is_first && !state.statuses.is_empty();
        drop(guard);
        if waits {
            (self.waits)();
        }
    }
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
        let report: signals::Report = Arc::new(move |status| {
            of_signals.add(Header { stamp: clock.stamp(), ..Header::default() }, [status]);
        });
        let signals = signals::watch(node, &signals, &report)?;
        Ok(Self { queue, _signals: signals })
    }

    /// Returns the pending statuses as an input line and clears them.
    pub(crate) fn line(&self) -> String {
        let mut state = self.queue.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (header, statuses) = (state.header.clone(), std::mem::take(&mut state.statuses));
        drop(state);
        let status = statuses.into_iter().map(|(_, status)| status).collect();
        // Serialisation cannot fail: the message consists of texts and numbers.
        serde_json::to_string(&DiagnosticArray { header, status }).unwrap_or_default()
    }
}

/// Translates a status to statuses that the loop can read: the results of matching rules, and the status itself if
/// its message is one of MROS's monitors.
fn translated(rules: &[DiagnosticRule], status: &DiagnosticStatus) -> Vec<DiagnosticStatus> {
    let mut statuses: Vec<DiagnosticStatus> =
        rules.iter().filter_map(|rule| rule.translate(status)).collect();
    let spelling =
        [MEASUREMENT, COMPONENT].into_iter().find(|message| status.message.eq_ignore_ascii_case(message));
    statuses
        .extend(spelling.map(|message| DiagnosticStatus { message: message.to_owned(), ..status.clone() }));
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
