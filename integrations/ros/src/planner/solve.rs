//! A domain and a problem, as PlanSys2 sends them → the best plan, or the reason why there is none.
//!
//! PlanSys2 leaves the metric out of its problems; so a default metric can be given. Durative actions overlap, as POPF has them, and the
//! makespan counts where there is no metric; if no such plan is found in time, actions follow one another. With a knowledge base
//! they always do: which design a function has is one choice at a time.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use metaplan::message::{Errors, Message};
use metaplan::mission::{
    Bindings, Mission, PlanLine, Planning as _, Reading, Unconfirmed, blocking, confirm, instant, plan_lines,
    spaced,
};
use metaplan::pddl::ast::{ActionBody, Problem};
use metaplan::pddl::{self, Source};
use metaplan::planner::{
    Config, Exact, Limits, Plan, Solution, Status, Step, alternatives, optimize, optimize_concurrent,
    optimize_exact,
};
use serde_json::{Value, json};

/// What is to be planned.
#[derive(Debug, Clone)]
pub struct Request<'r> {
    /// The domain.
    pub domain: Source,
    /// The problem.
    pub problem: Source,
    /// A mission whose knowledge base and bindings join in.
    pub joint: Option<&'r Mission>,
}

/// How it is to be planned.
#[derive(Debug, Clone)]
pub struct Manner {
    /// What is minimised where the problem has no metric: an expression as in a metric, or a function's name.
    pub metric: Option<String>,
    /// How long a plan is looked for.
    pub time_limit: Duration,
    /// Whether actions may overlap: if not said, durative ones without a knowledge base do.
    pub overlap: Option<bool>,
    /// Up to so many further plans that are as good.
    pub alternatives: usize,
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// The best plan, and further ones that are as good.
    pub plans: Vec<Vec<PlanLine>>,
    /// For each action of the best plan its functions and their designs.
    pub configuration: Vec<Vec<(String, String)>>,
    /// Its cost by the metric.
    pub cost: Exact,
    /// Whether it is proved that nothing is better.
    pub proved: bool,
    /// What is claimed of it, in a sentence.
    pub verdict: String,
    /// What is questionable about the domain and the problem.
    pub warnings: Vec<Message>,
}

impl Found {
    /// The best plan for programs, as the adaptation loop says it, with its times.
    pub fn to_json(&self) -> Value {
        let number = |number: &Exact| {
            let text = number.to_string();
            serde_json::from_str(&text).unwrap_or(Value::String(text))
        };
        let step = |(line, configuration): (&PlanLine, &Vec<(String, String)>)| {
            let mut words = line.action.trim_matches(['(', ')']).split(' ');
            json!({
                "action": words.next(),
                "arguments": words.collect::<Vec<_>>(),
                "configuration": configuration.iter().cloned().collect::<BTreeMap<_, _>>(),
                "start": number(&line.start),
                "duration": number(&line.duration),
            })
        };
        let best = self.plans.first().into_iter().flatten();
        json!({
            "answer": "plan_found",
            "cost": number(&self.cost),
            "optimal": self.proved,
            "steps": best.zip(&self.configuration).map(step).collect::<Vec<_>>(),
        })
    }
}

/// Why there is no plan.
#[derive(Debug, Clone)]
pub enum NoPlan {
    /// The domain, the problem or what the knowledge base contributes is wrong.
    Input(Errors),
    /// They have something that cannot be planned with.
    Unsupported(Errors),
    /// There is none, or none was found: why, in a sentence.
    None(String),
    /// A fault of this program.
    Fault(String),
}

impl NoPlan {
    /// The reason on one line, for PlanSys2's `error_info`, with the openings that PlanSys2 itself has.
    pub fn text(&self) -> String {
        match self {
            Self::Input(messages) => {
                let of = |name: &str| messages.iter().any(|message| message.file.as_deref() == Some(name));
                let opening = if of(DOMAIN) {
                    "Invalid PDDL domain"
                } else if of(PROBLEM) {
                    "Invalid PDDL problem"
                } else {
                    "Plan not found"
                };
                format!("{opening}: {}", one_line(messages))
            }
            Self::Unsupported(messages) => format!("Plan not found: {}", one_line(messages)),
            Self::None(reason) => format!("Plan not found: {reason}"),
            Self::Fault(reason) => {
                format!(
                    "Plan not found: this is a fault of metaplan, not of your input; please report it: {reason}"
                )
            }
        }
    }
}

