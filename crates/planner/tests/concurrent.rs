//! Plans with overlapping actions: tasks with known optima, including tasks without a sequential plan, and
//! random tasks. On the latter, the planner must agree with the validator applied to all plans of up to three
//! actions over a grid of times.

use std::fmt::Write as _;
use std::time::Duration;

use metaplan_planner::{
    GroundConfig, Limits, Plan, Solution, Status, Thresholds, ground_concurrent, optimize_concurrent,
};
use num_bigint::BigInt;
use num_rational::BigRational;
use pddl::ast::{Domain, Problem};
use pddl::validate::{Options, PlanText, validate};
use pddl::{Source, read};
use testing::random::Random;

use crate::tally::with_enough_time;
use crate::widths;

pub fn parse(domain: &str, problem: &str) -> (Domain, Problem) {
    let read = read(&Source::new("domain", domain), &Source::new("problem", problem));
    let (domain, problem, _) = read.unwrap_or_else(|errors| panic!("{errors:?}\n{domain}\n{problem}"));
    (domain, problem)
}

pub fn rational(numerator: i128, denominator: i128) -> BigRational {
    BigRational::new(BigInt::from(numerator), BigInt::from(denominator))
}

pub fn solve(domain: &Domain, problem: &Problem, separation: &BigRational) -> Solution {
    widths::solve(domain, problem, separation, &Limits::none())
}

pub fn written(plan: &Plan) -> String {
    let mut text = String::new();
    for step in &plan.steps {
        let mut words = step.arguments.clone();
        words.insert(0, step.action.clone());
        let _ = writeln!(text, "{}: ({}) [{}]", step.start, words.join(" "), step.duration);
    }
    text
}

/// Returns the metric that the validator computes. The error is the reason why the plan is invalid.
pub fn metric(
    domain: &Domain,
    problem: &Problem,
    text: &str,
    separation: &BigRational,
) -> Result<BigRational, String> {
    let plan =
        PlanText::parse(&Source::new("plan", text)).unwrap_or_else(|errors| panic!("{errors:?}\n{text}"));
    let options = Options::default().with_concurrent(true).with_tolerance(separation.clone());
    let verdict = validate(domain, problem, &plan, &options);
    match verdict.violation {
        None => Ok(verdict.metric.unwrap_or(verdict.total_time)),
        Some(violation) => Err(violation.message),
    }
}

/// Checks the metric and the actions of the best plan. `None` means that the planner must prove that there is
/// no plan.
pub fn check(
    name: &str,
    domain: &str,
    problem: &str,
    separation: (i128, i128),
    expected: Option<(&str, &[&str])>,
) {
    let (domain, problem) = parse(domain, problem);
    let separation = rational(separation.0, separation.1);
    let solution = solve(&domain, &problem, &separation);
    let Some(plan) = &solution.plan else {
        assert_eq!((solution.status, None), (Status::Unsolvable, expected), "{name}");
        return;
    };
    let text = written(plan);
    assert_eq!(solution.status, Status::Optimal, "{name}");
    let value = metric(&domain, &problem, &text, &separation)
        .unwrap_or_else(|message| panic!("{name}: {message}\n{text}"));
    assert_eq!(value, plan.cost.to_rational(), "{name}\n{text}");
    let shown = Some((plan.cost.to_string(), text.lines().map(str::to_owned).collect::<Vec<_>>()));
    let expected =
        expected.map(|(cost, lines)| (cost.to_owned(), lines.iter().map(ToString::to_string).collect()));
    assert_eq!(shown, expected, "{name}");
}

/// Example of Fox and Long: a fuse is mended by the light of a match.
const MATCH: &str = "(define (domain match) (:requirements :durative-actions :typing)
  (:types match fuse) (:predicates (light) (handfree) (unused ?m - match) (mended ?f - fuse))
  (:durative-action light :parameters (?m - match) :duration (= ?duration 5)
    :condition (and (at start (unused ?m)) (over all (light)))
    :effect (and (at start (not (unused ?m))) (at start (light)) (at end (not (light)))))
  (:durative-action mend :parameters (?f - fuse) :duration (= ?duration 2)
    :condition (and (at start (handfree)) (over all (light)))
    :effect (and (at start (not (handfree))) (at end (mended ?f)) (at end (handfree)))))";

