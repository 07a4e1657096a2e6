//! Plans with timed initial literals: tasks with known optima, and random tasks. On the latter, the planner
//! must agree with the validator applied to all sequences of up to three actions.

use std::fmt::Write as _;

use metaplan_planner::{Config, Engine, GroundConfig, Limits, Plan, Status, ground, optimize};
use num_rational::BigRational;
use pddl::Source;
use pddl::ast::{Domain, Problem};
use pddl::validate::{Options, PlanText, validate};
use testing::random::Random;

use crate::concurrent::{parse, written};

/// Returns the best plan, if there is one. With `Engine::Sat`, only the SAT solver is used, up to horizon
/// 8.
fn plan(domain: &Domain, problem: &Problem, engine: Engine) -> Option<Plan> {
    let task =
        ground(domain, problem, &GroundConfig::default()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let limits = Limits::none();
    let horizon = (engine == Engine::Sat).then_some(8);
    let solution = optimize(
        &task,
        &Config::default().with_horizon(horizon).with_engine(engine).with_limits(limits),
        &mut |_| {},
    );
    match solution.status {
        Status::Optimal | Status::Feasible => solution.plan,
        _ => None,
    }
}

fn metric(domain: &Domain, problem: &Problem, text: &str) -> Option<String> {
    let plan =
        PlanText::parse(&Source::new("plan", text)).unwrap_or_else(|errors| panic!("{errors:?}\n{text}"));
    let verdict = validate(domain, problem, &plan, &Options::default());
    let value = verdict.metric.unwrap_or(verdict.total_time);
    verdict.valid.then(|| value.to_string())
}

fn check(name: &str, domain: &str, problem: &str, expected: Option<(&str, &[&str])>) {
    let (domain, problem) = parse(domain, problem);
    let found = plan(&domain, &problem, Engine::Auto);
    let starts = |plan: &Plan| plan.steps.iter().map(|step| step.start.to_string()).collect::<Vec<_>>();
    let shown = found.as_ref().map(|plan| (plan.cost.to_string(), starts(plan)));
    let expected =
        expected.map(|(cost, starts)| (cost.to_owned(), starts.iter().map(ToString::to_string).collect()));
    assert_eq!(shown, expected, "{name}");
    if let Some(plan) = found {
        let text = written(&plan);
        assert_eq!(metric(&domain, &problem, &text), Some(plan.cost.to_string()), "{name}: {text}");
    }
}

const INSPECTION: &str = "(define (domain inspection)
  (:requirements :durative-actions :timed-initial-literals :fluents)
  (:predicates (daylight) (at-pipe) (inspected) (recorded))
  (:functions (level))
  (:durative-action dive :parameters () :duration (= ?duration 4) :condition (and)
    :effect (and (at end (at-pipe)) (at start (decrease (level) 3))))
  (:durative-action inspect :parameters () :duration (= ?duration 3)
    :condition (and (at start (at-pipe)) (over all (daylight)))
    :effect (at end (inspected)))
  (:durative-action record :parameters () :duration (= ?duration 2)
    :condition (and (at start (at-pipe)) (at end (daylight))) :effect (at end (recorded))))";

