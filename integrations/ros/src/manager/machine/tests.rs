//! Tests of the state machine without a robot: outputs after sequences of inputs.

mod autopilot;

use std::path::Path;
use std::time::Duration;

use metaplan::journal::{Journal, JournalReport, Policy};
use metaplan::mapek::Loop;
use metaplan::setup::Setup;

use crate::manager::machine::{Change, Ended, Input, Machine, Outcome, Output, State};
use crate::manager::settings::Settings;

const PATH: &str = "f_generate_search_path";
const MOTION: &str = "f_maintain_motion";
const RECHARGE: &str = "generate_recharge_path";

/// Outputs that stop the first action when its task ends.
const STOP: [Output; 2] = [Output::Stop(1), Output::Await(1, Duration::from_secs(3))];

struct Robot {
    machine: Machine,
    now: Duration,
}

fn control() -> (Loop, Settings) {
    control_of("suave/suave.toml")
}

fn control_of(example: &str) -> (Loop, Settings) {
    let mission = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(example);
    let setup = Setup::read(&mission).expect("the mission is read");
    let settings = Settings::read(None, &mission).expect("settings");
    (Loop::new(setup.mission, setup.settings).expect("it can be planned for"), settings)
}

impl Robot {
    /// Creates a machine whose functions reply and have no design.
    fn new(journal: Option<&Path>) -> Self {
        Self::found(journal, |_| "fd_unground")
    }

    fn found(journal: Option<&Path>, mode: impl Fn(&str) -> &'static str) -> Self {
        let (control, settings) = control();
        Self::with(control, settings, journal, mode)
    }

    fn with(
        control: Loop,
        settings: Settings,
        journal: Option<&Path>,
        mode: impl Fn(&str) -> &'static str,
    ) -> Self {
        let mut robot = Self::waiting(control, settings, journal);
        robot.ready(mode);
        robot
    }

    fn waiting(mut control: Loop, settings: Settings, journal: Option<&Path>) -> Self {
        let journal =
            journal.map(|path| Journal::open(path, Policy::default(), &mut control).expect("a journal").0);
        let robot = Self { machine: Machine::new(control, journal, settings), now: Duration::ZERO };
        assert_eq!(robot.machine.state(), State::WaitGraph);
        robot
    }

    fn ready(&mut self, mode: impl Fn(&str) -> &'static str) -> Vec<Output> {
        let functions = self.machine.functions().iter();
        let modes = functions.map(|name| (name.clone(), Some(mode(name).to_owned()))).collect();
        self.handle(Input::Ready(modes))
    }

    /// Creates a machine that waits for its functions after a restart during the task of another one.
    fn restarted(journal: &Path) -> Self {
        let (control, settings) = control();
        Self::waiting(control, settings, Some(journal))
    }

    /// Handles an input and returns the outputs other than events and plans.
    fn handle(&mut self, input: Input) -> Vec<Output> {
        self.now += Duration::from_millis(10);
        let outputs = self.machine.handle(input, self.now).expect("a journal that can be written");
        outputs.into_iter().filter(|output| !matches!(output, Output::Event(_) | Output::Plan(_))).collect()
    }

    fn answer(&mut self, output: &Output, outcome: Outcome) -> Vec<Output> {
        let Output::Change(change) = output else { panic!("{output:?} is not a change") };
        self.handle(Input::Changed(change.clone(), outcome))
    }

    fn obey(&mut self, outputs: Vec<Output>) -> Vec<Output> {
        let mut open = outputs;
        while let Some(at) = open.iter().position(|output| matches!(output, Output::Change(_))) {
            let change = open.remove(at);
            open.extend(self.answer(&change, Outcome::Done));
        }
        open
    }

    fn request(&mut self, task: &str) -> Vec<Output> {
        self.handle(Input::Request(7, task.to_owned()))
    }

    fn cancel(&mut self, task: &str) -> Vec<Output> {
        self.handle(Input::Cancel(8, task.to_owned()))
    }

    fn autopilot(&mut self, mode: &str) -> Vec<Output> {
        self.handle(Input::Autopilot(mode.to_owned()))
    }

