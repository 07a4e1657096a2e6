//! Planning for PlanSys2: computes the best plan of a domain and a problem, or the reason why no plan exists.
//!
//! PlanSys2's problems have no metric, so the parameters can provide one. Durative actions may overlap, as in POPF,
//! and the makespan is minimised if there is no metric. If no plan with overlapping actions is found in time, a
//! sequential plan is computed. By default, plans are also sequential if a knowledge base is used, because a function
//! has only one design at a time.

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

/// Domain and problem of a planning request.
#[derive(Debug, Clone)]
pub struct Request<'r> {
    /// PDDL domain.
    pub domain: Source,
    /// PDDL problem.
    pub problem: Source,
    /// Mission whose knowledge base and bindings restrict the plan; `None` for plain PDDL.
    pub joint: Option<&'r Mission>,
}

/// Parameters of planning.
#[derive(Debug, Clone)]
pub struct Manner {
    /// Metric for problems without a metric: an expression, or the name of a function.
    pub metric: Option<String>,
    /// Time limit of planning.
    pub time_limit: Duration,
    /// Whether actions may overlap. `None` allows overlap for durative actions without a knowledge
    /// base.
    pub overlap: Option<bool>,
    /// Upper limit on the number of alternative optimal plans.
    pub alternatives: usize,
}

/// A plan with its alternatives and cost.
#[derive(Debug, Clone)]
pub struct Found {
    /// The best plan, followed by alternatives of the same cost.
    pub plans: Vec<Vec<PlanLine>>,
    /// Pairs of a function and its design, for each action of the best plan.
    pub configuration: Vec<Vec<(String, String)>>,
    /// Cost of the plan by the metric.
    pub cost: Exact,
    /// Whether the plan is proved to be optimal.
    pub proved: bool,
    /// Sentence that states the quality of the plan, such as optimality.
    pub verdict: String,
    /// Warnings about the domain and the problem.
    pub warnings: Vec<Message>,
}

impl Found {
    /// Serialises the best plan with its times, in the format of the adaptation loop.
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

/// Reason why planning returned no plan.
#[derive(Debug, Clone)]
pub enum NoPlan {
    /// The domain, the problem or the contribution of the knowledge base is wrong.
    Input(Errors),
    /// The input uses features that the planner does not support.
    Unsupported(Errors),
    /// No plan exists or none was found; contains the reason.
    None(String),
    /// An error in this program; contains a description.
    Fault(String),
}

impl NoPlan {
    /// Formats the reason on a single line for PlanSys2's `error_info`, beginning like PlanSys2's
    /// own messages.
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

pub(crate) const DOMAIN: &str = "domain";
pub(crate) const PROBLEM: &str = "problem";

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

/// Share of the time limit for plans with overlapping actions. The remaining time is for sequential
/// plans.
const OVERLAPPING_SHARE: f64 = 0.7;

/// Computes a plan for a request; an optimal one, if the time limit permits. A panic of the planner is
/// returned as [`NoPlan::Fault`].
///
/// # Errors
/// Fails with the reason why there is no plan.
pub fn solve(request: Request<'_>, manner: &Manner) -> Result<Found, NoPlan> {
    let solved = catch_unwind(AssertUnwindSafe(|| solve_or_panic(request, manner)));
    solved.unwrap_or_else(|panic| Err(NoPlan::Fault(Message::of_panic(&*panic).message.clone())))
}

fn solve_or_panic(Request { domain, problem, joint }: Request<'_>, manner: &Manner) -> Result<Found, NoPlan> {
    let start = Instant::now();
    let knowledge = joint.and_then(Mission::knowledge).cloned();
    let bindings = joint.map_or_else(Bindings::default, |mission| mission.bindings().clone());
    let mission =
        Mission::new("", knowledge.map(Ok), bindings, Ok(domain), Ok(problem)).map_err(NoPlan::Input)?;
    let (mut problem, mut warnings) = mission.filled().map_err(NoPlan::Input)?;
    warnings.extend(mission.warnings().cloned());
    if let (Some(metric), None) = (&manner.metric, &problem.metric) {
        problem.metric = Some(mission.objective(&problem, metric).map_err(NoPlan::Input)?.metric);
    }
    let durative = |body: &ActionBody| matches!(body, ActionBody::Durative { .. });
    let is_durative = mission.domain().actions.iter().any(|action| durative(&action.body));
    let task = FilledMission { mission: &mission, problem: &problem, manner, start };
    let mut overlapping = None;
    if manner.overlap.unwrap_or(is_durative && mission.knowledge().is_none()) {
        let limits = Limits::none().with_time(manner.time_limit.mul_f64(OVERLAPPING_SHARE));
        overlapping = task.overlapping(&limits)?;
    }
    let (solution, other_plans) = match overlapping {
        Some(solution) => (solution, Vec::new()),
        None => task.sequence(task.remaining())?,
    };
    let plan = solution.plan.as_ref().ok_or_else(|| task.reason(&solution))?;
    let written = |plan: &Plan| plan_lines(&mission.written(plan.clone()));
    Ok(Found {
        plans: std::iter::once(plan).chain(&other_plans).map(written).collect(),
        configuration: plan.steps.iter().map(|step: &Step| step.configuration.clone()).collect(),
        cost: plan.cost.clone(),
        proved: solution.status == Status::Optimal,
        verdict: solution.verdict(),
        warnings,
    })
}

struct FilledMission<'a> {
    mission: &'a Mission,
    problem: &'a Problem,
    manner: &'a Manner,
    start: Instant,
}

impl FilledMission<'_> {
    fn remaining(&self) -> Limits {
        Limits::none().with_time(self.manner.time_limit.saturating_sub(self.start.elapsed()))
    }

