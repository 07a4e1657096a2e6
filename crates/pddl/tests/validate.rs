//! Tests of the validator: valid plans, and invalid plans for most kinds of violations.

use num_rational::BigRational;

use metaplan_pddl::validate::{Options, PlanText, Verdict, validate, validate_within};
use metaplan_pddl::{Source, ast, read, render};

fn parse(domain: &str, problem: &str) -> (ast::Domain, ast::Problem) {
    let (domain, problem) = (Source::new("domain", domain), Source::new("problem", problem));
    match read(&domain, &problem) {
        Ok((domain_tree, problem_tree, _)) => (domain_tree, problem_tree),
        Err(errors) => panic!("{}", render(&errors, &[&domain, &problem], false)),
    }
}

fn run((domain, problem): &(ast::Domain, ast::Problem), plan: &str, options: &Options) -> Verdict {
    let plan = PlanText::parse(&Source::new("plan", plan)).expect("the plan can be read");
    validate(domain, problem, &plan, options)
}

/// Formats a verdict on one line: `valid time=T metric=M values`, or step, kind and unmet conditions.
fn summary(verdict: &Verdict) -> String {
    let Some(violation) = &verdict.violation else {
        let metric = verdict.metric.as_ref().map(|metric| format!(" metric={metric}")).unwrap_or_default();
        let values: Vec<_> = verdict.values.iter().map(|(name, value)| format!(" {name}={value}")).collect();
        assert!(verdict.valid);
        return format!("valid time={}{metric}{}", verdict.total_time, values.concat());
    };
    assert!(!verdict.valid && verdict.metric.is_none());
    let step = violation.step.map_or("-".to_owned(), |step| step.to_string());
    let unmet = violation.unmet.iter().map(|unmet| {
        let values = unmet.values.iter().map(|(name, value)| {
            format!(" {name}={}", value.as_ref().map_or("?".to_owned(), ToString::to_string))
        });
        format!(" {}{}", unmet.condition, values.collect::<String>())
    });
    format!("{step} {}{}", violation.kind.as_str(), unmet.collect::<String>())
}

fn check(task: &(ast::Domain, ast::Problem), cases: &[(&str, &str)]) {
    for (plan, expected) in cases {
        assert_eq!(summary(&run(task, plan, &Options::default())), *expected, "{plan}");
    }
}

fn check_concurrent(task: &(ast::Domain, ast::Problem), cases: &[(&str, &str)]) {
    let options = Options::default().with_concurrent(true);
    for (plan, expected) in cases {
        assert_eq!(summary(&run(task, plan, &options)), *expected, "{plan}");
    }
}

fn classical() -> (ast::Domain, ast::Problem) {
    parse(
        "(define (domain d) (:types place dock - place tool)
         (:predicates (at ?x - place) (link ?x ?y - place) (broken ?t - tool) (seen ?x - place))
         (:functions (battery) (use ?x ?y - place) (total-cost))
         (:action go :parameters (?x ?y - place)
          :precondition (and (at ?x) (link ?x ?y) (>= (battery) (use ?x ?y)))
          :effect (and (not (at ?x)) (at ?y) (decrease (battery) (use ?x ?y)) (increase (total-cost) 1.5)
                       (when (not (seen ?y)) (seen ?y))))
         (:action go :parameters (?t - tool) :effect (broken ?t))
         (:action go :parameters (?x - dock) :precondition (at ?x) :effect (assign (battery) 10))
         (:action sweep :parameters () :precondition (exists (?x - dock) (at ?x))
          :effect (forall (?y - place) (when (not (at ?y)) (seen ?y))))
         (:action square :parameters () :effect (assign (battery) (* (battery) (battery))))
         (:action clash :parameters () :effect (and (increase (battery) 1) (assign (battery) 5)))
         (:action swap :parameters () :effect (and (not (at a)) (at a))))",
        "(define (problem p) (:domain d) (:objects a b - place d - dock t - tool)
         (:init (at a) (link a b) (link b d) (link d a) (= (battery) 4) (= (use a b) 3) (= (use b d) 1))
         (:goal (and (at d) (forall (?t - tool) (not (broken ?t))))) (:metric minimize (+ (total-cost) (* 2 (battery)))))",
    )
}