#[test]
fn actions_wait_for_timed_literals() {
    let problem = |init: &str, goal: &str| {
        format!(
            "(define (problem p) (:domain inspection) (:init (= (level) 10) {init}) (:goal {goal})
             (:metric minimize (total-time)))"
        )
    };
    let case = |name: &str, init: &str, goal: &str, expected: Option<(&str, &[&str])>| {
        check(name, INSPECTION, &problem(init, goal), expected);
    };
    case("day all along", "(daylight)", "(inspected)", Some(("7", &["0", "4"])));
    case("the night ends", "(at 10 (daylight))", "(inspected)", Some(("7", &["0", "10"])));
    case(
        "the day ends as it ends",
        "(daylight) (at 7 (not (daylight)))",
        "(inspected)",
        Some(("7", &["0", "4"])),
    );
    case("too short a day", "(daylight) (at 6.5 (not (daylight)))", "(inspected)", None);
    case(
        "a night in between",
        "(daylight) (at 6 (not (daylight))) (at 12.5 (daylight))",
        "(inspected)",
        Some(("7", &["0", "12.5"])),
    );
    case("only its end needs light", "(at 5.5 (daylight))", "(recorded)", Some(("6", &["0", "4"])));
    case(
        "light at the end, but not after it",
        "(at 6 (daylight))",
        "(recorded)",
        Some(("6", &["0", "4.001"])),
    );
    case("a plan ends with an action", "(at 6 (daylight))", "(daylight)", Some(("4", &["2"])));
    case("a day that is there", "(daylight) (at 6 (not (daylight)))", "(daylight)", Some(("0", &[])));
    case(
        "two windows",
        "(at 5 (daylight)) (at 8 (not (daylight))) (at 20 (daylight))",
        "(and (inspected) (recorded))",
        Some(("9", &["0", "5", "18.001"])),
    );
}

#[test]
fn an_action_keeps_its_start_if_an_earlier_one_costs_more() {
    // The rate is 1 at night and 10 before. Operator costs do not include it, because it is read from the state.
    let domain =
        "(define (domain rental) (:requirements :timed-initial-literals :fluents :conditional-effects)
      (:predicates (night) (ready) (done)) (:functions (rate) (bill))
      (:action prepare :parameters () :precondition (and)
        :effect (and (ready) (when (night) (assign (rate) 1)) (when (not (night)) (assign (rate) 10))))
      (:action use :parameters () :precondition (ready) :effect (and (done) (increase (bill) (rate)))))";
    let problem = "(define (problem p) (:domain rental) (:init (at 10 (night)) (= (rate) 0) (= (bill) 0))
      (:goal (done)) (:metric minimize (bill)))";
    check("night", domain, problem, Some(("1", &["10.001", "10.001"])));
}

fn literal(random: &mut Random) -> String {
    let atom = ["(p)", "(q)", "(r)"][random.below(3) as usize];
    if random.below(3) == 0 { format!("(not {atom})") } else { atom.to_owned() }
}

#[test]
fn a_wait_is_no_step_of_a_plan() {
    // Without a metric, the number of actions is minimised. Two actions and a wait are shorter than three
    // actions.
    let domain =
        "(define (domain d) (:requirements :timed-initial-literals) (:predicates (at-b) (at-c) (at-d) (gate))
      (:action to-b :parameters () :precondition (and) :effect (at-b))
      (:action through :parameters () :precondition (and (at-b) (gate)) :effect (at-c))
      (:action round :parameters () :precondition (at-b) :effect (at-d))
      (:action back :parameters () :precondition (at-d) :effect (at-c)))";
    let problem = "(define (problem p) (:domain d) (:init (at 5 (gate))) (:goal (at-c)))";
    let (domain, problem) = parse(domain, problem);
    for engine in [Engine::Auto, Engine::Sat] {
        let found = plan(&domain, &problem, engine).expect("a plan");
        let starts: Vec<_> = found.steps.iter().map(|step| step.start.to_string()).collect();
        assert_eq!((found.cost.to_string().as_str(), found.steps.len()), ("2", 2), "{starts:?}");
        assert_eq!(
            starts.last().map(String::as_str),
            Some("5.001"),
            "what reads the gate does not begin as it opens"
        );
    }
}

fn timed(random: &mut Random, times: &[&str], most: u64) -> String {
    let mut text = String::from("(and");
    for _ in 0..=random.below(most) {
        let time = times[random.below(times.len() as u64) as usize];
        let _ = write!(text, " ({time} {})", literal(random));
    }
    text + ")"
}

struct Sample {
    durations: [i64; 3],
    events: Vec<i64>,
    domain: String,
    problem: String,
}