    fn report(&mut self, component: &str, status: &str) -> Vec<Output> {
        self.handle(Input::Line(format!(
            r#"{{"event":"component_status","component":"{component}","status":"{status}"}}"#
        )))
    }

    fn measure(&mut self, attribute: &str, value: &str) -> Vec<Output> {
        self.handle(Input::Line(format!(
            r#"{{"event":"measured","attribute":"{attribute}","value":{value}}}"#
        )))
    }
}

fn changes(outputs: &[Output]) -> Vec<(&str, &str)> {
    let mut changes = Vec::new();
    for output in outputs {
        if let Output::Change(Change { function, mode, .. }) = output {
            changes.push((function.as_str(), mode.as_str()));
        }
    }
    changes.sort_unstable();
    changes
}

fn performed(outputs: &[Output]) -> Vec<&str> {
    let mut actions = Vec::new();
    for output in outputs {
        if let Output::Perform(_, call) = output {
            actions.push(call.action.as_str());
        }
    }
    actions
}

fn stopped(outputs: &[Output]) -> Vec<u64> {
    let mut actions = Vec::new();
    for output in outputs {
        if let Output::Stop(number) = output {
            actions.push(*number);
        }
    }
    actions
}

#[test]
fn a_task_is_granted_when_its_functions_have_their_designs() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_high"), (MOTION, "fd_all_thrusters")]);
    assert_eq!(robot.machine.state(), State::Reconfigure);
    let first = robot.answer(&outputs[0], Outcome::Done);
    assert_eq!(first, [], "one of two has answered");
    let last = robot.answer(&outputs[1], Outcome::Done);
    assert_eq!(performed(&last), ["search_pipeline"]);
    assert!(last.contains(&Output::Reply(7, true)), "{last:?}");
    assert_eq!(robot.machine.state(), State::Execute);
    // The end of the task withdraws all designs. The client receives the reply when this is done.
    assert_eq!(robot.cancel("search_pipeline"), STOP);
    let outputs = robot.handle(Input::Performed(1, Ended::Cancelled));
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
    let outputs = robot.obey(outputs);
    assert!(outputs.contains(&Output::Reply(8, true)), "{outputs:?}");
    assert_eq!(robot.machine.state(), State::Idle);
}

/// Creates a robot that searches, and whose performer was requested to stop because the task was cancelled.
fn stopping(journal: Option<&Path>) -> Robot {
    let mut robot = Robot::new(journal);
    let outputs = robot.request("search_pipeline");
    assert_eq!(performed(&robot.obey(outputs)), ["search_pipeline"]);
    assert_eq!(robot.cancel("search_pipeline"), STOP);
    robot
}

#[test]
fn functions_keep_their_designs_until_the_action_of_a_cancelled_task_has_ended() {
    let failed = || Ended::Failed("its server has aborted the goal".to_owned());
    for ended in [Ended::Succeeded, Ended::Cancelled, failed()] {
        let mut robot = stopping(None);
        robot.now += Duration::from_secs(2);
        assert_eq!(robot.handle(Input::Tick), []);
        assert_eq!(robot.machine.state(), State::Execute);
        let outputs = robot.handle(Input::Performed(1, ended));
        assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
        let outputs = robot.obey(outputs);
        assert_eq!(outputs, [Output::Reply(8, true)]);
        assert_eq!(robot.machine.state(), State::Idle);
    }
    // The performer does not stop. Its time does not depend on that of the loop, which may be simulated.
    let mut robot = stopping(None);
    robot.now += Duration::from_secs(9);
    assert_eq!(robot.handle(Input::Tick), []);
    assert_eq!(robot.handle(Input::Overdue(0)), [], "an earlier wait");
    assert_eq!(robot.cancel("search_pipeline"), [Output::Stop(1)], "the time begins with the first request");
    let outputs = robot.handle(Input::Overdue(1));
    assert_eq!(outputs[..2], [Output::Reply(8, false), Output::Reply(8, false)]);
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
    robot.obey(outputs);
    assert_eq!(robot.machine.state(), State::Idle);
    assert_eq!(robot.handle(Input::Performed(1, failed())), []);
}

