//! The stations of the loop one by one, for those who decide otherwise: they observe, plan and request by themselves.

use std::time::Duration;

use super::monitor::{Base, Changes};
use super::{Answer, Loop, Observation, PlannedStep};

impl Loop {
    /// Takes an observation over without reacting to it.
    pub(crate) fn observe(&mut self, observation: &Observation, now: Duration) {
        self.knowledge.lines += 1;
        self.knowledge.now = self.knowledge.now.max(now);
        let mut changes = Changes::default();
        for event in observation.events.iter().flatten() {
            // What the loop would answer with an error changes nothing.
            let _ = self.monitor(event, &mut changes);
        }
        if changes.base == Base::Watched {
            self.analyze(&mut Vec::new());
        }
    }

    /// The best plan for the situation as it is believed.
    pub(crate) fn plan_anew(&mut self) -> Option<Vec<PlannedStep>> {
        let outcome = self.plan(true);
        self.planner.made.clear();
        outcome.steps
    }

    /// Requests an action without asking whether it can be done.
    pub(crate) fn request_now(&mut self, step: PlannedStep, answers: &mut Vec<Answer>) {
        self.request(step, answers);
    }

    /// Gives the action under way other designs.
    pub(crate) fn reconfigure_now(&mut self, step: PlannedStep, answers: &mut Vec<Answer>) {
        if let Some(mut running) = self.knowledge.running.take() {
            running.step = step;
            self.reconfigure(running.action, &running.step.clone(), answers);
            self.knowledge.running = Some(running);
        }
    }

    /// Whether the goal holds as far as is believed.
    pub(crate) fn is_goal(&self) -> bool {
        self.knowledge.plan.is_none() && self.knowledge.running.is_none() && self.violation().is_none()
    }

    /// The available designs of a function, sorted.
    pub(crate) fn designs_for(&self, function: &str) -> Vec<String> {
        let Some(knowledge) = self.knowledge.mission.knowledge() else { return Vec::new() };
        let designs = knowledge.runtime().available_designs(Some(function)).unwrap_or_default();
        designs.into_iter().map(|design| design.name).collect()
    }
}
