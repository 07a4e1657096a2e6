//! Compares the replanner with planning from scratch: both must return equal plans after random changes of
//! state and availability.

#![allow(clippy::format_collect)]
#![expect(clippy::print_stdout, reason = "times are what one of these tests is for")]

use std::path::Path;
use std::process::Command;

use metaplan_planner::{
    Config, GroundConfig, Limits, Query, ReplanOutcome, Replanner, Solution, Status, alternatives, ground,
    optimize,
};
use num_rational::BigRational;
use pddl::ast::{Atom, Domain, Identifier, InitialElement, Name, Problem, Span, Term};
use pddl::validate::metric_after;
use test_resources::{data, python};
use testing::missions::Mission;
use testing::random::Random;

use crate::concurrent::parse;

fn atom(words: &str) -> Atom {
    let mut words = words.split(' ').map(|word| Identifier { name: Name::new(word), span: Span::default() });
    let predicate = words.next().expect("a symbol");
    Atom { predicate, arguments: words.map(Term::Constant).collect(), span: Span::default() }
}

fn words(atom: &Atom) -> Vec<String> {
    let term = |term: &Term| match term {
        Term::Variable(identifier) | Term::Constant(identifier) => identifier.name.to_string(),
    };
    std::iter::once(atom.predicate.name.to_string()).chain(atom.arguments.iter().map(term)).collect()
}

struct Changes {
    at: &'static str,
    places: Vec<String>,
    designs: Vec<String>,
    capacity: i64,
}

