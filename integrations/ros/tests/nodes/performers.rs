//! Performers of actions, tested with simulated servers.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use metaplan_ros::interfaces::action_msgs::srv::CancelGoal;
use metaplan_ros::interfaces::plansys2_1::plansys2_msgs::action as older;
use metaplan_ros::interfaces::plansys2_msgs::action::{
    ExecutePlan, ExecutePlanFeedback, ExecutePlanGoal, ExecutePlanResult,
};
use metaplan_ros::interfaces::plansys2_msgs::msg::{
    ActionExecution, ActionExecutionInfo, ActionPerformerStatus, Plan, PlanItem,
};
use metaplan_ros::interfaces::system_modes_msgs::srv::{ChangeMode, ChangeModeResponse};
use metaplan_ros::interfaces::{Action, humble, nav2_msgs, std_msgs};
use metaplan_ros::manager::Settings;
use metaplan_ros::node::{GoalEnd, GoalEvent, Node, depth};
use metaplan_ros::perform::{Call, End, Perform, Progress, Running};
use metaplan_ros::performer::{ExecutePlans, PlanVersion, offer, offers, performers};
use smol::block_on;

use crate::common::{domain, node, until};

const SETTINGS: &str = r#"
[actions.move]
by = "navigate_to_pose"

[actions.drive]
by = "navigate_to_pose"
server = "/humble"
types = "humble"
pose = 2

[actions.look]
by = "topic"
topic = "/detected"

[actions.reconfigure]
by = "change_mode"

[actions.search]
by = "actions_hub"

[poses]
hall = { x = 1.0, y = -2.5, yaw = 3.141592653589793 }
"#;

fn call(text: &str) -> Call {
    let mut words = text.trim_matches(['(', ')']).split(' ').map(str::to_owned);
    let action = words.next().expect("a name");
    Call { action, arguments: words.collect(), configuration: BTreeMap::new(), duration: 0.0 }
}

/// Collects all messages about an action until it ends. Returns the feedback and the end.
pub fn hear(running: &Running) -> (Vec<Progress>, End) {
    let mut heard = Vec::new();
    loop {
        match block_on(running.next()) {
            Progress::Ended(end) => return (heard, end),
            feedback @ Progress::Feedback { .. } => heard.push(feedback),
        }
    }
}

pub struct Cast(BTreeMap<String, Box<dyn Perform>>);

impl Cast {
    pub fn new(node: &Arc<Node>, file: &Path) -> Self {
        let settings = Settings::read(Some(file), Path::new("mission.toml")).expect("settings");
        Self(performers(node, &settings.actions, &settings.poses).expect("performers"))
    }

    pub fn start(&self, call: Call) -> Running {
        self.0[&call.action].start(call)
    }
}

fn cast(domain: u16, settings: &str) -> (Arc<Node>, Cast) {
    let manager = node(domain, "metaplan", "");
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("ros.toml");
    std::fs::write(&file, settings).expect("a file");
    let cast = Cast::new(&manager, &file);
    (manager, cast)
}

/// Serves an action: accepts each goal, sends one feedback message, and ends the goal with the given outcome.
/// Without an outcome, the goal runs until it is cancelled.
pub fn serve<A: Action + 'static>(
    node: &Arc<Node>,
    name: &str,
    feedback: A::Feedback,
    end: impl Fn(&A::Goal) -> Option<(GoalEnd, A::Result)> + Send + 'static,
) -> Arc<Mutex<Vec<A::Goal>>>
where
    A::Feedback: Sync,
{
    let goals = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&goals);
    let server = Arc::new(Mutex::new(None::<Arc<metaplan_ros::node::Goals<A>>>));
    let own = Arc::clone(&server);
    let made = node.serve_action::<A>(name, move |event| {
        let server = own.lock().expect("no panic").clone().expect("it is there");
        match event {
            GoalEvent::Wanted(wanted, goal) => {
                let id = server.accept(wanted);
                server.feedback(id, feedback.clone());
                if let Some((end, result)) = end(&goal) {
                    server.finish(id, end, result);
                }
                seen.lock().expect("no panic").push(goal);
            }
            GoalEvent::Cancel(id, request) => {
                server.canceling(request, true);
                server.finish(id, GoalEnd::Canceled, A::Result::default());
            }
        }
    });
    *server.lock().expect("no panic") = Some(made.expect("a server"));
    goals
}

