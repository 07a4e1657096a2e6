//! Acknowledgements: messages about reconfigurations to the design that a function is believed to have.
//!
//! A function has the design that was acknowledged last. A reconfiguration is acknowledged by an event that names its number, and
//! messages may cross, be doubled or come out of order: of two acknowledged reconfigurations of a function the later one counts.
//! A reconfiguration that was superseded before it was answered may still be acknowledged; until then it is not believed, and the
//! function's design is not certain.
//!
//! A report that an action has started, progressed or succeeded implies that its request has arrived, and that is all. Robots
//! that acknowledge nothing would never have any design then. So, as long as no reconfiguration was ever acknowledged by its
//! number, such a report also implies the reconfigurations that preceded the request: an action begins with the configuration of
//! its request.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::mapek::answer::Command;
use crate::mapek::beliefs::Beliefs;

/// Upper limit on the superseded reconfigurations that are kept for each function.
const MAX_SUPERSEDED: usize = 16;

/// Acknowledgements so far.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Receipts {
    /// Whether a reconfiguration was ever acknowledged by its number.
    by_number: bool,
    functions: BTreeMap<String, Received>,
}

/// Acknowledgements of one function's reconfigurations.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Received {
    last: Option<Acknowledged>,
    /// Reconfigurations that were superseded and never answered, by number, with their design.
    superseded: BTreeMap<u64, String>,
}

/// The greatest reconfiguration that was acknowledged.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Acknowledged {
    effect: u64,
    design: String,
    /// The design before.
    before: Option<String>,
    /// Whether it has failed after it was acknowledged.
    failed: bool,
}

/// The consequence of a reconfiguration's failure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Failure {
    /// The design cannot be realised.
    Design(String),
    /// None: it is old or a duplicate.
    Stale,
    /// The effect is not a reconfiguration, or there was none.
    NotReconfiguration,
}

impl Receipts {
    /// Returns `true` if the robot acknowledges reconfigurations by their number.
    pub(super) fn are_sent(&self) -> bool {
        self.by_number
    }

    /// Returns `true` if a reconfiguration of the function was superseded and never answered.
    pub(super) fn has_superseded(&self, function: &str) -> bool {
        self.functions.get(function).is_some_and(|own| !own.superseded.is_empty())
    }

    /// Notes that a reconfiguration was superseded before it was answered.
    pub(super) fn supersede(&mut self, effect: u64, function: String, design: String) {
        let superseded = &mut self.functions.entry(function).or_default().superseded;
        superseded.insert(effect, design);
        if superseded.len() > MAX_SUPERSEDED {
            superseded.pop_first();
        }
    }

    /// Notes that a function was seen: it is certain which design it has.
    pub(super) fn observe(&mut self, function: &str) {
        if let Some(own) = self.functions.get_mut(function) {
            own.superseded.clear();
        }
    }

    /// Returns the superseded reconfiguration with that number.
    fn superseded(&self, effect: u64) -> Option<(&String, &String)> {
        let design = |(function, own)| Some((function, Received::superseded(own, effect)?));
        self.functions.iter().find_map(design)
    }

    /// For a snapshot.
    pub(super) fn to_record(&self) -> Value {
        let function = |(name, own): (&String, &Received)| {
            let last =
                own.last.as_ref().map(|last| json!([last.effect, last.design, last.before, last.failed]));
            json!([name, last, own.superseded.iter().collect::<Vec<_>>()])
        };
        json!([self.by_number, self.functions.iter().map(function).collect::<Vec<_>>()])
    }