impl Changes {
    fn of(problem: &Problem, at: &'static str, place: &str, design: &str) -> Self {
        let of_type = |name: &str| {
            let own = problem
                .objects
                .iter()
                .filter(|object| object.r#type.alternatives.iter().any(|kind| kind.name == Name::new(name)));
            own.map(|object| object.identifier.name.to_string()).collect()
        };
        let battery = problem.init.iter().find_map(|element| match element {
            InitialElement::Value(function, value, _) if words(function) == ["battery"] => {
                Some(value.to_integer())
            }
            _ => None,
        });
        let capacity = battery.and_then(|value| value.try_into().ok()).unwrap_or(0);
        Self { at, places: of_type(place), designs: of_type(design), capacity }
    }

    fn happen(&self, problem: &mut Problem, random: &mut Random) {
        match random.below(5) {
            0 => {
                let place = &self.places[random.below(self.places.len() as u64) as usize];
                problem.init.retain(
                    |element| !matches!(element, InitialElement::Fact(fact) if words(fact)[0] == self.at),
                );
                problem.init.push(InitialElement::Fact(atom(&format!("{} {place}", self.at))));
            }
            1 => {
                // Tenths, so that the numbers have another scale than the task.
                let value = BigRational::new((random.below(10 * self.capacity as u64 + 1)).into(), 10.into());
                for element in &mut problem.init {
                    if let InitialElement::Value(function, known, _) = element
                        && words(function) == ["battery"]
                    {
                        known.clone_from(&value);
                    }
                }
            }
            _ => {
                let design = &self.designs[random.below(self.designs.len() as u64) as usize];
                let fact = atom(&format!("fd_available {design}"));
                let is_own = |element: &InitialElement| matches!(element, InitialElement::Fact(other) if words(other) == words(&fact));
                let before = problem.init.len();
                problem.init.retain(|element| !is_own(element));
                if problem.init.len() == before {
                    problem.init.push(InitialElement::Fact(fact));
                }
            }
        }
    }
}

fn from_scratch(domain: &Domain, problem: &Problem) -> Solution {
    let task = ground(domain, problem, &GroundConfig::default()).expect("a task");
    optimize(&task, &Config::default(), &mut |_| {})
}

fn live(replanner: &mut Replanner, domain: &Domain, problem: &Problem) -> ReplanOutcome {
    live_with(replanner, domain, problem, None)
}

fn live_with(
    replanner: &mut Replanner,
    domain: &Domain,
    problem: &Problem,
    old: Option<&Named>,
) -> ReplanOutcome {
    let zero = BigRational::default();
    let metric = metric_after(domain, problem, &zero).expect("a metric");
    let limits = Limits::none();
    let query = Query {
        problem,
        first: &[],
        metric,
        old: old.map(|old| &old[..]),
        stay_close: false,
        limits: &limits,
    };
    let mut told = Vec::new();
    let found = replanner.plan_aloud(&query, &mut |progress| told.push(progress));
    // Progress reports must be consistent with the final result.
    if let ReplanOutcome::Optimal { metric, .. } = &found {
        for progress in told {
            let dearest = progress.metric.as_ref();
            assert!(progress.bound <= *metric, "{progress:?}, {metric}");
            assert!(dearest.is_none_or(|dearest| metric <= dearest), "{progress:?}, {metric}");
        }
    }
    found
}

fn new(domain: &Domain, problem: &Problem) -> Replanner {
    let available = [Name::new("fd_available")];
    Replanner::new(domain, problem, &available, &GroundConfig::default()).expect("the domain is suited")
}

fn compare(expected: &Solution, found: &ReplanOutcome, context: &dyn Fn() -> String) {
    match (&expected.plan, found) {
        (Some(plan), ReplanOutcome::Optimal { steps, metric, .. }) => {
            assert_eq!(expected.status, Status::Optimal, "{}", context());
            let names = |steps: &[metaplan_planner::Step]| {
                let name = |step: &metaplan_planner::Step| (step.action.clone(), step.arguments.clone());
                steps.iter().map(name).collect::<Vec<_>>()
            };
            assert_eq!(names(&plan.steps), names(steps), "{}", context());
            let cost = plan.cost.to_rational();
            assert_eq!(cost, *metric, "{}", context());
        }
        (None, ReplanOutcome::Unsolvable) => assert_eq!(expected.status, Status::Unsolvable, "{}", context()),
        _ => panic!("{:?} and {found:?}: {}", expected.status, context()),
    }
}

/// Applies changes one by one, and compares both ways of planning after each. Returns how often the
/// mission had to be grounded again.
fn check(seed: u64, changes: usize) -> usize {
    let mission = Mission::random(seed);
    let (domain, mut problem) = parse(&mission.domain(), &mission.problem());
    let mut random = Random(seed ^ 0x5eed);
    let possible = Changes::of(&problem, "at", "waypoint", "design");
    let mut replanner = new(&domain, &problem);
    let mut misfits = 0;
    let mut old = None;
    for number in 0..changes {
        let mut found = live(&mut replanner, &domain, &problem);
        if found == ReplanOutcome::Misfit {
            misfits += 1;
            replanner = new(&domain, &problem);
            found = live(&mut replanner, &domain, &problem);
        }
        let context = || format!("seed {seed}, change {number}: {mission:?}: {:?}", problem.init);
        compare(&from_scratch(&domain, &problem), &found, &context);
        // A known plan must not change the result.
        let again = live_with(&mut replanner, &domain, &problem, old.as_ref());
        assert_eq!(again, found, "{}", context());
        if let ReplanOutcome::Optimal { steps, .. } = &found {
            old = Some(named(steps));
        }
        possible.happen(&mut problem, &mut random);
    }
    misfits
}

#[test]
fn answers_are_those_of_planning_anew() {
    let misfits: usize = (0..40).map(|seed| check(seed, 12)).sum();
    assert!(misfits < 240, "{misfits} of 480 had to be ground anew");
}

#[test]
#[ignore = "takes minutes"]
fn ten_thousand_answers_are_those_of_planning_anew() {
    let misfits: usize = (1_000..1_500).map(|seed| check(seed, 20)).sum();
    println!("{misfits} of 10000 had to be ground anew");
}

type Named = Vec<(String, Vec<String>)>;

fn named(steps: &[metaplan_planner::Step]) -> Named {
    steps.iter().map(|step| (step.action.clone(), step.arguments.clone())).collect()
}

/// After a change, the plan that stays close to the old plan must be optimal with the fewest steps. No
/// optimal plan of this length, as enumerated by `alternatives`, may share more steps with the old plan.
fn check_close(seed: u64) {
    let mission = Mission::random(seed);
    let (domain, mut problem) = parse(&mission.domain(), &mission.problem());
    let mut random = Random(seed ^ 0xc105e);
    let possible = Changes::of(&problem, "at", "waypoint", "design");
    let mut replanner = new(&domain, &problem);
    let ReplanOutcome::Optimal { steps: old, .. } = live(&mut replanner, &domain, &problem) else { return };
    let old = named(&old);
    possible.happen(&mut problem, &mut random);
    let metric = metric_after(&domain, &problem, &BigRational::default()).expect("a metric");
    let limits = Limits::none();
    let query =
        Query { problem: &problem, first: &[], metric, old: Some(&old), stay_close: true, limits: &limits };
    let ReplanOutcome::Optimal { steps, metric, .. } = replanner.plan(&query) else { return };
    let task = ground(&domain, &problem, &GroundConfig::default()).expect("a task");
    let solution = optimize(&task, &Config::default(), &mut |_| {});
    let others = alternatives(&task, &solution, 200, &Config::default());
    let Some(others) = others.filter(|others| others.complete) else { return };
    let best = solution.plan.as_ref().expect("a plan");
    let cost = best.cost.to_rational();
    assert_eq!(cost, metric, "seed {seed}");
    assert_eq!(steps.len(), best.steps.len(), "seed {seed}");
    let kept = |plan: &Named| plan.iter().filter(|step| old.contains(step)).count();
    let as_long = others.plans.iter().chain([best]).filter(|plan| plan.steps.len() == steps.len());
    let most = as_long.map(|plan| kept(&named(&plan.steps))).max();
    assert_eq!(Some(kept(&named(&steps))), most, "seed {seed}: {old:?} {steps:?}");
}

#[test]
fn plans_that_stay_close_are_best_and_closest() {
    for seed in 0..150 {
        check_close(seed);
    }
}

#[test]
fn plans_stay_close_to_the_old_one() {
    let domain = "(define (domain robot) (:types place design function)
      (:predicates (at ?p - place) (way ?a ?b - place) (fd_solve_f ?d - design ?f - function) (fd_available ?d - design))
      (:functions (total-cost) (price ?d - design))
      (:action go :parameters (?f - function ?d - design ?a ?b - place)
        :precondition (and (at ?a) (way ?a ?b) (fd_solve_f ?d ?f) (fd_available ?d))
        :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (price ?d)))))";
    let problem = "(define (problem two) (:domain robot)
      (:objects a b c - place f - function left right - design)
      (:init (at a) (way a b) (way b c) (fd_solve_f left f) (fd_solve_f right f) (fd_available right)
        (= (price left) 1) (= (price right) 1) (= (total-cost) 0))
      (:goal (at c)) (:metric minimize (total-cost)))";
    let (domain, mut problem) = parse(domain, problem);
    let mut replanner = new(&domain, &problem);
    let ReplanOutcome::Optimal { steps: old, .. } = live(&mut replanner, &domain, &problem) else {
        panic!("no plan")
    };
    let old = named(&old);
    // Both designs are equally good. The other design comes first in the order of declaration.
    problem.init.push(InitialElement::Fact(atom("fd_available left")));
    let limits = Limits::none();
    let plan = |replanner: &mut Replanner, close_to: Option<&[(String, Vec<String>)]>| {
        let query = Query {
            problem: &problem,
            first: &[],
            metric: BigRational::default(),
            old: close_to,
            stay_close: true,
            limits: &limits,
        };
        let ReplanOutcome::Optimal { steps, .. } = replanner.plan(&query) else { panic!("no plan") };
        named(&steps)
    };
    assert_ne!(plan(&mut replanner, None), old);
    assert_eq!(plan(&mut replanner, Some(&old)), old);
}

