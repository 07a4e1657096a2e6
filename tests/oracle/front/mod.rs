//! Every front end and every compilation: a mission has the same best plan as the files that `export --to pddl` writes of it, and the
//! oracles confirm it.
//!
//! Of the two one is planned with the usual thresholds and one with [`Thresholds::NONE`], so that stubborn sets, pairs of facts, landmarks,
//! trees of labels and all searches that take turns are reached by tasks that are small enough for brute force.
//!
//! Some tasks and oracles are those of the planner's own tests: `crates/planner/tests`.

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
    Failure, Mode, Step, Tally, Truth, compare, plan_lines, project_verdict, rational, setting, steps_of,
};
use crate::temporal;
use robots::{Form, Robot};
use testing::random::Random;

/// A mission and what brute force knows of it.
pub struct Sample {
    pub mission: Mission,
    pub mode: Mode,
    /// Whether the larger value is the better.
    pub maximize: bool,
    pub known: Known,
}

/// What brute force has looked at, with the best value of a plan, if there is one.
#[derive(Debug, Clone)]
pub enum Known {
    /// All plans.
    All(Option<BigRational>),
    /// All plans of at most this value, where less is better.
    UpTo(i64, Option<BigRational>),
    /// Some plans.
    Some(Option<BigRational>),
}

/// A whole number.
pub fn whole(value: i64) -> BigRational {
    BigRational::from_integer(value.into())
}

/// What the planner answers.
#[derive(Debug)]
struct Answer {
    status: Status,
    cost: Option<BigRational>,
    bound: Option<BigRational>,
    steps: Vec<Step>,
    /// Whether a limit was reached.
    is_limited: bool,
}

impl Answer {
    fn is_decided(&self) -> bool {
        matches!(self.status, Status::Optimal | Status::Unsolvable)
    }
}

/// A generator of samples from seeds; none where a seed has no sample.
type Samples = Box<dyn FnMut(u64) -> Option<Sample>>;

/// The number of situations in which a robot is looked at.
const SITUATIONS: u64 = 15;

/// The mission of the domain and the problem as `export --to pddl` writes them, and their texts.
fn exported(mission: &Mission) -> (Mission, [String; 2]) {
    let (problem, _) = mission.filled().unwrap_or_else(|messages| panic!("{messages:#?}"));
    let (domain, problem) = portable(mission.domain(), &problem);
    let texts = [print_domain(&domain), print_problem(&problem)];
    let source = |name: &str, text: &String| Ok(Source::new(name, text.clone()));
    let (domain, problem) = (source("domain.pddl", &texts[0]), source("problem.pddl", &texts[1]));
    let mission = Mission::new("exported", None, Bindings::default(), domain, problem);
    (mission.unwrap_or_else(|messages| panic!("{messages:#?}\n{}\n{}", texts[0], texts[1])), texts)
}

/// Plans a mission; if it is refused, the codes of the messages.
fn plan(mission: &Mission, mode: &Mode, thresholds: Thresholds) -> Result<Answer, String> {
    let (problem, _) = mission.filled().unwrap_or_else(|messages| panic!("{messages:#?}"));
    let limits = Limits::none().with_thresholds(thresholds);
    let limits = match mode {
        Mode::Sequential => limits.with_time(Duration::from_secs(2)),
        // Not all of these tasks are decided, however long it takes: memory ends that in the same way on every machine.
        Mode::Concurrent(_) => limits.with_time(Duration::from_secs(2)).with_room(1 << 20),
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
            let task =
                mission.ground_concurrent(&problem, &[], separation, &Limits::none()).map_err(codes)?;
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

/// A sentence about a claim of the first answer that the second one refutes.
fn refuted(one: &Answer, other: &Answer, maximize: bool) -> Option<&'static str> {
    let found = other.cost.as_ref()?;
    let is_better = |than: &BigRational| compare(maximize, found, than).is_lt();
    if one.status == Status::Unsolvable {
        return Some("there is no plan, and there is one");
    }
    if one.status == Status::Optimal && one.cost.as_ref().is_some_and(is_better) {
        return Some("a plan is optimal, and another one is better");
    }
    one.bound.as_ref().is_some_and(is_better).then_some("no plan is better than a bound, and one is")
}

/// A sentence about a claim that brute force refutes.
fn disproved(answer: &Answer, known: &Known, maximize: bool) -> Option<&'static str> {
    let (Known::All(best) | Known::UpTo(_, best) | Known::Some(best)) = known;
    let is_better = |one: &BigRational, other: &BigRational| compare(maximize, one, other).is_lt();
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
    match (known, &answer.cost) {
        (Known::All(None), Some(_)) => Some("a plan where there is none"),
        (Known::UpTo(limit, best), Some(cost))
            if *cost <= whole(*limit) && best.as_ref().is_none_or(|best| cost < best) =>
        {
            Some("a plan that is better than all plans")
        }
        (Known::All(Some(best)), Some(cost)) if is_better(cost, best) => {
            Some("a plan that is better than all plans")
        }
        _ => None,
    }
}

