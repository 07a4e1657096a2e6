//! Topics, services, actions, parameters and lifecycle states between two nodes.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use metaplan_ros::interfaces::lifecycle_msgs::msg::Transition;
use metaplan_ros::interfaces::lifecycle_msgs::srv::{
    ChangeState, ChangeStateRequest, GetState, GetStateRequest,
};
use metaplan_ros::interfaces::mros2_msgs::action::{
    ControlQos, ControlQosFeedback, ControlQosGoal, ControlQosResult,
};
use metaplan_ros::interfaces::rcl_interfaces::srv::{
    GetParameters, GetParametersRequest, ListParameters, ListParametersRequest, SetParameters,
    SetParametersRequest,
};
use metaplan_ros::interfaces::rcl_interfaces::{msg as parameters, msg::ParameterType};
use metaplan_ros::interfaces::std_msgs;
use metaplan_ros::interfaces::suave_msgs::srv::{Task, TaskRequest, TaskResponse};
use metaplan_ros::node::{
    Accepted, Declared, GoalEnd, GoalEvent, Goals, Lifecycle, Node, Phase, depth, latched,
};
use ros2_client::ParameterValue;
use smol::block_on;
use smol::channel::Receiver;

use crate::common::{domain, node, until};

const LONG: Duration = Duration::from_secs(20);

#[test]
fn messages_are_heard_and_rubbish_is_not() {
    let domain = domain();
    let (first, second) = (node(domain, "first", ""), node(domain, "second", "-r /told:=/heard"));
    let heard = Arc::new(Mutex::new(Vec::new()));
    let list = Arc::clone(&heard);
    first
        .subscribe::<std_msgs::msg::String>("/heard", latched(10), move |message| {
            list.lock().expect("no panic").push(message.data);
        })
        .expect("a subscription");
    // Late subscribers receive earlier messages, and names are remapped.
    let told = second.publisher("/told", latched(10)).expect("a publisher");
    for word in ["one", "two"] {
        told.publish(std_msgs::msg::String { data: word.to_owned() });
    }
    until("two words", || heard.lock().expect("no panic").len() == 2);
    // Messages with another type or shape are ignored.
    let third = node(domain, "third", "");
    let wrong = third.publisher::<std_msgs::msg::Float32>("/heard", depth(10)).expect("a publisher");
    std::thread::sleep(Duration::from_millis(500));
    for _ in 0..10 {
        wrong.publish(std_msgs::msg::Float32 { data: 2.0 });
    }
    told.publish(std_msgs::msg::String { data: "three".to_owned() });
    until("the third word", || heard.lock().expect("no panic").len() >= 3);
    assert_eq!(*heard.lock().expect("no panic"), ["one", "two", "three"]);
}

#[test]
fn services_answer_or_it_is_said_why_not() {
    let domain = domain();
    let (server, client) = (node(domain, "server", "-r __ns:=/uuv"), node(domain, "client", ""));
    server
        .serve::<Task>("task/request", |request, answer| {
            if request.task_name != "silence" {
                answer.send(TaskResponse { success: request.task_name == "search_pipeline" });
            }
        })
        .expect("a service");
    let caller = client.caller::<Task>("/uuv/task/request");
    let call = |name: &str, within: Duration| {
        block_on(caller.call(TaskRequest { task_name: name.to_owned() }, within)).map(|answer| answer.success)
    };
    assert_eq!(call("search_pipeline", LONG), Ok(true));
    assert_eq!(call("dance", LONG), Ok(false));
    let error = call("silence", Duration::from_millis(300)).expect_err("no answer").to_string();
    assert!(
        error.contains("no answer from /uuv/task/request after 0.3 s") && error.contains("--rmw"),
        "{error}"
    );
    // A late reply must not be taken as the reply to the next call.
    assert_eq!(call("search_pipeline", LONG), Ok(true));
    let nobody = client.caller::<Task>("/task/cancel");
    let error =
        block_on(nobody.call(TaskRequest::default(), Duration::from_millis(200))).expect_err("nobody");
    assert_eq!(error.to_string(), "/task/cancel has no server after 0.2 s");
    drop(server);
    until("the server is gone", || !caller.is_served());
}

/// Serves the action `/mros/objective`. Returns its goals, and a channel that receives its events.
fn objectives(server: &Arc<Node>) -> (Arc<Goals<ControlQos>>, Receiver<GoalEvent<ControlQos>>) {
    let (sender, events) = smol::channel::unbounded();
    let take = move |event| sender.try_send(event).expect("the test receives");
    (server.serve_action("/mros/objective", take).expect("an action"), events)
}