#[test]
fn nav2_moves_the_robot() {
    use nav2_msgs::action::{NavigateToPose, NavigateToPoseFeedback, NavigateToPoseResult};

    let domain = domain();
    let robot = node(domain, "robot", "");
    let told = NavigateToPoseFeedback { distance_remaining: 1.25, ..Default::default() };
    let goals = serve::<NavigateToPose>(&robot, "/navigate_to_pose", told, |goal| {
        let is_ahead = goal.pose.pose.position.x > 0.0;
        is_ahead.then(|| (GoalEnd::Succeeded, NavigateToPoseResult::default()))
    });
    let aborted = humble::nav2_msgs::action::NavigateToPoseResult::default();
    let others = serve::<humble::nav2_msgs::action::NavigateToPose>(
        &robot,
        "/humble",
        humble::nav2_msgs::action::NavigateToPoseFeedback::default(),
        move |_| Some((GoalEnd::Aborted, aborted.clone())),
    );
    let (_manager, cast) = cast(domain, &(SETTINGS.to_owned() + "hell = { x = -1.0, y = 0.0 }\n"));
    let (_, end) = hear(&cast.start(call("(move r1 kitchen HALL)")));
    assert_eq!(end, End::Succeeded);
    let goal = goals.lock().expect("no panic")[0].clone();
    let (position, way) = (&goal.pose.pose.position, &goal.pose.pose.orientation);
    assert_eq!((goal.pose.header.frame_id.as_str(), position.x, position.y), ("map", 1.0, -2.5));
    // The expected orientation is half a turn around the z-axis.
    assert!((way.z - 1.0).abs() < 1e-9 && way.w.abs() < 1e-9 && way.x == 0.0 && way.y == 0.0, "{way:?}");
    // A goal that takes long is cancelled.
    let running = cast.start(call("(move r1 hall hell)"));
    until("a second goal", || goals.lock().expect("no panic").len() == 2);
    running.cancel();
    let (_, end) = hear(&running);
    assert_eq!(end, End::Canceled);
    // Another distribution, another argument, and a failure.
    let (_, end) = hear(&cast.start(call("(drive r1 hall)")));
    assert!(matches!(&end, End::Failed(because) if because.contains("aborted the goal")), "{end:?}");
    assert_eq!(others.lock().expect("no panic").len(), 1);
    // Objects without a pose have no goal.
    let (_, end) = hear(&cast.start(call("(move r1 hall hal)")));
    assert!(matches!(&end, End::Failed(because) if because.contains("did you mean `hall`")), "{end:?}");
}

#[test]
fn an_action_without_a_server_is_cancelled_soon() {
    let (_manager, cast) = cast(domain(), SETTINGS);
    for text in ["(move r1 kitchen hall)", "(reconfigure f_search fd_high)"] {
        let running = cast.start(call(text));
        running.cancel();
        assert_eq!(hear(&running).1, End::Canceled, "{text}");
    }
}

#[test]
fn a_goal_is_cancelled_without_an_answer() {
    use nav2_msgs::action::NavigateToPose;

    let domain = domain();
    let (robot, observer) = (node(domain, "robot", ""), node(domain, "observer", ""));
    let (sender, goals) = smol::channel::unbounded();
    robot
        .serve_action::<NavigateToPose>("/navigate_to_pose", move |event| {
            sender.try_send(event).expect("the test receives");
        })
        .expect("an action");
    // An action server does not report cancel requests for goals that it has not accepted.
    let (sender, cancels) = smol::channel::unbounded();
    observer
        .serve::<CancelGoal>("/navigate_to_pose/_action/cancel_goal", move |request, _| {
            sender.try_send(request).expect("the test receives");
        })
        .expect("a service");
    let (_manager, cast) = cast(domain, SETTINGS);
    let running = cast.start(call("(move r1 kitchen hall)"));
    until("a goal", || !goals.is_empty());
    running.cancel();
    assert_eq!(hear(&running).1, End::Canceled);
    until("a request to cancel the goal", || !cancels.is_empty());
}

#[test]
fn a_goal_that_was_not_cancelled_on_request_has_failed() {
    use nav2_msgs::action::{NavigateToPose, NavigateToPoseFeedback, NavigateToPoseResult};

    let domain = domain();
    let robot = node(domain, "robot", "");
    serve::<NavigateToPose>(&robot, "/navigate_to_pose", NavigateToPoseFeedback::default(), |_| {
        Some((GoalEnd::Canceled, NavigateToPoseResult::default()))
    });
    let (_manager, cast) = cast(domain, SETTINGS);
    let (_, end) = hear(&cast.start(call("(move r1 kitchen hall)")));
    assert!(matches!(&end, End::Failed(because) if because.contains("another client")), "{end:?}");
}

