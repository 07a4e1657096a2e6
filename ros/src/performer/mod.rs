//! Those who carry out actions of a plan on a robot, by the settings: see [`perform`](crate::perform).

mod action;
mod change_mode;
mod execute_plan;
mod hub;
mod navigation;
mod offer;
mod settings;
mod topic;

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use metaplan::message::Message;

use crate::interfaces::suave_msgs::action::{
    FollowPipeline, RechargeBattery, RecoverThrusters, SpiralSearch,
};
use crate::node::Node;
use crate::perform::{Call, End, Perform, Progress, Running};

use action::Client;
use change_mode::ChangeMode;
use hub::Hub;
use topic::Awaited;

pub use execute_plan::{ExecutePlans, PlanVersion};
pub use offer::{offer, offers};
pub use settings::{By, Distribution, Offered, Pose, Poses};

/// Whoever is to carry out actions, by the names of these.
pub struct Cast(BTreeMap<String, Box<dyn Perform>>);

impl std::fmt::Debug for Cast {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_set().entries(self.0.keys()).finish()
    }
}

impl Cast {
    /// Makes ready to call all that the settings name.
    ///
    /// # Errors
    /// What is wrong with the names of topics, all of it.
    pub fn new(
        node: &Arc<Node>,
        actions: &BTreeMap<String, By>,
        poses: &Poses,
    ) -> Result<Self, Vec<Message>> {
        let (mut cast, mut errors) = (BTreeMap::new(), Vec::new());
        let hub = OnceLock::new();
        for (action, by) in actions {
            match performer(node, by, poses, &hub) {
                // PDDL knows no cases.
                Ok(performer) => drop(cast.insert(action.to_lowercase(), performer)),
                Err(error) => errors.push(error),
            }
        }
        if errors.is_empty() { Ok(Self(cast)) } else { Err(errors) }
    }
}

impl Perform for Cast {
    /// What nobody is there for is done as soon as it is begun.
    fn start(&self, call: Call) -> Running {
        if let Some(performer) = self.0.get(&call.action.to_lowercase()) {
            return performer.start(call);
        }
        let (running, performance) = Running::pair();
        performance.end(End::Succeeded);
        running
    }
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
                let made = Hub::new(node)?;
                Arc::clone(hub.get_or_init(|| made))
            };
            Box::new(hub)
        }
        By::Topic { topic } => Box::new(Awaited::new(node, topic)?),
        By::ChangeMode { function, design } => Box::new(ChangeMode::new(node, *function, *design)),
        By::SpiralSearch { server } => Box::new(Client::<SpiralSearch>::new(node, server)),
        By::FollowPipeline { server } => Box::new(Client::<FollowPipeline>::new(node, server)),
        By::RecoverThrusters { server } => Box::new(Client::<RecoverThrusters>::new(node, server)),
        By::RechargeBattery { server } => Box::new(Client::<RechargeBattery>::new(node, server)),
    })
}

/// How far along something is, of which the whole is known.
fn part(done: f32, whole: f32) -> Option<f32> {
    (whole > 0.0).then(|| (done / whole).clamp(0.0, 1.0))
}

/// How it goes.
fn feedback(completion: Option<f32>, text: impl Into<String>) -> Progress {
    Progress::Feedback { completion, text: text.into() }
}
