//! Compares the planner's answer for a task with the oracle's answer and records differences.
//!
//! The stages are the same as in the program: parse, ground, optimise, validate, certify, verify.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use metaplan::Errors;
use metaplan::measure::measure;
use metaplan::mission::{Bindings, Mission, Planning as _};
use num_rational::BigRational;
use num_traits::Zero as _;
use pddl::Source;
use pddl::ast::{Name, Problem};
use pddl::validate::{Options, PlanStep, PlanText, Verdict, validate};
use planner::{Config, Exact, Limits, MetricUnbounded, Plan, Solution, Status, Thresholds};

use crate::certify::{self, Planned};

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    pub action: String,
    pub arguments: Vec<String>,
    pub start: BigRational,
    /// 0 for an instantaneous action.
    pub duration: BigRational,
}

#[derive(Debug, Clone)]
pub enum Truth {
    /// The metric has a best value. The fields are this value and a plan that attains it.
    Best(BigRational, Vec<Step>),
    NoPlan,
    /// The task is solvable, but has no best value. The fields are the value of some plan and this plan.
    NoBest(BigRational, Vec<Step>),
    /// The oracle reached its limit. The field is the best value found with its plan, if any.
    Open(Option<(BigRational, Vec<Step>)>),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mode {
    Sequential,
    /// Actions can overlap. The field is the separation: the minimum distance of interfering happenings.
    Concurrent(BigRational),
}

/// Executes a plan according to the definition. Returns the value of the plan, or the reason why the plan is
/// invalid.
pub type Executor = Box<dyn Fn(&[Step]) -> Result<BigRational, String>>;

pub struct Case {
    /// Name of the generator and seed. Also the name of the directory in which a failure is saved.
    pub name: String,
    pub domain: String,
    pub problem: String,
    pub mode: Mode,
    pub maximize: bool,
    pub truth: Truth,
    pub execute: Executor,
    /// Whether a certificate is written and verified, in sequential mode only.
    pub certify: bool,
    pub limit: Duration,
    /// Time limit of the second run, which has no thresholds.
    pub second_limit: Duration,
}

/// Second time limit of random tasks: a task that the first run does not decide is rarely decided by the second run.
pub const SHORT: Duration = Duration::from_millis(300);

#[derive(Debug)]
pub struct Failure {
    pub kind: &'static str,
    pub text: String,
}

#[derive(Debug, Default)]
pub struct Tally {
    pub tasks: usize,
    pub counts: BTreeMap<String, usize>,
    pub failures: Vec<Failure>,
    pub planning: Duration,
    pub certificates: Duration,
}

#[derive(Debug)]
enum Answer {
    Refused(String),
    Solved(Box<Solved>),
}

#[derive(Debug)]
struct Solved {
    solution: Solution,
    /// Whether plans without a metric are measured by their total time.
    timed: bool,
    /// The ground task of a sequential run with the default thresholds, for a certificate.
    task: Option<Planned>,
}

pub fn rational(exact: &Exact) -> BigRational {
    exact.to_rational()
}

/// Formats a time as a decimal: exactly if at most 39 fractional digits suffice, otherwise rounded to nine
/// digits.
pub fn decimal(number: &BigRational) -> String {
    let mut scale = num_bigint::BigInt::from(1);
    for digits in 0..40_usize {
        let scaled = number * &scale;
        if scaled.is_integer() {
            let text = format!("{:0>width$}", scaled.to_integer().to_string(), width = digits + 1);
            let (whole, fraction) = text.split_at(text.len() - digits);
            return if fraction.is_empty() { whole.to_owned() } else { format!("{whole}.{fraction}") };
        }
        scale *= 10;
    }
    let billion = BigRational::from_integer(1_000_000_000.into());
    decimal(&((number * &billion).round() / billion))
}

/// Formats a plan as lines `start: (action arguments) [duration]`.
pub fn plan_lines(steps: &[Step]) -> String {
    steps.iter().fold(String::new(), |mut text, step| {
        let call = [std::slice::from_ref(&step.action), &step.arguments[..]].concat().join(" ");
        let _ = writeln!(text, "{}: ({call}) [{}]", decimal(&step.start), decimal(&step.duration));
        text
    })
}

pub fn steps_of(plan: &Plan) -> Vec<Step> {
    plan.steps
        .iter()
        .map(|step| Step {
            action: step.action.clone(),
            arguments: step.arguments.clone(),
            start: rational(&step.start),
            duration: rational(&step.duration),
        })
        .collect()
}

pub fn plan_text(steps: &[Step]) -> PlanText {
    let step = |step: &Step| PlanStep {
        action: Name::new(&step.action),
        arguments: step.arguments.iter().map(|argument| Name::new(argument)).collect(),
        start: Some(step.start.clone()),
        // Instantaneous actions have no duration in plan files.
        duration: (!step.duration.is_zero()).then(|| step.duration.clone()),
        line: 0,
    };
    PlanText { steps: steps.iter().map(step).collect() }
}

/// Sequential plans are checked without tolerance, because their times are exact.
pub fn options(mode: &Mode) -> Options {
    match mode {
        Mode::Sequential => Options::default().with_tolerance(BigRational::zero()),
        Mode::Concurrent(separation) => {
            Options::default().with_concurrent(true).with_tolerance(separation.clone())
        }
    }
}

pub fn project_verdict(mission: &Mission, problem: &Problem, steps: &[Step], mode: &Mode) -> Verdict {
    validate(mission.domain(), problem, &plan_text(steps), &options(mode))
}

pub fn read(domain: &str, problem: &str) -> Result<(Mission, Problem), Errors> {
    let source = |name: &str, text: &str| Ok(Source::new(name, text.to_owned()));
    let (domain, problem) = (source("domain.pddl", domain), source("problem.pddl", problem));
    let mission = Mission::new("", None, Bindings::default(), domain, problem)?;
    let (problem, _warnings) = mission.filled()?;
    Ok((mission, problem))
}

/// Returns the configuration of the planner for a task. The head start of the search varies with the name of the
/// task, so that all engines are used.
fn config(name: &str, limits: Limits, thresholds: Thresholds) -> Config {
    let sum: usize = name.bytes().map(usize::from).sum();
    let config = Config::default().with_limits(limits);
    let usual = [config.head_start, 10, 1][sum % 3];
    config.with_head_start(if thresholds == Thresholds::NONE { 1 } else { usual })
}

fn plan(
    mission: &Mission,
    problem: &Problem,
    Case { mode, name, .. }: &Case,
    (limits, thresholds): (&Limits, Thresholds),
) -> Answer {
    let limits = &limits.clone().with_thresholds(thresholds);
    // A certificate does not depend on the engine that found the answer, so one certificate per task is
    // enough.
    let is_certified = thresholds == Thresholds::default();
    let refused = |messages: Errors| {
        let mut codes: Vec<_> = messages.iter().map(|message| message.code.clone()).collect();
        codes.dedup();
        Answer::Refused(codes.join("+"))
    };
    match mode {
        Mode::Sequential => match mission.ground(problem, &[], limits) {
            // E304: numbers exceed the integers. The program then plans with rational numbers, and so does
            // the test.
            Err(messages) if messages.iter().all(|message| message.code == "E304") => {
                match mission.ground_exact(problem, &[], limits) {
                    Err(messages) => refused(messages),
                    Ok(task) => {
                        let config = Config::default().with_limits(limits.clone());
                        let solution = planner::optimize_exact(&task, &config);
                        let (timed, task) =
                            (task.is_timed(), is_certified.then(|| Planned::Exact(Box::new(task))));
                        Answer::Solved(Box::new(Solved { solution, timed, task }))
                    }
                }
            }
            Err(messages) => refused(messages),
            Ok(task) => {
                let config = config(name, limits.clone(), thresholds);
                let point = planner::lexicographic(&task, &config, &mut |_| {});
                let timed = task.is_timed();
                let task = is_certified.then(|| Planned::Integers(Box::new(task)));
                Answer::Solved(Box::new(Solved { solution: point.solution, timed, task }))
            }
        },
        Mode::Concurrent(separation) => match mission.ground_concurrent(problem, &[], separation, limits) {
            Err(messages) => refused(messages),
            Ok(task) => {
                let solution = planner::optimize_concurrent(&task, limits, &mut |_| {});
                Answer::Solved(Box::new(Solved { solution, timed: true, task: None }))
            }
        },
    }
}

impl Tally {
    pub fn count(&mut self, key: impl Into<String>) {
        *self.counts.entry(key.into()).or_default() += 1;
    }

