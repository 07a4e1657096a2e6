//! Differential test of all front ends and compilations. A mission and its export by
//! `export --to pddl` must have the same optimum, and a brute-force oracle must not refute it.
//!
//! Either the mission or its export is planned with the default thresholds, and the other with
//! [`Thresholds::NONE`]. Without thresholds, tasks that are small enough for brute force also reach
//! stubborn sets, h² mutexes, landmarks, label trees and further engines of the portfolio.
//!
//! Some generators and oracles are shared with the planner's own tests in `crates/planner/tests`.

#[path = "../../../crates/planner/tests/partial/model.rs"]
#[allow(dead_code, reason = "the planner's own tests ask more of it")]
mod partial;

mod grid;
mod object_fluents;
mod preferences;
mod robots;

use std::time::Duration;

use metaplan::mission::{Bindings, Mission, Planning as _};
use num_rational::BigRational;
use pddl::{Source, portable, print_domain, print_problem};
use planner::{Config, Limits, Status, Thresholds};

use crate::judge::{
    Failure, Mode, Step, Tally, Truth, compare, is_over, plan_lines, project_verdict, rational, setting,
    steps_of,
};
use crate::temporal;
use robots::{Form, Robot};
use testing::random::Random;

pub struct Sample {
    pub mission: Mission,
    pub mode: Mode,
    pub maximize: bool,
    pub reference: Reference,
}

/// Plans that brute force enumerated, with the best value among them (`None` without a plan).
#[derive(Debug, Clone)]
pub enum Reference {
    All(Option<BigRational>),
    /// All plans up to this value were enumerated; smaller values are better.
    UpTo(i64, Option<BigRational>),
    Some(Option<BigRational>),
}

pub fn whole(value: i64) -> BigRational {
    BigRational::from_integer(value.into())
}

#[derive(Debug)]
struct Answer {
    status: Status,
    cost: Option<BigRational>,
    bound: Option<BigRational>,
    steps: Vec<Step>,
    is_limited: bool,
}

impl Answer {
    fn is_decided(&self) -> bool {
        matches!(self.status, Status::Optimal | Status::Unsolvable)
    }
}

/// A generator of samples; `None` if it has no sample for a seed.
type Samples = Box<dyn FnMut(u64) -> Option<Sample>>;

/// All situations of a robot share its knowledge base, which is read once.
const SITUATIONS: u64 = 15;

/// Exports a mission as `export --to pddl` does. The texts are domain and problem.
fn exported(mission: &Mission) -> (Mission, [String; 2]) {
    let (problem, _) = mission.filled().unwrap_or_else(|messages| panic!("{messages:#?}"));
    let (domain, problem) = portable(mission.domain(), &problem);
    let texts = [print_domain(&domain), print_problem(&problem)];
    let source = |name: &str, text: &String| Ok(Source::new(name, text.clone()));
    let (domain, problem) = (source("domain.pddl", &texts[0]), source("problem.pddl", &texts[1]));
    let mission = Mission::new("exported", None, Bindings::default(), domain, problem);
    (mission.unwrap_or_else(|messages| panic!("{messages:#?}\n{}\n{}", texts[0], texts[1])), texts)
}

/// Plans a mission. If it is refused, returns the codes of the messages as an error.
fn plan(mission: &Mission, mode: &Mode, thresholds: Thresholds) -> Result<Answer, String> {
    let (problem, _) = mission.filled().unwrap_or_else(|messages| panic!("{messages:#?}"));
    let limits = Limits::none().with_thresholds(thresholds);
    let limits = match mode {
        Mode::Sequential => limits.with_time(Duration::from_secs(2)),
        // Some of these tasks are never decided. The memory limit ends their search at the same point on
        // every machine. With a time limit, searches would begin again when memory is full.
        Mode::Concurrent(_) => limits.with_room(1 << 20),
    };
    let codes = |messages: metaplan::Errors| {
        let mut codes: Vec<String> = messages.iter().map(|message| message.code.clone()).collect();
        codes.dedup();
        codes.join("+")
    };
    let solution = match mode {
        Mode::Sequential => {
            let task = mission.ground(&problem, &[], &Limits::none()).map_err(codes)?;
            let config = Config::default().with_limits(limits.clone());
            let config = if thresholds == Thresholds::NONE { config.with_head_start(1) } else { config };
            planner::lexicographic(&task, &config, &mut |_| {}).solution
        }
        Mode::Concurrent(separation) => {
            let task = mission.ground_concurrent(&problem, &[], separation, &limits).map_err(codes)?;
            planner::optimize_concurrent(&task, &limits, &mut |_| {})
        }
    };
    Ok(Answer {
        status: solution.status,
        cost: solution.plan.as_ref().map(|plan| rational(&plan.cost)),
        bound: solution.lower_bound.as_ref().map(rational),
        steps: solution.plan.as_ref().map(steps_of).unwrap_or_default(),
        is_limited: limits.reached(),
    })
}

