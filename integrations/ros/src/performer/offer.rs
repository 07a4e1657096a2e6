//! Performer for PlanSys2: executes the actions that PlanSys2's executor requests on `actions_hub`,
//! by the configured performers.
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use metaplan::message::{Errors, Message};
use smol::Timer;

use crate::interfaces::builtin_interfaces::msg::Time;
use crate::interfaces::plansys2_msgs::msg::{ActionExecution, ActionPerformerStatus};
use crate::node::{Node, Publisher, Severity, depth};
use crate::perform::{Call, End, Perform, Progress, Running};
use crate::performer::hub::{Hub, QUEUE_DEPTH};
use crate::performer::{Offered, Poses, performers};

const HEARTBEAT: Duration = Duration::from_secs(1);

/// Time without a confirmation after which the executor is assumed to have chosen another
/// performer.
const EXECUTOR_TIMEOUT: Duration = Duration::from_secs(5);

enum Stage {
    Idle,
    /// The performer has responded to a request for these arguments at this time.
    Committed(Vec<String>, Instant),
    Running(Vec<String>, Running),
}

struct Offer {
    hub: Arc<Hub>,
    action: String,
    specialized: Vec<String>,
    performer: Arc<dyn Perform>,
    stage: Mutex<Stage>,
    status: Publisher<ActionPerformerStatus>,
}

/// Performs an action for PlanSys2's executor during the lifetime of the node. `specialized` has
/// the required arguments by position; an empty or missing argument admits every value.
///
/// # Errors
/// Fails if a topic cannot be created.
pub fn offer(
    node: &Arc<Node>,
    action: &str,
    specialized: Vec<String>,
    performer: Arc<dyn Perform>,
) -> Result<(), Message> {
    let hub = Hub::new(node)?;
    let status = node.publisher("performers_status", depth(QUEUE_DEPTH))?;
    let messages = hub.listen();
    let stage = Mutex::new(Stage::Idle);
    let offer = Arc::new(Offer { hub, action: action.to_owned(), specialized, performer, stage, status });
    let beating = Arc::downgrade(&offer);
    smol::spawn(async move {
        while let Some(offer) = beating.upgrade() {
            offer.beat();
            drop(offer);
            Timer::after(HEARTBEAT).await;
        }
    })
    .detach();
    let weak = Arc::downgrade(node);
    smol::spawn(async move {
        while let Ok(message) = messages.recv().await {
            let Some(node) = weak.upgrade() else { return };
            offer.handle(&message, &node);
        }
    })
    .detach();
    Ok(())
}

/// Performs the actions that the settings offer for PlanSys2's executor.
///
/// # Errors
/// Fails with the errors about topics that cannot be created.
pub fn offers(node: &Arc<Node>, offered: &BTreeMap<String, Offered>, poses: &Poses) -> Result<(), Errors> {
    let by = offered.iter().map(|(action, offered)| (action.clone(), offered.by.clone())).collect();
    for (action, performer) in performers(node, &by, poses)? {
        let specialized = offered[&action].specialized_arguments.clone();
        offer(node, &action, specialized, Arc::from(performer))?;
    }
    Ok(())
}

impl Offer {
    fn stage(&self) -> MutexGuard<'_, Stage> {
        self.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn beat(&self) {
        let state = match *self.stage() {
            Stage::Running(..) => ActionPerformerStatus::RUNNING,
            Stage::Idle | Stage::Committed(..) => ActionPerformerStatus::READY,
        };
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        self.status.publish(ActionPerformerStatus {
            status_stamp: Time { sec: since.as_secs() as i32, nanosec: since.subsec_nanos() },
            state,
            action: self.action.clone(),
            specialized_arguments: self.specialized.clone(),
            node_name: self.hub.name().to_owned(),
        });
    }

    fn message(&self, r#type: i16, arguments: &[String]) -> ActionExecution {
        ActionExecution {
            r#type,
            node_id: self.hub.name().to_owned(),
            action: self.action.clone(),
            arguments: arguments.to_vec(),
            ..ActionExecution::default()
        }
    }

    fn is_ours(&self, message: &ActionExecution) -> bool {
        let fits = |(required, actual): (&String, &String)| required.is_empty() || required == actual;
        message.action == self.action && self.specialized.iter().zip(&message.arguments).all(fits)
    }

    fn handle(self: &Arc<Self>, message: &ActionExecution, node: &Node) {
        let mut stage = self.stage();
        // All offers of this process have the same node.
        let is_for_us = message.node_id == self.hub.name() && message.action == self.action;
        match (message.r#type, &*stage) {
            // A busy performer does not respond.
            (ActionExecution::REQUEST, Stage::Running(..)) => {}
            // A response to one request is binding for `EXECUTOR_TIMEOUT`, after which the
            // request counts as abandoned.
            (ActionExecution::REQUEST, Stage::Committed(other, since))
                if *other != message.arguments && since.elapsed() < EXECUTOR_TIMEOUT => {}
            (ActionExecution::REQUEST, _) if self.is_ours(message) => {
                *stage = Stage::Committed(message.arguments.clone(), Instant::now());
                self.hub.send(self.message(ActionExecution::RESPONSE, &message.arguments));
            }
            (ActionExecution::CONFIRM, Stage::Committed(arguments, _))
                if is_for_us && *arguments == message.arguments =>
            {
                let call = Call {
                    action: self.action.clone(),
                    arguments: message.arguments.clone(),
                    configuration: BTreeMap::new(),
                    duration: 0.0,
                };
                node.log(Severity::Info, &format!("{} is begun for PlanSys2", call.text()));
                let running = self.performer.start(call);
                *stage = Stage::Running(message.arguments.clone(), running.clone());
                let offer = Arc::clone(self);
                smol::spawn(async move { offer.report_progress(&running).await }).detach();
            }
            (ActionExecution::REJECT, Stage::Committed(arguments, _))
                if is_for_us && *arguments == message.arguments =>
            {
                *stage = Stage::Idle;
            }
            (ActionExecution::CANCEL, Stage::Running(arguments, running))
                if is_for_us && *arguments == message.arguments =>
            {
                node.log(Severity::Info, &format!("{} is cancelled by PlanSys2", self.action));
                running.cancel();
            }
            _ => {}
        }
    }

    /// Reports the progress and the end of the action to the executor, also after its request to cancel the action.
    /// Only the end [`End::Canceled`] is not reported.
    async fn report_progress(&self, running: &Running) {
        loop {
            let progress = running.next().await;
            let mut stage = self.stage();
            let Stage::Running(arguments, _) = &*stage else { return };
            let (completion, status, success) = match progress {
                Progress::Feedback { completion, text } => {
                    let (completion, status) = (completion.unwrap_or_default(), text);
                    let message = self.message(ActionExecution::FEEDBACK, arguments);
                    self.hub.send(ActionExecution { completion, status, ..message });
                    continue;
                }
                Progress::Ended(End::Succeeded) => (1.0, "done".to_owned(), true),
                Progress::Ended(End::Failed(because)) => (0.0, because, false),
                Progress::Ended(End::Canceled) => {
                    // An executor that cancels an action does not wait for a reply.
                    *stage = Stage::Idle;
                    return;
                }
            };
            let message = self.message(ActionExecution::FINISH, arguments);
            self.hub.send(ActionExecution { success, completion, status, ..message });
            *stage = Stage::Idle;
            return;
        }
    }
}
