//! Tests of the two experiments of the paper event by event, and of other properties of the loop.

use metaplan::mapek::{Answer, Command, Loop};
use serde_json::Value;

use crate::common::{control, feed};

/// Describes an answer in a few words. Returns `None` for irrelevant answers.
fn words(answer: &Answer) -> Option<String> {
    Some(match answer {
        Answer::Inferred { designs, objectives } => {
            let designs =
                designs.iter().map(|d| format!("{}{}", if d.available { "+" } else { "-" }, d.design));
            let objectives = objectives.iter().map(|o| format!("{} [{}]", o.objective, o.statuses.join(" ")));
            designs.chain(objectives).collect::<Vec<_>>().join(", ")
        }
        Answer::PlanRequested { .. } | Answer::Overdue { .. } => return None,
        Answer::PlanFound { cost, steps, optimal } => {
            assert!(optimal, "{answer:?}");
            let steps: Vec<String> = steps.iter().map(metaplan::mapek::PlannedStep::summary).collect();
            format!("plan {cost}: {}", steps.join("; "))
        }
        Answer::PlanKept { because } => format!("kept: {because}"),
        Answer::PlanNone { status, .. } => format!("no plan: {status}"),
        Answer::Effect(effect) if effect.repeated => return None,
        Answer::Effect(effect) => match &effect.command {
            Command::Reconfigure { function, from, to } => {
                format!("reconfigure {function}: {} to {to}", from.as_deref().unwrap_or("none"))
            }
            Command::Request { step } => format!("request {}: {}", effect.action, step.summary()),
            Command::Cancel { .. } => format!("cancel {}", effect.action),
            Command::Suspend { .. } => format!("suspend {}", effect.action),
            Command::Resume { .. } => format!("resume {}", effect.action),
            other => panic!("unexpected: {other:?}"),
        },
        Answer::GoalReached => "goal".to_owned(),
        Answer::Error { code, .. } => format!("error {code}"),
        other => panic!("unexpected: {other:?}"),
    })
}

/// Checks the answers to each line of a script. The line `start` starts the loop.
fn check(control: &mut Loop, script: &[(&str, &[&str])]) {
    for (line, expected) in script {
        let answers = if *line == "start" { control.start() } else { feed(control, line) };
        let texts: Vec<String> = answers.iter().filter_map(words).collect();
        assert_eq!(texts, *expected, "{line}");
    }
}

const KINECT_LOST: &str = "-fd_amcl_kinect, -fd_mrpt_kinect, o_f_localization [IN_ERROR_COMPONENT]";
const KINECT_FAILS: &str = r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#;
const KINECT_RECOVERS: &str = r#"{"event":"component_status","component":"c_kinect","status":"RECOVERED"}"#;
const AROUND: &str = "plan 412: move wp2 wp3 (f_localization = fd_amcl_lidar); move wp3 wp6 (f_localization = fd_amcl_lidar); \
                      move_in_the_dark wp6 wp9 (f_localization = fd_amcl_lidar)";

