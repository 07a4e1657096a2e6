//! Finds concurrent plans of a PDDL task, with the least makespan or the best weighted sum of makespan and
//! costs. At a limit, the best known plan is returned, which need not be optimal.
//!
//! A plan must satisfy the semantics of [`validate`](pddl::validate). In addition, at any time each function
//! that running actions require has only one design, and each duration is 0 or at least the *separation*
//! (epsilon).
//!
//! `split` makes a start and an end of each durative action, `temporal_task` computes the constraints of each
//! happening, and `search` explores sequences of happenings with their `simple_temporal_network`.

mod action_invariants;
mod builder;
mod compression_safe;
mod conjunctions;
mod critical_path;
mod deadline;
mod duration_fluents;
mod envelope_facts;
mod exclusive_resources;
mod flexible_durations;
mod footprint;
mod goal_orders;
mod greedy;
mod happening;
mod interference;
mod interleave;
mod makespan_heuristic;
mod measure;
mod monotone_metric;
mod plan_metric;
mod relaxed_plan_heuristic;
mod relevant_effects;
mod rule;
mod schedule;
mod search;
mod search_log;
mod self_overlap;
mod sequential_first;
mod simple_temporal_network;
mod solution;
mod source_task;
mod split;
mod store;
mod strict_comparisons;
mod successors;
mod temporal_relaxation;
mod temporal_task;
mod time;
mod time_number;
mod timed_relaxed_plan;
mod unit;

use std::time::Instant;

use num_rational::BigRational;
use num_traits::Signed;
use tracing::info_span;

use ::search::bounds::Bounds;
use pddl::ast::{self, ActionBody, Comparison, Direction, Domain, Problem, Span};
use task::compile::{CompiledTask, PlanSemantics, compile as compile_away, is_hidden};
use task::context::Context;
use task::error::{Error, Errors, File, Place};
use task::ground::{Generality, GroundConfig, ground_lifted};
use task::lifted::{DurationChoice, Expression, Lifted, Metric, Rational, Schema};
use task::limits::Limits;
use task::normalize::{normalize, normalize_freely, undefined_fluents};
use task::number::Int;
use task::plan::solution::{Improvement, Proof, Solution, Status};

pub use temporal_task::ConcurrentTask;

use deadline::Deadline;
use interleave::interleave_searches;
use search::SearchEnd;
use search_log::Record;
use solution::{ended, in_names};
use source_task::SourceTask;
use temporal_task::{Scale, TemporalTask, Width};
use time_number::TimeNumber;

/// If durations are chosen, a strict comparison requires a difference of at least 1 / `PRECISION`.
const PRECISION: Int = 1_000_000;

/// Grounds a domain and a problem that have passed `pddl::check`, for plans with overlapping
/// actions. Interfering happenings are at least `separation` apart, in the domain's time unit.
///
/// # Errors
/// Fails, for example, if a construct is unsupported (with its place), `separation` is not positive, a number of
/// the metric has no initial value, a number overflows, or a limit is reached.
pub fn ground_concurrent(
    domain: &Domain,
    problem: &Problem,
    config: &GroundConfig,
    separation: &BigRational,
) -> Result<ConcurrentTask, Errors> {
    let overflow = || vec![Error::overflow("the separation")];
    if !separation.is_positive() {
        return Err(overflow().into());
    }
    let separation = Rational::from_big(separation.clone());
    let semantics = PlanSemantics::Overlapping(&separation.to_big());
    let GroundConfig { objectives, limits, .. } = config;
    let plain =
        info_span!("compile").in_scope(|| compile_away(domain, problem, objectives, semantics, limits))?;
    let source = SourceTask::new(domain, problem, config);
    let config = config.clone().with_objectives(plain.objectives.to_vec());
    let has_deadlines = !plain.deadlines.is_empty();
    let task = ground_plain((&plain.domain, &plain.problem, &config, &separation), has_deadlines)?;
    Ok(ConcurrentTask(match task.0 {
        Width::Narrow(task) => Width::Narrow(Box::new(task.completed(&plain, source.as_ref()))),
        Width::Wide(task) => Width::Wide(Box::new(task.completed(&plain, source.as_ref()))),
    }))
}

