//! Connection of the manager to the robot: topics and services become inputs of the state machine,
//! and its outputs become calls.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::Message;
use serde_json::{Value, json};
use smol::{Task, Timer};

use crate::diagnosed::{Diagnosed, Sources};
use crate::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::interfaces::lifecycle_msgs::msg::TransitionEvent;
use crate::interfaces::lyrical::lifecycle_msgs::msg as lyrical;
use crate::interfaces::mavros_msgs;
use crate::interfaces::rcl_interfaces::msg::ParameterEvent;
use crate::interfaces::std_msgs;
use crate::interfaces::suave_msgs::srv::{Task as TaskService, TaskResponse};
use crate::interfaces::system_modes_msgs::msg::ModeEvent;
use crate::interfaces::system_modes_msgs::srv::{
    ChangeMode, ChangeModeRequest, GetAvailableModes, GetAvailableModesRequest, GetMode, GetModeRequest,
};
use crate::manager::machine::{Change, Ended, Input, Outcome};
use crate::manager::settings::Settings;
use crate::node::{CallError, Caller, Node, Publisher, Responder, depth, is_lyrical, keep_all, latched};
use crate::perform::{Call, End, Perform, Progress, Running};
use crate::procedure::{self, Procedures, Seen};

const MODE_TIMEOUT: Duration = Duration::from_secs(2);

/// Time after which an observation is repeated if a node was silent or in a transition, or steps were being executed.
const OBSERVATION_DELAY: Duration = Duration::from_millis(500);

/// Answer of the mode manager of `system_modes` while it cannot infer a function's mode.
const UNKNOWN_MODE: &str = "unknown";

/// Number of requests until [`UNKNOWN_MODE`] means that the function is in none of its modes. A mode manager that was
/// just started has not received the states of the nodes yet.
const MAX_UNKNOWN: u32 = 4;

/// Number of mode requests to a new server, one per call of [`Robot::request_new_modes`]. The first ones may be lost
/// before the server has discovered this node.
const MAX_MODE_REQUESTS: u32 = 3;

/// Minimum time after a report of progress until the next one with another share.
const CHANGE_PERIOD: Duration = Duration::from_millis(100);

/// Minimum time after a report of progress until feedback repeats this report.
const REPEAT_PERIOD: Duration = Duration::from_secs(1);

#[derive(Clone)]
enum Means {
    Modes { change: Arc<Caller<ChangeMode>>, get_mode: Arc<Caller<GetMode>> },
    Steps,
}

struct Function {
    means: Means,
    /// Running call. A new call replaces it.
    calling: Option<Task<()>>,
    /// Flag that makes the running procedure end before its next step.
    is_replaced: Arc<AtomicBool>,
    mode_request: Option<Task<()>>,
    /// GUIDs of the servers of `get_mode`, or of the servers that show the design that steps have set.
    servers: BTreeSet<[u8; 16]>,
    remaining_requests: u32,
}

pub(super) struct Robot {
    node: Arc<Node>,
    inputs: Sender<Input>,
    functions: BTreeMap<String, Function>,
    procedures: Arc<Procedures>,
    performers: BTreeMap<String, Box<dyn Perform>>,
    performing: HashMap<u64, (Running, Task<()>)>,
    diagnosed: Diagnosed,
    replies: Arc<Mutex<HashMap<u64, Responder<TaskService>>>>,
    plans: Publisher<std_msgs::msg::String>,
    events: Arc<Publisher<std_msgs::msg::String>>,
    diagnostics: Publisher<DiagnosticArray>,
}

