//! Plans with conditional effects, derived predicates, quantifiers and disjunctions: tasks with known optima,
//! and random tasks on which heuristic search and the SAT solver must agree. (Other tests compare the ground
//! tasks with an interpreter of the files.)

use metaplan_planner::{Config, Engine, GroundConfig, Solution, Status, ground, optimize};
use testing::adl::Generator;
use testing::random::Random;

use crate::tally::limits;
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};

/// Engines, each with the number of states that A\* stores before satisficing search and SAT solver
/// start.
const WAYS: [(Engine, usize); 5] =
    [(Engine::Auto, 20_000), (Engine::Auto, 30), (Engine::Auto, 1), (Engine::Search, 1), (Engine::Sat, 0)];

fn solve(domain: &str, problem: &str, engine: Engine, head_start: usize) -> Solution {
    let (domain, problem, _) = read(&Source::new("domain", domain), &Source::new("problem", problem))
        .unwrap_or_else(|errors| panic!("{errors:?}\n{domain}\n{problem}"));
    let task = ground(&domain, &problem, &GroundConfig::default())
        .unwrap_or_else(|errors| panic!("{errors:?}\n{domain:?}"));
    let config = Config::default().with_engine(engine).with_head_start(head_start);
    let config = config.with_limits(limits(head_start));
    optimize(&task, &config, &mut |_| {})
}

/// Checks the optimal cost with several engines. `None` means that no plan exists.
fn check(name: &str, domain: &str, problem: &str, expected: Option<&str>) {
    for (engine, head_start) in WAYS {
        let solution = solve(domain, problem, engine, head_start);
        let found = solution.plan.map(|plan| plan.cost.to_string());
        assert_eq!(found.as_deref(), expected, "{name}, {engine:?}, {head_start}");
        let status = if expected.is_some() { Status::Optimal } else { Status::Unsolvable };
        assert_eq!(solution.status, status, "{name}, {engine:?}, {head_start}");
    }
}

const BRIEFCASE: &str = "(define (domain briefcase)
 (:types place item)
 (:predicates (at ?i - item ?l - place) (in ?i - item) (is-at ?l - place))
 (:functions (total-cost) (weight ?i - item))
 (:action move :parameters (?m ?l - place)
  :precondition (and (is-at ?m) (not (= ?m ?l)))
  :effect (and (is-at ?l) (not (is-at ?m)) (increase (total-cost) 1)
    (forall (?x - item) (when (in ?x)
      (and (at ?x ?l) (not (at ?x ?m)) (increase (total-cost) (weight ?x)))))))
 (:action take-out :parameters (?x - item) :precondition (in ?x)
  :effect (and (not (in ?x)) (increase (total-cost) 0.25)))
 (:action put-in :parameters (?x - item ?l - place)
  :precondition (and (not (in ?x)) (at ?x ?l) (is-at ?l)) :effect (and (in ?x) (increase (total-cost) 0.25))))";

#[test]
fn conditional_and_universal_effects() {
    // An optimal plan carries a there (1 + 2) and b back (1 + 3), and handles the briefcase four times.
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain briefcase) (:objects home office - place a b - item)
             (:init (is-at home) (at a home) (at b office) (= (weight a) 2) (= (weight b) 3) (= (total-cost) 0))
             (:goal {goal}) (:metric minimize (total-cost)))"
        )
    };
    let swap = problem("(and (at a office) (at b home) (forall (?x - item) (not (in ?x))))");
    check("swap", BRIEFCASE, &swap, Some("8"));
    check("carry", BRIEFCASE, &problem("(exists (?x - item) (and (at ?x office) (in ?x)))"), Some("1.25"));
    check("both places", BRIEFCASE, &problem("(and (at a home) (at a office))"), None);
}

