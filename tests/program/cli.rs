//! Tests of exit statuses and messages of the command line.

use crate::common::{Outcome, copy_of_mission, edit, headlines, metaplan, metaplan_in, root};

/// Checks the exit status, and that standard error or output contains each text. An internal error (panic,
/// M170) always fails the check.
fn check(outcome: &Outcome, status: i32, texts: &[&str]) {
    assert_eq!(outcome.status, status, "{outcome:#?}");
    for text in texts {
        assert!(outcome.stderr.contains(text) || outcome.stdout.contains(text), "no `{text}`: {outcome:#?}");
    }
    assert!(!outcome.stderr.contains("panicked") && !outcome.stderr.contains("M170"), "{outcome:#?}");
}

const DOMAIN: &str = "(define (domain d)
  (:requirements :typing)
  (:types place)
  (:predicates (at ?p - place) (way ?a ?b - place))
  (:action go :parameters (?a ?b - place)
    :precondition (and (at ?a) (way ?a ?b))
    :effect (and (not (at ?a)) (at ?b))))";

const PROBLEM: &str = "(define (problem p) (:domain d)
  (:objects a b c - place)
  (:init (at a) (way a b) (way b c))
  (:goal (at c)))";

fn plan(domain: &str, problem: &str, arguments: &[&str]) -> Outcome {
    let directory = tempfile::tempdir().expect("a temporary directory");
    std::fs::write(directory.path().join("domain.pddl"), domain).expect("a file");
    std::fs::write(directory.path().join("problem.pddl"), problem).expect("a file");
    let plan_arguments: Vec<&str> =
        ["plan", "domain.pddl", "problem.pddl"].iter().chain(arguments).copied().collect();
    metaplan_in(directory.path(), &plan_arguments, "")
}

#[test]
fn plans_without_a_knowledge_base() {
    let outcome = plan(DOMAIN, PROBLEM, &[]);
    check(&outcome, 0, &["go a b", "go b c", "cost 2", "optimal, proved"]);
    let outcome = plan(DOMAIN, PROBLEM, &["--plan-format", "ipc"]);
    assert_eq!(outcome.stdout, "(go a b)\n(go b c)\n");
    let outcome = plan(DOMAIN, PROBLEM, &["--plan-format", "plansys2"]);
    assert_eq!(outcome.stdout, "Solution Found\n0.000: (go a b)  [0.001]\n0.002: (go b c)  [0.001]\n");
}

#[test]
fn answers_are_written_to_files() {
    let directory = copy_of_mission("ugv");
    let arguments = ["plan", "missions/ugv.toml", "--format", "json", "-o", "plan.json"];
    check(&metaplan_in(directory.path(), &arguments, ""), 0, &[]);
    let arguments = ["validate", "missions/ugv.toml", "plan.json"];
    check(&metaplan_in(directory.path(), &arguments, ""), 0, &["valid, metric 408"]);
    let arguments = ["plan", "missions/ugv.toml", "-o", "no/such/directory/plan.json"];
    check(&metaplan_in(directory.path(), &arguments, ""), 3, &["M109", "cannot be written"]);
}

#[test]
fn limits_have_their_own_exit_status() {
    check(&plan(DOMAIN, PROBLEM, &["--horizon", "1"]), 11, &["no plan with up to 1 step, proved"]);
    check(&plan(DOMAIN, PROBLEM, &["--horizon", "2"]), 0, &["optimal, proved"]);
    let outcome = plan(DOMAIN, PROBLEM, &["--horizon", "1", "--format", "json"]);
    assert_eq!(outcome.json()["status"], "unsolvable_within_horizon");
    let mission = ["plan", "missions/ugv.toml", "--horizon", "3"];
    check(&metaplan(&mission), 11, &[]);
}

