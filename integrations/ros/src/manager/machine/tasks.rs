//! Requests to start and end tasks, and the replies. A task ends if a client cancels it or requests another task, if
//! its goal is reached, or if the autopilot leaves its mode.

use std::time::Duration;

use metaplan::mapek::Event;
use metaplan::message::did_you_mean;
use serde_json::json;

use crate::manager::machine::io::{Output, State};
use crate::manager::machine::{EMPTY_GOAL, HeldRequest, Machine};
use crate::manager::settings::fact_value;

/// Time to wait for the end of the action of a task that has ended. Clients such as SUAVE's mission node wait five
/// seconds for the reply, even if time is simulated.
const STOP_WAIT: Duration = Duration::from_secs(3);

/// Time for which a requested task waits until the autopilot accepts commands. MAVROS reports the mode once per second,
/// so a client that has just changed the mode may request its task before the manager receives the report.
const MODE_WAIT: Duration = Duration::from_secs(2);

impl Machine {
    pub(super) fn reply(&mut self) {
        if !self.pending.is_empty() || self.ending.is_some() {
            return;
        }
        let granted = self.task.is_some() && !self.without_plan;
        for number in std::mem::take(&mut self.start_requests) {
            self.outputs.push(Output::Reply(number, granted));
        }
        for number in std::mem::take(&mut self.end_requests) {
            let is_other = |(function, mode): (&String, &String)| {
                self.settings.functions.unground(function).is_some_and(|unground| unground != mode)
            };
            let unanswered = self.modes.iter().any(is_other);
            self.outputs.push(Output::Reply(number, self.task.is_none() && !unanswered));
        }
    }

    pub(super) fn request(&mut self, number: u64, task: &str) -> String {
        let Some(settings) = self.settings.tasks.get(task).cloned() else {
            let suggestion = did_you_mean(task, self.settings.tasks.keys().map(String::as_str));
            let because = format!("there is no task `{task}`{suggestion}");
            self.outputs.push(Output::Reply(number, false));
            self.refuse(&because);
            return because;
        };
        if self.state == State::WaitGraph {
            return self.refuse_request(number, task, "functions are missing");
        }
        if !self.autopilot_obeys {
            self.waits += 1;
            self.outputs.push(Output::Await(self.waits, MODE_WAIT));
            self.held_requests.push(HeldRequest { wait: self.waits, number, task: task.to_owned() });
            return format!("the task {task} waits for the autopilot");
        }
        self.start_requests.push(number);
        if self.task.as_deref() != Some(task) {
            self.task = Some(task.to_owned());
            // The loop waits for the end of the previous task's action.
            self.ending = None;
            for (name, value) in &settings.facts {
                self.queue(&Event::Fact { name: name.clone(), value: fact_value(value) });
            }
            self.queue(&Event::Goal { goal: settings.goal });
        }
        format!("the task {task} is requested")
    }

    fn refuse_request(&mut self, number: u64, task: &str, obstacle: &str) -> String {
        self.outputs.push(Output::Reply(number, false));
        let because = format!("the task {task} is requested, and {obstacle}");
        self.refuse(&because);
        because
    }

    pub(super) fn refuse(&mut self, because: &str) {
        self.outputs.push(Output::Event(json!({"answer": "refused", "because": because})));
        self.outputs.push(Output::Warn(because.to_owned()));
    }

