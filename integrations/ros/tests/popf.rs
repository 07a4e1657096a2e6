//! `popf` as called by PlanSys2's plugin, with the plugin's parser applied to the output.
//!
//! The files of PlanSys2's tests are not part of the project.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use metaplan_ros::interfaces::plansys2_msgs::msg::PlanItem;

/// The problem that the plugin uses to validate a domain.
const VOID: &str = "(define (problem void) (:domain plansys2))";

const DOMAIN: &str = "(define (domain d) (:requirements :durative-actions :typing)
  (:types place robot) (:predicates (at ?r - robot ?p - place) (way ?a ?b - place)) (:functions (price ?a ?b - place) (spent))
  (:durative-action go :parameters (?r - robot ?a ?b - place) :duration (= ?duration 2)
    :condition (and (at start (at ?r ?a)) (at start (way ?a ?b)))
    :effect (and (at start (not (at ?r ?a))) (at end (at ?r ?b)) (at end (increase (spent) (price ?a ?b))))))";

/// The direct way from `a` to `c` is short and expensive.
const PROBLEM: &str = "(define (problem p) (:domain d) (:objects r s - robot a b c - place)
  (:init (at r a) (at s a) (way a b) (way b c) (way a c) (= (price a b) 1) (= (price b c) 1) (= (price a c) 5) (= (spent) 0))
  (:goal (and (at r c) (at s b))))";

fn popf(arguments: &[&str], environment: &[(&str, &str)]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_popf"))
        .args(arguments)
        .env_remove("METAPLAN_METRIC")
        .envs(environment.iter().copied())
        .output()
        .expect("the program")
}

/// Parses the redirected output like the plugin, which accesses parts of each line without a bounds
/// check. Such an access error fails the test.
fn read_as_the_plugin(output: &Output) -> Option<Vec<PlanItem>> {
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = String::from_utf8(output.stdout.clone()).expect("text");
    let mut lines = text.lines();
    lines.find(|line| line.contains("Solution Found"))?;
    let mut items = Vec::new();
    for line in lines {
        if line.as_bytes()[0] == b';' {
            continue;
        }
        let (colon, parenthesis, bracket) = (line.find(':'), line.find(')'), line.find('['));
        let (colon, parenthesis) = (colon.expect("a colon"), parenthesis.expect("a parenthesis"));
        let action = &line[colon + 2..][..parenthesis - colon - 1];
        let mut duration = line[bracket.expect("a bracket") + 1..].to_owned();
        duration.pop();
        let time = line[..colon].parse().expect("a time");
        let duration = duration.parse().expect("a duration");
        items.push(PlanItem { time, action: action.to_owned(), duration });
    }
    Some(items)
}

fn actions(items: &[PlanItem]) -> Vec<&str> {
    items.iter().map(|item| item.action.as_str()).collect()
}

fn files(domain: &str, problem: &str) -> (tempfile::TempDir, [String; 2]) {
    let directory = tempfile::tempdir().expect("a directory");
    let paths = [("domain.pddl", domain), ("problem.pddl", problem)].map(|(name, text)| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).expect("a file");
        path.display().to_string()
    });
    (directory, paths)
}

fn shared(file: &str) -> Option<PathBuf> {
    test_resources::data(Path::new("real/pddl/plansys2").join(file))
}

#[test]
fn robots_go_at_the_same_time_and_what_follows_comes_later() {
    let (_directory, [domain, problem]) = files(DOMAIN, PROBLEM);
    let items = read_as_the_plugin(&popf(&[&domain, &problem], &[])).expect("a solution");
    assert_eq!(actions(&items), ["(go r a c)", "(go s a b)"]);
    assert!(
        items.iter().all(|item| item.time.abs() < 1e-6 && (item.duration - 2.0).abs() < 1e-6),
        "{items:?}"
    );
    let one = ["--overlap", "no", &domain, &problem];
    let items = read_as_the_plugin(&popf(&one, &[])).expect("a solution");
    assert!(items.len() == 2 && (items[1].time - 2.001).abs() < 1e-6, "{items:?}");
}

