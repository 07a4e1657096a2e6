//! Who carries out the actions of a plan, on a robot.
//!
//! A manager of plans hands each action to whoever is configured for its name, hears how it goes, and may ask for its end:
//!
//! ```toml
//! # The file of `--settings`: a table for each action that somebody else carries out.
//! [actions.move]                    # (move r1 kitchen hall) is a goal for Nav2 …
//! by = "navigate_to_pose"
//! server = "/navigate_to_pose"      # … here (the default)
//! pose = 3                          # … with the pose of its third argument (the last, if not given)
//! types = "jazzy"                   # humble, iron, jazzy or rolling: they differ
//! behavior_tree = ""                # as Nav2 takes it
//!
//! [actions.inspect]                 # a performer of PlanSys2 does it
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
//! [poses]                           # where things are
//! frame = "map"
//! hall = { x = 1.0, y = -2.5, yaw = 1.57 }
//!
//! [offers.reconfigure]              # with `--as planner`: what PlanSys2's executor asks for is done here
//! by = "change_mode"
//! ```
//!
//! An action without a table is done as soon as it is begun: its effects are not in the world, but in the plan.

use std::collections::BTreeMap;

use smol::channel;

/// An action that is to be carried out.
#[derive(Debug, Clone, PartialEq)]
pub struct Call {
    /// As the plan names it.
    pub action: String,
    /// Its arguments, in the order of the domain.
    pub arguments: Vec<String>,
    /// The design of each function that it needs.
    pub configuration: BTreeMap<String, String>,
    /// As planned, in seconds; 0 where the domain has no durations.
    pub duration: f64,
}

impl Call {
    /// As in PDDL and in PlanSys2: `(move r1 kitchen hall)`.
    pub fn text(&self) -> String {
        let words: Vec<&str> =
            std::iter::once(&self.action).chain(&self.arguments).map(String::as_str).collect();
        format!("({})", words.join(" "))
    }
}

/// What is heard of an action that is carried out.
#[derive(Debug, Clone, PartialEq)]
pub enum Progress {
    /// How it goes.
    Feedback {
        /// From 0 to 1, where that is known.
        completion: Option<f32>,
        /// For people.
        text: String,
    },
    /// How it has ended; nothing follows.
    Ended(End),
}

/// How an action has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// As it should.
    Succeeded,
    /// Because that was asked for.
    Canceled,
    /// Otherwise: why.
    Failed(String),
}

/// An action that is carried out. It goes on when this is dropped.
#[derive(Debug, Clone)]
pub struct Running {
    events: channel::Receiver<Progress>,
    cancel: channel::Sender<()>,
}

impl Running {
    /// The two ends: for the manager, and for whoever carries out the action.
    pub fn pair() -> (Self, Performance) {
        let (progress, events) = channel::unbounded();
        let (cancel, canceled) = channel::bounded(1);
        (Self { events, cancel }, Performance { progress, canceled })
    }

    /// What is heard next; the last is [`Progress::Ended`].
    pub async fn next(&self) -> Progress {
        let lost = || Progress::Ended(End::Failed("whoever carried it out is gone".to_owned()));
        self.events.recv().await.unwrap_or_else(|_| lost())
    }

    /// Asks for an early end, which is heard of as any other.
    pub fn cancel(&self) {
        // Asked twice is asked.
        let _ = self.cancel.try_send(());
    }
}

/// The performer's end of a [`Running`] action.
#[derive(Debug)]
pub struct Performance {
    progress: channel::Sender<Progress>,
    canceled: channel::Receiver<()>,
}

impl Performance {
    /// Says how it goes.
    pub fn feedback(&self, completion: Option<f32>, text: impl Into<String>) {
        self.tell(Progress::Feedback { completion, text: text.into() });
    }

    /// Hands on what is heard.
    pub(crate) fn tell(&self, progress: Progress) {
        // Nobody may listen.
        let _ = self.progress.try_send(progress);
    }

    /// Says how it has ended.
    pub fn end(self, end: End) {
        self.tell(Progress::Ended(end));
    }

    /// Returns when an early end is asked for, and otherwise never.
    pub async fn canceled(&self) {
        if self.canceled.recv().await.is_err() {
            futures::future::pending::<()>().await;
        }
    }
}

/// Somebody who carries out actions.
pub trait Perform: Send + Sync {
    /// Begins an action. Whatever goes wrong is heard as its end.
    fn start(&self, call: Call) -> Running;
}

#[cfg(test)]
mod tests {
    use futures::FutureExt as _;

    use super::*;

    #[test]
    fn who_drops_an_action_has_failed() {
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
    fn an_early_end_is_heard_once_and_not_without_being_asked_for() {
        let (running, performance) = Running::pair();
        running.cancel();
        running.cancel();
        smol::block_on(performance.canceled());
        drop(running);
        assert!(performance.canceled().now_or_never().is_none());
    }
}