impl Robot {
    pub(super) fn connect(
        node: &Arc<Node>,
        settings: &Settings,
        functions: &[String],
        performers: BTreeMap<String, Box<dyn Perform>>,
        repeats: BTreeMap<String, Duration>,
        inputs: Sender<Input>,
    ) -> Result<Self, Message> {
        let queue = inputs.clone();
        let sources = Sources { rules: settings.rules(), signals: settings.signals(), repeats };
        let diagnosed = Diagnosed::subscribe(node, sources, move || drop(queue.send(Input::Diagnosed)))?;
        let events = Arc::new(node.publisher("~/events", depth(100))?);
        let publisher = Arc::clone(&events);
        let report =
            move |event: &Value| publisher.publish(std_msgs::msg::String { data: event.to_string() });
        let procedures = Arc::new(Procedures::new(node, settings.functions.procedures(), report)?);
        let mut services = BTreeMap::new();
        for function in functions {
            let means = if procedures.contains(function) {
                Means::Steps
            } else {
                subscribe_function(node, settings, function, &inputs)?;
                let system = settings.functions.system(function);
                let service = |name: &str| format!("/{system}/{name}");
                Means::Modes {
                    change: Arc::new(node.caller(&service("change_mode"))),
                    get_mode: Arc::new(node.caller(&service("get_mode"))),
                }
            };
            services.insert(
                function.clone(),
                Function {
                    means,
                    calling: None,
                    is_replaced: Arc::default(),
                    mode_request: None,
                    servers: BTreeSet::new(),
                    remaining_requests: 0,
                },
            );
        }
        subscribe_nodes(node, settings, functions, &procedures, &inputs)?;
        if let Some(autopilot) = &settings.autopilot {
            let inputs = inputs.clone();
            node.subscribe::<mavros_msgs::msg::State>(&autopilot.topic, depth(10), move |state| {
                let _ = inputs.send(Input::Autopilot(state.mode));
            })?;
        }
        let replies = Arc::default();
        serve_tasks(node, &inputs, &replies)?;
        Ok(Self {
            node: Arc::clone(node),
            inputs,
            functions: services,
            procedures,
            performers,
            performing: HashMap::new(),
            diagnosed,
            replies,
            plans: node.publisher("~/plan", latched(1))?,
            events,
            diagnostics: node.publisher("/diagnostics", depth(10))?,
        })
    }

    /// Waits until every function has its servers, or the time is up. Returns descriptions of the missing
    /// servers.
    pub(super) async fn wait(&self, within: Duration) -> Vec<String> {
        let missing = self.functions.iter().map(|(name, function)| async move {
            match &function.means {
                Means::Modes { change, .. } => {
                    change.ready(within).await.err().map(|error| error.to_string()).into_iter().collect()
                }
                Means::Steps => self.procedures.missing(name, within).await,
            }
        });
        futures::future::join_all(missing).await.into_iter().flatten().collect()
    }

    pub(super) fn missing_writer(&self) -> Option<String> {
        (!self.node.is_written("/diagnostics")).then(|| "/diagnostics has no publisher".to_owned())
    }

    /// Returns the mode of each function, if it is known. Missing replies are logged and published as events,
    /// except those of functions whose modes cannot be observed.
    pub(super) async fn modes(&self) -> Vec<(String, Option<String>)> {
        let request = |(name, function): (&String, &Function)| {
            let (name, means) = (name.clone(), function.means.clone());
            async move {
                let answer = match means {
                    Means::Modes { get_mode, .. } => {
                        reported_mode(&get_mode).await.map_err(|error| error.to_string())
                    }
                    Means::Steps => match self.procedures.observe(&name).await {
                        Seen::Mode(mode) => Ok(mode),
                        Seen::Nothing => Ok(String::new()),
                        Seen::Unsettled | Seen::Ambiguous => {
                            Err(format!("the nodes of {name} do not show the current design"))
                        }
                    },
                };
                (name, answer)
            }
        };
        let answers = futures::future::join_all(self.functions.iter().map(request)).await;
        let logged = |(name, answer): (String, Result<String, String>)| match answer {
            Ok(mode) => (name, Some(mode)),
            Err(because) => {
                // Service calls and commands cannot be observed, which is no fault of the robot.
                if !self.procedures.is_unobservable(&name) {
                    self.event(&json!({"answer": "silent", "function": name, "because": because}));
                    self.node.warn_once(&because);
                }
                (name, None)
            }
        };
        answers.into_iter().map(logged).collect()
    }

