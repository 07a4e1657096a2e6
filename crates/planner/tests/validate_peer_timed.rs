//! Compares the validator with that of the Unified Planning Framework on plans with times. The files are real
//! files that the framework can read. The plans are cheapest plans and plans that differ from them by one
//! change.
//!
//! The framework ignores the mutex rule of PDDL 2.1. If an action has no effect at its start, the framework
//! also ignores its over-all condition directly after the start. The validator must reject every plan that
//! the framework rejects, and may reject further plans only for these two reasons.
//!
//! The environment variable `METAPLAN_PEERS` must name a Python with the framework (`python3 -m venv peers;
//! peers/bin/pip install unified-planning`, then `METAPLAN_PEERS=peers/bin/python`). The files are not part
//! of the project.

#![expect(clippy::print_stdout, reason = "figures are shown")]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use metaplan_planner::{Config, Exact, GroundConfig, Limits, ground, optimize};
use num_bigint::BigInt;
use num_traits::ToPrimitive;
use pddl::ast::{ActionBody, Domain, Problem};
use pddl::validate::{Options, PlanText, ViolationKind, validate};
use pddl::{Source, print_domain, print_problem, read};
use test_resources::{data, data_path};

const PAIRS: [(&str, &str); 8] = [
    ("domain_expert_test_pddl_domain_charging", "domain_expert_test_pddl_problem_charging"),
    ("domain_expert_test_pddl_domain_simple", "domain_expert_test_pddl_problem_simple_1"),
    ("executor_test_pddl_elevator_domain", "executor_test_pddl_elevator_problem"),
    ("executor_test_pddl_factory", "executor_test_pddl_problem_factory_1"),
    ("executor_test_pddl_road_trip_domain", "executor_test_pddl_road_trip_problem"),
    ("planner_test_pddl_domain_simple_constants", "planner_test_pddl_problem_simple_constants_1"),
    ("problem_expert_test_pddl_domain_simple", "problem_expert_test_pddl_problem_simple_1"),
    ("suave_extended_metaplan_domain", "suave_extended_metaplan_problem"),
];

const PEER: &str = "import sys
from unified_planning.exceptions import UPTypeError, UPUsageError
from unified_planning.engines.plan_validator import TimeTriggeredPlanValidator
from unified_planning.io import PDDLReader
reader = PDDLReader()
problem = reader.parse_problem(sys.argv[1], sys.argv[2])
validator = TimeTriggeredPlanValidator()
validator.skip_checks = True
for text in open(sys.argv[3]).read().split('---\\n'):
    try:
        plan = reader.parse_plan_string(problem, text)
        valid = validator.validate(problem, plan).status.name == 'VALID'
    except (UPTypeError, UPUsageError):  # an object of another type, a function without a value
        valid = False
    print('valid' if valid else 'invalid')";

/// Start in thousandths, name and arguments, and duration in thousandths.
type Timed = (i128, Vec<String>, Option<i128>);

fn file(name: &str) -> PathBuf {
    let folder = if name.starts_with("suave") { "suave_metaplan/" } else { "plansys2/plansys2_" };
    data_path(format!("real/pddl/{folder}{name}.pddl"))
}

fn thousandths(value: i128) -> String {
    format!("{}.{:03}", value / 1000, value % 1000)
}

fn text(plan: &[Timed]) -> String {
    let line = |(start, words, duration): &Timed| {
        let duration = duration.map_or(String::new(), |value| format!(" [{}]", thousandths(value)));
        format!("{}: ({}){duration}\n", thousandths(*start), words.join(" "))
    };
    plan.iter().map(line).collect()
}

/// A plan with small gaps between its steps, cheapest unless time runs out; empty if the planner finds none.
fn plan(domain: &Domain, problem: &Problem) -> Vec<Timed> {
    let steps: Vec<(Vec<String>, Exact)> = ground(domain, problem, &GroundConfig::default())
        .ok()
        .and_then(|task| {
            let limits = Limits::none().with_time(Duration::from_secs(20));
            optimize(&task, &Config::default().with_limits(limits), &mut |_| {}).plan
        })
        .into_iter()
        .flat_map(|plan| plan.steps)
        .map(|step| (std::iter::once(step.action).chain(step.arguments).collect(), step.duration))
        .collect();
    let mut time = 0;
    let mut timed = Vec::new();
    for (words, duration) in steps {
        let action = domain.actions.iter().find(|action| action.identifier.name.as_str() == words[0]);
        let is_durative = action.is_some_and(|action| matches!(action.body, ActionBody::Durative { .. }));
        let length =
            (duration.to_rational() * BigInt::from(1000)).to_integer().to_i128().expect("a short time");
        timed.push((time, words, is_durative.then_some(length)));
        time += length + 10;
    }
    timed
}