#[test]
fn a_new_task_waits_for_the_end_of_the_cancelled_action() {
    let mut robot = stopping(None);
    let outputs = robot.request("inspect_pipeline");
    assert_eq!(performed(&robot.obey(outputs)), Vec::<&str>::new());
    let outputs = robot.handle(Input::Overdue(1));
    assert_eq!(performed(&robot.obey(outputs)), Vec::<&str>::new());
    let outputs = robot.handle(Input::Performed(1, Ended::Cancelled));
    assert_eq!(performed(&robot.obey(outputs)), ["inspect_pipeline"]);
}

#[test]
fn a_cancelled_task_does_not_inherit_the_time_of_the_previous_one() {
    let mut robot = stopping(None);
    let outputs = robot.request("inspect_pipeline");
    robot.obey(outputs);
    let outputs = robot.cancel("inspect_pipeline");
    assert!(outputs.contains(&Output::Await(2, Duration::from_secs(3))), "{outputs:?}");
    assert_eq!(robot.handle(Input::Overdue(1)), [], "the wait of the previous task");
    let outputs = robot.handle(Input::Performed(1, Ended::Cancelled));
    let outputs = robot.obey(outputs);
    assert!(outputs.contains(&Output::Reply(8, true)), "{outputs:?}");
}

#[test]
fn the_action_of_a_cancelled_task_is_not_repeated_after_a_restart() {
    let directory = tempfile::tempdir().expect("a directory");
    drop(stopping(Some(directory.path())));
    let mut robot = Robot::restarted(directory.path());
    let mut outputs = robot.ready(searching);
    robot.now += Duration::from_secs(4);
    outputs.extend(robot.handle(Input::Tick));
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
    assert_eq!(performed(&robot.obey(outputs)), Vec::<&str>::new());
    assert_eq!((robot.machine.state(), robot.machine.task()), (State::Idle, None));
}

#[test]
fn an_unknown_task_is_refused() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipline");
    assert!(
        matches!(&outputs[..], [Output::Reply(7, false), Output::Warn(text)] if text.contains("did you mean `search_pipeline`"))
    );
    assert_eq!(robot.machine.state(), State::Idle);
}

#[test]
fn a_stimulus_changes_the_mode_that_it_concerns() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let outputs = robot.measure("water_visibility", "2.3");
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_medium")]);
    // It becomes darker before the reply arrives: only the last mode is valid.
    let darker = robot.measure("water_visibility", "1.3");
    assert_eq!(changes(&darker), [(PATH, "fd_spiral_low")]);
    assert_eq!(robot.answer(&outputs[0], Outcome::Done), [], "a late reply must be ignored");
    assert_eq!(robot.machine.state(), State::Reconfigure);
    robot.obey(darker);
    assert_eq!(robot.machine.state(), State::Execute);
    // Too dark for all designs: no mode is changed, and the state is reported.
    let outputs = robot.measure("water_visibility", "1");
    assert_eq!(changes(&outputs), []);
    assert_eq!(robot.machine.state(), State::Degraded);
    let outputs = robot.measure("water_visibility", "4");
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_high")]);
}

#[test]
fn a_design_that_is_refused_is_replaced_and_tried_again_a_minute_later() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    let path = outputs
        .iter()
        .position(|output| matches!(output, Output::Change(output) if output.function == PATH))
        .expect("a change");
    let next = robot.answer(&outputs[path], Outcome::Refused);
    assert_eq!(changes(&next), [(PATH, "fd_spiral_medium")]);
    assert!(next.contains(&Output::Look(PATH.to_owned())), "{next:?}");
    let mut remaining: Vec<Output> =
        outputs.into_iter().enumerate().filter(|(at, _)| *at != path).map(|(_, output)| output).collect();
    remaining.extend(next);
    let outputs = robot.obey(remaining);
    assert!(outputs.contains(&Output::Reply(7, true)), "{outputs:?}");
    robot.now += Duration::from_secs(59);
    assert_eq!(changes(&robot.handle(Input::Tick)), []);
    robot.now += Duration::from_secs(2);
    assert_eq!(changes(&robot.handle(Input::Tick)), [(PATH, "fd_spiral_high")]);
}