#[test]
fn unsolvable_tasks_are_reported() {
    let unreachable = PROBLEM.replace("(way b c)", "");
    check(&plan(DOMAIN, &unreachable, &[]), 10, &["no plan exists, proved", "(at c)"]);
    // The two atoms are mutually exclusive, which the delete relaxation does not detect.
    let exclusive = PROBLEM.replace("(at c)", "(and (at b) (at c))");
    check(&plan(DOMAIN, &exclusive, &[]), 10, &["no plan exists, proved"]);
    let empty = PROBLEM.replace("(at c)", "(at a)");
    check(&plan(DOMAIN, &empty, &[]), 0, &["cost 0", "optimal, proved"]);
}

#[test]
fn pddl_errors_are_reported_with_their_position() {
    check(
        &plan(&DOMAIN.replace("(way ?a ?b))", "(waay ?a ?b))"), PROBLEM, &[]),
        3,
        &["domain.pddl:6:", "did you mean `way`?"],
    );
    check(&plan(&DOMAIN[..DOMAIN.len() - 1], PROBLEM, &[]), 3, &["domain.pddl:1:1"]);
    check(&plan(DOMAIN, &PROBLEM.replace("way b c", "way b d"), &[]), 3, &["problem.pddl:3:"]);
    check(&plan(DOMAIN, "", &[]), 3, &["problem.pddl"]);
    // Several errors are reported together, in JSON as well.
    let two_errors = PROBLEM.replace("(at a)", "(on a)").replace("(way a b)", "(rail a b)");
    let outcome = plan(DOMAIN, &two_errors, &["--format", "json"]);
    check(&outcome, 3, &[]);
    let answer = outcome.json();
    assert_eq!(answer["format"], "metaplan-error/1");
    let lines: Vec<_> =
        answer["messages"].as_array().expect("messages").iter().map(|m| m["line"].as_i64()).collect();
    assert_eq!(lines, [Some(3), Some(3)], "{answer:#}");
}

#[test]
fn unsupported_features_are_refused_with_their_position() {
    let counting = DOMAIN
        .replace("(:action", "(:functions (used)) (:action")
        .replace("(at ?b))", "(at ?b) (increase (used) 1))");
    let unset = PROBLEM.replace("(at c)))", "(at c)) (:metric minimize (used)))");
    check(&plan(&counting, &unset, &[]), 3, &["domain.pddl:7:", "E301", "`used` has no initial value"]);
    check(
        &plan(&counting, &unset.replace("(at a)", "(at a) (= (used) 0)"), &[]),
        0,
        &["cost 2", "optimal, proved"],
    );
    let durative = "(define (domain d) (:types place) (:predicates (at ?p - place) (way ?a ?b - place)) (:functions (load))
      (:durative-action go :parameters (?a ?b - place) :duration (= ?duration (load))
        :condition (and (at start (at ?a)) (at start (way ?a ?b)))
        :effect (and (at start (not (at ?a))) (at end (at ?b)) (at end (increase (load) 1)))))";
    let loaded = PROBLEM.replace("(at a)", "(at a) (= (load) 1)");
    check(&plan(durative, &loaded, &[]), 3, &["domain.pddl:2:", "E301", "depends on the state"]);
}

#[test]
fn timed_initial_literals_are_waited_for() {
    let timed = PROBLEM.replace("(way b c)", "(at 5 (way b c))");
    let outcome = plan(DOMAIN, &timed, &["--plan-format", "ipc"]);
    assert_eq!(outcome.stdout, "0.000: (go a b)  [0.000]\n5.001: (go b c)  [0.000]\n");
    // A behaviour tree of actions has no waits.
    let tree = ["--plan-format", "btcpp"];
    let refused = plan(DOMAIN, &timed, &tree);
    check(&refused, 2, &["M107", "the plan waits until 5.001 for `(go b c)`"]);
    assert_eq!(refused.stdout, "");
    check(
        &plan(DOMAIN, &PROBLEM.replace("(way b c)", "(way b c) (at 5 (not (way b c)))"), &tree),
        0,
        &["go"],
    );
}

