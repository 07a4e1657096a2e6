//! Reports of the robot, including their handling when a rule exceeds its limits.
//!
//! An update that exceeds the limits leaves the engine unchanged. The failed report is then kept as pending. Each
//! new report retries all pending reports in a single update, until an update succeeds. This is equivalent to
//! applying the last report on each subject.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Delta, Fact, Interrupt, Limits, Symbol};

use crate::knowledge::base::Knowledge;
use crate::knowledge::waiting::{Fault, RobotReport, Waiting, fault};
use crate::message::Message;

impl Knowledge {
    /// Returns the reason why the consequences of pending reports or objectives are unknown. `None` unless inference
    /// has failed. While the consequences are unknown, no design counts as available.
    pub fn fault(&self) -> Option<&Fault> {
        self.waiting.fault.as_ref()
    }

    /// Applies a report about a component, attribute or design, together with pending reports, then sets the pending
    /// objectives. Returns the facts that start or cease to hold by the reports, including conclusions. If inference
    /// fails, the report is kept as pending, and the returned change is empty.
    ///
    /// # Errors
    /// There is no such component, attribute or design.
    pub fn take(&mut self, name: &str, report: RobotReport) -> Result<Delta, Message> {
        let component = self.component(name);
        let name = if matches!(report, RobotReport::Component(_)) { component.as_str() } else { name };
        let mut reports = self.waiting.reports.clone();
        reports.retain(|(subject, earlier)| subject != name || !earlier.is_alike(&report));
        reports.push((name.to_owned(), report));
        let delta = self.update(&reports).map_err(|error| Message::from_ontology(&error))?;
        match self.runtime.apply(delta) {
            Ok(delta) => {
                self.waiting.reports.clear();
                self.waiting.fault = None;
                self.follow(&delta);
                if let Some(objectives) = self.waiting.objectives.take() {
                    // Only objectives of a former version of the mission can have unknown names. They are dropped, because
                    // an error would say that the report has changed nothing.
                    let _ = self.pursue_in_time(&objectives);
                }
                Ok(delta)
            }
            Err(error) => {
                self.waiting.reports = reports;
                self.waiting.fault = Some(fault(&error));
                Ok(Delta::default())
            }
        }
    }

    /// Combines several reports into one update. Of contradictory reports, the later one takes
    /// precedence.
    fn update(&mut self, reports: &[(String, RobotReport)]) -> Result<Delta, ontology::Error> {
        let engine = self.runtime.engine_mut();
        if let [(name, report)] = reports {
            return report.update(engine, name);
        }
        let mut words: BTreeMap<(Symbol, Symbol), Fact> = BTreeMap::new();
        let (mut insert, mut delete) = (BTreeSet::new(), BTreeSet::new());
        for (name, report) in reports {
            let delta = report.update(engine, name)?;
            let word = match report {
                RobotReport::Component(_) | RobotReport::Design(_) | RobotReport::Unmeasured => None,
                RobotReport::Measured(value) => engine.symbols().find_literal(value),
            };
            for fact in delta.insert {
                let is_word =
                    !matches!(report, RobotReport::Measured(_)) || fact.arguments.get(1) == word.as_ref();
                if is_word && fact.arguments.len() == 2 {
                    words.insert((fact.predicate, fact.arguments[0]), fact);
                } else {
                    insert.insert(fact);
                }
            }
            delete.extend(delta.delete);
        }
        insert.extend(words.into_values());
        delete.retain(|fact| !insert.contains(fact));
        Ok(Delta { insert: insert.into_iter().collect(), delete: delete.into_iter().collect() })
    }

    /// Sets the objectives as [`Knowledge::pursue`] does. If reports are pending or inference exceeds its limits, the
    /// objectives are stored and set later.
    ///
    /// # Errors
    /// There is no such function or design.
    pub fn pursue_in_time(&mut self, configuration: &[(String, String)]) -> Result<(), Message> {
        if self.waiting.reports.is_empty() {
            match self.pursue_now(configuration) {
                Ok(()) => {
                    self.waiting.fault = None;
                    self.waiting.objectives = None;
                    return Ok(());
                }
                Err(error @ ontology::Error::Engine(_)) => self.waiting.fault = Some(fault(&error)),
                Err(error) => return Err(Message::from_ontology(&error)),
            }
        }
        self.waiting.objectives = Some(configuration.to_vec());
        Ok(())
    }

    /// Returns the pending reports and objectives, for a snapshot.
    pub fn waiting(&self) -> &Waiting {
        &self.waiting
    }

    /// Restores the pending reports and objectives of a snapshot.
    pub fn set_waiting(&mut self, waiting: Waiting) {
        self.waiting = waiting;
    }

    /// Applies reports and objectives that are pending in another version of this knowledge. Those about entities that
    /// this version lacks are dropped.
    pub fn take_over(&mut self, mut waiting: Waiting) {
        let engine = self.runtime.engine_mut();
        waiting.reports.retain(|(name, report)| report.update(engine, name).is_ok());
        if let Some((name, report)) = waiting.reports.pop() {
            self.waiting = waiting;
            let _ = self.take(&name, report);
        } else {
            self.waiting = Waiting::default();
            // Objectives with unknown names are dropped.
            let _ = waiting.objectives.map(|objectives| self.pursue_in_time(&objectives));
        }
    }

    /// Sets the interrupt that can stop inference in later updates.
    pub fn interrupt(&mut self, interrupt: Interrupt) {
        let limits = Limits { interrupt: Some(interrupt), ..self.runtime.engine().limits().clone() };
        self.runtime.engine_mut().set_limits(limits);
    }

    /// Sets the limit of inference steps per update; see [`rules::Limits`].
    pub fn limit(&mut self, steps: u64) {
        let limits = Limits { steps, ..self.runtime.engine().limits().clone() };
        self.runtime.engine_mut().set_limits(limits);
    }
}
