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
pub use offer::offer;
pub use settings::{By, Distribution, Performers, Pose, Poses};

/// All performers of the settings, as one.
pub struct Cast {
    performers: BTreeMap<String, Box<dyn Perform>>,
}

impl std::fmt::Debug for Cast {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_set().entries(self.performers.keys()).finish()
    }
}

impl Cast {
    /// Makes ready to call all that the settings name.
    ///
    /// # Errors
    /// What is wrong with the names, all of it.
    pub fn new(node: &Arc<Node>, settings: &Performers) -> Result<Self, Vec<Message>> {
        let (mut performers, mut errors) = (BTreeMap::new(), settings.mistakes());
        let hub = OnceLock::new();
        for (action, by) in &settings.actions {
            match performer(node, by, &settings.poses, &hub) {
                // PDDL knows no cases.
                Ok(performer) => drop(performers.insert(action.to_lowercase(), performer)),
                Err(error) => errors.push(error),
            }
        }
        if errors.is_empty() { Ok(Self { performers }) } else { Err(errors) }
    }

    /// Whether somebody is there for an action.
    pub fn has(&self, action: &str) -> bool {
        self.performers.contains_key(&action.to_lowercase())
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

impl Perform for Cast {
    fn start(&self, call: Call) -> Running {
        if let Some(performer) = self.performers.get(&call.action.to_lowercase()) {
            return performer.start(call);
        }
        let (running, performance) = Running::pair();
        performance.end(End::Succeeded);
        running
    }
}

/// How far along something is, of which the whole is known.
fn part(done: f32, whole: f32) -> Option<f32> {
    (whole > 0.0).then(|| (done / whole).clamp(0.0, 1.0))
}

/// How it goes.
fn feedback(completion: Option<f32>, text: impl Into<String>) -> Progress {
    Progress::Feedback { completion, text: text.into() }
}
