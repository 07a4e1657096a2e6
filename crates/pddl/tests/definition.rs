//! Tests of the definition of a plan (`validate/definition.md`), with plans on both sides of the boundaries of
//! its rules.

use metaplan_pddl::validate::{Advance, Options, PlanStep, PlanText, advance, advance_defined, validate};
use metaplan_pddl::{Source, read};
use num_bigint::BigInt;
use num_rational::BigRational;

const IN_SEQUENCE: bool = false;
const CONCURRENTLY: bool = true;

/// Task over the atoms `p`, `q`, `r`, `g` and the numbers `x` (2), `y` (0) and `z` (undefined).
struct Task {
    actions: String,
    init: String,
    goal: String,
}

fn durative(name: &str, duration: &str, condition: &str, effect: &str) -> String {
    format!(
        "(:durative-action {name} :parameters () :duration (= ?duration {duration})
           :condition (and {condition}) :effect (and {effect}))\n"
    )
}

fn task(actions: &[String], init: &str, goal: &str) -> Task {
    Task { actions: actions.concat(), init: init.to_owned(), goal: goal.to_owned() }
}

impl Task {
    fn parse(&self) -> (metaplan_pddl::ast::Domain, metaplan_pddl::ast::Problem) {
        let domain = format!(
            "(define (domain d) (:predicates (p) (q) (r) (g) (derived)) (:functions (x) (y) (z))
               (:derived (derived) (or (p) (q)))\n{})",
            self.actions
        );
        let problem = format!(
            "(define (problem n) (:domain d) (:init (= (x) 2) (= (y) 0) {}) (:goal (and {})))",
            self.init, self.goal
        );
        let sources = (Source::new("domain", domain), Source::new("problem", problem));
        let read = read(&sources.0, &sources.1);
        let (domain, problem, _) = read.unwrap_or_else(|errors| panic!("{errors:?}\n{}", self.actions));
        (domain, problem)
    }

    /// Validates a plan. Returns `valid` or the kind of the violation. The tolerance is 0 in sequential
    /// execution; the separation is 0.001 in concurrent execution.
    fn verdict(&self, concurrent: bool, plan: &str) -> String {
        let (domain, problem) = self.parse();
        let plan = PlanText::parse(&Source::new("plan", plan)).expect("the plan can be read");
        let thousandth = BigRational::new(BigInt::from(1), BigInt::from(1000));
        let tolerance = if concurrent { thousandth } else { BigRational::default() };
        let verdict = validate(
            &domain,
            &problem,
            &plan,
            &Options::default().with_concurrent(concurrent).with_tolerance(tolerance),
        );
        verdict.violation.map_or("valid".to_owned(), |violation| violation.kind.as_str().to_owned())
    }

    fn check(&self, mode: bool, cases: &[(&str, &str)]) {
        for (plan, expected) in cases {
            assert_eq!(self.verdict(mode, plan), *expected, "concurrent: {mode}\n{}{plan}", self.actions);
        }
    }

    fn check_both(&self, cases: &[(&str, &str)]) {
        self.check(IN_SEQUENCE, cases);
        self.check(CONCURRENTLY, cases);
    }
}

#[test]
fn a_condition_over_all_holds_in_the_open_interval() {
    let a = durative("a", "2", "(over all (p))", "(at end (g))");
    // An event exactly at the end has no effect on the condition over all; an event before the end or at the
    // start has.
    let ends = task(std::slice::from_ref(&a), "(p) (at 5 (not (p)))", "(g)");
    ends.check_both(&[
        ("3: (a) [2]", "valid"),
        ("3.001: (a) [2]", "over_all"),
        ("5: (a) [2]", "over_all"),
        ("0: (a) [2]", "valid"),
    ]);
    let begins = task(&[a], "(at 5 (p))", "(g)");
    begins.check_both(&[("5: (a) [2]", "valid"), ("4.999: (a) [2]", "over_all")]);
    // The action's effects at start belong to the interval; its effects at end do not.
    let self_supporting =
        durative("a", "2", "(over all (p))", "(at start (p)) (at end (not (p))) (at end (g))");
    task(&[self_supporting], "", "(g)").check_both(&[("0: (a) [2]", "valid")]);
    let broken = durative("a", "2", "(over all (p))", "(at start (not (p))) (at end (g))");
    task(&[broken], "(p)", "(g)").check_both(&[("0: (a) [2]", "over_all")]);
    // `p` becomes true again within the interval, which is too late.
    let gap = durative("a", "2", "(over all (p))", "(at end (g))");
    task(&[gap], "(p) (at 1 (not (p))) (at 1.5 (p))", "(g)").check_both(&[("0: (a) [2]", "over_all")]);
}

