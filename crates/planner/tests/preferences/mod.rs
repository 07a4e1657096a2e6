//! Preferences and trajectory constraints: random tasks are compared with all plans up to a maximum length.
//! The plans are evaluated on the whole sequence of states by the definition of PDDL 3. Planner and validator
//! must agree with this.

mod generate;
mod model;

use std::time::Duration;

use generate::Generator;
use metaplan_planner::{Config, Engine, GroundConfig, Limits, Solution, Status, ground, optimize};
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};
use testing::random::Random;

use crate::tally::with_enough_time;

/// Returns `None` if the task is rejected because an instance has too many cases.
fn solve(domain: &str, problem: &str, engine: Engine, time: Duration) -> Option<Solution> {
    let (domain, problem, _) = read(&Source::new("domain", domain), &Source::new("problem", problem))
        .unwrap_or_else(|errors| panic!("{errors:?}\n{domain}\n{problem}"));
    let task = match ground(&domain, &problem, &GroundConfig::default()) {
        Ok(task) => task,
        Err(errors) => {
            let has_cases = errors.iter().all(|error| error.to_string().contains("with more than 64 cases"));
            assert!(has_cases, "{errors:?}");
            return None;
        }
    };
    let limits = Limits::none().with_time(time);
    Some(optimize(&task, &Config::default().with_engine(engine).with_limits(limits), &mut |_| {}))
}

fn compare(seed: u64, time: Duration) -> bool {
    let task = Generator(Random(seed)).task();
    let (domain, problem) = (task.domain(), task.problem());
    let best = task.best();
    let engine = if seed % 8 == 7 { Engine::Sat } else { Engine::Auto };
    let Some(solution) = solve(&domain, &problem, engine, time) else { return false };
    let about = || format!("seed {seed}\n{domain}\n{problem}\n{solution:?}");
    let Some(plan) = &solution.plan else {
        // The time may have run out before a plan was found.
        assert!(matches!(solution.status, Status::Unsolvable | Status::Unknown), "{}", about());
        assert!(best.is_none() || solution.status == Status::Unknown, "{}", about());
        return false;
    };
    let is_proved = solution.status == Status::Optimal;
    let steps: Vec<(usize, usize)> = plan
        .steps
        .iter()
        .map(|step| {
            let object = step.arguments.first().map_or(0, |object| usize::from(object == "o1"));
            (step.action[1..].parse().unwrap_or_else(|_| panic!("{}", about())), object)
        })
        .collect();
    let cost: i64 = plan.cost.to_string().parse().unwrap_or_else(|_| panic!("{}", about()));
    assert_eq!(task.judge(&steps), Some(cost), "{}", about());
    let is_best = best.is_none_or(|best| if task.maximize { cost >= best } else { cost <= best });
    assert!(is_best || !is_proved, "{best:?} is better\n{}", about());
    is_proved
}

#[test]
fn the_cheapest_plans_are_those_of_the_definition() {
    let seeds: u64 =
        std::env::var("METAPLAN_SEEDS").map_or(100, |text| text.parse().expect("a number of seeds"));
    with_enough_time(Duration::from_secs(2), |time| {
        let solved = (0..seeds).filter(|seed| compare(*seed, time)).count();
        let is_enough = solved * 5 > 2 * seeds as usize;
        if is_enough { Ok(()) } else { Err(format!("only {solved} tasks have plans that are proved")) }
    });
}

