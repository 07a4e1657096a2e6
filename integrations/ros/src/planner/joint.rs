//! A mission whose knowledge base joins in, as `/diagnostics` have it.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use metaplan::mapek::{Event, Observation};
use metaplan::message::Errors;
use metaplan::mission::Mission;
use metaplan::planner::Exact;

use crate::diagnosed::Diagnosed;
use crate::node::Node;

/// The mission, and what was diagnosed since it was looked at.
#[derive(Debug)]
pub(crate) struct Joint {
    mission: Mutex<Mission>,
    diagnosed: Diagnosed,
}

impl Joint {
    /// Listens to the diagnostics from now on.
    ///
    /// # Errors
    /// The topic cannot be made.
    pub(crate) fn listen(node: &Arc<Node>, mission: Mission) -> Result<Arc<Self>, Errors> {
        let diagnosed = Diagnosed::hear(node, &[], || {})?;
        Ok(Arc::new(Self { mission: Mutex::new(mission), diagnosed }))
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

    /// The mission, once it has taken over what the diagnostics say of what the knowledge base knows.
    fn lock(&self) -> MutexGuard<'_, Mission> {
        let mut mission = self.mission.lock().unwrap_or_else(PoisonError::into_inner);
        // What is not understood, or not known, is about something else.
        for event in Observation::parse(&self.diagnosed.line()).events.into_iter().flatten() {
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
        mission
    }
}