#[test]
fn happenings_of_other_actions_can_break_a_condition_over_all() {
    let a = durative("a", "2", "(over all (p))", "(at end (g))");
    let b = durative("b", "1", "", "(at end (not (p)))");
    let breaks = task(&[a.clone(), b], "(p)", "(g)");
    breaks.check(
        CONCURRENTLY,
        &[
            ("0: (a) [2]\n1: (b) [1]", "valid"),
            ("0: (a) [2]\n0.999: (b) [1]", "over_all"),
            // Deleted exactly at the start, `p` is false when the interval begins.
            ("1: (a) [2]\n0: (b) [1]", "over_all"),
        ],
    );
    let c = durative("c", "1", "", "(at end (p))");
    task(&[a, c], "", "(g)").check(
        CONCURRENTLY,
        &[("1: (a) [2]\n0: (c) [1]", "valid"), ("0.999: (a) [2]\n0: (c) [1]", "over_all")],
    );
}

#[test]
fn an_event_must_not_interfere_with_a_simultaneous_happening() {
    // An event adds what the start reads.
    let a = durative("a", "2", "(at start (p))", "(at end (g))");
    let reads = task(&[a], "(at 5 (p))", "(g)");
    reads.check(IN_SEQUENCE, &[("5: (a) [2]", "at_start"), ("5.000001: (a) [2]", "valid")]);
    reads.check(CONCURRENTLY, &[("5.0009: (a) [2]", "interference"), ("5.001: (a) [2]", "valid")]);
    // The event adds an atom that already holds, and still interferes with the read.
    let a = durative("a", "2", "(at start (p))", "(at end (g))");
    task(&[a], "(p) (at 5 (p))", "(g)")
        .check_both(&[("5: (a) [2]", "interference"), ("4.999: (a) [2]", "valid")]);
    // An event deletes what the end reads.
    let a = durative("a", "2", "(at end (p))", "(at end (g))");
    let reads = task(&[a], "(p) (at 5 (not (p)))", "(g)");
    reads.check(
        IN_SEQUENCE,
        &[("2.999999: (a) [2]", "valid"), ("3: (a) [2]", "interference"), ("3.000001: (a) [2]", "at_end")],
    );
    reads.check(CONCURRENTLY, &[("2.999: (a) [2]", "valid"), ("2.9991: (a) [2]", "interference")]);
    // The effect adds the atom that the event deletes, or vice versa; both add it; both delete it.
    for (effect, event, expected) in [
        ("(at end (p))", "(not (p))", "interference"),
        ("(at end (not (p)))", "(p)", "interference"),
        ("(at end (p))", "(p)", "valid"),
        ("(at end (not (p)))", "(not (p))", "valid"),
        ("(at end (q))", "(p)", "valid"),
    ] {
        let a = durative("a", "2", "", &format!("{effect} (at end (g))"));
        task(&[a], &format!("(at 5 {event})"), "(g)").check_both(&[("3: (a) [2]", expected)]);
    }
    // Two instantaneous actions at the time of an event that the second one reads.
    let actions = "(:action a :parameters () :effect (q)) (:action b :parameters () :precondition (not (p)) :effect (g))";
    let two = task(&[actions.to_owned()], "(at 5 (not (p)))", "(g)");
    two.check(IN_SEQUENCE, &[("5: (a)\n5: (b)", "interference"), ("5: (a)\n5.1: (b)", "valid")]);
    two.check(IN_SEQUENCE, &[("4: (a)\n4.9: (b)", "valid"), ("5: (a)", "goal")]);
}

