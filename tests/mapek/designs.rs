//! Designs that a function refuses, and designs that somebody else has given it.

use metaplan::mapek::{Answer, Command, Event, Loop};

use crate::common::{control, feed};

/// Function, design before and design from now on, of the reconfigurations among answers.
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

/// Feeds an event through its text, so that reading it is tried, too.
fn tell(control: &mut Loop, event: &Event) -> Vec<Answer> {
    feed(control, &event.to_json().to_string())
}

fn observed(control: &mut Loop, design: Option<&str>) -> Vec<Answer> {
    let (function, design) = ("f_localization".to_owned(), design.map(ToOwned::to_owned));
    tell(control, &Event::Observed { function, design })
}

#[test]
fn a_design_that_is_refused_is_not_asked_for_until_it_answers_again() {
    let mut control = control("ugv");
    let first = control.start();
    assert_eq!(reconfigured(&first), pair(None, "fd_amcl_kinect"));
    let answers = tell(&mut control, &Event::ReconfigurationFailed { effect: effect(&first) });
    // The cheapest design for what is left of the action comes at once. Then the plan: two moves in the light come after the corridor with
    // obstacles, where only the other Kinect design is safe enough.
    assert_eq!(reconfigured(&answers), [pair(None, "fd_amcl_lidar"), pair(None, "fd_mrpt_kinect")].concat());
    assert!(!control.beliefs().available().contains("fd_amcl_kinect"));
    assert!(control.beliefs().available().contains("fd_mrpt_kinect"));
    let design = || "fd_amcl_kinect".to_owned();
    tell(&mut control, &Event::Acknowledged { effect: 4 });
    let answers = tell(&mut control, &Event::Design { design: design(), realisable: true });
    assert_eq!(reconfigured(&answers), pair(Some("fd_mrpt_kinect"), "fd_amcl_kinect"));
    // What failed was answered for: a second word on it changes nothing.
    let again = tell(&mut control, &Event::ReconfigurationFailed { effect: effect(&first) });
    assert!(again.is_empty(), "{again:?}");
    let unknown = tell(&mut control, &Event::ReconfigurationFailed { effect: 1000 });
    assert_eq!(code(&unknown), "M305");
    let unknown = tell(&mut control, &Event::Design { design: "fd_nothing".to_owned(), realisable: false });
    assert_eq!(code(&unknown), "M306");
}

#[test]
fn a_design_that_was_observed_is_kept_if_a_change_is_not_worth_it() {
    let mut control = control("ugv");
    let answers = control.start();
    tell(&mut control, &Event::Acknowledged { effect: effect(&answers) });
    // Worse by two percent of battery for each move, and nothing is said of a minimum: the best comes back.
    let answers = observed(&mut control, Some("fd_mrpt_kinect"));
    assert_eq!(reconfigured(&answers), pair(Some("fd_mrpt_kinect"), "fd_amcl_kinect"), "{answers:?}");
    tell(&mut control, &Event::Acknowledged { effect: effect(&answers) });
    // The function lost its design altogether: it is asked for again.
    let answers = observed(&mut control, None);
    assert_eq!(reconfigured(&answers), pair(None, "fd_amcl_kinect"), "{answers:?}");
    // What is seen is what was asked for.
    assert_eq!(observed(&mut control, Some("fd_amcl_kinect")), Vec::new());
    assert_eq!(code(&observed(&mut control, Some("fd_nothing"))), "M306");
    let nothing = Event::Observed { function: "f_nothing".to_owned(), design: None };
    assert_eq!(code(&tell(&mut control, &nothing)), "M306");
}
