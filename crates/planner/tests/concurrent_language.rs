//! Overlapping actions with state-dependent durations or effects, and with bounded durations: tests of plans
//! and of claims.

use metaplan_planner::{GroundConfig, Limits, PlannerPart, Status, ground_concurrent, optimize_concurrent};
use num_bigint::BigInt;
use num_rational::BigRational;
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};

use crate::widths;

/// Checks status and metric of the solution, with a separation of 1/1000. The validator executes the plan.
fn check(actions: &str, init: &str, goal: &str, expected: (Status, Option<&str>)) {
    let domain =
        format!("(define (domain d) (:predicates (p) (q) (g) (on ?x)) (:functions (fuel) (log)) {actions})");
    let problem = format!(
        "(define (problem n) (:domain d) (:objects a b) (:init (= (fuel) 4) (= (log) 0) {init})
           (:goal (and {goal})) (:metric minimize (total-time)))"
    );
    let read = read(&Source::new("domain", domain.clone()), &Source::new("problem", problem.clone()));
    let (domain_read, problem_read, _) = read.unwrap_or_else(|errors| panic!("{errors:?}\n{domain}"));
    let separation = BigRational::new(BigInt::from(1), BigInt::from(1000));
    let solution = widths::solve(&domain_read, &problem_read, &separation, &Limits::none());
    let cost = solution.plan.as_ref().map(|plan| plan.cost.to_string());
    assert_eq!((solution.status, cost.as_deref()), expected, "{domain}\n{problem}");
    let Some(plan) = &solution.plan else { return };
    let lines = plan.steps.iter().map(|step| {
        let words = [std::slice::from_ref(&step.action), &step.arguments[..]].concat().join(" ");
        format!("{}: ({words}) [{}]\n", step.start, step.duration)
    });
    let text: String = lines.collect();
    let parsed = PlanText::parse(&Source::new("plan", text.clone())).expect("a plan");
    let options = Options::default().with_concurrent(true).with_tolerance(separation);
    let verdict = validate(&domain_read, &problem_read, &parsed, &options);
    assert!(verdict.valid, "{text}{:?}", verdict.violation);
    assert_eq!(verdict.metric, Some(plan.cost.to_rational()), "{text}");
}

fn durative(name: &str, duration: &str, condition: &str, effect: &str) -> String {
    format!(
        "(:durative-action {name} :parameters () :duration {duration}
           :condition (and {condition}) :effect (and {effect}))\n"
    )
}

#[test]
fn effects_on_numbers_have_conditions() {
    let light = durative("light", "(= ?duration 1)", "", "(at end (p))");
    for time in ["at start", "at end"] {
        let effect = format!("({time} (when (not (p)) (decrease (fuel) 3))) (at end (g))");
        let all = [light.clone(), durative("go", "(= ?duration 2)", "", &effect)].concat();
        // The search proves nothing here. With the effect at the end, the critical path of length 2 is a proof.
        let (status, later) =
            if time == "at start" { (Status::Feasible, "3.001") } else { (Status::Optimal, "2") };
        check(&all, "", "(g)", (status, Some("2")));
        check(&all, "", "(g) (>= (fuel) 2)", (status, Some(later)));
    }
}

#[test]
fn a_duration_is_that_of_the_state_at_the_start() {
    let fill =
        || durative("fill", "(= ?duration (- 10 (fuel)))", "", "(at end (assign (fuel) 10)) (at end (g))");
    check(&fill(), "", "(g)", (Status::Optimal, Some("6")));
    // More fuel shortens the filling, so `pour` comes first.
    let pour = durative(
        "pour",
        "(= ?duration 1)",
        "(at start (q))",
        "(at start (increase (fuel) 5)) (at start (not (q)))",
    );
    check(&[fill(), pour.clone()].concat(), "(q)", "(g)", (Status::Optimal, Some("1.001")));
    // At the end, `?duration` has its value from the start, even if the state has changed.
    let counted = || {
        durative(
            "fill",
            "(= ?duration (- 10 (fuel)))",
            "",
            "(at end (increase (log) ?duration)) (at end (g))",
        )
    };
    let drained = "(at start (assign (fuel) 0)) (at end (p))";
    let drain = durative("drain", "(= ?duration 1)", "", drained);
    check(&[counted(), drain.clone()].concat(), "", "(g) (p) (>= (log) 6)", (Status::Optimal, Some("6")));
    // Two simultaneous runs count twice.
    check(&[counted(), drain.clone()].concat(), "", "(g) (p) (>= (log) 10)", (Status::Optimal, Some("6")));
    let once = counted()
        .replace("(and )", "(at start (not (q)))")
        .replace("(at end (g))", "(at start (q)) (at end (g))");
    check(&[once, drain].concat(), "", "(g) (p) (>= (log) 10)", (Status::Optimal, Some("10.001")));
    // An action of duration 0 is a single happening. Its end must not change a number on which its duration
    // depends.
    check(&fill().replace("10", "4"), "", "(g)", (Status::Unsolvable, None));
    let counts = durative("counts", "(= ?duration (- 4 (fuel)))", "", "(at end (g))");
    check(&[counts, pour].concat(), "(q)", "(g)", (Status::Optimal, Some("0")));
}

