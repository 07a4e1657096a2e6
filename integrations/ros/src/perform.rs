//! Interface of performers, which execute the actions of a plan on a robot.
//!
//! A manager of plans passes each action to the performer that is configured for its name, receives
//! its progress, and may cancel it:
//!
//! ```toml
//! # The file of `--settings`: a table per action with a performer.
//! [actions.move]                    # (move r1 kitchen hall) is a goal for Nav2 …
//! by = "navigate_to_pose"
//! server = "/navigate_to_pose"      # … here (the default)
//! pose = 3                          # … with the pose of its third argument (the last, if not given)
//! types = "jazzy"                   # humble, iron, jazzy or rolling: they differ
//! behavior_tree = ""                # as Nav2 takes it
//!
//! [actions.inspect]                 # executed by a performer of PlanSys2
//! by = "actions_hub"
//!
//! [actions.search_pipeline]         # done when a Bool on a topic is true
//! by = "topic"
//! topic = "/pipeline/detected"
//!
//! [actions.reconfigure]             # (reconfigure f_search fd_high): /f_search/change_mode of system_modes
//! by = "change_mode"
//! function = 1                      # its first argument (the last but one, if not given)
//! design = 2                        # its second argument (the last, if not given)
//!
//! [actions.recharge]                # an action of SUAVE: also spiral_search, follow_pipeline, recover_thrusters
//! by = "recharge_battery"
//! server = "/recharge_battery"
//!
//! [actions.dock]                    # an action server of any type: (dock r1 station_1)
//! by = "action"
//! server = "/dock_robot"
//! type = "nav2_msgs/action/DockRobot"
//! goal = { dock_id = "{2}" }        # with the name of its second argument
//! expect = { success = true }
//!
//! [actions.load]                    # a service of any type
//! by = "service"
//! service = "/map_server/load_map"
//! type = "nav2_msgs/srv/LoadMap"
//! request = { map_url = "/maps/{1}.yaml" }
//! expect = { result = "RESULT_SUCCESS" }
//!
//! [poses]                           # poses of objects
//! frame = "map"
//! hall = { x = 1.0, y = -2.5, yaw = 1.57 }
//!
//! [offers.reconfigure]              # with `--as planner`: actions performed for PlanSys2's executor
//! by = "change_mode"
//! ```
//!
//! An action without a table ends immediately with success: its effects exist only in the plan.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

use smol::channel;

/// An action of a plan, to be executed by a performer.
#[derive(Debug, Clone, PartialEq)]
pub struct Call {
    /// Name of the action in the plan.
    pub action: String,
    /// Arguments in the order of the parameters in the domain.
    pub arguments: Vec<String>,
    /// Design to be used for each function that the action requires.
    pub configuration: BTreeMap<String, String>,
    /// Planned duration in seconds; 0 if the domain has no durations, or for an action of
    /// PlanSys2's executor.
    pub duration: f64,
}

impl Call {
    /// Formats the action as in PDDL and PlanSys2, for example `(move r1 kitchen hall)`.
    pub fn text(&self) -> String {
        let words: Vec<&str> =
            std::iter::once(&self.action).chain(&self.arguments).map(String::as_str).collect();
        format!("({})", words.join(" "))
    }
}

/// A message of a performer about a running action.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress {
    /// Intermediate feedback.
    Feedback {
        /// Completed share of the action from 0 to 1, if it is known.
        completion: Option<f32>,
        /// Description for users.
        text: String,
    },
    /// The action has ended; no further message follows.
    Ended(End),
}

/// Outcome of an action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// The action was completed.
    Succeeded,
    /// The action was cancelled on request.
    Canceled,
    /// The action failed; contains the reason.
    Failed(String),
}

/// The manager's handle of a running action. Dropping the handle does not stop the action.
#[derive(Debug, Clone)]
pub struct Running {
    events: channel::Receiver<Progress>,
    cancel: channel::Sender<()>,
}

impl Running {
    /// Creates the two connected ends of an action: the handle for the manager, and the handle for
    /// the performer.
    pub fn pair() -> (Self, Performance) {
        let (progress, events) = channel::unbounded();
        let (cancel, canceled) = channel::bounded(1);
        (Self { events, cancel }, Performance { progress, canceled, is_canceled: AtomicBool::new(false) })
    }

    /// Waits for the next message. The last message is [`Progress::Ended`].
    pub async fn next(&self) -> Progress {
        let lost = || Progress::Ended(End::Failed("its performer is gone".to_owned()));
        self.events.recv().await.unwrap_or_else(|_| lost())
    }

    /// Requests cancellation. The performer reports the end of the action as usual.
    pub fn cancel(&self) {
        // A full channel means that cancellation was already requested.
        let _ = self.cancel.try_send(());
    }
}

/// The performer's handle of a [`Running`] action.
#[derive(Debug)]
pub struct Performance {
    progress: channel::Sender<Progress>,
    canceled: channel::Receiver<()>,
    is_canceled: AtomicBool,
}

impl Performance {
    /// Reports intermediate feedback to the manager.
    pub fn feedback(&self, completion: Option<f32>, text: impl Into<String>) {
        self.forward(Progress::Feedback { completion, text: text.into() });
    }

    pub(crate) fn forward(&self, progress: Progress) {
        // The receiver may have been dropped.
        let _ = self.progress.try_send(progress);
    }

    /// Reports the end of the action.
    pub fn end(self, end: End) {
        self.forward(Progress::Ended(end));
    }

    /// Waits for a request to cancel the action, possibly forever.
    pub async fn canceled(&self) {
        if self.canceled.recv().await.is_err() {
            futures::future::pending::<()>().await;
        }
        self.is_canceled.store(true, Ordering::Relaxed);
    }

    /// Returns `true` if [`canceled`](Self::canceled) has returned.
    pub(crate) fn is_canceled(&self) -> bool {
        self.is_canceled.load(Ordering::Relaxed)
    }
}

/// Performer that executes actions of a plan on a robot.
pub trait Perform: Send + Sync {
    /// Starts an action, and returns its handle. All errors are reported as the end of the action.
    fn start(&self, call: Call) -> Running;
}

#[cfg(test)]
mod tests {
    use futures::FutureExt as _;

    use super::*;

    #[test]
    fn dropping_a_performance_is_a_failure() {
        let (running, performance) = Running::pair();
        performance.feedback(Some(0.5), "half");
        drop(performance);
        smol::block_on(async {
            assert_eq!(
                running.next().await,
                Progress::Feedback { completion: Some(0.5), text: "half".into() }
            );
            assert!(matches!(running.next().await, Progress::Ended(End::Failed(_))));
        });
    }

    #[test]
    fn cancellation_is_received_once_and_only_on_request() {
        let (running, performance) = Running::pair();
        running.cancel();
        running.cancel();
        smol::block_on(performance.canceled());
        drop(running);
        assert!(performance.canceled().now_or_never().is_none());
    }
}