#[test]
fn sequential_plans_of_a_classical_task_are_judged() {
    check(
        &classical(),
        &[
            ("(go a b)\n(go b d)", "valid time=0 metric=3 (battery)=0 (total-cost)=3"),
            (
                "; nothing\n  (GO A B) ; first\n\n(go b d)\n(go d)",
                "valid time=0 metric=23 (battery)=10 (total-cost)=3",
            ),
            ("", "- goal (at d)"),
            ("(go b d)", "1 at_start (at b)"),
            ("(go a b)\n(go b d)\n(go t)", "- goal (forall (?t - tool) (not (broken ?t)))"),
            (
                "(go a b)\n(go b d)\n(go d)\n(go d a)",
                "4 undefined (>= (battery) (use d a)) (battery)=10 (use d a)=?",
            ),
            ("(square)\n(go a b)\n(go b d)\n(sweep)", "valid time=0 metric=27 (battery)=12 (total-cost)=3"),
            ("(swap)\n(go a b)\n(go b d)", "valid time=0 metric=3 (battery)=0 (total-cost)=3"),
            ("(sweep)", "1 at_start (exists (?x - dock) (at ?x))"),
            ("(clash)", "1 conflict"),
            ("(fly a b)", "1 unknown_action"),
            ("(go a c)", "1 unknown_object"),
            ("(go a)", "1 arguments"),
            ("(go a b d)", "1 arguments"),
            ("(sweep a)", "1 arguments"),
        ],
    );
}

#[test]
fn the_size_of_numbers_is_limited() {
    let plan = "(square)\n".repeat(200);
    let verdict = run(&classical(), &plan, &Options::default());
    assert!(summary(&verdict).ends_with("undefined"), "{}", summary(&verdict));
}

#[test]
fn deep_conditions_are_evaluated() {
    let cases = [
        ("(not (not ", "))", 95),
        ("(and (p) ", ")", 190),
        ("(or (q) ", ")", 190),
        ("(imply (p) ", ")", 190),
        ("(exists (?x) ", ")", 190),
        ("(forall (?x) ", ")", 190),
    ];
    for (open, close, depth) in cases {
        let deep = format!("{}(p){}", open.repeat(depth), close.repeat(depth));
        let domain = format!(
            "(define (domain d) (:predicates (p) (q) (r)) (:derived (r) {deep})
             (:action a :parameters () :precondition {deep} :effect (when {deep} (q))))"
        );
        let problem =
            format!("(define (problem p) (:domain d) (:objects o) (:init (p)) (:goal (and (r) {deep} (q))))");
        check(&parse(&domain, &problem), &[("(a)", "valid time=0"), ("", "- goal (q)")]);
    }
}

fn temporal() -> (ast::Domain, ast::Problem) {
    parse(
        "(define (domain d) (:predicates (idle) (busy) (warm) (done) (day) (lit))
         (:functions (level) (rate))
         (:durative-action work :parameters () :duration (= ?duration (/ 10 (rate)))
          :condition (and (at start (idle)) (over all (warm)) (at end (day)))
          :effect (and (at start (not (idle))) (at start (busy)) (at end (idle)) (at end (done))
                       (at end (not (busy))) (at end (increase (level) (* 2 ?duration)))))
         (:durative-action heat :parameters () :duration (and (>= ?duration 1) (<= ?duration 5))
          :condition (over all (day)) :effect (and (at start (warm)) (at end (not (warm)))))
         (:durative-action wait :parameters () :duration () :effect ())
         (:durative-action light :parameters () :duration (= ?duration 2) :effect (and (at end (lit))))
         (:action prepare :parameters () :precondition (not (warm)) :effect (warm)))",
        "(define (problem p) (:domain d)
         (:init (idle) (day) (at 20 (not (day))) (= (level) 0) (= (rate) 3)) (:goal (done))
         (:metric minimize (+ (* 3 (total-time)) (level))))",
    )
}