#[test]
fn required_concurrency() {
    let problem = |objects: &str, goal: &str| {
        format!(
            "(define (problem p) (:domain match) (:objects {objects}) (:init (handfree) (unused m1))
               (:goal (and {goal})))"
        )
    };
    let one = ["0: (light m1) [5]", "0: (mend f1) [2]"];
    check("one fuse", MATCH, &problem("m1 - match f1 - fuse", "(mended f1)"), (1, 1000), Some(("5", &one)));
    let two = ["0: (light m1) [5]", "0: (mend f1) [2]", "2.001: (mend f2) [2]"];
    let goal = "(mended f1) (mended f2)";
    check("two fuses", MATCH, &problem("m1 - match f1 f2 - fuse", goal), (1, 1000), Some(("5", &two)));
    // The light is on in the open interval from 0 to 5, which is too short for three actions of duration 2.
    let goal = "(mended f1) (mended f2) (mended f3)";
    check("three fuses", MATCH, &problem("m1 - match f1 f2 f3 - fuse", goal), (1, 1000), None);
    // A separation of half a unit leaves enough time for two fuses, a separation of two units does not.
    let goal = "(mended f1) (mended f2)";
    let half = ["0: (light m1) [5]", "0: (mend f1) [2]", "2.5: (mend f2) [2]"];
    check("half", MATCH, &problem("m1 - match f1 f2 - fuse", goal), (1, 2), Some(("5", &half)));
    check("too far apart", MATCH, &problem("m1 - match f1 f2 - fuse", goal), (2, 1), None);
}

/// Figure 3 of Cushing et al. (2007): the end of one action needs a fact that holds only during another
/// action.
const WINDOW: &str = "(define (domain window) (:requirements :durative-actions)
  (:predicates (p) (q) (r) (s))
  (:durative-action a :parameters () :duration (= ?duration 10)
    :condition (and (at end (p))) :effect (and (at start (s)) (at end (q))))
  (:durative-action b :parameters () :duration (= ?duration 3)
    :condition (and (at start (s))) :effect (and (at start (p)) (at end (not (p))) (at end (r)))))";

#[test]
fn actions_start_between_other_happenings() {
    // The end of the long action must lie within the short action, so the short action does not start
    // together with any happening.
    let problem = "(define (problem w) (:domain window) (:init) (:goal (and (q) (r))))";
    let plan = ["0: (a) [10]", "7.001: (b) [3]"];
    check("window", WINDOW, problem, (1, 1000), Some(("10.001", &plan)));
}

#[test]
fn windows_of_timed_initial_literals() {
    let domain = "(define (domain d) (:requirements :durative-actions :timed-initial-literals)
      (:predicates (open) (done) (told))
      (:durative-action work :parameters () :duration (= ?duration 4)
        :condition (and (over all (open))) :effect (and (at end (done))))
      (:durative-action tell :parameters () :duration (= ?duration 6)
        :condition (and (at end (open))) :effect (and (at end (told)))))";
    let problem = |init: &str, goal: &str| {
        format!("(define (problem p) (:domain d) (:init {init}) (:goal (and {goal})))")
    };
    let both = "(done) (told)";
    let window = "(at 3 (open)) (at 8 (not (open)))";
    let plan = ["0: (tell) [6]", "3: (work) [4]"];
    check("both fit", domain, &problem(window, both), (1, 1000), Some(("7", &plan)));
    // An over-all condition refers to the open interval. The window may close when the action ends, but not
    // earlier.
    let closes = |time: &str| problem(&format!("(at 3 (open)) (at {time} (not (open)))"), "(done)");
    check("closes at the end", domain, &closes("7"), (1, 1000), Some(("7", &["3: (work) [4]"])));
    check("closes before the end", domain, &closes("6.999"), (1, 1000), None);
    let late = "(at 2 (open)) (at 5 (not (open))) (at 9 (open))";
    // The end of the action reads a fact that the event at 9 changes.
    let plan = ["3.001: (tell) [6]", "9: (work) [4]"];
    check("the second window", domain, &problem(late, both), (1, 1000), Some(("13", &plan)));
    // A plan ends with its last action; later events do not occur.
    let problem = problem("(open) (at 5 (open)) (at 20 (not (open)))", "(done) (open)");
    check("before it closes", domain, &problem, (1, 1000), Some(("4", &["0: (work) [4]"])));
}

