//! Replacement of PlanSys2's planner node. It has the services `planner/get_plan`,
//! `planner/get_plan_array` and `planner/validate_domain`, the parameters that PlanSys2 sets, and
//! the lifecycle by which PlanSys2's manager starts the node.
//!
//! Each request is planned on a separate thread, so that the node answers other requests in the
//! meantime. With a mission, its knowledge base restricts the designs and is updated from
//! `/diagnostics`.
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use metaplan::message::{Errors, Message};
use metaplan::mission::PlanLine;
use metaplan::pddl::Source;
use metaplan::setup::Setup;

use crate::interfaces::plansys2_msgs::msg::{Plan, PlanArray, PlanItem};
use crate::interfaces::plansys2_msgs::srv::{
    GetPlan, GetPlanArray, GetPlanArrayResponse, GetPlanResponse, ValidateDomain, ValidateDomainResponse,
};
use crate::manager::Settings;
use crate::node::{Lifecycle, Node, Phase, Severity};
use crate::performer;
use crate::planner::joint::Joint;
use crate::planner::manner::Chosen;
use crate::planner::solve::{DOMAIN, Found, Manner, NoPlan, PROBLEM, Request, check_domain, solve};
use crate::planner::told::PlanPublisher;

/// Stack size of planning threads in bytes, because syntax trees may be deeply nested.
const STACK_SIZE: usize = 64 << 20;

/// Upper limit on concurrent planning requests. Further requests are refused.
const MAX_REQUESTS: usize = 8;

struct Planner {
    node: Arc<Node>,
    busy: AtomicUsize,
    joint: Option<Arc<Joint>>,
    manner: Arc<Chosen>,
    plan_publisher: PlanPublisher,
}

/// Serves as PlanSys2's planner. The node must not have declared parameters before. Returns the
/// lifecycle of the node, in the state unconfigured.
///
/// # Errors
/// Fails if a parameter of the command line is wrong, or a topic cannot be created.
pub fn serve(node: &Arc<Node>, setup: Option<Setup>) -> Result<Arc<Lifecycle>, Errors> {
    let manner = Chosen::declare(node)?;
    let joint = setup.map(|setup| Joint::listen(node, setup.mission)).transpose()?;
    let planner = Arc::new(Planner {
        node: Arc::clone(node),
        busy: AtomicUsize::new(0),
        joint,
        manner,
        plan_publisher: PlanPublisher::new(node)?,
    });
    let to_errors = |message: Message| vec![message];
    let lifecycle = Lifecycle::serve(node, |_| true).map_err(to_errors)?;
    planner.answer(&lifecycle).map_err(to_errors)?;
    Ok(lifecycle)
}

/// Options of the planner.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Manifest of a mission whose knowledge base restricts the designs.
    pub mission: Option<PathBuf>,
    /// Settings of the robot, with the performers of actions that are offered to PlanSys2's
    /// executor; by default a file `ros.toml` in the directory of the mission.
    pub settings: Option<PathBuf>,
}

const STOP_POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Serves as PlanSys2's planner until `stop` is set, and performs the actions that the settings offer.
///
/// # Errors
/// Fails if the mission, the settings or a parameter of the command line is wrong, or a topic cannot be
/// created.
pub fn run(node: &Arc<Node>, options: &Options, stop: &AtomicBool) -> Result<(), Errors> {
    let setup = options.mission.as_deref().map(Setup::read).transpose()?;
    for warning in setup.iter().flat_map(|setup| setup.mission.warnings()) {
        node.log(Severity::Warn, warning.text().trim_end());
    }
    let settings = match (&options.settings, &options.mission) {
        (None, None) => Settings::default(),
        (file, mission) => {
            let location = mission.clone().unwrap_or_default();
            Settings::read(file.as_deref(), &location)?
        }
    };
    serve(node, setup)?;
    performer::offers(node, &settings.offers, &settings.poses)?;
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(STOP_POLL_INTERVAL);
    }
    Ok(())
}

impl Planner {
    fn answer(self: &Arc<Self>, lifecycle: &Arc<Lifecycle>) -> Result<(), Message> {
        let (planner, phase) = (Arc::clone(self), Arc::clone(lifecycle));
        self.node.serve::<GetPlan>("planner/get_plan", move |request, answer| {
            let is_ready = is_ready(&phase);
            planner.run_in_background("get_plan", move |planner| {
                answer.send(get_plan_response(planner.plan(is_ready, request.domain, request.problem, 0)));
            });
        })?;
        let (planner, phase) = (Arc::clone(self), Arc::clone(lifecycle));
        self.node.serve::<GetPlanArray>("planner/get_plan_array", move |request, answer| {
            let is_ready = is_ready(&phase);
            planner.run_in_background("get_plan_array", move |planner| {
                let alternatives = planner.manner.get().alternatives;
                let planned = planner.plan(is_ready, request.domain, request.problem, alternatives);
                answer.send(get_plan_array_response(planned));
            });
        })?;
        let (planner, phase) = (Arc::clone(self), Arc::clone(lifecycle));
        self.node.serve::<ValidateDomain>("planner/validate_domain", move |request, answer| {
            let is_ready = is_ready(&phase);
            planner.run_in_background("validate_domain", move |_| {
                answer.send(validate_domain_response(is_ready, &request.domain));
            });
        })
    }

