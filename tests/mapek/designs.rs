//! Tests of designs that a function refuses, and of designs that were set externally.

use metaplan::mapek::{Answer, Command, Event, Loop};

use crate::common::{control, feed};

fn reconfigured(answers: &[Answer]) -> Vec<(String, Option<String>, String)> {
    let change = |answer: &Answer| match &answer.effect()?.command {
        Command::Reconfigure { function, from, to } => Some((function.clone(), from.clone(), to.clone())),
        _ => None,
    };
    answers.iter().filter_map(change).collect()
}

fn pair(from: Option<&str>, to: &str) -> Vec<(String, Option<String>, String)> {
    vec![("f_localization".to_owned(), from.map(ToOwned::to_owned), to.to_owned())]
}

fn effect(answers: &[Answer]) -> u64 {
    let first = answers.iter().find_map(Answer::effect);
    first.expect("an effect").number
}

fn code(answers: &[Answer]) -> &str {
    let [Answer::Error { code, .. }] = answers else { panic!("{answers:?}") };
    code
}

/// Delivers an event as text, so that its syntax is tested as well.
fn deliver(control: &mut Loop, event: &Event) -> Vec<Answer> {
    feed(control, &event.to_json().to_string())
}

fn observed(control: &mut Loop, design: Option<&str>) -> Vec<Answer> {
    let (function, design) = ("f_localization".to_owned(), design.map(ToOwned::to_owned));
    deliver(control, &Event::Observed { function, design })
}

#[test]
fn a_refused_design_is_not_requested_until_it_is_realisable_again() {
    let mut control = control("ugv");
    let first = control.start();
    assert_eq!(reconfigured(&first), pair(None, "fd_amcl_kinect"));
    let answers = deliver(&mut control, &Event::ReconfigurationFailed { effect: effect(&first) });
    // The cheapest design for the remainder of the action is requested at once. The new plan has two moves in the light
    // after the corridor with obstacles, where only the other Kinect design is safe enough.
    assert_eq!(reconfigured(&answers), [pair(None, "fd_amcl_lidar"), pair(None, "fd_mrpt_kinect")].concat());
    assert!(!control.beliefs().available().contains("fd_amcl_kinect"));
    assert!(control.beliefs().available().contains("fd_mrpt_kinect"));
    let design = || "fd_amcl_kinect".to_owned();
    deliver(&mut control, &Event::Acknowledged { effect: 4 });
    let answers = deliver(&mut control, &Event::Design { design: design(), realisable: true });
    assert_eq!(reconfigured(&answers), pair(Some("fd_mrpt_kinect"), "fd_amcl_kinect"));
    // The failure has already been handled, so its repetition changes nothing.
    let repeated_answers = deliver(&mut control, &Event::ReconfigurationFailed { effect: effect(&first) });
    assert!(repeated_answers.is_empty(), "{repeated_answers:?}");
    let unknown = deliver(&mut control, &Event::ReconfigurationFailed { effect: 1000 });
    assert_eq!(code(&unknown), "M305");
    let unknown =
        deliver(&mut control, &Event::Design { design: "fd_nothing".to_owned(), realisable: false });
    assert_eq!(code(&unknown), "M306");
}

#[test]
fn a_better_design_than_the_observed_one_is_requested() {
    let mut control = control("ugv");
    let answers = control.start();
    deliver(&mut control, &Event::Acknowledged { effect: effect(&answers) });
    // The observed design needs two percent more battery per move. Without a minimum benefit, the best design is
    // requested again.
    let answers = observed(&mut control, Some("fd_mrpt_kinect"));
    assert_eq!(reconfigured(&answers), pair(Some("fd_mrpt_kinect"), "fd_amcl_kinect"), "{answers:?}");
    deliver(&mut control, &Event::Acknowledged { effect: effect(&answers) });
    // The function has lost its design; the loop requests the design again.
    let answers = observed(&mut control, None);
    assert_eq!(reconfigured(&answers), pair(None, "fd_amcl_kinect"), "{answers:?}");
    // The observed design is the requested one.
    assert_eq!(observed(&mut control, Some("fd_amcl_kinect")), Vec::new());
    assert_eq!(code(&observed(&mut control, Some("fd_nothing"))), "M306");
    let nothing = Event::Observed { function: "f_nothing".to_owned(), design: None };
    assert_eq!(code(&deliver(&mut control, &nothing)), "M306");
}