#[test]
fn the_validator_judges_random_plans_by_the_definition() {
    let (mut valid, mut invalid) = (0, 0);
    for seed in 0..400 {
        let mut generator = Generator(Random(1_000_000 + seed));
        let task = generator.task();
        let (domain_text, problem_text) = (task.domain(), task.problem());
        let (domain, problem, _) = read(
            &Source::new("domain", domain_text.as_str()),
            &Source::new("problem", problem_text.as_str()),
        )
        .expect("it is read");
        let mut plan: Vec<(usize, usize)> = Vec::new();
        for _ in 0..12 {
            let action = generator.below(3) as usize;
            let x = if task.actions[action].has_parameter { generator.below(2) as usize } else { 0 };
            plan.push((action, x));
            if task.execute(&plan).is_none() {
                plan.pop();
            }
        }
        let line = |(action, x): &(usize, usize)| {
            if task.actions[*action].has_parameter {
                format!("(a{action} o{x})\n")
            } else {
                format!("(a{action})\n")
            }
        };
        let text: String = plan.iter().map(line).collect();
        let parsed = PlanText::parse(&Source::new("plan", text.as_str())).expect("it is a plan");
        let verdict = validate(&domain, &problem, &parsed, &Options::default());
        let metric = verdict.metric.as_ref().map(ToString::to_string);
        let expected = task.judge(&plan).map(|metric| metric.to_string());
        assert_eq!(metric, expected, "{domain_text}\n{problem_text}\n{text}\n{verdict:?}");
        *(if verdict.valid { &mut valid } else { &mut invalid }) += 1;
    }
    assert!(valid > 50 && invalid > 50, "{valid} valid and {invalid} invalid plans");
}

/// A comparison with an undefined number is neither true nor false. If a preference contained one, a plan
/// that violates the preference would be invalid.
#[test]
fn numbers_without_an_initial_value_are_refused() {
    let domain = "(define (domain d) (:predicates (done)) (:functions (f) (g) (total-cost))
      (:action set_f :effect (and (assign (f) 5) (increase (total-cost) 10)))
      (:action set_g :effect (and (assign (g) 5) (increase (total-cost) 1)))
      (:action finish :precondition (preference a (> (f) 3)) :effect (and (done) (increase (total-cost) 1))))";
    let soft = |preference: &str| format!("(:constraints (preference a {preference}))");
    let (sometime, in_the_end) = (soft("(sometime (> (+ (f) (g)) 3))"), soft("(at end (> (f) 3))"));
    let defined = soft("(sometime (> (g) 3))");
    let ground_with = |values: &str, constraints: &str| {
        let problem = format!(
            "(define (problem p) (:domain d) (:init (= (total-cost) 0) {values}) (:goal (done)) {constraints}
               (:metric minimize (+ (total-cost) (* 4 (is-violated a)))))"
        );
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", &problem)).expect("PDDL");
        ground(&domain, &problem, &GroundConfig::default())
    };
    for (values, constraints) in
        [("", ""), ("(= (g) 0)", &sometime[..]), ("(= (g) 0)", &in_the_end[..]), ("(= (g) 0)", &defined[..])]
    {
        let errors = ground_with(values, constraints).expect_err("it would be neither met nor violated");
        assert!(errors.iter().all(|error| error.to_string().contains("no initial value")), "{errors:?}");
    }
    for constraints in ["", &sometime[..], &in_the_end[..]] {
        let task = ground_with("(= (f) 0) (= (g) 0)", constraints).expect("a task");
        let solution = optimize(&task, &Config::default(), &mut |_| {});
        // Each violation costs 4. For the sum, it suffices to set g.
        let expected = if constraints.is_empty() {
            "5"
        } else if constraints == sometime {
            "6"
        } else {
            "9"
        };
        assert_eq!(solution.plan.expect("a plan").cost.to_string(), expected, "{constraints}");
    }
}