#[test]
fn a_plan_waits_for_timed_literals() {
    let domain = "(define (domain d) (:requirements :durative-actions :timed-initial-literals)
      (:predicates (gate) (done))
      (:durative-action work :parameters () :duration (= ?duration 4) :condition (and) :effect (at end (done))))";
    let problem = "(define (problem p) (:domain d) (:init (at 10 (gate))) (:goal (and (done) (gate))))";
    check("ends with the gate", domain, problem, (1, 1000), Some(("10", &["6: (work) [4]"])));
    let problem =
        "(define (problem p) (:domain d) (:init (gate) (at 3 (not (gate)))) (:goal (and (done) (gate))))";
    check("too late", domain, problem, (1, 1000), None);
}

#[test]
fn conditions_that_happenings_keep_up_together() {
    // Both changes occur simultaneously, so neither can be the first.
    let domain = "(define (domain d) (:requirements :durative-actions :disjunctive-preconditions)
      (:predicates (p) (q) (r) (s) (done) (d1) (d2))
      (:durative-action hold :parameters () :duration (= ?duration 5)
        :condition (and (over all (or (p) (q))) (over all (or (r) (s)))) :effect (and (at end (done))))
      (:durative-action a :parameters () :duration (= ?duration 2)
        :condition (and (over all (d2))) :effect (and (at start (d1)) (at end (not (p))) (at end (r))))
      (:durative-action b :parameters () :duration (= ?duration 2)
        :condition (and (over all (d1))) :effect (and (at start (d2)) (at end (q)) (at end (not (s))))))";
    let problem =
        "(define (problem p) (:domain d) (:init (p) (s)) (:goal (and (done) (r) (q) (not (p)) (not (s)))))";
    let (domain, problem) = parse(domain, problem);
    let separation = rational(1, 1000);
    let plan = solve(&domain, &problem, &separation).plan.expect("a plan");
    assert_eq!(metric(&domain, &problem, &written(&plan), &separation), Ok(rational(5, 1)));
}

#[test]
fn functions_have_one_design_at_a_time() {
    let domain = "(define (domain d) (:requirements :durative-actions :typing)
      (:types function design place) (:predicates (fd_solve_f ?fd - design ?f - function) (seen ?p - place))
      (:functions (total-cost) (price ?fd - design) (needs ?p - place ?fd - design))
      (:durative-action look :parameters (?p - place ?f - function ?fd - design) :duration (= ?duration (needs ?p ?fd))
        :condition (and (over all (fd_solve_f ?fd ?f)))
        :effect (and (at end (seen ?p)) (at end (increase (total-cost) (price ?fd))))))";
    let problem = |functions: &str, solves: &str, metric: &str| {
        format!(
            "(define (problem p) (:domain d) (:objects {functions} - function fast slow - design a b - place)
               (:init (= (total-cost) 0) (= (price fast) 3) (= (price slow) 1) {solves}
                 (= (needs a fast) 2) (= (needs a slow) 6) (= (needs b fast) 5) (= (needs b slow) 3))
               (:goal (and (seen a) (seen b))) (:metric minimize {metric}))"
        )
    };
    let one = "(fd_solve_f fast f) (fd_solve_f slow f)";
    // Either different designs in sequence (2 + 3), or equal designs for both actions (5 or 6).
    let text = problem("f", one, "(total-time)");
    let (parsed, filled) = parse(domain, &text);
    let plan = solve(&parsed, &filled, &rational(1, 1000)).plan.expect("a plan");
    assert_eq!(plan.cost.to_string(), "5", "{}", written(&plan));
    // With one function for each place, each action uses its best design.
    let two = "(fd_solve_f fast f) (fd_solve_f slow g)";
    let plan = ["0: (look a f fast) [2]", "0: (look b g slow) [3]"];
    check("two functions", domain, &problem("f g", two, "(total-time)"), (1, 1000), Some(("3", &plan)));
    let plan = ["0: (look a f slow) [6]", "0: (look b f slow) [3]"];
    let weighted = "(+ (* 0.5 (total-time)) (total-cost))";
    check("weighted", domain, &problem("f", one, weighted), (1, 1000), Some(("5", &plan)));
}