#[test]
fn objectives_replace_the_metric() {
    let domain = DOMAIN
        .replace("(:action", "(:functions (toll ?a ?b) (used) (distance)) (:action")
        .replace("(at ?b))", "(at ?b) (increase (used) (toll ?a ?b)) (increase (distance) 1))");
    let problem = PROBLEM.replace(
        "(at a)",
        "(at a) (way a c) (= (toll a b) 1) (= (toll b c) 1) (= (toll a c) 5) (= (used) 0) (= (distance) 0)",
    );
    let in_order =
        |first: &str, second: &str| plan(&domain, &problem, &["--minimize", first, "--minimize", second]);
    check(&in_order("distance", "used"), 0, &["cost 1", "optimal, proved", "distance = 1, used = 5"]);
    check(&in_order("used", "(+ (distance) 1)"), 0, &["cost 2", "used = 2, (+ (distance) 1) = 3"]);
    let front = plan(&domain, &problem, &["--pareto", "used,distance"]);
    check(&front, 0, &["used = 2, distance = 2", "used = 5, distance = 1", "2 on the front, proved"]);
    check(&plan(&domain, &problem, &["--pareto", "used"]), 2, &["M107", "takes two"]);
    check(&plan(&domain, &problem, &["--minimize", "usd"]), 3, &["P122", "did you mean `used`"]);
}

#[test]
fn missing_and_malformed_files_are_reported() {
    check(&metaplan(&["plan", "missions/none.toml"]), 3, &["missions/none.toml", "cannot be read"]);
    check(&metaplan(&["plan", "no.pddl", "neither.pddl"]), 3, &["no.pddl", "neither.pddl"]);
    check(&metaplan(&["reason", "none.ttl"]), 3, &["none.ttl"]);
    let mission = copy_of_mission("ugv");
    edit(mission.path(), "ontology/kb/ugv.ttl", "a owl:Ontology ;", "a owl:Ontology ; ; oops");
    check(&metaplan_in(mission.path(), &["plan", "missions/ugv.toml"], ""), 3, &["ontology/kb/ugv.ttl:"]);
    let mission = copy_of_mission("ugv");
    edit(mission.path(), "missions/ugv.toml", "[planning]", "[plannning]");
    check(
        &metaplan_in(mission.path(), &["plan", "missions/ugv.toml"], ""),
        3,
        &["missions/ugv.toml:", "planning"],
    );
}