fn changed(plan: &[Timed], objects: &[String], number: usize) -> Vec<Timed> {
    let mut plan = plan.to_vec();
    let place = number / 7 % plan.len();
    let some = i128::try_from(number / 11 % 5).unwrap_or_default();
    match number % 7 {
        0 => drop(plan.remove(place)),
        1 => {
            let (start, words, duration) = plan[place].clone();
            plan.push((start + duration.unwrap_or_default() + 5, words, duration));
        }
        2 => plan.truncate(place),
        // The step may start earlier, so that it overlaps with or precedes an action that it needs. Sometimes it
        // starts together with the previous step.
        3 => {
            plan[place].0 = if place > 0 && some == 0 { plan[place - 1].0 } else { plan[place].0 * some / 4 }
        }
        4 => plan[place].2 = plan[place].2.map(|duration| duration * some / 2),
        5 => plan[place].0 += 1 + some * 1500,
        _ => {
            let words = &mut plan[place].1;
            if words.len() > 1 && !objects.is_empty() {
                let argument = 1 + number / 35 % (words.len() - 1);
                words[argument].clone_from(&objects[number / 3 % objects.len()]);
            }
        }
    }
    plan
}

#[test]
#[ignore = "needs a peer"]
fn verdicts_on_real_files_are_those_of_the_unified_planning_framework() {
    let Ok(python) = std::env::var("METAPLAN_PEERS") else { panic!("METAPLAN_PEERS names no Python") };
    if data("real/pddl").is_none() {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("timed");
    std::fs::create_dir_all(&folder).expect("a folder");
    let (mut valid, mut invalid, mut stricter) = (0, 0, 0);
    for (domain, problem) in PAIRS {
        let source = |name: &str| Source::from_bytes(name, &std::fs::read(file(name)).expect("a file"));
        let (domain, problem, _) = read(&source(domain), &source(problem)).expect("a real file is read");
        let best = plan(&domain, &problem);
        if best.is_empty() {
            println!("{}: no plan to start from", problem.name.name);
            continue;
        }
        let name = problem.name.name.to_string();
        let objects: Vec<String> =
            problem.objects.iter().map(|object| object.identifier.name.to_string()).collect();
        // The framework does not treat an empty plan as a plan with times.
        let changed = (0..70).map(|number| changed(&best, &objects, number * 3));
        let plans: Vec<_> =
            std::iter::once(best.clone()).chain(changed).filter(|plan| !plan.is_empty()).collect();
        let path = |kind: &str| folder.join(format!("{name}.{kind}"));
        let write = |kind: &str, text: String| std::fs::write(path(kind), text).expect("a file");
        write("domain.pddl", print_domain(&domain));
        write("problem.pddl", print_problem(&problem));
        write("plans", plans.iter().map(|plan| text(plan)).collect::<Vec<_>>().join("---\n"));
        let arguments = [path("domain.pddl"), path("problem.pddl"), path("plans")];
        let output =
            Command::new(&python).args(["-c", PEER]).args(arguments).output().expect("Python starts");
        let answer = String::from_utf8_lossy(&output.stdout);
        let verdicts: Vec<bool> = answer.lines().map(|line| line == "valid").collect();
        assert_eq!(verdicts.len(), plans.len(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let options =
            Options::default().with_concurrent(true).with_tolerance(num_rational::BigRational::default());
        for (plan, peer) in plans.iter().zip(verdicts) {
            let parsed = PlanText::parse(&Source::new("plan", text(plan))).expect("a plan is read");
            let ours = validate(&domain, &problem, &parsed, &options);
            match (&ours.violation, peer) {
                (None, true) => valid += 1,
                (Some(_), false) => invalid += 1,
                (Some(violation), true)
                    if matches!(violation.kind, ViolationKind::Interference | ViolationKind::OverAll) =>
                {
                    stricter += 1;
                }
                (violation, _) => panic!("{name}: peer {peer}, {violation:?}\n{}", text(plan)),
            }
        }
    }
    println!("{valid} valid, {invalid} invalid, {stricter} rejected by our rules only");
    assert!(valid > 50 && invalid > 150, "{valid} valid, {invalid} invalid");
}