fn literal(random: &mut Random) -> String {
    let atom = ["(p)", "(q)", "(r)"][random.below(3) as usize];
    if random.below(3) == 0 { format!("(not {atom})") } else { atom.to_owned() }
}

fn condition(random: &mut Random) -> String {
    match random.below(8) {
        0 => format!("(or {} {})", literal(random), literal(random)),
        1 => format!("({} (x) {})", [">=", "<="][random.below(2) as usize], random.below(3)),
        _ => literal(random),
    }
}

fn effect(random: &mut Random) -> String {
    match random.below(7) {
        0 => format!("(increase (x) {})", 1 + random.below(2)),
        1 => "(decrease (x) 1)".to_owned(),
        2 if random.below(2) == 0 => format!("(assign (x) {})", random.below(3)),
        _ => literal(random),
    }
}

fn timed(random: &mut Random, times: &[&str], most: u64, part: fn(&mut Random) -> String) -> String {
    let mut text = String::from("(and");
    for _ in 0..=random.below(most) {
        let time = times[random.below(times.len() as u64) as usize];
        let _ = write!(text, " ({time} {})", part(random));
    }
    text + ")"
}

struct Sample {
    durations: [i64; 3],
    domain: String,
    problem: String,
}

/// Generates a random task. If `is_locked`, all actions with a duration use the same resource.
fn sample(random: &mut Random, is_locked: bool) -> Sample {
    let mut domain = String::from(
        "(define (domain d) (:requirements :durative-actions :disjunctive-preconditions) (:predicates (p) (q) (r) (idle))
           (:functions (total-cost) (x))\n",
    );
    let mut durations = [0; 3];
    for (action, duration) in durations.iter_mut().enumerate() {
        let cost = 1 + random.below(3);
        if random.below(5) == 0 {
            let _ = writeln!(
                domain,
                "(:action a{action} :parameters () :precondition (and {} {})
                   :effect (and {} {} (increase (total-cost) {cost})))",
                condition(random),
                condition(random),
                effect(random),
                literal(random)
            );
            continue;
        }
        *duration = random.below(5);
        let times = ["at start", "over all", "at end", "over all"];
        let conditions = timed(random, &times, 3, condition);
        let effects = timed(random, &["at start", "at end"], 3, effect);
        let (taken, released) = if is_locked && *duration > 0 {
            ("(at start (idle))", "(at start (not (idle))) (at end (idle))")
        } else {
            ("", "")
        };
        let _ = writeln!(
            domain,
            "(:durative-action a{action} :parameters () :duration (= ?duration {duration})
               :condition (and {taken} {conditions})
               :effect (and {effects} {released} (at end (increase (total-cost) {cost}))))",
        );
    }
    domain.push(')');
    let mut init = format!("(idle) (= (total-cost) 0) (= (x) {})", random.below(3));
    for atom in ["(p)", "(q)", "(r)"] {
        if random.below(3) == 0 {
            let _ = write!(init, " {atom}");
        }
    }
    if random.below(2) == 0 {
        for _ in 0..=random.below(3) {
            let _ = write!(init, " (at {} {})", random.below(6), literal(random));
        }
    }
    let metric = [
        "(total-cost)",
        "(total-time)",
        "(+ (total-time) (total-cost))",
        "(+ (* 3 (total-time)) (total-cost))",
    ][random.below(4) as usize];
    let problem = format!(
        "(define (problem x) (:domain d) (:init {init}) (:goal (and {} {})) (:metric minimize {metric}))",
        condition(random),
        condition(random)
    );
    Sample { durations, domain, problem }
}

/// Latest start in the brute-force search. With a separation of one unit, all times of a best plan
/// are integers.
const LAST: i128 = 7;

