//! Tests of the UGV mission of the paper: both plans, their uniqueness by brute force, modified problems,
//! domains and knowledge bases, availability of designs, and identical answers of repeated runs.

use crate::common::{copy_of_mission, edit, metaplan, metaplan_in, steps};

fn check(arguments: &[&str], expected: &[&str], cost: i64) {
    let directory = crate::common::root();
    check_in(&directory, arguments, expected, cost);
}

fn check_in(directory: &std::path::Path, arguments: &[&str], expected: &[&str], cost: i64) {
    let command: Vec<&str> =
        ["plan", "missions/ugv.toml", "--format", "json"].iter().chain(arguments).copied().collect();
    let outcome = metaplan_in(directory, &command, "");
    assert_eq!(outcome.status, 0, "{outcome:#?}");
    let answer = outcome.json();
    assert_eq!(answer["format"], "metaplan-plan/1");
    assert_eq!(answer["status"], "optimal");
    assert_eq!(steps(&answer), expected);
    assert_eq!((answer["cost"].as_i64(), answer["lower_bound"].as_i64()), (Some(cost), Some(cost)));
    let validate: Vec<&str> =
        ["validate", "missions/ugv.toml", "-"].iter().chain(arguments).copied().collect();
    let verdict = metaplan_in(directory, &validate, &outcome.stdout);
    assert_eq!(verdict.status, 0, "{verdict:#?}");
    assert!(verdict.stdout.starts_with(&format!("valid, metric {cost}, ")), "{verdict:#?}");
}

const THROUGH_THE_OBSTACLES: [&str; 4] = [
    "move wp1 wp2 | fd_amcl_kinect",
    "move_with_obstacles wp2 wp5 | fd_amcl_kinect",
    "move wp5 wp8 | fd_amcl_kinect",
    "move wp8 wp9 | fd_amcl_kinect",
];

const THROUGH_THE_DARK: [&str; 3] = [
    "move wp2 wp3 | fd_amcl_lidar",
    "move wp3 wp6 | fd_amcl_lidar",
    "move_in_the_dark wp6 wp9 | fd_amcl_lidar",
];

#[test]
fn plan_without_failures() {
    check(&[], &THROUGH_THE_OBSTACLES, 408);
}

#[test]
fn plan_after_kinect_failure_at_wp2() {
    check(&["--fail", "c_kinect", "--set", "robot_at=wp2"], &THROUGH_THE_DARK, 412);
    check(&["--scenario", "kinect_failure"], &THROUGH_THE_DARK, 412);
}

#[test]
fn small_missions_are_proved_by_the_sat_solver() {
    let answer = metaplan(&["plan", "missions/ugv.toml", "--format", "json"]).json();
    assert_eq!(answer["proof"]["by"], "sat");
    assert!(answer["statistics"]["clauses"].as_i64() > Some(100), "{answer:#}");
}

/// Designs of the mission: name, battery usage per move, safety in tenths, whether the design needs
/// light, and components.
const DESIGNS: [(&str, i64, i64, bool, &[&str]); 6] = [
    ("fd_amcl_lidar", 4, 4, false, &["c_lidar"]),
    ("fd_amcl_kinect", 2, 10, false, &["c_kinect"]),
    ("fd_mrpt_lidar", 6, 3, false, &["c_lidar"]),
    ("fd_mrpt_kinect", 4, 9, false, &["c_kinect"]),
    ("fd_aruco", 7, 7, true, &["c_camera"]),
    ("fd_aruco_with_light", 10, 7, false, &["c_camera", "c_flashlight"]),
];

