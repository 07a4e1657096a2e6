//! A mission whose knowledge base joins in, as `/diagnostics` have it.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use metaplan::encodings::Exact;
use metaplan::mapek::{Event, Observation};
use metaplan::message::Message;
use metaplan::mission::Mission;

use crate::interfaces::diagnostic_msgs::msg::DiagnosticArray;
use crate::node::{Node, keep_all};

/// The mission.
#[derive(Debug)]
pub(crate) struct Joint {
    mission: Mutex<Mission>,
}

impl Joint {
    /// Listens to the diagnostics from now on.
    ///
    /// # Errors
    /// The topic cannot be made.
    pub(crate) fn listen(node: &Arc<Node>, mission: Mission) -> Result<Arc<Self>, Vec<Message>> {
        let joint = Arc::new(Self { mission: Mutex::new(mission) });
        let hears = Arc::clone(&joint);
        node.subscribe::<DiagnosticArray>("/diagnostics", keep_all(), move |array| hears.hear(&array))
            .map_err(|message| vec![message])?;
        Ok(joint)
    }

    /// The mission as it is now.
    pub(crate) fn mission(&self) -> Mission {
        self.lock().clone()
    }

    /// The designs that are available now, as problems call them.
    pub(crate) fn available(&self) -> BTreeSet<String> {
        let mission = self.lock();
        let designs = mission.knowledge().map(|knowledge| knowledge.view().function_designs());
        let available = designs.unwrap_or_default().into_iter().filter(|design| design.available);
        available.map(|design| design.individual.name.to_lowercase()).collect()
    }

    fn lock(&self) -> MutexGuard<'_, Mission> {
        self.mission.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes over what the diagnostics say of what the knowledge base knows.
    fn hear(&self, array: &DiagnosticArray) {
        let Ok(text) = serde_json::to_string(array) else { return };
        let mut mission = self.lock();
        // What is not understood, or not known, is about something else.
        for event in Observation::parse(&text).events.into_iter().flatten() {
            let _ = match event {
                Event::Measured { attribute, value } => {
                    mission.set(&attribute, &Exact::from(value).to_string())
                }
                Event::Component { component, status } => mission
                    .knowledge_mut()
                    .map_or(Ok(()), |knowledge| knowledge.report(&component, status).map(|_| ())),
                _ => Ok(()),
            };
        }
    }
}