#[test]
fn goals_are_pursued_cancelled_and_rejected() {
    let domain = domain();
    let (server, client) = (node(domain, "server", ""), node(domain, "client", ""));
    let (goals, events) = objectives(&server);
    let caller = client.action_caller::<ControlQos>("/mros/objective");
    let goal = |name: &str| {
        let mut goal = ControlQosGoal::default();
        name.clone_into(&mut goal.qos_expected.objective_type);
        goal
    };
    // One goal runs to its end, one is rejected, and one is cancelled.
    let pursuing = std::thread::spawn(move || {
        let first = block_on(caller.pursue(goal("f_move"), LONG)).expect("accepted");
        let second = block_on(caller.pursue(goal("nonsense"), LONG));
        let third = block_on(caller.pursue(goal("f_search"), LONG)).expect("accepted");
        third.cancel();
        (first, second, third)
    });
    let mut accepted = Vec::new();
    for wanted in ["f_move", "nonsense", "f_search"] {
        let GoalEvent::Wanted(request, goal) = events.recv_blocking().expect("an event") else {
            panic!("a goal is wanted")
        };
        assert_eq!(goal.qos_expected.objective_type, wanted);
        if wanted == "nonsense" {
            goals.reject(request);
        } else {
            accepted.push(goals.accept(request));
        }
    }
    let GoalEvent::Cancel(goal, request) = events.recv_blocking().expect("an event") else {
        panic!("a goal is to be cancelled")
    };
    assert_eq!(goal, accepted[1]);
    goals.canceling(request, true);
    goals.finish(goal, GoalEnd::Canceled, ControlQosResult::default());
    let (first, second, third) = pursuing.join().expect("no panic");
    assert_eq!(second.expect_err("rejected").to_string(), "/mros/objective has rejected the goal");
    let mut feedback = ControlQosFeedback::default();
    "fd_all".clone_into(&mut feedback.qos_status.selected_mode);
    goals.feedback(accepted[0], feedback.clone());
    assert_eq!(block_on(first.events.recv()), Ok(Accepted::Feedback(feedback)));
    goals.finish(accepted[0], GoalEnd::Succeeded, ControlQosResult::default());
    assert_eq!(
        block_on(first.events.recv()),
        Ok(Accepted::Ended(GoalEnd::Succeeded, ControlQosResult::default()))
    );
    assert_eq!(
        block_on(third.events.recv()),
        Ok(Accepted::Ended(GoalEnd::Canceled, ControlQosResult::default()))
    );
}

/// Returns the next message of a channel, or `None` after [`LONG`].
fn next<T>(messages: &Receiver<T>) -> Option<T> {
    block_on(smol::future::or(async { messages.recv().await.ok() }, async {
        smol::Timer::after(LONG).await;
        None
    }))
}

#[test]
fn a_goal_that_is_accepted_late_is_cancelled() {
    let domain = domain();
    let (server, client) = (node(domain, "server", ""), node(domain, "client", ""));
    let (goals, events) = objectives(&server);
    let caller = client.action_caller::<ControlQos>("/mros/objective");
    // The server is discovered, and does not answer the second goal in time.
    let pursuing = std::thread::spawn(move || {
        let first = block_on(caller.pursue(ControlQosGoal::default(), LONG));
        let second = block_on(caller.pursue(ControlQosGoal::default(), Duration::from_millis(500)));
        (caller, first.expect("accepted"), second.expect_err("no answer").to_string())
    });
    let Some(GoalEvent::Wanted(request, _)) = next(&events) else { panic!("a goal is wanted") };
    let accepted = goals.accept(request);
    let Some(GoalEvent::Wanted(request, _)) = next(&events) else { panic!("a goal is wanted") };
    let (_caller, first, error) = pursuing.join().expect("no panic");
    assert!(error.contains("no answer to a goal after 0.5 s"), "{error}");
    let late = goals.accept(request);
    let Some(GoalEvent::Cancel(goal, _)) = next(&events) else { panic!("a goal is to be cancelled") };
    assert_eq!(goal, late);
    // A goal whose handle is dropped is cancelled, too. The late goal may be cancelled twice.
    drop(first);
    let mut cancelled = std::iter::from_fn(|| match next(&events) {
        Some(GoalEvent::Cancel(goal, _)) => Some(goal),
        _ => None,
    });
    assert_eq!(cancelled.find(|goal| *goal != late), Some(accepted));
}