#[test]
fn conditions_and_effects_read_atoms_even_without_influence() {
    let event = "(at 5 (p))";
    for (effect, expected) in [
        // Conditions of active and inactive effects, also through derived predicates.
        ("(at end (when (p) (r)))", "interference"),
        ("(at end (when (and (q) (p)) (r)))", "interference"),
        ("(at end (when (derived) (r)))", "interference"),
        ("(at end (when (q) (r)))", "valid"),
        ("(at end (when (q) (not (p))))", "valid"),
        ("(at end (when (not (q)) (not (p))))", "interference"),
    ] {
        let a = durative("a", "2", "", &format!("{effect} (at end (g))"));
        task(&[a], event, "(g)").check_both(&[("3: (a) [2]", expected)]);
    }
    for (condition, expected) in [
        // The event does not change the truth of the disjunction.
        ("(at end (or (p) (g)))", "interference"),
        ("(at end (or (q) (g)))", "valid"),
        ("(at end (derived))", "interference"),
        ("(over all (or (p) (g)))", "valid"),
    ] {
        let a = durative("a", "2", condition, "(at end (r))");
        task(&[a], &format!("(g) (q) {event}"), "(r)").check_both(&[("3: (a) [2]", expected)]);
    }
}

#[test]
fn changes_of_one_number_interfere_unless_they_commute() {
    let pair = |left: &str, right: &str| {
        let actions = [
            durative("a", "2", "", &format!("(at end {left})")),
            durative("b", "2", "", &format!("(at end {right})")),
        ];
        let task = task(&actions, "(q)", "");
        let separated = task.verdict(CONCURRENTLY, "0: (a) [2]\n0.001: (b) [2]");
        assert_eq!(separated, "valid", "{left} {right}");
        task.verdict(CONCURRENTLY, "0: (a) [2]\n0: (b) [2]")
    };
    for (left, right, expected) in [
        ("(increase (x) 1)", "(decrease (x) 1)", "valid"),
        ("(scale-up (x) 2)", "(scale-down (x) 2)", "valid"),
        ("(increase (x) 1)", "(scale-up (x) 2)", "interference"),
        ("(assign (x) 1)", "(assign (x) 1)", "interference"),
        ("(assign (x) 1)", "(increase (x) 1)", "interference"),
        ("(increase (x) 1)", "(increase (y) (x))", "interference"),
        ("(increase (x) 1)", "(when (p) (increase (y) (x)))", "interference"),
        ("(increase (x) 1)", "(increase (y) 1)", "valid"),
        ("(when (p) (increase (x) 1))", "(increase (y) (x))", "valid"),
        ("(p)", "(not (p))", "interference"),
        ("(p)", "(p)", "valid"),
    ] {
        assert_eq!(pair(left, right), expected, "{left} {right}");
        assert_eq!(pair(right, left), expected, "{right} {left}");
    }
}