#[test]
fn sequential_plans_of_a_temporal_task_are_judged() {
    check(
        &temporal(),
        &[
            ("(prepare)\n(work)", "valid time=10/3 metric=50/3 (level)=20/3"),
            ("0.000: (prepare)\n0.001: (work) [3.333]", "valid time=10/3 metric=50/3 (level)=20/3"),
            ("0.0: (PREPARE) [0]\n0.001: (WORK)[3.333])", "valid time=10/3 metric=50/3 (level)=20/3"),
            // Steps are ordered by time, not by line.
            ("1: (work) [3.333]\n0: (prepare) [0.001]", "valid time=10/3 metric=50/3 (level)=20/3"),
            (
                "0.0: (PREPARE) ; [\n0.001: (WORK) [D:3.333; C:0.1]",
                "valid time=10/3 metric=50/3 (level)=20/3",
            ),
            ("0: (prepare)\n1: (work) [3.4]", "2 duration"),
            ("0: (prepare)\n0: (wait) [-1]", "2 duration"),
            ("(prepare)\n(wait)", "2 duration"),
            ("(work)", "1 over_all (warm)"),
            // Two steps may be adjacent, with rounded times, but they may not overlap.
            (
                "0: (prepare)\n0: (work) [3.333]\n3.333: (light) [2]",
                "valid time=16/3 metric=68/3 (level)=20/3",
            ),
            ("0: (prepare)\n0: (work) [3.333]\n3.3: (light) [2]", "3 overlap"),
            // Daylight ends at 20.
            ("0: (prepare)\n18: (work) [3.333]", "2 at_end (day)"),
            ("0: (prepare)\n16.666: (work) [3.333]", "valid time=10/3 metric=50/3 (level)=20/3"),
            // The action reads `day` at its end, so the event must not be at the same time.
            ("0: (prepare)\n16.667: (work) [3.333]", "2 interference"),
            ("18: (heat) [3]", "1 over_all (day)"),
            (
                "0: (heat) [5.001]\n6: (prepare)\n6: (work)",
                "valid time=25003/3000 metric=95009/3000 (level)=20/3",
            ),
            ("0: (heat) [5.1]", "1 duration"),
            ("0: (heat)", "1 duration"),
        ],
    );
}

#[test]
fn overlapping_plans_of_a_temporal_task_are_judged() {
    check_concurrent(
        &temporal(),
        &[
            ("0: (prepare)\n0.001: (work) [3.333]", "valid time=1667/500 metric=25003/1500 (level)=20/3"),
            ("0: (heat) [5]\n0.001: (work) [3.333]\n1: (light) [2]", "valid time=5 metric=65/3 (level)=20/3"),
            // The heating ends during the work.
            ("0: (heat) [3]\n0.001: (work) [3.333]", "2 over_all (warm)"),
            // Both actions write `warm`, at one time and less than the separation apart.
            ("0: (prepare)\n0: (heat) [5]\n0.001: (work) [3.333]", "2 interference"),
            ("0: (prepare)\n0.0005: (heat) [5]\n0.001: (work) [3.333]", "2 interference"),
            ("0: (prepare)\n0.001: (work) [3.333]\n3.334: (work) [3.333]", "3 at_start (idle)"),
            (
                "0: (prepare)\n0.001: (work) [3.333]\n3.335: (work) [3.333]",
                "valid time=1667/250 metric=25003/750 (level)=40/3",
            ),
            ("(prepare)", "1 duration"),
            ("0: (prepare)\n17: (work) [3.333]", "2 at_end (day)"),
        ],
    );
}

/// Creates a task with one action that changes `y` to 5 at its start and reaches the goal at its end. `x` is 5, and
/// `(q)` never holds.
fn lasting(duration: &str, condition: &str) -> (ast::Domain, ast::Problem) {
    let domain = format!(
        "(define (domain d) (:predicates (q) (g)) (:functions (x) (y))
         (:durative-action go :parameters () :duration {duration} :condition {condition}
          :effect (and (at start (assign (y) 5)) (at end (g)))))"
    );
    parse(&domain, "(define (problem p) (:domain d) (:init (= (x) 5) (= (y) 0)) (:goal (g)))")
}