#[test]
fn a_function_without_reply_is_called_twice_and_again_once_it_replies() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let first = robot.measure("water_visibility", "1.3");
    let silent = || Outcome::Failed("no answer".to_owned());
    let second = robot.answer(&first[0], silent());
    assert_eq!(changes(&second), [(PATH, "fd_spiral_low")]);
    let again = second.iter().find(|output| matches!(output, Output::Change(_))).expect("once more").clone();
    let third = robot.answer(&again, silent());
    assert_eq!(changes(&third), [], "no other spiral can be flown in the dark");
    let probe = third.iter().find_map(|output| match output {
        Output::Probe(function, wait) => Some((function.clone(), *wait)),
        _ => None,
    });
    assert_eq!(probe, Some((PATH.to_owned(), Duration::from_secs(2))));
    assert_eq!(robot.machine.state(), State::Degraded);
    let outputs = robot.handle(Input::Probed(PATH.to_owned(), false));
    assert!(matches!(&outputs[..], [Output::Probe(..)]), "{outputs:?}");
    let outputs = robot.handle(Input::Probed(PATH.to_owned(), true));
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_low")]);
}

#[test]
fn a_silent_function_has_one_outstanding_probe() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let mut probes = 0;
    for visibility in ["1.3", "2.3"] {
        let mut outputs = robot.measure("water_visibility", visibility);
        for _ in 0..2 {
            let call = outputs.iter().find(|output| matches!(output, Output::Change(_))).expect("a call");
            outputs = robot.answer(&call.clone(), Outcome::Failed("no answer".to_owned()));
            probes += outputs.iter().filter(|output| matches!(output, Output::Probe(..))).count();
        }
    }
    assert_eq!(probes, 1);
}

#[test]
fn a_late_mode_report_is_accepted() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let first = robot.measure("water_visibility", "2.3");
    let silent = || Outcome::Failed("no answer".to_owned());
    let second = robot.answer(&first[0], silent());
    let again = second.iter().find(|output| matches!(output, Output::Change(_))).expect("once more").clone();
    // The function reports its mode although it has not replied.
    let outputs = robot.handle(Input::Mode(PATH.to_owned(), "fd_spiral_medium".to_owned()));
    assert_eq!(changes(&outputs), []);
    assert_eq!(robot.machine.state(), State::Execute);
    assert_eq!(robot.answer(&again, Outcome::Done), [], "it is late");
}

#[test]
fn modes_set_by_other_clients_are_adopted_or_reverted() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    // The report of a requested mode changes nothing.
    assert_eq!(robot.handle(Input::Mode(PATH.to_owned(), "fd_spiral_high".to_owned())), []);
    let outputs = robot.handle(Input::ModeRequested(PATH.to_owned(), "fd_spiral_low".to_owned()));
    assert_eq!(
        changes(&outputs),
        [(PATH, "fd_spiral_high")],
        "it costs more, and nothing is said of a minimum"
    );
    robot.obey(outputs);
    let outputs = robot.handle(Input::Touched(MOTION.to_owned()));
    assert_eq!(outputs, [Output::Look(MOTION.to_owned())]);
    robot.now += Duration::from_secs(2);
    let outputs = robot.handle(Input::Mode(MOTION.to_owned(), "fd_unground".to_owned()));
    assert_eq!(changes(&outputs), [(MOTION, "fd_all_thrusters")], "it is needed");
    // A mode without a design counts as no design.
    let outputs = robot.handle(Input::Mode(RECHARGE.to_owned(), "inactive".to_owned()));
    assert_eq!(changes(&outputs), []);
}

#[test]
fn a_granted_mode_is_requested_once_although_the_old_one_is_reported() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let outputs = robot.measure("water_visibility", "2.3");
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_medium")]);
    robot.obey(outputs);
    // Each change of the node causes an event, after which the observer of `system_modes` still has the old mode.
    let reported_mode = |mode: &str| Input::Mode(PATH.to_owned(), mode.to_owned());
    for _ in 0..20 {
        assert_eq!(robot.handle(reported_mode("fd_spiral_high")), []);
    }
    let late = Input::ModeRequested(PATH.to_owned(), "fd_spiral_high".to_owned());
    assert_eq!(robot.handle(late), [], "our own request before this one");
    robot.now += Duration::from_secs(2);
    assert_eq!(robot.handle(Input::Tick), [Output::Look(PATH.to_owned())], "asked again after the period");
    let outputs = robot.handle(reported_mode("fd_spiral_high"));
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_medium")], "it really has another mode");
}

