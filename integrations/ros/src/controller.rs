//! Controller of a PlanSys2 mission. PlanSys2's experts provide domain, problem and goal, the knowledge
//! base restricts the designs, and PlanSys2's executor carries out the plan.
//!
//! ```text
//! ASK --domain_expert/get_domain, problem_expert/get_problem--> PLAN --a plan--> EXECUTE (action execute_plan)
//! EXECUTE --success--> end     EXECUTE --failure--> ASK, or error after 5 consecutive failures
//! EXECUTE --a design of the plan becomes unavailable--> cancel --> ASK
//! PLAN --no plan--> report, then ASK when the available designs have changed, or after some seconds
//! PLAN --the goal holds--> end
//! ```
//!
//! Effects of completed actions persist between plans, because PlanSys2's problem expert records them.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use metaplan::message::{Errors, Message};
use metaplan::pddl::Source;
use metaplan::setup::Setup;
use smol::Timer;

use crate::interfaces::plansys2_msgs::msg::Plan;
use crate::interfaces::plansys2_msgs::srv::{GetDomain, GetDomainRequest, GetProblem, GetProblemRequest};
use crate::node::{Node, Severity};
use crate::perform::{End, Progress};
use crate::performer::{ExecutePlans, PlanVersion};
use crate::planner::{
    Chosen, DOMAIN, Found, Joint, NoPlan, PROBLEM, PlanPublisher, Request, on_a_thread, plan_message, solve,
};

const EXPERT_TIMEOUT: Duration = Duration::from_secs(10);

/// Maximum pause before the next planning attempt if no plan was found. It ends early if the available designs
/// change.
const RETRY_PAUSE: Duration = Duration::from_secs(5);

const FAILURE_PAUSE: Duration = Duration::from_secs(1);

const POLL_INTERVAL: Duration = Duration::from_millis(50);

const MAX_FAILURES: usize = 5;

/// Options of the controller.
#[derive(Debug, Clone)]
pub struct Options {
    /// Manifest of the mission whose knowledge base restricts the designs.
    pub mission: PathBuf,
    /// Version of the executor's message types.
    pub version: PlanVersion,
}

