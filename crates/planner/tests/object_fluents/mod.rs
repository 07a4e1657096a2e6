//! Functions whose values are objects (object fluents): random tasks are compared with a search, up to a maximum
//! cost, that uses the definition of such functions. Planner and validator process the compiled task and
//! must agree with this search.

mod generate;
mod model;

use metaplan_planner::{Solution, Status};
use testing::random::Random;

use crate::tally::{self, Tally};
use generate::Generator;
use model::{Formula, Step, Term};
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, print_domain, print_problem, read};
use test_resources::data;

/// Compiles a task. Printing it, and reading and printing it again, must yield the same texts.
fn compiled(domain: &str, problem: &str) -> (pddl::ast::Domain, pddl::ast::Problem) {
    let read_both = |domain: &str, problem: &str| {
        let (tree, task, found) = read(&Source::new("domain", domain), &Source::new("problem", problem))
            .unwrap_or_else(|errors| panic!("{errors:?}\n{domain}\n{problem}"));
        assert!(found.is_empty(), "{found:?}");
        (tree, task)
    };
    let (tree, task) = read_both(domain, problem);
    let printed = (print_domain(&tree), print_problem(&task));
    let (again, task_again) = read_both(&printed.0, &printed.1);
    assert!(again.object_fluents.is_empty());
    assert_eq!((print_domain(&again), print_problem(&task_again)), printed);
    (tree, task)
}

/// Returns `None` if the task is rejected because an effect at the start or a numeric effect has
/// too many cases.
fn solve(domain: &str, problem: &str, has_plan: bool) -> Option<Solution> {
    let (tree, task) = compiled(domain, problem);
    tally::solve(&tree, &task, "with more than 64 cases", has_plan)
}

#[test]
fn plans_are_those_of_functions_with_objects_as_values() {
    let mut tally = Tally::new();
    for seed in tally.seeds() {
        let task = Generator(Random(seed)).task();
        let (domain, problem) = (task.domain(), task.problem());
        let best = task.best();
        let Some(solution) = solve(&domain, &problem, best.is_some()) else { continue };
        let about = || format!("seed {seed}\n{domain}\n{problem}\n{solution:?}");
        tally.count(&solution);
        let Some(plan) = &solution.plan else {
            assert!(best.is_none(), "{best:?} {}", about());
            continue;
        };
        let number = |name: &str| name[1..].parse().expect("a number");
        let step = |step: &metaplan_planner::Step| -> Step {
            (number(&step.action), step.arguments.iter().map(|name| number(name)).collect())
        };
        let steps: Vec<Step> = plan.steps.iter().map(step).collect();
        let cost = task.cost(&steps);
        assert!(cost.is_some(), "{}", about());
        if solution.status == Status::Optimal {
            assert!(best.is_none_or(|best| cost == Some(best)), "{best:?} {}", about());
        }
    }
    tally.check(4);
}

#[test]
fn the_validator_executes_functions_with_objects_as_values() {
    let mut valid = 0;
    for seed in 0..2_000 {
        let mut generator = Generator(Random(1_000_000 + seed));
        let mut task = generator.task();
        if seed % 2 == 0 {
            task.goal = Formula::Equal(Term::Object(0), Term::Object(0));
        }
        let all = task.steps();
        let plan: Vec<Step> =
            (0..generator.below(4)).map(|_| all[generator.below(all.len() as u64)].clone()).collect();
        let (domain, problem) = compiled(&task.domain(), &task.problem());
        let line = |(action, arguments): &Step| {
            let names = arguments.iter().map(|object| format!(" o{object}"));
            format!("(a{action}{})\n", names.collect::<Vec<_>>().concat())
        };
        let text: String = plan.iter().map(line).collect::<Vec<_>>().concat();
        let parsed = PlanText::parse(&Source::new("plan", text.as_str())).expect("it is a plan");
        let verdict = validate(&domain, &problem, &parsed, &Options::default());
        let about = || format!("{}\n{}\n{text}\n{verdict:?}", task.domain(), task.problem());
        assert_eq!(verdict.valid, task.cost(&plan).is_some(), "{}", about());
        valid += u32::from(verdict.valid);
    }
    assert!(valid > 100, "{valid} valid plans");
}

#[test]
fn the_public_file_is_planned() {
    let directory = "real/ipc/numeric/up-unified_planning-test-pddl-object_fluents-domain.pddl";
    let Some(directory) = data(directory) else { return };
    let text = |name: &str| std::fs::read_to_string(directory.join(name)).expect("a file");
    let (domain, problem) = (text("domain.pddl"), text("problem.pddl"));
    let solved = |problem: &str| solve(&domain, problem, true).expect("it is ground");
    // No action assigns a place to a package.
    assert_eq!(solved(&problem).status, Status::Unsolvable);
    let goal = "(= (package_at pkg1) loc3)";
    assert!(problem.contains(goal));
    let solution = solved(&problem.replace(goal, "(= (cargo truck1) pkg1)"));
    assert_eq!(solution.status, Status::Optimal);
    let steps = solution.plan.expect("a plan").steps;
    let steps: Vec<_> =
        steps.iter().map(|step| format!("{} {}", step.action, step.arguments.join(" "))).collect();
    assert_eq!(steps, ["drive truck1 loc1 loc2", "load truck1 pkg1 loc2"]);
}
