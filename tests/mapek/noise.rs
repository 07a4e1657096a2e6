//! Tests of noisy sensors and components, with the settings of the UGV mission and with filters
//! from a manifest.

use std::path::Path;
use std::time::Duration;

use metaplan::configure::{Configurator, Goal, Keeper, KeeperAnswer, Wishes};
use metaplan::mapek::{Answer, Command, FilterSettings, Loop, MeasuredSettings, Observation, Stale};
use metaplan::setup::Setup;
use num_rational::BigRational;
use serde_json::json;

fn started(settings_text: &str) -> Loop {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions");
    let text = std::fs::read_to_string(directory.join("ugv.toml")).expect("a manifest");
    let Setup { mission, settings, .. } =
        Setup::parse("ugv.toml", &format!("{text}\n{settings_text}"), &directory)
            .expect("the mission is read");
    let mut control = Loop::new(mission, settings).expect("the mission can be planned for");
    control.start();
    control
}

fn feed(control: &mut Loop, line: &str, now: f64) -> Vec<Answer> {
    control.handle(&Observation::parse(line), Duration::from_secs_f64(now))
}

fn light(value: f64) -> String {
    json!({ "event": "measured", "attribute": "ambient_light", "value": value }).to_string()
}

fn kinect(status: &str) -> String {
    json!({ "event": "component_status", "component": "c_kinect", "status": status }).to_string()
}

fn reconfigurations(answers: &[Answer]) -> usize {
    let is_one = |answer: &&Answer| {
        matches!(answer.effect().map(|effect| &effect.command), Some(Command::Reconfigure { .. }))
    };
    answers.iter().filter(is_one).count()
}

fn words(answers: &[Answer]) -> Vec<String> {
    answers.iter().map(|answer| answer.to_json()["answer"].as_str().expect("a kind").to_owned()).collect()
}

#[test]
fn a_noisy_light_costs_one_reconfiguration() {
    let mut control = started("");
    let mut answers = Vec::new();
    for sample in 1..=200 {
        let value = if sample % 2 == 1 { 0.801 } else { 0.799 };
        answers.extend(feed(&mut control, &light(value), f64::from(sample)));
    }
    assert_eq!(reconfigurations(&answers), 1, "{answers:#?}");
    // A hundred samples are held back, but only three of them are reported.
    let filtered: Vec<_> =
        answers.iter().map(Answer::to_json).filter(|answer| answer["answer"] == "filtered").collect();
    let held: Vec<_> = filtered.iter().filter_map(|answer| answer["held"].as_u64()).collect();
    assert_eq!(held, [1, 10, 100], "{filtered:?}");
    assert_eq!(filtered[0]["because"], "hysteresis");
}

/// The manifest lists the bounds in rules. Its keys say on which side of a bound designs are lost.
#[test]
fn a_sample_that_violates_a_bound_of_a_rule_counts_at_once() {
    let samples = [0.45, 0.505, 0.52, 0.495];
    for (key, held) in [
        ("upper_bounds", [false, false, false, true]),
        ("lower_bounds", [false, true, false, false]),
        ("bounds", [false, true, false, true]),
    ] {
        let mut control = started(&format!("[adaptation.measured.ambient_light]\n{key} = [0.5]\n"));
        let is_held = |value| words(&feed(&mut control, &light(value), 1.0)).contains(&"filtered".to_owned());
        assert_eq!(samples.map(is_held), held, "{key}");
    }
}

#[test]
fn failures_and_clear_crossings_count_at_once() {
    for line in [kinect("FALSE"), kinect("ERROR"), light(0.9)] {
        let mut control = started("");
        let answers = feed(&mut control, &line, 1.0);
        assert_eq!(words(&answers)[0], "inferred", "{line}: {answers:?}");
        assert_eq!(reconfigurations(&answers), 1, "{line}: {answers:?}");
    }
}