/// A robot turns on switches in its own order. The time limit is reached before replanning begins.
#[test]
fn the_old_plan_serves_when_time_is_up() {
    let domain = "(define (domain robot) (:types switch design function)
      (:predicates (on ?s - switch) (fd_solve_f ?d - design ?f - function) (fd_available ?d - design))
      (:functions (total-cost))
      (:action turn :parameters (?f - function ?d - design ?s - switch)
        :precondition (and (not (on ?s)) (fd_solve_f ?d ?f) (fd_available ?d))
        :effect (and (on ?s) (increase (total-cost) 1))))";
    let names: Vec<String> = (0..14).map(|number| format!("s{number}")).collect();
    let goal: Vec<String> = names.iter().map(|name| format!("(on {name})")).collect();
    let problem = format!(
        "(define (problem many) (:domain robot) (:objects {} - switch f - function hand - design)
           (:init (fd_solve_f hand f) (fd_available hand) (= (total-cost) 0))
           (:goal (and {})) (:metric minimize (total-cost)))",
        names.join(" "),
        goal.join(" ")
    );
    let (domain, mut problem) = parse(domain, &problem);
    let mut replanner = new(&domain, &problem);
    let turn = |name: &String| ("turn".to_owned(), vec!["f".to_owned(), "hand".to_owned(), name.clone()]);
    let old: Named = names.iter().rev().map(turn).collect();
    let limits = Limits::none().with_time(std::time::Duration::ZERO);
    let ask = |replanner: &mut Replanner, problem: &Problem, old: Option<&Named>| {
        let (metric, old) = (BigRational::default(), old.map(|old| &old[..]));
        replanner.plan(&Query { problem, first: &[], metric, old, stay_close: false, limits: &limits })
    };
    let found = ask(&mut replanner, &problem, Some(&old));
    let ReplanOutcome::Feasible { first: None, steps, metric } = found else { panic!("{found:?}") };
    assert_eq!((named(&steps), metric), (old.clone(), BigRational::from_integer(14.into())));
    // If the old plan is no longer valid, it must not be returned.
    problem.init.push(InitialElement::Fact(atom("on s3")));
    assert_eq!(ask(&mut replanner, &problem, Some(&old)), ReplanOutcome::Unknown);
    assert!(
        matches!(live(&mut replanner, &domain, &problem), ReplanOutcome::Optimal { steps, .. } if steps.len() == 13)
    );
}

