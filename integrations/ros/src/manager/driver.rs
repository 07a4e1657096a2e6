//! Driver of the manager: passes inputs to the state machine, one at a time, and its outputs to the robot.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use metaplan::journal::{Journal, Policy};
use metaplan::knowledge::Knowledge;
use metaplan::mapek::Loop;
use metaplan::message::{Errors, Message, did_you_mean};
use metaplan::setup::Setup;
use serde_json::json;

use crate::diagnosed::repeats;
use crate::interfaces::diagnostic_msgs::msg::DiagnosticStatus;
use crate::manager::machine::{Input, Machine, Output, State};
use crate::manager::robot::Robot;
use crate::manager::settings::Settings;
use crate::node::{Clock, Lifecycle, Node, Severity};
use crate::perform::Perform;
use crate::performer::performers;

/// Period of the tick input, of the search for new mode servers, and of the manager's own status on `/diagnostics`.
const PERIOD: Duration = Duration::from_secs(1);

/// Limit on the number of inputs that are kept while the manager is inactive. When it is reached, the kept inputs are
/// handled.
const MAX_DELAYED_INPUTS: usize = 100_000;

const SEARCH_TIME: Duration = Duration::from_millis(200);

/// Time after which a task that is requested while functions are missing is refused. SUAVE's mission node waits five
/// seconds for the reply.
const TASK_WAIT: Duration = Duration::from_secs(4);

const GRAPH_LOG_PERIOD: Duration = Duration::from_secs(5);

/// Options of the manager.
#[derive(Debug, Clone)]
pub struct Options {
    /// Manifest of the mission.
    pub mission: PathBuf,
    /// Settings of the robot; by default a file `ros.toml` in the directory of the mission.
    pub settings: Option<PathBuf>,
    /// Directory of the journal. `None` for no journal.
    pub journal: Option<PathBuf>,
    /// `true` if the steps of designs may execute commands.
    pub allow_commands: bool,
}

