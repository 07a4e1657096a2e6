//! What fails, what is measured, and what is asked of a mission in PLANTA's form; and its maps.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{Seek as _, Write as _};
use std::path::Path;
use std::process::Command;

use metaplan::mission::Planning;
use pddl::ast::{InitialElement, Problem, Term};
use serde_json::Value;

use crate::brute::Task;
use crate::files::{Input, metaplan, parsed, real};

fn extended(real: &Path) -> Input {
    Input {
        domain: real.join("pddl/suave_planta/suave_domain_extended.pddl"),
        problem: real.join("pddl/suave_planta/suave_problem_extended.pddl"),
        knowledge: real.join("owl/suave_planta/suave_extended.owl"),
        directory: real.join("owl/pddl_tomasys"),
    }
}

fn grid(real: &Path, nodes: &str, with_designs: bool) -> Input {
    let suffix = if with_designs { "" } else { "_no_sas" };
    let domain = if with_designs { "domain_sas.pddl" } else { "domain_no_sas.pddl" };
    Input {
        domain: real.join("pddl/navigation_planta").join(domain),
        problem: real.join(format!("planta/grid/grid-{nodes}-1/problem{suffix}.pddl")),
        knowledge: real.join("owl/navigation_planta/navigation.owl"),
        directory: real.join("owl/pddl_tomasys"),
    }
}

/// The best plan as JSON; it must be proved.
fn plan(input: &Input, further: &[&str]) -> Value {
    let (status, stdout, stderr) =
        metaplan(&input.arguments("plan", &[&["--format", "json"], further].concat()));
    assert_eq!(status, 0, "{stdout}{stderr}");
    let answer: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(answer["status"], "optimal", "{answer}");
    answer
}

/// The arguments of all steps.
fn mentioned(answer: &Value) -> BTreeSet<String> {
    let steps = answer["steps"].as_array().expect("steps").iter();
    let arguments = steps.flat_map(|step| step["arguments"].as_array().expect("arguments"));
    arguments.filter_map(Value::as_str).map(ToOwned::to_owned).collect()
}

#[test]
fn the_knowledge_base_decides_which_designs_are_grounded() {
    let Some(real) = real() else { return };
    let input = extended(&real);
    // The situation, the number of steps, what the plan uses and what not.
    let cases: [(&[&str], usize, &str, &str); 4] = [
        (&[], 7, "fd_all_thrusters", "fd_recover_thrusters"),
        (&["--fail", "c_thruster_1"], 7, "fd_recover_thrusters", "fd_all_thrusters"),
        (&["--set", "water_visibility=1.5"], 7, "fd_spiral_low", "fd_spiral_high"),
        (&["--set", "battery_level=0.2"], 10, "generate_recharge_path", "fd_spiral_low"),
    ];
    for (situation, steps, used, unused) in cases {
        let answer = plan(&input, situation);
        assert_eq!(answer["steps"].as_array().map(Vec::len), Some(steps), "{situation:?}");
        let all = mentioned(&answer);
        assert!(all.contains(used) && !all.contains(unused), "{situation:?}: {all:?}");
    }
}

#[test]
fn a_situation_is_that_of_the_merged_files() {
    let Some(real) = real() else { return };
    let input = extended(&real);
    let situations: [(Option<&str>, Option<&str>); 3] =
        [(Some("c_thruster_1"), None), (None, Some("1.5")), (Some("c_thruster_3"), Some("2.5"))];
    for (failed, visibility) in situations {
        let mut mission = input.mission();
        if let Some(component) = failed {
            mission.fail(component).expect("a component");
        }
        if let Some(value) = visibility {
            mission.set("water_visibility", value).expect("an attribute");
        }
        let (filled, _) = mission.filled().expect("a problem");
        let exported = Task::new(mission.domain(), &filled).explore(20_000).expect("few states");
        let (domain, problem) = mission.narrowed(&filled);
        let narrowed = Task::new(&domain, &problem).explore(20_000).expect("few states");
        assert_eq!(narrowed.steps, exported.steps, "{failed:?} {visibility:?}");
        assert_eq!(narrowed.least, exported.least, "{failed:?} {visibility:?}");
    }
}

#[test]
fn certificates_of_such_missions_are_verified() {
    let Some(real) = real() else { return };
    let directory = tempfile::tempdir().expect("a temporary directory");
    let cases: [(Input, &[&str]); 3] = [
        (extended(&real), &["--set", "water_visibility=1.5"]),
        (grid(&real, "50", true), &["--fail", "c_kinect"]),
        (grid(&real, "50", false), &[]),
    ];
    for (number, (input, situation)) in cases.iter().enumerate() {
        let path = directory.path().join(number.to_string());
        let path = path.to_str().expect("UTF-8");
        plan(input, &[&["--certificate", path], *situation].concat());
        let (status, stdout, stderr) = metaplan(&["verify", path]);
        assert_eq!(status, 0, "{stdout}{stderr}");
        let text = std::fs::read_to_string(Path::new(path).join("domain.pddl")).expect("the domain");
        assert!(!text.contains("possible-"), "the domain before narrowing");
        assert!(stdout.contains("on trust: the "), "{stdout}");
    }
}

