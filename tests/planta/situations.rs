//! Tests of failures, measurements, commands and maps for missions in PLANTA's form.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{Seek as _, Write as _};
use std::path::Path;
use std::process::Command;

use metaplan::mission::Planning;
use pddl::ast::{InitialElement, Problem, Term};
use serde_json::Value;
use test_resources::{data, data_path};

use crate::brute::Task;
use crate::files::{Input, metaplan, parsed, real};

pub fn extended(real: &Path) -> Input {
    Input {
        domain: real.join("pddl/suave_planta/suave_domain_extended.pddl"),
        problem: real.join("pddl/suave_planta/suave_problem_extended.pddl"),
        knowledge: real.join("owl/suave_planta/suave_extended.owl"),
        directory: real.join("owl/pddl_tomasys"),
    }
}

/// Problems that PLANTA's generator has made; they are not published.
const GRID: &str = "real/planta/grid";

fn grid(real: &Path, nodes: &str, with_designs: bool) -> Input {
    let suffix = if with_designs { "" } else { "_no_sas" };
    let domain = if with_designs { "domain_sas.pddl" } else { "domain_no_sas.pddl" };
    Input {
        domain: real.join("pddl/navigation_planta").join(domain),
        problem: data_path(GRID).join(format!("grid-{nodes}-1/problem{suffix}.pddl")),
        knowledge: real.join("owl/navigation_planta/navigation.owl"),
        directory: real.join("owl/pddl_tomasys"),
    }
}

/// Plans with the program and returns its answer. Panics unless optimality is proved.
fn plan(input: &Input, options: &[&str]) -> Value {
    let (status, stdout, stderr) =
        metaplan(&input.arguments("plan", &[&["--format", "json"], options].concat()));
    assert_eq!(status, 0, "{stdout}{stderr}");
    let answer: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(answer["status"], "optimal", "{answer}");
    answer
}

fn arguments_of_steps(answer: &Value) -> BTreeSet<String> {
    let steps = answer["steps"].as_array().expect("steps").iter();
    let arguments = steps.flat_map(|step| step["arguments"].as_array().expect("arguments"));
    arguments.filter_map(Value::as_str).map(ToOwned::to_owned).collect()
}

#[test]
fn knowledge_base_determines_the_designs_of_plans() {
    let Some(real) = real() else { return };
    let input = extended(&real);
    // Options, number of steps, a design or action in the plan, and a design or action that is not in the
    // plan.
    let cases: [(&[&str], usize, &str, &str); 4] = [
        (&[], 7, "fd_all_thrusters", "fd_recover_thrusters"),
        (&["--fail", "c_thruster_1"], 7, "fd_recover_thrusters", "fd_all_thrusters"),
        (&["--set", "water_visibility=1.5"], 7, "fd_spiral_low", "fd_spiral_high"),
        (&["--set", "battery_level=0.2"], 10, "generate_recharge_path", "fd_spiral_low"),
    ];
    for (situation, steps, used, unused) in cases {
        let answer = plan(&input, situation);
        assert_eq!(answer["steps"].as_array().map(Vec::len), Some(steps), "{situation:?}");
        let arguments = arguments_of_steps(&answer);
        assert!(arguments.contains(used) && !arguments.contains(unused), "{situation:?}: {arguments:?}");
    }
}

#[test]
fn a_situation_has_the_state_space_of_its_export() {
    compare_with_export(Some("c_thruster_3"), Some("2.5"));
}

#[test]
#[ignore = "20 s each, without optimisation"]
fn further_situations_have_the_state_space_of_their_export() {
    compare_with_export(Some("c_thruster_1"), None);
    compare_with_export(None, Some("1.5"));
}

/// Explores the narrowed and the exported problem of a situation, and compares their transitions and the
/// lengths of their best plans.
fn compare_with_export(failed_component: Option<&str>, visibility: Option<&str>) {
    let Some(real) = real() else { return };
    let input = extended(&real);
    let mut mission = input.mission();
    if let Some(component) = failed_component {
        mission.fail(component).expect("a component");
    }
    if let Some(value) = visibility {
        mission.set("water_visibility", value).expect("an attribute");
    }
    let (filled, _) = mission.filled().expect("a problem");
    let exported = Task::new(mission.domain(), &filled).explore(20_000).expect("few states");
    let (domain, problem) = mission.narrowed(&filled);
    let narrowed = Task::new(&domain, &problem).explore(20_000).expect("few states");
    assert_eq!(narrowed.steps, exported.steps, "{failed_component:?} {visibility:?}");
    assert_eq!(narrowed.least_steps, exported.least_steps, "{failed_component:?} {visibility:?}");
}