#[test]
fn a_state_dependent_duration_may_have_a_static_divisor() {
    let fill = |divisor: &str| {
        let duration = format!("(= ?duration (/ (- 10 (fuel)) {divisor}))");
        durative("fill", &duration, "", "(at end (assign (fuel) 10)) (at end (g))")
    };
    check(&fill("4"), "", "(g)", (Status::Optimal, Some("1.5")));
    check(&fill("0.15"), "", "(g)", (Status::Optimal, Some("40")));
    // More fuel shortens the filling.
    let pour = durative(
        "pour",
        "(= ?duration 1)",
        "(at start (q))",
        "(at start (increase (fuel) 5)) (at start (not (q)))",
    );
    check(&[fill("2"), pour.clone()].concat(), "(q)", "(g)", (Status::Optimal, Some("1")));
    check(&[fill("0.5"), pour].concat(), "(q)", "(g) (>= (fuel) 10)", (Status::Optimal, Some("2.001")));
}

#[test]
fn conditional_effects_at_the_end_are_proved_only_by_bounds() {
    let helps = durative("helps", "(= ?duration 2)", "", "(at start (p)) (at end (not (p)))");
    let asks =
        |effect: &str| durative("asks", "(= ?duration 1)", "", &format!("(at end (when (p) {effect}))"));
    check(&[asks("(g)"), helps.clone()].concat(), "", "(g)", (Status::Feasible, Some("2")));
    // The proof of unsolvability does not depend on times.
    check(&asks("(g)"), "", "(g)", (Status::Unsolvable, None));
    let each = "(:durative-action each :parameters () :duration (= ?duration 3) :condition ()
                  :effect (at end (forall (?x) (when (on ?x) (not (on ?x))))))";
    check(each, "(on a)", "(not (on a)) (not (on b))", (Status::Optimal, Some("3")));
}

#[test]
fn durations_within_bounds() {
    let bounded = |bounds: &str| durative("a", bounds, "", "(at end (g))");
    check(&bounded("(and (>= ?duration 4) (<= ?duration 4))"), "", "(g)", (Status::Optimal, Some("4")));
    check(&bounded("(and (>= ?duration 4) (<= ?duration 6))"), "", "(g)", (Status::Optimal, Some("4")));
}

#[test]
fn errors_about_unscalable_numbers_name_the_action() {
    let domain = "(define (domain d) (:functions (fuel))
      (:action halve :parameters () :effect (scale-up (fuel) 0.5)))";
    let problem = "(define (problem p) (:domain d) (:init (= (fuel) 4)) (:goal (<= (fuel) 1)))";
    let (domain_read, problem, _) =
        read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
    let separation = BigRational::new(BigInt::from(1), BigInt::from(1000));
    let errors = ground_concurrent(&domain_read, &problem, &GroundConfig::default(), &separation)
        .expect_err("no scale makes an integer of it");
    let [error] = &errors[..] else { panic!("{errors:?}") };
    assert_eq!(error.code(), "E304");
    assert!(error.to_string().contains("`halve`"), "{error}");
    let place = error.place().expect("a place");
    assert_eq!(place.file, metaplan_planner::File::Domain);
    assert!(domain[place.span.start as usize..place.span.end as usize].contains("halve"), "{place:?}");
}

