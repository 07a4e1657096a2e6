//! The validator compared with that of the unified planning framework: the same verdict on cheapest
//! plans of generated missions and on plans that were changed in one place.
//!
//! Needs a Python with the framework
//! (`python3 -m venv peers; peers/bin/pip install unified-planning`), named by
//! `METAPLAN_PEERS=peers/bin/python`. The missions come from a script that is not part of the
//! project.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use metaplan_planner::{Config, GroundConfig, ground, optimize};
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};

const TOOL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/tools/gen_ratpa.py");

/// Reads a domain, a problem and plans, and prints a verdict for each plan.
const PEER: &str = "import sys
from unified_planning.exceptions import UPTypeError
from unified_planning.engines import SequentialPlanValidator
from unified_planning.io import PDDLReader
reader = PDDLReader()
problem = reader.parse_problem(sys.argv[1], sys.argv[2])
validator = SequentialPlanValidator()
validator.skip_checks = True
for text in open(sys.argv[3]).read().split('---\\n'):
    try:
        plan = reader.parse_plan_string(problem, text)
        valid = validator.validate(problem, plan).status.name == 'VALID'
    except UPTypeError:  # an object of another type than the parameter
        valid = False
    print('valid' if valid else 'invalid')";

/// The plan with one thing changed, chosen by a number.
fn changed(plan: &[String], objects: &[String], number: usize) -> Vec<String> {
    let mut plan = plan.to_vec();
    let place = number / 5 % plan.len();
    match number % 5 {
        0 => drop(plan.remove(place)),
        1 => plan.insert(place, plan[place].clone()),
        2 => {
            let next = (place + 1) % plan.len();
            plan.swap(place, next);
        }
        3 => plan.truncate(place),
        _ => {
            let mut words: Vec<&str> = plan[place].trim_matches(['(', ')']).split(' ').collect();
            let argument = 1 + number / 25 % (words.len() - 1);
            words[argument] = &objects[number / 3 % objects.len()];
            plan[place] = format!("({})", words.join(" "));
        }
    }
    plan
}

#[test]
#[ignore = "needs a peer"]
fn verdicts_are_those_of_the_unified_planning_framework() {
    let Ok(python) = std::env::var("METAPLAN_PEERS") else { panic!("METAPLAN_PEERS names no Python") };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("verdicts");
    let (mut valid, mut invalid) = (0, 0);
    for (family, seed, k, encoding) in
        [("ugv", 1, 1, "c"), ("ugv", 2, 2, "n"), ("uuv", 1, 2, "n"), ("uuv", 2, 1, "c")]
    {
        let name = format!("{family}-{seed}-{k}");
        let [seed, k] = [seed, k].map(|number: usize| number.to_string());
        let n = if family == "ugv" { "8" } else { "2" };
        let arguments =
            [["--family", family, "--n", n], ["--m", "3", "--k", &k], ["--seed", &seed, "--enc", encoding]];
        let mut script = Command::new("python3");
        script.arg(TOOL).args(arguments.as_flattened()).args(["--name", &name, "--out"]).arg(&folder);
        assert!(script.output().is_ok_and(|made| made.status.success()), "the script makes {name}");
        let path = |kind: &str| folder.join(format!("{name}.{encoding}.{kind}.pddl"));
        let source = |kind: &str| Source::new(kind, std::fs::read_to_string(path(kind)).expect("a file"));
        let (domain, problem, _) = read(&source("domain"), &source("problem")).expect("a mission is read");
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a mission is ground");
        let best = optimize(&task, &Config::default(), &mut |_| {}).plan.expect("a plan");
        let line = |step: &metaplan_planner::Step| format!("({} {})", step.action, step.arguments.join(" "));
        let best: Vec<String> = best.steps.iter().map(line).collect();
        let objects: Vec<String> =
            problem.objects.iter().map(|object| object.identifier.name.to_string()).collect();
        let plans: Vec<Vec<String>> =
            (0..50).map(|number| changed(&best, &objects, number * 7)).chain([best.clone()]).collect();
        let mut file = String::new();
        for (index, plan) in plans.iter().enumerate() {
            let _ = writeln!(file, "{}{}", if index > 0 { "---\n" } else { "" }, plan.join("\n"));
        }
        std::fs::write(path("plans"), file).expect("a file");
        let output = Command::new(&python)
            .args(["-c", PEER])
            .args([path("domain"), path("problem"), path("plans")])
            .output();
        let output = output.expect("Python starts");
        let text = String::from_utf8_lossy(&output.stdout);
        let verdicts: Vec<bool> = text.lines().map(|line| line == "valid").collect();
        assert_eq!(verdicts.len(), plans.len(), "{}", String::from_utf8_lossy(&output.stderr));
        for (plan, peer) in plans.iter().zip(verdicts) {
            let parsed = PlanText::parse(&Source::new("plan", plan.join("\n"))).expect("a plan is read");
            let ours = validate(&domain, &problem, &parsed, &Options::default());
            assert_eq!(ours.valid, peer, "{name}: {plan:?}: {:?}", ours.violation);
            *(if peer { &mut valid } else { &mut invalid }) += 1;
        }
    }
    assert!(valid > 10 && invalid > 100, "{valid} are valid, {invalid} are not");
}
