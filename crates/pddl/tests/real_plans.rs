//! Validates hand-made plans for real files.
//!
//! The files are not part of the project.

use metaplan_pddl::validate::{Options, PlanText, validate};
use metaplan_pddl::{Source, read, render};
use test_resources::data;

/// Validates a plan and compares the result with `expected`: `time metric`, or the step and the kind of the
/// violation.
fn check(domain: &str, problem: &str, plan: &str, concurrent: bool, expected: &str) {
    let source = |path: &str| {
        let bytes = std::fs::read(data(format!("real/pddl/{path}"))?).expect("a file");
        Some(Source::from_bytes(path, &bytes))
    };
    let (Some(domain), Some(problem)) = (source(domain), source(problem)) else { return };
    let (domain_tree, problem_tree) = match read(&domain, &problem) {
        Ok((domain, problem, _)) => (domain, problem),
        Err(errors) => panic!("{}", render(&errors, &[&domain, &problem], false)),
    };
    let plan = PlanText::parse(&Source::new("plan", plan)).expect("the plan can be read");
    let verdict =
        validate(&domain_tree, &problem_tree, &plan, &Options::default().with_concurrent(concurrent));
    let metric = verdict.metric.map_or("-".to_owned(), |metric| metric.to_string());
    let result = verdict.violation.as_ref().map_or(format!("{} {metric}", verdict.total_time), |violation| {
        format!("{} {}", violation.step.unwrap_or(0), violation.kind.as_str())
    });
    assert_eq!(result, expected, "{:?}", verdict.violation);
}

const SUAVE: (&str, &str) = (
    "suave_metaplan/suave_extended_metaplan_domain.pddl",
    "suave_metaplan/suave_extended_metaplan_problem.pddl",
);

const RECHARGE: &str =
    "(recharge a_recharge f_recharge f_maintain_motion fd_recharge fd_maintain_motion)  [5.000]\n";
const SEARCH: &str = "(search_pipeline a_search_pipeline f_generate_search_path f_maintain_motion fd_search_high fd_maintain_motion)  [5.000]\n";
const INSPECT: &str = "(inspect_pipeline a_inspect_pipeline f_follow_pipeline f_maintain_motion fd_follow fd_maintain_motion)  [5.000]\n";

#[test]
fn suave_plans_with_suitable_designs_are_valid() {
    let plan = format!("0.000: {RECHARGE}5.001: {SEARCH}10.002: {INSPECT}");
    check(SUAVE.0, SUAVE.1, &plan, false, "15 6");
    check(SUAVE.0, SUAVE.1, &plan, true, "7501/500 6");
    let plan_with_low_search =
        plan.replace("fd_search_high", "fd_search_low").replace("fd_maintain_motion", "fd_recover_motion");
    check(SUAVE.0, SUAVE.1, &plan_with_low_search, false, "15 4");
}

#[test]
fn suave_plans_in_the_wrong_order_are_invalid() {
    check(SUAVE.0, SUAVE.1, &format!("{SEARCH}{INSPECT}"), false, "1 over_all");
    check(SUAVE.0, SUAVE.1, &format!("{RECHARGE}{INSPECT}"), false, "2 over_all");
    check(SUAVE.0, SUAVE.1, &format!("{RECHARGE}{SEARCH}"), false, "0 goal");
    let overlapping = format!("0: {RECHARGE}2: {SEARCH}8: {INSPECT}");
    check(SUAVE.0, SUAVE.1, &overlapping, false, "2 overlap");
    check(SUAVE.0, SUAVE.1, &overlapping, true, "2 over_all");
}

#[test]
fn durations_can_depend_on_the_state() {
    let (domain, problem) = (
        "plansys2/plansys2_executor_test_pddl_road_trip_domain.pddl",
        "plansys2/plansys2_executor_test_pddl_road_trip_problem.pddl",
    );
    let plan = "0: (move herbie wp0 wp1) [121.951]\n121.952: (visit herbie wp1) [1]\n122.953: (move herbie wp1 wp3) [163.615]\n\
                286.569: (visit herbie wp3) [1]\n";
    check(domain, problem, plan, false, "0 goal");
    // The tank suffices for 7500 m. With the reserve of 10 %, 7159 m are too far, and so are 5000 m after
    // 2500 m.
    check(domain, problem, "(move herbie wp0 wp2)", false, "1 at_start");
    check(domain, problem, "(move herbie wp0 wp1)\n(move herbie wp1 wp2)", false, "2 at_start");
    check(domain, problem, "0: (move herbie wp0 wp1) [121.5]", false, "1 duration");
    check(
        domain,
        problem,
        "(move herbie wp0 rp0)\n(refuel herbie rp0)\n(refuel herbie rp1)",
        false,
        // The tank is full, so refuelling has duration 0: its start reads the level, and its end sets it.
        "3 interference",
    );
}