fn brute_force(task: &Sample, domain: &Domain, problem: &Problem) -> Option<BigRational> {
    let separation = rational(1, 1);
    let mut best: Option<BigRational> = None;
    let mut open: Vec<Vec<(i128, usize)>> = vec![Vec::new()];
    while let Some(plan) = open.pop() {
        let mut text = String::new();
        for (start, action) in &plan {
            let _ = writeln!(text, "{start}: (a{action}) [{}]", task.durations[*action]);
        }
        if let Ok(value) = metric(domain, problem, &text, &separation)
            && best.as_ref().is_none_or(|best| value < *best)
        {
            best = Some(value);
        }
        if plan.len() == 3 {
            continue;
        }
        let (from, after) = plan.last().copied().unwrap_or((0, 0));
        for start in from..=LAST {
            for action in 0..3 {
                // Several instances of one action may start at the same time.
                if (start, action) >= (from, after) {
                    let mut longer = plan.clone();
                    longer.push((start, action));
                    open.push(longer);
                }
            }
        }
    }
    best
}

/// Compares the planner with brute force. Returns `false` if the planner proves nothing.
fn agree(seed: u64, is_locked: bool, thresholds: Thresholds, time: Duration) -> bool {
    let task = sample(&mut Random(seed), is_locked);
    let (domain, problem) = parse(&task.domain, &task.problem);
    let expected = brute_force(&task, &domain, &problem);
    let separation = rational(1, 1);
    // Numbers can grow without bound, so the time is limited.
    let limits = Limits::none().with_time(time).with_thresholds(thresholds);
    let config = GroundConfig::default().with_limits(limits.clone());
    let ground = ground_concurrent(&domain, &problem, &config, &separation)
        .unwrap_or_else(|errors| panic!("{errors:?}"));
    let solution = optimize_concurrent(&ground, &limits, &mut |_| {});
    let context = || format!("seed {seed}\n{}\n{}", task.domain, task.problem);
    if !matches!(solution.status, Status::Optimal | Status::Unsolvable) {
        return false;
    }
    let Some(found) = &solution.plan else {
        assert_eq!(expected, None, "{}", context());
        return true;
    };
    let text = written(found);
    let value = metric(&domain, &problem, &text, &separation);
    let claimed = found.cost.to_rational();
    assert_eq!(value, Ok(claimed.clone()), "{}\n{text}", context());
    let within = |step: &metaplan_planner::Step| step.start.to_rational() <= rational(LAST, 1);
    if found.steps.len() <= 3 && found.steps.iter().all(within) {
        assert_eq!(Some(&claimed), expected.as_ref(), "{}\n{text}", context());
    } else {
        assert!(expected.is_none_or(|expected| claimed <= expected), "{}\n{text}", context());
    }
    true
}

fn are_decided(decided: impl Iterator<Item = bool>) -> Result<(), String> {
    let decided: Vec<bool> = decided.collect();
    let (count, undecided) = (decided.len(), decided.iter().filter(|is_decided| !**is_decided).count());
    if undecided * 20 <= count { Ok(()) } else { Err(format!("{undecided} of {count} undecided")) }
}

fn all_agree(seeds: std::ops::Range<u64>) {
    with_enough_time(Duration::from_secs(2), |time| {
        are_decided(seeds.clone().map(|seed| agree(seed, false, Thresholds::default(), time)))
    });
}

#[test]
fn plans_are_as_good_as_the_validator_admits() {
    all_agree(0..70);
}

/// Every search takes part from the first node on. In half of the tasks, all actions with a duration use one
/// resource, so that the lower bound from the work of a resource is at its highest.
fn all_searches_agree(seeds: std::ops::Range<u64>) {
    with_enough_time(Duration::from_secs(2), |time| {
        let agree = |seed| [false, true].map(|is_locked| agree(seed, is_locked, Thresholds::NONE, time));
        are_decided(seeds.clone().flat_map(agree))
    });
}

#[test]
fn no_search_claims_more_than_the_validator_admits() {
    all_searches_agree(0..60);
}

#[test]
#[ignore = "half an hour"]
fn no_search_claims_more_than_the_validator_admits_on_many() {
    all_searches_agree(1_000..3_000);
}

