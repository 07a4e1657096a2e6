//! Tests of the UUV mission: with a full and with a low battery, in murky water, and without designs
//! that it needs. Brute force shows that the optimal plans with a full and with a low battery are
//! unique.

use crate::common::{copy_of_mission, edit, metaplan, metaplan_in, root, steps};

fn check(arguments: &[&str], expected: &[&str], cost: i64) {
    let command: Vec<&str> =
        ["plan", "missions/uuv.toml", "--format", "json"].iter().chain(arguments).copied().collect();
    let outcome = metaplan(&command);
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = outcome.json();
    assert_eq!(steps(&answer), expected);
    assert_eq!((answer["status"].as_str(), answer["cost"].as_i64()), (Some("optimal"), Some(cost)));
    let validate: Vec<&str> =
        ["validate", "missions/uuv.toml", "-"].iter().chain(arguments).copied().collect();
    let verdict = metaplan_in(&root(), &validate, &outcome.stdout);
    assert_eq!(verdict.status, 0, "{verdict:#?}");
}

const INSPECTION: [&str; 2] =
    ["search_pipeline pl1 | fd_search_high, fd_speed_high", "follow_pipeline pl1 | fd_follow, fd_speed_high"];

#[test]
fn plan_with_a_full_battery() {
    check(&[], &INSPECTION, 28);
}

#[test]
fn plan_with_a_low_battery_recharges_first() {
    let expected = ["recharge  | fd_speed_low, fd_recharge", INSPECTION[0], INSPECTION[1]];
    check(&["--scenario", "battery_drop"], &expected, 60);
    let answer =
        metaplan(&["plan", "missions/uuv.toml", "--scenario", "battery_drop", "--format", "json"]).json();
    assert_eq!(answer["steps"][1]["reconfigured"], serde_json::json!(["f_maintain_motion"]));
}

#[test]
fn visibility_limits_the_search_height() {
    let low = ["search_pipeline pl1 | fd_search_low, fd_speed_high", INSPECTION[1]];
    check(&["--set", "water_visibility=1.5"], &low, 40);
    let medium = ["search_pipeline pl1 | fd_search_medium, fd_speed_high", INSPECTION[1]];
    check(&["--set", "water_visibility=2.5"], &medium, 34);
    let outcome = metaplan(&["plan", "missions/uuv.toml", "--set", "water_visibility=1"]);
    assert_eq!(outcome.status, 10, "{outcome:#?}");
}

/// The function `battery` keeps its meaning if the knowledge base has an attribute of its name.
#[test]
fn settings_change_functions_that_are_named_like_an_attribute() {
    let measured = ":obs_battery a t:QAvalue ; t:isQAtype :battery ; t:isMeasured true ; t:hasValue 100.0 .";
    let estimated =
        ":fd_speed_low t:hasQAestimation [ a t:QAvalue ; t:isQAtype :battery ; t:hasValue 4.0 ] .";
    for statement in [measured, estimated] {
        let mission = copy_of_mission("uuv");
        let component = ":c_thruster_1 a owl:NamedIndividual , t:Component .";
        let statements = format!("{component} :battery a t:QualityAttributeType . {statement}");
        edit(mission.path(), "ontology/kb/uuv.ttl", component, &statements);
        for arguments in [
            &["plan", "missions/uuv.toml", "--scenario", "battery_drop"][..],
            &["explain", "missions/uuv.toml"],
        ] {
            let (outcome, expected) = (metaplan_in(mission.path(), arguments, ""), metaplan(arguments));
            assert_eq!(outcome.stdout, expected.stdout, "{statement}: {outcome:#?}");
            assert_eq!((outcome.status, expected.status), (0, 0), "{statement}: {outcome:#?}");
        }
    }
}

/// Designs for motion: time and battery usage, each per unit of work.
const SPEEDS: [(i64, i64); 3] = [(6, 2), (4, 5), (2, 10)];
/// Designs for searching: time per unit of work. Each design uses 1 unit of battery per unit of work.
const HEIGHTS: [i64; 3] = [6, 4, 2];
const RESERVE: i64 = 10;

/// Enumerates the costs of all plans with at most five actions and a cost of at most `limit`.
fn enumerate(battery: i64, stage: usize, actions: usize, cost: i64, limit: i64, costs: &mut Vec<i64>) {
    if cost > limit || actions > 5 {
        return;
    }
    if stage == 2 {
        costs.push(cost);
        return;
    }
    for (time, usage) in SPEEDS {
        let work: Vec<(i64, i64)> = match stage {
            0 => HEIGHTS.iter().map(|height| (3 * (height + time), 3 * (1 + usage))).collect(),
            _ => vec![(4 * (2 + time), 4 * (1 + usage))],
        };
        for (duration, used) in work {
            if battery >= used + RESERVE {
                enumerate(battery - used, stage + 1, actions + 1, cost + duration, limit, costs);
            }
        }
        if battery >= 2 * usage + RESERVE {
            enumerate(100, stage, actions + 1, cost + 2 * (10 + time), limit, costs);
        }
    }
}

#[test]
fn optima_are_unique_by_brute_force() {
    for (battery, cost) in [(100, 28), (15, 60)] {
        let mut costs = Vec::new();
        enumerate(battery, 0, 0, 0, 2 * cost, &mut costs);
        costs.sort_unstable();
        assert_eq!(costs.first(), Some(&cost), "battery {battery}");
        assert_ne!(costs.get(1), Some(&cost), "battery {battery}: the optimum is not unique");
    }
}

#[test]
fn only_blocking_designs_are_listed() {
    // Without thruster 3 only the low speed is available, which is sufficient.
    let arguments = ["plan", "missions/uuv.toml", "--fail", "c_sonar", "--fail", "c_thruster_3"];
    let answer = metaplan(&[&arguments[..], &["--format", "json"]].concat());
    assert_eq!((answer.status, answer.json()["blocking"].clone()), (10, serde_json::json!(["fd_follow"])));
}