fn ugv_at_wp2() -> Loop {
    let mut ugv = control("ugv");
    check(
        &mut ugv,
        &[
            (
                "start",
                &[
                    "plan 408: move wp1 wp2 (f_localization = fd_amcl_kinect); move_with_obstacles wp2 wp5 \
                     (f_localization = fd_amcl_kinect); move wp5 wp8 (f_localization = fd_amcl_kinect); \
                     move wp8 wp9 (f_localization = fd_amcl_kinect)",
                    "reconfigure f_localization: none to fd_amcl_kinect",
                    "request 1: move wp1 wp2 (f_localization = fd_amcl_kinect)",
                ],
            ),
            (r#"{"event":"action_started","action":1}"#, &[]),
            (
                r#"{"event":"action_succeeded","action":1}"#,
                &["request 2: move_with_obstacles wp2 wp5 (f_localization = fd_amcl_kinect)"],
            ),
        ],
    );
    ugv
}

#[test]
fn the_kinect_fails_at_wp2() {
    let mut ugv = ugv_at_wp2();
    check(
        &mut ugv,
        &[
            // No other design is safe enough among the obstacles. The action is therefore cancelled, and then
            // the route and the design change.
            (KINECT_FAILS, &[KINECT_LOST, "suspend 2", "cancel 2"]),
            (
                r#"{"event":"action_cancelled","action":2}"#,
                &[
                    AROUND,
                    "reconfigure f_localization: fd_amcl_kinect to fd_amcl_lidar",
                    "o_f_localization []",
                    "request 3: move wp2 wp3 (f_localization = fd_amcl_lidar)",
                ],
            ),
            (
                r#"{"event":"action_succeeded","action":3}"#,
                &["request 4: move wp3 wp6 (f_localization = fd_amcl_lidar)"],
            ),
            (
                r#"{"event":"action_succeeded","action":4}"#,
                &["request 5: move_in_the_dark wp6 wp9 (f_localization = fd_amcl_lidar)"],
            ),
            (r#"{"event":"action_succeeded","action":5}"#, &["goal"]),
        ],
    );
}

#[test]
fn the_kinect_fails_on_the_way_to_wp2() {
    let mut ugv = control("ugv");
    ugv.start();
    check(
        &mut ugv,
        &[(
            // Another design is possible: the action continues with that design immediately, and then the
            // remaining route changes.
            KINECT_FAILS,
            &[
                KINECT_LOST,
                "reconfigure f_localization: none to fd_amcl_lidar",
                "o_f_localization []",
                "plan 516: move wp1 wp2 (f_localization = fd_amcl_lidar); move wp2 wp3 (f_localization = fd_amcl_lidar); \
                 move wp3 wp6 (f_localization = fd_amcl_lidar); move_in_the_dark wp6 wp9 (f_localization = fd_amcl_lidar)",
            ],
        )],
    );
}

#[test]
fn the_battery_of_the_uuv_drops() {
    let mut uuv = control("uuv");
    check(
        &mut uuv,
        &[
            (
                "start",
                &[
                    "plan 28: search_pipeline pl1 (f_generate_search_path = fd_search_high, f_maintain_motion = fd_speed_high); \
                     follow_pipeline pl1 (f_follow_pipeline = fd_follow, f_maintain_motion = fd_speed_high)",
                    "reconfigure f_generate_search_path: none to fd_search_high",
                    "reconfigure f_maintain_motion: none to fd_speed_high",
                    "request 1: search_pipeline pl1 (f_generate_search_path = fd_search_high, f_maintain_motion = fd_speed_high)",
                ],
            ),
            (r#"{"event":"action_started","action":1}"#, &[]),
            // Half of the search is done, and the battery has the expected value: 100 - 33 / 2.
            (r#"{"event":"action_progress","action":1,"fraction":0.5}"#, &[]),
            (r#"{"event":"fact_changed","name":"battery","value":83.5}"#, &[]),
            // At 15 percent, the remainder of the search needs more battery with any design.
            (
                r#"{"event":"fact_changed","name":"battery","value":15}"#,
                &["reconfigure f_maintain_motion: fd_speed_high to fd_speed_low", "cancel 1"],
            ),
            (
                r#"{"event":"action_cancelled","action":1}"#,
                &[
                    "plan 60: recharge (f_maintain_motion = fd_speed_low, f_recharge = fd_recharge); search_pipeline pl1 \
                     (f_generate_search_path = fd_search_high, f_maintain_motion = fd_speed_high); follow_pipeline pl1 \
                     (f_follow_pipeline = fd_follow, f_maintain_motion = fd_speed_high)",
                    "reconfigure f_recharge: none to fd_recharge",
                    "request 2: recharge (f_maintain_motion = fd_speed_low, f_recharge = fd_recharge)",
                ],
            ),
            (
                r#"{"event":"action_succeeded","action":2}"#,
                &[
                    "reconfigure f_maintain_motion: fd_speed_low to fd_speed_high",
                    "request 3: search_pipeline pl1 (f_generate_search_path = fd_search_high, f_maintain_motion = fd_speed_high)",
                ],
            ),
            (
                r#"{"event":"action_succeeded","action":3}"#,
                &[
                    "reconfigure f_follow_pipeline: none to fd_follow",
                    "request 4: follow_pipeline pl1 (f_follow_pipeline = fd_follow, f_maintain_motion = fd_speed_high)",
                ],
            ),
            (r#"{"event":"action_succeeded","action":4}"#, &["goal"]),
        ],
    );
}

#[test]
fn an_action_with_full_progress_is_not_cancelled() {
    for (mission, change) in [
        ("uuv", r#"{"event":"fact_changed","name":"battery","value":"50"}"#),
        ("ugv", r#"{"event":"component_status","component":"c_kinect","status":"FALSE"}"#),
    ] {
        let mut control = control(mission);
        control.start();
        feed(&mut control, r#"{"event":"action_progress","action":1,"fraction":1}"#);
        assert_eq!(control.beliefs().violation(), None, "{mission}");
        let answers = feed(&mut control, change);
        let commands = answers.iter().filter_map(Answer::effect).map(|effect| &effect.command);
        for command in commands {
            assert!(matches!(command, Command::Reconfigure { .. }), "{mission}: {answers:#?}");
        }
        let answers = feed(&mut control, r#"{"event":"action_succeeded","action":1}"#);
        assert!(answers.iter().filter_map(Answer::effect).any(|effect| effect.action == 2), "{answers:#?}");
    }
}

#[test]
fn the_plan_survives_failures_of_unused_components() {
    let mut ugv = ugv_at_wp2();
    check(
        &mut ugv,
        &[
            (
                r#"{"event":"component_status","component":"c_lidar","status":"ERROR"}"#,
                &[
                    "-fd_amcl_lidar, -fd_mrpt_lidar",
                    "kept: it uses none of the designs that are not available any more",
                ],
            ),
            (r#"{"event":"tick"}"#, &[]),
            (
                r#"{"event":"action_failed","action":2,"reason":"wheels slip"}"#,
                &[
                    "plan 306: move_with_obstacles wp2 wp5 (f_localization = fd_amcl_kinect); move wp5 wp8 (f_localization = \
                     fd_amcl_kinect); move wp8 wp9 (f_localization = fd_amcl_kinect)",
                    "request 3: move_with_obstacles wp2 wp5 (f_localization = fd_amcl_kinect)",
                ],
            ),
        ],
    );
}

const BACK: &str = "+fd_amcl_kinect, +fd_mrpt_kinect";
const BETTER: [&str; 2] = [
    "plan 304: move wp3 wp6 (f_localization = fd_amcl_kinect); move_in_the_dark wp6 wp9 (f_localization = fd_amcl_kinect)",
    "reconfigure f_localization: fd_amcl_lidar to fd_amcl_kinect",
];

#[test]
fn a_recovered_better_design_is_used_after_the_settle_time() {
    // From `wp3` the Kinect saves 2 percent of battery for each of two moves.
    let detour = |benefit: i64, settle: u64| {
        let mut ugv = control("ugv");
        let mission = ugv.beliefs().mission().clone();
        let settings = metaplan::mapek::Settings::immediate()
            .with_minimum_benefit(num_rational::BigRational::from_integer(benefit.into()))
            .with_settle(std::time::Duration::from_secs(settle))
            .with_time_limit(None);
        ugv = Loop::new(mission, settings).expect("a loop");
        ugv.start();
        for line in [
            r#"{"event":"action_succeeded","action":1,"time":1}"#,
            KINECT_FAILS,
            r#"{"event":"action_cancelled","action":2}"#,
            r#"{"event":"action_succeeded","action":3}"#,
        ] {
            feed(&mut ugv, line);
        }
        ugv
    };
    check(&mut detour(4, 0), &[(KINECT_RECOVERS, &[BACK, BETTER[0], BETTER[1]])]);
    check(
        &mut detour(5, 0),
        &[(KINECT_RECOVERS, &[BACK, "kept: the benefit of another plan is 4, the minimum is 5"])],
    );
    check(
        &mut detour(0, 10),
        &[
            (KINECT_RECOVERS, &[BACK]),
            (r#"{"event":"tick","time":9}"#, &[]),
            (r#"{"event":"tick","time":12}"#, &BETTER),
        ],
    );
    // The design becomes unavailable again within the settle time.
    check(
        &mut detour(0, 10),
        &[
            (KINECT_RECOVERS, &[BACK]),
            (
                KINECT_FAILS,
                &[
                    "-fd_amcl_kinect, -fd_mrpt_kinect",
                    "kept: it uses none of the designs that are not available any more",
                ],
            ),
            (r#"{"event":"tick","time":30}"#, &[]),
        ],
    );
}

#[test]
fn diagnostic_arrays_are_accepted() {
    let array = |message: &str, values: &[(&str, &str)]| {
        let values: Vec<Value> =
            values.iter().map(|(key, value)| serde_json::json!({ "key": key, "value": value })).collect();
        serde_json::json!({
            "header": { "stamp": { "sec": 3, "nanosec": 5 }, "frame_id": "" },
            "status": [{ "level": 0, "name": "", "message": message, "hardware_id": "", "values": values }],
        })
        .to_string()
    };
    let mut uuv = control("uuv");
    uuv.start();
    let murky = array("QA status", &[("water_visibility", "1.5")]);
    let thruster = array("Component status", &[("c_thruster_3", "FALSE"), ("c_thruster_3", "ERROR")]);
    let recovered = array("Component status", &[("c_thruster_3", "RECOVERED"), ("c_thruster_3", "OK")]);
    let planta = array("Component status", &[("c_thruster_3", "ERROR")]);
    let unknown = array("Component status", &[("c_thruster_9", "FALSE")]);
    let bad = array("QA status", &[("water_visibility", "clear")]);
    let foreign = array("battery ok", &[("cell", "3.7")]);
    let first = |control: &mut Loop, line: &str| feed(control, line).iter().find_map(words);
    let lost = "-fd_speed_high, -fd_speed_medium, o_f_maintain_motion [IN_ERROR_COMPONENT]";
    assert_eq!(first(&mut uuv, &thruster).as_deref(), Some(lost));
    assert_eq!(first(&mut uuv, &recovered).as_deref(), Some("+fd_speed_high, +fd_speed_medium"));
    assert_eq!(first(&mut uuv, &planta).as_deref(), Some(lost));
    let dark = "-fd_search_high, -fd_search_medium, o_f_generate_search_path [IN_ERROR_NFR]";
    assert_eq!(first(&mut uuv, &murky).as_deref(), Some(dark));
    assert_eq!(first(&mut uuv, &unknown).as_deref(), Some("error M306"));
    assert_eq!(first(&mut uuv, &bad).as_deref(), Some("error M304"));
    assert_eq!(first(&mut uuv, &foreign), None);
}

#[test]
fn the_goal_changes_and_actions_fail() {
    let mut ugv = ugv_at_wp2();
    check(
        &mut ugv,
        &[
            (
                r#"{"event":"goal_changed","goal":"(robot_at wp7)"}"#,
                &[
                    "plan 306: move_with_obstacles wp2 wp5 (f_localization = fd_amcl_kinect); move wp5 wp4 (f_localization = \
                   fd_amcl_kinect); move wp4 wp7 (f_localization = fd_amcl_kinect)",
                ],
            ),
            (r#"{"event":"goal_changed","goal":"(robot_at wp11)"}"#, &["error M306"]),
            (r#"{"event":"action_succeeded","action":7}"#, &["error M305"]),
        ],
    );
    for action in [2, 3] {
        let answers = feed(&mut ugv, &format!(r#"{{"event":"action_failed","action":{action}}}"#));
        assert!(answers.iter().any(|answer| answer.effect().is_some()), "{answers:?}");
    }
    // After three consecutive failures, planning pauses until the situation changes.
    check(
        &mut ugv,
        &[(r#"{"event":"action_failed","action":4}"#, &["no plan: failed"]), (r#"{"event":"tick"}"#, &[])],
    );
    let answers = feed(&mut ugv, r#"{"event":"fact_changed","name":"robot_at","value":"wp5"}"#);
    assert!(answers.iter().any(|answer| answer.effect().is_some()), "{answers:?}");
}

#[test]
fn an_action_is_suspended_without_any_plan() {
    let mut uuv = control("uuv");
    uuv.start();
    let thruster = |number: u32, status: &str| {
        format!(r#"{{"event":"component_status","component":"c_thruster_{number}","status":"{status}"}}"#)
    };
    let stands = "-fd_speed_high, -fd_speed_low, -fd_speed_medium, o_f_maintain_motion [IN_ERROR_COMPONENT]";
    check(
        &mut uuv,
        &[
            (r#"{"event":"action_progress","action":1,"fraction":0.75}"#, &[]),
            // No speed is available. Cancelling the search would discard three quarters of the work without
            // any benefit.
            (&thruster(1, "FALSE"), &[stands, "suspend 1", "no plan: unsolvable"]),
            (r#"{"event":"tick"}"#, &[]),
            (r#"{"event":"component_status","component":"c_sonar","status":"OK"}"#, &[]),
            (&thruster(3, "FALSE"), &[]),
            (r#"{"event":"fact_changed","name":"battery","value":90}"#, &["no plan: unsolvable"]),
            // The low speed is available again and is used.
            (
                &thruster(1, "RECOVERED"),
                &[
                    "+fd_speed_low",
                    "plan 38: search_pipeline pl1 (f_generate_search_path = fd_search_high, f_maintain_motion = fd_speed_low); \
                     follow_pipeline pl1 (f_follow_pipeline = fd_follow, f_maintain_motion = fd_speed_low)",
                    "reconfigure f_maintain_motion: fd_speed_high to fd_speed_low",
                    "o_f_maintain_motion []",
                    "resume 1",
                ],
            ),
            (
                r#"{"event":"action_succeeded","action":1}"#,
                &[
                    "reconfigure f_follow_pipeline: none to fd_follow",
                    "request 2: follow_pipeline pl1 (f_follow_pipeline = fd_follow, f_maintain_motion = fd_speed_low)",
                ],
            ),
            // A robot that cannot suspend reports the end of the action.
            (
                &thruster(1, "FALSE"),
                &[
                    "-fd_speed_low, o_f_maintain_motion [IN_ERROR_COMPONENT]",
                    "suspend 2",
                    "no plan: unsolvable",
                ],
            ),
            (r#"{"event":"action_cancelled","action":2}"#, &["no plan: unsolvable"]),
        ],
    );
}

#[test]
fn an_action_is_cancelled_if_another_route_is_better() {
    let mut ugv = ugv_at_wp2();
    for line in [KINECT_FAILS, r#"{"event":"action_cancelled","action":2}"#] {
        feed(&mut ugv, line);
    }
    check(
        &mut ugv,
        &[
            // The move to wp3 becomes long. Then the Kinect recovers and the lidar fails.
            (
                r#"{"event":"fact_changed","name":"travel_time wp2 wp3","value":30}"#,
                &["kept: it is still the best"],
            ),
            (
                r#"{"status":[{"message":"Component status","values":[{"key":"c_lidar","value":"FALSE"},{"key":"c_kinect","value":"RECOVERED"}]}]}"#,
                &[
                    "+fd_amcl_kinect, -fd_amcl_lidar, +fd_mrpt_kinect, -fd_mrpt_lidar, o_f_localization [IN_ERROR_COMPONENT]",
                    "reconfigure f_localization: fd_amcl_kinect to fd_amcl_kinect",
                    "o_f_localization []",
                    "cancel 3",
                ],
            ),
            (
                r#"{"event":"action_cancelled","action":3}"#,
                &[
                    "plan 306: move_with_obstacles wp2 wp5 (f_localization = fd_amcl_kinect); move wp5 wp8 (f_localization = \
                     fd_amcl_kinect); move wp8 wp9 (f_localization = fd_amcl_kinect)",
                    "request 4: move_with_obstacles wp2 wp5 (f_localization = fd_amcl_kinect)",
                ],
            ),
        ],
    );
}