#[test]
fn invalid_arguments_are_usage_errors() {
    check(&metaplan(&["plan"]), 2, &["Usage"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--fail", "c_kinekt"]), 2, &["c_kinekt", "c_kinect"]);
    check(
        &metaplan(&["plan", "missions/ugv.toml", "--set", "sunshine=1"]),
        2,
        &["sunshine", "ambient_light"],
    );
    check(
        &metaplan(&["plan", "missions/ugv.toml", "--set", "ambient_light=bright"]),
        2,
        &["not a decimal number"],
    );
    check(&metaplan(&["plan", "missions/ugv.toml", "--scenario", "none"]), 2, &["kinect_failure"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--time-limit", "-1"]), 2, &["negative"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--set", "safety=1"]), 2, &["nothing measures it"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--set", "fd_available fd_aruco=false"]), 2, &["--fail"]);
    check(
        &metaplan(&["plan", "missions/ugv.toml", "--directory", "."]),
        2,
        &["manifest of a mission has keys for them"],
    );
    check(&metaplan(&["reason", "ontology/kb/ugv.ttl", "--directory", "nowhere"]), 2, &["no directory"]);
    check(&metaplan(&["validate", "missions/ugv.toml"]), 2, &["and a plan"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--time-limit", "soon"]), 2, &["not a number of seconds"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--format", "ntriples"]), 2, &[]);
}

#[test]
fn errors_in_settings_do_not_name_a_file() {
    let outcome = metaplan(&["plan", "missions/ugv.toml", "--set", "robot_at=wp99"]);
    check(&outcome, 3, &["wp99", "from a setting"]);
    assert!(!outcome.stderr.contains("problem.pddl"), "{outcome:#?}");
}

#[test]
fn json_messages_have_file_and_line_fields() {
    let mission = copy_of_mission("ugv");
    edit(mission.path(), "ontology/kb/ugv.ttl", "a owl:Ontology ;", "a owl:Ontology ; ; oops");
    let answer =
        metaplan_in(mission.path(), &["reason", "ontology/kb/ugv.ttl", "--format", "json"], "").json();
    let message = &answer["messages"][0];
    assert!(message["file"].as_str().is_some_and(|file| file.ends_with("ontology/kb/ugv.ttl")), "{answer:#}");
    assert!(message["line"].as_i64() > Some(5) && message["code"] == "O102", "{answer:#}");
    assert!(!message["message"].as_str().unwrap_or("").contains("O102"), "{answer:#}");
    std::fs::write(mission.path().join("bad.swrl"), "a b c").expect("a file");
    let arguments = ["reason", "ontology/kb/ugv.ttl", "--rules", "bad.swrl", "--format", "json"];
    let answer = metaplan_in(mission.path(), &arguments, "").json();
    assert_eq!(
        (answer["messages"][0]["file"].as_str(), answer["messages"][0]["line"].as_i64()),
        (Some("bad.swrl"), Some(1))
    );
}

#[test]
fn plan_formats_report_unsolvability_on_standard_error() {
    let outcome =
        metaplan(&["plan", "missions/uuv.toml", "--set", "water_visibility=1", "--plan-format", "ipc"]);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (10, ""));
    assert!(outcome.stderr.contains("no plan exists, proved"), "{outcome:#?}");
}

#[cfg(target_os = "linux")]
#[test]
fn an_answer_that_cannot_be_written_is_an_error() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("the device");
    let status = std::process::Command::new(env!("CARGO_BIN_EXE_metaplan"))
        .args(["plan", "missions/ugv.toml"])
        .current_dir(root())
        .stdout(full)
        .stderr(std::process::Stdio::null())
        .status()
        .expect("the program runs");
    assert_eq!(status.code(), Some(3));
}

#[test]
fn manifests_can_come_from_standard_input() {
    let manifest =
        std::fs::read_to_string(root().join("missions/ugv.toml")).expect("the manifest").replace("../", "");
    check(&metaplan_in(&root(), &["plan", "-", "--scenario", "kinect_failure"], &manifest), 0, &["cost 412"]);
    let unknown = manifest.replace("c_kinect", "c_kinekt");
    check(
        &metaplan_in(&root(), &["plan", "-", "--scenario", "kinect_failure"], &unknown),
        3,
        &["kinect_failure", "c_kinekt"],
    );
    let bound = format!("{manifest}\n[bindings]\nnothing_like_it = \"solves\"\n");
    check(&metaplan_in(&root(), &["plan", "-"], &bound), 0, &["M204", "nothing_like_it"]);
}

#[test]
fn inconsistent_knowledge_is_refused() {
    let mission = copy_of_mission("ugv");
    let old = ":fd_amcl_lidar a owl:NamedIndividual , t:FunctionDesign ;";
    edit(
        mission.path(),
        "ontology/kb/ugv.ttl",
        old,
        ":fd_amcl_lidar a owl:NamedIndividual , t:FunctionDesign , t:Component ;",
    );
    check(
        &metaplan_in(mission.path(), &["plan", "missions/ugv.toml"], ""),
        20,
        &["inconsistent", "fd_amcl_lidar"],
    );
    let outcome = metaplan_in(mission.path(), &["reason", "ontology/kb/ugv.ttl", "--format", "json"], "");
    check(&outcome, 20, &[]);
    assert_eq!(outcome.json()["consistent"], false);
}