#[test]
fn a_manifest_serves_scenarios_explanations_and_the_loop() {
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
    // With it, and no other one that searches, it is what the plan uses.
    let (_, alone) = explained.split_once("if it were available").expect("what would be");
    assert!(alone.contains("f_generate_search_path = fd_spiral_high"), "{explained}");
    assert!(!alone.contains("fd_spiral_low"), "{explained}");
    // A report of the robot changes what is decided before planning.
    let answers =
        run_with(manifest, r#"{"event":"component_status","component":"c_thruster_1","status":"ERROR"}"#);
    let plans: Vec<&Value> = answers.iter().filter(|answer| answer["answer"] == "plan_found").collect();
    let [before, after] = plans[..] else { panic!("{answers:#?}") };
    assert!(mentioned(before).contains("fd_all_thrusters"), "{before}");
    let after = mentioned(after);
    assert!(after.contains("fd_recover_thrusters") && !after.contains("fd_all_thrusters"), "{after:?}");
}

/// What the loop answers to a line.
fn run_with(manifest: &str, line: &str) -> Vec<Value> {
    run(&["run", manifest, "--quiet"], line)
}

/// Answers of the loop to a line, with other arguments. The line comes from a file, so that the first plan comes before it.
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
fn without_a_knowledge_base_it_is_said_what_to_give() {
    let Some(real) = real() else { return };
    let input = extended(&real);
    let path = |path: &Path| path.display().to_string();
    let (domain, problem) = (path(&input.domain), path(&input.problem));
    let (status, _, stderr) = metaplan(&["plan", &domain, &problem]);
    assert_ne!(status, 0);
    assert!(stderr.contains("P134") && stderr.contains("`--kb FILE`"), "{stderr}");
    // And with one that has other names, which they are.
    let other = path(&real.join("owl/pddl_tomasys/pddl.owl"));
    let (status, _, stderr) = metaplan(&["plan", &domain, &problem, "--kb", &other]);
    assert_ne!(status, 0);
    assert!(stderr.contains("M215") && stderr.contains("`inferred-SolvesF`"), "{stderr}");
}

/// The facts of a predicate in a problem.
fn facts<'p>(problem: &'p Problem, predicate: &str) -> Vec<Vec<&'p str>> {
    let name = |term: &'p Term| match term {
        Term::Variable(own) | Term::Constant(own) => own.name.as_str(),
    };
    let own = problem.init.iter().filter_map(|element| match element {
        InitialElement::Fact(atom) if atom.predicate.name.as_str().eq_ignore_ascii_case(predicate) => {
            Some(atom.arguments.iter().map(name).collect())
        }
        _ => None,
    });
    own.collect()
}

/// The designs of PLANTA's navigation with accuracy and light, in hundredths, as its knowledge base has them.
const DESIGNS: [(u32, u32); 6] = [(100, 0), (90, 0), (80, 0), (80, 100), (70, 0), (60, 0)];

/// The least number of moves and reconfigurations, by breadth-first search over place and design: a corridor asks for accuracy and
/// light, and of all designs that have both the most accurate has to be at work.
fn least_with_designs(problem: &Problem) -> usize {
    let amount =
        |name: &str| (name.trim_end_matches("_decimal").parse::<f64>().expect("a number") * 100.0) as u32;
    let needs = |predicate: &str| -> BTreeMap<(String, String), u32> {
        let own = facts(problem, predicate).into_iter();
        own.map(|row| ((row[0].to_owned(), row[1].to_owned()), amount(row[2]))).collect()
    };
    let (safety, light) = (needs("safety_requirement"), needs("light_requirement"));
    let corridors = facts(problem, "corridor");
    let start = facts(problem, "robot_at")[0][0].to_owned();
    let goal = format!("{:?}", problem.goal);
    let mut seen: BTreeSet<(String, Option<usize>)> = BTreeSet::from([(start.clone(), None)]);
    let mut open = VecDeque::from([(start, None, 0)]);
    while let Some((place, design, steps)) = open.pop_front() {
        if goal.contains(&format!("\"{place}\"")) {
            return steps;
        }
        let mut next: Vec<(String, Option<usize>)> =
            (0..DESIGNS.len()).map(|other| (place.clone(), Some(other))).collect();
        for row in corridors.iter().filter(|row| row[0] == place) {
            let key = (row[0].to_owned(), row[1].to_owned());
            let (Some(safe), Some(bright)) = (safety.get(&key), light.get(&key)) else { continue };
            let meets = |own: &(u32, u32)| own.0 >= *safe && own.1 >= *bright;
            let best = DESIGNS.iter().filter(|own| meets(own)).map(|own| own.0).max();
            if design.is_some_and(|own: usize| meets(&DESIGNS[own]) && Some(DESIGNS[own].0) == best) {
                next.push((row[1].to_owned(), design));
            }
        }
        for (place, design) in next {
            if seen.insert((place.clone(), design)) {
                open.push_back((place, design, steps + 1));
            }
        }
    }
    panic!("the goal is not reached")
}

/// The least number of moves.
fn least(problem: &Problem) -> usize {
    let corridors = facts(problem, "corridor");
    let goal = format!("{:?}", problem.goal);
    let mut layer = BTreeSet::from([facts(problem, "robot_at")[0][0]]);
    for steps in 0.. {
        if layer.iter().any(|place| goal.contains(&format!("\"{place}\""))) {
            return steps;
        }
        let before = layer.clone();
        layer.extend(corridors.iter().filter(|row| before.contains(row[0])).map(|row| row[1]));
        assert_ne!(before, layer, "the goal is not reached");
    }
    unreachable!("it ends above")
}

#[test]
fn every_map_of_the_sweep_is_planned_with_proof() {
    let Some(real) = real() else { return };
    for nodes in ["10", "50", "100", "200", "400", "1000"] {
        for with_designs in [true, false] {
            let input = grid(&real, nodes, with_designs);
            let answer = plan(&input, &[]);
            let (_, problem) = parsed(&input.domain, &input.problem);
            let least = if with_designs { least_with_designs(&problem) } else { least(&problem) };
            let found = answer["steps"].as_array().map(Vec::len);
            assert_eq!(found, Some(least), "{nodes} nodes, with designs: {with_designs}");
        }
    }
}