/// Runs until a plan for PlanSys2's goal is executed, until the goal already holds, or until `stop` is set.
///
/// # Errors
/// Fails if the mission or a parameter of the command line is wrong, if a topic cannot be created, or if
/// `MAX_FAILURES` consecutive executions have failed.
pub fn run(node: &Arc<Node>, options: &Options, stop: &AtomicBool) -> Result<(), Errors> {
    let setup = Setup::read(&options.mission)?;
    for warning in setup.mission.warnings() {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    let controller = Controller {
        node: Arc::clone(node),
        manner: Chosen::declare(node)?,
        joint: Joint::listen(node, setup.mission)?,
        executes: ExecutePlans::new(node, "execute_plan", options.version),
        plan_publisher: PlanPublisher::new(node)?,
    };
    smol::block_on(controller.control(stop)).map_err(Errors::from)
}

struct Controller {
    node: Arc<Node>,
    manner: Arc<Chosen>,
    joint: Arc<Joint>,
    executes: ExecutePlans,
    plan_publisher: PlanPublisher,
}

enum Outcome {
    Done,
    Failed(String),
    /// The plan was cancelled, because these designs are no longer available.
    Lost(Vec<String>),
    Stopped,
}

impl Controller {
    async fn control(&self, stop: &AtomicBool) -> Result<(), Message> {
        let mut failures = 0;
        while !stop.load(Ordering::Relaxed) {
            let stopped = async {
                while !stop.load(Ordering::Relaxed) {
                    Timer::after(POLL_INTERVAL).await;
                }
                None
            };
            let solution = match smol::future::or(stopped, async { Some(self.find().await) }).await {
                Some(Some(solution)) => solution,
                Some(None) => {
                    self.pause(RETRY_PAUSE, stop).await;
                    continue;
                }
                None => return Ok(()),
            };
            let plan = solution.plans.first().map(|lines| plan_message(lines)).unwrap_or_default();
            if plan.items.is_empty() {
                self.node.log(Severity::Info, "the goal holds");
                return Ok(());
            }
            match self.execute(plan, &solution, stop).await {
                Outcome::Done => {
                    self.node.log(Severity::Info, "the plan is executed");
                    return Ok(());
                }
                Outcome::Stopped => return Ok(()),
                Outcome::Lost(designs) => {
                    let text = format!("the plan is abandoned: {} lost; replanning", designs.join(", "));
                    self.node.log(Severity::Warn, &text);
                    failures = 0;
                }
                Outcome::Failed(because) => {
                    failures += 1;
                    self.node.log(Severity::Error, &because);
                    if failures == MAX_FAILURES {
                        let text = format!(
                            "{failures} consecutive plans have failed, the last one because: {because}"
                        );
                        return Err(Message::error("N150", text));
                    }
                    self.pause(FAILURE_PAUSE, stop).await;
                }
            }
        }
        Ok(())
    }

    /// Plans for PlanSys2's current problem. Without a plan, logs the reason and returns `None`.
    async fn find(&self) -> Option<Found> {
        match self.request_problem().await {
            Ok((domain, problem)) => self.plan(domain, problem).await.ok(),
            Err(because) => {
                self.node.log(Severity::Warn, &because);
                None
            }
        }
    }

    async fn request_problem(&self) -> Result<(String, String), String> {
        let domain = self.node.caller::<GetDomain>("domain_expert/get_domain");
        let domain = domain
            .call(GetDomainRequest::default(), EXPERT_TIMEOUT)
            .await
            .map_err(|error| error.to_string())?;
        let problem = self.node.caller::<GetProblem>("problem_expert/get_problem");
        let problem = problem
            .call(GetProblemRequest::default(), EXPERT_TIMEOUT)
            .await
            .map_err(|error| error.to_string())?;
        match (domain.success, problem.success) {
            (true, true) => Ok((domain.domain, problem.problem)),
            (false, _) => Err(format!("PlanSys2 has no domain: {}", domain.error_info)),
            (_, false) => Err(format!("PlanSys2 has no problem: {}", problem.error_info)),
        }
    }

    async fn plan(&self, domain: String, problem: String) -> Result<Found, NoPlan> {
        let (mission, manner) = (self.joint.mission(), self.manner.get());
        let (sender, receiver) = smol::channel::bounded(1);
        let work = move || {
            let (domain, problem) = (Source::new(DOMAIN, domain), Source::new(PROBLEM, problem));
            let _ = sender.try_send(solve(Request { domain, problem, joint: Some(&mission) }, &manner));
        };
        let outcome = match on_a_thread("plan", work) {
            Ok(()) => {
                let ended = |_| Err(NoPlan::Fault("the planner has ended".to_owned()));
                receiver.recv().await.unwrap_or_else(ended)
            }
            Err(error) => Err(NoPlan::None(format!("no thread can be started: {error}"))),
        };
        self.plan_publisher.publish_result(&outcome);
        outcome
    }

    /// Executes a plan, and cancels it if one of its designs becomes unavailable or `stop` is set.
    async fn execute(&self, plan: Plan, found: &Found, stop: &AtomicBool) -> Outcome {
        let used: BTreeSet<String> =
            found.configuration.iter().flatten().map(|(_, design)| design.to_lowercase()).collect();
        let running = self.executes.start(plan);
        let (mut lost, mut stopped, mut next_look) = (Vec::new(), false, Instant::now());
        loop {
            let progress = async { Some(running.next().await) };
            let look = async {
                Timer::after(POLL_INTERVAL).await;
                None
            };
            match smol::future::or(progress, look).await {
                Some(Progress::Feedback { completion, text }) => self.log_progress(completion, &text),
                // An end after our own cancellation is not a failure.
                Some(Progress::Ended(_)) if stopped => return Outcome::Stopped,
                Some(Progress::Ended(End::Succeeded)) => return Outcome::Done,
                Some(Progress::Ended(_)) if !lost.is_empty() => return Outcome::Lost(lost),
                Some(Progress::Ended(End::Failed(because))) => return Outcome::Failed(because),
                Some(Progress::Ended(End::Canceled)) => {
                    return Outcome::Failed("another client has cancelled the plan".to_owned());
                }
                None => {}
            }
            // Feedback may be more frequent than the looks.
            if stopped || Instant::now() < next_look {
                continue;
            }
            next_look = Instant::now() + POLL_INTERVAL;
            if stop.load(Ordering::Relaxed) {
                stopped = true;
                running.cancel();
            } else if lost.is_empty() {
                lost = used.intersection(&self.joint.unavailable()).cloned().collect();
                if !lost.is_empty() {
                    running.cancel();
                }
            }
        }
    }

    fn log_progress(&self, completion: Option<f32>, text: &str) {
        let done = completion.map(|part| format!("{:.0} %: ", part * 100.0)).unwrap_or_default();
        self.node.log(Severity::Debug, &(done + text));
    }

    /// Waits until the available designs change or `stop` is set, at most for `time`.
    async fn pause(&self, time: Duration, stop: &AtomicBool) {
        let (start, available) = (Instant::now(), self.joint.available());
        while start.elapsed() < time && !stop.load(Ordering::Relaxed) && self.joint.available() == available {
            Timer::after(POLL_INTERVAL).await;
        }
    }
}