#[test]
fn a_component_that_comes_and_goes_costs_one_reconfiguration() {
    let mut control = started("");
    let mut answers = Vec::new();
    for tenth in 0..200_u32 {
        let status = if tenth % 2 == 0 { "FALSE" } else { "RECOVERED" };
        answers.extend(feed(&mut control, &kinect(status), f64::from(tenth) / 10.0));
    }
    assert_eq!(reconfigurations(&answers), 1);
    // The component has recovered: the recovery counts after the heal time, and a better plan is sought after the
    // settle time.
    let healed = control.due().expect("a recovery is held back");
    assert_eq!(healed, Duration::from_secs_f64(21.9));
    assert_eq!(words(&feed(&mut control, r#"{"event":"tick"}"#, 21.8)), [""; 0]);
    assert_eq!(words(&feed(&mut control, r#"{"event":"tick"}"#, 21.9)), ["inferred"]);
    assert_eq!(control.due(), Some(Duration::from_secs_f64(26.9)));
    let answers = feed(&mut control, r#"{"event":"tick"}"#, 26.9);
    assert!(words(&answers).contains(&"plan_requested".to_owned()), "{answers:?}");
}

#[test]
fn a_failure_is_confirmed_if_the_mission_requires_it() {
    let mut control = started("[adaptation.components.c_kinect]\nconfirm_time = 0.5");
    let answers = feed(&mut control, &kinect("FALSE"), 1.0);
    assert_eq!(words(&answers), ["filtered"]);
    assert_eq!(answers[0].to_json()["due"], 1.5);
    assert_eq!(words(&feed(&mut control, &kinect("TRUE"), 1.2)), [""; 0]);
    assert_eq!(words(&feed(&mut control, r#"{"event":"tick"}"#, 3.0)), [""; 0]);
    feed(&mut control, &kinect("FALSE"), 4.0);
    assert_eq!(words(&feed(&mut control, r#"{"event":"tick"}"#, 4.5))[0], "inferred");
}

#[test]
fn a_silent_sensor_has_a_stated_outcome() {
    for (stale, is_lost) in [("worst", true), ("keep", false), ("unknown", false)] {
        let settings_text = format!("[adaptation.measured.ambient_light]\nperiod = 2\nstale = \"{stale}\"");
        let mut control = started(&settings_text);
        assert_eq!(words(&feed(&mut control, &light(0.3), 1.0)), [""; 0]);
        assert_eq!(words(&feed(&mut control, r#"{"event":"tick"}"#, 3.0)), [""; 0], "{stale}");
        let answers = feed(&mut control, r#"{"event":"tick"}"#, 3.1);
        assert_eq!(answers[0].to_json()["answer"], "silent");
        assert_eq!(answers[0].to_json()["outcome"], stale);
        assert_eq!(words(&answers).contains(&"inferred".to_owned()), is_lost, "{answers:?}");
        let values = control.beliefs().mission().knowledge().expect("a knowledge base").view().measurements();
        let value = values
            .into_iter()
            .find(|measurement| measurement.attribute == "ambient_light")
            .and_then(|measurement| measurement.value);
        assert_eq!(value.is_none(), stale == "unknown", "{value:?}");
        // A silent sensor is reported once; the silence ends with a sample.
        assert_eq!(words(&feed(&mut control, r#"{"event":"tick"}"#, 9.0)), [""; 0]);
        feed(&mut control, &light(0.3), 10.0);
        assert_eq!(
            words(&feed(&mut control, r#"{"event":"tick"}"#, 11.9))
                .iter()
                .filter(|word| *word == "silent")
                .count(),
            0
        );
        assert_eq!(words(&feed(&mut control, r#"{"event":"tick"}"#, 12.1))[0], "silent");
    }
}

#[test]
fn a_restored_loop_has_the_same_filter_states() {
    let settings_text = "[adaptation.measured.ambient_light]\nhysteresis = 0.05\ndebounce = 1\nagree = 2\nof = 3\nperiod = 5\n\
        [adaptation.components.c_kinect]\nconfirm_time = 1";
    let fresh = started(settings_text);
    let mut random = fastrand::Rng::with_seed(11);
    for _ in 0..6 {
        let (mut whole, mut now) = (fresh.clone(), 0.0);
        let mut cut = fresh.clone();
        for _ in 0..25 {
            now += random.f64() * 1.5;
            let line = match random.u32(..4) {
                0 => kinect(["FALSE", "TRUE", "RECOVERED"][random.usize(..3)]),
                1 => r#"{"event":"tick"}"#.to_owned(),
                _ => light((700.0 + random.f64() * 200.0).round() / 1000.0),
            };
            let mut next = fresh.clone();
            next.restore(&cut.snapshot()).expect("the snapshot is taken over");
            cut = next;
            assert_eq!(feed(&mut cut, &line, now), feed(&mut whole, &line, now), "{line} at {now}");
            assert_eq!(cut.due(), whole.due());
            assert_eq!(cut.snapshot(), whole.snapshot());
        }
    }
}

#[test]
fn the_keeper_filters_noise_too() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
    let mission = Setup::read(&manifest).expect("the mission is read").mission;
    let knowledge = mission.knowledge().expect("a knowledge base").clone();
    let mut configurator = Configurator::new(knowledge, Wishes::default()).expect("no wishes");
    configurator.pursue(&Goal::of("f_localization")).expect("a function");
    let started = |settings: &FilterSettings| {
        let mut keeper = Keeper::new(configurator.clone(), None).with_filters(settings);
        keeper.start();
        keeper
    };
    let count = |answers: &[KeeperAnswer]| {
        let is_one = |answer: &&KeeperAnswer| matches!(answer, KeeperAnswer::Loop(Answer::Inferred { .. }));
        answers.iter().filter(is_one).count()
    };
    let flaps = |keeper: &mut Keeper| -> usize {
        let designs = keeper.configurator().objectives();
        let design = designs[0].groundings[0].design.as_ref().expect("a design").name.clone();
        let view = keeper.configurator().knowledge().view();
        let design_in_use = view
            .function_designs()
            .into_iter()
            .find(|design_in_use| design_in_use.individual.name == design)
            .expect("a design");
        let component = design_in_use.components[0].name.clone();
        (0..40_u32)
            .map(|tenth| {
                let status = if tenth % 2 == 0 { "FALSE" } else { "RECOVERED" };
                let line = json!({ "event": "component_status", "component": component, "status": status });
                let now = Duration::from_millis(u64::from(tenth) * 100);
                count(&keeper.handle_at(&Observation::parse(&line.to_string()), now))
            })
            .sum()
    };
    let (without, with) =
        (flaps(&mut started(&FilterSettings::none())), flaps(&mut started(&FilterSettings::default())));
    assert!(without >= 40 && with <= 3, "{without} {with}");
    let mut settings = FilterSettings::default();
    let silent = MeasuredSettings {
        period: Some(Duration::from_secs(1)),
        stale: Stale::Worst,
        hysteresis: Some(BigRational::from_integer(0.into())),
        ..MeasuredSettings::default()
    };
    settings.measured.insert("ambient_light".to_owned(), silent);
    let mut keeper = started(&settings);
    keeper.handle_at(&Observation::parse(r#"{"event":"tick"}"#), Duration::from_secs(1));
    assert_eq!(keeper.due(), Some(Duration::from_micros(2_000_001)));
    let answers = keeper.handle_at(&Observation::parse(r#"{"event":"tick"}"#), Duration::from_secs(3));
    assert!(matches!(&answers[0], KeeperAnswer::Loop(Answer::Silent { .. })), "{answers:?}");
}