/// Returns a description of a statement in `claim` that the plan of `witness` refutes, if there is one.
fn refuted(claim: &Answer, witness: &Answer, maximize: bool) -> Option<&'static str> {
    let cost = witness.cost.as_ref()?;
    let is_better = |than: &BigRational| compare(maximize, cost, than).is_lt();
    if claim.status == Status::Unsolvable {
        return Some("there is no plan, and there is one");
    }
    if claim.status == Status::Optimal && claim.cost.as_ref().is_some_and(is_better) {
        return Some("a plan is optimal, and another one is better");
    }
    claim.bound.as_ref().is_some_and(is_better).then_some("no plan is better than a bound, and one is")
}

fn disproved(answer: &Answer, reference: &Reference, maximize: bool) -> Option<&'static str> {
    let (Reference::All(best) | Reference::UpTo(_, best) | Reference::Some(best)) = reference;
    let is_better = |left: &BigRational, right: &BigRational| compare(maximize, left, right).is_lt();
    if let Some(best) = best {
        if answer.status == Status::Unsolvable {
            return Some("false: no plan");
        }
        if answer.status == Status::Optimal && answer.cost.as_ref().is_some_and(|cost| is_better(best, cost))
        {
            return Some("false: optimal");
        }
        if answer.bound.as_ref().is_some_and(|bound| is_better(best, bound)) {
            return Some("false: bound");
        }
    }
    match (reference, &answer.cost) {
        (Reference::All(None), Some(_)) => Some("a plan where there is none"),
        (Reference::UpTo(limit, best), Some(cost))
            if *cost <= whole(*limit) && best.as_ref().is_none_or(|best| cost < best) =>
        {
            Some("a plan that is better than all plans")
        }
        (Reference::All(Some(best)), Some(cost)) if is_better(cost, best) => {
            Some("a plan that is better than all plans")
        }
        _ => None,
    }
}

fn check(sample: &Sample, about: &str, seed: u64, tally: &mut Tally) {
    tally.tasks += 1;
    let Sample { mission, mode, maximize, reference } = sample;
    let (export, texts) = exported(mission);
    // The roles alternate, so that the mission and the export are both planned without thresholds.
    let [first, second] = if seed.is_multiple_of(2) {
        [Thresholds::default(), Thresholds::NONE]
    } else {
        [Thresholds::NONE, Thresholds::default()]
    };
    let (original, counterpart) = (plan(mission, mode, first), plan(&export, mode, second));
    let mut fail = |kind: &'static str, reason: &str| {
        let show = |answer: &Result<Answer, String>| match answer {
            Err(codes) => format!("refused: {codes}"),
            Ok(answer) => {
                let cost = answer.cost.as_ref().map(ToString::to_string);
                format!("{:?}, {cost:?}\n{}", answer.status, plan_lines(&answer.steps))
            }
        };
        let text = format!(
            "{about}: {kind}: {reason}\nthe mission: {}the export: {}brute force: {reference:?}\n{}\n{}\n{}\n{}\n",
            show(&original),
            show(&counterpart),
            mission.domain_source().text(),
            mission.problem_source().text(),
            texts[0],
            texts[1],
        );
        tally.failures.push(Failure { kind, text });
    };
    let (first_answer, second_answer) = match (&original, &counterpart) {
        (Ok(first_answer), Ok(second_answer)) => (first_answer, second_answer),
        (Err(first_answer), Err(second_answer)) if first_answer == second_answer => {
            return tally.count(format!("refused: {first_answer}"));
        }
        _ => return fail("one is refused, the other one is not", ""),
    };
    for (answer, witness) in [(first_answer, second_answer), (second_answer, first_answer)] {
        if let Some(kind) = refuted(answer, witness, *maximize) {
            fail(kind, "mission and export contradict each other");
        }
        if let Some(kind) = disproved(answer, reference, *maximize) {
            fail(kind, "brute force");
        }
    }
    // Answers that are not decided can differ by the time that the engines got, unless no limit was reached.
    if first_answer.is_decided() && second_answer.is_decided() {
        if (first_answer.status, &first_answer.cost) != (second_answer.status, &second_answer.cost) {
            fail("the answers differ", "");
        }
    } else if *mode == Mode::Sequential
        && first_answer.status != second_answer.status
        && !first_answer.is_limited
        && !second_answer.is_limited
    {
        fail("the statuses differ", "no limit was reached");
    }
    // A plan for the mission is also a plan for the export with the same cost, and vice versa.
    let problem = mission.filled().expect("filled").0;
    let exported_problem = export.filled().expect("filled").0;
    for (answer, mission, problem) in
        [(first_answer, &export, &exported_problem), (second_answer, mission, &problem)]
    {
        let Some(cost) = &answer.cost else { continue };
        let verdict = project_verdict(mission, problem, &answer.steps, mode);
        if let Some(violation) = &verdict.violation {
            fail("a plan is not one of the other files", &violation.message);
        } else if problem.metric.is_some() && verdict.metric.as_ref() != Some(cost) {
            fail("a plan costs otherwise in the other files", &format!("{:?}", verdict.metric));
        }
    }
    tally.count(match (first_answer.is_decided() && second_answer.is_decided(), first_answer.status) {
        (true, Status::Optimal) => "decided: optimal",
        (true, _) => "decided: no plan",
        (false, _) => "not decided",
    });
    if let (Reference::All(best) | Reference::UpTo(_, best) | Reference::Some(best), Status::Optimal) =
        (reference, first_answer.status)
    {
        let is_same = best.as_ref() == first_answer.cost.as_ref();
        tally.count(if is_same { "brute force: as good" } else { "brute force: worse, or nothing" });
    }
}

