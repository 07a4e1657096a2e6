//! Reports of the robot, and what becomes of them where a rule runs away: they stay, and nothing follows until rules come
//! to an end again.
//!
//! An update after which a rule runs away leaves the engine as it was. So the report is kept beside it, with all that come
//! later, and with each new report all of them are told at once: what follows then is what follows for whoever hears the
//! last word on everything.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Delta, Fact, Interrupt, Limits, Symbol};

use crate::knowledge::base::Knowledge;
use crate::knowledge::waiting::{Fault, RobotReport, Waiting, fault};
use crate::message::Message;

impl Knowledge {
    /// Why it is not known what follows, if it is not: no design counts as available then.
    pub fn fault(&self) -> Option<&Fault> {
        self.waiting.fault.as_ref()
    }

    /// Takes a report over; returns what holds since, and what no more.
    ///
    /// # Errors
    /// There is no such component or attribute.
    pub fn take(&mut self, name: &str, report: RobotReport) -> Result<Delta, Message> {
        let component = self.component(name);
        let name = if matches!(report, RobotReport::Component(_)) { component.as_str() } else { name };
        let mut reports = self.waiting.reports.clone();
        reports.retain(|(known, other)| known != name || !other.is_alike(&report));
        reports.push((name.to_owned(), report));
        let delta = self.update(&reports).map_err(|error| Message::from_ontology(&error))?;
        match self.runtime.apply(delta) {
            Ok(delta) => {
                self.waiting.reports.clear();
                self.waiting.fault = None;
                self.follow(&delta);
                if let Some(objectives) = self.waiting.objectives.take() {
                    self.pursue_in_time(&objectives)?;
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

    /// The update that tells several reports at once, of which later ones count.
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

    /// As [`Knowledge::pursue`], and later, where what follows is not known.
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

    /// What waits, for a snapshot.
    pub fn waiting(&self) -> &Waiting {
        &self.waiting
    }

    /// Lets wait what waited when a snapshot was made.
    pub fn set_waiting(&mut self, waiting: Waiting) {
        self.waiting = waiting;
    }

    /// Sets what stops later updates before their end.
    pub fn interrupt(&mut self, interrupt: Interrupt) {
        let limits = Limits { interrupt: Some(interrupt), ..self.runtime.engine().limits().clone() };
        self.runtime.engine_mut().set_limits(limits);
    }

    /// From now on an update may take so many steps; see [`rules::Limits`].
    pub fn limit(&mut self, steps: u64) {
        let limits = Limits { steps, ..self.sources.limits.clone() };
        self.runtime.engine_mut().set_limits(limits);
    }
}