#[test]
fn an_action_of_duration_zero_is_one_happening() {
    for (condition, effect, expected) in [
        // All conditions are evaluated in the preceding state, so effects at start do not enable conditions
        // at end.
        ("(at end (q))", "(at start (p)) (at end (g))", "at_end"),
        ("(at end (p))", "(at start (p)) (at end (g))", "at_end"),
        ("(at end (r))", "(at start (p)) (at end (g))", "valid"),
        // The end reads an atom that the start writes, or vice versa, although the atom held before.
        ("(at end (r))", "(at start (r)) (at end (g))", "interference"),
        ("(at start (r))", "(at end (not (r))) (at end (g))", "interference"),
        // The start adds the atom that the end deletes, or vice versa; both add it; both delete it.
        ("", "(at start (p)) (at end (not (p))) (at end (g))", "interference"),
        ("", "(at start (not (p))) (at end (p)) (at end (g))", "interference"),
        ("", "(at start (p)) (at end (p)) (at end (g))", "valid"),
        ("", "(at start (not (r))) (at end (not (r))) (at end (g))", "valid"),
        // Changes of numbers.
        ("", "(at start (increase (x) 1)) (at end (increase (x) 1)) (at end (g))", "valid"),
        ("", "(at start (assign (x) 1)) (at end (assign (x) 1)) (at end (g))", "interference"),
        ("", "(at start (increase (x) 1)) (at end (increase (y) (x))) (at end (g))", "interference"),
        // Conditions over all are not checked.
        ("(over all (p))", "(at end (g))", "valid"),
        ("(over all (p))", "(at start (p)) (at end (not (p))) (at end (g))", "interference"),
    ] {
        let a = durative("a", "0", condition, effect);
        task(&[a], "(r)", "(g)").check_both(&[("0: (a) [0]", expected)]);
    }
    let sums = durative("a", "0", "", "(at start (increase (x) 1)) (at end (increase (x) 3))");
    task(&[sums], "", "(= (x) 6)").check_both(&[("0: (a) [0]", "valid")]);
    // With a positive duration, start and end are two happenings.
    let a = durative("a", "0.001", "(at end (p))", "(at start (p)) (at end (not (p))) (at end (g))");
    task(&[a], "", "(g)").check_both(&[("0: (a) [0.001]", "valid")]);
}

#[test]
fn conflicting_effects_of_one_happening_are_reported() {
    for (effect, expected) in [
        ("(at end (not (g))) (at end (g))", "valid"),
        ("(at end (g)) (at end (assign (x) 1)) (at end (assign (x) 1))", "valid"),
        ("(at end (g)) (at end (assign (x) 1)) (at end (assign (x) 2))", "conflict"),
        ("(at end (g)) (at end (assign (x) 1)) (at end (increase (x) 2))", "conflict"),
        ("(at end (g)) (at end (scale-up (x) 1)) (at end (increase (x) 2))", "conflict"),
        ("(at end (g)) (at end (increase (x) 1)) (at end (decrease (x) 1))", "valid"),
        // An effect whose condition does not hold is ignored.
        ("(at end (g)) (at end (assign (x) 1)) (at end (when (p) (assign (x) 2)))", "valid"),
        ("(at end (g)) (at end (assign (x) 1)) (at end (when (not (p)) (assign (x) 2)))", "conflict"),
        ("(at end (g)) (at end (when (p) (increase (x) (z))))", "valid"),
        ("(at end (g)) (at end (when (not (p)) (increase (x) (z))))", "undefined"),
        ("(at end (g)) (at end (increase (z) 1))", "undefined"),
        ("(at end (g)) (at end (assign (z) 1))", "valid"),
        ("(at end (g)) (at end (assign (x) (/ 1 (y))))", "undefined"),
    ] {
        let a = durative("a", "2", "", effect);
        task(&[a], "", "(g)").check_both(&[("0: (a) [2]", expected)]);
        // The same effects at the start.
        let a = durative("a", "2", "", &effect.replace("at end", "at start"));
        task(&[a], "", "(g)").check_both(&[("0: (a) [2]", expected)]);
    }
}