    /// Computes a plan with overlapping actions, or a proof that no plan exists. Returns `None` if
    /// neither is found in time or the task has unsupported features.
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

    /// Computes the best sequential plan within the limits, and alternatives of the same cost. A task whose
    /// numbers exceed the range of the SAT encoding gets no alternatives.
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
        let max_alternatives = self.manner.alternatives;
        let same_cost = if max_alternatives > 0 {
            alternatives(&task, &solution, max_alternatives, &config)
        } else {
            None
        };
        solution.plan =
            solution.plan.map(|plan| self.confirmed(plan, &reading, &config.limits)).transpose()?;
        let other_plans = same_cost.into_iter().flat_map(|same_cost| same_cost.plans);
        let other_plans = other_plans
            .map(|plan| self.confirmed(plan, &reading, &config.limits))
            .collect::<Result<_, _>>()?;
        Ok((solution, other_plans))
    }

    fn exact(&self, config: &Config) -> Result<Solution, NoPlan> {
        let task =
            self.mission.ground_exact(self.problem, &[], &config.limits).map_err(NoPlan::Unsupported)?;
        let mut solution = optimize_exact(&task, config);
        let reading = Reading::sequential(task.is_timed());
        solution.plan =
            solution.plan.map(|plan| self.confirmed(plan, &reading, &config.limits)).transpose()?;
        Ok(solution)
    }

    /// Validates a plan by execution. Returns the plan with start times that show which actions
    /// follow each other.
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
            let config = Config::default().with_limits(self.remaining());
            let blocking = blocking(self.mission, self.problem, &config);
            let explanation = blocking.as_ref().map(ToString::to_string);
            text.extend(explanation.map(|explanation| format!("; {explanation}")));
        }
        NoPlan::None(text)
    }
}

pub(crate) fn check_domain(domain: &Source) -> Result<(), Errors> {
    let (tree, mut diagnostics) = pddl::parse_domain(domain);
    if let Some(tree) = &tree {
        diagnostics.extend(pddl::check_domain(tree, domain));
    }
    diagnostics.retain(|diagnostic| diagnostic.severity == pddl::Severity::Error);
    match tree {
        Some(_) if diagnostics.is_empty() => Ok(()),
        _ => Err(Message::from_pddl(&diagnostics, &[domain]).into()),
    }
}