    /// The inverse of [`Receipts::to_record`].
    pub(super) fn from_record(record: &Value) -> Option<Self> {
        let text = |value: &Value| value.as_str().map(ToOwned::to_owned);
        let superseded = |pair: &Value| Some((pair.get(0)?.as_u64()?, text(pair.get(1)?)?));
        let function = |record: &Value| {
            let last = match record.get(1)? {
                Value::Null => None,
                last => Some(Acknowledged {
                    effect: last.get(0)?.as_u64()?,
                    design: text(last.get(1)?)?,
                    before: text(last.get(2)?),
                    failed: last.get(3)?.as_bool()?,
                }),
            };
            let superseded = record.get(2)?.as_array()?.iter().map(superseded).collect::<Option<_>>()?;
            Some((text(record.get(0)?)?, Received { last, superseded }))
        };
        let functions = record.get(1)?.as_array()?.iter().map(function).collect::<Option<_>>()?;
        Some(Self { by_number: record.get(0)?.as_bool()?, functions })
    }
}

impl Received {
    fn superseded(&self, effect: u64) -> Option<&String> {
        self.superseded.get(&effect)
    }
}

impl Beliefs {
    /// Takes an acknowledgement of an effect. Returns `false` if there was no such effect.
    pub(super) fn acknowledge(&mut self, effect: u64) -> bool {
        if effect == 0 || effect > self.effects {
            return false;
        }
        self.waits.remove(&effect);
        // A report of the action may have confirmed the effect before its acknowledgement came.
        self.receipts.by_number = true;
        if let Some(outstanding) = self.outstanding.remove(&effect) {
            if let Command::Reconfigure { function, to, .. } = outstanding.command {
                self.configured(effect, &function, to);
            }
        } else if let Some((function, design)) = self.receipts.superseded(effect) {
            let (function, design) = (function.clone(), design.clone());
            self.configured(effect, &function, design);
        }
        true
    }

    /// Takes a report of an action that has started: its request has arrived, and with a robot that never acknowledges also what
    /// was asked for before that.
    pub(super) fn confirm_request(&mut self, request: u64) {
        self.outstanding.remove(&request);
        self.waits.remove(&request);
        if self.receipts.by_number {
            return;
        }
        let before = self.outstanding.range(..request);
        let implied: Vec<(u64, String, String)> = before
            .filter_map(|(number, effect)| match &effect.command {
                Command::Reconfigure { function, to, .. } => Some((*number, function.clone(), to.clone())),
                _ => None,
            })
            .collect();
        for (number, function, design) in implied {
            self.outstanding.remove(&number);
            self.waits.remove(&number);
            self.configured(number, &function, design);
        }
    }

    /// Takes the failure of a reconfiguration.
    pub(super) fn reconfiguration_failed(&mut self, effect: u64) -> Failure {
        if effect == 0 || effect > self.effects {
            return Failure::NotReconfiguration;
        }
        match self.outstanding.get(&effect).map(|own| &own.command) {
            Some(Command::Reconfigure { to, .. }) => {
                let design = to.clone();
                self.outstanding.remove(&effect);
                self.waits.remove(&effect);
                return Failure::Design(design);
            }
            Some(_) => return Failure::NotReconfiguration,
            None => {}
        }
        for (function, own) in &mut self.receipts.functions {
            if let Some(design) = own.superseded.remove(&effect) {
                return Failure::Design(design);
            }
            let Some(last) = own.last.as_mut().filter(|last| last.effect == effect && !last.failed) else {
                continue;
            };
            last.failed = true;
            let design = last.design.clone();
            match last.before.clone() {
                // Somebody else may have changed it since.
                _ if self.configuration.get(function) != Some(&design) => {}
                Some(before) => drop(self.configuration.insert(function.clone(), before)),
                None => drop(self.configuration.remove(function)),
            }
            return Failure::Design(design);
        }
        Failure::Stale
    }

    /// Believes that a function has got a design by a reconfiguration, unless a later one was acknowledged.
    fn configured(&mut self, effect: u64, function: &str, design: String) {
        let own = self.receipts.functions.entry(function.to_owned()).or_default();
        own.superseded.retain(|number, _| *number > effect);
        if own.last.as_ref().is_some_and(|last| last.effect >= effect) {
            return;
        }
        let before = self.configuration.insert(function.to_owned(), design.clone());
        own.last = Some(Acknowledged { effect, design, before, failed: false });
    }
}
