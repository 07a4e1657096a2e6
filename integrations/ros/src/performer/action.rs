//! Performers that execute an action of a plan by a goal for a ROS action server.

use std::marker::PhantomData;
use std::sync::Arc;
use std::time::{Duration, Instant};

use futures::FutureExt as _;
use smol::Timer;

use crate::interfaces::suave_msgs::action::{
    FollowPipeline, FollowPipelineFeedback, FollowPipelineGoal, FollowPipelineResult, RechargeBattery,
    RechargeBatteryFeedback, RechargeBatteryGoal, RechargeBatteryResult, RecoverThrusters,
    RecoverThrustersFeedback, RecoverThrustersGoal, RecoverThrustersResult, SpiralSearch,
    SpiralSearchFeedback, SpiralSearchGoal, SpiralSearchResult,
};
use crate::interfaces::{Action, Service};
use crate::node::{Accepted, ActionCaller, Caller, GoalEnd, GoalError, Node, Pursued};
use crate::perform::{Call, End, Perform, Performance, Progress, Running};
use crate::performer::{feedback, part};

const SERVER_TIMEOUT: Duration = Duration::from_secs(10);

/// Pause before a rejected goal is sent again. A server that was just started rejects goals until it is active.
const REJECTED_PAUSE: Duration = Duration::from_secs(1);

/// Time to wait for the answer to a goal whose action is cancelled. A goal without an answer in time is cancelled, too,
/// but its end is not awaited.
const CANCELED_WAIT: Duration = Duration::from_secs(1);

/// Mapping of an action of a plan to goals, feedback and results of a ROS action.
pub(super) trait Meaning: Action + Sized + 'static {
    /// Settings that are needed to create a goal, in addition to the arguments of the action.
    type Settings: Clone + Send + Sync + 'static;

    fn goal(settings: &Self::Settings, call: &Call) -> Result<Self::Goal, String>;

    fn progress(call: &Call, feedback: &Self::Feedback) -> Progress;

    /// Returns the reason why a goal has not achieved its purpose according to its result, even if
    /// the server reports success. Returns `None` if the purpose is achieved.
    fn shortfall(result: &Self::Result) -> Option<String>;
}

pub(super) struct Client<A: Meaning> {
    caller: Arc<ActionCaller<A>>,
    settings: A::Settings,
    action: PhantomData<fn() -> A>,
}

impl<A: Meaning<Settings = ()>> Client<A> {
    pub(super) fn new(node: &Arc<Node>, server: &str) -> Self {
        Self::with(node, server, ())
    }
}

impl<A: Meaning> Client<A> {
    pub(super) fn with(node: &Arc<Node>, server: &str, settings: A::Settings) -> Self {
        Self { caller: Arc::new(node.action_caller::<A>(server)), settings, action: PhantomData }
    }
}

impl<A: Meaning> Perform for Client<A> {
    fn start(&self, call: Call) -> Running {
        let (running, performance) = Running::pair();
        match A::goal(&self.settings, &call) {
            Ok(goal) => {
                let caller = Arc::clone(&self.caller);
                smol::spawn(async move {
                    let end = follow(&caller, goal, &call, &performance).await;
                    performance.end(end);
                })
                .detach();
            }
            Err(because) => performance.end(End::Failed(format!("{}: {because}", call.text()))),
        }
        running
    }
}

async fn follow<A: Meaning>(
    caller: &ActionCaller<A>,
    goal: A::Goal,
    call: &Call,
    performance: &Performance,
) -> End {
    let pursued = match send(caller, goal, performance).await {
        Ok(pursued) => pursued,
        Err(end) => return end,
    };
    pursue_on(&pursued, performance, |message| A::progress(call, message), A::shortfall).await
}

/// Waits until a server is `ready` or the action is cancelled. Nothing is sent meanwhile.
async fn await_server<E: ToString>(
    ready: impl Future<Output = Result<(), E>>,
    performance: &Performance,
) -> Result<(), End> {
    let canceled = async {
        performance.canceled().await;
        Err(End::Canceled)
    };
    let ready = async { ready.await.map_err(|error| End::Failed(error.to_string())) };
    smol::future::or(canceled, ready).await
}

/// Sends a goal, and again while the server rejects it, for [`SERVER_TIMEOUT`] or until the action is cancelled.
async fn pursue<A: Action + 'static>(
    caller: &ActionCaller<A>,
    goal: &A::Goal,
    performance: &Performance,
) -> Result<Pursued<A>, GoalError> {
    let start = Instant::now();
    loop {
        let answer = caller.pursue(goal.clone(), SERVER_TIMEOUT).await;
        let is_rejected = matches!(answer, Err(GoalError::Rejected(_)));
        if !is_rejected || start.elapsed() + REJECTED_PAUSE > SERVER_TIMEOUT {
            return answer;
        }
        Timer::after(REJECTED_PAUSE).await;
        if performance.is_canceled() {
            return answer;
        }
    }
}