impl<T: TimeNumber> TemporalTask<T> {
    /// Adds the source files, the deadlines, and the exactness of the compilation of trajectory
    /// constraints.
    fn completed(mut self, plain: &CompiledTask<'_>, source: Option<&SourceTask>) -> Self {
        let shortest = self.shortest.take().map(|shortest| {
            let shortest = shortest.judged_by(plain);
            Box::new(Self { kept: source.cloned(), ..shortest })
        });
        Self { shortest, kept: source.cloned(), ..self.judged_by(plain) }
    }

    fn judged_by(self, plain: &CompiledTask<'_>) -> Self {
        Self {
            deadlines: plain
                .deadlines
                .iter()
                .map(|constraint| Deadline::new(&self.task, constraint, self.unit))
                .collect(),
            is_exact: self.is_exact && plain.is_exact,
            is_bounded: self.is_bounded && plain.is_exact,
            ..self
        }
    }
}

/// Grounds a task whose trajectory constraints were compiled away. If the planner can choose
/// durations, `shortest` holds the variant with the shortest durations, if it can be grounded. With
/// hidden actions (compiled constraints), or if chosen durations are not supported, only the
/// shortest durations are possible.
fn ground_plain(files: Files<'_>, has_deadlines: bool) -> Result<ConcurrentTask, Errors> {
    let shortest = ground_with(files, &normalize);
    let is_judged = files.0.actions.iter().any(|action| is_hidden(action.identifier.name.as_str()));
    if shortest.is_ok() && (is_fixed(files.0) || is_judged) {
        return shortest;
    }
    match (ground_with(files, &normalize_freely), shortest) {
        // The search for chosen durations does not count violated preferences and deadlines.
        (Ok(ConcurrentTask(Width::Narrow(mut free))), shortest)
            if free.violations.is_empty() && !has_deadlines =>
        {
            free.is_exact = free.is_exact && flexible_durations::is_exact(&free);
            free.repairs_over_all = flexible_durations::may_repair_over_all(&free);
            free.shortest = match shortest {
                Ok(ConcurrentTask(Width::Narrow(shortest))) => Some(shortest),
                _ => None,
            };
            Ok(ConcurrentTask(Width::Narrow(free)))
        }
        (Ok(ConcurrentTask(Width::Narrow(_))), Err(_)) => Err(uncounted_preferences(files.1)),
        // Linear programs for chosen durations support narrow numbers only, and no preferences or deadlines.
        (Ok(_), shortest) => shortest,
        (Err(_), Ok(shortest)) => Ok(shortest),
        (Err(errors), Err(_)) => Err(errors),
    }
}

fn uncounted_preferences(problem: &Problem) -> Errors {
    let span = problem.metric.as_ref().map_or_else(Span::default, |metric| metric.span);
    vec![Error::Unsupported {
        construct: "preferences or `always-within` together with effects that depend on a duration that the planner chooses"
            .into(),
        instead: "durations that are fixed".into(),
        place: Place { file: File::Problem, span },
    }]
    .into()
}

type Files<'f> = (&'f Domain, &'f Problem, &'f GroundConfig, &'f Rational);

type Normalize = dyn Fn(&Domain, &Problem, &[ast::Metric]) -> Result<Lifted, Errors>;