    /// Saves the files of the task to the directory `ORACLE_SAVE`, if this variable is set.
    pub fn fail(&mut self, case: &Case, kind: &'static str, reason: &str) {
        let Case { name, domain, problem, mode, truth, .. } = case;
        let mode = match mode {
            Mode::Sequential => "one after another".to_owned(),
            Mode::Concurrent(separation) => format!("concurrent, separation {separation}"),
        };
        let truth = match truth {
            Truth::Best(cost, plan) => format!("best {cost} by\n{}", plan_lines(plan)),
            Truth::NoPlan => "no plan\n".to_owned(),
            Truth::NoBest(cost, plan) => format!("no best value; {cost} by\n{}", plan_lines(plan)),
            Truth::Open(Some((cost, plan))) => format!("at least as good as {cost} by\n{}", plan_lines(plan)),
            Truth::Open(None) => "not known\n".to_owned(),
        };
        let text = format!("{name}: {kind}: {reason}\n{mode}; by the oracle: {truth}{domain}\n{problem}\n");
        if let Some(directory) = std::env::var_os("ORACLE_SAVE") {
            let directory = PathBuf::from(directory).join(name);
            std::fs::create_dir_all(&directory).expect("a directory");
            for (file, text) in [("domain.pddl", domain), ("problem.pddl", problem)] {
                std::fs::write(directory.join(file), text).expect("a file");
            }
            let failures = directory.join("failures.txt");
            let before = std::fs::read_to_string(&failures).unwrap_or_default();
            std::fs::write(failures, before + &text).expect("a file");
        }
        self.count(format!("FAILURE {kind}"));
        self.failures.push(Failure { kind, text });
    }