#[test]
fn a_rejected_goal_is_sent_again_until_the_action_is_cancelled() {
    use nav2_msgs::action::{NavigateToPose, NavigateToPoseResult};

    let domain = domain();
    let robot = node(domain, "robot", "");
    let (sender, events) = smol::channel::unbounded();
    let goals = robot
        .serve_action::<NavigateToPose>("/navigate_to_pose", move |event| {
            sender.try_send(event).expect("the test receives");
        })
        .expect("an action");
    let wanted = || {
        until("a goal", || !events.is_empty());
        match events.try_recv() {
            Ok(GoalEvent::Wanted(wanted, _)) => wanted,
            _ => panic!("no goal is cancelled"),
        }
    };
    let (_manager, cast) = cast(domain, SETTINGS);
    let running = cast.start(call("(move r1 kitchen hall)"));
    goals.reject(wanted());
    let goal = goals.accept(wanted());
    goals.finish(goal, GoalEnd::Succeeded, NavigateToPoseResult::default());
    assert_eq!(hear(&running).1, End::Succeeded);
    let running = cast.start(call("(move r1 kitchen hall)"));
    goals.reject(wanted());
    goals.reject(wanted());
    running.cancel();
    assert_eq!(hear(&running).1, End::Canceled);
    std::thread::sleep(Duration::from_millis(1500));
    assert!(events.is_empty(), "nothing is sent after the cancellation");
}

#[test]
fn a_result_of_another_version_ends_the_action() {
    use humble::nav2_msgs::action::{NavigateToPose, NavigateToPoseFeedback, NavigateToPoseResult};

    let domain = domain();
    let robot = node(domain, "robot", "");
    serve::<NavigateToPose>(&robot, "/navigate_to_pose", NavigateToPoseFeedback::default(), |_| {
        Some((GoalEnd::Succeeded, NavigateToPoseResult::default()))
    });
    let (_manager, cast) = cast(domain, SETTINGS);
    let running = cast.start(call("(move r1 kitchen hall)"));
    let moving = std::thread::spawn(move || hear(&running).1);
    until("the end", || moving.is_finished());
    let end = moving.join().expect("no panic");
    let expected = "a result of /navigate_to_pose is malformed";
    assert!(matches!(&end, End::Failed(because) if because.contains(expected)), "{end:?}");
}

#[test]
fn the_world_and_the_modes_of_functions_do_their_part() {
    let domain = domain();
    let robot = node(domain, "robot", "");
    let modes = Arc::new(Mutex::new(Vec::new()));
    let asked = Arc::clone(&modes);
    robot
        .serve::<ChangeMode>("/f_search/change_mode", move |request, answer| {
            let success = request.mode_name == "fd_high";
            asked.lock().expect("no panic").push(request.mode_name);
            answer.send(ChangeModeResponse { success });
        })
        .expect("a service");
    let detected = robot.publisher::<std_msgs::msg::Bool>("/detected", depth(10)).expect("a topic");
    let (_manager, cast) = cast(domain, SETTINGS);
    assert_eq!(hear(&cast.start(call("(reconfigure f_search fd_high)"))).1, End::Succeeded);
    let end = hear(&cast.start(call("(reconfigure f_search fd_low)"))).1;
    assert!(matches!(&end, End::Failed(because) if because.contains("refused")), "{end:?}");
    assert_eq!(*modes.lock().expect("no panic"), ["fd_high", "fd_low"]);
    let running = cast.start(call("(look)"));
    let looks = running.clone();
    let end = std::thread::spawn(move || hear(&looks).1);
    detected.publish(std_msgs::msg::Bool { data: false });
    std::thread::sleep(Duration::from_millis(300));
    assert!(!end.is_finished());
    until("the end", || {
        detected.publish(std_msgs::msg::Bool { data: true });
        end.is_finished()
    });
    assert_eq!(end.join().expect("no panic"), End::Succeeded);
}

