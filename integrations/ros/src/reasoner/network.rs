//! Network side of the reasoner: its action server, subscriptions and service clients.
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

use metaplan::message::{Errors, Message};
use ros2_client::action::GoalId;
use serde_json::Value;
use smol::{Task, Timer};

use crate::diagnosed::{Diagnosed, Sources};
use crate::interfaces::mros2_msgs::action::{ControlQos, ControlQosFeedback, ControlQosResult};
use crate::interfaces::mros2_msgs::msg::QoS;
use crate::interfaces::mros2_msgs::srv::{MetacontrolFD, MetacontrolFDRequest};
use crate::interfaces::std_msgs;
use crate::interfaces::system_modes_msgs::srv::{ChangeMode, ChangeModeRequest, GetMode, GetModeRequest};
use crate::node::{
    CallError, Caller, CancelRequest, GoalEnd, GoalEvent, Goals, Lifecycle, Node, Publisher, Severity,
    Wanted as Offer, depth,
};
use crate::procedure::{self, Procedure, Procedures, Seen};
use crate::reasoner::keeping::{Keeping, Outcome, Output, Wanted};
use crate::reasoner::memory::{MemoryFile, Remembered};

const CHANGE_TIMEOUT: Duration = Duration::from_secs(5);

const MODE_TIMEOUT: Duration = Duration::from_secs(2);

/// Pause between attempts to connect to the bridge in advance.
const RETRY_PAUSE: Duration = Duration::from_secs(1);

enum Input {
    Wanted(Offer, QoS),
    Cancel(GoalId, CancelRequest),
    Diagnosed,
    Answered(Wanted, Outcome),
    /// Steps of a function have failed, and it is in none of its modes.
    InNoMode(String),
}

pub(super) struct Network {
    node: Arc<Node>,
    keeping: Keeping,
    goals: Arc<Goals<ControlQos>>,
    cancels: BTreeMap<GoalId, Vec<CancelRequest>>,
    bridge: Arc<Caller<MetacontrolFD>>,
    systems: BTreeMap<String, Arc<Caller<ChangeMode>>>,
    calling: BTreeMap<String, Task<()>>,
    procedures: Arc<Procedures>,
    /// Flags that make a running procedure end before its next step, by function.
    replaced: BTreeMap<String, Arc<AtomicBool>>,
    diagnosed: Diagnosed,
    events: Arc<Publisher<std_msgs::msg::String>>,
    /// Period in which the statuses of objectives are published, in milliseconds.
    period: Arc<AtomicU64>,
    active: Arc<AtomicBool>,
    memory: Option<MemoryFile>,
    sender: Sender<Input>,
    inputs: Receiver<Input>,
}

impl Network {
    pub(super) fn connect(
        node: &Arc<Node>,
        keeping: Keeping,
        procedures: BTreeMap<String, BTreeMap<String, Procedure>>,
        sources: Sources,
        memory: Option<MemoryFile>,
    ) -> Result<Self, Errors> {
        let to_errors = |message: Message| vec![message];
        let period = node.declare_seconds(
            "reasoning_period",
            "Period of reports on objectives, in seconds; changes are reported immediately.",
            1.5,
        )?;
        let (sender, inputs) = mpsc::channel();
        let diagnostic_sender = sender.clone();
        let diagnosed =
            Diagnosed::subscribe(node, sources, move || drop(diagnostic_sender.send(Input::Diagnosed)))
                .map_err(to_errors)?;
        let goal_sender = sender.clone();
        let goals = node.serve_action::<ControlQos>("/mros/objective", move |event| {
            let input = match event {
                GoalEvent::Wanted(offer, goal) => Input::Wanted(offer, goal.qos_expected),
                GoalEvent::Cancel(goal, request) => Input::Cancel(goal, request),
            };
            let _ = goal_sender.send(input);
        });
        let systems = keeping.functions().into_iter().map(|function| {
            let service = format!("/{}/change_mode", keeping.system(&function));
            let caller = node.caller(&service);
            (function, Arc::new(caller))
        });
        let systems = systems.collect();
        let bridge = Arc::new(node.caller::<MetacontrolFD>("/mros/request_configuration"));
        let client = Arc::clone(&bridge);
        // Connects in advance, so that the first call need not wait for discovery.
        smol::spawn(until_ok(move || {
            let client = Arc::clone(&client);
            async move { client.ready(CHANGE_TIMEOUT).await }
        }))
        .detach();
        let events = Arc::new(node.publisher("~/events", depth(100)).map_err(to_errors)?);
        let publisher = Arc::clone(&events);
        let report =
            move |event: &Value| publisher.publish(std_msgs::msg::String { data: event.to_string() });
        let procedures = Arc::new(Procedures::new(node, procedures, report).map_err(to_errors)?);
        let active = Lifecycle::activated(node).map_err(to_errors)?;
        Ok(Self {
            node: Arc::clone(node),
            keeping,
            goals: goals.map_err(to_errors)?,
            cancels: BTreeMap::new(),
            bridge,
            systems,
            calling: BTreeMap::new(),
            procedures,
            replaced: BTreeMap::new(),
            diagnosed,
            events,
            period,
            active,
            memory,
            sender,
            inputs,
        })
    }