    pub fn summary(&self) -> String {
        let mut text = format!("{} tasks\n", self.tasks);
        for (key, count) in &self.counts {
            let _ = writeln!(text, "{count:>8}  {key}");
        }
        let each = |time: Duration| time.as_secs_f64() * 1e3 / self.tasks.max(1) as f64;
        let (planning, certificates) = (each(self.planning), each(self.certificates));
        let _ =
            writeln!(text, "a task: {planning:.2} ms in the planner, {certificates:.2} ms in certificates");
        text
    }

    #[allow(clippy::print_stdout)]
    pub fn finish(&self) {
        println!("{}", self.summary());
        let texts: Vec<_> = self.failures.iter().take(5).map(|failure| failure.text.as_str()).collect();
        assert!(texts.is_empty(), "{}\n{}", texts.join("\n"), self.summary());
    }
}

/// Compares two metric values. `Less` means that `left` is better.
pub fn compare(maximize: bool, left: &BigRational, right: &BigRational) -> std::cmp::Ordering {
    if maximize { right.cmp(left) } else { left.cmp(right) }
}

pub fn judge(case: &Case, tally: &mut Tally) {
    tally.tasks += 1;
    tally.count(match &case.truth {
        Truth::Best(..) => "oracle: best",
        Truth::NoPlan => "oracle: no plan",
        Truth::NoBest(..) => "oracle: no best value",
        Truth::Open(_) => "oracle: open",
    });
    // The oracle's own plan must have the oracle's value; otherwise the oracle is wrong.
    if let Truth::Best(cost, plan) | Truth::NoBest(cost, plan) | Truth::Open(Some((cost, plan))) = &case.truth
    {
        match (case.execute)(plan) {
            Ok(value) if value == *cost => {}
            unexpected => tally.fail(case, "the oracle refutes itself", &format!("{unexpected:?}")),
        }
    }
    // A panic is a failure of this task only, and the run continues.
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| judge_caught(case, tally))) {
        let reason = panic.downcast_ref::<String>().map(String::as_str);
        let reason = reason.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("?").to_owned();
        tally.fail(case, "panic", &reason);
    }
}

fn judge_caught(case: &Case, tally: &mut Tally) {
    let (mission, problem) = match read(&case.domain, &case.problem) {
        Ok(read) => read,
        Err(messages) => {
            let texts: Vec<_> = messages.iter().map(|message| message.message.clone()).collect();
            return tally.fail(case, "not read", &texts.join("; "));
        }
    };
    check_witness(case, &mission, &problem, tally);
    for (thresholds, limit) in [(Thresholds::default(), case.limit), (Thresholds::NONE, case.second_limit)] {
        let started = Instant::now();
        let limits = Limits::none().with_time(limit);
        let answer = plan(&mission, &problem, case, (&limits, thresholds));
        tally.planning += started.elapsed();
        judge_answer(case, (&mission, &problem), answer, &limits, tally);
    }
}

fn judge_answer(
    case: &Case,
    (mission, problem): (&Mission, &Problem),
    answer: Answer,
    limits: &Limits,
    tally: &mut Tally,
) {
    match answer {
        Answer::Refused(codes) => {
            // A limit reached while grounding is not a refusal of the task.
            tally.count(if limits.reached() {
                "limit while grounding".into()
            } else {
                format!("refused {codes}")
            });
        }
        Answer::Solved(solved) => {
            check_claim(case, &solved, tally);
            if let Some(plan) = &solved.solution.plan {
                check_plan(case, (mission, problem), plan, solved.timed, tally);
            }
            if let (true, Some(task)) = (case.certify, &solved.task) {
                let started = Instant::now();
                certify::check(case, (mission, problem), task, &solved.solution, tally);
                tally.certificates += started.elapsed();
            }
        }
    }
}

