//! Execution of procedures: steps in order, verification, and rollback after a failure.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use metaplan::message::Message;
use serde_json::{Value, json};

use crate::node::{Node, Severity};
use crate::procedure::clients::{Clients, Failure, OBSERVATION_TIMEOUT, execute};
use crate::procedure::settings::{Condition, Operation, Procedure};
use crate::types::TopicMessage;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Outcome {
    Done,
    /// A step has failed, a condition does not hold although the robot answers, or a newer request replaces the
    /// procedure. Earlier steps were undone as far as possible.
    Failed(String),
    /// The robot has given no valid answer in time. Earlier steps were undone as far as possible.
    Silent(String),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Seen {
    /// The observable conditions of this mode hold. A mode without observable conditions is assumed to be unchanged
    /// if it was the last one.
    Mode(String),
    /// The conditions of no mode hold.
    Nothing,
    /// A node does not answer or is in a transition, or steps are being executed. A later observation may show the mode.
    Unsettled,
    /// The nodes answer, but their conditions do not distinguish the modes.
    Ambiguous,
}

type Report = dyn Fn(&Value) + Send + Sync;

struct FunctionProcedures {
    modes: BTreeMap<String, Procedure>,
    /// Held while a procedure runs, so that procedures of a function never overlap.
    running: smol::lock::Mutex<()>,
    /// Mode that was put into effect or seen last; `None` before the first one. Empty once an observation finds the
    /// conditions of no mode, or if failed steps were not undone.
    present: Mutex<Option<String>>,
    /// Modes that could not be put into effect because a node was silent.
    silent: Mutex<BTreeSet<String>>,
}

pub(crate) struct Procedures {
    node: Arc<Node>,
    functions: BTreeMap<String, FunctionProcedures>,
    clients: Clients,
    report: Box<Report>,
}

#[derive(Debug)]
enum Undo {
    Operation(Operation),
    /// No operation is known that undoes this one.
    Impossible(String),
}

impl Procedures {
    /// Creates the procedures. `functions` contains, for each function with procedures, the procedure of each of its
    /// modes. `report` receives the events about their steps.
    pub(crate) fn new(
        node: &Arc<Node>,
        functions: BTreeMap<String, BTreeMap<String, Procedure>>,
        report: impl Fn(&Value) + Send + Sync + 'static,
    ) -> Result<Self, Message> {
        let clients = Clients::new(node, functions.values().flat_map(BTreeMap::values))?;
        let functions = functions.into_iter().map(|(function, modes)| {
            let procedures = FunctionProcedures {
                modes,
                running: smol::lock::Mutex::new(()),
                present: Mutex::default(),
                silent: Mutex::default(),
            };
            (function, procedures)
        });
        Ok(Self { node: Arc::clone(node), functions: functions.collect(), clients, report: Box::new(report) })
    }

    pub(crate) fn contains(&self, function: &str) -> bool {
        self.functions.contains_key(function)
    }

    /// Returns `true` if a function has procedures, but none of their steps and conditions can be observed later.
    /// Only states, parameters and messages with known content can be observed.
    pub(crate) fn is_unobservable(&self, function: &str) -> bool {
        self.functions.get(function).is_some_and(|procedures| procedures.conditions().next().is_none())
    }

    /// Returns `true` if a function was last found in none of its modes, or failed steps were not undone, and no mode was
    /// put into effect or seen since.
    pub(crate) fn is_in_no_mode(&self, function: &str) -> bool {
        let present = self.functions.get(function).and_then(FunctionProcedures::present);
        present.is_some_and(|mode| mode.is_empty())
    }

    pub(crate) fn nodes(&self, function: &str) -> BTreeSet<String> {
        let conditions = self.functions.get(function).into_iter().flat_map(FunctionProcedures::conditions);
        let node = |condition| match condition {
            Condition::State { node, .. } | Condition::Parameters { node, .. } => Some(node),
            Condition::Topic(_) | Condition::Published(_) | Condition::Message { .. } => None,
        };
        conditions.filter_map(node).collect()
    }

    /// Returns the servers of the nodes that show the mode of a function, and an id for each condition about messages
    /// that holds. The result changes if a node is restarted or lost, or if a message changes whether such a
    /// condition holds.
    pub(crate) fn servers(&self, function: &str) -> BTreeSet<[u8; 16]> {
        let conditions = self.functions.get(function).into_iter().flat_map(FunctionProcedures::conditions);
        conditions.flat_map(|condition| self.clients.servers(&condition)).collect()
    }

    /// Waits for the services of all modes of a function, for each at most for `within`. Returns the missing
    /// ones of the mode that lacks the fewest. Services that are used after a command may be started by it and
    /// are not waited for.
    pub(crate) async fn missing(&self, function: &str, within: Duration) -> Vec<String> {
        let Some(procedures) = self.functions.get(function) else { return Vec::new() };
        let of_mode = |procedure: &'_ Procedure| {
            let operations: Vec<Operation> = procedure
                .steps
                .iter()
                .map(|step| step.operation.clone())
                .take_while(|operation| !matches!(operation, Operation::Command(_)))
                .collect();
            async move {
                let missing = operations.iter().map(|operation| self.clients.missing(operation, within));
                futures::future::join_all(missing).await.into_iter().flatten().collect::<Vec<_>>()
            }
        };
        let missing = futures::future::join_all(procedures.modes.values().map(of_mode)).await;
        missing.into_iter().min_by_key(Vec::len).unwrap_or_default()
    }

    /// Determines the mode of a function from the conditions of its modes.
    ///
    /// The result is [`Seen::Unsettled`] while a procedure runs or a node does not answer. If the last mode (put into
    /// effect or seen) has no observable conditions, it is returned unchecked. Otherwise, the mode is returned whose
    /// conditions hold. Of several such modes, those with the most conditions are considered. If more than one remains,
    /// the last mode is returned if it is one of them; otherwise, the result is [`Seen::Ambiguous`]. If the conditions
    /// of no mode hold, the result is [`Seen::Nothing`], or [`Seen::Ambiguous`] if the last mode is unknown and some
    /// mode has no observable conditions.
    pub(crate) async fn observe(&self, function: &str) -> Seen {
        let Some(procedures) = self.functions.get(function) else { return Seen::Ambiguous };
        // In the middle of a procedure, an observation would be meaningless.
        let Some(_idle) = procedures.running.try_lock() else { return Seen::Unsettled };
        let present = procedures.present();
        let is_unobservable = |mode: &String| {
            procedures.modes.get(mode).is_some_and(|procedure| procedure.lasting().is_empty())
        };
        if let Some(mode) = present.clone().filter(is_unobservable) {
            return Seen::Mode(mode);
        }
        let mut matching: Vec<(usize, &String)> = Vec::new();
        for (mode, procedure) in &procedures.modes {
            let lasting = procedure.lasting();
            let results = lasting.iter().map(|condition| self.observed(condition));
            let results = futures::future::join_all(results).await;
            if results.contains(&None) {
                return Seen::Unsettled;
            }
            if !lasting.is_empty() && results.iter().all(|result| *result == Some(true)) {
                matching.push((lasting.len(), mode));
            }
        }
        let greatest_count = matching.iter().map(|(count, _)| *count).max().unwrap_or_default();
        matching.retain(|(count, _)| *count == greatest_count);
        let observed_mode = match matching.as_slice() {
            [] if procedures.modes.keys().any(is_unobservable) && present.is_none() => {
                return Seen::Ambiguous;
            }
            [] => {
                procedures.set_present("");
                return Seen::Nothing;
            }
            [(_, mode)] => (*mode).clone(),
            several => match present.filter(|present| several.iter().any(|(_, mode)| *mode == present)) {
                Some(present) => present,
                None => return Seen::Ambiguous,
            },
        };
        procedures.set_present(&observed_mode);
        Seen::Mode(observed_mode)
    }

    /// Returns `Some(true)` if a condition holds, and `None` if its node is silent. A node that does not
    /// exist meets no condition.
    async fn observed(&self, condition: &Condition) -> Option<bool> {
        let of_node = matches!(condition, Condition::State { .. } | Condition::Parameters { .. });
        if of_node && self.clients.servers(condition).is_empty() {
            return Some(false);
        }
        self.clients.holds(condition).await.ok()
    }

    /// Returns `true` if the services of all modes that could not be put into effect because of a silent node answer
    /// again, except services that are used after a command. These modes are then no longer recorded as silent.
    pub(crate) async fn answers(&self, function: &str) -> bool {
        let Some(procedures) = self.functions.get(function) else { return false };
        let silent = procedures.silent.lock().unwrap_or_else(PoisonError::into_inner).clone();
        for mode in &silent {
            let steps = procedures.modes.get(mode).into_iter().flat_map(|procedure| &procedure.steps);
            for step in steps.take_while(|step| !matches!(step.operation, Operation::Command(_))) {
                if !self.clients.answers(&step.operation).await {
                    return false;
                }
            }
        }
        procedures.silent.lock().unwrap_or_else(PoisonError::into_inner).clear();
        true
    }

    /// Puts a mode of a function into effect, once no other procedure runs for the function. The
    /// caller must first set the `is_replaced` of a running procedure, which is then normally
    /// undone.
    pub(crate) async fn apply(
        &self,
        function: &str,
        mode: &str,
        timeout: Duration,
        is_replaced: &AtomicBool,
    ) -> Outcome {
        let Some((procedures, procedure)) =
            self.functions.get(function).and_then(|own| Some((own, own.modes.get(mode)?)))
        else {
            return Outcome::Failed(format!("{function} has no steps for {mode}"));
        };
        let _running = procedures.running.lock().await;
        let run = Run { procedures: self, function, mode, is_replaced };
        let timeout = procedure.timeout.unwrap_or(timeout);
        let mut undos = Vec::new();
        let Err(failure) = run.perform(procedure, Instant::now() + timeout, &mut undos).await else {
            procedures.set_present(mode);
            procedures.silent.lock().unwrap_or_else(PoisonError::into_inner).remove(mode);
            return Outcome::Done;
        };
        // A silent node must not use up the time for restoring the other nodes.
        let first =
            if matches!(failure, Failure::Silent(_)) { timeout.min(OBSERVATION_TIMEOUT) } else { timeout };
        if !run.roll_back(undos, first, timeout).await {
            procedures.set_present("");
        }
        let because = failure.because().to_owned();
        match failure {
            Failure::Silent(_) => {
                procedures.silent.lock().unwrap_or_else(PoisonError::into_inner).insert(mode.to_owned());
                Outcome::Silent(because)
            }
            Failure::Refused(_) | Failure::Replaced => Outcome::Failed(because),
        }
    }
}