/// What domains are called in messages.
pub(crate) const DOMAIN: &str = "domain";
/// What problems are called in messages.
pub(crate) const PROBLEM: &str = "problem";

/// Errors with their places, on one line.
fn one_line(messages: &[Message]) -> String {
    let texts = messages.iter().filter(|message| message.is_error()).map(|message| {
        let place = match (&message.file, message.line, message.column) {
            (Some(file), Some(line), Some(column)) => format!("{file}, line {line}, column {column}: "),
            _ => String::new(),
        };
        let help = message.help.as_ref().map(|help| format!(" ({help})")).unwrap_or_default();
        format!("{place}{}{help}", message.message)
    });
    texts.collect::<Vec<_>>().join("; ")
}

/// Of the time, so much is for plans whose actions overlap; the rest is for sequences if there is none.
const SHARE: f64 = 0.7;

/// Plans.
///
/// # Errors
/// Why there is no plan.
pub fn solve(request: Request<'_>, manner: &Manner) -> Result<Found, NoPlan> {
    let solved = catch_unwind(AssertUnwindSafe(|| solve_or_panic(request, manner)));
    solved.unwrap_or_else(|panic| Err(NoPlan::Fault(Message::of_panic(&*panic).message.clone())))
}

fn solve_or_panic(Request { domain, problem, joint }: Request<'_>, manner: &Manner) -> Result<Found, NoPlan> {
    let begun = Instant::now();
    let knowledge = joint.and_then(Mission::knowledge).cloned();
    let bindings = joint.map_or_else(Bindings::default, |mission| mission.bindings().clone());
    let mission =
        Mission::new("", knowledge.map(Ok), bindings, Ok(domain), Ok(problem)).map_err(NoPlan::Input)?;
    let (mut problem, mut warnings) = mission.filled().map_err(NoPlan::Input)?;
    warnings.extend(mission.warnings().cloned());
    if let (Some(metric), None) = (&manner.metric, &problem.metric) {
        problem.metric = Some(mission.objective(&problem, metric).map_err(NoPlan::Input)?);
    }
    let durative = |body: &ActionBody| matches!(body, ActionBody::Durative { .. });
    let is_durative = mission.domain().actions.iter().any(|action| durative(&action.body));
    let task = Asked { mission: &mission, problem: &problem, manner };
    let mut overlapping = None;
    if manner.overlap.unwrap_or(is_durative && mission.knowledge().is_none()) {
        let limits = Limits::none().with_time(manner.time_limit.mul_f64(SHARE));
        overlapping = task.overlapping(&limits)?;
    }
    let (solution, others) = match overlapping {
        Some(solution) => (solution, Vec::new()),
        None => task.sequence(Limits::none().with_time(manner.time_limit.saturating_sub(begun.elapsed())))?,
    };
    let plan = solution.plan.as_ref().ok_or_else(|| task.reason(&solution))?;
    let written = |plan: &Plan| plan_lines(&mission.written(plan.clone()));
    Ok(Found {
        plans: std::iter::once(plan).chain(&others).map(written).collect(),
        configuration: plan.steps.iter().map(|step: &Step| step.configuration.clone()).collect(),
        cost: plan.cost.clone(),
        proved: solution.status == Status::Optimal,
        verdict: solution.verdict(),
        warnings,
    })
}

/// A mission to plan, with its problem complete.
struct Asked<'a> {
    mission: &'a Mission,
    problem: &'a Problem,
    manner: &'a Manner,
}

