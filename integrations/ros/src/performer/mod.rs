//! Performers of the actions of a plan, as configured in the settings; see
//! [`perform`](crate::perform).

mod action;
mod any;
mod change_mode;
mod execute_plan;
mod hub;
mod navigation;
mod offer;
mod settings;
mod topic;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use metaplan::message::{Errors, Message};

use crate::interfaces::suave_msgs::action::{
    FollowPipeline, RechargeBattery, RecoverThrusters, SpiralSearch,
};
use crate::node::Node;
use crate::perform::{Perform, Progress};

use action::Client;
use any::{CallClient, GoalClient};
use change_mode::ChangeMode;
use hub::Hub;
use topic::Awaited;

pub use any::{AnyCall, AnyGoal};
pub use execute_plan::{ExecutePlans, PlanVersion};
pub use offer::{offer, offers};
pub use settings::{By, Distribution, Offered, Pose, Poses};

/// Creates the performers that the settings configure, by action name.
///
/// # Errors
/// Fails with the errors about all topics that cannot be created.
pub fn performers(
    node: &Arc<Node>,
    actions: &BTreeMap<String, By>,
    poses: &Poses,
) -> Result<BTreeMap<String, Box<dyn Perform>>, Errors> {
    let (mut performers, mut errors) = (BTreeMap::new(), Vec::new());
    let hub = OnceLock::new();
    for (action, by) in actions {
        match performer(node, by, poses, &hub) {
            Ok(performer) => drop(performers.insert(action.clone(), performer)),
            Err(error) => errors.push(error),
        }
    }
    if errors.is_empty() { Ok(performers) } else { Err(errors.into()) }
}

fn performer(
    node: &Arc<Node>,
    by: &By,
    poses: &Poses,
    hub: &OnceLock<Arc<Hub>>,
) -> Result<Box<dyn Perform>, Message> {
    Ok(match by {
        By::NavigateToPose { server, pose, types, behavior_tree } => {
            navigation::performer(node, server, (poses, *pose), *types, behavior_tree)
        }
        By::ActionsHub => {
            let hub = if let Some(hub) = hub.get() {
                Arc::clone(hub)
            } else {
                let created = Hub::new(node)?;
                Arc::clone(hub.get_or_init(|| created))
            };
            Box::new(hub)
        }
        By::Topic { topic } => Box::new(Awaited::new(node, topic)?),
        By::ChangeMode { function, design } => Box::new(ChangeMode::new(node, *function, *design)),
        By::Action(settings) => Box::new(GoalClient::new(node, settings, poses)),
        By::Service(settings) => Box::new(CallClient::new(node, settings, poses)),
        By::SpiralSearch { server } => Box::new(Client::<SpiralSearch>::new(node, server)),
        By::FollowPipeline { server } => Box::new(Client::<FollowPipeline>::new(node, server)),
        By::RecoverThrusters { server } => Box::new(Client::<RecoverThrusters>::new(node, server)),
        By::RechargeBattery { server } => Box::new(Client::<RechargeBattery>::new(node, server)),
    })
}

/// Completed share from 0 to 1. Returns `None` if the total is not positive, i.e. unknown.
fn part(done: f32, whole: f32) -> Option<f32> {
    (whole > 0.0).then(|| (done / whole).clamp(0.0, 1.0))
}

fn feedback(completion: Option<f32>, text: impl Into<String>) -> Progress {
    Progress::Feedback { completion, text: text.into() }
}