impl FunctionProcedures {
    fn conditions(&self) -> impl Iterator<Item = Condition> {
        self.modes.values().flat_map(Procedure::lasting)
    }

    fn present(&self) -> Option<String> {
        self.present.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn set_present(&self, mode: &str) {
        *self.present.lock().unwrap_or_else(PoisonError::into_inner) = Some(mode.to_owned());
    }
}

struct Run<'r> {
    procedures: &'r Procedures,
    function: &'r str,
    mode: &'r str,
    is_replaced: &'r AtomicBool,
}

impl Run<'_> {
    /// Executes all steps, and waits for all conditions. Stops at the first failure, or if the procedure is
    /// replaced. Collects the operations that undo the steps.
    async fn perform(
        &self,
        procedure: &Procedure,
        deadline: Instant,
        undos: &mut Vec<Undo>,
    ) -> Result<(), Failure> {
        let clients = &self.procedures.clients;
        for step in &procedure.steps {
            if self.is_replaced.load(Ordering::Relaxed) {
                return Err(Failure::Replaced);
            }
            let outcome = self.step(&step.operation, step.undo.as_ref(), deadline, undos).await;
            self.report(
                &step.operation,
                if outcome.is_ok() { "done" } else { "failed" },
                outcome.as_ref().err(),
            );
            outcome?;
        }
        let end = Instant::now();
        for condition in procedure.lasting().iter().chain(&procedure.conditions) {
            if self.is_replaced.load(Ordering::Relaxed) {
                return Err(Failure::Replaced);
            }
            clients.until(condition, end, deadline).await?;
        }
        Ok(())
    }

    async fn step(
        &self,
        operation: &Operation,
        undo: Option<&Operation>,
        deadline: Instant,
        undos: &mut Vec<Undo>,
    ) -> Result<(), Failure> {
        let clients = &self.procedures.clients;
        let within = deadline.saturating_duration_since(Instant::now());
        let count = undos.len();
        let outcome = match operation {
            Operation::State { node, state } => {
                let target = *state;
                // A refused transition may have changed the state, so its undo is kept.
                return clients
                    .bring(node, target, deadline, |before| {
                        if before != target {
                            let undo = Operation::State { node: node.clone(), state: before };
                            undos.push(Undo::Operation(undo));
                        }
                    })
                    .await;
            }
            Operation::Parameters { node, values } => {
                let note = |before: Vec<(String, ros2_client::ParameterValue)>| {
                    let (set, unset): (Vec<_>, Vec<_>) = before
                        .into_iter()
                        .partition(|(_, value)| *value != ros2_client::ParameterValue::NotSet);
                    let unset = unset.into_iter().map(|(name, _)| {
                        Undo::Impossible(format!("the parameter {name} of {node} had no value before"))
                    });
                    undos.extend(unset);
                    if !set.is_empty() {
                        undos
                            .push(Undo::Operation(Operation::Parameters { node: node.clone(), values: set }));
                    }
                };
                clients.set(node, values, deadline, note).await
            }
            Operation::Service { service, call } => {
                // Without a server nothing is sent, so that nothing must be undone.
                clients.ready(service, call, within).await?;
                undos.push(undo_of(operation, undo));
                let within = deadline.saturating_duration_since(Instant::now());
                clients.call(service, call, within).await
            }
            Operation::Publish { message, subscribers } => {
                let note = |before: Option<Vec<u8>>| {
                    undos.push(match (undo, before) {
                        (None, Some(before)) => Undo::Operation(Operation::Publish {
                            message: TopicMessage { message: before, ..message.clone() },
                            subscribers: 0,
                        }),
                        _ => undo_of(operation, undo),
                    });
                };
                clients.publish(message, *subscribers, within, note).await
            }
            Operation::Command(words) => {
                execute(words, deadline, || undos.push(undo_of(operation, undo))).await
            }
        };
        // A refused service call counts as without effect, so its undo is dropped. Without an answer, the effect is unknown,
        // and the undo is kept, as for a program, which can fail after a part of its effect.
        if matches!((operation, &outcome), (Operation::Service { .. }, Err(Failure::Refused(_)))) {
            undos.truncate(count);
        }
        outcome
    }

    /// Undoes steps in reverse order, with the timeout `first` for the first undo, and `other` for each further one.
    /// A step that cannot be undone does not stop the others. Returns `true` if all steps were undone.
    async fn roll_back(&self, undos: Vec<Undo>, first: Duration, other: Duration) -> bool {
        let mut is_undone = true;
        for (index, undo) in undos.into_iter().rev().enumerate() {
            let deadline = Instant::now() + if index == 0 { first } else { other };
            match undo {
                Undo::Impossible(text) => {
                    self.warn(&format!("{text}: it is not undone"));
                    is_undone = false;
                }
                Undo::Operation(operation) => {
                    let outcome = self.step(&operation, None, deadline, &mut Vec::new()).await;
                    let word = if outcome.is_ok() { "undone" } else { "not_undone" };
                    self.report(&operation, word, outcome.as_ref().err());
                    if let Err(failure) = outcome {
                        self.warn(&format!("{operation} could not be restored: {}", failure.because()));
                        is_undone = false;
                    }
                }
            }
        }
        is_undone
    }

    fn warn(&self, text: &str) {
        let text = format!("{} {}: {text}", self.function, self.mode);
        self.procedures.node.log(Severity::Warn, &text);
    }

    fn report(&self, operation: &Operation, outcome: &str, failure: Option<&Failure>) {
        let mut event = json!({
            "answer": "step", "function": self.function, "mode": self.mode, "step": operation.to_string(),
            "outcome": outcome,
        });
        if let Some(failure) = failure {
            event["because"] = failure.because().into();
        }
        (self.procedures.report)(&event);
    }
}

