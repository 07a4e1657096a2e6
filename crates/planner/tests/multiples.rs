//! Tests of tasks in which numbers are added to each other with fractional factors. Grounding to integers then
//! stores multiples of these numbers. The results must equal those with exact rationals, which store the
//! numbers themselves.

use metaplan_planner::{
    Config, Engine, GroundConfig, Status, ground, ground_exact, optimize, optimize_exact,
};
use pddl::{Source, read};

use testing::random::Random;

const FLUENTS: [&str; 4] = ["a", "b", "c", "e"];
const FACTORS: [&str; 8] = ["0.5", "-0.5", "0.25", "1.5", "2", "-1", "0.2", "1.75"];

fn action(random: &mut Random, number: usize) -> String {
    let pick = |random: &mut Random, below: usize| random.below(below as u64) as usize;
    let target = pick(random, FLUENTS.len());
    let factor = FACTORS[pick(random, FACTORS.len())];
    // A fluent only reads earlier fluents, so the fractional dependencies have no cycle.
    let value = if target > 0 && pick(random, 4) > 0 {
        let (read, constant) = (FLUENTS[pick(random, target)], pick(random, 3));
        format!("(+ (* {factor} ({read})) {constant})")
    } else {
        factor.to_owned()
    };
    let change = ["increase", "decrease", "assign"][pick(random, 3)];
    let (compared, bound) = (FLUENTS[pick(random, FLUENTS.len())], FACTORS[pick(random, FACTORS.len())]);
    let order = ["<=", ">", ">="][pick(random, 3)];
    format!(
        "(:action act{number} :parameters () :precondition (and (< (steps) 5) ({order} (* 3 ({compared})) {bound}))
           :effect (and (increase (steps) 1) ({change} ({}) {value}) (increase (total-cost) {})))\n",
        FLUENTS[target],
        1 + pick(random, 3)
    )
}

/// Compares both kinds of numbers on a random task. Returns whether the domain has a decimal such
/// as `0.5`, so that the integer task may store multiples, and whether there is a plan.
fn compare(seed: u64) -> (bool, bool) {
    let mut random = Random(seed);
    let actions: String = (0..4).map(|number| action(&mut random, number)).collect();
    let values = FLUENTS.map(|name| format!("(= ({name}) {}) ", FACTORS[random.below(8) as usize])).concat();
    let domain = format!(
        "(define (domain d) (:predicates (p)) (:functions (a) (b) (c) (e) (steps) (total-cost))\n{actions})"
    );
    let goal = format!("(> (e) {})", FACTORS[random.below(8) as usize]);
    let other = format!("(>= (- (c) (b)) {})", FACTORS[random.below(8) as usize]);
    let problem = format!(
        "(define (problem p) (:domain d) (:init {values} (= (steps) 0) (= (total-cost) 0)) (:goal (and {goal} {other}))
           (:metric minimize (total-cost)))"
    );
    let (read_domain, read_problem, _) =
        read(&Source::new("domain", domain.clone()), &Source::new("problem", problem.clone())).expect("PDDL");
    let config = GroundConfig::default();
    let exact = ground_exact(&read_domain, &read_problem, &config).expect("a task");
    let expected = optimize_exact(&exact, &Config::default());
    let task =
        ground(&read_domain, &read_problem, &config).unwrap_or_else(|errors| panic!("{errors:?}\n{domain}"));
    let mut found = Vec::new();
    for engine in [Engine::Auto, Engine::Search] {
        let solution = optimize(&task, &Config::default().with_engine(engine), &mut |_| {});
        found.push((solution.status, solution.plan.map(|plan| plan.cost)));
    }
    let expected = (expected.status, expected.plan.map(|plan| plan.cost));
    assert!(matches!(expected.0, Status::Optimal | Status::Unsolvable), "{expected:?}");
    assert!(
        found.iter().all(|found| *found == expected),
        "{seed}: {found:?}, {expected:?}\n{domain}\n{problem}"
    );
    (domain.contains("0."), expected.1.is_some())
}

#[test]
fn answers_are_those_of_exact_rationals() {
    let solved = (0..400).map(compare).filter(|(fractions, solved)| *fractions && *solved).count();
    assert!(solved > 60, "{solved} with fractions and a plan");
}