    /// Returns the possible modes of each function of `system_modes` that replies.
    pub(super) async fn available(&self, settings: &Settings) -> Vec<(String, Vec<String>)> {
        let request = |name: &String| {
            let service = format!("/{}/get_available_modes", settings.functions.system(name));
            let (name, caller) = (name.clone(), self.node.caller::<GetAvailableModes>(&service));
            async move {
                let answer = caller.call(GetAvailableModesRequest::default(), MODE_TIMEOUT).await.ok();
                answer.map(|answer| (name, answer.available_modes))
            }
        };
        let with_modes =
            self.functions.iter().filter(|(_, function)| matches!(function.means, Means::Modes { .. }));
        let answers = with_modes.map(|(name, _)| request(name));
        futures::future::join_all(answers).await.into_iter().flatten().collect()
    }

    /// Calls `change_mode`, or executes the steps of the mode. A running call of the function is cancelled. Running
    /// steps end before their next step, and are undone before the new ones are executed.
    pub(super) fn change(&mut self, change: Change, within: Duration) {
        let Some(function) = self.functions.get_mut(&change.function) else { return };
        let inputs = self.inputs.clone();
        match function.means.clone() {
            Means::Modes { change: caller, .. } => {
                // The running call must end first, because it holds the client.
                function.calling = None;
                function.calling = Some(smol::spawn(async move {
                    let request = ChangeModeRequest { mode_name: change.mode.clone() };
                    let outcome = match caller.call(request, within).await {
                        Ok(answer) if answer.success => Outcome::Done,
                        Ok(_) => Outcome::Refused,
                        Err(error) => Outcome::Failed(error.to_string()),
                    };
                    let _ = inputs.send(Input::Changed(change, outcome));
                }));
            }
            Means::Steps => {
                function.is_replaced.store(true, Ordering::Relaxed);
                let is_replaced = Arc::new(AtomicBool::new(false));
                function.is_replaced = Arc::clone(&is_replaced);
                let procedures = Arc::clone(&self.procedures);
                // The task is not cancelled, so that it can undo its steps.
                smol::spawn(async move {
                    let outcome =
                        procedures.apply(&change.function, &change.mode, within, &is_replaced).await;
                    let outcome = match outcome {
                        procedure::Outcome::Done => Outcome::Done,
                        procedure::Outcome::Failed(because) => Outcome::StepFailed(because),
                        procedure::Outcome::Silent(because) => Outcome::Failed(because),
                    };
                    let has_failed = outcome != Outcome::Done;
                    let outcome = if has_failed && procedures.is_in_no_mode(&change.function) {
                        Outcome::NoMode(Box::new(outcome))
                    } else {
                        outcome
                    };
                    let _ = inputs.send(Input::Changed(change, outcome));
                })
                .detach();
            }
        }
    }

    /// Requests the modes of functions with new servers, because a restarted server has lost its mode. If steps set the
    /// designs of a function, a lost server of its nodes counts, too.
    pub(super) fn request_new_modes(&mut self) {
        let mut names = Vec::new();
        for (name, function) in &mut self.functions {
            let servers = match &function.means {
                Means::Modes { get_mode, .. } => get_mode.servers(),
                Means::Steps => self.procedures.servers(name),
            };
            let is_changed = match &function.means {
                Means::Modes { .. } => !function.servers.is_empty() && !servers.is_subset(&function.servers),
                Means::Steps => servers != function.servers,
            };
            if is_changed {
                function.remaining_requests = MAX_MODE_REQUESTS;
            }
            if !servers.is_empty() || matches!(function.means, Means::Steps) {
                function.servers = servers;
            }
            if function.remaining_requests > 0 {
                function.remaining_requests -= 1;
                names.push(name.clone());
            }
        }
        for name in names {
            self.request_mode(&name);
        }
    }