const NETWORK: &str = "(define (domain network)
 (:types node)
 (:predicates (link ?a ?b - node) (up ?a ?b - node) (reaches ?a ?b - node) (isolated ?a - node)
   (neighbours ?a ?b - node) (done))
 (:functions (power) (total-cost))
 (:derived (reaches ?a ?b - node) (or (up ?a ?b) (exists (?c - node) (and (up ?a ?c) (reaches ?c ?b)))))
 (:derived (isolated ?a - node) (forall (?b - node) (not (reaches ?b ?a))))
 (:derived (neighbours ?a ?b - node) (or (link ?a ?b) (link ?b ?a)))
 (:action switch :parameters (?a ?b - node)
   :precondition (and (neighbours ?a ?b) (not (up ?a ?b)) (or (>= (power) 2) (isolated ?b)))
   :effect (and (up ?a ?b) (decrease (power) 1) (increase (total-cost) 1)))
 (:action cut :parameters (?a ?b - node) :precondition (up ?a ?b)
   :effect (and (not (up ?a ?b)) (increase (total-cost) 1)))
 (:action charge :parameters () :precondition (< (power) 2)
   :effect (and (assign (power) 3) (increase (total-cost) 5))))";

#[test]
fn derived_predicates_and_numbers_in_disjunctions() {
    let problem = |goal: &str| {
        format!(
            "(define (problem p) (:domain network) (:objects a b c - node)
             (:init (link a b) (link b c) (link c a) (= (power) 0) (= (total-cost) 0))
             (:goal {goal}) (:metric minimize (total-cost)))"
        )
    };
    let check = |name, goal, expected| check(name, NETWORK, &problem(goal), expected);
    check("a path", "(reaches a c)", Some("1"));
    check("a cycle", "(reaches a a)", Some("2"));
    // The second edge to a requires power, because a is no longer isolated.
    check("in twice", "(and (up b a) (up c a))", Some("7"));
    // The goal holds initially, so the empty plan is optimal.
    check("isolated", "(forall (?x - node) (isolated ?x))", Some("0"));
    check("one but not back", "(and (reaches a c) (not (reaches c a)) (reaches b c))", Some("2"));
    check("never", "(and (reaches a b) (isolated b))", None);
}

/// The speeds of two clocks differ by less than floating-point numbers can represent.
#[test]
fn differences_that_no_double_holds_count() {
    let domain = "(define (domain clocks) (:functions (fast) (slow) (total-cost))
     (:action tick :parameters ()
       :effect (and (increase (fast) 10000000000000001) (increase (slow) 10000000000000000)
         (increase (total-cost) 1))))";
    let problem = "(define (problem p) (:domain clocks)
     (:init (= (fast) 0) (= (slow) 0) (= (total-cost) 0))
     (:goal (>= (- (fast) (slow)) 6)) (:metric minimize (total-cost)))";
    check("clocks", domain, problem, Some("6"));
}

const DURATIVE: &str = "(define (domain rooms)
 (:requirements :durative-actions)
 (:predicates (lit) (warm) (dark) (inside) (done))
 (:functions (heat))
 (:durative-action enter :parameters () :duration (and (>= ?duration 2) (<= ?duration 5))
   :condition (and (at start (not (inside))) (over all (or (lit) (warm))))
   :effect (and (at start (inside)) (at start (when (dark) (lit))) (at end (when (lit) (done)))
     (at end (when (not (dark)) (done)))))
 (:durative-action heat-up :parameters () :duration (= ?duration 3)
   :condition (at start (< (heat) 4)) :effect (and (at end (increase (heat) 2)) (at end (when (>= (heat) 2) (warm))))))";

#[test]
fn durative_actions_with_cases() {
    let problem = |init: &str| {
        format!(
            "(define (problem p) (:domain rooms) (:init (= (heat) 0) {init}) (:goal (done)) (:metric minimize (total-time)))"
        )
    };
    // In the dark, the light is switched on when the robot enters.
    check("dark", DURATIVE, &problem("(dark)"), Some("2"));
    // Otherwise it must be warm. The second heating finds the temperature at 2.
    check("cold", DURATIVE, &problem(""), Some("8"));
    check("inside", DURATIVE, &problem("(dark) (inside)"), None);
}

