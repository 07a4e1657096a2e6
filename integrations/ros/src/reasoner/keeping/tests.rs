//! Tests of the reasoner without a robot: expected outputs after sequences of inputs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use metaplan::configure::{Configurator, Keeper, Wishes};
use metaplan::setup::Setup;
use ros2_client::action::GoalId;

use crate::interfaces::mros2_msgs::msg::QoS;
use crate::manager::Settings;
use crate::reasoner::keeping::{Keeping, Outcome, Output, Wanted};
use crate::reasoner::memory::MemoryFile;

const PATH: &str = "f_generate_search_path";

fn keeping() -> Keeping {
    let mission = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/suave/suave.toml");
    let settings = Settings::read(None, &mission).expect("settings");
    let mission = Setup::read(&mission).expect("the mission is read").mission;
    let knowledge = mission.knowledge().cloned().expect("a knowledge base");
    let configurator = Configurator::new(knowledge, Wishes::default()).expect("designs");
    Keeping::new(Keeper::new(configurator, None), settings.functions)
}

fn wanted(function: &str) -> QoS {
    QoS { objective_type: function.to_owned(), always_improve: true, ..QoS::default() }
}

fn requested_modes(keeping: &mut Keeping) -> Vec<Wanted> {
    let mut requested = Vec::new();
    for output in keeping.outputs() {
        if let Output::Configure(wanted) = output {
            requested.push(wanted);
        }
    }
    requested
}

fn modes(requested: &[Wanted]) -> Vec<&str> {
    requested.iter().map(|wanted| wanted.mode.as_str()).collect()
}