/// The blocking set makes the mission unsolvable, and no proper subset does. Returns `true` if the
/// mission is unsolvable and the set is not empty.
fn check_blocking(seed: u64) -> bool {
    let mission = Mission::random(seed);
    let (domain, mut problem) = parse(&mission.domain(), &mission.problem());
    let designs = Changes::of(&problem, "at", "waypoint", "design").designs;
    let is_available = |element: &InitialElement| matches!(element, InitialElement::Fact(fact) if words(fact)[0] == "fd_available");
    let mut random = Random(seed ^ 0xb10c);
    problem.init.retain(|element| !is_available(element) || random.below(3) == 0);
    let mut replanner = new(&domain, &problem);
    let metric = metric_after(&domain, &problem, &BigRational::default()).expect("a metric");
    let limits = Limits::none();
    let query =
        Query { problem: &problem, first: &[], metric, old: None, stay_close: false, limits: &limits };
    if replanner.plan(&query) != ReplanOutcome::Unsolvable {
        return false;
    }
    let blocking = replanner.blocking(&query).expect("an answer");
    let solvable_without = |blocked: &[&String]| {
        let mut problem = problem.clone();
        problem.init.retain(|element| !is_available(element));
        for design in designs.iter().filter(|design| !blocked.contains(design)) {
            problem.init.push(InitialElement::Fact(atom(&format!("fd_available {design}"))));
        }
        from_scratch(&domain, &problem).plan.is_some()
    };
    let all: Vec<&String> = blocking.iter().collect();
    assert!(!solvable_without(&all), "seed {seed}: {blocking:?} does not suffice");
    if blocking.is_empty() {
        return false;
    }
    for one in &all {
        let rest: Vec<&String> = all.iter().copied().filter(|other| other != one).collect();
        assert!(solvable_without(&rest), "seed {seed}: {blocking:?} needs not {one}");
    }
    true
}

#[test]
fn the_blocking_set_of_a_mission_is_minimal() {
    let found = (0..150).filter(|seed| check_blocking(*seed)).count();
    assert!(found > 10, "{found}");
}