#[test]
fn certificates_are_verified() {
    let Some(real) = real() else { return };
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mut cases: Vec<(Input, &[&str])> = vec![(extended(&real), &["--set", "water_visibility=1.5"])];
    if data(GRID).is_some() {
        cases.push((grid(&real, "50", true), &["--fail", "c_kinect"]));
        cases.push((grid(&real, "50", false), &[]));
    }
    for (number, (input, situation)) in cases.iter().enumerate() {
        let path = directory.path().join(number.to_string());
        let path = path.to_str().expect("UTF-8");
        plan(input, &[&["--certificate", path], *situation].concat());
        let (status, stdout, stderr) = metaplan(&["verify", path]);
        assert_eq!(status, 0, "{stdout}{stderr}");
        let text = std::fs::read_to_string(Path::new(path).join("domain.pddl")).expect("the domain");
        assert!(!text.contains("possible-"), "the domain before narrowing");
        assert!(stdout.contains("trusted without a check: the "), "{stdout}");
    }
}

#[test]
fn manifests_support_scenarios_explanations_and_the_loop() {
    let Some(real) = real() else { return };
    let input = extended(&real);
    let directory = tempfile::tempdir().expect("a temporary directory");
    let manifest = directory.path().join("suave.toml");
    let text = format!(
        "name = \"suave\"\n[knowledge]\nfiles = [{:?}]\ndirectories = [{:?}]\n[planning]\ndomain = {:?}\nproblem = {:?}\n\
         [scenarios.murky]\nset = {{ water_visibility = 1.5 }}\n",
        input.knowledge, input.directory, input.domain, input.problem
    );
    std::fs::write(&manifest, text).expect("a file");
    let manifest = manifest.to_str().expect("UTF-8");
    let run = |arguments: &[&str]| {
        let (status, stdout, stderr) = metaplan(arguments);
        assert_eq!(status, 0, "{arguments:?}: {stdout}{stderr}");
        stdout
    };
    let murky = run(&["plan", manifest, "--scenario", "murky", "--quiet"]);
    assert!(murky.contains("fd_spiral_low"), "{murky}");
    let explained = run(&["explain", manifest, "fd_spiral_high", "--scenario", "murky", "--quiet"]);
    assert!(explained.contains("fd_spiral_high (f_generate_search_path) is not available"), "{explained}");
    // The explanation describes the plan with this design, in which no other search design is used.
    let (_, hypothetical) = explained.split_once("if it were available").expect("what would be");
    assert!(hypothetical.contains("f_generate_search_path = fd_spiral_high"), "{explained}");
    assert!(!hypothetical.contains("fd_spiral_low"), "{explained}");
    // A reported failure changes facts that are evaluated before planning.
    let answers =
        run_with(manifest, r#"{"event":"component_status","component":"c_thruster_1","status":"ERROR"}"#);
    let plans: Vec<&Value> = answers.iter().filter(|answer| answer["answer"] == "plan_found").collect();
    let [before, after] = plans[..] else { panic!("{answers:#?}") };
    assert!(arguments_of_steps(before).contains("fd_all_thrusters"), "{before}");
    let after = arguments_of_steps(after);
    assert!(after.contains("fd_recover_thrusters") && !after.contains("fd_all_thrusters"), "{after:?}");
}

fn run_with(manifest: &str, line: &str) -> Vec<Value> {
    run(&["run", manifest, "--quiet"], line)
}

/// Runs a command and returns its answers to one input line. The line comes from a file, so that the loop
/// sends the first plan before it reads the line.
pub fn run(arguments: &[&str], line: &str) -> Vec<Value> {
    let mut input = tempfile::tempfile().expect("a temporary file");
    input.write_all(line.as_bytes()).and_then(|()| input.rewind()).expect("a line");
    let output = Command::new(env!("CARGO_BIN_EXE_metaplan"))
        .args(arguments)
        .stdin(input)
        .output()
        .expect("the program runs");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

#[test]
fn missing_knowledge_base_is_reported_with_a_remedy() {
    let Some(real) = real() else { return };
    let input = extended(&real);
    let path = |path: &Path| path.display().to_string();
    let (domain, problem) = (path(&input.domain), path(&input.problem));
    let (status, _, stderr) = metaplan(&["plan", &domain, &problem]);
    assert_ne!(status, 0);
    assert!(stderr.contains("P134") && stderr.contains("`--kb FILE`"), "{stderr}");
    // If the knowledge base lacks the names, the message lists them.
    let unrelated = path(&real.join("owl/pddl_tomasys/pddl.owl"));
    let (status, _, stderr) = metaplan(&["plan", &domain, &problem, "--kb", &unrelated]);
    assert_ne!(status, 0);
    assert!(stderr.contains("M215") && stderr.contains("`inferred-SolvesF`"), "{stderr}");
}

fn facts<'p>(problem: &'p Problem, predicate: &str) -> Vec<Vec<&'p str>> {
    let name = |term: &'p Term| match term {
        Term::Variable(identifier) | Term::Constant(identifier) => identifier.name.as_str(),
    };
    let rows = problem.init.iter().filter_map(|element| match element {
        InitialElement::Fact(atom) if atom.predicate.name.as_str().eq_ignore_ascii_case(predicate) => {
            Some(atom.arguments.iter().map(name).collect())
        }
        _ => None,
    });
    rows.collect()
}