fn see(keeping: &mut Keeping, metres: &str) -> Vec<Wanted> {
    keeping
        .handle_line(&format!(r#"{{"event":"measured","attribute":"water_visibility","value":{metres}}}"#));
    requested_modes(keeping)
}

const NOW: Duration = Duration::from_secs(100);

#[test]
fn an_objective_has_the_best_design_until_it_ends() {
    let (mut keeping, goal) = (keeping(), GoalId::new_random());
    assert!(keeping.refused(&wanted("f_fly")).is_some_and(|text| text.contains("`f_fly`")));
    assert_eq!(keeping.refused(&wanted(PATH)), None);
    keeping.pursue(goal, &wanted(PATH));
    let first = requested_modes(&mut keeping);
    assert_eq!(modes(&first), ["fd_spiral_high"]);
    keeping.answered(&first[0], Outcome::Done, NOW);
    let outputs = keeping.outputs();
    let is_selected = |output: &Output| matches!(output, Output::Feedback(_, feedback) if feedback.selected_mode == "fd_spiral_high");
    assert!(outputs.iter().any(is_selected), "{outputs:?}");
    let darker = see(&mut keeping, "2.3");
    assert_eq!(modes(&darker), ["fd_spiral_medium"]);
    keeping.answered(&darker[0], Outcome::Done, NOW);
    keeping.cancel(goal);
    let end = requested_modes(&mut keeping);
    assert_eq!(modes(&end), ["fd_unground"]);
    keeping.answered(&end[0], Outcome::Refused, NOW);
    assert!(keeping.outputs().contains(&Output::Cancelled(goal, false)), "it keeps its design");
    keeping.cancel(goal);
    let end = requested_modes(&mut keeping);
    keeping.answered(&end[0], Outcome::Done, NOW);
    assert!(keeping.outputs().contains(&Output::Cancelled(goal, true)));
    assert_eq!(see(&mut keeping, "4"), [], "an unused function must not be reconfigured");
}

#[test]
fn a_design_that_is_refused_is_replaced_and_tried_again() {
    let mut keeping = keeping();
    keeping.pursue(GoalId::new_random(), &wanted(PATH));
    let first = requested_modes(&mut keeping);
    keeping.answered(&first[0], Outcome::Refused, NOW);
    let next = requested_modes(&mut keeping);
    assert_eq!(modes(&next), ["fd_spiral_medium"]);
    keeping.answered(&next[0], Outcome::Done, NOW);
    keeping.tick(NOW + Duration::from_secs(59));
    assert_eq!(requested_modes(&mut keeping), []);
    keeping.tick(NOW + Duration::from_secs(61));
    assert_eq!(modes(&requested_modes(&mut keeping)), ["fd_spiral_high"]);
}

#[test]
fn a_design_is_requested_again_after_steps_that_were_not_undone() {
    for is_undone in [true, false] {
        let (mut keeping, goal) = (keeping(), GoalId::new_random());
        keeping.pursue(goal, &wanted(PATH));
        let first = requested_modes(&mut keeping);
        keeping.answered(&first[0], Outcome::Done, NOW);
        let darker = see(&mut keeping, "1.3");
        assert_eq!(modes(&darker), ["fd_spiral_low"]);
        keeping.answered(&darker[0], Outcome::StepFailed("it is stuck".to_owned()), NOW);
        if !is_undone {
            keeping.lose_design(PATH);
        }
        assert_eq!(requested_modes(&mut keeping), [], "no other spiral can be flown in the dark");
        let design = is_undone.then(|| "fd_spiral_high".to_owned());
        assert_eq!(keeping.memory().goals[0].design, design);
        let expected = if is_undone { &[][..] } else { &["fd_spiral_high"] };
        assert_eq!(modes(&see(&mut keeping, "4")), expected);
    }
}

#[test]
fn a_design_required_during_a_cancellation_does_not_replace_it() {
    for outcome in [Outcome::Done, Outcome::Refused] {
        let (mut keeping, goal) = (keeping(), GoalId::new_random());
        keeping.pursue(goal, &wanted(PATH));
        let first = requested_modes(&mut keeping);
        keeping.answered(&first[0], Outcome::Done, NOW);
        keeping.cancel(goal);
        let end = requested_modes(&mut keeping);
        assert_eq!(modes(&end), ["fd_unground"]);
        assert_eq!(see(&mut keeping, "2.3"), []);
        let is_done = outcome == Outcome::Done;
        keeping.answered(&end[0], outcome, NOW);
        let outputs = keeping.outputs();
        assert!(outputs.contains(&Output::Cancelled(goal, is_done)), "{outputs:?}");
        let is_medium = |output: &Output| matches!(output, Output::Configure(wanted) if wanted.mode == "fd_spiral_medium");
        assert_eq!(outputs.iter().any(is_medium), !is_done, "{outputs:?}");
    }
}

#[test]
fn a_function_keeps_its_design_until_its_last_objective_ends() {
    let (mut keeping, goals) = (keeping(), [GoalId::new_random(), GoalId::new_random()]);
    for goal in goals {
        keeping.pursue(goal, &wanted(PATH));
        for requested in requested_modes(&mut keeping) {
            keeping.answered(&requested, Outcome::Done, NOW);
        }
    }
    keeping.cancel(goals[0]);
    let outputs = keeping.outputs();
    assert!(outputs.contains(&Output::Cancelled(goals[0], true)), "{outputs:?}");
    assert!(!outputs.iter().any(|output| matches!(output, Output::Configure(_))), "{outputs:?}");
    keeping.cancel(goals[1]);
    assert_eq!(modes(&requested_modes(&mut keeping)), ["fd_unground"]);
}

#[test]
fn automatic_names_differ_from_those_before_a_restart() {
    let goals = [GoalId::new_random(), GoalId::new_random(), GoalId::new_random()];
    let mut before = keeping();
    before.pursue(goals[0], &wanted(PATH));
    before.pursue(goals[1], &wanted(PATH));
    before.cancel(goals[0]);
    let mut after = keeping();
    after.remember(before.memory(), &goals[1..2], &BTreeMap::new());
    after.pursue(goals[2], &wanted(PATH));
    let remembered = after.memory().goals;
    let names: BTreeSet<String> = remembered.into_iter().map(|goal| goal.wanted.objective_id).collect();
    assert_eq!(
        names,
        ["obj_f_generate_search_path_2", "obj_f_generate_search_path_3"].map(str::to_owned).into()
    );
}

#[test]
fn a_restart_repeats_no_fulfilled_request() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut file = MemoryFile::open(directory.path()).expect("a directory");
    let (mut before, goal) = (keeping(), GoalId::new_random());
    see(&mut before, "2.3");
    before.pursue(goal, &wanted(PATH));
    let first = requested_modes(&mut before);
    assert_eq!(modes(&first), ["fd_spiral_medium"]);
    before.answered(&first[0], Outcome::Done, NOW);
    file.write(before.memory()).expect("written");
    let again = |found: &str| {
        let file = MemoryFile::open(directory.path()).expect("it is read");
        let modes: BTreeMap<String, String> = [(PATH.to_owned(), found.to_owned())].into();
        let mut keeping = keeping();
        keeping.remember(file.read(), &[goal], &modes);
        keeping
    };
    let mut after = again("fd_spiral_medium");
    assert_eq!(requested_modes(&mut after), []);
    assert_eq!(modes(&see(&mut after, "4")), ["fd_spiral_high"], "it goes on");
    // Another client has changed the mode, so the mode of the goal's design is requested again.
    assert_eq!(modes(&requested_modes(&mut again("fd_spiral_low"))), ["fd_spiral_medium"]);
    // Reports are restored even without goals.
    let mut alone = keeping();
    see(&mut alone, "1.3");
    file.write(alone.memory()).expect("written");
    let mut after = again("fd_unground");
    after.pursue(goal, &wanted(PATH));
    assert_eq!(modes(&requested_modes(&mut after)), ["fd_spiral_low"]);
    // A damaged file is reported.
    std::fs::write(directory.path().join("reasoner.json"), "{").expect("written");
    let message = MemoryFile::open(directory.path()).expect_err("it is damaged");
    assert_eq!(message.code, "N141");
}
