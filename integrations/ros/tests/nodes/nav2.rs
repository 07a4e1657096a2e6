//! The example `examples/nav2`: its plan is executed by a simulated Nav2 server.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use metaplan::setup::Setup;
use metaplan_ros::interfaces::nav2_msgs::action::{
    NavigateToPose, NavigateToPoseFeedback, NavigateToPoseGoal, NavigateToPoseResult,
};
use metaplan_ros::interfaces::std_msgs::msg::Bool;
use metaplan_ros::node::{GoalEnd, depth};
use metaplan_ros::perform::{Call, End};
use metaplan_ros::planner::{self, Found, Manner, NoPlan, Request};

use crate::common::{domain, node, until};
use crate::performers::{Cast, hear, serve};

pub fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/nav2").join(name)
}

fn plan(failed: &[&str]) -> Result<Found, NoPlan> {
    let mut mission = Setup::read(&file("mission.toml")).expect("a mission").mission;
    for component in failed {
        mission.fail(component).expect("a component");
    }
    let manner = Manner { metric: None, time_limit: Duration::from_secs(20), overlap: None, alternatives: 0 };
    let (domain, problem) = (mission.domain_source().clone(), mission.problem_source().clone());
    planner::solve(Request { domain, problem, joint: Some(&mission) }, &manner)
}

fn words(text: &str) -> Vec<String> {
    text.trim_matches(['(', ')']).split(' ').map(str::to_owned).collect()
}

#[test]
fn the_round_is_driven() {
    let found = plan(&[]).expect("a plan");
    let domain = domain();
    let (robot, manager) = (node(domain, "robot", ""), node(domain, "metaplan", ""));
    let goals =
        serve::<NavigateToPose>(&robot, "/navigate_to_pose", NavigateToPoseFeedback::default(), |_| {
            Some((GoalEnd::Succeeded, NavigateToPoseResult::default()))
        });
    let inspected = robot.publisher::<Bool>("/shelf/inspected", depth(10)).expect("a topic");
    let cast = Cast::new(&manager, &file("ros.toml"));
    for (line, configuration) in found.plans[0].iter().zip(&found.configuration) {
        let mut words = words(&line.action).into_iter();
        let call = Call {
            action: words.next().expect("a name"),
            arguments: words.collect(),
            configuration: configuration.iter().cloned().collect::<BTreeMap<_, _>>(),
            duration: line.duration.to_f64(),
        };
        let running = cast.start(call);
        let end = Arc::new(Mutex::new(None));
        let ended = Arc::clone(&end);
        let hears = std::thread::spawn(move || *ended.lock().expect("no panic") = Some(hear(&running).1));
        until("the end of an action", || {
            inspected.publish(Bool { data: true });
            hears.is_finished()
        });
        assert_eq!(*end.lock().expect("no panic"), Some(End::Succeeded), "{}", line.action);
    }
    let place = |goal: &NavigateToPoseGoal| {
        let position = &goal.pose.pose.position;
        (position.x, position.y)
    };
    let places: Vec<_> = goals.lock().expect("no panic").iter().map(place).collect();
    assert_eq!(places, [(4.0, 0.0), (4.0, 3.0), (6.0, 3.0), (4.0, 0.0), (0.0, 0.0)]);
}

/// Calculated by hand: 18 m at 1 s each, or at 2 s each with cameras for localisation, and two
/// pictures of 2 s each, or of 15 s each by warmth.
#[test]
fn the_designs_follow_the_components() {
    let designs = |found: &Found| {
        let all = found.configuration.iter().flatten().map(|(_, design)| design.clone());
        all.collect::<std::collections::BTreeSet<_>>().into_iter().collect::<Vec<_>>()
    };
    for (failed, cost, expected) in [
        (&[][..], "22", ["fd_drive_fast", "fd_lidar_localization", "fd_look_by_light"]),
        (&["c_lidar"], "40", ["fd_drive_fast", "fd_look_by_light", "fd_visual_localization"]),
        (&["c_camera"], "48", ["fd_drive_fast", "fd_lidar_localization", "fd_look_by_warmth"]),
    ] {
        let found = plan(failed).expect("a plan");
        assert_eq!(
            (found.cost.to_string().as_str(), designs(&found).as_slice()),
            (cost, &expected.map(String::from)[..])
        );
    }
    let reason = plan(&["c_lidar", "c_camera"]).expect_err("no plan").text();
    assert!(
        reason.contains("there is no plan without fd_lidar_localization, fd_visual_localization"),
        "{reason}"
    );
}
