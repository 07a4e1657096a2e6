//! The manager and the reasoner on a simulated robot.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use metaplan::message::Errors;
use metaplan_ros::interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use metaplan_ros::interfaces::mros2_msgs::action::{ControlQos, ControlQosGoal};
use metaplan_ros::interfaces::rcl_interfaces::msg::ParameterEvent;
use metaplan_ros::interfaces::std_msgs::msg::{Bool, String as Text};
use metaplan_ros::interfaces::suave_msgs::srv::{Task, TaskRequest};
use metaplan_ros::interfaces::system_modes_msgs::srv::{
    ChangeMode, ChangeModeResponse, GetAvailableModes, GetAvailableModesResponse, GetMode, GetModeResponse,
};
use metaplan_ros::node::{Accepted, Declared, GoalEnd, Node, Publisher, depth, keep_all};
use metaplan_ros::{manager, reasoner};
use ros2_client::ParameterValue;
use serde_json::Value;
use smol::block_on;

use crate::common::{domain, node, until};

const LONG: Duration = Duration::from_secs(20);

const MODES: [(&str, &[&str]); 4] = [
    ("f_generate_search_path", &["fd_spiral_high", "fd_spiral_medium", "fd_spiral_low", "fd_unground"]),
    ("f_follow_pipeline", &["fd_follow_pipeline", "fd_unground"]),
    ("f_maintain_motion", &["fd_all_thrusters", "fd_recover_thrusters", "fd_unground"]),
    ("generate_recharge_path", &["normal", "inactive", "fd_unground"]),
];

/// A robot whose functions accept each request of an available mode.
struct Robot {
    node: Arc<Node>,
    modes: Arc<Mutex<BTreeMap<String, String>>>,
    asked: Arc<Mutex<Vec<(String, String)>>>,
    diagnostics: Publisher<DiagnosticArray>,
}

impl Robot {
    fn new(domain: u16, missing: Option<&'static str>) -> Self {
        let node = node(domain, "robot", "");
        let modes: Arc<Mutex<BTreeMap<String, String>>> = Arc::default();
        let asked: Arc<Mutex<Vec<(String, String)>>> = Arc::default();
        for (function, available) in MODES {
            modes.lock().expect("no panic").insert(function.to_owned(), "fd_unground".to_owned());
            let (own, list) = (Arc::clone(&modes), Arc::clone(&asked));
            node.serve::<ChangeMode>(&format!("/{function}/change_mode"), move |request, answer| {
                let mode = request.mode_name;
                list.lock().expect("no panic").push((function.to_owned(), mode.clone()));
                let success = available.contains(&mode.as_str());
                if success {
                    own.lock().expect("no panic").insert(function.to_owned(), mode);
                }
                answer.send(ChangeModeResponse { success });
            })
            .expect("a service");
            let own = Arc::clone(&modes);
            node.serve::<GetMode>(&format!("/{function}/get_mode"), move |_, answer| {
                let current_mode = own.lock().expect("no panic")[function].clone();
                answer.send(GetModeResponse { current_mode });
            })
            .expect("a service");
            node.serve::<GetAvailableModes>(&format!("/{function}/get_available_modes"), move |_, answer| {
                let named = available.iter().filter(|mode| Some(**mode) != missing);
                let available_modes = named.map(|mode| (*mode).to_owned()).collect();
                answer.send(GetAvailableModesResponse { available_modes });
            })
            .expect("a service");
        }
        let diagnostics = node.publisher("/diagnostics", keep_all()).expect("a topic");
        Self { node, modes, asked, diagnostics }
    }

    fn mode(&self, function: &str) -> String {
        self.modes.lock().expect("no panic")[function].clone()
    }

    fn measure(&self, attribute: &str, value: &str) {
        self.diagnose("QA status", attribute, value);
    }

    fn diagnose(&self, message: &str, key: &str, value: &str) {
        let values = vec![KeyValue { key: key.to_owned(), value: value.to_owned() }];
        let status = DiagnosticStatus { message: message.to_owned(), values, ..DiagnosticStatus::default() };
        self.diagnostics.publish(DiagnosticArray { status: vec![status], ..DiagnosticArray::default() });
    }

    fn until(&self, function: &str, mode: &str) {
        until(&format!("{function} has the mode {mode}"), || self.mode(function) == mode);
    }
}