/// Manages the tasks of a robot until `stop` is set.
///
/// # Errors
/// The mission, its settings or the journal are wrong, or the journal can no longer be written.
pub fn run(node: &Arc<Node>, options: &Options, stop: &AtomicBool) -> Result<(), Errors> {
    let Setup { mission, settings: mut adaptation, .. } = Setup::read(&options.mission)?;
    let settings = Settings::read(options.settings.as_deref(), &options.mission)?;
    let designs = mission.functions().into_iter().map(|function| {
        let designs = mission.designs_of(&function);
        (function, designs)
    });
    settings.check_steps(&designs.collect(), options.allow_commands)?;
    settings.check_mission(&mission)?;
    for warning in mission.warnings() {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    let timeout = node.declare_seconds(
        "call_timeout",
        "Time after which an unfinished change of mode is requested again, in seconds.",
        5.0,
    )?;
    let attribute = |name: &str| {
        // The check only sets some value on a copy of the mission.
        mission.clone().set(name, "0").map_err(|message| message.message.clone())
    };
    settings.check_targets(&components(mission.knowledge()), attribute)?;
    for signal in settings.signals() {
        signal.add_filter(&mut adaptation.filters);
    }
    let repeats = repeats(&adaptation.filters);
    let mut control = Loop::new(mission, adaptation)?;
    let journal = journal(node, options, &mut control)?;
    let start_time = control.beliefs().now();
    let performers: BTreeMap<String, Box<dyn Perform>> =
        performers(node, &settings.actions, &settings.poses)?;
    let machine = Machine::new(control, journal, settings.clone());
    let (sender, inputs) = mpsc::channel();
    let robot = Robot::connect(node, &settings, machine.functions(), performers, repeats, sender.clone())?;
    let active = Lifecycle::activated(node)?;
    let mut driver = Driver {
        node: Arc::clone(node),
        machine,
        robot,
        settings,
        active,
        timeout,
        clock: node.clock(),
        origin: node.clock().elapsed(),
        start_time,
    };
    driver.wait_for_functions(&sender, &inputs, stop)?;
    driver.drive(&inputs, stop).map_err(Errors::from)
}

pub(crate) fn components(knowledge: Option<&Knowledge>) -> Vec<String> {
    let components = knowledge.map(|knowledge| knowledge.view().components()).unwrap_or_default();
    components.into_iter().map(|component| component.individual.name).collect()
}

fn journal(node: &Node, options: &Options, control: &mut Loop) -> Result<Option<Journal>, Message> {
    let Some(directory) = &options.journal else { return Ok(None) };
    let (journal, recovery) = Journal::open(directory, Policy::default(), control)?;
    for warning in &recovery.warnings {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    if recovery.replayed.is_some() {
        let text = format!("continues from the journal after {} lines", control.beliefs().lines());
        node.log(Severity::Info, &text);
    }
    Ok(Some(journal))
}

struct Driver {
    node: Arc<Node>,
    machine: Machine,
    robot: Robot,
    settings: Settings,
    /// `true` while the lifecycle state is active. Otherwise, tasks are refused and other inputs wait.
    active: Arc<AtomicBool>,
    /// Time limit of a call, in milliseconds.
    timeout: Arc<AtomicU64>,
    clock: Arc<Clock>,
    /// Time of `clock` when this driver was created.
    origin: Duration,
    /// Time of the adaptation loop at `origin`: that of the last line in the journal, or zero without a journal.
    start_time: Duration,
}

impl Driver {
    /// Waits until the functions are present, and logs the missing ones periodically. Then checks
    /// the designs and passes the current modes of the functions to the state machine. Returns
    /// early if `stop` is set.
    ///
    /// Requests to start or end a task wait for at most [`TASK_WAIT`]. A start is then refused. An end then takes
    /// effect, and gets its reply, only when the functions are present.
    fn wait_for_functions(
        &mut self,
        sender: &Sender<Input>,
        inputs: &Receiver<Input>,
        stop: &AtomicBool,
    ) -> Result<(), Message> {
        let (mut delayed, mut task_requests, mut last_log) = (Vec::new(), Vec::new(), Instant::now());
        let mut next_diagnostic = Instant::now();
        loop {
            if Instant::now() >= next_diagnostic {
                next_diagnostic = Instant::now() + PERIOD;
                self.diagnose();
            }
            let mut missing = smol::block_on(self.robot.wait(SEARCH_TIME));
            let is_there = missing.is_empty();
            // The writer of diagnostics may start later: it is reported as missing, but not waited for.
            missing.extend(self.robot.missing_writer());
            while let Ok(input) = inputs.try_recv() {
                // Clients of tasks wait for a reply, so their requests are kept with the time of arrival.
                match input {
                    Input::Request(..) | Input::Cancel(..) => task_requests.push((Instant::now(), input)),
                    other => delayed.push(other),
                }
            }
            if is_there {
                break;
            }
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            // A client that waits too long for its task treats it as refused, so the task must then
            // be refused.
            let (late, waiting) =
                task_requests.into_iter().partition(|(since, _)| since.elapsed() >= TASK_WAIT);
            task_requests = waiting;
            let late: Vec<(Instant, Input)> = late;
            late.into_iter().try_for_each(|(_, input)| self.handle(input))?;
            if last_log.elapsed() >= GRAPH_LOG_PERIOD {
                last_log = Instant::now();
                let text = format!("waits for the robot: {}", missing.join("; "));
                self.robot.event(&json!({"answer": "waiting", "missing": missing}));
                self.node.log(Severity::Warn, &text);
            }
        }
        delayed.extend(task_requests.into_iter().map(|(_, input)| input));
        self.fits()?;
        let modes = smol::block_on(self.robot.modes());
        for (function, mode) in &modes {
            self.node.log(Severity::Debug, &format!("{function} has the mode {mode:?}"));
        }
        let silent = modes.iter().filter(|(_, mode)| mode.is_none()).count();
        let text = match silent {
            0 => "every function answers".to_owned(),
            _ => format!("{silent} of {} functions do not report their modes", modes.len()),
        };
        self.node.log(Severity::Info, &text);
        // The calls above take seconds. What has arrived meanwhile must not be handled before the older inputs.
        delayed.extend(inputs.try_iter());
        // No action may begin if the autopilot has already reported that it accepts no commands.
        if let Some(mode) = last_autopilot_mode(&mut delayed) {
            self.handle(mode)?;
        }
        self.handle(Input::Ready(modes))?;
        delayed.extend(inputs.try_iter());
        for input in delayed {
            let _ = sender.send(input);
        }
        Ok(())
    }

    /// Checks that the designs of each function of `system_modes` that replies are modes of the function.
    fn fits(&self) -> Result<(), Message> {
        let mut missing = Vec::new();
        for (function, available) in smol::block_on(self.robot.available(&self.settings)) {
            let absent =
                self.machine.modes_of(&function).into_iter().filter(|mode| !available.contains(mode));
            missing.extend(absent.map(|mode| {
                let suggestion = did_you_mean(&mode, available.iter().map(String::as_str));
                format!("{function} has no mode `{mode}`{suggestion}")
            }));
        }
        if missing.is_empty() {
            return Ok(());
        }
        let text = format!(
            "designs of the mission are not modes of the robot; `[functions.F.modes]` of the settings names them: {}",
            missing.join("; ")
        );
        Err(Message::error("N132", text))
    }

    fn drive(&mut self, inputs: &Receiver<Input>, stop: &AtomicBool) -> Result<(), Message> {
        let (mut next, mut next_tick) = (Instant::now(), self.clock.elapsed());
        while !stop.load(Ordering::Relaxed) {
            let wait = next.saturating_duration_since(Instant::now()).min(Duration::from_millis(100));
            if !self.active.load(Ordering::Relaxed) {
                self.wait_for_activation(inputs, stop)?;
                continue;
            }
            match inputs.recv_timeout(wait) {
                Ok(input) => self.handle(input)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            // Ticks follow the clock of the node, whose simulated time may run faster or slower than the real time of
            // `next`.
            if self.clock.elapsed() >= next_tick {
                next_tick = self.clock.elapsed() + PERIOD;
                self.handle(Input::Tick)?;
            }
            if Instant::now() >= next {
                next = Instant::now() + PERIOD;
                self.robot.request_new_modes();
                self.diagnose();
            }
        }
        Ok(())
    }

    /// While the node is inactive, refuses requests to start or end a task, and keeps other inputs. The kept inputs are
    /// handled when the node is active, or when there are [`MAX_DELAYED_INPUTS`]. Returns early if `stop` is set.
    fn wait_for_activation(&mut self, inputs: &Receiver<Input>, stop: &AtomicBool) -> Result<(), Message> {
        let mut next_diagnostic = Instant::now();
        let delayed = delayed_inputs(inputs, &self.active, stop, |refused| {
            if let Some(number) = refused {
                self.robot.reply(number, false);
            }
            if Instant::now() >= next_diagnostic {
                next_diagnostic = Instant::now() + PERIOD;
                self.diagnose();
            }
        });
        if stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        delayed.into_iter().try_for_each(|input| self.handle(input))
    }

    fn handle(&mut self, input: Input) -> Result<(), Message> {
        let input = match input {
            Input::Diagnosed => Input::Line(self.robot.diagnosed()),
            other => other,
        };
        let now = self.start_time + self.clock.elapsed().saturating_sub(self.origin);
        if self.node.is_logged(Severity::Debug) && !matches!(input, Input::Tick) {
            self.node.log(Severity::Debug, &format!("hears {input:?}"));
        }
        // Effects of actions and facts of tasks set values that may have been measured before.
        let sets_values = matches!(input, Input::Performed(..) | Input::Progress(..) | Input::Request(..))
            || matches!(input, Input::Autopilot(_)) && self.machine.holds_requests();
        let outputs = self.machine.handle(input, now)?;
        if sets_values {
            self.robot.forget_measurements(|attribute| self.machine.measures_value(attribute));
        }
        for output in outputs {
            match output {
                Output::Change(change) => {
                    let timeout = Duration::from_millis(self.timeout.load(Ordering::Relaxed));
                    self.robot.change(change, timeout);
                }
                Output::Look(function) => self.robot.request_mode(&function),
                Output::Probe(function, after) => self.robot.probe(&function, after),
                Output::Reply(number, success) => self.robot.reply(number, success),
                Output::Perform(number, call) => {
                    let event = json!({
                        "answer": "begin_action", "action": number, "name": call.action, "arguments": call.arguments,
                    });
                    self.robot.perform(number, call);
                    // A robot that performs the action on this event may report its end at once.
                    self.robot.event(&event);
                }
                Output::Stop(number) => {
                    self.robot.event(&json!({"answer": "stop_action", "action": number}));
                    self.robot.stop(number);
                }
                Output::Await(wait, time) => self.robot.await_end(wait, time),
                Output::Plan(plan) => self.robot.plan(&plan),
                Output::Event(event) => self.robot.event(&event),
                Output::Warn(text) => self.node.warn_once(&text),
            }
        }
        Ok(())
    }

    fn diagnose(&self) {
        let state = self.machine.state();
        let level = match state {
            State::Degraded => DiagnosticStatus::WARN,
            State::WaitGraph => DiagnosticStatus::STALE,
            State::Idle | State::Plan | State::Reconfigure | State::Execute => DiagnosticStatus::OK,
        };
        let beliefs = self.machine.control().beliefs();
        let mut values = vec![
            ("state", state.to_string()),
            ("task", self.machine.task().unwrap_or_default().to_owned()),
            ("lines", beliefs.lines().to_string()),
        ];
        if let Some((_, step)) = beliefs.running() {
            values.push(("action", step.summary()));
        }
        self.robot.diagnose(level, &state.to_string(), values);
    }
}

/// Removes the reports of the autopilot's mode, and returns the last one.
fn last_autopilot_mode(delayed: &mut Vec<Input>) -> Option<Input> {
    let is_mode = |input: &Input| matches!(input, Input::Autopilot(_));
    let last = delayed.iter().rposition(is_mode).map(|at| delayed.remove(at));
    delayed.retain(|input| !is_mode(input));
    last
}

/// Returns the inputs that arrive until the node is active, `stop` is set, or there are [`MAX_DELAYED_INPUTS`]. Of the
/// progress of an action and of the autopilot's mode, only the last report is returned. Calls `idle` at least every
/// 50 ms, with the number of a request that must be refused, if there is one.
fn delayed_inputs(
    inputs: &Receiver<Input>,
    active: &AtomicBool,
    stop: &AtomicBool,
    mut idle: impl FnMut(Option<u64>),
) -> Vec<Input> {
    let mut delayed = Vec::new();
    let is_waiting = || !active.load(Ordering::Relaxed) && !stop.load(Ordering::Relaxed);
    while is_waiting() && delayed.len() < MAX_DELAYED_INPUTS {
        match inputs.recv_timeout(Duration::from_millis(50)) {
            Ok(Input::Request(number, _) | Input::Cancel(number, _)) => idle(Some(number)),
            Ok(input) => {
                match input {
                    Input::Progress(number, _) => delayed.retain(
                        |earlier| !matches!(earlier, Input::Progress(action, _) if *action == number),
                    ),
                    Input::Autopilot(_) => delayed.retain(|earlier| !matches!(earlier, Input::Autopilot(_))),
                    _ => {}
                }
                delayed.push(input);
                idle(None);
            }
            Err(RecvTimeoutError::Timeout) => idle(None),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    delayed
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc;

    use super::{delayed_inputs, last_autopilot_mode};
    use crate::manager::machine::Input;

    #[test]
    fn an_inactive_manager_can_be_stopped() {
        let (sender, inputs) = mpsc::channel();
        for input in [Input::Tick, Input::Request(7, "search_pipeline".to_owned())] {
            sender.send(input).expect("a receiver");
        }
        let (active, stop, mut refused) = (AtomicBool::new(false), AtomicBool::new(false), Vec::new());
        let delayed = delayed_inputs(&inputs, &active, &stop, |number| {
            refused.extend(number);
            stop.store(number.is_none() && !refused.is_empty(), Ordering::Relaxed);
        });
        assert_eq!(refused, [7]);
        assert!(matches!(delayed[..], [Input::Tick]), "{delayed:?}");
    }

    #[test]
    fn only_the_last_progress_of_an_action_waits_for_the_activation() {
        let (sender, inputs) = mpsc::channel();
        for percent in 0..100 {
            for number in [3, 4] {
                sender.send(Input::Progress(number, f64::from(percent) / 100.0)).expect("a receiver");
            }
        }
        sender.send(Input::Tick).expect("a receiver");
        drop(sender);
        let (active, stop) = (AtomicBool::new(false), AtomicBool::new(false));
        let delayed = delayed_inputs(&inputs, &active, &stop, |_| {});
        let [Input::Progress(3, third), Input::Progress(4, fourth), Input::Tick] = delayed[..] else {
            panic!("{delayed:?}");
        };
        assert_eq!((third.to_string(), fourth.to_string()), ("0.99".to_owned(), "0.99".to_owned()));
    }

    fn mode(mode: &str) -> Input {
        Input::Autopilot(mode.to_owned())
    }

    #[test]
    fn only_the_last_mode_of_the_autopilot_waits_for_the_activation() {
        let (sender, inputs) = mpsc::channel();
        for input in [mode("MANUAL"), Input::Tick, mode("GUIDED")] {
            sender.send(input).expect("a receiver");
        }
        drop(sender);
        let (active, stop) = (AtomicBool::new(false), AtomicBool::new(false));
        let delayed = delayed_inputs(&inputs, &active, &stop, |_| {});
        assert!(
            matches!(&delayed[..], [Input::Tick, Input::Autopilot(mode)] if mode == "GUIDED"),
            "{delayed:?}"
        );
    }

    #[test]
    fn the_last_mode_of_the_autopilot_precedes_the_start() {
        let mut delayed = vec![mode("GUIDED"), Input::Tick, mode("MANUAL"), Input::Diagnosed];
        let last = last_autopilot_mode(&mut delayed);
        assert!(matches!(&last, Some(Input::Autopilot(mode)) if mode == "MANUAL"), "{last:?}");
        assert!(matches!(delayed[..], [Input::Tick, Input::Diagnosed]), "{delayed:?}");
        assert!(last_autopilot_mode(&mut delayed).is_none());
    }
}
