//! Restart of the manager: resumes unfinished requests, and adopts mode changes of the robot since
//! the previous run.

use std::collections::BTreeSet;
use std::time::Duration;

use metaplan::mapek::{Command, Effect, Event};
use metaplan::message::Message;

use crate::manager::machine::io::{Output, State};
use crate::manager::machine::{Action, Deferred, EMPTY_GOAL, Machine, call, unwritten};

/// Time to wait for new diagnostics after a restart, before the modes found at the start are evaluated. Without the wait,
/// they would be evaluated with old diagnostics.
const DIAGNOSTICS_WAIT: Duration = Duration::from_secs(3);

impl Machine {
    /// Handles the start: `modes` are the current modes of the robot's functions. After a restart, the
    /// answers of the adaptation loop are deferred until diagnostics arrive or a task is requested or
    /// cancelled, at most for [`DIAGNOSTICS_WAIT`].
    pub(super) fn ready(&mut self, modes: Vec<(String, Option<String>)>) -> Result<String, Message> {
        self.state = State::Idle;
        let is_first = self.control.beliefs().lines() == 0;
        let answers = match &mut self.journal {
            None => self.control.start(),
            Some(journal) => journal.begin(&mut self.control).map_err(|error| unwritten(&error))?,
        };
        let way = |from: &str, to: State| [from.to_owned(), to.to_string()];
        self.note(&way("START", State::WaitGraph), "the mission and its settings are read")?;
        self.note(&[State::WaitGraph.to_string(), State::Idle.to_string()], "every function answers")?;
        // The current modes are recorded, so that requests fulfilled in the meantime are not
        // repeated.
        for (function, mode) in modes {
            if let Some(mode) = mode {
                self.modes.insert(function, mode);
            }
        }
        self.restore_action();
        let until = if is_first { self.now } else { self.now + DIAGNOSTICS_WAIT };
        self.deferred = Some(Deferred { answers, modes: self.modes.clone(), until });
        if until == self.now {
            self.catch_up();
        }
        Ok("every function answers".to_owned())
    }

    /// Repeats the deferred answers whose requests are still outstanding, and reports modes that
    /// have changed since the previous run.
    pub(super) fn catch_up(&mut self) {
        let Some(deferred) = &mut self.deferred else { return };
        let (mut answers, modes) =
            (std::mem::take(&mut deferred.answers), std::mem::take(&mut deferred.modes));
        let outstanding: BTreeSet<u64> =
            self.control.beliefs().outstanding().map(|effect| effect.number).collect();
        answers.retain(|answer| answer.effect().is_none_or(|effect| outstanding.contains(&effect.number)));
        self.handle_answers(answers);
        self.deferred = None;
        for (function, mode) in modes {
            // A mode that was requested in the meantime is newer.
            if !self.pending.contains_key(&function) && self.modes.get(&function) == Some(&mode) {
                self.observe(&function, &mode);
            }
        }
    }

    /// Restores the action of the previous run. [`begin`](Self::begin) performs it again once the functions have their
    /// designs, because its performer may have lost it. For an action that ends with a message on a topic, this has no
    /// disadvantage.
    fn restore_action(&mut self) {
        let Some((number, step)) = self.control.beliefs().running() else { return };
        let call = call(step);
        let is_waiting = |effect: &&Effect| matches!(effect.command, Command::Request { .. });
        let effect = self.control.beliefs().outstanding().find(is_waiting).map(|effect| effect.number);
        self.has_acted = true;
        self.action = Some(Action { number, call, effect, begun: false, is_lost: true, is_stopped: false });
    }

    /// Drops the action of the previous run if it has ended or must not be performed again. A cancelled or suspended
    /// action, and that of an ended task, count as cancelled: no performer can report their end any more.
    pub(super) fn end_lost_action(&mut self) {
        let beliefs = self.control.beliefs();
        let running = beliefs.running().map(|(number, _)| number);
        let is_interrupted = beliefs.cancelling() || beliefs.suspended();
        let is_of_ended_task = beliefs.goal() == Some(EMPTY_GOAL);
        let lost = self.action.as_ref().filter(|action| action.is_lost);
        let Some(number) = lost.map(|action| action.number) else { return };
        if running != Some(number) {
            self.drop_lost_action();
        } else if is_of_ended_task {
            self.end_action();
        } else if is_interrupted {
            self.drop_lost_action();
            self.queue(&Event::Cancelled { action: number });
        }
    }

    /// Drops the action of the previous run, and requests its end: a node that performs actions on the events
    /// `begin_action` and `stop_action` may still be working.
    pub(super) fn drop_lost_action(&mut self) {
        if let Some(action) = self.action.take_if(|action| action.is_lost) {
            self.outputs.push(Output::Stop(action.number));
        }
    }
}