#[test]
fn the_metric_that_plansys2_leaves_out_counts() {
    let (_directory, [domain, problem]) = files(DOMAIN, PROBLEM);
    let expected = ["(go r a b)", "(go r b c)", "(go s a b)"];
    for (arguments, environment) in [
        (&["--metric", "(spent)", &domain, &problem][..], &[][..]),
        (&["--metric=spent", &domain, &problem], &[]),
        (&[&domain, &problem], &[("METAPLAN_METRIC", "(spent)")]),
    ] {
        let items = read_as_the_plugin(&popf(arguments, environment)).expect("a solution");
        let mut found = actions(&items);
        found.sort_unstable();
        assert_eq!(found, expected, "{arguments:?}");
    }
    // The problem's own metric takes precedence.
    let text = PROBLEM.replace("(:goal", "(:metric minimize (total-time)) (:goal");
    let (_directory, [domain, problem]) = files(DOMAIN, &text);
    let items = read_as_the_plugin(&popf(&[&domain, &problem], &[("METAPLAN_METRIC", "(spent)")]));
    assert_eq!(items.expect("a solution").len(), 2);
}

#[test]
fn arguments_of_popf_do_no_harm() {
    let (_directory, [domain, problem]) = files(DOMAIN, PROBLEM);
    for arguments in [&["-n", "-citation", "-b"][..], &["-t", "5"], &["-T"]] {
        let all: Vec<&str> = arguments.iter().copied().chain([domain.as_str(), &problem]).collect();
        assert_eq!(read_as_the_plugin(&popf(&all, &[])).map(|items| items.len()), Some(2), "{arguments:?}");
    }
}

#[test]
fn why_there_is_no_plan_is_said_and_not_taken_for_one() {
    let impossible = PROBLEM.replace("(way a b) ", "");
    let broken = &PROBLEM[..PROBLEM.len() - 1];
    for (domain, problem, expected) in [
        (DOMAIN, impossible.as_str(), "Plan not found: no plan exists, proved"),
        (DOMAIN, broken, "Invalid PDDL problem: problem, line 1, column 1"),
        (&DOMAIN.replace("(way ?a ?b)))", "(weg ?a ?b)))"), PROBLEM, "Invalid PDDL domain: domain, line 4"),
    ] {
        let (_directory, [domain, problem]) = files(domain, problem);
        let output = popf(&[&domain, &problem], &[]);
        assert_eq!(read_as_the_plugin(&output), None, "{expected}");
        for said in [&output.stdout, &output.stderr] {
            let said = String::from_utf8_lossy(said);
            assert!(said.contains(expected), "{said}");
        }
    }
    for arguments in [&["one"][..], &["no/domain", "no/problem"], &["--time-limit", "soon", "a", "b"]] {
        let output = popf(arguments, &[]);
        assert_eq!(read_as_the_plugin(&output), None);
        assert!(!output.stderr.is_empty() && output.stdout.starts_with(b"; "), "{output:?}");
    }
}

#[test]
fn a_plan_without_actions_is_empty() {
    let (_directory, [domain, problem]) =
        files(DOMAIN, &PROBLEM.replace("(and (at r c) (at s b))", "(at r a)"));
    assert_eq!(read_as_the_plugin(&popf(&[&domain, &problem], &[])), Some(Vec::new()));
}

#[test]
fn actions_without_durations_follow_each_other() {
    let domain = "(define (domain d) (:predicates (a) (b) (c))
      (:action one :precondition (a) :effect (b)) (:action two :precondition (b) :effect (c)))";
    let (_directory, [domain, problem]) =
        files(domain, "(define (problem p) (:domain d) (:init (a)) (:goal (c)))");
    let items = read_as_the_plugin(&popf(&[&domain, &problem], &[])).expect("a solution");
    assert_eq!(actions(&items), ["(one)", "(two)"]);
    assert!(items[0].time + items[0].duration < items[1].time, "{items:?}");
}

#[test]
fn a_domain_is_checked_by_a_problem_that_asks_for_nothing() {
    let broken = DOMAIN.replace("(way ?a ?b)))", "(weg ?a ?b)))");
    for (domain, is_valid) in [(DOMAIN, true), (&DOMAIN[..DOMAIN.len() - 1], false), (&broken, false)] {
        let (_directory, [domain, problem]) = files(domain, VOID);
        let found = read_as_the_plugin(&popf(&[&domain, &problem], &[]));
        assert_eq!(found, is_valid.then(Vec::new));
    }
}