/// Sends a goal, and waits until the server accepts it. If the action is cancelled meanwhile, the goal is cancelled.
pub(super) async fn send<A: Action + 'static>(
    caller: &ActionCaller<A>,
    goal: A::Goal,
    performance: &Performance,
) -> Result<Pursued<A>, End> {
    await_server(caller.ready(SERVER_TIMEOUT), performance).await?;
    let mut pursuit = Box::pin(pursue(caller, &goal, performance));
    let canceled = async {
        performance.canceled().await;
        None
    };
    let answer = smol::future::or(async { Some(pursuit.as_mut().await) }, canceled).await;
    if let Some(answer) = answer {
        return answer.map_err(|error| End::Failed(error.to_string()));
    }
    // A goal that was sent already may be accepted, and the robot then needs its designs until the goal has ended.
    let late = async {
        Timer::after(CANCELED_WAIT).await;
        None
    };
    let pursued = smol::future::or(async { pursuit.await.ok() }, late).await.ok_or(End::Canceled)?;
    pursued.cancel();
    Ok(pursued)
}

/// Calls a service. The action can be cancelled while the service has no server.
pub(super) async fn call<S: Service>(
    caller: &Caller<S>,
    request: S::Request,
    performance: &Performance,
) -> Result<S::Response, End> {
    await_server(caller.ready(SERVER_TIMEOUT), performance).await?;
    caller.call(request, SERVER_TIMEOUT).await.map_err(|error| End::Failed(error.to_string()))
}

/// Forwards the progress of an accepted goal until the goal ends, and cancels the goal on request.
pub(super) async fn pursue_on<A: Action>(
    pursued: &Pursued<A>,
    performance: &Performance,
    progress: impl Fn(&A::Feedback) -> Progress,
    shortfall: impl Fn(&A::Result) -> Option<String>,
) -> End {
    loop {
        let mut event = Box::pin(pursued.events.recv()).fuse();
        let mut canceled = Box::pin(performance.canceled()).fuse();
        futures::select! {
            event = event => match event {
                Ok(Accepted::Feedback(message)) => performance.forward(progress(&message)),
                Ok(Accepted::Ended(GoalEnd::Succeeded, result)) => {
                    return shortfall(&result).map_or(End::Succeeded, End::Failed);
                }
                Ok(Accepted::Ended(GoalEnd::Canceled, _)) if performance.is_canceled() => return End::Canceled,
                Ok(Accepted::Ended(GoalEnd::Canceled, _)) => {
                    return End::Failed("another client or its server has cancelled the goal".to_owned());
                }
                Ok(Accepted::Ended(GoalEnd::Aborted, result)) => {
                    let because = shortfall(&result).unwrap_or_else(|| "its server has aborted the goal".to_owned());
                    return End::Failed(because);
                }
                Ok(Accepted::Lost(because)) => return End::Failed(because),
                Err(_) => return End::Failed("its server no longer responds".to_owned()),
            },
            () = canceled => pursued.cancel(),
        }
    }
}

impl Meaning for SpiralSearch {
    type Settings = ();

    fn goal((): &(), _: &Call) -> Result<SpiralSearchGoal, String> {
        Ok(SpiralSearchGoal::default())
    }

    fn progress(call: &Call, message: &SpiralSearchFeedback) -> Progress {
        let text = format!("{:.1} s searched", message.elapsed_time);
        feedback(part(message.elapsed_time, call.duration as f32), text)
    }

    fn shortfall(result: &SpiralSearchResult) -> Option<String> {
        let text = || format!("no pipeline was found in {:.1} s", result.time_spent);
        (!result.pipeline_found).then(text)
    }
}

impl Meaning for FollowPipeline {
    type Settings = ();

    /// Creates a goal without a timeout, because the planner decides when the inspection ends.
    fn goal((): &(), _: &Call) -> Result<FollowPipelineGoal, String> {
        Ok(FollowPipelineGoal { timeout: 0.0 })
    }

    fn progress(_: &Call, message: &FollowPipelineFeedback) -> Progress {
        feedback(None, format!("{:.2} m inspected", message.distance_inspected))
    }

    fn shortfall(result: &FollowPipelineResult) -> Option<String> {
        let because = if result.timed_out { "its time was over" } else { "the pipeline was not followed" };
        (!result.success).then(|| format!("{because} after {:.2} m", result.distance_inspected))
    }
}

impl Meaning for RecoverThrusters {
    type Settings = ();

    fn goal((): &(), _: &Call) -> Result<RecoverThrustersGoal, String> {
        Ok(RecoverThrustersGoal::default())
    }

    fn progress(_: &Call, _: &RecoverThrustersFeedback) -> Progress {
        feedback(None, "recovering")
    }

    fn shortfall(result: &RecoverThrustersResult) -> Option<String> {
        (!result.success).then(|| "the thrusters did not recover".to_owned())
    }
}

impl Meaning for RechargeBattery {
    type Settings = ();

    fn goal((): &(), _: &Call) -> Result<RechargeBatteryGoal, String> {
        Ok(RechargeBatteryGoal::default())
    }

    fn progress(_: &Call, _: &RechargeBatteryFeedback) -> Progress {
        feedback(None, "charging")
    }

    fn shortfall(result: &RechargeBatteryResult) -> Option<String> {
        (!result.success).then(|| "the battery was not charged".to_owned())
    }
}