#[test]
fn a_request_of_another_client_is_believed_at_once() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let outputs = robot.handle(Input::ModeRequested(MOTION.to_owned(), "fd_recover_thrusters".to_owned()));
    assert_eq!(changes(&outputs), [(MOTION, "fd_all_thrusters")]);
}

#[test]
fn a_low_battery_interrupts_the_task_for_recharging() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let outputs = robot.measure("battery_level", "0.2");
    let Some(Output::Stop(action)) = outputs.iter().find(|output| matches!(output, Output::Stop(_))) else {
        panic!("{outputs:?}")
    };
    let outputs = robot.handle(Input::Performed(*action, Ended::Cancelled));
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (RECHARGE, "normal")]);
    let outputs = robot.obey(outputs);
    assert_eq!(performed(&outputs), ["recharge"]);
    let outputs = robot.handle(Input::Performed(2, Ended::Succeeded));
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_high"), (RECHARGE, "fd_unground")]);
    let outputs = robot.obey(outputs);
    assert_eq!(performed(&outputs), ["search_pipeline"]);
    // The goal is reached: no function is needed any more.
    let outputs = robot.handle(Input::Performed(3, Ended::Succeeded));
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
    robot.obey(outputs);
    assert_eq!((robot.machine.state(), robot.machine.task()), (State::Idle, None));
}

/// Creates a machine for the goal of a problem, and returns it with the outputs of its start. Its settings have a task
/// and an autopilot, too.
fn with_goal_of_problem() -> (Robot, Vec<Output>) {
    let mut robot = waiting_with_goal_of_problem(None);
    let outputs = robot.ready(|_| "fd_unground");
    (robot, outputs)
}

fn waiting_with_goal_of_problem(journal: Option<&Path>) -> Robot {
    let autopilot = "[autopilot]\ntopic = \"/state\"\nmode = \"GUIDED\"\n";
    let task = "[tasks.round]\ngoal = \"(inspected shelf_1)\"\n";
    let settings = extended("nav2/mission.toml", &[autopilot, task].concat());
    Robot::waiting(control_of("nav2/mission.toml").0, settings, journal)
}

#[test]
fn functions_are_not_needed_after_the_goal_of_the_problem_is_reached() {
    let (mut robot, mut outputs) = with_goal_of_problem();
    let mut actions = 0;
    while performed(&robot.obey(outputs)).len() == 1 {
        actions += 1;
        outputs = robot.handle(Input::Performed(actions, Ended::Succeeded));
    }
    assert_eq!((actions, robot.machine.state()), (7, State::Idle));
    let modes = &robot.machine.modes;
    assert!(modes.values().all(|mode| mode == "fd_unground"), "{modes:?}");
}

#[test]
fn the_cancellation_of_a_task_does_not_concern_the_goal_of_the_problem() {
    let (mut robot, outputs) = with_goal_of_problem();
    robot.obey(outputs);
    assert_eq!(robot.cancel("round"), [Output::Reply(8, true)]);
    assert_eq!(robot.machine.state(), State::Execute);
    for component in ["c_lidar", "c_camera"] {
        let outputs = robot.report(component, "FALSE");
        robot.obey(outputs);
    }
    robot.handle(Input::Performed(1, Ended::Cancelled));
    assert_eq!(robot.machine.state(), State::Degraded);
    assert_eq!(robot.cancel("round"), [Output::Reply(8, true)]);
    assert_eq!(robot.machine.state(), State::Degraded);
}