#[test]
#[ignore = "half an hour"]
fn plans_are_as_good_as_the_validator_admits_on_many() {
    let from = std::env::var("FROM").ok().and_then(|text| text.parse().ok()).unwrap_or(1_000);
    all_agree(from..from + 3_000);
}

const ROBOTS: &str = "(define (domain robots) (:requirements :durative-actions :typing)
  (:types robot place) (:functions (way ?a ?b - place) (battery ?r - robot))
  (:predicates (robot_at ?r - robot ?p - place) (seen ?p - place) (wanted ?p - place))
  (:durative-action move :parameters (?r - robot ?a ?b - place) :duration (= ?duration (way ?a ?b))
    :condition (and (at start (robot_at ?r ?a)) (at start (>= (battery ?r) (way ?a ?b))))
    :effect (and (at start (not (robot_at ?r ?a))) (at end (robot_at ?r ?b))
      (at start (decrease (battery ?r) (way ?a ?b)))))
  (:durative-action look :parameters (?r - robot ?p - place) :duration (= ?duration 5)
    :condition (and (at start (robot_at ?r ?p)) (over all (robot_at ?r ?p)) (at start (wanted ?p)))
    :effect (and (at end (seen ?p)))))";

/// Robots on a grid of `side` × `side` places. Each robot must reach a place, and `looks` places
/// must be seen.
fn robots(count: u64, side: u64, looks: u64, seed: u64) -> String {
    let mut random = Random(seed);
    let places = side * side;
    let mut text = String::from("(define (problem p) (:domain robots) (:objects");
    (0..places).for_each(|place| _ = write!(text, " p{place}"));
    text.push_str(" - place");
    (0..count).for_each(|robot| _ = write!(text, " r{robot}"));
    text.push_str(" - robot) (:init");
    for place in 0..places {
        let right = (place % side + 1 < side).then_some(place + 1);
        for other in right.into_iter().chain((place + side < places).then_some(place + side)) {
            let way = 2 + random.below(8);
            let _ = write!(text, " (= (way p{place} p{other}) {way}) (= (way p{other} p{place}) {way})");
        }
    }
    let mut goal = String::new();
    for robot in 0..count {
        let battery = 20 * side;
        let _ =
            write!(text, " (robot_at r{robot} p{}) (= (battery r{robot}) {battery})", random.below(places));
        let _ = write!(goal, " (robot_at r{robot} p{})", random.below(places));
    }
    for _ in 0..looks {
        let place = random.below(places);
        let _ = write!(text, " (wanted p{place})");
        let _ = write!(goal, " (seen p{place})");
    }
    format!("{text}) (:goal (and{goal})) (:metric minimize (total-time)))")
}

#[test]
#[ignore = "a measurement"]
#[allow(clippy::print_stdout)]
fn robots_on_maps() {
    for (count, side, looks) in [
        (1, 5, 2),
        (1, 7, 4),
        (2, 5, 0),
        (2, 7, 0),
        (2, 5, 2),
        (2, 7, 3),
        (3, 5, 0),
        (3, 7, 0),
        (3, 5, 3),
        (4, 5, 0),
        (4, 7, 2),
    ] {
        for seed in 0..2 {
            let (domain, problem) = parse(ROBOTS, &robots(count, side, looks, seed));
            let separation = rational(1, 1000);
            let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation)
                .unwrap_or_else(|errors| panic!("{errors:?}"));
            let start = std::time::Instant::now();
            let limits = Limits::none().with_time(Duration::from_secs(10));
            let solution = optimize_concurrent(&task, &limits, &mut |_| {});
            let shown =
                |exact: Option<metaplan_planner::Exact>| exact.map_or("-".to_owned(), |e| e.to_string());
            println!(
                "{count} robots, {} places, {looks} looks, seed {seed}: {:?} {} >= {} in {:.2?}",
                side * side,
                solution.status,
                shown(solution.plan.as_ref().map(|plan| plan.cost.clone())),
                shown(solution.lower_bound),
                start.elapsed()
            );
            if let Some(plan) = &solution.plan {
                let value = metric(&domain, &problem, &written(plan), &separation);
                assert_eq!(value, Ok(plan.cost.to_rational()));
            }
        }
    }
}
