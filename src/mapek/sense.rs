//! Applies reports of sensors, components and functions to the beliefs. Noise filters can delay or reject a report.

use num_rational::BigRational;
use ontology::tomasys::change::Status;

use crate::knowledge::RobotReport;
use crate::mapek::fields::Refusal;
use crate::mapek::filter::Accepted;
use crate::mapek::monitor::BeliefUpdate;
use crate::message::did_you_mean;
use crate::mission::unused_measurement;

impl BeliefUpdate<'_> {
    /// Applies a report that a function has a design, or has none (`None`), without a request of the loop. The report
    /// is believed from now on. If it is not new, or a reconfiguration of the function is pending, the plan stays as it
    /// is. Otherwise, an action under way that uses the function adopts the reported design, and the loop later
    /// searches for a better plan. If the function has no design, but the action needs one, a new plan is needed.
    pub(super) fn observed(&mut self, function: &str, design: Option<&str>) -> Result<(), Refusal> {
        let designs = self.beliefs.mission.designs_of(function);
        if designs.is_empty() {
            return Err(Refusal::new("M306", format!("there is no function `{function}` that has designs")));
        }
        if let Some(design) = design.filter(|design| designs.iter().all(|name| name != design)) {
            let suggestion = did_you_mean(design, designs.iter().map(String::as_str));
            let text =
                format!("{function} has no design `{design}`; it has {}{suggestion}", designs.join(", "));
            return Err(Refusal::new("M306", text));
        }
        let before = match design {
            Some(design) => self.beliefs.configuration.insert(function.to_owned(), design.to_owned()),
            None => self.beliefs.configuration.remove(function),
        };
        // If a request is pending, the action continues with the requested design.
        let pending = self.beliefs.pending().find(|(name, _)| *name == function).map(|(_, to)| to.to_owned());
        let is_news = before.as_deref() != design;
        let is_crossing =
            (is_news || design.is_none()) && pending.as_ref().is_some_and(|to| design != Some(to));
        let latest = is_crossing.then_some(self.beliefs.effects);
        self.beliefs.receipts.observe(function, latest, pending.is_some());
        if !is_news || pending.is_some() {
            return Ok(());
        }
        let Some(running) = self
            .beliefs
            .running
            .as_mut()
            .filter(|running_action| running_action.step.design(function).is_some())
        else {
            return Ok(());
        };
        if let Some(design) = design {
            running.step = running.step.with_design(function, design);
            self.changes.facts = true;
            self.changes.predicates = true;
            self.changes.observed = true;
        } else {
            let action = running.action;
            self.changes
                .reasons
                .push(format!("{function} no longer has a design, but action {action} needs {function}"));
        }
        Ok(())
    }

    pub(super) fn accept(&mut self, accepted: Accepted) -> Result<(), Refusal> {
        match accepted {
            Accepted::Value(attribute, value) => self.measured(&attribute, &value),
            Accepted::Status(component, status) => {
                self.report("component", &component, RobotReport::Component(status))
            }
            Accepted::Unknown(attribute) => self.report("attribute", &attribute, RobotReport::Unmeasured),
        }
    }

    pub(super) fn sampled(&mut self, attribute: &str, value: &BigRational) -> Result<(), Refusal> {
        let is_known = self.monitor.attributes.contains(attribute);
        let (states, now, filtered) =
            (&mut self.beliefs.filters, self.beliefs.now, &mut self.changes.filtered);
        if !is_known {
            return self.measured(attribute, value);
        }
        if self.monitor.unused_attributes.contains(attribute) {
            return Err(Refusal::new("M306", unused_measurement(attribute)));
        }
        match self.monitor.filters.sample(states, now, attribute, value, filtered) {
            Some(value) => self.measured(attribute, &value),
            None => Ok(()),
        }
    }

    pub(super) fn component(&mut self, component: &str, status: Status) -> Result<(), Refusal> {
        let name = match self.monitor.components.get(component) {
            Some(name) => Some(name.clone()),
            None => self.beliefs.mission.knowledge().and_then(|base| base.known_component(component)),
        };
        if let Some(name) = &name {
            self.monitor.components.insert(component.to_owned(), name.clone());
        }
        let (states, now, filtered) =
            (&mut self.beliefs.filters, self.beliefs.now, &mut self.changes.filtered);
        let is_held =
            name.is_some_and(|name| !self.monitor.filters.report(states, now, &name, status, filtered));
        if is_held { Ok(()) } else { self.report("component", component, RobotReport::Component(status)) }
    }
}