#[test]
fn derived_predicates_recur_through_forall() {
    let domain = "(define (domain d) (:types part)
      (:predicates (below ?a ?b - part) (broken ?a - part) (sound ?a - part))
      (:functions (total-cost))
      (:derived (sound ?a - part) (and (not (broken ?a)) (forall (?b - part) (or (not (below ?b ?a)) (sound ?b)))))
      (:action mend :parameters (?a - part) :precondition (broken ?a)
        :effect (and (not (broken ?a)) (increase (total-cost) 1))))";
    let problem = |broken: &str| {
        format!(
            "(define (problem p) (:domain d) (:objects a b c d - part)
             (:init (below b a) (below c b) (= (total-cost) 0) {broken}) (:goal (sound a)) (:metric minimize (total-cost)))"
        )
    };
    check("sound", domain, &problem(""), Some("0"));
    check("one of two", domain, &problem("(broken c) (broken d)"), Some("1"));
    check("both", domain, &problem("(broken c) (broken a)"), Some("2"));
}

#[test]
fn a_derived_predicate_that_the_start_changes_is_refused() {
    let domain = DURATIVE
        .replace("(:functions", "(:derived (bright) (or (lit) (warm))) (:functions")
        .replace("(inside) (done))", "(inside) (done) (bright))")
        .replace("(over all (or (lit) (warm)))", "(over all (bright))");
    let problem = "(define (problem p) (:domain rooms) (:init (= (heat) 0)) (:goal (done)))";
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let errors = ground(&domain, &problem, &GroundConfig::default()).expect_err("a refusal");
    assert!(errors.iter().any(|error| error.to_string().contains("its own start effects")), "{errors:?}");
}

/// The duration is 5. If the condition read the value after the start, there would be no plan.
#[test]
fn a_duration_that_the_start_changes_is_refused() {
    let domain = "(define (domain d) (:requirements :durative-actions :numeric-fluents)
      (:predicates (ready) (done)) (:functions (need))
      (:durative-action work :parameters () :duration (= ?duration (need))
        :condition (and (at start (ready)) (at end (>= ?duration 3)))
        :effect (and (at start (assign (need) 1)) (at end (done)))))";
    let problem = "(define (problem p) (:domain d) (:init (ready) (= (need) 5)) (:goal (done)))";
    let (domain, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let errors = ground(&domain, &problem, &GroundConfig::default()).expect_err("a refusal");
    assert!(
        errors.iter().any(|error| error.to_string().contains("a function of the duration")),
        "{errors:?}"
    );
}

/// With duration 0, the condition over all is void, so the action is executable. Its longest duration is not.
#[test]
fn a_longest_duration_is_refused_if_zero_is_admissible() {
    let domain = |bounds: &str| {
        format!(
            "(define (domain d) (:requirements :durative-actions :duration-inequalities) (:predicates (q) (g))
              (:durative-action go :parameters () :duration {bounds}
                :condition (over all (q)) :effect (at end (g))))"
        )
    };
    let problem = "(define (problem p) (:domain d) (:init) (:goal (g)) (:metric maximize (total-time)))";
    let read_both = |bounds: &str| {
        read(&Source::new("domain", domain(bounds)), &Source::new("problem", problem)).expect("PDDL")
    };
    for bounds in ["(<= ?duration 5)", "(and (>= ?duration 0) (<= ?duration 5))"] {
        let (domain, problem, _) = read_both(bounds);
        let plan = PlanText::parse(&Source::new("plan", "0: (go) [0]")).expect("a plan");
        assert!(validate(&domain, &problem, &plan, &Options::default()).valid, "{bounds}");
        let errors = ground(&domain, &problem, &GroundConfig::default()).expect_err("a refusal");
        assert!(errors.iter().all(|error| error.to_string().contains("may be 0")), "{errors:?}");
    }
    let accepted = [
        "(and (> ?duration 0) (<= ?duration 5))",
        "(and (>= ?duration 1) (<= ?duration 5))",
        // No other duration is admissible.
        "(<= ?duration 0)",
        "(<= ?duration -1)",
    ];
    for bounds in accepted {
        let (domain, problem, _) = read_both(bounds);
        assert!(ground(&domain, &problem, &GroundConfig::default()).is_ok(), "{bounds}");
    }
}

