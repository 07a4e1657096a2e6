//! Tests of acknowledgements that cross other messages, are duplicated, or arrive out of order.

use metaplan::mapek::{Answer, Command, Loop};

use crate::common::{control, feed};

fn words(answers: &[Answer]) -> Vec<String> {
    let word = |answer: &Answer| match &answer.effect()?.command {
        Command::Reconfigure { from, to, .. } => {
            Some(format!("{} to {to}", from.as_deref().unwrap_or("none")))
        }
        Command::Request { step } => Some(format!("request {}", step.action)),
        Command::Cancel { .. } => Some("cancel".to_owned()),
        Command::Suspend { .. } => Some("suspend".to_owned()),
        Command::Resume { .. } => Some("resume".to_owned()),
        _ => None,
    };
    answers.iter().filter_map(word).collect()
}

fn design(control: &Loop) -> Option<&str> {
    control.beliefs().configuration().get("f_localization").map(String::as_str)
}

fn event(control: &mut Loop, event: &str, field: &str, number: u64) -> Vec<Answer> {
    feed(control, &format!(r#"{{"event":"{event}","{field}":{number}}}"#))
}

const KINECT_FAILS: &str = r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#;

#[test]
fn a_report_in_transit_acknowledges_nothing() {
    let mut ugv = control("ugv");
    ugv.start();
    event(&mut ugv, "action_started", "action", 1);
    assert_eq!(words(&feed(&mut ugv, KINECT_FAILS)), ["fd_amcl_kinect to fd_amcl_lidar"]);
    for report in ["action_started", "action_progress"] {
        let line = format!(
            r#"{{"event":"{report}","action":1{}}}"#,
            if report == "action_started" { "" } else { ",\"fraction\":0.3" }
        );
        assert!(words(&feed(&mut ugv, &line)).is_empty());
    }
    assert_eq!(design(&ugv), Some("fd_amcl_kinect"));
    assert_eq!(ugv.beliefs().pending().collect::<Vec<_>>(), [("f_localization", "fd_amcl_lidar")]);
    assert!(
        words(&ugv.repeat()).contains(&"fd_amcl_kinect to fd_amcl_lidar".to_owned()),
        "it is repeated after a crash"
    );
    let answers = event(&mut ugv, "reconfiguration_failed", "effect", 3);
    assert!(!answers.iter().any(|answer| matches!(answer, Answer::Error { .. })), "{answers:?}");
    assert_eq!(words(&answers)[0], "fd_amcl_kinect to fd_mrpt_lidar", "the next design is asked for");
}

#[test]
fn a_reconfiguration_may_fail_after_it_was_acknowledged() {
    let mut ugv = control("ugv");
    ugv.start();
    event(&mut ugv, "acknowledged", "effect", 1);
    assert_eq!(design(&ugv), Some("fd_amcl_kinect"));
    let answers = event(&mut ugv, "reconfiguration_failed", "effect", 1);
    assert!(!answers.iter().any(|answer| matches!(answer, Answer::Error { .. })), "{answers:?}");
    assert_eq!(design(&ugv), None, "the function has what it had before");
    assert!(!ugv.beliefs().available().contains("fd_amcl_kinect"));
    assert_eq!(words(&answers)[0], "none to fd_amcl_lidar");
    // The duplicate of the failure is ignored.
    assert!(event(&mut ugv, "reconfiguration_failed", "effect", 1).is_empty());
}

/// A reconfiguration that has superseded an unanswered one fails. The superseded design is not believed, and
/// the suspended action does not resume before a design is requested.
#[test]
fn a_superseded_design_is_not_believed() {
    let mut ugv = control("ugv");
    ugv.start();
    let bright = r#"{"event":"measured","attribute":"ambient_light","value":0.9}"#;
    let answers = feed(&mut ugv, bright);
    assert_eq!(
        words(&answers)[0],
        "none to fd_amcl_lidar",
        "what was not acknowledged is not the design before"
    );
    for _ in 0..10 {
        let Some((effect, _)) = ugv
            .beliefs()
            .outstanding()
            .filter(|effect| matches!(effect.command, Command::Reconfigure { .. }))
            .map(|effect| (effect.number, effect.action))
            .last()
        else {
            break;
        };
        event(&mut ugv, "reconfiguration_failed", "effect", effect);
        assert_eq!(design(&ugv), None);
    }
    assert!(ugv.beliefs().suspended());
    let answers = feed(&mut ugv, r#"{"event":"measured","attribute":"ambient_light","value":0.3}"#);
    let words = words(&answers);
    let resume = words.iter().position(|word| word == "resume").expect("it goes on");
    assert!(words[..resume].iter().any(|word| word.starts_with("none to ")), "{words:?}");
}

#[test]
fn of_two_acknowledged_reconfigurations_the_later_one_counts() {
    for order in [[1, 3], [3, 1]] {
        let mut ugv = control("ugv");
        ugv.start();
        feed(&mut ugv, KINECT_FAILS);
        for effect in order {
            event(&mut ugv, "acknowledged", "effect", effect);
            event(&mut ugv, "acknowledged", "effect", effect);
        }
        assert_eq!(design(&ugv), Some("fd_amcl_lidar"), "{order:?}");
        assert!(!ugv.beliefs().is_unsettled("f_localization"));
    }
}

#[test]
fn a_start_implies_earlier_reconfigurations_without_acknowledgements() {
    let mut ugv = control("ugv");
    ugv.start();
    event(&mut ugv, "action_started", "action", 1);
    assert_eq!(design(&ugv), Some("fd_amcl_kinect"));
    // For a robot that acknowledges by number, unacknowledged designs are not believed.
    let mut ugv = control("ugv");
    ugv.start();
    event(&mut ugv, "acknowledged", "effect", 1);
    feed(&mut ugv, KINECT_FAILS);
    event(&mut ugv, "action_succeeded", "action", 1);
    event(&mut ugv, "action_started", "action", 2);
    assert_eq!(design(&ugv), Some("fd_amcl_kinect"));
    assert_eq!(ugv.beliefs().pending().count(), 1);
}

/// Creates the situation of a row of the table: reconfiguration 3 from A (Kinect) to B (lidar), in the given
/// state. C is the camera.
fn situation(state: &str) -> Loop {
    let mut ugv = control("ugv");
    ugv.start();
    event(&mut ugv, "acknowledged", "effect", 1);
    event(&mut ugv, "action_started", "action", 1);
    feed_reconfiguration(&mut ugv, KINECT_FAILS, 3);
    let (first, second) = state.split_once(", ").unwrap_or((state, ""));
    match first {
        "asked" => {}
        "acknowledged" => drop(event(&mut ugv, "acknowledged", "effect", 3)),
        "failed" => {
            fail_quietly(&mut ugv, 3);
        }
        "superseded" => feed_reconfiguration(
            &mut ugv,
            r#"{"event":"component_status","component":"c_lidar","status":"FALSE"}"#,
            4,
        ),
        other => panic!("unknown state {other}"),
    }
    match second {
        "" => {}
        "C acknowledged" => drop(event(&mut ugv, "acknowledged", "effect", 4)),
        "C failed" => {
            fail_quietly(&mut ugv, 4);
        }
        other => panic!("unknown state {other}"),
    }
    ugv
}

fn feed_reconfiguration(ugv: &mut Loop, line: &str, number: u64) {
    let answers = react(ugv, line);
    let reconfiguration = answers.iter().filter_map(Answer::effect).find(|effect| effect.number == number);
    assert!(
        reconfiguration.is_some_and(|effect| matches!(effect.command, Command::Reconfigure { .. })),
        "{answers:?}"
    );
}

fn react(ugv: &mut Loop, line: &str) -> Vec<Answer> {
    let now = ugv.beliefs().now() + std::time::Duration::from_millis(100);
    ugv.react(&metaplan::mapek::Observation::parse(line), now)
}

fn fail_quietly(ugv: &mut Loop, effect: u64) {
    react(ugv, &format!(r#"{{"event":"reconfiguration_failed","effect":{effect}}}"#));
}

#[test]
fn the_loop_implements_the_documented_table() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference/events.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let table = page.split("<!-- table: receipts -->").nth(1).expect("the table");
    let table = table.split("<!-- end of table -->").next().expect("its end");
    let rows = table.lines().filter(|line| line.starts_with('|')).skip(2);
    let names = [("A", "fd_amcl_kinect"), ("B", "fd_amcl_lidar")];
    let mut count = 0;
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [state, message, believed, pending, refused] = cells[..] else { panic!("{row}") };
        let mut ugv = situation(state);
        let third = ugv.beliefs().pending().map(|(_, design)| design.to_owned()).next();
        let third = third.or_else(|| design(&ugv).map(ToOwned::to_owned)).unwrap_or_default();
        let name = |letter: &str| {
            let listed = names.iter().find(|(label, _)| *label == letter).map(|(_, name)| (*name).to_owned());
            listed.unwrap_or_else(|| third.clone())
        };
        let before = if state.starts_with("superseded") { 4 } else { 3 };
        let line = match message.trim_matches('`') {
            "action_progress" => r#"{"event":"action_progress","action":1,"fraction":0.5}"#.to_owned(),
            "action_succeeded" => r#"{"event":"action_succeeded","action":1}"#.to_owned(),
            kind => format!(r#"{{"event":"{kind}","effect":3}}"#),
        };
        let answers = react(&mut ugv, &line);
        assert!(!answers.iter().any(|answer| matches!(answer, Answer::Error { .. })), "{row}: {answers:?}");
        assert_eq!(design(&ugv), Some(name(believed).as_str()), "{row}");
        // Reconfigurations in response to the message have later numbers.
        let is_older = |effect: &&metaplan::mapek::Effect| effect.number <= before;
        let waiting = ugv.beliefs().outstanding().filter(is_older).find_map(|effect| match &effect.command {
            Command::Reconfigure { to, .. } => Some(to.clone()),
            _ => None,
        });
        let is_superseded =
            answers.iter().filter_map(Answer::effect).any(|label| label.supersedes.contains(&before));
        if pending != "no" {
            assert!(is_superseded || waiting == Some(name(pending)), "{row}: {waiting:?}");
        } else if !state.ends_with("failed") {
            assert_eq!(waiting, None, "{row}");
        }
        let is_refused = ugv.snapshot().0.to_string().contains("fd_realisability");
        assert_eq!(is_refused && lidar_refused(&ugv), refused == "yes", "{row}");
        count += 1;
    }
    assert_eq!(count, 16);
}

fn lidar_refused(ugv: &Loop) -> bool {
    let snapshot = ugv.snapshot().0;
    let added = snapshot["added"].as_array().expect("statements");
    added.iter().any(|statement| {
        let text = statement.to_string();
        text.contains("fd_realisability") && text.contains("fd_amcl_lidar") && text.contains("false")
    })
}
