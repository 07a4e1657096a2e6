//! The settings of performers, and what can be wrong with them.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use metaplan::message::did_you_mean;
use serde::Deserialize;

use crate::interfaces::builtin_interfaces::msg::Time;
use crate::interfaces::geometry_msgs::msg::Pose as PoseMessage;
use crate::interfaces::geometry_msgs::msg::{Point, PoseStamped, Quaternion};
use crate::interfaces::std_msgs::msg::Header;

/// Who carries out an action.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "by", rename_all = "snake_case", deny_unknown_fields)]
pub enum By {
    /// Nav2, with the pose of one of the action's arguments.
    NavigateToPose {
        /// The name of Nav2's action.
        #[serde(default = "navigate_to_pose")]
        server: String,
        /// Which argument, from 1; if not given, the last.
        pose: Option<NonZeroUsize>,
        /// Whose types.
        #[serde(default)]
        types: Distribution,
        /// A behaviour tree, as Nav2 takes it.
        #[serde(default)]
        behavior_tree: String,
    },
    /// A performer of PlanSys2, over `actions_hub`.
    ActionsHub,
    /// The world: it is done when a `std_msgs/Bool` on a topic is true.
    Topic {
        /// The name of the topic.
        topic: String,
    },
    /// `system_modes`: one argument is a function, another one the design that it is to have.
    ChangeMode {
        /// Which argument is the function, from 1; if not given, the last but one.
        function: Option<NonZeroUsize>,
        /// Which argument is the design, from 1; if not given, the last.
        design: Option<NonZeroUsize>,
    },
    /// SUAVE's search.
    SpiralSearch {
        /// The name of the action.
        #[serde(default = "spiral_search")]
        server: String,
    },
    /// SUAVE's inspection.
    FollowPipeline {
        /// The name of the action.
        #[serde(default = "follow_pipeline")]
        server: String,
    },
    /// SUAVE's repair.
    RecoverThrusters {
        /// The name of the action.
        #[serde(default = "recover_thrusters")]
        server: String,
    },
    /// SUAVE's charging.
    RechargeBattery {
        /// The name of the action.
        #[serde(default = "recharge_battery")]
        server: String,
    },
}

/// An action that is done for PlanSys2's executor.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Offered {
    /// What its arguments have to be; an empty one, or one that is not there, may be anything.
    #[serde(default)]
    pub specialized_arguments: Vec<String>,
    /// Who does it.
    #[serde(flatten)]
    pub by: By,
}

fn navigate_to_pose() -> String {
    "/navigate_to_pose".to_owned()
}

fn spiral_search() -> String {
    "/spiral_search".to_owned()
}

fn follow_pipeline() -> String {
    "/follow_pipeline".to_owned()
}

fn recover_thrusters() -> String {
    "/recover_thrusters".to_owned()
}

fn recharge_battery() -> String {
    "/recharge_battery".to_owned()
}

/// A distribution of ROS 2, where types of Nav2 differ.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// ROS 2 Humble.
    Humble,
    /// ROS 2 Iron.
    Iron,
    /// ROS 2 Jazzy.
    #[default]
    Jazzy,
    /// ROS 2 Rolling.
    Rolling,
}

/// Where things are, in one frame.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Poses {
    /// The coordinate frame.
    #[serde(default = "map")]
    pub frame: String,
    /// By the names of objects.
    #[serde(flatten)]
    pub places: BTreeMap<String, Pose>,
}

impl Default for Poses {
    fn default() -> Self {
        Self { frame: map(), places: BTreeMap::new() }
    }
}

fn map() -> String {
    "map".to_owned()
}

/// A place and a direction.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// In metres.
    pub x: f64,
    /// In metres.
    pub y: f64,
    /// In metres.
    #[serde(default)]
    pub z: f64,
    /// The direction, counter-clockwise from the x-axis, in radians.
    #[serde(default)]
    pub yaw: f64,
}

impl Poses {
    /// The pose of an object, as of now.
    pub(super) fn find(&self, object: &str) -> Option<PoseStamped> {
        let is_it = |(name, _): &(&String, &Pose)| name.eq_ignore_ascii_case(object);
        let (_, pose) = self.places.iter().find(is_it)?;
        let half = pose.yaw / 2.0;
        Some(PoseStamped {
            // A time of 0 is the latest that is known, for those who transform it.
            header: Header { stamp: Time::default(), frame_id: self.frame.clone() },
            pose: PoseMessage {
                position: Point { x: pose.x, y: pose.y, z: pose.z },
                orientation: Quaternion { x: 0.0, y: 0.0, z: half.sin(), w: half.cos() },
            },
        })
    }

    /// That an object has no pose, and what may be meant.
    pub(super) fn lacking(&self, object: &str) -> String {
        let meant = did_you_mean(object, self.places.keys().map(String::as_str));
        format!("`[poses]` has no `{object}`{meant}")
    }
}

/// An argument by its number from 1, or from the end: 0 is the last.
pub(super) fn argument(
    arguments: &[String],
    number: Option<NonZeroUsize>,
    from_end: usize,
) -> Result<&str, String> {
    let index = match number {
        Some(number) => Some(number.get() - 1),
        None => arguments.len().checked_sub(from_end + 1),
    };
    let found = index.and_then(|index| arguments.get(index)).map(String::as_str);
    found.ok_or_else(|| match number {
        Some(number) => format!("there is no argument {number}, but {}", arguments.len()),
        None => format!("{} arguments are too few", arguments.len()),
    })
}