/// With a mission's knowledge base, the actions of the domain get designs. PlanSys2 does not see
/// the designs.
#[test]
fn the_knowledge_base_of_a_mission_joins_in() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let [mission, domain, problem] =
        ["missions/uuv_plain.toml", "encodings/uuv/plain.pddl", "encodings/uuv/problem.pddl"]
            .map(|file| root.join(file).display().to_string());
    let output = popf(&["--mission", &mission, &domain, &problem], &[]);
    let items = read_as_the_plugin(&output).expect("a solution");
    assert!(!items.is_empty());
    assert!(items.iter().all(|item| !item.action.contains("fd_")), "{items:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("optimal, proved") && text.contains(" = fd_"), "{text}");
}

/// `ros2 run PACKAGE PROGRAM` runs `lib/PACKAGE/PROGRAM` of the first prefix of `AMENT_PREFIX_PATH` whose
/// index names the package.
#[cfg(unix)]
#[test]
fn the_overlay_is_where_ros2_run_looks() {
    let (directory, [domain, problem]) = files(DOMAIN, PROBLEM);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/popf/overlay");
    let prefix = directory.path().join("prefix");
    let made =
        Command::new(&script).arg(env!("CARGO_BIN_EXE_popf")).arg(&prefix).status().expect("the script");
    assert!(made.success());
    assert!(prefix.join("share/ament_index/resource_index/packages/popf").is_file());
    let output = Command::new(prefix.join("lib/popf/popf")).args([&domain, &problem]).output().expect("popf");
    assert_eq!(read_as_the_plugin(&output).map(|items| items.len()), Some(2));
    assert!(!Command::new(script).arg("nothing").output().expect("the script").status.success());
}

/// Checks the domains of PlanSys2's own tests, including those that PlanSys2's tests declare
/// invalid.
#[test]
fn domains_of_plansys2_are_judged_as_expected() {
    let (_directory, [_, void]) = files("", VOID);
    for (name, is_valid) in [
        ("plansys2_popf_plan_solver_test_pddl_domain_1_ok.pddl", true),
        ("plansys2_popf_plan_solver_test_pddl_domain_2_error.pddl", false),
        ("plansys2_popf_plan_solver_test_pddl_domain_simple.pddl", true),
        ("plansys2_domain_expert_test_pddl_domain_2_error.pddl", false),
        ("plansys2_domain_expert_test_pddl_domain_charging.pddl", true),
        ("plansys2_executor_test_pddl_factory.pddl", true),
        ("plansys2_executor_test_pddl_road_trip_domain.pddl", true),
        ("plansys2_executor_test_pddl_cooking_domain.pddl", true),
        ("plansys2_problem_expert_test_pddl_domain_exists.pddl", true),
    ] {
        let Some(domain) = shared(name) else { return };
        let found = read_as_the_plugin(&popf(&[&domain.display().to_string(), &void], &[]));
        assert_eq!(found, is_valid.then(Vec::new), "{name}");
    }
}

/// Solves the problems of PlanSys2's own tests. The expected number of actions is the one that
/// these tests expect of POPF; `None` expects no plan.
#[test]
fn problems_of_plansys2_are_solved() {
    for (domain, problem, expected) in [
        ("planner_test_pddl_domain_simple", "planner_test_pddl_problem_simple_1", Some(3)),
        ("planner_test_pddl_domain_simple", "planner_test_pddl_problem_simple_2", None),
        ("planner_test_pddl_domain_simple", "planner_test_pddl_problem_simple_3", None),
        (
            "planner_test_pddl_domain_simple_constants",
            "planner_test_pddl_problem_simple_constants_1",
            Some(3),
        ),
        ("popf_plan_solver_test_pddl_domain_simple", "popf_plan_solver_test_pddl_problem_simple_1", Some(3)),
        ("tests_test_2_pddl_test_2", "tests_test_2_pddl_problem_2", Some(6)),
    ] {
        let [domain, problem] = [domain, problem].map(|name| shared(&format!("plansys2_{name}.pddl")));
        let (Some(domain), Some(problem)) = (domain, problem) else { return };
        let name = problem.display().to_string();
        let found = read_as_the_plugin(&popf(&[&domain.display().to_string(), &name], &[]));
        assert_eq!(found.map(|items| items.len()), expected, "{name}");
    }
}