#[test]
fn a_reconfiguration_at_the_last_step_counts() {
    let domain = "(define (domain robot) (:types place design function)
      (:predicates (at ?p - place) (suits ?d - design ?a ?b - place) (fd_solve_f ?d - design ?f - function)
        (fd_available ?d - design))
      (:functions (total-cost))
      (:action go :parameters (?f - function ?d - design ?a ?b - place)
        :precondition (and (at ?a) (suits ?d ?a ?b) (fd_solve_f ?d ?f) (fd_available ?d))
        :effect (and (not (at ?a)) (at ?b) (increase (total-cost) 1))))";
    let problem = "(define (problem two) (:domain robot)
      (:objects a b c - place f - function left right - design)
      (:init (at a) (suits right a b) (suits left b c) (suits right b c) (fd_solve_f left f) (fd_solve_f right f)
        (fd_available left) (fd_available right) (= (total-cost) 0))
      (:goal (at c)) (:metric minimize (total-cost)))";
    let (domain, problem) = parse(domain, problem);
    let solution = from_scratch(&domain, &problem);
    let steps = solution.plan.as_ref().map(|plan| named(&plan.steps)).expect("a plan");
    assert!(steps.iter().all(|(_, arguments)| arguments[1] == "right"), "{steps:?}");
    compare(&solution, &live(&mut new(&domain, &problem), &domain, &problem), &String::new);
}

fn generated(waypoints: usize, designs: usize, functions: usize) -> Option<(Domain, Problem)> {
    let directory = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let arguments = ["--family", "ugv", "--seed", "1", "--metric", "weighted", "--enc", "n", "--name", "map"];
    let sizes = [("--n", waypoints), ("--m", designs), ("--k", functions)];
    let sizes = sizes.into_iter().flat_map(|(name, size)| [name.to_owned(), size.to_string()]);
    let mut command = Command::new(python()?);
    command.arg(data("tools/gen_ratpa.py")?).args(arguments).args(sizes).arg("--out").arg(directory);
    let read =
        |part: &str| std::fs::read_to_string(directory.join(format!("map.n.{part}.pddl"))).expect("a file");
    assert!(command.output().is_ok_and(|output| output.status.success()), "the script makes a map");
    Some(parse(&read("domain"), &read("problem")))
}

/// CPU time of the thread in milliseconds.
fn used() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux tells");
    text.split(' ').next().and_then(|first| first.parse::<f64>().ok()).expect("nanoseconds") / 1e6
}

#[test]
#[ignore = "a measurement, for release builds"]
fn replanning_time_compared_with_planning_from_scratch() {
    println!("places designs functions   answers   anew ms  live ms  ratio  slowest anew  slowest live");
    for (waypoints, designs, functions) in [(20, 3, 2), (50, 6, 2), (100, 6, 2), (200, 6, 2), (100, 12, 3)] {
        let Some((domain, mut problem)) = generated(waypoints, designs, functions) else { return };
        let possible = Changes::of(&problem, "robot_at", "waypoint", "function_design");
        let mut random = Random(7);
        let mut replanner = new(&domain, &problem);
        let (mut anew, mut kept, mut old) = (Vec::new(), Vec::new(), None);
        for number in 0..40 {
            let before = used();
            let expected = from_scratch(&domain, &problem);
            anew.push(used() - before);
            let before = used();
            let mut found = live_with(&mut replanner, &domain, &problem, old.as_ref());
            if found == ReplanOutcome::Misfit {
                replanner = new(&domain, &problem);
                found = live(&mut replanner, &domain, &problem);
            }
            kept.push(used() - before);
            if let ReplanOutcome::Optimal { steps, .. } = &found {
                old = Some(named(steps));
            }
            compare(&expected, &found, &|| format!("{waypoints} places, change {number}"));
            possible.happen(&mut problem, &mut random);
        }
        let sum = |times: &[f64]| times.iter().sum::<f64>();
        let most = |times: &[f64]| times.iter().copied().fold(0.0, f64::max);
        println!(
            "{waypoints:6} {designs:7} {functions:9} {:9} {:9.1} {:8.1} {:6.2} {:13.1} {:13.1}",
            anew.len(),
            sum(&anew) / anew.len() as f64,
            sum(&kept) / kept.len() as f64,
            sum(&anew) / sum(&kept),
            most(&anew),
            most(&kept),
        );
    }
}