#[test]
fn the_goal_holds_when_the_last_action_ends() {
    let a = durative("a", "2", "", "(at end (g))");
    // An event at the end of the plan counts; a later event does not, and a plan cannot wait for it.
    let adds = task(std::slice::from_ref(&a), "(at 5 (p))", "(g) (p)");
    adds.check_both(&[
        ("3: (a) [2]", "valid"),
        ("2.999: (a) [2]", "goal"),
        ("4: (a) [2]", "valid"),
        ("", "goal"),
    ]);
    let deletes = task(std::slice::from_ref(&a), "(p) (at 5 (not (p)))", "(g) (p)");
    deletes.check_both(&[("3: (a) [2]", "goal"), ("2.999: (a) [2]", "valid")]);
    task(std::slice::from_ref(&a), "(at 5 (p))", "(p)").check_both(&[("", "goal"), ("3: (a) [2]", "valid")]);
    // A plan without actions ends at 0.
    task(std::slice::from_ref(&a), "(at 0 (p))", "(p)").check_both(&[("", "valid"), ("0: (a) [2]", "valid")]);
    task(std::slice::from_ref(&a), "(p) (at 0 (not (p)))", "(p)").check_both(&[("", "goal")]);
    task(&[a], "(at 0.001 (p))", "(p)").check_both(&[("", "goal")]);
    // The condition over all becomes false exactly at the end, as the goal requires.
    let guarded = durative("a", "2", "(over all (p))", "(at end (g))");
    task(&[guarded], "(p) (at 2 (not (p)))", "(g) (not (p))")
        .check_both(&[("0: (a) [2]", "valid"), ("0.001: (a) [2]", "over_all")]);
}

#[test]
fn in_sequence_an_end_and_a_start_may_coincide() {
    let a = durative("a", "2", "", "(at end (p))");
    let b = durative("b", "2", "(at start (p))", "(at start (not (p))) (at end (g))");
    let task_of_both = task(&[a, b], "", "(g)");
    task_of_both.check(
        IN_SEQUENCE,
        &[("0: (a) [2]\n2: (b) [2]", "valid"), ("0: (a) [2]\n1.999: (b) [2]", "overlap")],
    );
    task_of_both.check(
        CONCURRENTLY,
        &[("0: (a) [2]\n2: (b) [2]", "at_start"), ("0: (a) [2]\n2.001: (b) [2]", "valid")],
    );
}

#[test]
fn an_instance_may_overlap_with_itself() {
    let a = durative("a", "2", "", "(at end (increase (x) 1)) (at end (g))");
    let free = task(std::slice::from_ref(&a), "", "(g) (= (x) 4)");
    free.check(
        CONCURRENTLY,
        &[
            ("0: (a) [2]\n2: (a) [2]", "valid"),
            ("0: (a) [2]\n1.999: (a) [2]", "valid"),
            // A plan may contain one action several times at one time, and each occurrence has its effects.
            ("0: (a) [2]\n0: (a) [2]", "valid"),
            ("0: (a) [2]", "goal"),
            ("0: (a) [2]\n0: (a) [2]\n0: (a) [2]", "goal"),
        ],
    );
    free.check(IN_SEQUENCE, &[("0: (a) [2]\n1.999: (a) [2]", "overlap")]);
    // Each occurrence has its own start, end and conditions over all.
    let a = durative("a", "2", "(at start (p)) (over all (q))", "(at start (not (p))) (at end (g))");
    let b = durative("b", "1", "", "(at start (p)) (at end (not (q)))");
    task(&[a, b], "(p) (q)", "(g)").check(
        CONCURRENTLY,
        &[("0: (a) [2]\n0.5: (a) [2]", "at_start"), ("0: (a) [2]\n1: (b) [1]\n1.001: (a) [2]", "over_all")],
    );
    // The ends of two occurrences that assign the same number must be separated, like any interfering
    // happenings.
    for effect in ["(assign (x) 1)", "(assign (x) (+ (x) 1))"] {
        let a = durative("a", "2", "", &format!("(at end {effect})"));
        task(&[a], "", "").check(
            CONCURRENTLY,
            &[
                ("0: (a) [2]\n0: (a) [2]", "interference"),
                ("0: (a) [2]\n0.0009: (a) [2]", "interference"),
                ("0: (a) [2]\n0.001: (a) [2]", "valid"),
            ],
        );
    }
    // Two additions or two deletions of one atom do not interfere; an addition and a deletion do.
    let a = durative("a", "2", "", "(at start (p)) (at end (not (p)))");
    task(&[a], "", "(not (p))").check(
        CONCURRENTLY,
        &[
            ("0: (a) [2]\n0: (a) [2]", "valid"),
            ("0: (a) [2]\n1.9995: (a) [2]", "interference"),
            ("0: (a) [2]\n1.999: (a) [2]", "valid"),
        ],
    );
    // The second occurrence starts when the first one ends, and the two interfere.
    let a = durative("a", "2", "(at start (not (p)))", "(at start (p)) (at end (not (p)))");
    task(&[a], "", "").check(
        CONCURRENTLY,
        &[
            ("0: (a) [2]\n2: (a) [2]", "at_start"),
            ("0: (a) [2]\n2.0009: (a) [2]", "interference"),
            ("0: (a) [2]\n2.001: (a) [2]", "valid"),
        ],
    );
}