/// Compares the answers to a mission and to its export with each other, and with brute force.
fn check(sample: &Sample, about: &str, seed: u64, tally: &mut Tally) {
    tally.tasks += 1;
    let Sample { mission, mode, maximize, known } = sample;
    let (export, texts) = exported(mission);
    let [first, second] = if seed.is_multiple_of(2) {
        [Thresholds::default(), Thresholds::NONE]
    } else {
        [Thresholds::NONE, Thresholds::default()]
    };
    let (own, other) = (plan(mission, mode, first), plan(&export, mode, second));
    let mut fail = |kind: &'static str, reason: &str| {
        let show = |answer: &Result<Answer, String>| match answer {
            Err(codes) => format!("refused: {codes}"),
            Ok(answer) => {
                let cost = answer.cost.as_ref().map(ToString::to_string);
                format!("{:?}, {cost:?}\n{}", answer.status, plan_lines(&answer.steps))
            }
        };
        let text = format!(
            "{about}: {kind}: {reason}\nthe mission: {}the export: {}brute force: {known:?}\n{}\n{}\n{}\n{}\n",
            show(&own),
            show(&other),
            mission.domain_source().text(),
            mission.problem_source().text(),
            texts[0],
            texts[1],
        );
        tally.failures.push(Failure { kind, text });
    };
    let (one, two) = match (&own, &other) {
        (Ok(one), Ok(two)) => (one, two),
        (Err(one), Err(two)) if one == two => return tally.count(format!("refused: {one}")),
        _ => return fail("one is refused, the other one is not", ""),
    };
    for (answer, against) in [(one, two), (two, one)] {
        if let Some(kind) = refuted(answer, against, *maximize) {
            fail(kind, "mission and export contradict each other");
        }
        if let Some(kind) = disproved(answer, known, *maximize) {
            fail(kind, "brute force");
        }
    }
    if one.is_decided() && two.is_decided() {
        if (one.status, &one.cost) != (two.status, &two.cost) {
            fail("the answers differ", "");
        }
    } else if *mode == Mode::Sequential && one.status != two.status && !one.is_limited && !two.is_limited {
        fail("the statuses differ", "no limit was reached");
    }
    // Each plan is one of the other files, too, and costs as much.
    let problem = mission.filled().expect("filled").0;
    let exported_problem = export.filled().expect("filled").0;
    for (answer, mission, problem) in [(one, &export, &exported_problem), (two, mission, &problem)] {
        let Some(cost) = &answer.cost else { continue };
        let verdict = project_verdict(mission, problem, &answer.steps, mode);
        if let Some(violation) = &verdict.violation {
            fail("a plan is not one of the other files", &violation.message);
        } else if problem.metric.is_some() && verdict.metric.as_ref() != Some(cost) {
            fail("a plan costs otherwise in the other files", &format!("{:?}", verdict.metric));
        }
    }
    tally.count(match (one.is_decided() && two.is_decided(), one.status) {
        (true, Status::Optimal) => "decided: optimal",
        (true, _) => "decided: no plan",
        (false, _) => "not decided",
    });
    if let (Known::All(best) | Known::UpTo(_, best) | Known::Some(best), Status::Optimal) =
        (known, one.status)
    {
        let is_same = best.as_ref() == one.cost.as_ref();
        tally.count(if is_same { "brute force: as good" } else { "brute force: worse, or nothing" });
    }
}

/// Robots, each in some situations.
fn robots(form: impl Fn(u64) -> Form + 'static) -> Samples {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mut known: Option<(u64, Robot)> = None;
    Box::new(move |seed| {
        let group = seed / SITUATIONS;
        if known.as_ref().is_none_or(|(own, _)| *own != group) {
            known = Some((group, Robot::new(group, form(group), directory.path())));
        }
        known.as_ref().map(|(_, robot)| robot.sample(seed))
    })
}

fn of_texts(domain: &str, problem: &str, maximize: bool, known: Known) -> Sample {
    let (mission, _) = crate::judge::read(domain, problem)
        .unwrap_or_else(|messages| panic!("{messages:#?}\n{domain}\n{problem}"));
    Sample { mission, mode: Mode::Sequential, maximize, known }
}

fn derived(seed: u64) -> Option<Sample> {
    let case = temporal::with_derived(seed)?;
    let known = match case.truth {
        Truth::Best(value, _) => Known::All(Some(value)),
        Truth::NoPlan => Known::All(None),
        Truth::NoBest(value, _) => Known::Some(Some(value)),
        Truth::Open(found) => Known::Some(found.map(|(value, _)| value)),
    };
    Some(of_texts(&case.domain, &case.problem, case.maximize, known))
}

fn undefined(seed: u64) -> Sample {
    let task = partial::Generator(Random(seed)).task();
    let known = Known::UpTo(partial::DEPTH as i64, task.shortest().map(|steps| whole(steps as i64)));
    of_texts(&task.domain(), &task.problem(), false, known)
}

/// The samples of a front end, by name.
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
        other => panic!("there is no front end `{other}`"),
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

/// Checks so many samples; at least as many of a hundred must be decided.
fn run(front: &str, default: u64, least: usize) {
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", default) as usize);
    let (mut samples, mut tally) = (samples(front), Tally::default());
    for seed in from.. {
        if tally.tasks == tasks {
            break;
        }
        if let Some(sample) = samples(seed) {
            check(&sample, &format!("{front}, seed {seed}"), seed, &mut tally);
        }
    }
    let decided: usize = ["decided: optimal", "decided: no plan"]
        .map(|what| tally.counts.get(what).copied().unwrap_or(0))
        .iter()
        .sum();
    tally.finish();
    assert!(100 * decided >= least * tasks, "{front}: {decided} of {tasks} are decided");
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

/// Ten thousand tasks of each front end, or of `ORACLE_FRONT`.
#[test]
#[ignore = "takes an hour"]
fn many() {
    let only = std::env::var("ORACLE_FRONT").ok();
    for front in FRONTS.iter().filter(|front| only.as_ref().is_none_or(|only| only == *front)) {
        run(front, 10_000, 0);
    }
}