/// Enumerates all plans from a waypoint to wp9 with a cost of at most `limit`. `prefix` contains the steps so
/// far.
fn enumerate(
    waypoint: usize,
    failed: &str,
    limit: i64,
    prefix: &mut Vec<String>,
    plans: &mut Vec<(i64, Vec<String>)>,
) {
    fn spent(prefix: &[String]) -> i64 {
        prefix.iter().filter_map(|step| step.rsplit(' ').next()?.parse::<i64>().ok()).sum()
    }
    if waypoint == 9 {
        plans.push((spent(prefix), prefix.clone()));
    }
    let corridors = [(1, 2), (2, 3), (4, 5), (5, 6), (7, 8), (8, 9), (2, 5), (3, 6), (4, 7), (5, 8), (6, 9)];
    for (a, b) in
        corridors.into_iter().flat_map(|(a, b)| [(a, b), (b, a)]).filter(|(from, _)| *from == waypoint)
    {
        let (low, high) = (a.min(b), a.max(b));
        let (obstacles, dark) = ((low, high) == (2, 5), (low, high) == (6, 9));
        for (name, battery, safety, needs_light, components) in DESIGNS {
            let unsuitable = components.contains(&failed) || obstacles && safety <= 8 || dark && needs_light;
            let cost = 100 * if dark { 2 } else { 1 } + battery;
            if !unsuitable && spent(prefix) + cost <= limit {
                prefix.push(format!("{a} {b} {name} {cost}"));
                enumerate(b, failed, limit, prefix, plans);
                prefix.pop();
            }
        }
    }
}

#[test]
fn optima_are_unique_by_brute_force() {
    for (start, failed, cost, moves) in [(1, "none", 408, 4), (2, "c_kinect", 412, 3)] {
        let mut plans = Vec::new();
        enumerate(start, failed, cost + 1, &mut Vec::new(), &mut plans);
        let least_cost = plans.iter().map(|(cost, _)| *cost).min();
        let optima: Vec<_> = plans.iter().filter(|(c, _)| Some(*c) == least_cost).collect();
        assert_eq!((least_cost, optima.len(), optima[0].1.len()), (Some(cost), 1, moves), "{optima:?}");
    }
}

#[test]
fn start_goal_and_map_are_defined_in_the_problem() {
    let mission = copy_of_mission("ugv");
    let problem = "encodings/ugv/problem.pddl";
    edit(mission.path(), problem, "(robot_at wp1)", "(robot_at wp4)");
    edit(mission.path(), problem, "(:goal (robot_at wp9))", "(:goal (robot_at wp7))");
    check_in(mission.path(), &[], &["move wp4 wp7 | fd_amcl_kinect"], 102);

    let mission = copy_of_mission("ugv");
    edit(
        mission.path(),
        problem,
        "(robot_at wp1)",
        "(robot_at wp1) (corridor wp1 wp4) (= (travel_time wp1 wp4) 1)",
    );
    edit(mission.path(), problem, "(:goal (robot_at wp9))", "(:goal (robot_at wp7))");
    check_in(mission.path(), &[], &["move wp1 wp4 | fd_amcl_kinect", "move wp4 wp7 | fd_amcl_kinect"], 204);
}

#[test]
fn battery_usage_is_defined_in_the_domain() {
    let mission = copy_of_mission("ugv");
    let domain = "encodings/ugv/domain.pddl";
    let text = std::fs::read_to_string(mission.path().join(domain)).expect("the domain");
    let (text_before, obstacles) = text.split_once("move_with_obstacles").expect("the action");
    let (obstacles, text_after) =
        obstacles.split_once("(:durative-action move_in_the_dark").expect("the next action");
    let expensive_obstacles = obstacles.replace("(battery_usage ?fd)", "(* 60 (battery_usage ?fd))");
    let text = format!(
        "{text_before}move_with_obstacles{expensive_obstacles}(:durative-action move_in_the_dark{text_after}"
    );
    std::fs::write(mission.path().join(domain), text).expect("the domain is written");
    // At 60 times the usual consumption, the battery would not suffice, so the plan avoids the obstacles.
    let detour = [
        "move wp1 wp2 | fd_amcl_kinect",
        "move wp2 wp3 | fd_amcl_kinect",
        "move wp3 wp6 | fd_amcl_kinect",
        "move_in_the_dark wp6 wp9 | fd_amcl_kinect",
    ];
    check_in(mission.path(), &[], &detour, 508);
}

