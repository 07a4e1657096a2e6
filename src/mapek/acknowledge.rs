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

use crate::mapek::answer::Command;
use crate::mapek::beliefs::Beliefs;
use crate::mapek::receipts::{Acknowledged, Before};

/// The consequence of an acknowledgement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Receipt {
    /// There was no such effect.
    Unknown,
    /// The effect is acknowledged.
    Taken,
    /// It is not certain any more which design this function has.
    Doubtful(String),
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

impl Beliefs {
    /// Takes an acknowledgement of an effect.
    pub(super) fn acknowledge(&mut self, effect: u64) -> Receipt {
        if effect == 0 || effect > self.effects {
            return Receipt::Unknown;
        }
        self.waits.remove(&effect);
        // A report of the action may have confirmed the effect before its acknowledgement came.
        self.receipts.by_number = true;
        if let Some(outstanding) = self.outstanding.remove(&effect) {
            if let Command::Reconfigure { function, to, .. } = outstanding.command {
                return self.configured(effect, function, to);
            }
        } else if let Some((function, design)) = self.receipts.superseded(effect) {
            let (function, design) = (function.clone(), design.clone());
            return self.configured(effect, function, design);
        }
        Receipt::Taken
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
            self.configured(number, function, design);
        }
    }

    /// Takes the failure of a reconfiguration.
    pub(super) fn reconfiguration_failed(&mut self, effect: u64) -> Failure {
        if effect == 0 || effect > self.effects {
            return Failure::NotReconfiguration;
        }
        match self.outstanding.get(&effect).map(|own| &own.command) {
            Some(Command::Reconfigure { function, to, .. }) => {
                let (function, design) = (function.clone(), to.clone());
                self.outstanding.remove(&effect);
                self.waits.remove(&effect);
                return self.unanswered_failed(&function, design);
            }
            Some(_) => return Failure::NotReconfiguration,
            None => {}
        }
        for (function, own) in &mut self.receipts.functions {
            if let Some(design) = own.superseded.remove(&effect) {
                let function = function.clone();
                return self.unanswered_failed(&function, design);
            }
            let Some(last) = own.last.as_mut() else { continue };
            // Without the reconfiguration before the last one nobody knows what a failure of the last one leads to, or has led to.
            if let Some(before) = last.before.take_if(|before| before.effect == Some(effect))
                && last.failed
                && self.configuration.get(function) == Some(&before.design)
            {
                self.configuration.remove(function);
                return Failure::Design(before.design);
            }
            if last.effect != effect || last.failed {
                continue;
            }
            last.failed = true;
            let design = last.design.clone();
            match last.before.clone() {
                // Somebody else may have changed it since.
                _ if self.configuration.get(function) != Some(&design) => {}
                Some(before) => drop(self.configuration.insert(function.clone(), before.design)),
                None => drop(self.configuration.remove(function)),
            }
            return Failure::Design(design);
        }
        Failure::Stale
    }

    /// Takes the failure of a reconfiguration without an answer so far. The function keeps the design before. But if it was seen with
    /// the design meanwhile, the reconfiguration was carried out and has failed later: nobody knows the design before.
    fn unanswered_failed(&mut self, function: &str, design: String) -> Failure {
        if self.configuration.get(function) == Some(&design) {
            self.configuration.remove(function);
        }
        Failure::Design(design)
    }

    /// Believes that a function has got a design by a reconfiguration, unless a later one was acknowledged. The function was seen
    /// with another design while the reconfiguration was pending: then nobody knows which came first.
    fn configured(&mut self, effect: u64, function: String, design: String) -> Receipt {
        let own = self.receipts.functions.entry(function.clone()).or_default();
        // One that was superseded without an answer may have been carried out in between.
        let is_before_known = own.superseded.range(..effect).next().is_none();
        own.superseded.retain(|number, _| *number > effect);
        if own.last.as_ref().is_some_and(|last| last.effect >= effect) {
            return Receipt::Taken;
        }
        let is_doubtful = own.doubted >= effect;
        let before = if is_doubtful {
            self.configuration.remove(&function)
        } else {
            self.configuration.insert(function.clone(), design.clone())
        };
        // The function was seen with the design before its acknowledgement came: nobody knows the one that it had before.
        let before = before.filter(|before| is_before_known && !is_doubtful && *before != design);
        let source = own.last.as_ref().filter(|last| !last.failed && Some(&last.design) == before.as_ref());
        let source = source.map(|last| last.effect);
        let before = before.map(|design| Before { design, effect: source });
        own.last = Some(Acknowledged { effect, design, before, failed: false });
        if is_doubtful { Receipt::Doubtful(function) } else { Receipt::Taken }
    }
}