    pub(super) fn cancel(&mut self, number: Option<u64>, task: &str) -> String {
        if !self.settings.tasks.contains_key(task) {
            let because = format!("there is no task `{task}`");
            self.outputs.extend(number.map(|number| Output::Reply(number, false)));
            self.refuse(&because);
            return because;
        }
        for held in self.held_requests.iter().filter(|held| held.task == task) {
            self.outputs.push(Output::Reply(held.number, false));
        }
        self.held_requests.retain(|held| held.task != task);
        let beliefs = self.control.beliefs();
        let pursues_goal_of_problem = self.task.is_none()
            && beliefs.goal().is_none()
            && (beliefs.running().is_some() || self.without_plan);
        if pursues_goal_of_problem || self.task.as_deref().is_some_and(|current| current != task) {
            // The mission or another task is running, so the cancelled task is not.
            self.outputs.extend(number.map(|number| Output::Reply(number, true)));
            return format!("the task {task} is not under way");
        }
        self.end_requests.extend(number);
        self.without_plan = false;
        for request in std::mem::take(&mut self.start_requests) {
            self.outputs.push(Output::Reply(request, false));
        }
        if self.task.take().is_some() {
            self.queue(&Event::Goal { goal: EMPTY_GOAL.to_owned() });
        }
        match self.action.as_mut().filter(|action| action.begun) {
            // The robot needs the functions until the performer reports the end.
            Some(action) => {
                action.is_stopped = true;
                self.outputs.push(Output::Stop(action.number));
                if self.ending.is_none() {
                    self.waits += 1;
                    self.ending = Some(self.waits);
                    self.outputs.push(Output::Await(self.waits, STOP_WAIT));
                }
            }
            None => self.end_action(),
        }
        format!("the task {task} ends")
    }

    /// Ends the action of a task that has ended, and withdraws the designs of all functions.
    pub(super) fn end_action(&mut self) {
        self.drop_lost_action();
        self.action = None;
        if let Some((action, _)) = self.control.beliefs().running() {
            self.queue(&Event::Cancelled { action });
        }
        self.unground_all();
    }

    pub(super) fn unground_all(&mut self) {
        self.ending = None;
        for function in self.functions.clone() {
            self.unground(&function);
        }
    }

    /// Handles the end of a wait: refuses a task that waits for the autopilot, or ends an action whose performer has not
    /// reported its end in time after the end of the task.
    pub(super) fn abandon(&mut self, wait: u64) -> String {
        if let Some(at) = self.held_requests.iter().position(|held| held.wait == wait) {
            let HeldRequest { number, task, .. } = self.held_requests.remove(at);
            return self.refuse_request(number, &task, "the autopilot accepts no commands in its mode");
        }
        if self.ending != Some(wait) {
            return "nothing waits any more".to_owned();
        }
        for request in std::mem::take(&mut self.end_requests) {
            self.outputs.push(Output::Reply(request, false));
        }
        let action = self.action.as_ref().map(|action| action.call.text()).unwrap_or_default();
        let because = format!("{action} was cancelled, but its performer has not reported the end");
        self.outputs.push(Output::Warn(because.clone()));
        self.end_action();
        because
    }

    pub(super) fn reached(&mut self) {
        self.without_plan = false;
        self.drop_lost_action();
        self.action = None;
        let has_acted = std::mem::take(&mut self.has_acted);
        if self.task.take().is_none() && !has_acted {
            return;
        }
        for number in std::mem::take(&mut self.start_requests) {
            self.outputs.push(Output::Reply(number, true));
        }
        if self.control.beliefs().goal().is_some_and(|goal| goal != EMPTY_GOAL) {
            self.queue(&Event::Goal { goal: EMPTY_GOAL.to_owned() });
        }
        self.unground_all();
    }

    pub(super) fn accepts_commands(&self, mode: &str) -> bool {
        self.settings.autopilot.as_ref().is_none_or(|autopilot| autopilot.mode == mode)
    }

    /// Ends the task if the autopilot accepts no commands in its mode. A mission with its own goal has no task: its action
    /// is stopped, and the next one waits. If the autopilot accepts commands, handles the tasks that wait for it.
    pub(super) fn autopilot(&mut self, mode: &str) -> String {
        self.autopilot_obeys = self.accepts_commands(mode);
        if let Some(task) = self.task.clone().filter(|_| !self.autopilot_obeys) {
            self.cancel(None, &task);
        }
        if self.autopilot_obeys {
            for HeldRequest { number, task, .. } in std::mem::take(&mut self.held_requests) {
                self.request(number, &task);
            }
        }
        format!("the autopilot is in the mode {mode}")
    }
}