    pub(super) fn run(mut self, stop: &AtomicBool) -> Result<(), Message> {
        self.go_on();
        self.node.log(Severity::Info, "serves /mros/objective");
        let clock = self.node.clock();
        let mut next = clock.elapsed();
        while !stop.load(Ordering::Relaxed) {
            let wait = next.saturating_sub(clock.elapsed()).min(Duration::from_millis(100));
            match self.inputs.recv_timeout(wait) {
                Ok(input) => {
                    self.handle(input, clock.elapsed());
                    // The state is written before the requests are sent, so that a crash in between loses no goal.
                    if let Some(memory) = &mut self.memory {
                        memory.write(self.keeping.memory())?;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            if clock.elapsed() >= next {
                next = clock.elapsed() + Duration::from_millis(self.period.load(Ordering::Relaxed).max(1));
                self.keeping.tick(clock.elapsed());
            }
            self.carry_out();
        }
        Ok(())
    }

    fn go_on(&mut self) {
        let Some(memory) = self.memory.as_ref().map(MemoryFile::read) else { return };
        if !memory.goals.is_empty() {
            let text = format!("continues from the journal with {} objectives", memory.goals.len());
            self.node.log(Severity::Info, &text);
        }
        let goals: Vec<GoalId> =
            memory.goals.iter().map(|remembered| self.goals.go_on(remembered.goal)).collect();
        let request = |remembered: &Remembered| {
            let function = remembered.wanted.objective_type.clone();
            let service = format!("/{}/get_mode", self.keeping.system(&function));
            let caller = self.node.caller::<GetMode>(&service);
            let procedures = Arc::clone(&self.procedures);
            async move {
                if procedures.contains(&function) {
                    return match procedures.observe(&function).await {
                        Seen::Mode(mode) => Some((function, mode)),
                        Seen::Nothing => Some((function, String::new())),
                        Seen::Unsettled | Seen::Ambiguous => None,
                    };
                }
                let answer = caller.call(GetModeRequest::default(), MODE_TIMEOUT).await.ok()?;
                Some((function, answer.current_mode))
            }
        };
        let modes = smol::block_on(futures::future::join_all(memory.goals.iter().map(request)));
        let modes = modes.into_iter().flatten().collect();
        self.keeping.remember(memory, &goals, &modes);
    }

    fn handle(&mut self, input: Input, now: Duration) {
        match input {
            Input::Wanted(offer, wanted) => {
                let rests =
                    (!self.active.load(Ordering::Relaxed)).then(|| "the node is not active".to_owned());
                if let Some(because) = rests.or_else(|| self.keeping.refused(&wanted)) {
                    self.node.log(Severity::Warn, &format!("a goal is rejected: {because}"));
                    self.goals.reject(offer);
                } else {
                    let goal = self.goals.accept(offer);
                    self.keeping.pursue(goal, &wanted);
                }
            }
            Input::Cancel(goal, request) => {
                self.cancels.entry(goal).or_default().push(request);
                self.keeping.cancel(goal);
            }
            Input::Diagnosed => {
                let line = self.diagnosed.line();
                self.keeping.handle_line(&line);
            }
            Input::Answered(wanted, outcome) => self.keeping.answered(&wanted, outcome, now),
            Input::InNoMode(function) => self.keeping.lose_design(&function),
        }
    }

    fn carry_out(&mut self) {
        for output in self.keeping.outputs() {
            match output {
                Output::Configure(wanted) => self.configure(wanted),
                Output::Feedback(goal, qos_status) => {
                    self.goals.feedback(goal, ControlQosFeedback { qos_status });
                }
                Output::Cancelled(goal, is_so) => {
                    for request in self.cancels.remove(&goal).unwrap_or_default() {
                        self.goals.canceling(request, is_so);
                    }
                    if is_so {
                        self.goals.finish(goal, GoalEnd::Canceled, ControlQosResult::default());
                    }
                }
                Output::Event(event) => {
                    self.events.publish(std_msgs::msg::String { data: event.to_string() });
                }
                Output::Warn(text) => self.node.warn_once(&text),
            }
        }
    }

    /// Executes the steps of a mode, if the settings have some. Otherwise requests the mode from MROS's
    /// bridge, or from the function itself if only its service has a server.
    fn configure(&mut self, wanted: Wanted) {
        if self.procedures.contains(&wanted.function) {
            self.execute(wanted);
            return;
        }
        let bridge = Arc::clone(&self.bridge);
        let Some(system) = self.systems.get(&wanted.function).map(Arc::clone) else { return };
        let (sender, name) = (self.sender.clone(), wanted.function.clone());
        // A running call for the same function is cancelled first.
        self.calling.remove(&name);
        let call = smol::spawn(async move {
            let (function, mode) = (wanted.function.clone(), wanted.mode.clone());
            let answer: Result<bool, CallError> = if bridge.is_served() || !system.is_served() {
                let request =
                    MetacontrolFDRequest { required_function_name: function, required_fd_name: mode };
                bridge.call(request, CHANGE_TIMEOUT).await.map(|answer| answer.success)
            } else {
                system
                    .call(ChangeModeRequest { mode_name: mode }, CHANGE_TIMEOUT)
                    .await
                    .map(|answer| answer.success)
            };
            let outcome = match answer {
                Ok(true) => Outcome::Done,
                Ok(false) => Outcome::Refused,
                Err(error) => Outcome::Failed(error.to_string()),
            };
            let _ = sender.send(Input::Answered(wanted, outcome));
        });
        self.calling.insert(name, call);
    }

    /// Executes the steps of a mode. Running steps of the function are normally undone first.
    fn execute(&mut self, wanted: Wanted) {
        let is_replaced = Arc::new(AtomicBool::new(false));
        if let Some(earlier) = self.replaced.insert(wanted.function.clone(), Arc::clone(&is_replaced)) {
            earlier.store(true, Ordering::Relaxed);
        }
        let (procedures, sender) = (Arc::clone(&self.procedures), self.sender.clone());
        smol::spawn(async move {
            let applied =
                procedures.apply(&wanted.function, &wanted.mode, CHANGE_TIMEOUT, &is_replaced).await;
            let outcome = match applied {
                procedure::Outcome::Done => Outcome::Done,
                procedure::Outcome::Failed(because) => Outcome::StepFailed(because),
                procedure::Outcome::Silent(because) => Outcome::Failed(because),
            };
            let is_lost = outcome != Outcome::Done && procedures.is_in_no_mode(&wanted.function);
            let lost = is_lost.then(|| Input::InNoMode(wanted.function.clone()));
            for input in [Some(Input::Answered(wanted, outcome)), lost].into_iter().flatten() {
                let _ = sender.send(input);
            }
        })
        .detach();
    }
}

/// Repeats an attempt until it succeeds. An attempt can fail without waiting, for example if the server has another
/// type; without a pause between the attempts, no other task of the executor's thread would run.
async fn until_ok<F: Future<Output = Result<(), CallError>>>(attempt: impl Fn() -> F) {
    while attempt().await.is_err() {
        Timer::after(RETRY_PAUSE).await;
    }
}

#[cfg(test)]
mod tests {
    use super::{CallError, until_ok};

    #[test]
    fn failing_attempts_leave_time_for_other_tasks() {
        let attempt = || async {
            let (service, complaint) = ("/mros/request_configuration".to_owned(), "another type".to_owned());
            Err(CallError::Unfit { service, complaint })
        };
        let first_poll = smol::block_on(smol::future::poll_once(Box::pin(until_ok(attempt))));
        assert_eq!(first_poll, None, "it waits");
    }
}