/// Grounds a task. If a value is missing because a fluent has no initial value, grounds the task again with
/// guards (atoms that state that a fluent has a value).
fn ground_with(
    (domain, problem, config, separation): Files<'_>,
    normalize: &Normalize,
) -> Result<ConcurrentTask, Errors> {
    let lifted = || normalize(domain, problem, &config.objectives);
    let ground = |lifted| -> Result<ConcurrentTask, Errors> {
        let task = ground_normal((domain, problem), lifted, config, separation)?;
        match &task.0 {
            Width::Narrow(narrow) if narrow.chooses_durations() => flexible_durations::check(narrow)?,
            Width::Wide(wide) if wide.chooses_durations() => {
                return Err(vec![Error::overflow("chosen durations")].into());
            }
            _ => {}
        }
        Ok(task)
    };
    match ground(lifted()?) {
        Err(errors) if errors.iter().any(Error::is_value_missing) => {
            let mut lifted = lifted()?;
            undefined_fluents::guard(&mut lifted);
            ground(lifted)
        }
        result => result,
    }
}

fn ground_normal(
    (domain, problem): (&Domain, &Problem),
    mut lifted: Lifted,
    config: &GroundConfig,
    separation: &Rational,
) -> Result<ConcurrentTask, Errors> {
    let place = Place { file: File::Problem, span: Span::default() };
    let number = |number| Expression::Number(Rational::from_integer(number));
    let (weight, metric) = match lifted.metrics.first() {
        Some(metric) => measure::split(metric)?,
        None => (
            Rational::from_integer(1),
            Metric { direction: Direction::Minimize, expression: number(0), place },
        ),
    };
    lifted.metrics = vec![metric];
    let is_strict = strict_comparisons::compares_strictly(&lifted);
    let has_all_durations = has_all_durations((domain, problem), &lifted);
    let mut split = split::split(lifted, &config.solves);
    // With chosen durations, strict comparisons require a minimal difference.
    let is_chosen = split.chosen.contains(&true);
    split.is_exact = if is_chosen { !is_strict } else { is_fixed(domain) };
    split.is_bounded = if is_chosen { !is_strict } else { has_all_durations };
    let no_atoms = vec![Vec::new(); split.designs.len()];
    let (lifted, designs) = (&split.lifted, &split.designs);
    let precision = (is_chosen && is_strict).then_some(PRECISION);
    let generality = Generality {
        measures_ends: true,
        measures_rewards: true,
        omits_durations: true,
        precision,
        ..Generality::default()
    };
    let (task, reached) = ground_lifted(lifted, designs, &no_atoms, &generality, &config.limits)?;
    let _span = info_span!("happenings", operators = task.operators.len()).entered();
    let scale = Scale { separation, time_weight: &weight };
    temporal_task::compile(task, &split, &reached, &scale, &config.limits)
}

/// Returns `true` if the duration of every action is fixed, by an equality or by two equal bounds that are
/// numbers.
fn is_fixed(domain: &Domain) -> bool {
    domain.actions.iter().all(has_fixed_duration)
}

fn has_fixed_duration(action: &ast::Action) -> bool {
    let number = |constraint: &ast::DurationConstraint| match &constraint.expression {
        ast::Expression::Number(number, _) => Some(number.clone()),
        _ => None,
    };
    match &action.body {
        ActionBody::Durative { duration, .. } => match &duration[..] {
            [only] => only.operator == Comparison::Equal,
            [first, second] => {
                let bounds = [first.operator, second.operator];
                let equality = [Comparison::GreaterOrEqual, Comparison::LessOrEqual];
                equality.iter().all(|bound| bounds.contains(bound))
                    && number(first).is_some_and(|value| number(second) == Some(value))
            }
            _ => false,
        },
        ActionBody::Instantaneous { .. } => true,
    }
}

/// Returns `true` if the minimal durations of a normalised task admit the lower bounds of every plan: each duration
/// is fixed, or variable with a positive minimum. The happenings of a minimum of 0 do not relax those of longer
/// durations, because start and end are then one happening.
fn has_all_durations((domain, problem): (&Domain, &Problem), lifted: &Lifted) -> bool {
    let has_positive_minimum = |schema: &Schema| {
        let duration = schema.duration.as_ref();
        matches!(schema.choice, DurationChoice::Shortest)
            && duration.is_some_and(|duration| is_positive((problem, lifted), duration))
    };
    lifted.schemas.iter().all(|schema| {
        let action = domain.actions.get(schema.action as usize);
        action.is_some_and(has_fixed_duration) || has_positive_minimum(schema)
    })
}