/// A quotient by 0 is undefined, so a comparison with it and the negation of this comparison are both false.
#[test]
fn divisors_that_may_be_zero_are_refused() {
    let domain = "(define (domain d) (:predicates (g)) (:functions (x) (c ?o))
      (:action act :parameters (?o) :precondition (preference a (< (/ (x) (c ?o)) 5))
        :effect (and (g) (increase (x) 1))))";
    let ground_with = |divisor: u32, preference: &str| {
        let problem = format!(
            "(define (problem p) (:domain d) (:objects o) (:init (= (c o) {divisor}) (= (x) 0))
               (:goal (and (g) (preference b (< (/ (x) (c o)) 5)))) (:metric minimize (is-violated {preference})))"
        );
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", &problem)).expect("PDDL");
        ground(&domain, &problem, &GroundConfig::default())
    };
    for preference in ["a", "b"] {
        let errors = ground_with(0, preference).expect_err("it would be neither met nor violated");
        assert!(errors.iter().all(|error| error.to_string().contains("may be 0")), "{errors:?}");
        let solution =
            optimize(&ground_with(2, preference).expect("a task"), &Config::default(), &mut |_| {});
        assert_eq!(solution.plan.expect("a plan").cost.to_string(), "0", "{preference}");
    }
}

/// The start adds `b`, and the constraint reads `b` at the end. If the duration is 0, both are one happening
/// and interfere.
#[test]
fn sometime_before_over_start_and_end_needs_a_positive_duration() {
    let task = |duration: u32| {
        let domain = format!(
            "(define (domain d) (:predicates (b) (g))
               (:durative-action a :parameters () :duration (= ?duration {duration}) :condition (and)
                 :effect (and (at start (b)) (at end (g)))))"
        );
        let problem = "(define (problem p) (:domain d) (:init) (:goal (g))
          (:constraints (preference w (sometime-before (g) (b)))) (:metric minimize (is-violated w)))";
        let (domain, problem, _) =
            read(&Source::new("domain", &domain), &Source::new("problem", problem)).expect("PDDL");
        ground(&domain, &problem, &GroundConfig::default())
    };
    let errors = task(0).expect_err("a plan violates the preference, but no action would be applicable");
    assert!(errors.iter().all(|error| error.to_string().contains("may be one time")), "{errors:?}");
    let solution = optimize(&task(1).expect("a task"), &Config::default(), &mut |_| {});
    assert_eq!(solution.plan.expect("a plan").cost.to_string(), "0");
}

/// If the duration is 0, start and end are one happening. A preference reads nothing, so it does not interfere with a
/// change of its condition.
#[test]
fn preferences_of_actions_without_duration_do_not_interfere() {
    for (time, other) in [("start", "end"), ("end", "start")] {
        let domain = format!(
            "(define (domain d) (:predicates (p) (g))
               (:durative-action a :parameters () :duration (= ?duration 0)
                 :condition (and (preference w (at {time} (p))))
                 :effect (and (at {other} (not (p))) (at end (g)))))"
        );
        let problem = "(define (problem p) (:domain d) (:init (p)) (:goal (g))
          (:metric minimize (+ (total-time) (* 3 (is-violated w)))))";
        let (domain, problem, _) =
            read(&Source::new("domain", &domain), &Source::new("problem", problem)).expect("PDDL");
        let plan = PlanText::parse(&Source::new("plan", "0: (a) [0]")).expect("a plan");
        let verdict = validate(&domain, &problem, &plan, &Options::default());
        assert!(verdict.valid, "{verdict:?}");
        let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
        let best = optimize(&task, &Config::default(), &mut |_| {}).plan.expect("a plan");
        assert_eq!(Some(best.cost.to_string()), verdict.metric.map(|metric| metric.to_string()), "{time}");
    }
}

/// Each of the 60 effects may change the compared number or not, so there would be 2^60 cases.
#[test]
fn a_comparison_with_too_many_cases_is_refused_at_once() {
    let list = |item: &dyn Fn(u32) -> String| (0..60).map(item).collect::<String>();
    let domain = format!(
        "(define (domain d) (:predicates (g)) (:functions (f ?x))
           (:action a :parameters ({}) :effect (and (g) {})))",
        list(&|index| format!("?x{index} ")),
        list(&|index| format!("(increase (f ?x{index}) 1) "))
    );
    let problem = "(define (problem p) (:domain d) (:objects o) (:init (= (f o) 0)) (:goal (g))
      (:constraints (always (<= (f o) 100))))";
    let (domain, problem, _) =
        read(&Source::new("domain", &domain), &Source::new("problem", problem)).expect("PDDL");
    let errors = ground(&domain, &problem, &GroundConfig::default()).expect_err("there are too many cases");
    assert!(errors.iter().all(|error| error.to_string().contains("many functions")), "{errors:?}");
}

