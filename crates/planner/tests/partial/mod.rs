//! Tests of numbers without an initial value, on random tasks. A reference implementation executes plans with possibly
//! undefined values, and enumerates all plans up to a maximum length. The planner must find a plan if one of these is
//! valid, and no optimal plan may be longer than the shortest of them. The validator must accept exactly the plans that
//! the reference implementation can execute and that reach the goal.

mod model;

use metaplan_planner::{Solution, Status};
use testing::random::Random;

use crate::tally::{self, Tally};
use model::Generator;
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};

fn solve(domain: &str, problem: &str, has_plan: bool) -> Option<Solution> {
    let (domain, problem, _) = read(&Source::new("domain", domain), &Source::new("problem", problem))
        .unwrap_or_else(|errors| panic!("{errors:?}\n{domain}\n{problem}"));
    tally::solve(&domain, &problem, "in `when` with a value", has_plan)
}

#[test]
fn plans_are_those_of_values_that_may_be_undefined() {
    let mut tally = Tally::new();
    for seed in tally.seeds() {
        let task = Generator(Random(seed)).task();
        let (domain, problem) = (task.domain(), task.problem());
        let shortest = task.shortest();
        let Some(solution) = solve(&domain, &problem, shortest.is_some()) else { continue };
        let about = || format!("seed {seed}\n{domain}\n{problem}\n{solution:?}");
        tally.count(&solution);
        let Some(plan) = &solution.plan else {
            assert!(shortest.is_none(), "{}", about());
            continue;
        };
        let step = |step: &metaplan_planner::Step| step.action[1..].parse().expect("a number");
        let steps: Vec<usize> = plan.steps.iter().map(step).collect();
        assert!(task.is_plan(&steps), "{}", about());
        if solution.status == Status::Optimal {
            assert!(shortest.is_none_or(|shortest| steps.len() <= shortest), "{}", about());
        }
    }
    tally.check(10);
}

#[test]
fn the_validator_executes_with_values_that_may_be_undefined() {
    let mut valid = 0;
    for seed in 0..3_000 {
        let mut generator = Generator(Random(1_000_000 + seed));
        let task = generator.task();
        let plan: Vec<usize> = (0..generator.below(5)).map(|_| generator.below(3)).collect();
        let (domain_text, problem_text) = (task.domain(), task.problem());
        let (domain, problem, _) = read(
            &Source::new("domain", domain_text.as_str()),
            &Source::new("problem", problem_text.as_str()),
        )
        .expect("it is read");
        let text: String = plan.iter().map(|action| format!("(a{action})\n")).collect::<Vec<_>>().concat();
        let parsed = PlanText::parse(&Source::new("plan", text.as_str())).expect("it is a plan");
        let verdict = validate(&domain, &problem, &parsed, &Options::default());
        assert_eq!(verdict.valid, task.is_plan(&plan), "{domain_text}\n{problem_text}\n{text}\n{verdict:?}");
        valid += u32::from(verdict.valid);
    }
    assert!(valid > 100, "{valid} valid plans");
}
