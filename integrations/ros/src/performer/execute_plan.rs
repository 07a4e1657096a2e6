//! Client of PlanSys2's executor, which executes a whole plan: its action `execute_plan`, with the
//! message types of each version.

use std::sync::Arc;

use clap::ValueEnum;

use crate::interfaces::plansys2_1::plansys2_msgs::action as older;
use crate::interfaces::plansys2_msgs::action as newer;
use crate::interfaces::plansys2_msgs::msg::{ActionExecutionInfo, Plan};
use crate::node::{ActionCaller, Node};
use crate::perform::{Progress, Running};
use crate::performer::action::{pursue_on, send};
use crate::performer::{feedback, part};

/// Versions of PlanSys2 with different executors.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum PlanVersion {
    /// The executor requests the plan from PlanSys2's planner, and the goal is empty.
    Older,
    /// The goal contains the plan.
    #[default]
    Newer,
}

/// Client of PlanSys2's executor.
#[derive(Debug)]
pub struct ExecutePlans {
    caller: Caller,
}

#[derive(Debug)]
enum Caller {
    Older(Arc<ActionCaller<older::ExecutePlan>>),
    Newer(Arc<ActionCaller<newer::ExecutePlan>>),
}

impl ExecutePlans {
    /// Creates a client of the action server `server`, normally `/execute_plan`.
    pub fn new(node: &Arc<Node>, server: &str, version: PlanVersion) -> Self {
        let caller = match version {
            PlanVersion::Older => Caller::Older(Arc::new(node.action_caller(server))),
            PlanVersion::Newer => Caller::Newer(Arc::new(node.action_caller(server))),
        };
        Self { caller }
    }

    /// Starts the execution of a plan. An executor of an older version requests the plan itself, so `plan` is then
    /// ignored. The progress is the completed share of the plan's actions.
    pub fn start(&self, plan: Plan) -> Running {
        let (running, performance) = Running::pair();
        match &self.caller {
            Caller::Older(caller) => {
                let caller = Arc::clone(caller);
                smol::spawn(async move {
                    let end = match send(&caller, older::ExecutePlanGoal::default(), &performance).await {
                        Ok(pursued) => {
                            pursue_on(&pursued, &performance, progress_older, |result| {
                                let because = || format!("PlanSys2 has failed: {}", result.error_info);
                                (!result.success).then(because)
                            })
                            .await
                        }
                        Err(end) => end,
                    };
                    performance.end(end);
                })
                .detach();
            }
            Caller::Newer(caller) => {
                let caller = Arc::clone(caller);
                smol::spawn(async move {
                    let end = match send(&caller, newer::ExecutePlanGoal { plan }, &performance).await {
                        Ok(pursued) => {
                            pursue_on(
                                &pursued,
                                &performance,
                                |message| progress(&message.action_execution_status),
                                |result| {
                                    let because = || failed(&result.action_execution_status);
                                    (!result.success).then(because)
                                },
                            )
                            .await
                        }
                        Err(end) => end,
                    };
                    performance.end(end);
                })
                .detach();
            }
        }
        running
    }
}

fn progress_older(message: &older::ExecutePlanFeedback) -> Progress {
    let done = message.seq_action as f32 + message.progress_current_action;
    feedback(part(done, message.total_actions as f32), message.current_action.clone())
}

/// Progress of a plan: a completed action counts as 1, a running action as its completed share.
fn progress(actions: &[ActionExecutionInfo]) -> Progress {
    let done = |action: &ActionExecutionInfo| match action.status {
        ActionExecutionInfo::SUCCEEDED => 1.0,
        ActionExecutionInfo::EXECUTING => action.completion.clamp(0.0, 1.0),
        _ => 0.0,
    };
    let executing = actions.iter().filter(|action| action.status == ActionExecutionInfo::EXECUTING);
    let texts: Vec<&str> = executing.map(|action| action.action_full_name.as_str()).collect();
    feedback(part(actions.iter().map(done).sum(), actions.len() as f32), texts.join(", "))
}

fn failed(actions: &[ActionExecutionInfo]) -> String {
    let failed = actions.iter().filter(|action| action.status == ActionExecutionInfo::FAILED);
    let texts: Vec<String> =
        failed.map(|action| format!("{}: {}", action.action_full_name, action.message_status)).collect();
    if texts.is_empty() { "PlanSys2 has failed".to_owned() } else { texts.join("; ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_the_mean_completion_and_the_current_action() {
        let info = |status, completion, name: &str| ActionExecutionInfo {
            status,
            completion,
            action_full_name: name.to_owned(),
            message_status: "stuck".to_owned(),
            ..ActionExecutionInfo::default()
        };
        let actions = [
            info(ActionExecutionInfo::SUCCEEDED, 1.0, "(a)"),
            info(ActionExecutionInfo::EXECUTING, 0.5, "(b)"),
            info(ActionExecutionInfo::FAILED, 0.5, "(c)"),
            info(ActionExecutionInfo::NOT_EXECUTED, 0.0, "(d)"),
        ];
        assert_eq!(progress(&actions), feedback(Some(0.375), "(b)"));
        assert_eq!(progress(&[]), feedback(None, ""));
        assert_eq!((failed(&actions), failed(&[])), ("(c): stuck".into(), "PlanSys2 has failed".into()));
    }
}