fn robots(form: impl Fn(u64) -> Form + 'static) -> Samples {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mut current: Option<(u64, Robot)> = None;
    Box::new(move |seed| {
        let group = seed / SITUATIONS;
        if current.as_ref().is_none_or(|(group_of_robot, _)| *group_of_robot != group) {
            current = Some((group, Robot::new(group, form(group), directory.path())));
        }
        current.as_ref().map(|(_, robot)| robot.sample(seed))
    })
}

fn of_texts(domain: &str, problem: &str, maximize: bool, reference: Reference) -> Sample {
    let (mission, _) = crate::judge::read(domain, problem)
        .unwrap_or_else(|messages| panic!("{messages:#?}\n{domain}\n{problem}"));
    Sample { mission, mode: Mode::Sequential, maximize, reference }
}

fn derived(seed: u64) -> Option<Sample> {
    let case = temporal::with_derived(seed)?;
    let reference = match case.truth {
        Truth::Best(value, _) => Reference::All(Some(value)),
        Truth::NoPlan => Reference::All(None),
        Truth::NoBest(value, _) => Reference::Some(Some(value)),
        Truth::Open(best_plan) => Reference::Some(best_plan.map(|(value, _)| value)),
    };
    Some(of_texts(&case.domain, &case.problem, case.maximize, reference))
}

fn undefined(seed: u64) -> Sample {
    let task = partial::Generator(Random(seed)).task();
    let reference = Reference::UpTo(partial::DEPTH as i64, task.shortest().map(|steps| whole(steps as i64)));
    of_texts(&task.domain(), &task.problem(), false, reference)
}

fn samples(front: &str) -> Samples {
    match front {
        "explicit form" => robots(|_| Form::Explicit),
        "native form" => robots(|_| Form::Native),
        "bindings and names" => {
            robots(|group| if group.is_multiple_of(2) { Form::Renamed } else { Form::NativeBound })
        }
        "object fluents" => Box::new(|seed| Some(object_fluents::sample(seed))),
        "preferences" => Box::new(|seed| Some(preferences::sample(seed))),
        "overlapping preferences" => Box::new(|seed| Some(grid::trajectories(seed))),
        "chosen durations" => Box::new(|seed| Some(grid::durations(seed))),
        "derived predicates" => Box::new(derived),
        "undefined fluents" => Box::new(|seed| Some(undefined(seed))),
        unknown => panic!("there is no front end `{unknown}`"),
    }
}

const FRONTS: [&str; 9] = [
    "explicit form",
    "native form",
    "bindings and names",
    "object fluents",
    "preferences",
    "overlapping preferences",
    "chosen durations",
    "derived predicates",
    "undefined fluents",
];

/// Checks `default` samples (or `ORACLE_TASKS`) of a front end. At least `min_percent` percent must be
/// decided.
fn run(front: &str, default: u64, min_percent: usize) {
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", default) as usize);
    let (mut samples, mut tally) = (samples(front), Tally::default());
    // Some seeds have no sample, so tasks are counted instead of seeds.
    for seed in from.. {
        if tally.tasks == tasks || is_over(&tally) {
            break;
        }
        if let Some(sample) = samples(seed) {
            check(&sample, &format!("{front}, seed {seed}"), seed, &mut tally);
        }
    }
    let decided: usize = ["decided: optimal", "decided: no plan"]
        .map(|key| tally.counts.get(key).copied().unwrap_or(0))
        .iter()
        .sum();
    tally.finish();
    assert!(100 * decided >= min_percent * tasks, "{front}: {decided} of {tasks} are decided");
}

#[test]
fn explicit_form() {
    run("explicit form", 300, 95);
}

#[test]
fn native_form() {
    run("native form", 300, 95);
}

#[test]
fn bindings_and_names() {
    run("bindings and names", 300, 95);
}

#[test]
fn object_fluents() {
    run("object fluents", 300, 50);
}

#[test]
fn preferences() {
    run("preferences", 300, 50);
}

#[test]
fn overlapping_preferences() {
    run("overlapping preferences", 300, 10);
}

#[test]
fn chosen_durations() {
    run("chosen durations", 300, 20);
}

#[test]
fn derived_predicates() {
    run("derived predicates", 300, 50);
}

#[test]
fn undefined_fluents() {
    run("undefined fluents", 300, 50);
}

/// Checks 10,000 samples of each front end, or only of the front end `ORACLE_FRONT`.
#[test]
#[ignore = "takes an hour"]
fn thousands_of_samples_per_front_end() {
    let only = std::env::var("ORACLE_FRONT").ok();
    for front in FRONTS.iter().filter(|front| only.as_ref().is_none_or(|only| only == *front)) {
        run(front, 10_000, 0);
    }
}