#[test]
fn a_restart_repeats_no_fulfilled_request() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut robot = Robot::new(Some(directory.path()));
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let outputs = robot.measure("water_visibility", "2.3");
    // The program ends before the reply, but the function has changed its mode.
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_medium")]);
    drop(robot);
    let mode = |path: &'static str| {
        move |function: &str| match function {
            PATH => path,
            MOTION => "fd_all_thrusters",
            _ => "fd_unground",
        }
    };
    let mut robot = Robot::found(Some(directory.path()), mode("fd_spiral_medium"));
    assert_eq!(robot.machine.task(), Some("search_pipeline"));
    assert_eq!(changes(&robot.measure("water_visibility", "2.4")), []);
    assert_eq!(robot.machine.state(), State::Execute);
    assert_eq!(robot.machine.control().beliefs().outstanding().count(), 0);
    drop(robot);
    // Another client has chosen a lower altitude, which the visibility does not require. This is
    // evaluated after a time without diagnostics.
    let mut robot = Robot::found(Some(directory.path()), mode("fd_spiral_low"));
    assert_eq!(changes(&robot.handle(Input::Tick)), []);
    robot.now += Duration::from_secs(4);
    assert_eq!(changes(&robot.handle(Input::Tick)), [(PATH, "fd_spiral_medium")]);
    drop(robot);
    // The water has become darker, and another client has already adapted the mode.
    let mut robot = Robot::found(Some(directory.path()), mode("fd_spiral_low"));
    assert_eq!(changes(&robot.measure("water_visibility", "1.3")), []);
    drop(robot);
    let report = JournalReport::read(directory.path()).expect("a report");
    let text = format!("{report:?}");
    assert!(text.contains("WAIT_GRAPH -> IDLE: every function answers"), "{text}");
    assert!(text.contains("IDLE -> PLAN -> RECONFIGURE: the task search_pipeline is requested"), "{text}");
}

fn searching(function: &str) -> &'static str {
    match function {
        PATH => "fd_spiral_high",
        MOTION => "fd_all_thrusters",
        _ => "fd_unground",
    }
}

#[test]
fn a_degraded_robot_goes_on_when_a_component_has_healed() {
    let (control, settings) = control_of("nav2/mission.toml");
    let mut robot = Robot::with(control, settings, None, |_| "fd_unground");
    for component in ["c_lidar", "c_camera"] {
        robot.report(component, "FALSE");
        let pending: Vec<Output> = robot.machine.pending.values().cloned().map(Output::Change).collect();
        robot.obey(pending);
    }
    assert_eq!(robot.machine.state(), State::Degraded);
    robot.report("c_lidar", "TRUE");
    assert_eq!(robot.machine.state(), State::Degraded, "the report must last");
    robot.now += Duration::from_secs(3);
    let outputs = robot.handle(Input::Tick);
    robot.obey(outputs);
    assert_eq!(robot.machine.state(), State::Execute);
}

#[test]
fn an_action_that_is_suspended_is_stopped() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let outputs = robot.measure("water_visibility", "1");
    assert_eq!(outputs.iter().filter(|output| matches!(output, Output::Stop(1))).count(), 1, "{outputs:?}");
    assert_eq!(robot.measure("water_visibility", "0.9"), [], "it is stopped once");
    robot.handle(Input::Performed(1, Ended::Cancelled));
    assert_eq!(robot.machine.state(), State::Degraded);
    let outputs = robot.measure("water_visibility", "4");
    assert_eq!(performed(&robot.obey(outputs)), ["search_pipeline"]);
}

#[test]
fn a_mode_whose_task_has_ended_is_not_requested_again() {
    let mut robot = Robot::new(None);
    let outputs = robot.request("search_pipeline");
    let path = outputs
        .iter()
        .find(|output| matches!(output, Output::Change(change) if change.function == PATH))
        .expect("a change");
    robot.answer(path, Outcome::Done);
    // The motion has not answered yet.
    let outputs = robot.cancel("search_pipeline");
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
    robot.obey(outputs);
    assert_eq!(robot.machine.control().beliefs().outstanding().count(), 0);
    robot.now += Duration::from_secs(30);
    assert_eq!(changes(&robot.measure("water_visibility", "3.4")), []);
    assert_eq!(robot.machine.state(), State::Idle);
}

