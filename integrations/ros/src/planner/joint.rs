//! Mission whose knowledge base is updated from `/diagnostics`.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use metaplan::mapek::{Event, Observation};
use metaplan::message::Errors;
use metaplan::mission::Mission;
use metaplan::planner::Exact;

use crate::diagnosed::{Diagnosed, Sources};
use crate::node::Node;

#[derive(Debug)]
pub(crate) struct Joint {
    mission: Mutex<Mission>,
    diagnosed: Diagnosed,
}

impl Joint {
    pub(crate) fn listen(node: &Arc<Node>, mission: Mission) -> Result<Arc<Self>, Errors> {
        let diagnosed = Diagnosed::subscribe(node, Sources::default(), || {})?;
        Ok(Arc::new(Self { mission: Mutex::new(mission), diagnosed }))
    }

    pub(crate) fn mission(&self) -> Mission {
        self.lock().clone()
    }

    /// Returns the names of the currently available designs, in lower case.
    pub(crate) fn available(&self) -> BTreeSet<String> {
        self.designs(true)
    }

    /// Returns the names of the currently unavailable designs of the knowledge base, in lower case. The availability of
    /// designs that only the problem has does not change.
    pub(crate) fn unavailable(&self) -> BTreeSet<String> {
        self.designs(false)
    }

    fn designs(&self, are_available: bool) -> BTreeSet<String> {
        let mission = self.lock();
        let designs = mission.knowledge().map(|knowledge| knowledge.view().function_designs());
        let designs = designs.unwrap_or_default().into_iter();
        let selected = designs.filter(|design| design.available == are_available);
        selected.map(|design| design.individual.name.to_lowercase()).collect()
    }

    /// Locks the mission and applies the pending diagnostics to it.
    fn lock(&self) -> MutexGuard<'_, Mission> {
        let mut mission = self.mission.lock().unwrap_or_else(PoisonError::into_inner);
        // Diagnostics that the mission rejects are ignored, because they may concern other devices.
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
