//! Actions of the plan: started once their functions have the required designs, and ended by their
//! performers.

use metaplan::mapek::Event;
use serde_json::json;

use crate::manager::machine::io::{Ended, Output};
use crate::manager::machine::{Action, Machine};

impl Machine {
    /// Starts the requested action if its functions have the required designs, no mode request is pending,
    /// the action is neither suspended nor being cancelled, and the autopilot accepts commands. If only the autopilot
    /// does not, the action is reported as started and waits: the loop would cancel an unacknowledged request.
    pub(super) fn begin(&mut self) {
        let beliefs = self.control.beliefs();
        let has = |(function, design): &(String, String)| {
            beliefs.configuration().get(function).is_some_and(|current| current == design)
        };
        let is_ready = beliefs.running().is_some_and(|(_, step)| step.configuration.iter().all(has))
            && !beliefs.suspended()
            && !beliefs.cancelling();
        if !self.pending.is_empty() || !is_ready {
            return;
        }
        let Some(action) = self.action.as_mut().filter(|action| !action.begun) else { return };
        let (number, effect) = (action.number, action.effect.take());
        if self.autopilot_obeys {
            (action.begun, action.is_lost) = (true, false);
            self.outputs.push(Output::Perform(number, action.call.clone()));
        }
        if let Some(effect) = effect {
            self.acknowledge(effect);
            self.queue(&Event::Started { action: number });
        }
    }

    /// Ends the action under way if the loop has suspended it, or if the autopilot no longer accepts commands.
    /// Performers cannot pause, and an action that goes on would move the robot without its designs or against the
    /// pilot. The performer reports the action as cancelled. The performer of an action of the previous run may still be
    /// working, too.
    pub(super) fn stop_interrupted(&mut self) {
        let is_interrupted = self.control.beliefs().suspended() || !self.autopilot_obeys;
        let is_ready = self.deferred.is_none();
        let is_performed = |action: &&mut Action| action.begun || is_ready && action.is_lost;
        if let Some(action) = self.action.as_mut().filter(is_performed)
            && is_interrupted
            && !std::mem::replace(&mut action.is_stopped, true)
        {
            self.outputs.push(Output::Stop(action.number));
        }
    }

    pub(super) fn performed(&mut self, number: u64, ended: &Ended) -> String {
        if self.control.beliefs().running().is_none_or(|(running, _)| running != number) {
            return format!("action {number} has ended before");
        }
        self.action = None;
        let is_ending = self.ending.is_some();
        match ended {
            Ended::Succeeded => self.queue(&Event::Succeeded { action: number }),
            // The failure of an action that should end anyway does not count.
            Ended::Failed(_) if is_ending => self.queue(&Event::Cancelled { action: number }),
            Ended::Cancelled => self.queue(&Event::Cancelled { action: number }),
            Ended::Failed(reason) => self.queue(&Event::Failed { action: number, reason: reason.clone() }),
        }
        if is_ending {
            self.unground_all();
        }
        format!("action {number} has ended")
    }

    pub(super) fn progress(&mut self, number: u64, fraction: f64) -> String {
        let is_running = self.control.beliefs().running().is_some_and(|(running, _)| running == number);
        if is_running && (0.0..=1.0).contains(&fraction) {
            let line = json!({"event": "action_progress", "action": number, "fraction": (fraction * 100.0).round() / 100.0});
            self.lines.push_back(line.to_string());
        }
        format!("action {number} continues")
    }
}