#[test]
fn a_task_that_is_cancelled_before_the_functions_are_found_is_not_carried_out() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut robot = Robot::new(Some(directory.path()));
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    drop(robot);
    let mut robot = Robot::restarted(directory.path());
    assert_eq!(robot.cancel("search_pipeline"), []);
    let outputs = robot.ready(searching);
    assert_eq!(performed(&outputs), Vec::<&str>::new());
    assert_eq!(stopped(&outputs), [1], "a node may still perform it");
    assert_eq!(changes(&outputs), [(PATH, "fd_unground"), (MOTION, "fd_unground")]);
    let outputs = robot.obey(outputs);
    assert!(outputs.contains(&Output::Reply(8, true)), "{outputs:?}");
    robot.now += Duration::from_secs(4);
    robot.handle(Input::Tick);
    let configuration = robot.machine.control().beliefs().configuration();
    assert!(configuration.get(PATH).is_none() && configuration.get(MOTION).is_none(), "{configuration:?}");
}

#[test]
fn an_action_that_was_being_cancelled_is_not_repeated_after_a_restart() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut robot = Robot::new(Some(directory.path()));
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    let outputs = robot.measure("battery_level", "0.2");
    assert!(outputs.iter().any(|output| matches!(output, Output::Stop(_))), "{outputs:?}");
    // The program ends before the performer has reported the end.
    drop(robot);
    let mut robot = Robot::restarted(directory.path());
    let mut outputs = robot.ready(searching);
    robot.now += Duration::from_secs(4);
    outputs.extend(robot.handle(Input::Tick));
    assert_eq!(stopped(&outputs), [1], "a node may still perform it");
    assert_eq!(performed(&robot.obey(outputs)), ["recharge"]);
}

#[test]
fn an_action_is_performed_after_a_restart_once_its_functions_have_their_designs() {
    // All functions have lost their modes, as after a power cycle, or have kept them.
    for (modes, expected) in [
        (
            (|_| "fd_unground") as fn(&str) -> &'static str,
            &[(PATH, "fd_spiral_high"), (MOTION, "fd_all_thrusters")][..],
        ),
        (searching, &[]),
    ] {
        let directory = tempfile::tempdir().expect("a directory");
        let mut robot = Robot::new(Some(directory.path()));
        let outputs = robot.request("search_pipeline");
        assert_eq!(performed(&robot.obey(outputs)), ["search_pipeline"]);
        drop(robot);
        let mut robot = Robot::restarted(directory.path());
        let outputs = robot.ready(modes);
        assert_eq!((performed(&outputs), changes(&outputs)), (vec![], vec![]), "diagnostics may be new");
        robot.now += Duration::from_secs(4);
        let outputs = robot.handle(Input::Tick);
        assert_eq!(changes(&outputs), expected);
        assert_eq!(performed(&outputs).is_empty(), !expected.is_empty(), "{outputs:?}");
        assert_eq!(performed(&robot.obey(outputs)), ["search_pipeline"]);
        assert_eq!(performed(&robot.handle(Input::Tick)), Vec::<&str>::new(), "once");
        let outputs = robot.handle(Input::Performed(1, Ended::Succeeded));
        robot.obey(outputs);
        assert_eq!(robot.machine.state(), State::Idle);
    }
}

/// Reads the settings of an example with further tables.
fn extended(example: &str, tables: &str) -> Settings {
    let mission = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(example);
    let text = std::fs::read_to_string(mission.with_file_name("ros.toml")).expect("settings");
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("ros.toml");
    std::fs::write(&file, format!("{text}\n{tables}")).expect("written");
    Settings::read(Some(&file), &mission).expect("settings")
}

/// Creates a machine whose spiral has steps for its designs, but none for the time when it is not needed.
fn with_steps() -> Robot {
    let mut text = String::new();
    for design in ["fd_spiral_high", "fd_spiral_medium", "fd_spiral_low"] {
        let step = format!("{{ node = \"/{design}\", state = \"active\" }}");
        text.extend([format!("\n[functions.{PATH}.designs.{design}]\nsteps = [{step}]\n")]);
    }
    let settings = extended("suave/suave.toml", &text);
    Robot::with(control().0, settings, None, |function| if function == PATH { "" } else { "fd_unground" })
}

