//! Settings of performers.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use metaplan::message::did_you_mean;
use serde::Deserialize;

use crate::interfaces::builtin_interfaces::msg::Time;
use crate::interfaces::geometry_msgs::msg::Pose as PoseMessage;
use crate::interfaces::geometry_msgs::msg::{Point, PoseStamped, Quaternion};
use crate::interfaces::std_msgs::msg::Header;
use crate::performer::{AnyCall, AnyGoal};

/// Performer of an action, as configured in the settings.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "by", rename_all = "snake_case", deny_unknown_fields)]
pub enum By {
    /// Nav2: the action becomes a navigation goal with the pose of an argument.
    NavigateToPose {
        /// Name of Nav2's action.
        #[serde(default = "navigate_to_pose")]
        server: String,
        /// Position of the argument with the pose, counted from 1; by default the last argument.
        pose: Option<NonZeroUsize>,
        /// Distribution of ROS 2 whose Nav2 message types are used.
        #[serde(default)]
        types: Distribution,
        /// File of the behaviour tree for Nav2; empty for Nav2's default.
        #[serde(default)]
        behavior_tree: String,
    },
    /// A performer of PlanSys2 on `actions_hub`.
    ActionsHub,
    /// The environment: the action ends when a `std_msgs/Bool` on a topic is true.
    Topic {
        /// Name of the topic.
        topic: String,
    },
    /// `system_modes`: the action sets the design of a function. Two of its arguments are the function and the
    /// design.
    ChangeMode {
        /// Position of the function, counted from 1; by default the last argument but one.
        function: Option<NonZeroUsize>,
        /// Position of the design, counted from 1; by default the last argument.
        design: Option<NonZeroUsize>,
    },
    /// An action server of any type.
    Action(AnyGoal),
    /// A service of any type.
    Service(AnyCall),
    /// SUAVE's search for a pipeline.
    SpiralSearch {
        /// Name of SUAVE's action.
        #[serde(default = "spiral_search")]
        server: String,
    },
    /// SUAVE's inspection of a pipeline.
    FollowPipeline {
        /// Name of SUAVE's action.
        #[serde(default = "follow_pipeline")]
        server: String,
    },
    /// SUAVE's recovery of thrusters.
    RecoverThrusters {
        /// Name of SUAVE's action.
        #[serde(default = "recover_thrusters")]
        server: String,
    },
    /// SUAVE's charging of the battery.
    RechargeBattery {
        /// Name of SUAVE's action.
        #[serde(default = "recharge_battery")]
        server: String,
    },
}

/// Settings of an action that is performed for PlanSys2's executor.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Offered {
    /// Required arguments by position. An empty or missing argument admits every value.
    #[serde(default)]
    pub specialized_arguments: Vec<String>,
    /// Performer of the action.
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

/// Distribution of ROS 2 with its own message types of Nav2.
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

/// Poses of the objects in a problem, in a common coordinate frame.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Poses {
    /// Name of the coordinate frame.
    #[serde(default = "map")]
    pub frame: String,
    /// Poses by object names.
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

/// Position and orientation of an object.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// x-coordinate in metres.
    pub x: f64,
    /// y-coordinate in metres.
    pub y: f64,
    /// z-coordinate in metres; 0 by default.
    #[serde(default)]
    pub z: f64,
    /// Orientation in radians, counter-clockwise from the x-axis.
    #[serde(default)]
    pub yaw: f64,
}

impl Poses {
    /// Returns the pose of an object, or `None` if the settings have none. Names are compared
    /// without case.
    pub(super) fn find(&self, object: &str) -> Option<PoseStamped> {
        let is_object = |(name, _): &(&String, &Pose)| name.eq_ignore_ascii_case(object);
        let (_, pose) = self.places.iter().find(is_object)?;
        let half = pose.yaw / 2.0;
        Some(PoseStamped {
            // Time 0 selects the latest coordinate transform.
            header: Header { stamp: Time::default(), frame_id: self.frame.clone() },
            pose: PoseMessage {
                position: Point { x: pose.x, y: pose.y, z: pose.z },
                orientation: Quaternion { x: 0.0, y: 0.0, z: half.sin(), w: half.cos() },
            },
        })
    }

    pub(super) fn lacking(&self, object: &str) -> String {
        let suggestion = did_you_mean(object, self.places.keys().map(String::as_str));
        format!("`[poses]` has no `{object}`{suggestion}")
    }
}

/// Returns the argument with the position `number`, counted from 1. If `number` is `None`, `from_end` is the position
/// counted from the end, where 0 is the last argument. The error describes a missing argument.
pub(super) fn argument(
    arguments: &[String],
    number: Option<NonZeroUsize>,
    from_end: usize,
) -> Result<&str, String> {
    let index = match number {
        Some(number) => Some(number.get() - 1),
        None => arguments.len().checked_sub(from_end + 1),
    };
    let argument_text = index.and_then(|index| arguments.get(index)).map(String::as_str);
    argument_text.ok_or_else(|| match number {
        Some(number) => format!("there is no argument {number}, but {}", arguments.len()),
        None => format!("{} arguments are too few", arguments.len()),
    })
}