fn undo_of(operation: &Operation, undo: Option<&Operation>) -> Undo {
    match undo {
        Some(undo) => Undo::Operation(undo.clone()),
        None => Undo::Impossible(format!("{operation} has no `undo`")),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    use super::{Outcome, Procedures, Seen};
    use crate::node::{Network, Node, Opening, Rmw, RosArguments};
    use crate::procedure::Procedure;

    const FUNCTION: &str = "f_grip";

    /// Steps of the designs of a gripper, and the mode in which their failure leaves a gripper with a vacuum.
    const DESIGNS: [(&str, &str, Option<&str>); 8] = [
        ("fd_vacuum", r#"[{ command = ["true"] }]"#, None),
        ("fd_magnet", r#"[{ command = ["true"] }, { command = ["false"] }]"#, Some("")),
        (
            "fd_clamp",
            r#"[{ command = ["true"], undo = { command = ["true"] } }, { command = ["/no/such/program"] }]"#,
            Some("fd_vacuum"),
        ),
        (
            "fd_hook",
            r#"[{ command = ["true"], undo = { command = ["false"] } }, { command = ["false"] }]"#,
            Some(""),
        ),
        // A program may fail after a part of its effect, but not if it was not started.
        ("fd_glue", r#"[{ command = ["false"] }]"#, Some("")),
        ("fd_tape", r#"[{ command = ["/no/such/program"] }]"#, Some("fd_vacuum")),
        (
            "fd_rope",
            r#"[{ command = ["true"], undo = { command = ["true"] } }, { command = ["sleep", "9"] }]"#,
            Some(""),
        ),
        // The service has no server, so that nothing is sent.
        ("fd_claw", r#"[{ service = "/claw", type = "std_srvs/srv/Trigger" }]"#, Some("fd_vacuum")),
    ];

    fn procedures() -> Procedures {
        let words = ["p".to_owned(), "--ros-args".to_owned()];
        let (_, arguments) = RosArguments::split(words).expect("arguments");
        let network = Network { domain: 11, loopback: true };
        let opening = Opening { name: "gripper".to_owned(), arguments, network, rmw: Rmw::Auto };
        let node = Node::open(opening).expect("a node");
        let modes = DESIGNS.map(|(design, steps, _)| {
            let procedure: Procedure =
                toml::from_str(&format!("steps = {steps}\ntimeout = 0.5")).expect("steps");
            (design.to_owned(), procedure)
        });
        let functions = [(FUNCTION.to_owned(), modes.into())];
        Procedures::new(&node, functions.into(), |_| {}).expect("clients")
    }

    #[test]
    fn a_function_has_no_mode_after_steps_that_were_not_undone() {
        let procedures = procedures();
        let apply = |design: &str| {
            let is_replaced = AtomicBool::new(false);
            smol::block_on(procedures.apply(FUNCTION, design, Duration::from_secs(5), &is_replaced))
        };
        let observe = || smol::block_on(procedures.observe(FUNCTION));
        assert_eq!(observe(), Seen::Ambiguous);
        for (design, _, mode) in DESIGNS {
            assert_eq!(apply("fd_vacuum"), Outcome::Done);
            assert_eq!(observe(), Seen::Mode("fd_vacuum".to_owned()));
            let Some(mode) = mode else { continue };
            assert!(matches!(apply(design), Outcome::Failed(_) | Outcome::Silent(_)), "{design}");
            let expected = if mode.is_empty() { Seen::Nothing } else { Seen::Mode(mode.to_owned()) };
            assert_eq!(observe(), expected, "{design}");
            assert_eq!(procedures.is_in_no_mode(FUNCTION), mode.is_empty(), "{design}");
        }
    }
}
