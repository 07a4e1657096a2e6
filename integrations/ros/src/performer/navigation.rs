//! Performer for Nav2: an action of the plan becomes a goal for `navigate_to_pose`, with the pose
//! of one of its arguments.

use std::num::NonZeroUsize;
use std::sync::Arc;

use crate::interfaces::{geometry_msgs, humble, iron, nav2_msgs, rolling};
use crate::node::Node;
use crate::perform::{Call, Perform, Progress};
use crate::performer::action::{Client, Meaning};
use crate::performer::settings::argument;
use crate::performer::{Distribution, Poses, feedback, part};

#[derive(Debug, Clone)]
pub(super) struct Navigation {
    poses: Poses,
    pose: Option<NonZeroUsize>,
    behavior_tree: String,
}

pub(super) fn performer(
    node: &Arc<Node>,
    server: &str,
    (poses, pose): (&Poses, Option<NonZeroUsize>),
    types: Distribution,
    behavior_tree: &str,
) -> Box<dyn Perform> {
    let settings = Navigation { poses: poses.clone(), pose, behavior_tree: behavior_tree.to_owned() };
    match types {
        Distribution::Humble => {
            Box::new(Client::<humble::nav2_msgs::action::NavigateToPose>::with(node, server, settings))
        }
        Distribution::Iron => {
            Box::new(Client::<iron::nav2_msgs::action::NavigateToPose>::with(node, server, settings))
        }
        Distribution::Jazzy => {
            Box::new(Client::<nav2_msgs::action::NavigateToPose>::with(node, server, settings))
        }
        Distribution::Rolling => {
            Box::new(Client::<rolling::nav2_msgs::action::NavigateToPose>::with(node, server, settings))
        }
    }
}

impl Navigation {
    fn pose(&self, call: &Call) -> Result<geometry_msgs::msg::PoseStamped, String> {
        let object = argument(&call.arguments, self.pose, 0)?;
        self.poses.find(object).ok_or_else(|| self.poses.lacking(object))
    }
}

/// Progress with the completed share of the route, estimated from elapsed and remaining seconds.
fn progress_of(elapsed: i32, remaining: i32, distance: f32, recoveries: i16) -> Progress {
    let (elapsed, remaining) = (elapsed as f32, remaining as f32);
    let recovered = if recoveries > 0 { format!(", {recoveries} recoveries") } else { String::new() };
    let text = format!("{distance:.2} m left{recovered}");
    // Nav2 reports 0 as long as the remaining time is unknown.
    feedback(if remaining > 0.0 { part(elapsed, elapsed + remaining) } else { None }, text)
}

fn error(code: u16, text: &str) -> Option<String> {
    let because = if text.is_empty() { String::new() } else { format!(": {text}") };
    (code != 0).then(|| format!("Nav2 says error {code}{because}"))
}

/// Implements [`Meaning`] for the types of one distribution. The types have the same fields, except for
/// additional fields of the result and of the feedback.
macro_rules! meaning {
    ($($path:ident)::+, |$result:ident| $shortfall:expr) => {
        impl Meaning for $($path)::+::action::NavigateToPose {
            type Settings = Navigation;

            fn goal(
                settings: &Navigation,
                call: &Call,
            ) -> Result<$($path)::+::action::NavigateToPoseGoal, String> {
                let behavior_tree = settings.behavior_tree.clone();
                Ok($($path)::+::action::NavigateToPoseGoal { pose: settings.pose(call)?, behavior_tree })
            }

            fn progress(_: &Call, message: &$($path)::+::action::NavigateToPoseFeedback) -> Progress {
                let (elapsed, remaining) = (message.navigation_time.sec, message.estimated_time_remaining.sec);
                progress_of(elapsed, remaining, message.distance_remaining, message.number_of_recoveries)
            }

            fn shortfall($result: &$($path)::+::action::NavigateToPoseResult) -> Option<String> {
                $shortfall
            }
        }
    };
}

meaning!(humble::nav2_msgs, |_result| None);
meaning!(iron::nav2_msgs, |result| error(result.error_code, ""));
meaning!(nav2_msgs, |result| error(result.error_code, &result.error_msg));
meaning!(rolling::nav2_msgs, |result| error(result.error_code, &result.error_msg));