#[test]
fn invalid_plans_are_refused_with_the_reason() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).expect("a file");
    file("domain.pddl", DOMAIN);
    file("problem.pddl", PROBLEM);
    let validate =
        |plan: &str| metaplan_in(directory.path(), &["validate", "domain.pddl", "problem.pddl", "-"], plan);
    check(&validate("(go a b)\n(go b c)\n"), 0, &["valid"]);
    check(&validate("(go b c)\n"), 30, &["invalid", "go b c", "(at b)"]);
    check(&validate("(go a b)\n"), 30, &["invalid", "(at c)"]);
    check(&validate("(fly a c)\n"), 30, &["fly"]);
    check(&validate("go a b\n)("), 3, &[":1:"]);
    check(&validate("{\"format\": 1"), 3, &["not JSON"]);
    // A plan becomes invalid if a component fails after planning.
    let plan = metaplan(&["plan", "missions/ugv.toml", "--format", "json"]).stdout;
    let arguments = ["validate", "missions/ugv.toml", "-", "--fail", "c_kinect"];
    check(&metaplan_in(&root(), &arguments, &plan), 30, &["invalid", "fd_available fd_amcl_kinect"]);
}

#[test]
fn reads_standard_input() {
    let kb = std::fs::read_to_string(root().join("ontology/kb/ugv.ttl")).expect("the knowledge base");
    let outcome = metaplan_in(&root(), &["reason", "-", "--rules", "coadaptation", "--fail", "c_lidar"], &kb);
    check(&outcome, 0, &["fd_mrpt_lidar", "not available"]);
    // A certificate contains the knowledge base, which is read again for it.
    let directory = tempfile::tempdir().expect("a temporary directory");
    let certificate = directory.path().join("certificate").display().to_string();
    let files = ["encodings/ugv/domain.pddl", "encodings/ugv/problem.pddl", "--kb"];
    let arguments = [&["plan"][..], &files, &["-", "--certificate", &certificate]].concat();
    let outcome = metaplan_in(&root(), &arguments, &kb);
    check(&outcome, 3, &["M120", "standard input"]);
    assert_eq!(outcome.stdout, "");
}

#[test]
fn metrics_without_a_best_value_get_a_bounded_reading() {
    let domain = "(define (domain d) (:requirements :fluents) (:predicates (p)) (:functions (profit))
      (:action earn :parameters () :precondition () :effect (and (p) (increase (profit) 3)))
      (:action waste :parameters () :precondition () :effect (and (p) (increase (profit) 1))))";
    let problem =
        "(define (problem x) (:domain d) (:init (= (profit) 0)) (:goal (p)) (:metric maximize (profit)))";
    let outcome = plan(domain, problem, &["--format", "json"]);
    check(&outcome, 1, &[]);
    let answer = outcome.json();
    assert_eq!(
        (answer["cost"].as_i64(), answer["unbounded"].as_str()),
        (Some(3), Some("proved")),
        "{answer:#}"
    );
    assert_eq!((answer["status"].as_str(), answer["lower_bound"].as_null()), (Some("feasible"), Some(())));
}

#[test]
fn numbers_of_any_size_are_supported() {
    let domain = "(define (domain d) (:requirements :fluents) (:predicates (p)) (:functions (total-cost) (big) (level))
      (:action dear :parameters () :precondition (<= (level) 1)
        :effect (and (p) (increase (total-cost) (* (big) (big)))))
      (:action halve :parameters () :precondition () :effect (and (scale-up (level) 0.5) (increase (total-cost) 0.1))))";
    let problem = "(define (problem x) (:domain d) (:init (= (total-cost) 0) (= (big) 18446744073709551616) (= (level) 3))
      (:goal (p)) (:metric minimize (total-cost)))";
    let outcome = plan(domain, problem, &["-v"]);
    check(&outcome, 0, &["planned by search alone", "too large after scaling", "`dear`"]);
    assert!(
        outcome.stdout.contains("cost 340282366920938463463374607431768211456.2: optimal"),
        "{outcome:?}"
    );
    // Options that planning with exact rationals does not support are refused.
    let directory = tempfile::tempdir().expect("a directory");
    let certificate = directory.path().join("certificate").display().to_string();
    check(
        &plan(domain, problem, &["--certificate", &certificate]),
        3,
        &["M120", "`halve` multiplies a number by a fraction"],
    );
    for (options, omitted) in [
        (&["--alternatives", "3"][..], "`--alternatives`"),
        (&["--engine", "sat"], "`--engine sat`"),
        (&["--confirm"], "`--confirm`"),
        (&["--alternatives", "3", "--confirm"], "`--alternatives` and `--confirm`"),
        (&["--minimize", "total-cost", "--minimize", "big"], "a second objective"),
        (&["--pareto", "total-cost,big"], "`--pareto`"),
    ] {
        let help = format!("without {omitted}, planning uses exact rationals");
        check(&plan(domain, problem, options), 3, &["E304", &help]);
    }
}