/// A condition over all does not apply to the duration 0, but to each positive one.
#[test]
fn tolerances_do_not_allow_the_duration_0() {
    for (duration, plan, expected) in [
        ("(and (> ?duration 0) (<= ?duration 5))", "0: (go) [0]", "1 duration"),
        ("(>= ?duration 0.001)", "0: (go) [0]", "1 duration"),
        ("(at end (>= ?duration 0.001))", "0: (go) [0]", "1 duration"),
        ("(>= ?duration 0.001)", "0: (go) [0.0005]", "1 over_all (q)"),
        ("(= ?duration 0.001)", "0: (go) [0]", "1 over_all (q)"),
        ("(>= ?duration 0)", "0: (go) [0]", "valid time=0 (y)=5"),
    ] {
        let task = lasting(duration, "(over all (q))");
        check(&task, &[(plan, expected)]);
        check_concurrent(&task, &[(plan, expected)]);
    }
    let generous = Options::default().with_tolerance(BigRational::from_integer(1.into()));
    let verdict = run(&lasting("(>= ?duration 1)", "(over all (q))"), "0: (go) [0]", &generous);
    assert_eq!(summary(&verdict), "1 duration");
}

#[test]
fn durations_at_end_are_known_at_the_start_if_they_are_constant() {
    for (duration, plan, expected) in [
        ("(at end (= ?duration 5))", "0: (go)", "valid time=5 (y)=5"),
        ("(at end (= ?duration (x)))", "0: (go)", "valid time=5 (y)=5"),
        ("(at end (= ?duration (x)))", "0: (go) [6]", "1 duration"),
        ("(and (at start (>= ?duration 6)) (at end (= ?duration 5)))", "0: (go)", "1 duration"),
        ("(at end (= ?duration (y)))", "0: (go)", "1 duration"),
        ("(at end (= ?duration (y)))", "0: (go) [5]", "valid time=5 (y)=5"),
    ] {
        let task = lasting(duration, "()");
        check(&task, &[(plan, expected)]);
        check_concurrent(&task, &[(plan, expected)]);
    }
    let chosen = Options::default().with_chosen_durations(true);
    let verdict = run(&lasting("(at end (>= ?duration 1))", "()"), "(go)", &chosen);
    assert_eq!(summary(&verdict), "valid time=1 (y)=5");
}

#[test]
fn derived_predicates_are_recomputed_in_each_state() {
    let task = parse(
        "(define (domain d) (:requirements :typing) (:types node)
         (:predicates (edge ?x ?y - node) (path ?x ?y - node) (lonely ?x - node) (on ?x - node))
         (:derived (path ?x ?y - node) (or (edge ?x ?y) (exists (?z - node) (and (path ?x ?z) (path ?z ?y)))))
         (:derived (lonely ?x - node) (not (exists (?y - node) (path ?x ?y))))
         (:action cut :parameters (?x ?y - node) :precondition (path ?x ?y) :effect (not (edge ?x ?y)))
         (:action join :parameters (?x ?y - node) :precondition (lonely ?x) :effect (edge ?x ?y)))",
        "(define (problem p) (:domain d) (:objects a b c - node) (:init (edge a b) (edge b c)) (:goal (path c b)))",
    );
    check(
        &task,
        &[
            ("(join c a)", "valid time=0"),
            ("(cut b c)\n(join c b)", "valid time=0"),
            ("(join a c)", "1 at_start (lonely a)"),
            ("(cut a b)\n(cut a c)", "2 at_start (path a c)"),
            ("(cut b c)\n(join b a)\n(join c c)", "- goal (path c b)"),
        ],
    );
}

#[test]
fn an_object_without_a_type_fits_either_of_object_and_a_type() {
    let task = parse(
        "(define (domain d) (:requirements :typing) (:types robot) (:predicates (g ?x))
         (:action a :parameters (?x - (either object robot)) :effect (g ?x)))",
        "(define (problem p) (:domain d) (:objects b - object r - robot) (:init)
         (:goal (forall (?x - (either robot object)) (g ?x))))",
    );
    check(&task, &[("(a b)\n(a r)", "valid time=0")]);
}