#[test]
fn safety_of_designs_is_defined_in_the_knowledge_base() {
    let mission = copy_of_mission("ugv");
    let old = ":qa_mrpt_lidar_safety a owl:NamedIndividual , t:QAvalue ; t:isQAtype :safety ; t:hasValue 0.3";
    edit(mission.path(), "ontology/kb/ugv.ttl", old, &old.replace("0.3", "0.9"));
    let obstacles_with_mrpt = [
        "move_with_obstacles wp2 wp5 | fd_mrpt_lidar",
        "move wp5 wp8 | fd_amcl_lidar",
        "move wp8 wp9 | fd_amcl_lidar",
    ];
    check_in(mission.path(), &["--scenario", "kinect_failure"], &obstacles_with_mrpt, 314);
}

#[test]
fn availability_comes_from_the_knowledge_base() {
    for file in ["encodings/ugv/problem.pddl", "encodings/uuv/problem.pddl"] {
        let text = std::fs::read_to_string(crate::common::root().join(file)).expect("the problem");
        assert!(!text.contains("fd_"), "{file} says something about designs");
    }
    let detour = [
        "move wp1 wp2 | fd_amcl_lidar",
        "move wp2 wp3 | fd_amcl_lidar",
        "move wp3 wp6 | fd_amcl_lidar",
        "move_in_the_dark wp6 wp9 | fd_amcl_lidar",
    ];
    // The measured value is outside the range of the Kinect designs.
    check(&["--set", "ambient_light=0.9"], &detour, 516);
    check(&["--set", "ambient_light=0.8"], &THROUGH_THE_OBSTACLES, 408);
    // If both the Kinect and the lidar fail, the camera remains. Its design without flashlight does not work
    // in the dark.
    let camera = [
        "move wp2 wp3 | fd_aruco",
        "move wp3 wp6 | fd_aruco",
        "move_in_the_dark wp6 wp9 | fd_aruco_with_light",
    ];
    check(&["--set", "robot_at=wp2", "--fail", "c_kinect", "--fail", "c_lidar"], &camera, 424);
    // The optimal plan does not use the lidar.
    check(&["--fail", "c_lidar"], &THROUGH_THE_OBSTACLES, 408);
    // The limit of the light is a value of the knowledge base.
    let mission = copy_of_mission("ugv");
    edit(mission.path(), "ontology/kb/ugv.ttl", "t:hasMaximum 0.8", "t:hasMaximum 0.2");
    check_in(mission.path(), &[], &detour, 516);
}

#[test]
fn without_any_sensor_there_is_no_plan() {
    let outcome = metaplan(&[
        "plan",
        "missions/ugv.toml",
        "--fail",
        "c_kinect",
        "--fail",
        "c_lidar",
        "--fail",
        "c_camera",
    ]);
    assert_eq!(outcome.status, 10, "{outcome:#?}");
    assert!(outcome.stdout.starts_with("no plan exists, proved"), "{outcome:#?}");
    assert!(
        outcome.stdout.contains("there is no plan without fd_amcl_kinect, fd_amcl_lidar, fd_aruco,"),
        "{outcome:#?}"
    );
    let empty = metaplan(&["plan", "missions/ugv.toml", "--set", "battery=3"]);
    assert!(empty.status == 10 && empty.stdout.contains("designs are not the cause"), "{empty:#?}");
}

#[test]
fn answers_are_deterministic() {
    let run = || {
        let mut answer = metaplan(&["plan", "missions/ugv.toml", "--format", "json"]).json();
        answer["statistics"].as_object_mut().expect("statistics").remove("milliseconds");
        answer
    };
    let first_answer = run();
    (0..5).for_each(|_| assert_eq!(run(), first_answer));
}