/// An error in an objective of the command line has its position in the text of the objective. An error in the metric of
/// a problem has its position in the file.
#[test]
fn errors_in_objectives_have_their_positions() {
    let domain =
        "(define (domain d) (:requirements :fluents) (:predicates (p)) (:functions (cost) (risk) (zero))
      (:action a :parameters () :precondition () :effect (and (p) (increase (cost) 1) (increase (risk) 1))))";
    let problem = |metric: &str| {
        format!(
            "(define (problem x) (:domain d) (:init (= (cost) 0) (= (risk) 0) (= (zero) 0)) (:goal (p))\n{metric})"
        )
    };
    let large = format!("(* 1{} (risk))", "0".repeat(40));
    let nonlinear = "error[E303]: the expression is not linear in the fluents that actions change";
    let divided = "error[E303]: the divisor is 0, so the expression has no value";
    for (options, place, text) in [
        (&["--minimize", "(* (cost) (risk))"][..], "objective:1:1", nonlinear),
        (&["--minimize", "(+ 1 (/ (cost) (risk)))"], "objective:1:6", nonlinear),
        (&["--minimize", "(+ 1 (/ (cost) 0))"], "objective:1:6", divided),
        (&["--minimize", "(/ (cost) (zero))"], "objective:1:1", divided),
        (&["--minimize", "cost", "--minimize", "(+ (risk) (/ 1 (zero)))"], "objective:1:11", divided),
        (&["--pareto", "cost,(+ 2 (* (risk) (risk)))"], "objective:1:6", nonlinear),
        (
            &["--minimize", "cost", "--minimize", &large],
            "objective:1:1",
            "error[E304]: the objective (`a`): a number",
        ),
    ] {
        let outcome = plan(domain, &problem(""), options);
        check(&outcome, 3, &[]);
        let line = format!("{place}: {text}");
        assert!(headlines(&outcome.stderr).contains(&line), "{options:?}: {outcome:#?}");
    }
    for (metric, text) in [("(* (cost) (risk))", nonlinear), ("(/ (cost) 0)", divided)] {
        let outcome = plan(domain, &problem(&format!("(:metric minimize {metric})")), &[]);
        check(&outcome, 3, &[]);
        let line = format!("problem.pddl:2:19: {text}");
        assert!(headlines(&outcome.stderr).contains(&line), "{metric}: {outcome:#?}");
    }
}