/// The inner variable hides the parameter, so the condition of the effect and its atom concern different objects.
#[test]
fn a_hidden_parameter_keeps_its_value_in_a_constraint() {
    let domain = "(define (domain d) (:types a b) (:predicates (ready) (p ?x - a) (q ?x - b))
      (:action go :parameters (?x - a) :precondition (ready)
        :effect (and (not (ready)) (when (p ?x) (forall (?x - b) (q ?x))))))";
    let problem =
        "(define (problem p) (:domain d) (:objects a1 - a c - b) (:init (ready) (p a1)) (:goal (q c))
      (:constraints (sometime (q c))))";
    let (parsed, instance, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let plan = PlanText::parse(&Source::new("plan", "(go a1)")).expect("a plan");
    let verdict = validate(&parsed, &instance, &plan, &Options::default());
    assert!(verdict.valid, "{verdict:?}");
    for engine in [Engine::Auto, Engine::Sat] {
        let solution = solve(domain, problem, engine, Duration::from_secs(60)).expect("few cases");
        assert_eq!((solution.status, solution.plan.map(|plan| plan.steps.len())), (Status::Optimal, Some(1)));
    }
}

/// Without a value, `total-cost` is 0, so start and end are one happening, after which `(q)` holds.
#[test]
fn a_duration_of_total_cost_without_a_value_is_not_positive() {
    let domain = "(define (domain d) (:requirements :typing) (:predicates (p) (q)) (:functions (total-cost))
      (:durative-action a :parameters () :duration (= ?duration (total-cost))
        :condition (at start (p)) :effect (and (at start (not (p))) (at end (q)))))";
    let problem =
        "(define (problem p) (:domain d) (:init (p)) (:goal (q)) (:constraints (always (or (p) (q)))))";
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let plan = PlanText::parse(&Source::new("plan", "0: (a) [0]")).expect("a plan");
    let verdict = validate(&domain, &problem, &plan, &Options::default());
    assert!(verdict.valid, "{verdict:?}");
    let errors = ground(&domain, &problem, &GroundConfig::default()).expect_err("the times may be equal");
    assert!(errors.iter().all(|error| error.to_string().contains("which may be one time")), "{errors:?}");
}

/// Cells form a ring, and the constraint admits all but one of them, so the robot takes the longer way round. A move may
/// change the constraint in more ways than are distinguished.
#[test]
fn a_constraint_on_many_cells_holds() {
    let cells = 400;
    let list = |item: &dyn Fn(u32) -> String| (0..cells).map(item).collect::<String>();
    let domain = "(define (domain d) (:requirements :typing) (:types cell) (:predicates (at ?c - cell) (next ?a ?b - cell))
      (:action move :parameters (?a ?b - cell) :precondition (and (at ?a) (or (next ?a ?b) (next ?b ?a)))
        :effect (and (at ?b) (not (at ?a)))))";
    let problem = format!(
        "(define (problem p) (:domain d) (:objects {} - cell) (:init (at c0) {}) (:goal (at c4))
          (:constraints (always (or {}))))",
        list(&|cell| format!("c{cell} ")),
        list(&|cell| format!("(next c{cell} c{}) ", (cell + 1) % cells)),
        list(&|cell| if cell == 2 { String::new() } else { format!("(at c{cell}) ") }),
    );
    let solution = solve(domain, &problem, Engine::Auto, Duration::from_secs(60)).expect("few constraints");
    let steps = solution.plan.map(|plan| plan.steps.len());
    assert_eq!((solution.status, steps), (Status::Optimal, Some(cells as usize - 4)));
}