    pub(super) fn request_mode(&mut self, name: &str) {
        let Some(function) = self.functions.get_mut(name) else { return };
        let (inputs, name) = (self.inputs.clone(), name.to_owned());
        // The previous request is cancelled and must have ended first. Its observation may have begun before the
        // change that has caused this request, and a second observation during the first one would be unsettled.
        let previous = function.mode_request.take();
        let end_previous = async move {
            if let Some(previous) = previous {
                previous.cancel().await;
            }
        };
        function.mode_request = Some(match &function.means {
            Means::Modes { get_mode, .. } => {
                let get_mode = Arc::clone(get_mode);
                smol::spawn(async move {
                    end_previous.await;
                    if let Ok(mode) = reported_mode(&get_mode).await {
                        let _ = inputs.send(Input::Mode(name, mode));
                    }
                })
            }
            Means::Steps => {
                let procedures = Arc::clone(&self.procedures);
                smol::spawn(async move {
                    end_previous.await;
                    // No event announces that a silent node answers again or that a transition has ended unnoticed.
                    let mode = loop {
                        match procedures.observe(&name).await {
                            Seen::Mode(mode) => break mode,
                            Seen::Nothing => break String::new(),
                            Seen::Unsettled => Timer::after(OBSERVATION_DELAY).await,
                            Seen::Ambiguous => return,
                        };
                    };
                    let _ = inputs.send(Input::Mode(name, mode));
                })
            }
        });
    }

    /// Checks later whether a function replies. A function without a server of `get_mode` counts as replying if
    /// `change_mode` has a server.
    pub(super) fn probe(&mut self, name: &str, after: Duration) {
        let Some(function) = self.functions.get(name) else { return };
        let (means, procedures) = (function.means.clone(), Arc::clone(&self.procedures));
        let (inputs, name) = (self.inputs.clone(), name.to_owned());
        smol::spawn(async move {
            Timer::after(after).await;
            let answers = match means {
                Means::Modes { change, get_mode } => {
                    match get_mode.call(GetModeRequest::default(), MODE_TIMEOUT).await {
                        Ok(_) => true,
                        Err(CallError::Absent { .. }) => change.is_served(),
                        Err(_) => false,
                    }
                }
                Means::Steps => procedures.answers(&name).await,
            };
            let _ = inputs.send(Input::Probed(name, answers));
        })
        .detach();
    }

    pub(super) fn diagnosed(&self) -> String {
        self.diagnosed.line()
    }

    pub(super) fn forget_measurements(&self, is_selected: impl Fn(&str) -> bool) {
        self.diagnosed.forget_measurements(is_selected);
    }

    pub(super) fn reply(&self, number: u64, success: bool) {
        let mut replies = self.replies.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(responder) = replies.remove(&number) {
            responder.send(TaskResponse { success });
        }
    }

    /// Starts an action. An action without a performer ends immediately with success.
    pub(super) fn perform(&mut self, number: u64, call: Call) {
        // PDDL names are case-insensitive.
        let performer = self.performers.iter().find(|(action, _)| action.eq_ignore_ascii_case(&call.action));
        let Some((_, performer)) = performer else {
            let _ = self.inputs.send(Input::Performed(number, Ended::Succeeded));
            return;
        };
        let running = performer.start(call);
        let (events, inputs) = (running.clone(), self.inputs.clone());
        let task = smol::spawn(async move {
            let mut reports = Reports::default();
            loop {
                let due = reports.due();
                let timer = async {
                    match due {
                        Some(due) => _ = Timer::at(due).await,
                        None => futures::future::pending().await,
                    }
                    None
                };
                let completion = match smol::future::or(async { Some(events.next().await) }, timer).await {
                    Some(Progress::Feedback { completion, .. }) => completion,
                    None => None,
                    Some(Progress::Ended(end)) => {
                        let ended = match end {
                            End::Succeeded => Ended::Succeeded,
                            End::Canceled => Ended::Cancelled,
                            End::Failed(reason) => Ended::Failed(reason),
                        };
                        let _ = inputs.send(Input::Performed(number, ended));
                        return;
                    }
                };
                if let Some(fraction) = reports.fraction(completion, Instant::now()) {
                    let _ = inputs.send(Input::Progress(number, fraction));
                }
            }
        });
        self.performing.retain(|_, (_, task)| !task.is_finished());
        self.performing.insert(number, (running, task));
    }

    /// Cancels an action. An action that this program does not execute is reported as cancelled.
    pub(super) fn stop(&self, number: u64) {
        match self.performing.get(&number) {
            Some((running, _)) => running.cancel(),
            None => drop(self.inputs.send(Input::Performed(number, Ended::Cancelled))),
        }
    }

    /// Reports after a real time that an action should have ended. Simulated time may be paused.
    pub(super) fn await_end(&self, wait: u64, time: Duration) {
        let inputs = self.inputs.clone();
        smol::spawn(async move {
            Timer::after(time).await;
            let _ = inputs.send(Input::Overdue(wait));
        })
        .detach();
    }