/// Returns `true` if an expression is certainly positive in every state.
fn is_positive(task: (&Problem, &Lifted), expression: &Expression) -> bool {
    let all = |parts: &[Expression]| !parts.is_empty() && parts.iter().all(|part| is_positive(task, part));
    let (problem, lifted) = task;
    match expression {
        Expression::Number(number) => number.is_positive(),
        Expression::Function(function, ..) => {
            let function = &lifted.functions[function.index()];
            !function.fluent && problem.initial_values(&function.name).iter().all(Signed::is_positive)
        }
        Expression::Sum(parts) | Expression::Product(parts, _) => all(parts),
        Expression::Quotient(left, right, _) => is_positive(task, left) && is_positive(task, right),
        Expression::Negate(_) | Expression::TotalTime => false,
    }
}

/// Searches for an optimal plan with overlapping actions, until optimality is proved, no search can
/// continue, or a limit is reached. If the exact search proves optimality and no duration is
/// chosen, the plan has the least makespan among the optimal plans. Calls `report` for every better
/// plan, unless only a part of the metric is minimised.
pub fn optimize_concurrent(
    concurrent: &ConcurrentTask,
    limits: &Limits,
    report: &mut dyn FnMut(Improvement),
) -> Solution {
    match &concurrent.0 {
        Width::Narrow(task) if task.chooses_durations() && task.task.unreachable.is_none() => {
            let record = Record::new(task, Instant::now(), report);
            flexible_durations::optimize(task, limits, record)
        }
        Width::Narrow(task) => optimize_fixed(task, limits, report),
        Width::Wide(task) => optimize_fixed(task, limits, report),
    }
}

fn optimize_fixed<T: TimeNumber>(
    concurrent: &TemporalTask<T>,
    limits: &Limits,
    report: &mut dyn FnMut(Improvement),
) -> Solution {
    let task = &concurrent.task;
    let mut record = Record::new(concurrent, Instant::now(), report);
    if let Some(reason) = &task.unreachable {
        // Without all plans, the relaxation proves nothing.
        return if concurrent.is_bounded {
            ended(Status::Unsolvable, Some(Proof::Relaxation(reason.clone())), record)
        } else {
            ended(Status::Unknown, None, record)
        };
    }
    let costs = task.operators.iter().any(|operator| operator.cost.constant > 0);
    let bounds = (costs || !task.initial.numbers.is_empty())
        .then(|| Bounds::new(Context::new(task, limits)).ok())
        .flatten();
    let span = info_span!("optimize", operators = task.operators.len());
    let (search_end, incumbent) =
        span.in_scope(|| interleave_searches(concurrent, bounds.as_ref(), limits, &mut record, usize::MAX));
    let plan = incumbent.as_ref().map(|sequence| in_names(concurrent, sequence));
    let (status, lower) = match (&search_end, &incumbent) {
        (SearchEnd::Exhausted, Some(incumbent)) => (Status::Optimal, Some(incumbent.value.0)),
        (SearchEnd::Exhausted, None) => (Status::Unsolvable, None),
        (SearchEnd::Stopped(lower), Some(incumbent)) => {
            (Status::Feasible, Some(*lower.min(&incumbent.value.0)))
        }
        (SearchEnd::Stopped(lower), None) => (Status::Unknown, Some(*lower)),
    };
    let metric = |total: T| concurrent.measure.metric(&total.to_rational());
    let proved = || if concurrent.is_exact { Proof::Search } else { Proof::Bound };
    let proof = matches!(search_end, SearchEnd::Exhausted).then(proved);
    let steps = plan.as_ref().filter(|_| proof.is_some()).map_or(0, |plan| plan.steps.len());
    Solution {
        horizon: steps,
        plan,
        lower_bound: lower.filter(|_| concurrent.is_whole).map(metric),
        ..ended(status, proof, record)
    }
}