fn check_witness(case: &Case, mission: &Mission, problem: &Problem, tally: &mut Tally) {
    let (Truth::Best(cost, plan) | Truth::NoBest(cost, plan) | Truth::Open(Some((cost, plan)))) = &case.truth
    else {
        return;
    };
    let verdict = project_verdict(mission, problem, plan, &case.mode);
    if let Some(violation) = &verdict.violation {
        tally.fail(case, "the validator refuses the oracle's plan", &violation.message);
    } else if problem.metric.is_some() && verdict.metric.as_ref() != Some(cost) {
        tally.fail(
            case,
            "the validator measures the oracle's plan otherwise",
            &format!("{:?}", verdict.metric),
        );
    }
}

fn check_claim(case: &Case, solved: &Solved, tally: &mut Tally) {
    let solution = &solved.solution;
    let cost = solution.plan.as_ref().map(|plan| rational(&plan.cost));
    tally.count(match (solution.status, solution.unbounded) {
        (Status::Feasible, Some(MetricUnbounded::Proved)) => "planner: no best value, proved",
        (Status::Feasible, Some(MetricUnbounded::Suspected)) => "planner: no best value, suspected",
        (Status::Optimal, _) => "planner: optimal",
        (Status::Feasible, None) => "planner: feasible",
        (Status::Unsolvable, _) => "planner: no plan",
        (Status::UnsolvableWithinHorizon, _) => "planner: no plan within the horizon",
        (Status::Unknown, _) => "planner: nothing known",
    });
    let claim = format!("the planner says {:?}, {:?}, cost {cost:?}", solution.status, solution.proof);
    let kind = match (solution.status, &case.truth) {
        (Status::UnsolvableWithinHorizon, _) => Some("a horizon that was not asked for"),
        (Status::Unsolvable, Truth::Best(..) | Truth::NoBest(..) | Truth::Open(Some(_))) => {
            Some("false: no plan")
        }
        (Status::Optimal | Status::Feasible, Truth::NoPlan) => Some("a plan where there is none"),
        (Status::Optimal, Truth::NoBest(..)) => Some("false: optimal, no best value"),
        (Status::Optimal, Truth::Best(best, _)) if cost.as_ref() != Some(best) => Some("false: optimal"),
        (Status::Optimal, Truth::Open(Some((incumbent, _))))
            if cost.as_ref().is_none_or(|cost| compare(case.maximize, incumbent, cost).is_lt()) =>
        {
            Some("false: optimal")
        }
        (Status::Feasible, Truth::Best(best, _)) if solution.unbounded == Some(MetricUnbounded::Proved) => {
            let _ = best;
            Some("false: no best value")
        }
        _ => None,
    };
    if let Some(kind) = kind {
        tally.fail(case, kind, &claim);
    }
    if let Some(contradiction) = &solution.statistics.contradiction {
        tally.fail(case, "the planner contradicts itself", contradiction);
    }
    let (Truth::Best(attained, _) | Truth::Open(Some((attained, _))) | Truth::NoBest(attained, _)) =
        &case.truth
    else {
        return;
    };
    // A bound on the metric is false if an existing plan is better.
    if let Some(bound) = solution.lower_bound.as_ref().map(rational)
        && kind.is_none()
        && compare(case.maximize, attained, &bound).is_lt()
    {
        tally.fail(case, "false: bound", &format!("{claim}, bound {bound}"));
    }
}

fn check_plan(
    case: &Case,
    (mission, problem): (&Mission, &Problem),
    plan: &Plan,
    timed: bool,
    tally: &mut Tally,
) {
    let steps = steps_of(plan);
    let cost = rational(&plan.cost);
    let show = || format!("cost {cost} claimed for\n{}", plan_lines(&steps));
    match (case.execute)(&steps) {
        Ok(value) if value == cost => {}
        Ok(value) => tally.fail(case, "a plan costs otherwise", &format!("{value}; {}", show())),
        Err(reason) => tally.fail(case, "an invalid plan", &format!("{reason}; {}", show())),
    }
    let verdict = project_verdict(mission, problem, &steps, &case.mode);
    let value = measure(problem, &verdict, steps.len(), timed);
    if let Some(violation) = &verdict.violation {
        tally.fail(
            case,
            "the validator refuses the planner's plan",
            &format!("{}; {}", violation.message, show()),
        );
    } else if value.as_ref() != Some(&cost) {
        tally.fail(case, "the validator measures otherwise", &format!("{value:?}; {}", show()));
    }
}

pub fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

pub fn is_over(tally: &Tally) -> bool {
    !tally.failures.is_empty() && std::env::var_os("ORACLE_STOP").is_some()
}

/// Judges the cases of random tasks. `default` is the default of `ORACLE_TASKS`.
pub fn run(default: u64, cases: impl Fn(u64) -> Vec<Case>) -> Tally {
    let (from, tasks) = (setting("ORACLE_FROM", 0), setting("ORACLE_TASKS", default));
    let mut tally = Tally::default();
    for seed in from..from + tasks {
        cases(seed).iter().for_each(|case| judge(case, &mut tally));
        if is_over(&tally) {
            break;
        }
    }
    tally
}