    pub(super) fn plan(&self, plan: &Value) {
        self.plans.publish(std_msgs::msg::String { data: plan.to_string() });
    }

    pub(super) fn event(&self, event: &Value) {
        self.events.publish(std_msgs::msg::String { data: event.to_string() });
    }

    pub(super) fn diagnose(&self, level: u8, message: &str, values: Vec<(&str, String)>) {
        let values = values.into_iter().map(|(key, value)| KeyValue { key: key.to_owned(), value }).collect();
        let status = DiagnosticStatus {
            level,
            name: format!("{}: manager", self.node.full_name().trim_start_matches('/')),
            message: message.to_owned(),
            hardware_id: String::new(),
            values,
        };
        let mut array = DiagnosticArray { status: vec![status], ..DiagnosticArray::default() };
        array.header.stamp = self.node.clock().stamp();
        self.diagnostics.publish(array);
    }
}

/// Requests the mode of a function from its mode manager, and again while the mode manager does not know it.
async fn reported_mode(get_mode: &Caller<GetMode>) -> Result<String, CallError> {
    let mut requests = 0;
    loop {
        let mode = get_mode.call(GetModeRequest::default(), MODE_TIMEOUT).await?.current_mode;
        requests += 1;
        if mode != UNKNOWN_MODE || requests == MAX_UNKNOWN {
            return Ok(mode);
        }
        Timer::after(OBSERVATION_DELAY).await;
    }
}

#[derive(Debug, Default)]
struct Reports {
    /// The last known share, in hundredths.
    share: Option<f64>,
    /// The last reported share, with the time of its report.
    last: Option<(f64, Instant)>,
}

impl Reports {
    /// Returns the completed share that feedback reports, rounded to hundredths. Feedback without a share repeats the
    /// last known one. Repetitions are limited by [`REPEAT_PERIOD`]. They show that the action goes on, which the loop
    /// would otherwise cancel for silence. Changes are limited by [`CHANGE_PERIOD`], because each report is a line of
    /// the journal, and Nav2 sends 100 messages per second.
    fn fraction(&mut self, completion: Option<f32>, now: Instant) -> Option<f64> {
        self.share = completion.map(|share| (f64::from(share) * 100.0).round()).or(self.share);
        let share = self.share?;
        let is_due = self.last.is_none_or(|(last, since)| {
            let period = if (share - last).abs() < 0.5 { REPEAT_PERIOD } else { CHANGE_PERIOD };
            now.saturating_duration_since(since) >= period
        });
        is_due.then(|| {
            self.last = Some((share, now));
            share / 100.0
        })
    }

    /// Returns the time at which the last known share must be reported, if it was not reported at once.
    fn due(&self) -> Option<Instant> {
        let (last, since) = self.last?;
        self.share.filter(|share| (share - last).abs() >= 0.5).map(|_| since + CHANGE_PERIOD)
    }
}

fn subscribe_function(
    node: &Arc<Node>,
    settings: &Settings,
    function: &str,
    inputs: &Sender<Input>,
) -> Result<(), Message> {
    let system = settings.functions.system(function);
    let (name, sender) = (function.to_owned(), inputs.clone());
    node.subscribe::<ModeEvent>(&format!("/{system}/mode_request_info"), depth(10), move |event| {
        let _ = sender.send(Input::ModeRequested(name.clone(), event.goal_mode.label));
    })?;
    let (name, sender) = (function.to_owned(), inputs.clone());
    let topic = format!("/{}/transition_event", settings.functions.node(function));
    subscribe_transitions(node, &topic, move || drop(sender.send(Input::Touched(name.clone()))))
}