struct Running {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Result<(), Errors>>,
}

impl Running {
    fn new(role: impl FnOnce(&AtomicBool) -> Result<(), Errors> + Send + 'static) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&stop);
        Self { stop, thread: std::thread::spawn(move || role(&asked)) }
    }

    fn end(self) -> Result<(), Errors> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().expect("no panic")
    }
}

fn mission() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/suave/suave.toml")
}

fn manager(domain: u16, journal: Option<PathBuf>) -> Running {
    let node = node(domain, "metaplan", "");
    let options = manager::Options { mission: mission(), settings: None, journal, allow_commands: false };
    Running::new(move |stop| manager::run(&node, &options, stop))
}

#[test]
fn a_manager_searches_adapts_restarts_and_inspects() {
    let (domain, directory) = (domain(), tempfile::tempdir().expect("a directory"));
    let robot = Robot::new(domain, None);
    let events: Arc<Mutex<Vec<String>>> = Arc::default();
    let heard = Arc::clone(&events);
    robot
        .node
        .subscribe::<Text>("/metaplan/events", depth(100), move |event| {
            heard.lock().expect("no panic").push(event.data);
        })
        .expect("a topic");
    let journal = directory.path().join("journal");
    let first = manager(domain, Some(journal.clone()));
    let request = robot.node.caller::<Task>("/task/request");
    let ask = |task: &str| {
        let request = request.call(TaskRequest { task_name: task.to_owned() }, LONG);
        block_on(request).expect("an answer").success
    };
    assert!(!ask("search_pipline"), "there is no such task");
    until("the search is granted", || ask("search_pipeline"));
    assert_eq!(robot.mode("f_generate_search_path"), "fd_spiral_high");
    assert_eq!(robot.mode("f_maintain_motion"), "fd_all_thrusters");
    until("diagnostics are heard", || {
        robot.measure("water_visibility", "2.5");
        std::thread::sleep(Duration::from_millis(20));
        robot.mode("f_generate_search_path") == "fd_spiral_medium"
    });
    robot.diagnose("Component status", "c_thruster_2", "FALSE");
    robot.until("f_maintain_motion", "fd_recover_thrusters");
    robot.diagnose("Component status", "c_thruster_2", "RECOVERED");
    robot.until("f_maintain_motion", "fd_all_thrusters");
    first.end().expect("it ends as it should");
    let before = robot.asked.lock().expect("no panic").len();
    // A requested mode is not requested again, and the task continues.
    let second = manager(domain, Some(journal));
    until("it adapts again", || {
        robot.measure("water_visibility", "1.5");
        std::thread::sleep(Duration::from_millis(20));
        robot.mode("f_generate_search_path") == "fd_spiral_low"
    });
    let low = ("f_generate_search_path".to_owned(), "fd_spiral_low".to_owned());
    assert_eq!(robot.asked.lock().expect("no panic")[before..], [low]);
    // The topic reports that the pipeline is found: no function is needed any more.
    let found = robot.node.publisher("/pipeline/detected", depth(10)).expect("a topic");
    until("the search ends", || {
        found.publish(Bool { data: true });
        std::thread::sleep(Duration::from_millis(20));
        robot.mode("f_generate_search_path") == "fd_unground"
    });
    until("the inspection is granted", || ask("inspect_pipeline"));
    assert_eq!(robot.mode("f_follow_pipeline"), "fd_follow_pipeline");
    second.end().expect("it ends as it should");
    let events = events.lock().expect("no panic").join("\n");
    for word in ["plan_found", "IDLE", "RECONFIGURE", "EXECUTE", "did you mean"] {
        assert!(events.contains(word), "{word} is not among the events");
    }
}