#[test]
fn the_tolerance_delays_steps_and_limits_rounding_of_durations() {
    let a = durative("a", "5", "", "(at end (q))");
    let b = durative("b", "1", "(at start (p)) (at start (q))", "(at end (g))");
    let (domain, problem) = task(&[a, b], "(p) (at 5 (not (p)))", "(g)").parse();
    let verdict = |options: &Options, text: &str| {
        let plan = PlanText::parse(&Source::new("plan", text)).expect("the plan can be read");
        validate(&domain, &problem, &plan, options).violation.map(|violation| violation.kind.as_str())
    };
    // A step that starts too early within the tolerance is delayed to the end of the preceding step. The
    // event has then already taken place.
    assert_eq!(verdict(&Options::default(), "0: (a) [5]\n4.9995: (b) [1]"), Some("at_start"));
    // A large separation does not enlarge the tolerance of durations.
    let separation = BigRational::from_integer(BigInt::from(1));
    let wide = Options::default().with_concurrent(true).with_tolerance(separation);
    assert_eq!(verdict(&wide, "0: (a) [4.5]"), Some("duration"));
    assert_eq!(verdict(&wide, "0: (a) [4.9995]"), Some("goal"));
}

#[test]
fn a_fixed_duration_must_satisfy_the_other_constraints() {
    let action = |constraints: &str| {
        format!(
            "(:durative-action a :parameters () :duration (and {constraints})
               :condition (and) :effect (at end (g)))\n"
        )
    };
    for (constraints, expected) in [
        ("(= ?duration 5) (<= ?duration 3)", "duration"),
        ("(= ?duration 5) (= ?duration 4)", "duration"),
        ("(= ?duration 5) (<= ?duration 6)", "valid"),
    ] {
        let both = task(&[action(constraints)], "", "(g)");
        both.check(IN_SEQUENCE, &[("(a)", expected), ("0: (a) [5]", expected)]);
    }
}

fn changed_facts(advance: &Advance) -> String {
    let names = |atoms: &[metaplan_pddl::ast::Atom]| {
        atoms.iter().map(|atom| atom.predicate.name.to_string()).collect::<Vec<_>>().join(" ")
    };
    format!("+{} -{}", names(&advance.added), names(&advance.deleted))
}

#[test]
fn a_single_step_has_the_same_effects_as_in_a_plan() {
    let single = |duration: &str, condition: &str, effect: &str, forced: bool| {
        let (domain, problem) = task(&[durative("a", duration, condition, effect)], "(r)", "").parse();
        let plan = PlanText::parse(&Source::new("plan", "(a)")).expect("the plan can be read");
        let step: &PlanStep = &plan.steps[0];
        match advance(&domain, &problem, step, forced) {
            Ok(after) => changed_facts(&after),
            Err(violation) => violation.kind.as_str().to_owned(),
        }
    };
    for (duration, condition, effect, forced, expected) in [
        ("2", "(over all (p))", "(at end (g))", false, "over_all"),
        ("0", "(over all (p))", "(at end (g))", false, "+g -"),
        ("2", "(at end (p))", "(at start (p)) (at end (g))", false, "+g p -"),
        ("0", "(at end (p))", "(at start (p)) (at end (g))", false, "at_end"),
        ("0", "", "(at start (p)) (at end (not (p))) (at end (g))", false, "interference"),
        ("0", "", "(at start (p)) (at end (not (p))) (at end (g))", true, "+g -"),
        ("0", "", "(at start (p)) (at end (not (r)))", false, "+p -r"),
    ] {
        assert_eq!(single(duration, condition, effect, forced), expected, "{duration} {condition} {effect}");
    }
}