#[test]
fn numbers_below_zero_do_no_harm_where_nothing_is_used() {
    let domain = "(define (domain d) (:predicates (done)) (:functions (level) (total-cost))
      (:action sink :parameters () :precondition (>= (level) 2) :effect (decrease (level) 2))
      (:action end :parameters () :precondition (< (level) 0) :effect (and (done) (increase (total-cost) 1))))";
    let dig = "(:action dig :parameters () :precondition (not (dug))
        :effect (and (dug) (assign (level) -5) (increase (total-cost) 1)))";
    let digging = domain
        .replace("(done))", "(done) (dug))")
        .replace("(:action sink", &format!("{dig} (:action sink"))
        .replace("(< (level) 0)", "(and (dug) (< (level) 0))");
    let problem = |level: &str| {
        format!(
            "(define (problem p) (:domain d) (:init (= (level) {level}) (= (total-cost) 0)) (:goal (done))
             (:metric minimize (total-cost)))"
        )
    };
    check("below from the start", domain, &problem("-3"), Some("1"));
    check("dug", &digging, &problem("1"), Some("2"));
}

/// Limit on steps, because the SAT solver cannot prove that there is no plan of any length.
const HORIZON: usize = 4;

fn agree(seeds: std::ops::Range<u64>) {
    let (mut solved, mut longest) = (0, 0);
    for seed in seeds {
        let mut random = Generator(Random(seed));
        let (domain, problem) = (random.domain(), random.problem());
        let (parsed, goal, _) = read(&Source::new("domain", &domain), &Source::new("problem", &problem))
            .unwrap_or_else(|errors| panic!("seed {seed}: {errors:?}\n{domain}\n{problem}"));
        let task = ground(&parsed, &goal, &GroundConfig::default())
            .unwrap_or_else(|errors| panic!("seed {seed}: {errors:?}\n{domain}\n{problem}"));
        let run = |engine| {
            let config = Config::default().with_horizon(HORIZON).with_engine(engine);
            optimize(&task, &config, &mut |_| {})
        };
        let (quick, sat) = (run(Engine::Auto), run(Engine::Sat));
        let cost = |solution: &Solution| solution.plan.as_ref().map(|plan| plan.cost.to_string());
        assert_eq!(cost(&quick), cost(&sat), "seed {seed}\n{domain}\n{problem}\n{quick:?}\n{sat:?}");
        let known = optimize(&task, &Config::default().with_head_start(1_000_000), &mut |_| {});
        for head_start in [1, 10, 100] {
            let config = Config::default().with_engine(Engine::Search).with_head_start(head_start);
            let config = config.with_limits(limits(head_start));
            let found = optimize(&task, &config, &mut |_| {});
            let context = || format!("seed {seed}, {head_start}\n{domain}\n{problem}\n{known:?}\n{found:?}");
            assert_eq!((found.status, cost(&found)), (known.status, cost(&known)), "{}", context());
        }
        solved += usize::from(cost(&quick).is_some());
        longest = longest.max(quick.plan.map_or(0, |plan| plan.steps.len()));
    }
    assert!(solved > 0 && longest > 1, "{solved} solved, the longest plan has {longest} steps");
}

#[test]
fn search_and_solver_agree() {
    agree(0..60);
}

#[test]
#[ignore = "minutes"]
fn search_and_solver_agree_on_many() {
    agree(1_000..4_000);
}