#[test]
fn all_solvers_give_the_same_answer() {
    let cheapest = metaplan(&["plan", "missions/ugv.toml"]);
    for solver in planner::Backend::BUILT_IN {
        let answer = metaplan(&["plan", "missions/ugv.toml", "--solver", solver]);
        assert_eq!((answer.status, &answer.stdout), (0, &cheapest.stdout), "{solver}");
    }
    for encoding in ["sequential", "for-all-step", "exists-step"] {
        let answer = metaplan(&["plan", "missions/uuv.toml", "--encoding", encoding]);
        check(&answer, 0, &["optimal, proved"]);
    }
    for strategy in ["auto", "tighten", "cores"] {
        let answer = metaplan(&["plan", "missions/ugv.toml", "--strategy", strategy]);
        assert_eq!((answer.status, &answer.stdout), (0, &cheapest.stdout), "{strategy}");
    }
    let answer = metaplan(&["plan", "missions/ugv.toml", "--solver", "no-such-solver -q"]);
    check(&answer, 2, &["M113", "`no-such-solver` cannot be used", "varisat, batsat"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--solver", " "]), 2, &["needs a name"]);
}

#[test]
fn open_durations_exclude_timed_initial_literals() {
    let domain =
        "(define (domain d) (:requirements :durative-actions :duration-inequalities :timed-initial-literals)
  (:predicates (ready) (done))
  (:durative-action work :parameters () :duration (>= ?duration 3)
    :condition (at start (ready)) :effect (at end (done))))";
    let problem = |init: &str| format!("(define (problem p) (:domain d) (:init {init}) (:goal (done)))");
    check(&plan(domain, &problem("(ready)"), &[]), 0, &["cost 3", "optimal, proved"]);
    let timed = plan(domain, &problem("(at 2 (ready))"), &[]);
    check(&timed, 3, &["E301", "`(>= ?duration …)` without timed initial literals"]);
}

#[test]
fn search_alone_confirms_nothing() {
    let search = ["plan", "missions/ugv.toml", "--engine", "search"];
    check(&metaplan(&search), 0, &["optimal, proved"]);
    check(
        &metaplan(&[&search[..], &["--confirm"]].concat()),
        2,
        &["M107", "`--confirm`", "`--engine search`"],
    );
}

#[test]
#[cfg(unix)]
fn claims_of_external_solvers_are_not_proofs() {
    let directory = tempfile::tempdir().expect("a directory");
    let script = directory.path().join("solver.sh");
    // The script answers correctly only while the program tests whether it is a usable solver.
    let text = "case $(grep -vc '^p') in 1) printf 's SATISFIABLE\\nv 1 0\\n'; exit 10;; *) echo s UNSATISFIABLE; exit $1;; esac";
    std::fs::write(&script, text).expect("a file");
    let plan = |status: &str, options: &[&str]| {
        let solver = format!("sh {} {status}", script.display());
        metaplan(&[&["plan", "missions/ugv.toml", "--solver", &solver], options].concat())
    };
    let unchecked = plan("20", &["--horizon", "2"]);
    check(&unchecked, 11, &["no plan with up to 2 steps, according to `sh ", "solver.sh 20`, not checked"]);
    // A claim that the search has already proved does not depend on the external solver.
    check(&plan("20", &[]), 0, &["optimal, proved: the"]);
    check(&plan("7", &[]), 2, &["cannot be used", "it failed: exit status: 7"]);
}

#[test]
fn memory_is_limited() {
    check(&metaplan(&["plan", "missions/ugv.toml", "--memory-limit", "0"]), 2, &["0 is not in"]);
    check(&metaplan(&["plan", "missions/ugv.toml", "--memory-limit", "4000"]), 0, &["optimal, proved"]);
    let memory_limit = ["--memory-limit", "40"];
    check(
        &plan(&sliding_tiles(""), &tiles_in_reverse(), &memory_limit),
        12,
        &["a limit was reached", "no plan has a better metric than"],
    );
    let help = "(:action ask_for_help :parameters () :effect (and (solved) (increase (total-cost) 1000)))";
    let suboptimal = plan(&sliding_tiles(help), &tiles_in_reverse(), &memory_limit);
    check(&suboptimal, 1, &["ask_for_help", "cost 1000", "not proved optimal"]);
}

/// Returns the domain of the 15-puzzle, whose state space no search exhausts, with an additional action.
fn sliding_tiles(extra_action: &str) -> String {
    let goal_atoms: Vec<String> = (1..16).map(|tile| format!("(on t{tile} c{tile})")).collect();
    let constants: Vec<String> = (1..16).map(|tile| format!("t{tile} - tile c{tile} - cell")).collect();
    format!(
        "(define (domain tiles) (:requirements :typing :action-costs) (:types tile cell)
          (:constants {constants})
          (:predicates (on ?t - tile ?c - cell) (blank ?c - cell) (beside ?a ?b - cell) (solved))
          (:functions (total-cost) - number)
          {extra_action}
          (:action finish :parameters () :precondition (and {goal_atoms}) :effect (solved))
          (:action slide :parameters (?t - tile ?from ?to - cell)
            :precondition (and (beside ?from ?to) (on ?t ?from) (blank ?to))
            :effect (and (not (on ?t ?from)) (not (blank ?to)) (on ?t ?to) (blank ?from) (increase (total-cost) 1))))",
        constants = constants.join(" "),
        goal_atoms = goal_atoms.join(" "),
    )
}