#[test]
fn a_forced_step_is_an_instance_of_the_first_schema_that_can_start() {
    let take = |place: &str, effect: &str| {
        format!(
            "(:action take :parameters () :precondition ({place}) :effect (and (not ({place})) {effect}))\n"
        )
    };
    let actions = [take("p", "(r)"), take("q", "(g) (increase (y) 5)")];
    let plan = PlanText::parse(&Source::new("plan", "(take)")).expect("the plan can be read");
    // If no schema can start, the first one counts.
    for (init, expected, count) in [("(p)", "+r -p", 0), ("(q)", "+g -q", 1), ("", "+r -", 0)] {
        let (domain, problem) = task(&actions, init, "").parse();
        let after = advance(&domain, &problem, &plan.steps[0], true).expect("a schema fits");
        assert_eq!((changed_facts(&after).as_str(), after.values.len()), (expected, count), "{init}");
    }
}

#[test]
fn effects_that_cannot_be_evaluated_are_left_out() {
    // The divisor `y` is 0, and `z` has no value.
    let effect =
        "(at start (not (r))) (at end (g)) (at end (increase (x) ?duration)) (at end (increase (z) 1))
        (at end (assign (y) (/ 1 (y)))) (when (at end (> (/ 1 (y)) 1)) (at end (p)))";
    let (domain, problem) = task(&[durative("a", "(/ 6 (y))", "", effect)], "(r)", "").parse();
    let plan = PlanText::parse(&Source::new("plan", "(a)")).expect("the plan can be read");
    let violation = advance(&domain, &problem, &plan.steps[0], true).expect_err("no duration");
    assert_eq!(violation.kind.as_str(), "undefined");
    let number = |value: i32| BigRational::from_integer(BigInt::from(value));
    let after = advance_defined(&domain, &problem, &plan.steps[0], &number(3)).expect("an action");
    assert_eq!(changed_facts(&after), "+g -r");
    let values: Vec<_> = after.values.iter().map(|change| (change.text.as_str(), &change.after)).collect();
    assert_eq!(values, [("(x)", &number(5))]);
}

#[test]
fn the_best_reading_of_an_ambiguous_plan_counts() {
    let domain = "(define (domain d) (:predicates (p) (g)) (:functions (total-cost))
      (:action go :parameters () :effect (and (g) (increase (total-cost) 10)))
      (:action go :parameters () :precondition (p) :effect (and (g) (increase (total-cost) 1)))
      (:action go :parameters () :effect (and (not (g)))))";
    let metric = |init: &str, plan: &str| {
        let problem = format!(
            "(define (problem n) (:domain d) (:init {init} (= (total-cost) 0)) (:goal (g)) (:metric minimize (total-cost)))"
        );
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("a task");
        let plan = PlanText::parse(&Source::new("plan", plan)).expect("the plan can be read");
        validate(&domain, &problem, &plan, &Options::default()).metric.map(|value| value.to_string())
    };
    assert_eq!(metric("(p)", "(go)"), Some("1".to_owned()));
    assert_eq!(metric("", "(go)"), Some("10".to_owned()));
    // The first step may be an instance of the schema that deletes the goal.
    assert_eq!(metric("(p)", "(go)\n(go)"), Some("1".to_owned()));
    assert_eq!(metric("", ""), None);
}