#[test]
fn a_metric_with_the_divisor_zero_is_refused() {
    let domain = "(define (domain d) (:predicates (g))
      (:durative-action a :parameters () :duration (= ?duration 2) :condition () :effect (at end (g))))";
    for metric in ["(/ (total-time) 0)", "(+ (total-time) (/ 2 0))"] {
        let text =
            format!("(define (problem p) (:domain d) (:init) (:goal (g)) (:metric minimize {metric}))");
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", &*text)).expect("PDDL");
        let separation = BigRational::new(BigInt::from(1), BigInt::from(1000));
        let errors = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation)
            .expect_err("the metric has no value");
        let [error] = &errors[..] else { panic!("{errors:?}") };
        assert_eq!(error.code(), "E303");
        assert!(error.to_string().contains("the divisor is 0"), "{error}");
        let place = error.place().expect("a place");
        assert_eq!(place.file, metaplan_planner::File::Problem);
        assert!(text[place.span.start as usize..].starts_with("(/"), "{place:?}");
    }
}

#[test]
fn search_statistics_and_history_are_recorded() {
    let tower = |count: usize| {
        let names: Vec<String> = (0..count).map(|index| format!("k{index}")).collect();
        let each = |text: &str| names.iter().map(|name| [text, name, ")"].concat()).collect::<String>();
        let (init, goal) = (each("(off "), each("(on "));
        let domain = "(define (domain d) (:predicates (on ?x) (off ?x) (free)) (:functions (total-cost))
          (:durative-action switch :parameters (?x) :duration (= ?duration 2)
            :condition (and (at start (free)) (at start (off ?x)))
            :effect (and (at start (not (free))) (at start (not (off ?x))) (at end (on ?x)) (at end (free)))))";
        let objects = names.join(" ");
        let problem = format!(
            "(define (problem n) (:domain d) (:objects {objects}) (:init (free) {init}) (:goal (and {goal})))"
        );
        let read = read(&Source::new("domain", domain), &Source::new("problem", problem));
        let (domain, problem, _) = read.expect("PDDL");
        let separation = BigRational::new(BigInt::from(1), BigInt::from(1000));
        let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation);
        let mut heard = 0;
        let limits = Limits::none().with_room(1 << 24);
        let solution = optimize_concurrent(&task.expect("a task"), &limits, &mut |_| heard += 1);
        (solution, heard)
    };
    let (solution, heard) = tower(3);
    let statistics = &solution.statistics;
    assert_eq!((solution.status, statistics.found_by), (Status::Optimal, Some(PlannerPart::Search)));
    assert!(0 < statistics.expanded && statistics.expanded <= statistics.generated, "{statistics:?}");
    assert!(0 < statistics.evaluated && statistics.evaluated <= statistics.generated + 1, "{statistics:?}");
    let known = statistics.history.iter().filter(|moment| moment.cost.is_some()).count();
    assert_eq!(known, heard, "{statistics:?}");
    let last = statistics.history.last().expect("a moment");
    assert_eq!(
        (last.cost.as_ref(), Some(&last.lower_bound)),
        (solution.plan.as_ref().map(|plan| &plan.cost), solution.lower_bound.as_ref())
    );
    assert!(statistics.history.is_sorted_by_key(|moment| moment.time));
    assert!(statistics.history.iter().all(|moment| moment.time <= statistics.search));
    // With little memory, the satisficing search soon finds a plan that A* does not find.
    let (solution, _) = tower(18);
    assert_eq!(solution.statistics.found_by, Some(PlannerPart::Satisficing));
    assert!(solution.statistics.history.iter().any(|moment| moment.cost.is_some()));
}

/// The planner evaluates durations at the start. A value at the end may differ.
#[test]
fn a_duration_at_end_must_not_read_what_changes() {
    let ground_with = |time: &str| {
        let domain = format!(
            "(define (domain d) (:predicates (g) (h)) (:functions (f))
               (:durative-action a :parameters () :duration ({time} (= ?duration (f))) :condition (and)
                 :effect (at end (g)))
               (:action b :parameters () :precondition (and) :effect (and (assign (f) 7) (h))))"
        );
        let problem = "(define (problem p) (:domain d) (:init (= (f) 3)) (:goal (and (g) (h))))";
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
        let separation = BigRational::new(BigInt::from(1), BigInt::from(1000));
        ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation)
    };
    assert!(ground_with("at start").is_ok());
    let Err(errors) = ground_with("at end") else { panic!("the plan would be invalid") };
    assert!(errors.iter().all(|error| error.to_string().contains("a duration `at end`")), "{errors:?}");
}