/// Accuracy and light of the designs in PLANTA's navigation mission, in hundredths, from its knowledge base.
const DESIGNS: [(u32, u32); 6] = [(100, 0), (90, 0), (80, 0), (80, 100), (70, 0), (60, 0)];

/// Returns the minimum number of moves and reconfigurations, by breadth-first search over place and current
/// design. A corridor requires a minimum accuracy and light. Among the designs that satisfy both requirements, the most
/// accurate one must be current.
fn least_with_designs(problem: &Problem) -> usize {
    let amount =
        |name: &str| (name.trim_end_matches("_decimal").parse::<f64>().expect("a number") * 100.0) as u32;
    let requirements = |predicate: &str| -> BTreeMap<(String, String), u32> {
        let rows = facts(problem, predicate).into_iter();
        rows.map(|row| ((row[0].to_owned(), row[1].to_owned()), amount(row[2]))).collect()
    };
    let (safety, light) = (requirements("safety_requirement"), requirements("light_requirement"));
    let corridors = facts(problem, "corridor");
    let start = facts(problem, "robot_at")[0][0].to_owned();
    let goal = format!("{:?}", problem.goal);
    let mut visited: BTreeSet<(String, Option<usize>)> = BTreeSet::from([(start.clone(), None)]);
    let mut open = VecDeque::from([(start, None, 0)]);
    while let Some((place, design, steps)) = open.pop_front() {
        if goal.contains(&format!("\"{place}\"")) {
            return steps;
        }
        let mut successors: Vec<(String, Option<usize>)> =
            (0..DESIGNS.len()).map(|new_design| (place.clone(), Some(new_design))).collect();
        for row in corridors.iter().filter(|row| row[0] == place) {
            let key = (row[0].to_owned(), row[1].to_owned());
            let (Some(safe), Some(bright)) = (safety.get(&key), light.get(&key)) else { continue };
            let satisfies = |candidate: &(u32, u32)| candidate.0 >= *safe && candidate.1 >= *bright;
            let best =
                DESIGNS.iter().filter(|candidate| satisfies(candidate)).map(|candidate| candidate.0).max();
            if design.is_some_and(|candidate: usize| {
                satisfies(&DESIGNS[candidate]) && Some(DESIGNS[candidate].0) == best
            }) {
                successors.push((row[1].to_owned(), design));
            }
        }
        for (place, design) in successors {
            if visited.insert((place.clone(), design)) {
                open.push_back((place, design, steps + 1));
            }
        }
    }
    panic!("the goal is not reached")
}

fn least_moves(problem: &Problem) -> usize {
    let corridors = facts(problem, "corridor");
    let goal = format!("{:?}", problem.goal);
    let mut layer = BTreeSet::from([facts(problem, "robot_at")[0][0]]);
    for steps in 0.. {
        if layer.iter().any(|place| goal.contains(&format!("\"{place}\""))) {
            return steps;
        }
        let previous = layer.clone();
        layer.extend(corridors.iter().filter(|row| previous.contains(row[0])).map(|row| row[1]));
        assert_ne!(previous, layer, "the goal is not reached");
    }
    unreachable!("it ends above")
}

#[test]
fn all_maps_of_the_study_are_planned_optimally() {
    let (Some(real), Some(_)) = (real(), data(GRID)) else { return };
    for nodes in ["10", "50", "100", "200", "400", "1000"] {
        for with_designs in [true, false] {
            let input = grid(&real, nodes, with_designs);
            let answer = plan(&input, &[]);
            let (_, problem) = parsed(&input.domain, &input.problem);
            let least_steps = if with_designs { least_with_designs(&problem) } else { least_moves(&problem) };
            let plan_length = answer["steps"].as_array().map(Vec::len);
            assert_eq!(plan_length, Some(least_steps), "{nodes} nodes, with designs: {with_designs}");
        }
    }
}