/// Tests both ends of `actions_hub`: a simulated executor and a simulated performer of PlanSys2.
#[test]
fn actions_go_over_the_hub() {
    let domain = domain();
    let performer = node(domain, "performer", "");
    let (manager, cast) = cast(domain, SETTINGS);
    let begun = Arc::new(Mutex::new(Vec::new()));
    let own = Own { begun: Arc::clone(&begun) };
    offer(&performer, "search", vec![String::new(), "here".to_owned()], Arc::new(own)).expect("an offer");
    let (said, states) = (Arc::new(Mutex::new(Vec::new())), Arc::new(Mutex::new(Vec::new())));
    let list = Arc::clone(&said);
    // A node does not receive its own messages.
    let observer = node(domain, "observer", "");
    observer
        .subscribe::<ActionExecution>("/actions_hub", depth(100), move |message| {
            list.lock().expect("no panic").push(message.r#type);
        })
        .expect("a subscription");
    let list = Arc::clone(&states);
    manager
        .subscribe::<ActionPerformerStatus>("/performers_status", depth(100), move |status| {
            list.lock().expect("no panic").push((status.node_name, status.action, status.state));
        })
        .expect("a subscription");
    let idle = ("performer".to_owned(), "search".to_owned(), ActionPerformerStatus::READY);
    until("a heartbeat", || states.lock().expect("no panic").contains(&idle));
    let (heard, end) = hear(&cast.start(call("(search r1 here)")));
    assert_eq!(heard, [Progress::Feedback { completion: Some(0.5), text: "half".to_owned() }]);
    assert_eq!(end, End::Succeeded);
    let (_, end) = hear(&cast.start(call("(search r2 here)")));
    assert_eq!(end, End::Failed("performer has failed: lost".to_owned()));
    // The action runs until it is cancelled.
    let running = cast.start(call("(search r3 here)"));
    until("the third", || begun.lock().expect("no panic").len() == 3);
    running.cancel();
    assert_eq!(hear(&running).1, End::Canceled);
    let (_, end) = hear(&cast.start(call("(search r1 here)")));
    assert_eq!(end, End::Succeeded);
    // The performer is restricted to a single place.
    let running = cast.start(call("(search r1 there)"));
    std::thread::sleep(Duration::from_millis(1500));
    running.cancel();
    assert_eq!(hear(&running).1, End::Canceled);
    assert_eq!(begun.lock().expect("no panic").len(), 4);
    until("the last word", || said.lock().expect("no panic").last() == Some(&ActionExecution::CANCEL));
    // A late subscriber misses messages of the first action, and messages of two writers are not
    // ordered.
    let said: BTreeSet<i16> = said.lock().expect("no panic").iter().copied().collect();
    let all = [
        ActionExecution::REQUEST,
        ActionExecution::RESPONSE,
        ActionExecution::CONFIRM,
        ActionExecution::FEEDBACK,
        ActionExecution::FINISH,
        ActionExecution::CANCEL,
    ];
    assert_eq!(said, BTreeSet::from(all));
}

#[test]
fn only_the_confirmed_one_of_two_offered_actions_begins() {
    let domain = domain();
    let (performer, executor) = (node(domain, "performer", ""), node(domain, "executor", ""));
    let offered = ["light", "search"].map(|action| {
        let begun = Arc::new(Mutex::new(Vec::new()));
        let own = Own { begun: Arc::clone(&begun) };
        offer(&performer, action, Vec::new(), Arc::new(own)).expect("an offer");
        begun
    });
    let (responses, list) = (Arc::new(Mutex::new(BTreeSet::new())), Arc::new(Mutex::new(Vec::new())));
    let (noted, finished) = (Arc::clone(&responses), Arc::clone(&list));
    executor
        .subscribe::<ActionExecution>("/actions_hub", depth(100), move |message| match message.r#type {
            ActionExecution::RESPONSE => _ = noted.lock().expect("no panic").insert(message.action),
            ActionExecution::FINISH => finished.lock().expect("no panic").push(message.action),
            _ => {}
        })
        .expect("a subscription");
    let hub = executor.publisher::<ActionExecution>("/actions_hub", depth(100)).expect("a topic");
    let send = |r#type: i16, action: &str| {
        let (node_id, arguments) = ("performer".to_owned(), vec!["r1".to_owned()]);
        let action = action.to_owned();
        hub.publish(ActionExecution { r#type, node_id, action, arguments, ..ActionExecution::default() });
    };
    until("both respond", || {
        send(ActionExecution::REQUEST, "light");
        send(ActionExecution::REQUEST, "search");
        responses.lock().expect("no panic").len() == 2
    });
    send(ActionExecution::CONFIRM, "search");
    until("the search is finished", || !list.lock().expect("no panic").is_empty());
    assert_eq!(*list.lock().expect("no panic"), ["search"]);
    assert_eq!(offered.map(|begun| begun.lock().expect("no panic").len()), [0, 1]);
}

/// PlanSys2's executor requests an action that the settings offer. The action changes a mode.
#[test]
fn what_the_settings_offer_is_done_for_plansys2() {
    let domain = domain();
    let (robot, own, executor) =
        (node(domain, "robot", ""), node(domain, "planner", ""), node(domain, "executor", ""));
    robot
        .serve::<ChangeMode>("/f_search/change_mode", |request, answer| {
            answer.send(ChangeModeResponse { success: request.mode_name == "fd_high" });
        })
        .expect("a service");
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("ros.toml");
    let text = "[offers.reconfigure]\nby = \"change_mode\"\nspecialized_arguments = [\"f_search\"]\n\
                [actions.reconfigure]\nby = \"actions_hub\"\n";
    std::fs::write(&file, text).expect("a file");
    let settings = Settings::read(Some(&file), Path::new("mission.toml")).expect("settings");
    offers(&own, &settings.offers, &settings.poses).expect("offers");
    let cast = Cast::new(&executor, &file);
    assert_eq!(hear(&cast.start(call("(reconfigure f_search fd_high)"))).1, End::Succeeded);
    let end = hear(&cast.start(call("(reconfigure f_search fd_low)"))).1;
    assert!(matches!(&end, End::Failed(because) if because.contains("refused")), "{end:?}");
}

struct Own {
    begun: Arc<Mutex<Vec<Call>>>,
}

impl Perform for Own {
    fn start(&self, call: Call) -> Running {
        let (running, performance) = Running::pair();
        self.begun.lock().expect("no panic").push(call.clone());
        smol::spawn(async move {
            performance.feedback(Some(0.5), "half");
            match call.arguments[0].as_str() {
                "r1" => performance.end(End::Succeeded),
                "r2" => performance.end(End::Failed("lost".to_owned())),
                _ => {
                    performance.canceled().await;
                    performance.end(End::Canceled);
                }
            }
        })
        .detach();
        running
    }
}

#[test]
fn plansys2_executes_a_whole_plan() {
    let domain = domain();
    let (robot, manager) = (node(domain, "executor", ""), node(domain, "metaplan", ""));
    let info = |status: i8, completion: f32| ActionExecutionInfo {
        status,
        completion,
        action_full_name: "(go)".to_owned(),
        message_status: "stuck".to_owned(),
        ..ActionExecutionInfo::default()
    };
    let executing = info(ActionExecutionInfo::EXECUTING, 0.25);
    let told = ExecutePlanFeedback { action_execution_status: vec![executing] };
    let failed = info(ActionExecutionInfo::FAILED, 0.5);
    let goals = serve::<ExecutePlan>(&robot, "/execute_plan", told, move |goal: &ExecutePlanGoal| {
        let success = goal.plan.items.len() == 1;
        Some((
            GoalEnd::Succeeded,
            ExecutePlanResult { success, action_execution_status: vec![failed.clone()] },
        ))
    });
    let told = older::ExecutePlanFeedback {
        seq_action: 1,
        total_actions: 4,
        current_action: "(go)".to_owned(),
        progress_current_action: 0.5,
    };
    serve::<older::ExecutePlan>(&robot, "/execute_older", told, |_| {
        let error_info = "no plan".to_owned();
        Some((GoalEnd::Aborted, older::ExecutePlanResult { success: false, error_info }))
    });
    let newer = ExecutePlans::new(&manager, "/execute_plan", PlanVersion::Newer);
    let item = PlanItem { time: 0.0, action: "(go)".to_owned(), duration: 1.0 };
    let plan = Plan { items: vec![item.clone()] };
    assert_eq!(hear(&newer.start(plan.clone())).1, End::Succeeded);
    assert_eq!(goals.lock().expect("no panic")[0].plan, plan);
    let two = Plan { items: vec![item.clone(), item] };
    assert_eq!(hear(&newer.start(two)).1, End::Failed("(go): stuck".to_owned()));
    let older = ExecutePlans::new(&manager, "/execute_older", PlanVersion::Older);
    assert_eq!(hear(&older.start(plan)).1, End::Failed("PlanSys2 has failed: no plan".to_owned()));
}

#[test]
fn settings_that_are_wrong_say_where() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("ros.toml");
    for (text, expected) in [
        ("[actions.a]\nby = \"nav\"\n", "unknown variant `nav`"),
        ("[actions.a]\nby = \"topic\"\n", "missing field `topic`"),
        ("[actions.a]\nby = \"navigate_to_pose\"\nposes = 1\n", "unknown field `poses`"),
        ("[actions.a]\nby = \"navigate_to_pose\"\npose = 0\n", "nonzero"),
        ("[offers.a]\nby = \"change_mode\"\nmode = 1\n", "unknown field `mode`"),
        ("[poses]\nhall = { x = 1 }\n", "missing field `y`"),
    ] {
        std::fs::write(&file, text).expect("a file");
        let error = Settings::read(Some(&file), Path::new("mission.toml")).expect_err("a mistake");
        assert!(error.message.contains(expected), "{}", error.message);
        assert!(error.line.is_some(), "{error:?}");
    }
}