impl Asked<'_> {
    /// A plan whose actions overlap, or that there is none; nothing if that is not known in time, or cannot be planned so.
    fn overlapping(&self, limits: &Limits) -> Result<Option<Solution>, NoPlan> {
        let separation = instant();
        let Ok(task) = self.mission.ground_concurrent(self.problem, &[], &separation, limits) else {
            return Ok(None);
        };
        let mut solution = optimize_concurrent(&task, limits, &mut |_| {});
        solution.plan = solution
            .plan
            .map(|plan| self.confirmed(plan, &Reading::concurrent(&separation), limits))
            .transpose()?;
        Ok(Some(solution).filter(|solution| solution.status != Status::Unknown))
    }

    /// A plan whose actions follow one another, and others that are as good.
    fn sequence(&self, limits: Limits) -> Result<(Solution, Vec<Plan>), NoPlan> {
        let config = Config::default().with_limits(limits);
        let task = match self.mission.ground(self.problem, &[], &config.limits) {
            Ok(task) => task,
            Err(refused) if refused.iter().all(|message| message.code == "E304") => {
                return self.exact(&config).map(|solution| (solution, Vec::new()));
            }
            Err(_) if config.limits.reached() => {
                let text = "a limit was reached before a plan was found; nothing is proved";
                return Err(NoPlan::None(text.to_owned()));
            }
            Err(messages) => return Err(NoPlan::Unsupported(messages)),
        };
        let mut solution = optimize(&task, &config, &mut |_| {});
        if let Some(contradiction) = &solution.statistics.contradiction {
            return Err(NoPlan::Fault(contradiction.clone()));
        }
        let reading = Reading::sequential(task.is_timed());
        let most = self.manner.alternatives;
        let found = if most > 0 { alternatives(&task, &solution, most, &config) } else { None };
        solution.plan =
            solution.plan.map(|plan| self.confirmed(plan, &reading, &config.limits)).transpose()?;
        let others = found.into_iter().flat_map(|found| found.plans);
        let others =
            others.map(|plan| self.confirmed(plan, &reading, &config.limits)).collect::<Result<_, _>>()?;
        Ok((solution, others))
    }

    /// A plan of a task whose numbers are too large for formulas.
    fn exact(&self, config: &Config) -> Result<Solution, NoPlan> {
        let task =
            self.mission.ground_exact(self.problem, &[], &config.limits).map_err(NoPlan::Unsupported)?;
        let mut solution = optimize_exact(&task, config);
        let reading = Reading::sequential(task.is_timed());
        solution.plan =
            solution.plan.map(|plan| self.confirmed(plan, &reading, &config.limits)).transpose()?;
        Ok(solution)
    }

    /// Returns a plan once the validator has executed it, with start times that show which actions follow each other.
    fn confirmed(&self, plan: Plan, reading: &Reading, limits: &Limits) -> Result<Plan, NoPlan> {
        match confirm(self.mission, self.problem, &plan, reading, limits) {
            Ok(()) => Ok(spaced(self.mission, self.problem, plan, reading, limits)),
            Err(Unconfirmed::Refused(reason)) => Err(NoPlan::Fault(reason)),
            Err(Unconfirmed::Interrupted) => {
                Err(NoPlan::None("a limit was reached before the plan was validated".to_owned()))
            }
        }
    }

    fn reason(&self, solution: &Solution) -> NoPlan {
        let mut text = solution.verdict();
        if solution.status == Status::Unsolvable && self.mission.knowledge().is_some() {
            let limits = Limits::none().with_time(self.manner.time_limit);
            let config = Config::default().with_limits(limits);
            let blocking = blocking(self.mission, self.problem, &config);
            let more = blocking.as_ref().map(ToString::to_string);
            text.extend(more.map(|more| format!("; {more}")));
        }
        NoPlan::None(text)
    }
}

/// That a text is a valid domain.
///
/// # Errors
/// All that is wrong with it.
pub(crate) fn check_domain(domain: &Source) -> Result<(), Errors> {
    let (tree, mut found) = pddl::parse_domain(domain);
    if let Some(tree) = &tree {
        found.extend(pddl::check_domain(tree, domain));
    }
    found.retain(|diagnostic| diagnostic.severity == pddl::Severity::Error);
    match tree {
        Some(_) if found.is_empty() => Ok(()),
        _ => Err(Message::from_pddl(&found, &[domain]).into()),
    }
}