/// In this state, two atoms hold that are mutually exclusive in the mission, although they are values of
/// different variables.
#[test]
fn a_state_that_violates_a_mutex_group_is_ground_again() {
    let moves = [("t1", "c", "a"), ("x1", "a", "b"), ("x2", "b", "a"), ("u1", "c", "d"), ("u2", "d", "e")];
    let moves = moves.into_iter().chain([("u3", "e", "f"), ("u4", "f", "d")]);
    let actions: String = moves
        .map(|(name, from, to)| {
            format!(
                "(:action {name} :parameters () :precondition ({from}) :effect (and (not ({from})) ({to})))"
            )
        })
        .collect();
    let domain = format!(
        "(define (domain x) (:predicates (a) (b) (c) (d) (e) (f) (g)) (:functions (total-cost)) {actions}
          (:action w :parameters () :precondition (a) :effect (and (g) (increase (total-cost) 1))))"
    );
    let problem = |init: &str, goal: &str| {
        format!(
            "(define (problem p) (:domain x) (:init (= (total-cost) 0) {init}) (:goal (and {goal}))
          (:metric minimize (total-cost)))"
        )
    };
    for (goal, steps) in [("(a) (b)", 1), ("(b) (g)", 2)] {
        let (tree, base) = parse(&domain, &problem("(c)", goal));
        let mut replanner = new(&tree, &base);
        let (tree, both) = parse(&domain, &problem("(c) (b)", goal));
        assert_eq!(live(&mut replanner, &tree, &both), ReplanOutcome::Misfit, "{goal}");
        let anew = from_scratch(&tree, &both);
        assert_eq!(anew.plan.map(|plan| plan.steps.len()), Some(steps), "{goal}");
    }
}

/// A condition over all does not apply to an action with the duration 0, so the design need not be available.
#[test]
fn availability_over_all_is_required_only_with_a_duration() {
    let available = [Name::new("fd_available")];
    for (duration, condition, is_suited) in [
        ("0", "(over all (fd_available ?d))", false),
        ("0", "(and (at start (fd_available ?d)) (over all (fd_available ?d)))", true),
        ("1", "(over all (fd_available ?d))", true),
    ] {
        let domain = format!(
            "(define (domain d) (:types design) (:predicates (fd_available ?d - design) (done))
              (:durative-action act :parameters (?d - design) :duration (= ?duration {duration}) :condition {condition}
                :effect (at end (done))))"
        );
        let problem =
            "(define (problem p) (:domain d) (:objects x - design) (:init (fd_available x)) (:goal (done)))";
        let (domain, problem) = parse(&domain, problem);
        let replanner = Replanner::new(&domain, &problem, &available, &GroundConfig::default());
        assert_eq!(replanner.is_some(), is_suited, "{duration}, {condition}");
    }
}

/// The check accepts an object without a type as an argument of a typed parameter.
#[test]
fn designs_without_a_type_can_become_available() {
    let domain = "(define (domain d) (:types function design)
      (:predicates (fd_available ?d - design) (fd_solve_f ?d - design ?f - function) (done))
      (:functions (total-cost) (price ?d))
      (:action work :parameters (?d ?f) :precondition (and (fd_solve_f ?d ?f) (fd_available ?d))
        :effect (and (done) (increase (total-cost) (price ?d)))))";
    let problem = "(define (problem p) (:domain d) (:objects typed - design bare f)
      (:init (fd_solve_f typed f) (fd_solve_f bare f) (= (price typed) 2) (= (price bare) 1) (= (total-cost) 0)
        (fd_available typed))
      (:goal (done)) (:metric minimize (total-cost)))";
    let (domain, mut problem) = parse(domain, problem);
    let mut replanner = new(&domain, &problem);
    problem.init.push(InitialElement::Fact(atom("fd_available bare")));
    let mut check = |problem: &Problem, metric: i64| {
        let plan = live(&mut replanner, &domain, problem);
        compare(&from_scratch(&domain, problem), &plan, &|| format!("{:?}", problem.init));
        let ReplanOutcome::Optimal { metric: best, .. } = plan else { panic!("no plan") };
        assert_eq!(best, BigRational::from_integer(metric.into()));
    };
    check(&problem, 1);
    let typed = ["fd_available", "typed"];
    problem.init.retain(|element| !matches!(element, InitialElement::Fact(fact) if words(fact) == typed));
    check(&problem, 1);
}