fn sample(random: &mut Random) -> Sample {
    let mut domain = String::from(
        "(define (domain d) (:requirements :durative-actions) (:predicates (p) (q) (r)) (:functions (total-cost))\n",
    );
    let mut durations = [0; 3];
    for (action, duration) in durations.iter_mut().enumerate() {
        *duration = random.below(4);
        let conditions = timed(random, &["at start", "over all", "at end", "over all"], 2);
        let effects = timed(random, &["at start", "at end", "at end"], 2);
        let _ = writeln!(
            domain,
            "(:durative-action a{action} :parameters () :duration (= ?duration {duration}) :condition {conditions}
               :effect (and {effects} (at end (increase (total-cost) {}))))",
            1 + random.below(3)
        );
    }
    domain.push(')');
    let mut init = String::from("(= (total-cost) 0)");
    for atom in ["(p)", "(q)", "(r)"] {
        if random.below(3) == 0 {
            let _ = write!(init, " {atom}");
        }
    }
    let mut events = Vec::new();
    for _ in 0..=random.below(4) {
        let time = random.below(7);
        let _ = write!(init, " (at {time} {})", literal(random));
        events.push(time);
    }
    let metric = ["(total-cost)", "(total-time)"][random.below(2) as usize];
    let problem = format!(
        "(define (problem x) (:domain d) (:init {init}) (:goal (and {} {})) (:metric minimize {metric}))",
        literal(random),
        literal(random)
    );
    Sample { durations, events, domain, problem }
}

/// Returns the best value over all plans with up to three actions. All times in the files are integers. An
/// action that is possible at some time is therefore also possible directly after the previous action, or
/// such that it starts or ends at an event or half a unit later. Times are doubled.
fn brute_force(task: &Sample, domain: &Domain, problem: &Problem) -> Option<i64> {
    let mut best = None;
    let mut open: Vec<(i64, String, usize)> = vec![(0, String::new(), 0)];
    while let Some((clock, text, length)) = open.pop() {
        let cost = metric(domain, problem, &text).and_then(|value| value.parse::<i64>().ok());
        best = [best, cost].into_iter().flatten().min();
        if length == 3 {
            continue;
        }
        for (action, duration) in task.durations.iter().enumerate() {
            let later =
                |time: i64| [2 * time, 2 * time + 1, 2 * (time - duration), 2 * (time - duration) + 1];
            let mut starts: Vec<_> = task.events.iter().flat_map(|time| later(*time)).collect();
            starts.retain(|time| *time > clock);
            starts.push(clock);
            starts.sort_unstable();
            starts.dedup();
            for start in starts {
                let half = if start % 2 == 0 { "" } else { ".5" };
                let longer = format!("{text}{}{half}: (a{action}) [{duration}]\n", start / 2);
                open.push((start + 2 * duration, longer, length + 1));
            }
        }
    }
    best
}

fn agree(seed: u64) {
    let task = sample(&mut Random(seed));
    let (domain, problem) = parse(&task.domain, &task.problem);
    let expected = brute_force(&task, &domain, &problem);
    for engine in [Engine::Auto, Engine::Sat] {
        let found = plan(&domain, &problem, engine);
        let context = || format!("seed {seed}, {engine:?}\n{}\n{}", task.domain, task.problem);
        let Some(found) = found else {
            assert_eq!(expected, None, "{}", context());
            continue;
        };
        let text = written(&found);
        let cost = metric(&domain, &problem, &text);
        assert_eq!(cost, Some(found.cost.to_string()), "{}\n{text}", context());
        let cost = found.cost.to_rational();
        let expected = expected.map(|expected| BigRational::from_integer(expected.into()));
        assert!(cost.is_integer());
        if found.steps.len() <= 3 {
            assert_eq!(Some(cost), expected, "{}\n{text}", context());
        } else {
            assert!(expected.is_none_or(|expected| cost <= expected), "{}\n{text}", context());
        }
    }
}

#[test]
fn plans_are_as_cheap_as_the_validator_admits() {
    (0..60).for_each(agree);
}

#[test]
#[ignore = "a minute"]
fn plans_are_as_cheap_as_the_validator_admits_on_many() {
    (1_000..20_000).for_each(agree);
}