fn tiles_in_reverse() -> String {
    let place = |tile: i32| (tile / 4, tile % 4);
    let is_adjacent = |a: i32, b: i32| (place(a).0 - place(b).0).abs() + (place(a).1 - place(b).1).abs() == 1;
    let pairs = (0..16).flat_map(|a| (0..16).map(move |b| (a, b))).filter(|(a, b)| is_adjacent(*a, *b));
    let pairs: Vec<String> = pairs.map(|(a, b)| format!("(beside c{a} c{b})")).collect();
    let tiles: Vec<String> = (1..16).map(|tile| format!("(on t{tile} c{})", 16 - tile)).collect();
    format!(
        "(define (problem p) (:domain tiles) (:objects c0 - cell)
          (:init (blank c0) (= (total-cost) 0) {} {}) (:goal (solved)) (:metric minimize (total-cost)))",
        pairs.join(" "),
        tiles.join(" ")
    )
}

#[test]
fn alternatives_are_listed_with_forced_steps() {
    let unique = metaplan(&["plan", "missions/ugv.toml", "--alternatives", "3"]);
    check(
        &unique,
        0,
        &[
            "no other plan is equally good, apart from plans with idle actions",
            "step 1: in every equally good plan: move",
        ],
    );
    let problem = PROBLEM.replace("(way b c)", "(way b c) (way a d) (way d c)").replace("a b c", "a b c d");
    let answer = plan(DOMAIN, &problem, &["--alternatives", "5"]);
    check(
        &answer,
        0,
        &[
            "alternative 1",
            "go a d",
            "no other equally good plans, apart from plans with idle actions",
            "step 1: in every equally good plan: nothing",
        ],
    );
    let answer = plan(DOMAIN, &problem, &["--alternatives", "0", "--format", "json"]).json();
    assert_eq!(answer["alternatives"]["plans"].as_array().map(Vec::len), Some(0), "{answer:#}");
    assert_eq!(answer["alternatives"]["complete"].as_bool(), Some(false), "{answer:#}");
    assert_eq!(answer["alternatives"]["forced"][0]["action"].as_bool(), Some(false), "{answer:#}");
}

/// A free action whose effect nothing reads yields further plans of equal cost. Such plans do not count as
/// alternatives.
#[test]
fn alternatives_exclude_idle_actions() {
    let domain = "(define (domain d) (:predicates (p) (q) (seen)) (:functions (total-cost))
      (:action look :effect (seen))
      (:action a :effect (and (p) (increase (total-cost) 1)))
      (:action b :precondition (p) :effect (and (q) (increase (total-cost) 1))))";
    let problem = "(define (problem p) (:domain d) (:init (= (total-cost) 0)) (:goal (q))
      (:metric minimize (total-cost)))";
    let answer = plan(domain, problem, &["--alternatives", "5"]);
    let idle = "idle actions are not counted: they cost nothing, and nothing depends on their effects";
    check(
        &answer,
        0,
        &[
            "proved: no other plan is equally good, apart from plans with idle actions",
            "step 1: in every equally good plan",
            idle,
        ],
    );
}