#[test]
fn a_measurement_corrects_the_effect_of_an_action() {
    let domain = domain();
    let robot = Robot::new(domain, None);
    let events: Arc<Mutex<Vec<Value>>> = Arc::default();
    let heard = Arc::clone(&events);
    robot
        .node
        .subscribe::<Text>("/metaplan/events", depth(100), move |event| {
            heard.lock().expect("no panic").push(serde_json::from_str(&event.data).expect("JSON"));
        })
        .expect("a topic");
    let running = manager(domain, None);
    let request = robot.node.caller::<Task>("/task/request");
    let task = || TaskRequest { task_name: "search_pipeline".to_owned() };
    until("the search is granted", || block_on(request.call(task(), LONG)).expect("an answer").success);
    let recharged = robot.node.publisher("/battery_monitor/recharge/complete", depth(10)).expect("a topic");
    let begun = || {
        let events = events.lock().expect("no panic");
        events.iter().filter(|event| event["answer"] == "begin_action").count()
    };
    // The charger has no contact, so that the level stays low.
    for round in 0..2 {
        until("the robot recharges", || {
            robot.measure("battery_level", "0.2");
            std::thread::sleep(Duration::from_millis(50));
            begun() == 2 * round + 2
        });
        until("the search continues", || {
            recharged.publish(Bool { data: true });
            std::thread::sleep(Duration::from_millis(20));
            begun() == 2 * round + 3
        });
    }
    running.end().expect("it ends as it should");
    let events = events.lock().expect("no panic");
    let of_kind = |kind: &str| events.iter().filter(|event| event["answer"] == kind).collect::<Vec<_>>();
    let names: Vec<&Value> = of_kind("begin_action").into_iter().map(|event| &event["name"]).collect();
    assert_eq!(names, ["search_pipeline", "recharge", "search_pipeline", "recharge", "search_pipeline"]);
    // A request to stop can be repeated.
    let mut stopped: Vec<&Value> = of_kind("stop_action").into_iter().map(|event| &event["action"]).collect();
    stopped.dedup();
    assert_eq!(stopped, [1, 3]);
}

#[test]
fn a_function_keeps_its_design_while_its_mode_manager_does_not_know_the_mode() {
    let (domain, path) = (domain(), "f_generate_search_path");
    let robot = Robot::new(domain, None);
    let running = manager(domain, None);
    let request = robot.node.caller::<Task>("/task/request");
    let task = || TaskRequest { task_name: "search_pipeline".to_owned() };
    until("the search is granted", || block_on(request.call(task(), LONG)).expect("an answer").success);
    // A granted mode is assumed for 2 s.
    std::thread::sleep(Duration::from_millis(2500));
    let set = |mode: &str| robot.modes.lock().expect("no panic").insert(path.to_owned(), mode.to_owned());
    let parameters = robot.node.publisher::<ParameterEvent>("/parameter_events", depth(10)).expect("a topic");
    let changes = robot.asked.lock().expect("no panic").len();
    assert_eq!(set("unknown").as_deref(), Some("fd_spiral_high"));
    for _ in 0..6 {
        parameters.publish(ParameterEvent { node: format!("/{path}_node"), ..ParameterEvent::default() });
        std::thread::sleep(Duration::from_millis(50));
    }
    set("fd_spiral_high");
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(robot.asked.lock().expect("no panic").len(), changes, "no mode is requested");
    running.end().expect("it ends as it should");
}

#[test]
fn a_design_that_is_no_mode_of_the_robot_is_an_error() {
    let domain = domain();
    let _robot = Robot::new(domain, Some("fd_spiral_low"));
    let running = manager(domain, None);
    until("it ends", || running.thread.is_finished());
    let messages = running.end().expect_err("a mode is missing");
    assert_eq!(messages[0].code, "N132");
    assert!(
        messages[0].message.contains("f_generate_search_path has no mode `fd_spiral_low`"),
        "{}",
        messages[0].message
    );
}

