//! Tests of sequence numbers: late lines are accepted, and no number blocks later numbers. Tests of memory: the state
//! does not grow with the history.
#![expect(clippy::print_stdout, reason = "the table is what the long test is for")]

use metaplan::mapek::{Answer, Loop};
use serde_json::json;

use crate::common::{control, feed};
use crate::soak::resident;

fn ugv() -> Loop {
    let mut control = control("ugv");
    control.start();
    control
}

/// Checks the answer to a line. `expected` is `None` for an accepted line.
fn check(control: &mut Loop, line: &str, expected: Option<&str>) {
    let kind = |answer: &Answer| match answer {
        Answer::Duplicate { .. } => Some("duplicate".to_owned()),
        Answer::Stale { .. } => Some("stale".to_owned()),
        Answer::Error { code, .. } => Some(code.clone()),
        _ => None,
    };
    assert_eq!(feed(control, line).iter().find_map(kind).as_deref(), expected, "{line}");
}

#[test]
fn a_late_line_is_accepted() {
    let mut ugv = ugv();
    check(&mut ugv, r#"{"event":"tick","seq":5}"#, None);
    let late = r#"{"event":"component_status","component":"c_kinect","status":"FALSE","seq":4}"#;
    check(&mut ugv, late, None);
    assert!(!ugv.beliefs().available().contains("fd_amcl_kinect"));
    check(&mut ugv, late, Some("duplicate"));
    check(&mut ugv, r#"{"event":"tick","seq":5}"#, Some("duplicate"));
    assert_eq!(ugv.beliefs().sequence(), Some(5));
}

#[test]
fn a_number_far_ahead_does_not_block_later_ones() {
    let mut ugv = ugv();
    check(&mut ugv, r#"{"event":"tick","seq":18446744073709551615}"#, Some("M307"));
    check(&mut ugv, r#"{"event":"tick","seq":1}"#, None);
    check(&mut ugv, r#"{"event":"tick","seq":18446744073709551615}"#, Some("M307"));
    check(&mut ugv, r#"{"event":"tick","seq":2}"#, None);
    assert_eq!(ugv.beliefs().sequence(), Some(2));
}

#[test]
fn the_number_of_a_refused_line_can_be_reused() {
    let mut ugv = ugv();
    check(&mut ugv, r#"{"event":"unheard_of","seq":1}"#, Some("M303"));
    check(
        &mut ugv,
        r#"{"event":"component_status","component":"c_none","status":"FALSE","seq":1}"#,
        Some("M306"),
    );
    check(&mut ugv, r#"{"event":"tick","seq":1}"#, None);
    check(&mut ugv, r#"{"event":"tick","seq":1}"#, Some("duplicate"));
}

#[test]
fn very_many_gaps_make_old_numbers_stale() {
    let mut ugv = ugv();
    for number in 0..300 {
        check(&mut ugv, &format!(r#"{{"event":"tick","seq":{}}}"#, 10 + 2 * number), None);
    }
    check(&mut ugv, r#"{"event":"tick","seq":11}"#, Some("stale"));
    check(&mut ugv, r#"{"event":"tick","seq":607}"#, None);
}

fn flap(control: &mut Loop, number: u64) {
    let status = if number.is_multiple_of(2) { "FALSE" } else { "TRUE" };
    feed(
        control,
        &json!({ "event": "component_status", "component": "c_kinect", "status": status }).to_string(),
    );
}

#[test]
fn state_without_acknowledgements_does_not_grow() {
    let mut ugv = ugv();
    let mut sizes = Vec::new();
    for number in 0..400 {
        flap(&mut ugv, number);
        if number % 100 == 99 {
            sizes.push(ugv.snapshot().0.to_string().len());
        }
    }
    let (first, last) = (sizes[0], sizes[3]);
    assert!(last < first + 200, "{sizes:?}");
    assert!(
        ugv.beliefs().outstanding().count() <= 2,
        "{:?}",
        ugv.beliefs().outstanding().collect::<Vec<_>>()
    );
    // Without a journal, plans of earlier lines are not kept.
    assert!(ugv.decision(&[]).plans.len() <= 2);
    let superseded: usize = ugv.beliefs().outstanding().map(|effect| effect.supersedes.len()).sum();
    assert!(superseded > 0);
}

#[test]
#[ignore = "takes an hour; only a release build is of interest"]
fn memory_is_constant_over_ten_million_events() {
    let event_count: u64 =
        std::env::var("METAPLAN_EVENTS").ok().and_then(|text| text.parse().ok()).unwrap_or(10_000_000);
    for acknowledging in [true, false] {
        let mut ugv = ugv();
        let (mut sizes, mut next) = (Vec::new(), 10_000);
        let mut number = 0;
        while number < event_count {
            if number % 10 == 0 {
                flap(&mut ugv, number / 10);
            } else {
                // The measured value oscillates around the bound, in full precision.
                let value = 0.8 + 0.1 * (number as f64).sin();
                feed(
                    &mut ugv,
                    &json!({ "event": "measured", "attribute": "ambient_light", "value": value }).to_string(),
                );
            }
            number += 1;
            if acknowledging {
                let waiting: Vec<u64> = ugv.beliefs().outstanding().map(|effect| effect.number).collect();
                for effect in waiting {
                    feed(&mut ugv, &json!({ "event": "acknowledged", "effect": effect }).to_string());
                    number += 1;
                }
            }
            if number >= next {
                let memory = resident().unwrap_or(0);
                println!("{number} events, acknowledged: {acknowledging}, {:.1} MB", memory as f64 / 1024.0);
                sizes.push(memory);
                next *= 10;
            }
        }
        assert!(sizes.last() <= sizes.first().map(|first| first + first / 5).as_ref(), "{sizes:?}");
    }
}
