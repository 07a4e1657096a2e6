//! Tests of the manager while the autopilot has another mode.

use super::*;

/// Lets ten minutes pass in which the robot must not be called.
fn wait_quietly(robot: &mut Robot) {
    let action = robot.machine.control().beliefs().running().map(|(number, _)| number);
    for _ in 0..600 {
        robot.now += Duration::from_secs(1);
        assert_eq!(robot.handle(Input::Tick), []);
    }
    assert_eq!(robot.machine.control().beliefs().running().map(|(number, _)| number), action);
    assert_eq!(robot.machine.state(), State::Execute);
}

#[test]
fn a_task_ends_when_the_autopilot_no_longer_obeys() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    assert_eq!(robot.autopilot("GUIDED"), []);
    assert_eq!(robot.autopilot("MANUAL"), STOP);
    let outputs = robot.handle(Input::Performed(1, Ended::Cancelled));
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
    robot.obey(outputs);
    assert_eq!(robot.machine.state(), State::Idle);
    // In this mode, no task is granted.
    let wait = |number| [Output::Await(number, Duration::from_secs(2))];
    assert_eq!(robot.request("search_pipeline"), wait(2));
    assert_eq!(robot.autopilot("MANUAL"), []);
    let outputs = robot.handle(Input::Overdue(2));
    assert!(matches!(&outputs[..], [Output::Reply(7, false), Output::Warn(_)]), "{outputs:?}");
    assert_eq!(robot.request("search_pipeline"), wait(3));
    assert_eq!(robot.cancel("search_pipeline"), [Output::Reply(7, false), Output::Reply(8, true)]);
    assert_eq!(robot.autopilot("GUIDED"), []);
}

#[test]
fn a_task_waits_for_the_report_that_the_autopilot_obeys() {
    let mut robot = Robot::new(None);
    robot.autopilot("MANUAL");
    robot.request("search_pipeline");
    let outputs = robot.autopilot("GUIDED");
    let outputs = robot.obey(outputs);
    assert_eq!(performed(&outputs), ["search_pipeline"]);
    assert!(outputs.contains(&Output::Reply(7, true)), "{outputs:?}");
    assert_eq!(robot.handle(Input::Overdue(1)), []);
    assert_eq!(robot.machine.state(), State::Execute);
}

#[test]
fn a_task_ends_if_the_autopilot_has_left_its_mode_during_a_restart() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut robot = Robot::new(Some(directory.path()));
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    drop(robot);
    let mut robot = Robot::restarted(directory.path());
    robot.ready(searching);
    let outputs = robot.autopilot("MANUAL");
    assert_eq!(stopped(&outputs), [1], "a node may still perform it");
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
    assert_eq!(performed(&robot.obey(outputs)), Vec::<&str>::new());
    assert_eq!((robot.machine.state(), robot.machine.task()), (State::Idle, None));
}

#[test]
fn no_action_begins_while_the_autopilot_does_not_obey() {
    let (mut robot, outputs) = with_goal_of_problem();
    assert_eq!(performed(&robot.obey(outputs)), ["move"]);
    assert_eq!(robot.autopilot("MANUAL"), [Output::Stop(1)]);
    assert_eq!(robot.autopilot("MANUAL"), [], "it is stopped once");
    let outputs = robot.handle(Input::Performed(1, Ended::Cancelled));
    assert_eq!(performed(&robot.obey(outputs)), Vec::<&str>::new());
    wait_quietly(&mut robot);
    assert_eq!(performed(&robot.autopilot("GUIDED")), ["move"]);
    assert_eq!(robot.autopilot("GUIDED"), [], "it begins once");
    let outputs = robot.handle(Input::Performed(2, Ended::Succeeded));
    let outputs = robot.obey(outputs);
    assert!(matches!(outputs[..], [Output::Perform(3, _)]), "{outputs:?}");
}

#[test]
fn no_action_begins_if_the_autopilot_does_not_obey_at_the_start() {
    let mut robot = waiting_with_goal_of_problem(None);
    assert_eq!(robot.autopilot("MANUAL"), []);
    let outputs = robot.ready(|_| "fd_unground");
    assert_eq!(performed(&robot.obey(outputs)), Vec::<&str>::new());
    wait_quietly(&mut robot);
    assert_eq!(performed(&robot.autopilot("GUIDED")), ["move"]);
}

#[test]
fn an_action_of_the_previous_run_is_stopped_if_the_autopilot_does_not_obey() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut robot = waiting_with_goal_of_problem(Some(directory.path()));
    let outputs = robot.ready(|_| "fd_unground");
    assert_eq!(performed(&robot.obey(outputs)), ["move"]);
    let modes = robot.machine.modes.clone();
    drop(robot);
    let mut robot = waiting_with_goal_of_problem(Some(directory.path()));
    robot.handle(Input::Ready(modes.into_iter().map(|(function, mode)| (function, Some(mode))).collect()));
    assert_eq!(robot.autopilot("MANUAL"), [Output::Stop(1)]);
    let outputs = robot.handle(Input::Performed(1, Ended::Cancelled));
    assert_eq!(performed(&robot.obey(outputs)), Vec::<&str>::new());
    wait_quietly(&mut robot);
    assert_eq!(performed(&robot.autopilot("GUIDED")), ["move"]);
}
