//! Functions: requested modes, replies, and modes that were changed by other clients.

use std::time::Duration;

use metaplan::mapek::{Command, Event};
use serde_json::json;

use crate::manager::machine::Machine;
use crate::manager::machine::io::{Change, Outcome, Output, State};

/// Maximum number of calls for a mode if there is no reply. A change that consists of steps gets one attempt.
const MAX_ATTEMPTS: u32 = 2;

/// Half of the delay before the first probe of a function without a reply. The delay is doubled with each
/// further change without a reply, up to [`MAX_PROBE_DELAY`].
const INITIAL_PROBE_DELAY: Duration = Duration::from_secs(1);

const MAX_PROBE_DELAY: Duration = Duration::from_secs(60);

/// Maximum delay until a function that did not reply to a probe is probed again.
const SILENT_RETRY_DELAY: Duration = Duration::from_secs(2);

const REFUSED_RETRY_DELAY: Duration = Duration::from_secs(60);

/// Time after a granted change of mode during which reports of another mode are ignored. If a report
/// was ignored, and no later report confirmed the mode, the mode is queried again after this time.
///
/// `system_modes` answers `change_mode` before the node has changed, and `get_mode` returns the old mode until its
/// observer has noticed the change. If this program adopted the old mode, it would request the new mode again, and
/// the next wrong report would follow.
const GRANT_PERIOD: Duration = Duration::from_secs(2);

#[derive(Debug)]
pub(super) struct Grant {
    until: Duration,
    /// Modes that the function had shortly before; reports of them may be late.
    earlier: Vec<String>,
    is_contradicted: bool,
}

impl Machine {
    /// Requests the mode that the settings provide for a function while it is not needed. Does nothing without such a
    /// mode, if this mode is already set or requested, or if the function's mode is unknown.
    pub(super) fn unground(&mut self, function: &str) {
        let Some(mode) = self.settings.functions.unground(function).map(str::to_owned) else { return };
        let requested = self.pending.get(function).map(|change| &change.mode);
        let has = requested.or_else(|| self.modes.get(function));
        if has.is_some_and(|has| *has != mode) {
            let replaced = self.pending.get(function).and_then(|change| change.effect);
            self.change(function.to_owned(), mode, None);
            // The loop would request the design again after its deadline, although no one needs it any more.
            if let Some(effect) = replaced {
                self.acknowledge(effect);
                self.queue(&Event::Observed { function: function.to_owned(), design: None });
            }
        }
    }

    /// Requests a mode. Steps get a single attempt, because they wait for their nodes themselves.
    pub(super) fn change(&mut self, function: String, mode: String, effect: Option<u64>) {
        let attempt = if self.settings.functions.has_steps(&function) { MAX_ATTEMPTS } else { 1 };
        self.send(Change { function, mode, effect, attempt });
    }

    fn send(&mut self, change: Change) {
        self.pending.insert(change.function.clone(), change.clone());
        self.outputs.push(Output::Change(change));
    }

    pub(super) fn changed(&mut self, change: Change, outcome: Outcome) -> String {
        let Change { function, mode, effect, attempt } = change.clone();
        if self.pending.get(&function) != Some(&change) {
            // A newer request has replaced this one, and its mode overwrites the result.
            return format!("{function} has answered late");
        }
        match outcome {
            Outcome::Done => {
                self.pending.remove(&function);
                self.grant(&function, &mode);
                self.failures.entry(function.clone()).or_default().missed_replies = 0;
                match effect {
                    Some(effect) => self.acknowledge(effect),
                    None => self.queue(&Event::Observed { function: function.clone(), design: None }),
                }
                format!("{function} has the mode {mode}")
            }
            Outcome::Failed(because) if attempt < MAX_ATTEMPTS => {
                self.complain(&function, &mode, &because);
                self.send(Change { attempt: attempt + 1, ..change });
                because
            }
            Outcome::Failed(because) => {
                self.complain(&function, &mode, &because);
                let failures = self.failures.entry(function.clone()).or_default();
                failures.missed_replies = failures.missed_replies.saturating_add(1);
                let wait = INITIAL_PROBE_DELAY
                    .saturating_mul(1 << failures.missed_replies.min(6))
                    .min(MAX_PROBE_DELAY);
                if !std::mem::replace(&mut failures.is_probed, true) {
                    self.outputs.push(Output::Probe(function.clone(), wait));
                }
                self.failed(&function, effect, None);
                because
            }
            Outcome::Refused => {
                let because = format!("{function} has refused the mode {mode}");
                self.complain(&function, &mode, &because);
                self.failed(&function, effect, Some(self.now + REFUSED_RETRY_DELAY));
                because
            }
            Outcome::StepFailed(because) => {
                self.complain(&function, &mode, &because);
                self.failed(&function, effect, Some(self.now + REFUSED_RETRY_DELAY));
                because
            }
            Outcome::NoMode(outcome) => {
                self.grants.remove(&function);
                self.modes.insert(function.clone(), String::new());
                // The failure is reported afterwards, so that the loop does not assume the previous design for its next
                // decision.
                self.queue(&Event::Observed { function, design: None });
                self.changed(change, *outcome)
            }
        }
    }