#[test]
fn an_empty_preference_is_never_violated() {
    let task = parse(
        "(define (domain d) (:predicates (g)) (:durative-action a :parameters () :duration (= ?duration 1)
           :condition (preference w (at start (and))) :effect (at end (g))))",
        "(define (problem p) (:domain d) (:init) (:goal (g)) (:metric minimize (is-violated w)))",
    );
    check(&task, &[("0: (a) [1]", "valid time=1 metric=0")]);
}

#[test]
fn the_output_of_popf_is_parsed() {
    let text = "Number of literals: 3\n(not a step)\n;;;; Solution Found\n; States: 3\n; Cost: 1.000\n0.000: (old)  [1.000]\n\
                ;;;; Solution Found\r\n; Cost: 0.5\n0.000: (move Robot a)  [5.000]\r\n5.001: (stop)\n\n * All goal deadlines now no later than 10\n";
    let plan = PlanText::parse(&Source::new("plan", text)).expect("a plan");
    let number = |value: &Option<_>| value.as_ref().map_or("-".to_owned(), BigRational::to_string);
    let steps = plan.steps.iter().map(|step| {
        let (start, duration) = (number(&step.start), number(&step.duration));
        format!("{} {:?} at {start} for {duration}, line {}", step.action, step.arguments, step.line)
    });
    let steps: Vec<_> = steps.collect();
    insta::assert_snapshot!(steps.join("\n"), @r#"
    move ["Robot", "a"] at 0 for 5, line 9
    stop [] at 5001/1000 for -, line 10
    "#);
}

#[test]
fn lines_that_are_not_steps_are_reported() {
    let source =
        Source::new("plan", "go a b\n(go a\n0.5 (go a)\n1: (go a) 5\n1: (go a) [x]\n()\n(go a) ; fine\n");
    let messages = PlanText::parse(&source).expect_err("not a plan");
    let messages: Vec<_> = messages
        .iter()
        .map(|message| format!("{}:{} {}", message.line, message.column, message.message))
        .collect();
    insta::assert_snapshot!(messages.join("\n"), @r"
    1:1 this is not a step of a plan
    2:1 the `)` of this step is missing
    3:1 expected `:` after the time
    4:1 expected a duration such as `[5.000]` after the action
    5:1 `x` is not a number
    6:1 the name of the action is missing
    ");
}

/// A quantified variable may have the name of a parameter. It has no single value then.
#[test]
fn a_shadowed_parameter_has_no_value_in_an_explanation() {
    let task = parse(
        "(define (domain d) (:types place) (:functions (n ?x - place))
         (:action go :parameters (?x - place) :precondition (forall (?x - place) (<= (n ?x) 1)) :effect ()))",
        "(define (problem p) (:domain d) (:objects a b - place) (:init (= (n a) 0) (= (n b) 7)) (:goal (and)))",
    );
    check(&task, &[("(go a)", "1 at_start (forall (?x - place) (<= (n ?x) 1))")]);
}

/// The comparison of simultaneous happenings polls the limits: it takes quadratic time.
#[test]
fn the_comparison_of_simultaneous_happenings_can_be_stopped() {
    let names: Vec<String> = (0..400).map(|number| format!("o{number}")).collect();
    let (domain, problem) = parse(
        "(define (domain d) (:types place) (:predicates (seen ?x - place))
         (:action see :parameters (?x - place) :precondition () :effect (seen ?x)))",
        &format!(
            "(define (problem p) (:domain d) (:objects {} - place) (:init) (:goal (and)))",
            names.join(" ")
        ),
    );
    let plan: Vec<String> = names.iter().map(|name| format!("0: (see {name}) [0]")).collect();
    let plan = PlanText::parse(&Source::new("plan", plan.join("\n"))).expect("the plan can be read");
    let options = Options::default().with_concurrent(true);
    let polls = std::cell::Cell::new(0_u32);
    let stop = || {
        polls.set(polls.get() + 1);
        false
    };
    assert!(validate_within(&domain, &problem, &plan, &options, &stop).expect("no limit").valid);
    // There are 79,800 pairs.
    assert!(polls.get() > 200, "{} polls", polls.get());
}