/// Different individuals, classes and values of a knowledge base must not become one object or predicate.
#[test]
fn names_that_are_equal_in_pddl_are_refused() {
    let domain = "(define (domain d) (:requirements :adl :derived-predicates) (:predicates (done ?x))
        (:action a :parameters (?x) :precondition (and (inferred-Ca ?x) (inferred-Cb ?x)) :effect (done ?x)))";
    let problem = "(define (problem p) (:domain d) (:objects o1) (:init) (:goal (done i0)))";
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = |name: &str, text: &str| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    let (domain, problem) = (file("domain.pddl", domain), file("problem.pddl", problem));
    let check = |axioms: &str, status: i32, words: &[&str]| {
        let text = format!(
            "Prefix(:=<http://e.org/k#>)\nPrefix(o:=<http://o.org/k#>)\nOntology(<http://e.org/k>
             Declaration(Class(:Ca)) Declaration(Class(:Cb)) Declaration(DataProperty(:pd))
             Declaration(NamedIndividual(:i0)) ClassAssertion(:Ca :i0) {axioms})"
        );
        let knowledge = file("kb.ofn", &text);
        let (actual, _, stderr) = metaplan(&["plan", &domain, &problem, "--kb", &knowledge, "--quiet"]);
        assert_eq!(actual, status, "{axioms}: {stderr}");
        for word in words {
            assert!(stderr.contains(word), "{axioms}: no `{word}`: {stderr}");
        }
    };
    check("ClassAssertion(:Cb :i0)", 0, &[]);
    check("ClassAssertion(:Cb :I0)", 3, &["M225", "<http://e.org/k#i0>", "<http://e.org/k#I0>"]);
    check("ClassAssertion(:Cb o:i0)", 3, &["M225", "<http://e.org/k#i0>", "<http://o.org/k#i0>"]);
    check(
        "Declaration(Class(o:Cb)) ClassAssertion(o:Cb :i0)",
        3,
        &["M225", "<http://e.org/k#Cb>", "<http://o.org/k#Cb>"],
    );
    let values =
        "DataPropertyAssertion(:pd :i0 \"hello world\") DataPropertyAssertion(:pd :i0 \"hello_world\")";
    let used = format!("DataPropertyDomain(:pd :Cb) {values}");
    check(&used, 3, &["M225", "\"hello world\"", "\"hello_world\""]);
    // What the domain does not use may have equal names.
    check(&format!("ClassAssertion(:Cb :i0) {values}"), 0, &[]);
    let classes =
        "Declaration(Class(:Cc)) Declaration(Class(o:Cc)) SubClassOf(:Cb o:Cc) ClassAssertion(o:Cc :i0)";
    check(&format!("ClassAssertion(:Cb :i0) {classes}"), 0, &[]);
    // An individual and a class may have one name, because objects and predicates are different in PDDL.
    check("ClassAssertion(:Cb :i0) ClassAssertion(:Cb :ca)", 0, &[]);
    check("ClassAssertion(:Cb :i0) ClassAssertion(:Cb o:i0) SameIndividual(:i0 o:i0)", 0, &[]);
    check(
        "ClassAssertion(:Cb :i0) ClassAssertion(:Cb o:i0) SameIndividual(:i0 :j) SameIndividual(:j o:i0)",
        0,
        &[],
    );
}

#[test]
fn settings_do_not_remove_facts_of_the_knowledge_base() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let file = |name: &str, text: &str| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    let domain = file(
        "domain.pddl",
        "(define (domain d) (:requirements :adl :derived-predicates) (:predicates (done ?x))
          (:action pass :parameters (?x) :precondition (and (inferred-Open ?x) (inferred-DockedAt ?x d1))
            :effect (done ?x)))",
    );
    let problem = file(
        "problem.pddl",
        "(define (problem p) (:domain d) (:objects o1) (:init (Open d2)) (:goal (done door)))",
    );
    let knowledge = file(
        "kb.ofn",
        "Prefix(:=<http://e.org/k#>)\nOntology(<http://e.org/k>
         Declaration(Class(:Open)) Declaration(ObjectProperty(:dockedAt)) Declaration(NamedIndividual(:door))
         ClassAssertion(:Open :door) ObjectPropertyAssertion(:dockedAt :door :d1)
         ObjectPropertyAssertion(:dockedAt :d2 :d2))",
    );
    for (setting, status, words) in [
        ("Open door=false", 2, "the knowledge base states `(Open door)`"),
        ("dockedAt door d1=false", 2, "the knowledge base states `(dockedAt door d1)`"),
        ("dockedAt door=d2", 2, "the knowledge base states `(dockedAt door d1)`"),
        ("dockedAt door=d1", 0, ""),
        ("Open d2=false", 0, ""),
        ("Open d1=true", 0, ""),
    ] {
        let (actual, _, stderr) =
            metaplan(&["plan", &domain, &problem, "--kb", &knowledge, "--set", setting, "--quiet"]);
        assert_eq!(actual, status, "{setting}: {stderr}");
        assert!(stderr.contains(words), "{setting}: {stderr}");
    }
}