/// Subscribes to the parameter changes of the functions' nodes and of the nodes that steps use. Also subscribes to
/// the lifecycle transitions of the nodes that steps use.
fn subscribe_nodes(
    node: &Arc<Node>,
    settings: &Settings,
    functions: &[String],
    procedures: &Procedures,
    inputs: &Sender<Input>,
) -> Result<(), Message> {
    let mut of_node: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for function in functions {
        for name in procedures.nodes(function) {
            of_node.entry(node.resolve(&name)).or_default().push(function.clone());
        }
    }
    for (name, functions) in &of_node {
        let (functions, sender) = (functions.clone(), inputs.clone());
        subscribe_transitions(node, &format!("{name}/transition_event"), move || {
            for function in &functions {
                let _ = sender.send(Input::Touched(function.clone()));
            }
        })?;
    }
    for function in functions.iter().filter(|function| !procedures.contains(function)) {
        let name = format!("/{}", settings.functions.node(function));
        of_node.entry(name).or_default().push(function.clone());
    }
    let inputs = inputs.clone();
    node.subscribe::<ParameterEvent>("/parameter_events", keep_all(), move |event| {
        let name = format!("/{}", event.node.trim_start_matches('/'));
        for function in of_node.get(&name).into_iter().flatten() {
            let _ = inputs.send(Input::Touched(function.clone()));
        }
    })
}

fn subscribe_transitions(
    node: &Arc<Node>,
    topic: &str,
    touched: impl Fn() + Send + 'static,
) -> Result<(), Message> {
    if is_lyrical() {
        node.subscribe::<lyrical::TransitionEvent>(topic, depth(10), move |_| touched())
    } else {
        node.subscribe::<TransitionEvent>(topic, depth(10), move |_| touched())
    }
}

type Replies = Arc<Mutex<HashMap<u64, Responder<TaskService>>>>;

fn serve_tasks(node: &Arc<Node>, inputs: &Sender<Input>, replies: &Replies) -> Result<(), Message> {
    let count = Arc::new(AtomicU64::new(0));
    for (service, is_request) in [("/task/request", true), ("/task/cancel", false)] {
        let (inputs, replies, count) = (inputs.clone(), Arc::clone(replies), Arc::clone(&count));
        node.serve::<TaskService>(service, move |request, responder| {
            let number = count.fetch_add(1, Ordering::Relaxed);
            replies.lock().unwrap_or_else(PoisonError::into_inner).insert(number, responder);
            let input = if is_request { Input::Request } else { Input::Cancel };
            let _ = inputs.send(input(number, request.task_name));
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::Reports;

    #[test]
    fn feedback_without_a_share_repeats_the_last_one() {
        let (mut reports, start) = (Reports::default(), Instant::now());
        let mut at =
            |millis: u64, completion| reports.fraction(completion, start + Duration::from_millis(millis));
        assert_eq!(at(0, None), None, "no share is known");
        assert_eq!(at(100, Some(0.5)), Some(0.5));
        assert_eq!(at(200, None), None);
        assert_eq!(at(1100, None), Some(0.5));
        assert_eq!(at(1200, None), None);
        assert_eq!(at(1300, Some(0.75)), Some(0.75));
    }

    #[test]
    fn frequent_feedback_is_reported_at_most_ten_times_per_second() {
        let start = Instant::now();
        // Ten seconds of feedback every 10 ms, as of Nav2: the number of reports by the final share.
        for (last_share, expected) in [(1.0, 100), (0.4, 41), (0.0, 10)] {
            let (mut reports, mut shares) = (Reports::default(), Vec::new());
            for step in 0..1000_u16 {
                let share = last_share * f32::from(step) / 1000.0;
                let now = start + Duration::from_millis(10) * u32::from(step);
                shares.extend(reports.fraction(Some(share), now));
            }
            assert_eq!(shares.len(), expected, "{shares:?}");
            assert!(shares.is_sorted(), "{shares:?}");
            assert!((shares[shares.len() - 1] - f64::from(last_share)).abs() < 0.015, "{shares:?}");
        }
        // A share that was not reported at once is reported later, even without further feedback.
        let mut reports = Reports::default();
        let at = |millis| start + Duration::from_millis(millis);
        assert_eq!(reports.fraction(Some(0.1), at(0)), Some(0.1));
        assert_eq!(reports.due(), None);
        assert_eq!(reports.fraction(Some(0.257), at(10)), None);
        assert_eq!(reports.due(), Some(at(100)));
        assert_eq!(reports.fraction(None, at(100)), Some(0.26));
        assert_eq!(reports.due(), None);
    }
}
