//! The controller with simulated experts and a simulated executor of PlanSys2, for the example
//! `examples/nav2`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use metaplan_ros::controller::{self, Options};
use metaplan_ros::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use metaplan_ros::interfaces::plansys2_msgs::action::{ExecutePlan, ExecutePlanFeedback, ExecutePlanResult};
use metaplan_ros::interfaces::plansys2_msgs::srv::{
    GetDomain, GetDomainResponse, GetProblem, GetProblemResponse,
};
use metaplan_ros::node::{GoalEnd, Node, depth};
use metaplan_ros::performer::PlanVersion;

use crate::common::{domain, node, until};
use crate::nav2::file;
use crate::performers::serve;

fn experts(robot: &Arc<Node>) -> Arc<Mutex<String>> {
    let text = |name: &str| std::fs::read_to_string(file(name)).expect("a file");
    let domain = text("domain.pddl");
    let problem = Arc::new(Mutex::new(text("problem.pddl")));
    robot
        .serve::<GetDomain>("/domain_expert/get_domain", move |_, answer| {
            let domain = domain.clone();
            answer.send(GetDomainResponse { success: true, domain, error_info: String::new() });
        })
        .expect("a service");
    let own = Arc::clone(&problem);
    robot
        .serve::<GetProblem>("/problem_expert/get_problem", move |_, answer| {
            let problem = own.lock().expect("no panic").clone();
            let (success, error_info) = (!problem.is_empty(), "none was added".to_owned());
            answer.send(GetProblemResponse { success, problem, error_info });
        })
        .expect("a service");
    problem
}

fn failed(component: &str) -> DiagnosticArray {
    let values = vec![KeyValue { key: component.into(), value: "FALSE".into() }];
    let status = vec![DiagnosticStatus { message: "Component status".into(), values, ..Default::default() }];
    DiagnosticArray { status, ..Default::default() }
}

fn control(domain: u16, stop: &Arc<AtomicBool>) -> std::thread::JoinHandle<Result<(), String>> {
    let controller = node(domain, "metaplan", "");
    let (options, stop) =
        (Options { mission: file("mission.toml"), version: PlanVersion::Newer }, Arc::clone(stop));
    std::thread::spawn(move || {
        controller::run(&controller, &options, &stop).map_err(|messages| messages[0].message.clone())
    })
}

#[test]
fn a_plan_whose_design_is_lost_is_cancelled_and_made_anew() {
    let domain = domain();
    let robot = node(domain, "robot", "");
    experts(&robot);
    let durations = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&durations);
    let goals = serve::<ExecutePlan>(&robot, "/execute_plan", ExecutePlanFeedback::default(), move |goal| {
        let mut seen = seen.lock().expect("no panic");
        seen.push(goal.plan.items.iter().map(|item| item.duration).sum::<f32>());
        let done = ExecutePlanResult { success: true, ..Default::default() };
        // The first plan never ends, the second fails, and the third succeeds.
        match seen.len() {
            1 => None,
            2 => Some((GoalEnd::Aborted, ExecutePlanResult::default())),
            _ => Some((GoalEnd::Succeeded, done)),
        }
    });
    let said = robot.publisher::<DiagnosticArray>("/diagnostics", depth(10)).expect("a topic");
    let stop = Arc::new(AtomicBool::new(false));
    let controls = control(domain, &stop);
    until("a first plan", || goals.lock().expect("no panic").len() == 1);
    until("the end", || {
        said.publish(failed("c_lidar"));
        std::thread::sleep(Duration::from_millis(50));
        controls.is_finished()
    });
    assert_eq!(controls.join().expect("no panic"), Ok(()));
    // Calculated by hand: 18 m at 1 s each, or at 2 s each with cameras for localisation, and two
    // pictures of 2 s.
    assert_eq!(*durations.lock().expect("no panic"), [22.0, 40.0, 40.0]);
}

#[test]
fn without_a_problem_it_waits() {
    let domain = domain();
    let robot = node(domain, "robot", "");
    let problem = experts(&robot);
    let text = std::mem::take(&mut *problem.lock().expect("no panic"));
    let goals = serve::<ExecutePlan>(&robot, "/execute_plan", ExecutePlanFeedback::default(), |_| {
        Some((GoalEnd::Succeeded, ExecutePlanResult { success: true, ..Default::default() }))
    });
    let stop = Arc::new(AtomicBool::new(false));
    let controls = control(domain, &stop);
    std::thread::sleep(Duration::from_secs(2));
    assert!(!controls.is_finished() && goals.lock().expect("no panic").is_empty());
    *problem.lock().expect("no panic") = text;
    until("the end", || controls.is_finished());
    assert_eq!(controls.join().expect("no panic"), Ok(()));
    assert_eq!(goals.lock().expect("no panic").len(), 1);
}

#[test]
fn it_gives_up_and_it_can_be_stopped() {
    let domain = domain();
    let robot = node(domain, "robot", "");
    experts(&robot);
    let goals = serve::<ExecutePlan>(&robot, "/execute_plan", ExecutePlanFeedback::default(), |_| {
        Some((GoalEnd::Aborted, ExecutePlanResult::default()))
    });
    let stop = Arc::new(AtomicBool::new(false));
    let controls = control(domain, &stop);
    until("the end", || controls.is_finished());
    let end = controls.join().expect("no panic");
    assert!(end.as_ref().is_err_and(|text| text.starts_with("5 consecutive plans have failed")), "{end:?}");
    assert_eq!(goals.lock().expect("no panic").len(), 5);
    // Without an executor, nothing can be cancelled. The controller ends nevertheless.
    let other = crate::common::domain();
    experts(&node(other, "robot", ""));
    let controls = control(other, &stop);
    std::thread::sleep(Duration::from_millis(500));
    stop.store(true, Ordering::Relaxed);
    let asked = Instant::now();
    until("the end", || controls.is_finished());
    assert!(asked.elapsed() < Duration::from_secs(2), "{:?}", asked.elapsed());
    assert_eq!(controls.join().expect("no panic"), Ok(()));
}