#[test]
fn a_reasoner_serves_objectives() {
    let domain = domain();
    let robot = Robot::new(domain, None);
    let node = node(domain, "reasoner", "");
    let options =
        reasoner::Options { mission: mission(), settings: None, journal: None, allow_commands: false };
    let running = Running::new(move |stop| reasoner::run(&node, &options, stop));
    let caller = robot.node.action_caller::<ControlQos>("/mros/objective");
    let goal = |function: &str| {
        let mut goal = ControlQosGoal::default();
        function.clone_into(&mut goal.qos_expected.objective_type);
        goal.qos_expected.always_improve = true;
        goal
    };
    let wrong = block_on(caller.pursue(goal("f_fly"), LONG)).expect_err("there is no such function");
    assert!(wrong.to_string().contains("rejected"), "{wrong}");
    let pursued = block_on(caller.pursue(goal("f_generate_search_path"), LONG)).expect("accepted");
    // MROS's bridge has no server, so the function itself is called.
    robot.until("f_generate_search_path", "fd_spiral_high");
    until("diagnostics are heard", || {
        robot.measure("water_visibility", "2.5");
        std::thread::sleep(Duration::from_millis(20));
        robot.mode("f_generate_search_path") == "fd_spiral_medium"
    });
    until(
        "the feedback has the mode",
        || matches!(block_on(pursued.events.recv()), Ok(Accepted::Feedback(told)) if told.qos_status.selected_mode == "fd_spiral_medium"),
    );
    pursued.cancel();
    until("the goal is cancelled", || {
        matches!(block_on(pursued.events.recv()), Ok(Accepted::Ended(GoalEnd::Canceled, _)))
    });
    assert_eq!(robot.mode("f_generate_search_path"), "fd_unground");
    running.end().expect("it ends as it should");
}

fn spiral(domain: u16) -> (Arc<Node>, Arc<Mutex<Vec<f64>>>) {
    let (node, values) = (node(domain, "spiral", ""), Arc::new(Mutex::new(Vec::new())));
    let noted = Arc::clone(&values);
    let altitude = Declared {
        name: "altitude",
        description: "metres above the ground",
        value: ParameterValue::Double(0.0),
        is_dynamic: true,
        check: |value| match value {
            ParameterValue::Double(altitude) if *altitude > 2.5 => Err("is too high"),
            _ => Ok(()),
        },
    };
    node.declare(vec![altitude], move |name, value| {
        if let ("altitude", ParameterValue::Double(altitude)) = (name, value) {
            noted.lock().expect("no panic").push(*altitude);
        }
    })
    .expect("parameters");
    (node, values)
}

#[test]
fn a_reasoner_executes_steps_and_avoids_a_design_that_is_refused() {
    let domain = domain();
    let robot = Robot::new(domain, None);
    let (_spiral, altitudes) = spiral(domain);
    let directory = tempfile::tempdir().expect("a directory");
    let settings = directory.path().join("ros.toml");
    let table = |(design, altitude): (&str, f64)| {
        let step = format!("{{ node = \"/spiral\", parameters = {{ altitude = {altitude:?} }} }}");
        format!("[functions.f_generate_search_path.designs.{design}]\nsteps = [{step}]\n")
    };
    let altitudes_of_designs = [("fd_spiral_high", 3.0), ("fd_spiral_medium", 2.0), ("fd_spiral_low", 1.0)];
    let text = altitudes_of_designs.map(table).concat();
    std::fs::write(&settings, text).expect("written");
    let node = node(domain, "reasoner", "");
    let options = reasoner::Options {
        mission: mission(),
        settings: Some(settings),
        journal: None,
        allow_commands: false,
    };
    let running = Running::new(move |stop| reasoner::run(&node, &options, stop));
    let caller = robot.node.action_caller::<ControlQos>("/mros/objective");
    let mut goal = ControlQosGoal::default();
    "f_generate_search_path".clone_into(&mut goal.qos_expected.objective_type);
    let pursued = block_on(caller.pursue(goal, LONG)).expect("accepted");
    // The high spiral is refused by the node.
    until("the medium spiral is flown", || altitudes.lock().expect("no panic").last() == Some(&2.0));
    until(
        "the feedback has the mode",
        || matches!(block_on(pursued.events.recv()), Ok(Accepted::Feedback(told)) if told.qos_status.selected_mode == "fd_spiral_medium"),
    );
    until("diagnostics are heard", || {
        robot.measure("water_visibility", "1.5");
        std::thread::sleep(Duration::from_millis(20));
        altitudes.lock().expect("no panic").last() == Some(&1.0)
    });
    // The function has no steps for the time when it is not needed, and keeps its design.
    pursued.cancel();
    until("the goal is cancelled", || {
        matches!(block_on(pursued.events.recv()), Ok(Accepted::Ended(GoalEnd::Canceled, _)))
    });
    assert_eq!(*altitudes.lock().expect("no panic"), [2.0, 1.0]);
    assert!(robot.asked.lock().expect("no panic").is_empty(), "system_modes is not called");
    running.end().expect("it ends as it should");
}
