//! Translates `/diagnostics` to input lines of the loop: statuses of the monitors of MROS, ROSA and
//! PLANTA, and diagnostics of drivers by the rules of `ros.toml`.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use metaplan::message::Message;

use crate::diagnostic_rules::{COMPONENT, DiagnosticRule, MEASUREMENT};
use crate::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::interfaces::std_msgs::msg::Header;
use crate::node::{Node, keep_all};

/// Upper limit on the number of warnings about statuses that nothing uses.
const MAX_UNUSED: usize = 20;

/// Diagnostics that are not handled yet. Only the latest status of each subject is kept, so that a
/// slow loop does not fall behind.
#[derive(Debug, Clone, Default)]
pub(crate) struct Diagnosed {
    waiting: Arc<Mutex<Waiting>>,
}

/// Pending statuses by subject, with the header of the last message.
#[derive(Debug, Default)]
struct Waiting {
    header: Header,
    statuses: Vec<(String, DiagnosticStatus)>,
}

impl Diagnosed {
    /// Subscribes to diagnostics and calls `waits` when the first status becomes pending. Repeated
    /// statuses are ignored. An unused status at level WARN or above is reported once, with a rule
    /// that would use it.
    pub(crate) fn subscribe(
        node: &Arc<Node>,
        rules: &[DiagnosticRule],
        waits: impl Fn() + Send + 'static,
    ) -> Result<Self, Message> {
        let diagnosed = Self::default();
        let waiting = Arc::clone(&diagnosed.waiting);
        let rules = rules.to_vec();
        let weak = Arc::downgrade(node);
        let own_name = node.full_name().trim_start_matches('/').to_owned();
        let mut unused: Vec<String> = Vec::new();
        let mut last: HashMap<String, Vec<KeyValue>> = HashMap::new();
        node.subscribe::<DiagnosticArray>("/diagnostics", keep_all(), move |array| {
            let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
            let nobody_waits = waiting.statuses.is_empty();
            waiting.header = array.header;
            for status in array.status {
                let statuses = translated(&rules, &status);
                let is_new = statuses.is_empty()
                    && status.level >= DiagnosticStatus::WARN
                    && !status.name.starts_with(&own_name)
                    && unused.len() < MAX_UNUSED
                    && !unused.contains(&status.name);
                if is_new && let Some(node) = weak.upgrade() {
                    node.warn_once(&suggestion(&status));
                    unused.push(status.name.clone());
                }
                for status in statuses {
                    let keys: Vec<&str> = status.values.iter().map(|pair| pair.key.as_str()).collect();
                    let key = format!("{}\u{0}{}", status.message, keys.join("\u{0}"));
                    if last.insert(key.clone(), status.values.clone()).as_ref() != Some(&status.values) {
                        waiting.statuses.retain(|(known, _)| *known != key);
                        waiting.statuses.push((key, status));
                    }
                }
            }
            if nobody_waits && !waiting.statuses.is_empty() {
                waits();
            }
        })?;
        Ok(diagnosed)
    }

    /// Returns the pending statuses as an input line and clears them.
    pub(crate) fn line(&self) -> String {
        let Waiting { header, statuses } =
            std::mem::take(&mut *self.waiting.lock().unwrap_or_else(PoisonError::into_inner));
        let status = statuses.into_iter().map(|(_, status)| status).collect();
        // Serialisation cannot fail: the message consists of texts and numbers.
        serde_json::to_string(&DiagnosticArray { header, status }).unwrap_or_default()
    }
}

/// Translates a status to the loop's statuses: itself if a monitor of MROS has published it, and
/// the results of matching rules.
fn translated(rules: &[DiagnosticRule], status: &DiagnosticStatus) -> Vec<DiagnosticStatus> {
    let mut statuses: Vec<DiagnosticStatus> =
        rules.iter().filter_map(|rule| rule.translate(status)).collect();
    let spelling =
        [MEASUREMENT, COMPONENT].into_iter().find(|message| status.message.eq_ignore_ascii_case(message));
    statuses
        .extend(spelling.map(|message| DiagnosticStatus { message: message.to_owned(), ..status.clone() }));
    statuses
}

/// Warns about an unused status and proposes a rule.
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
