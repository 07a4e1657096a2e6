//! Determines the believed design of each function from acknowledgements and failures of reconfigurations.
//!
//! The event `acknowledged` refers to an effect by its number. After the acknowledgement of a reconfiguration, its
//! function is believed to have the requested design. Later observations, failures and acknowledgements can correct
//! this belief. If an observation since the request contradicts the reconfiguration, the design is unknown. Messages
//! can cross, be duplicated or arrive out of order: of two acknowledged reconfigurations of one function, the one
//! requested later counts. A reconfiguration that a later one has superseded can still be acknowledged; until then its
//! design is not believed.
//!
//! A report that an action has started, progressed or succeeded implies that the request of the action has arrived.
//! Some robots never acknowledge an effect by its number. For such a robot, the report also implies that the
//! reconfigurations before the request have arrived, because an action starts with the configuration of its request.

use crate::mapek::answer::{Command, Effect};
use crate::mapek::beliefs::Beliefs;
use crate::mapek::receipts::{Acknowledged, Before};

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Receipt {
    Unknown,
    Recorded,
    /// The effect is acknowledged, but the current design of the given function is unknown.
    Doubtful(String),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Failure {
    Design(String),
    /// The report is old or a duplicate: the believed designs stay as they are.
    Stale,
    NotReconfiguration,
}

impl Beliefs {
    /// Records an acknowledgement by number. The effect is then no longer outstanding, unless it is the cancellation of
    /// the action under way. Returns [`Receipt::Unknown`] if the loop has created no effect with this number.
    pub(super) fn acknowledge(&mut self, effect: u64) -> Receipt {
        if effect == 0 || effect > self.effects {
            return Receipt::Unknown;
        }
        let is_first = self.waits.remove(&effect).is_some();
        self.receipts.by_number = true;
        let is_cancellation = |pending: &Effect| matches!(pending.command, Command::Cancel { .. });
        if self.outstanding.get(&effect).is_some_and(is_cancellation) {
            // The cancellation stays outstanding until the action ends, because the report of the end may be lost.
            if let Some(running) = self.running.as_mut().filter(|_| is_first) {
                (running.last_report, running.overdue) = (self.now, 0);
            }
            return Receipt::Recorded;
        }
        // The effect need not be outstanding: a report of the action may have confirmed it, or a later effect
        // superseded it.
        if let Some(outstanding) = self.outstanding.remove(&effect) {
            if let Command::Reconfigure { function, to, .. } = outstanding.command {
                return self.configured(effect, function, to);
            }
        } else if let Some((function, design)) = self.receipts.superseded(effect) {
            let (function, design) = (function.clone(), design.clone());
            return self.configured(effect, function, design);
        }
        Receipt::Recorded
    }

    /// Records that the request of an action has arrived, as implied by a report of the action. If the robot has never
    /// acknowledged an effect by its number, the earlier reconfigurations have arrived, too.
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
            self.configured(number, function.clone(), design);
            self.receipts.functions.entry(function).or_default().implied = Some(number);
        }
    }

    pub(super) fn reconfiguration_failed(&mut self, effect: u64) -> Failure {
        if effect == 0 || effect > self.effects {
            return Failure::NotReconfiguration;
        }
        // A reconfiguration is outstanding, superseded, or acknowledged; the three cases follow in this order.
        match self.outstanding.get(&effect).map(|outstanding_effect| &outstanding_effect.command) {
            Some(Command::Reconfigure { function, to, .. }) => {
                let (function, design) = (function.clone(), to.clone());
                self.outstanding.remove(&effect);
                self.waits.remove(&effect);
                return self.unanswered_failed(&function, design);
            }
            Some(_) => return Failure::NotReconfiguration,
            None => {}
        }
        for (function, history) in &mut self.receipts.functions {
            if let Some(design) = history.superseded.remove(&effect) {
                let function = function.clone();
                return self.unanswered_failed(&function, design);
            }
            let Some(last) = history.last.as_mut() else { continue };
            // If both the last and the previous reconfiguration have failed, the design of the function is unknown.
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
                // The design may have changed since, for example by an observation.
                _ if self.configuration.get(function) != Some(&design) => {}
                Some(before) => drop(self.configuration.insert(function.clone(), before.design)),
                None => drop(self.configuration.remove(function)),
            }
            return Failure::Design(design);
        }
        Failure::Stale
    }

    fn unanswered_failed(&mut self, function: &str, design: String) -> Failure {
        if self.configuration.get(function) == Some(&design) {
            self.configuration.remove(function);
        }
        Failure::Design(design)
    }

    /// Records that a reconfiguration has arrived, unless it or a later one of the function is already recorded. The
    /// design is unknown if an observation since the request contradicts it.
    fn configured(&mut self, effect: u64, function: String, design: String) -> Receipt {
        let history = self.receipts.functions.entry(function.clone()).or_default();
        // A superseded reconfiguration with a smaller number may have been carried out without an answer. Then the
        // previous design is unknown.
        let is_before_known = history.superseded.range(..effect).next().is_none();
        history.superseded.retain(|number, _| *number > effect);
        history.implied = history.implied.filter(|implied| *implied > effect);
        if history.last.as_ref().is_some_and(|last| last.effect >= effect) {
            return Receipt::Recorded;
        }
        let is_doubtful = history.doubted >= effect;
        let before = if is_doubtful {
            self.configuration.remove(&function)
        } else {
            self.configuration.insert(function.clone(), design.clone())
        };
        // If the function was observed with this design before the acknowledgement arrived, its previous design is
        // unknown.
        let before = before.filter(|before| is_before_known && !is_doubtful && *before != design);
        let source =
            history.last.as_ref().filter(|last| !last.failed && Some(&last.design) == before.as_ref());
        let source = source.map(|last| last.effect);
        let before = before.map(|design| Before { design, effect: source });
        history.last = Some(Acknowledged { effect, design, before, failed: false });
        if is_doubtful { Receipt::Doubtful(function) } else { Receipt::Recorded }
    }
}