#[test]
fn failed_steps_are_replaced_by_another_design_at_once_and_tried_again_later() {
    let mut robot = with_steps();
    let outputs = robot.request("search_pipeline");
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_high"), (MOTION, "fd_all_thrusters")]);
    let is_path = |output: &Output| matches!(output, Output::Change(change) if change.function == PATH);
    let first = outputs.iter().find(|output| is_path(output)).expect("a change").clone();
    let next = robot.answer(&first, Outcome::StepFailed("/fd_spiral_high has refused".to_owned()));
    assert_eq!(changes(&next), [(PATH, "fd_spiral_medium")]);
    // A node without an answer is not called twice, because the steps have waited for it.
    let second = next.iter().find(|output| is_path(output)).expect("a change").clone();
    let next = robot.answer(&second, Outcome::Failed("no answer".to_owned()));
    assert_eq!(changes(&next), [(PATH, "fd_spiral_low")]);
    assert!(next.iter().any(|output| matches!(output, Output::Probe(function, _) if function == PATH)));
    let outputs = robot.handle(Input::Probed(PATH.to_owned(), true));
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_medium")]);
}

#[test]
fn a_mode_that_is_seen_does_not_end_running_steps() {
    let mut robot = with_steps();
    let outputs = robot.request("search_pipeline");
    assert_eq!(robot.handle(Input::Mode(PATH.to_owned(), "fd_spiral_high".to_owned())), []);
    assert_eq!(robot.machine.state(), State::Reconfigure);
    robot.obey(outputs);
    assert_eq!(robot.machine.state(), State::Execute);
    // The node fails later.
    robot.now += Duration::from_secs(3);
    robot.handle(Input::Tick);
    let outputs = robot.handle(Input::Mode(PATH.to_owned(), String::new()));
    assert_eq!(changes(&outputs), [(PATH, "fd_spiral_high")]);
}

#[test]
fn a_function_without_steps_for_its_idle_time_keeps_its_design() {
    let mut robot = with_steps();
    let outputs = robot.request("search_pipeline");
    robot.obey(outputs);
    robot.cancel("search_pipeline");
    let outputs = robot.handle(Input::Performed(1, Ended::Cancelled));
    assert_eq!(changes(&outputs), [(MOTION, "fd_unground")]);
    let outputs = robot.obey(outputs);
    assert!(outputs.contains(&Output::Reply(8, true)), "{outputs:?}");
}

#[test]
fn a_design_is_requested_again_after_steps_that_were_not_undone() {
    for (is_undone, expected) in [(true, &[][..]), (false, &[(PATH, "fd_spiral_medium")])] {
        let mut robot = with_steps();
        let outputs = robot.request("search_pipeline");
        let is_path = |output: &Output| matches!(output, Output::Change(change) if change.function == PATH);
        let high = outputs.iter().find(|output| is_path(output)).expect("a change").clone();
        let mut remaining: Vec<Output> = outputs.into_iter().filter(|output| !is_path(output)).collect();
        let failed = || Outcome::StepFailed("/fd_spiral_high has refused".to_owned());
        remaining.extend(robot.answer(&high, failed()));
        assert_eq!(performed(&robot.obey(remaining)), ["search_pipeline"]);
        // The medium spiral is in effect, and the high one is tried again.
        robot.now += Duration::from_secs(61);
        let outputs = robot.handle(Input::Tick);
        assert_eq!(changes(&outputs), [(PATH, "fd_spiral_high")]);
        let high = outputs.iter().find(|output| is_path(output)).expect("a change").clone();
        let outcome = if is_undone { failed() } else { Outcome::NoMode(Box::new(failed())) };
        let outputs = robot.answer(&high, outcome);
        assert_eq!(changes(&outputs), expected);
        assert_eq!(robot.machine.state(), if is_undone { State::Execute } else { State::Reconfigure });
        robot.obey(outputs);
        assert_eq!(robot.machine.state(), State::Execute);
        let configuration = robot.machine.control().beliefs().configuration();
        assert_eq!(configuration.get(PATH).map(String::as_str), Some("fd_spiral_medium"));
    }
}