#[test]
fn a_goal_is_lost_if_its_server_is_replaced() {
    let domain = domain();
    let (server, client) = (node(domain, "server", ""), node(domain, "client", ""));
    let (goals, events) = objectives(&server);
    let caller = client.action_caller::<ControlQos>("/mros/objective");
    let pursuing = std::thread::spawn(move || {
        let pursued = block_on(caller.pursue(ControlQosGoal::default(), LONG)).expect("accepted");
        (caller, pursued)
    });
    let Some(GoalEvent::Wanted(request, _)) = next(&events) else { panic!("a goal is wanted") };
    goals.accept(request);
    let (_caller, pursued) = pursuing.join().expect("no panic");
    // The endpoints of a server that has crashed remain until their lease expires, in addition to those of the next server.
    let respawned = node(domain, "server", "");
    respawned.serve_action::<ControlQos>("/mros/objective", |_| {}).expect("an action");
    let lost = "the server of /mros/objective is gone".to_owned();
    assert_eq!(next(&pursued.events), Some(Accepted::Lost(lost)));
    let Some(GoalEvent::Cancel(..)) = next(&events) else { panic!("a server that goes on is to stop") };
}

#[test]
fn parameters_are_declared_listed_and_set() {
    let domain = domain();
    let (server, client) = (node(domain, "server", "-p period:=2 -p unknown:=1"), node(domain, "client", ""));
    let changes = Arc::new(Mutex::new(Vec::new()));
    let hear = Arc::clone(&changes);
    let declared =
        |name, value, is_dynamic| Declared { name, description: "", value, is_dynamic, check: |_| Ok(()) };
    let warnings = server
        .declare(
            vec![
                declared("period", ParameterValue::Double(1.0), true),
                declared("mission", ParameterValue::String("m".to_owned()), false),
            ],
            move |name, value| hear.lock().expect("no panic").push((name.to_owned(), value.clone())),
        )
        .expect("declared");
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let list = client.caller::<ListParameters>("/server/list_parameters");
    let names = block_on(list.call(ListParametersRequest::default(), LONG)).expect("an answer").result.names;
    assert_eq!(names, ["mission", "period", "use_sim_time"]);
    let get = client.caller::<GetParameters>("/server/get_parameters");
    let values =
        block_on(get.call(GetParametersRequest { names: vec!["period".to_owned()] }, LONG)).expect("values");
    assert_eq!(
        (values.values[0].r#type, values.values[0].double_value),
        (ParameterType::PARAMETER_DOUBLE, 2.0)
    );
    let set = client.caller::<SetParameters>("/server/set_parameters");
    let parameter = |name: &str, double_value| parameters::Parameter {
        name: name.to_owned(),
        value: parameters::ParameterValue {
            r#type: ParameterType::PARAMETER_DOUBLE,
            double_value,
            ..Default::default()
        },
    };
    let request = SetParametersRequest {
        parameters: vec![parameter("period", 3.0), parameter("mission", 1.0), parameter("nothing", 1.0)],
    };
    let results = block_on(set.call(request, LONG)).expect("an answer").results;
    let succeeded: Vec<bool> = results.iter().map(|result| result.successful).collect();
    assert_eq!(succeeded, [true, false, false], "{results:?}");
    assert_eq!(*changes.lock().expect("no panic"), [("period".to_owned(), ParameterValue::Double(3.0))]);
}

#[test]
fn a_managed_node_goes_where_it_is_sent() {
    let domain = domain();
    let (server, client) = (node(domain, "planner", ""), node(domain, "manager", ""));
    let lifecycle = Lifecycle::serve(&server, |phase| phase != Phase::Finalized).expect("states");
    let change = client.caller::<ChangeState>("/planner/change_state");
    let go = |id, label: &str| {
        let transition = Transition { id, label: label.to_owned() };
        block_on(change.call(ChangeStateRequest { transition }, LONG)).expect("an answer").success
    };
    assert!(!go(Transition::TRANSITION_ACTIVATE, ""), "it is not configured");
    assert!(go(Transition::TRANSITION_CONFIGURE, ""));
    assert!(go(0, "activate"));
    assert_eq!(lifecycle.phase(), Phase::Active);
    assert!(!go(Transition::TRANSITION_ACTIVE_SHUTDOWN, ""), "it does not want to");
    let get = client.caller::<GetState>("/planner/get_state");
    let state = block_on(get.call(GetStateRequest::default(), LONG)).expect("an answer").current_state;
    assert_eq!((state.id, state.label.as_str()), (3, "active"));
}
