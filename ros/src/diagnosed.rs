//! `/diagnostics` to lines of events: what MROS's, ROSA's and PLANTA's monitors say of components and attributes.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use metaplan::message::Message;

use crate::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::interfaces::std_msgs::msg::Header;
use crate::node::{Node, keep_all};

/// The messages by which diagnostics say what concerns us, in the spelling of MROS.
const CONCERN: [&str; 2] = ["QA status", "Component status"];

/// What was diagnosed and not yet handled: of each thing the last that was said of it, so that nobody falls behind who is told faster than
/// he can follow.
#[derive(Debug, Clone, Default)]
pub(crate) struct Diagnosed {
    waiting: Arc<Mutex<Waiting>>,
}

/// What waits, by what it is about, with the header of the last message.
#[derive(Debug, Default)]
struct Waiting {
    header: Header,
    statuses: Vec<(String, DiagnosticStatus)>,
}

impl Diagnosed {
    /// Listens; says when something waits that nothing waited before. What says the same as before does not wait.
    pub(crate) fn hear(node: &Arc<Node>, waits: impl Fn() + Send + 'static) -> Result<Self, Message> {
        let own = Self::default();
        let waiting = Arc::clone(&own.waiting);
        let mut last: HashMap<String, Vec<KeyValue>> = HashMap::new();
        node.subscribe::<DiagnosticArray>("/diagnostics", keep_all(), move |array| {
            let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
            let nobody_waits = waiting.statuses.is_empty();
            waiting.header = array.header;
            for status in array.status.into_iter().filter(|own| CONCERN.contains(&own.message.as_str())) {
                let keys: Vec<&str> = status.values.iter().map(|pair| pair.key.as_str()).collect();
                let key = format!("{}\u{0}{}", status.message, keys.join("\u{0}"));
                if last.insert(key.clone(), status.values.clone()).as_ref() != Some(&status.values) {
                    waiting.statuses.retain(|(known, _)| *known != key);
                    waiting.statuses.push((key, status));
                }
            }
            if nobody_waits && !waiting.statuses.is_empty() {
                waits();
            }
        })?;
        Ok(own)
    }

    /// What waits, as a line of events.
    pub(crate) fn line(&self) -> String {
        let Waiting { header, statuses } =
            std::mem::take(&mut *self.waiting.lock().unwrap_or_else(PoisonError::into_inner));
        let status = statuses.into_iter().map(|(_, status)| status).collect();
        // Texts and numbers are always data.
        serde_json::to_string(&DiagnosticArray { header, status }).unwrap_or_default()
    }
}