    fn run_in_background(self: &Arc<Self>, name: &str, work: impl FnOnce(&Self) + Send + 'static) {
        let planner = Arc::clone(self);
        if let Err(error) = on_a_thread(name, move || work(&planner)) {
            // The client receives no reply and times out.
            self.node.log(Severity::Error, &format!("{name}: no thread can be started: {error}"));
        }
    }

    fn plan(
        &self,
        is_ready: bool,
        domain: String,
        problem: String,
        alternatives: usize,
    ) -> Result<Found, NoPlan> {
        if !is_ready {
            return Err(NoPlan::None(UNCONFIGURED.to_owned()));
        }
        // Requests are counted before the comparison, so that concurrent requests cannot exceed the
        // limit together.
        if self.busy.fetch_add(1, Ordering::Relaxed) >= MAX_REQUESTS {
            self.busy.fetch_sub(1, Ordering::Relaxed);
            return Err(NoPlan::None(format!("{MAX_REQUESTS} other plans are being looked for")));
        }
        // The guard decrements the count when the request ends, also if planning panics.
        let _request = CountedRequest(&self.busy);
        self.plan_now(domain, problem, alternatives)
    }

    fn plan_now(&self, domain: String, problem: String, alternatives: usize) -> Result<Found, NoPlan> {
        let manner = Manner { alternatives, ..self.manner.get() };
        let joint = self.joint.as_ref().map(|joint| joint.mission());
        let request = Request {
            domain: Source::new(DOMAIN, domain),
            problem: Source::new(PROBLEM, problem),
            joint: joint.as_ref(),
        };
        let planned = solve(request, &manner);
        self.plan_publisher.publish_result(&planned);
        planned
    }
}

pub(crate) fn on_a_thread(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    std::thread::Builder::new().name(name.to_owned()).stack_size(STACK_SIZE).spawn(work).map(|_| ())
}

const UNCONFIGURED: &str = "the planner is not configured; `ros2 lifecycle set /planner configure` does it";

fn is_ready(lifecycle: &Lifecycle) -> bool {
    matches!(lifecycle.phase(), Phase::Inactive | Phase::Active)
}

/// Converts a plan to PlanSys2's message type, with times in seconds.
pub(crate) fn plan_message(lines: &[PlanLine]) -> Plan {
    let item = |line: &PlanLine| PlanItem {
        time: line.start.to_f64() as f32,
        action: line.action.clone(),
        duration: line.duration.to_f64() as f32,
    };
    Plan { items: lines.iter().map(item).collect() }
}

fn get_plan_response(found: Result<Found, NoPlan>) -> GetPlanResponse {
    match found {
        Ok(found) => {
            let plan = found.plans.first().map(|lines| plan_message(lines)).unwrap_or_default();
            GetPlanResponse { success: true, plan, error_info: String::new() }
        }
        Err(none) => GetPlanResponse { success: false, plan: Plan::default(), error_info: none.text() },
    }
}

fn get_plan_array_response(found: Result<Found, NoPlan>) -> GetPlanArrayResponse {
    match found {
        Ok(found) => {
            let plan_array = found.plans.iter().map(|lines| plan_message(lines)).collect();
            let plan_array = PlanArray { plan_array };
            GetPlanArrayResponse { success: true, plan_array, error_info: String::new() }
        }
        Err(none) => {
            GetPlanArrayResponse { success: false, plan_array: PlanArray::default(), error_info: none.text() }
        }
    }
}

fn validate_domain_response(is_ready: bool, domain: &str) -> ValidateDomainResponse {
    if !is_ready {
        return ValidateDomainResponse { success: false, error_info: UNCONFIGURED.to_owned() };
    }
    match check_domain(&Source::new(DOMAIN, domain)) {
        Ok(()) => ValidateDomainResponse { success: true, error_info: String::new() },
        Err(messages) => {
            ValidateDomainResponse { success: false, error_info: NoPlan::Input(messages).text() }
        }
    }
}

struct CountedRequest<'a>(&'a AtomicUsize);

impl Drop for CountedRequest<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