    pub(super) fn complain(&mut self, function: &str, mode: &str, because: &str) {
        if self.settings.functions.has_steps(function) {
            self.outputs.push(Output::Warn(format!("{function} {mode}: {because}")));
            self.outputs.push(Output::Event(json!({
                "answer": "steps_failed", "function": function, "mode": mode, "because": because,
            })));
            return;
        }
        let service = format!("/{}/change_mode", self.settings.functions.system(function));
        self.outputs.push(Output::Warn(format!("{service} {mode}: {because}")));
        self.outputs.push(Output::Event(json!({
            "answer": "call_failed", "service": service, "mode": mode, "because": because,
        })));
    }

    /// Handles a design that could not be set: reports it to the loop as failed if `effect` is outstanding. The
    /// design is reported as realisable again at the time `again` or, if `again` is `None`, once the function
    /// replies.
    pub(super) fn failed(&mut self, function: &str, effect: Option<u64>, again: Option<Duration>) {
        self.pending.remove(function);
        let Some(effect) = effect else { return };
        let outstanding = self
            .control
            .beliefs()
            .outstanding()
            .find(|effect_in_progress| effect_in_progress.number == effect);
        if let Some(Command::Reconfigure { to, .. }) =
            outstanding.map(|effect_in_progress| effect_in_progress.command.clone())
        {
            self.failures.entry(function.to_owned()).or_default().designs.insert(to, again);
            self.queue(&Event::ReconfigurationFailed { effect });
        }
        self.outputs.push(Output::Look(function.to_owned()));
    }

    fn grant(&mut self, function: &str, mode: &str) {
        let before = self.modes.insert(function.to_owned(), mode.to_owned());
        let mut earlier = match self.grants.remove(function) {
            Some(grant) if grant.until > self.now => grant.earlier,
            _ => Vec::new(),
        };
        earlier.extend(before);
        let grant = Grant { until: self.now + GRANT_PERIOD, earlier, is_contradicted: false };
        self.grants.insert(function.to_owned(), grant);
    }

    /// Handles a request for a mode that a mode manager has received. Unlike a reported mode, a
    /// request that this program has not sent recently comes from another client. It therefore ends
    /// the [`GRANT_PERIOD`], unless a change is pending.
    pub(super) fn mode_requested(&mut self, function: &str, mode: &str) -> String {
        if self.modes.get(function).is_some_and(|current| current == mode) {
            return format!("{function} was requested to have the mode {mode}, which it has");
        }
        let is_ours = |grant: &Grant| grant.earlier.iter().any(|earlier| earlier == mode);
        let is_late = self.grants.get(function).is_some_and(|grant| grant.until > self.now && is_ours(grant));
        if is_late {
            return format!("{function} reports the earlier request of the mode {mode}");
        }
        if !self.pending.contains_key(function) {
            self.grants.remove(function);
        }
        self.mode(function, mode)
    }

    pub(super) fn mode(&mut self, function: &str, mode: &str) -> String {
        let because = match mode {
            "" => format!("{function} was seen in none of its modes"),
            _ => format!("{function} was seen with the mode {mode}"),
        };
        if let Some(change) = self.pending.get(function).cloned() {
            let has_steps = self.settings.functions.has_steps(function);
            if change.mode == mode && change.attempt >= MAX_ATTEMPTS && !has_steps {
                // The reply was lost, but the mode shows that the call succeeded.
                return self.changed(change, Outcome::Done);
            }
            // The function is still changing its mode on our request.
            return because;
        }
        if self.modes.get(function).map(String::as_str) == Some(mode) {
            self.grants.remove(function);
            return because;
        }
        if let Some(grant) = self.grants.get_mut(function).filter(|grant| grant.until > self.now) {
            grant.is_contradicted = true;
            return format!("{because}, which may be the mode before the change");
        }
        self.modes.insert(function.to_owned(), mode.to_owned());
        self.changed_late(function, mode);
        self.observe(function, mode);
        because
    }

    /// If the design of a reported mode counts as failed, for example because its call has timed out, reports the
    /// design as realisable again.
    pub(super) fn changed_late(&mut self, function: &str, mode: &str) {
        let designs = self.control.beliefs().mission().designs_of(function);
        let Some(design) = self.settings.functions.design(function, mode, &designs) else { return };
        let failures = self.failures.get_mut(function).and_then(|failures| failures.designs.remove(&design));
        if failures.is_some() {
            self.queue(&Event::Design { design, realisable: true });
        }
    }

    /// Reports the design of a mode to the loop, unless this is already the function's design in the beliefs of the
    /// loop.
    pub(super) fn observe(&mut self, function: &str, mode: &str) {
        let designs = self.control.beliefs().mission().designs_of(function);
        let design = self.settings.functions.design(function, mode, &designs);
        let believed = self.control.beliefs().configuration().get(function);
        if believed != design.as_ref() {
            self.queue(&Event::Observed { function: function.to_owned(), design });
        }
    }

    pub(super) fn probed(&mut self, function: &str, answers: bool) -> String {
        let failures = self.failures.entry(function.to_owned()).or_default();
        if !answers {
            let wait =
                INITIAL_PROBE_DELAY.saturating_mul(1 << failures.missed_replies.min(6)).min(MAX_PROBE_DELAY);
            self.outputs.push(Output::Probe(function.to_owned(), wait.min(SILENT_RETRY_DELAY)));
            return format!("{function} does not answer");
        }
        failures.is_probed = false;
        let back: Vec<String> = failures
            .designs
            .iter()
            .filter(|(_, again)| again.is_none())
            .map(|(design, _)| design.clone())
            .collect();
        failures.designs.retain(|_, again| again.is_some());
        for design in back {
            self.queue(&Event::Design { design, realisable: true });
        }
        self.outputs.push(Output::Look(function.to_owned()));
        format!("{function} answers again")
    }

    /// Reports designs as realisable again once their retry delay is over. Removes grants once their period is over; if
    /// another mode was reported in the meantime, requests the current mode of the function. In the states EXECUTE and
    /// DEGRADED, also passes a due tick to the loop: the filters of the loop delay the report that a component works
    /// again until a later line, and an unchanged status produces no line.
    pub(super) fn tick(&mut self) -> String {
        let now = self.now;
        let mut back = Vec::new();
        for failures in self.failures.values_mut() {
            let due = |again: &Option<Duration>| again.is_some_and(|again| again <= now);
            back.extend(
                failures.designs.iter().filter(|(_, again)| due(again)).map(|(design, _)| design.clone()),
            );
            failures.designs.retain(|_, again| !due(again));
        }
        for design in back {
            self.queue(&Event::Design { design, realisable: true });
        }
        self.grants.retain(|function, grant| {
            let is_over = grant.until <= now;
            if is_over && grant.is_contradicted {
                self.outputs.push(Output::Look(function.clone()));
            }
            !is_over
        });
        let is_due = self.control.due().is_some_and(|due| due <= self.now);
        if is_due && matches!(self.state, State::Execute | State::Degraded) {
            self.queue(&Event::Tick);
        }
        "time has passed".to_owned()
    }
}
