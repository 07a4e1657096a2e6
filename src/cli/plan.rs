//! `metaplan plan`.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use encodings::{
    Alternatives, Backend, Config, Front, Improvement, Limits, Plan, Point, Semantics, Solution, Status, Task,
};
use metaplan::answers::{PlanAnswer, Preparation};
use metaplan::certificate::{self, Ground};
use metaplan::message::Message;
use metaplan::mission::{Blocking, Mission, Planning as _, Reading, blocking, btcpp_text, spaced};
use metaplan::report::{Positions, Seen, front_sheet};
use metaplan::visible::visible;
use pddl::ast::Problem;

use crate::cli::alternatives;
use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::concurrent::{self, Overlap};
use crate::cli::confirm::fault;
use crate::cli::drawn::Drawing;
use crate::cli::limits::Guard;
use crate::cli::objectives::Objectives;
use crate::cli::output;
use crate::cli::plan_answer::answer_text;
use crate::cli::plan_exact;
use crate::cli::plan_text::{PlanFormat, plan_text};
use crate::cli::progress::Progress;
use crate::cli::situation::Situation;
use crate::cli::values::seconds;

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem; `-` is standard input.
    #[arg(required = true, num_args = 1..=2, value_name = "MISSION | DOMAIN PROBLEM")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    /// Only plans with at most this many steps.
    #[arg(long, value_name = "N", allow_negative_numbers = true, conflicts_with = "concurrent")]
    horizon: Option<usize>,
    /// Stop after this many seconds with the best plan so far.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
    /// Stop when the program takes more than this much memory, in megabytes, with the best plan so far.
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    memory_limit: Option<u64>,
    /// What finds plans, and proves that there is none better: search and then the SAT solver, or one of them alone.
    #[arg(long, value_enum, default_value_t, conflicts_with = "concurrent")]
    engine: EngineName,
    /// Have the SAT solver confirm what is proved without it, however long that takes.
    #[arg(long, conflicts_with = "concurrent")]
    confirm: bool,
    /// The SAT solver: `varisat`, `batsat`, or a program with its arguments that reads DIMACS on its standard input.
    #[arg(long, value_name = "NAME", default_value = Backend::BUILT_IN[0], conflicts_with = "concurrent")]
    solver: Backend,
    /// How the SAT solver finds a cheapest plan: cheaper and cheaper plans until there is none, or a lower bound that rises until a
    /// plan costs as much. The cost of the answer is the same.
    #[arg(long, value_enum, default_value_t, conflicts_with = "concurrent")]
    strategy: StrategyName,
    /// How many actions stand at one step of the SAT solver's formulas; if not given, several while a first plan is looked
    /// for, and one from then on. The answer is the same.
    #[arg(long, value_enum, conflicts_with = "concurrent")]
    encoding: Option<Encoding>,
    /// What to minimize in place of the problem's metric: an expression as in a metric, or a function's name. Repeated,
    /// earlier objectives come first, and later ones decide among plans that are equal by them.
    #[arg(long, value_name = "EXPRESSION", allow_hyphen_values = true)]
    minimize: Vec<String>,
    /// All plans that are best by one of two objectives without being worse by the other.
    #[arg(long, value_name = "EXPRESSION,EXPRESSION", conflicts_with_all = ["minimize", "plan_format", "concurrent"])]
    pareto: Option<String>,
    /// Write all that is needed to check that the answer is optimal, or that there is no plan, into a new directory;
    /// `metaplan verify` checks it.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["pareto", "concurrent"])]
    certificate: Option<PathBuf>,
    /// Up to so many further plans that are as good as the best one, and which choices all such plans share.
    #[arg(long, value_name = "N", conflicts_with_all = ["minimize", "pareto", "plan_format", "concurrent"])]
    alternatives: Option<usize>,
    #[command(flatten)]
    overlap: Overlap,
    /// Only the plan, in a format that other tools read.
    #[arg(long, value_enum)]
    plan_format: Option<PlanFormat>,
    #[command(flatten)]
    drawing: Drawing,
    /// Write the front as a page to look at, too, whose points unfold to plans.
    #[arg(long, value_name = "FILE", requires = "pareto")]
    report: Option<PathBuf>,
    /// Write the answer to a file.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Encoding {
    /// One.
    Sequential,
    /// Several that can be executed in any order.
    ForAllStep,
    /// Several that can be executed in at least one order.
    ExistsStep,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum StrategyName {
    /// The one that is faster in general.
    #[default]
    Auto,
    /// Cheaper and cheaper plans.
    Tighten,
    /// A rising lower bound.
    Cores,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum EngineName {
    /// Search, then the SAT solver.
    #[default]
    Auto,
    /// The SAT solver.
    Sat,
    /// Search.
    Search,
}

impl From<EngineName> for encodings::Engine {
    fn from(engine: EngineName) -> Self {
        match engine {
            EngineName::Auto => Self::Auto,
            EngineName::Sat => Self::Sat,
            EngineName::Search => Self::Search,
        }
    }
}

impl From<StrategyName> for encodings::Strategy {
    fn from(strategy: StrategyName) -> Self {
        match strategy {
            StrategyName::Auto => Self::Auto,
            StrategyName::Tighten => Self::Tighten,
            StrategyName::Cores => Self::Cores,
        }
    }
}

impl From<Encoding> for Semantics {
    fn from(encoding: Encoding) -> Self {
        match encoding {
            Encoding::Sequential => Self::Sequential,
            Encoding::ForAllStep => Self::ForAllStep,
            Encoding::ExistsStep => Self::ExistsStep,
        }
    }
}

/// What the user asks of the optimizer.
fn configuration(arguments: &Arguments, limits: Limits) -> Config {
    Config::default()
        .with_horizon(arguments.horizon)
        .with_engine(arguments.engine.into())
        .with_confirmation(arguments.confirm)
        .with_semantics(arguments.encoding.map(Semantics::from))
        .with_strategy(arguments.strategy.into())
        .with_backend(arguments.solver.clone())
        .with_limits(limits)
}

impl Arguments {
    /// Whether one plan is not all that the user wants.
    fn asks_for_more(&self) -> bool {
        self.pareto.is_some() || self.alternatives.is_some()
    }

    /// Refuses what no parser of options sees.
    fn check(&self) -> Result<(), Failure> {
        let usage = |code: &str, text: String| Failure::usage(Message::error(code, text));
        self.solver.check().map_err(|error| usage("M113", error.to_string()))?;
        if self.plan_format == Some(PlanFormat::Btcpp) && self.overlap.separation().is_some() {
            let text =
                "`--plan-format btcpp` writes a sequence of actions, and with `--concurrent` they overlap";
            return Err(usage("M107", text.to_owned()));
        }
        Ok(())
    }

    /// Whether people read the answer where it is.
    fn is_text(&self, common: &Common) -> bool {
        self.plan_format.is_none() && self.output.is_none() && common.format == Format::Text
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let started = Instant::now();
    let guard = Guard::new(arguments.time_limit, arguments.memory_limit, common)?;
    arguments.check()?;

    let setup = arguments.situation.setup(&arguments.inputs)?;
    let is_drawn = arguments.report.is_some() || arguments.drawing.is_file_wanted();
    let positions = if is_drawn { setup.positions()? } else { Positions::Unknown };
    let mission = setup.mission;
    let (problem, warnings) = mission.filled()?;
    output::warnings(common, mission.warnings().chain(&warnings));
    let limits = guard.plan();
    let read = started.elapsed();
    let objectives = Objectives::read(&mission, &problem, &arguments.minimize, arguments.pareto.as_deref())?;
    let progress = Progress::new("planning", common);
    let mut report = |improvement: Improvement| {
        progress.set_message(format!(
            "cost {}, lower bound {}, gap {:.1} %, up to {} steps",
            improvement.cost,
            improvement.lower_bound,
            100.0 * improvement.gap(),
            improvement.horizon
        ));
    };
    if let Some(separation) = arguments.overlap.separation() {
        if objectives.metrics.len() > 1 {
            let text = "`--concurrent` takes one objective; add several with weights";
            return Err(Failure::usage(Message::error("M107", text)));
        }
        let point = concurrent::solve(&mission, &problem, &objectives, separation, &limits, &mut report)?;
        progress.finish();
        let ground = started.elapsed().saturating_sub(read + point.solution.statistics.search);
        let preparation = Preparation { read, ground };
        let reading = Reading::concurrent(separation);
        objectives.confirm(&mission, &problem, &point, &reading)?;
        let subject = (&mission, &problem, &reading);
        return finish(point, &Beside::default(), subject, &objectives, &preparation, (arguments, common));
    }
    let config = configuration(arguments, limits);
    let failed = |messages| {
        let exit = if config.limits.reached() { Exit::NothingFound } else { Exit::BadInput };
        Failure { exit, messages }
    };
    let ground = mission.ground(&problem, &objectives.metrics, &config.limits);
    let preparation = Preparation { read, ground: started.elapsed().saturating_sub(read) };
    let task = match ground {
        Ok(task) => task,
        Err(refused) if plan_exact::is_too_large(&refused) && !arguments.asks_for_more() => {
            let found = plan_exact::solve(&mission, &problem, &objectives, &config, refused.clone());
            progress.finish();
            let (task, point, reading) = found.map_err(failed)?;
            objectives.confirm(&mission, &problem, &point, &reading)?;
            if common.verbose {
                plan_exact::explain(&refused);
            }
            let subject = (&mission, &problem, Ground::Exact(&task));
            let certified = certify(arguments, subject, &objectives, &point.solution, &config.limits);
            let beside = Beside::default();
            let subject = (&mission, &problem, &reading);
            let exit = finish(point, &beside, subject, &objectives, &preparation, (arguments, common))?;
            return Ok(certified_or(certified, exit, common));
        }
        Err(messages) => return Err(failed(messages)),
    };
    if arguments.pareto.is_some() {
        let front = encodings::pareto(&task, &config, &mut report);
        progress.finish();
        let seen = Seen { mission: &mission, problem: &problem, positions: &positions };
        return show_front(front, (seen, &task), &objectives, &preparation, (arguments, common));
    }
    let point = encodings::lexicographic(&task, &config, &mut report);
    progress.finish();
    if let Some(reason) = &point.solution.statistics.contradiction {
        return Err(fault(reason));
    }
    let reading = Reading::sequential(task.is_timed());
    objectives.confirm(&mission, &problem, &point, &reading)?;
    let subject = (&mission, &problem, Ground::Integers(&task));
    let certified = certify(arguments, subject, &objectives, &point.solution, &config.limits);
    if let Some(reason) = &point.solution.statistics.failure {
        let text = format!("the SAT solver gave up: {reason}");
        output::warnings(common, &[Message::warning("M114", text)]);
    }
    let others = match arguments.alternatives {
        Some(most) => alternatives::find(&mission, &problem, &task, &point.solution, most, &config)?,
        None => None,
    };
    let blocking = match point.solution.status {
        Status::Unsolvable => blocking(&mission, &problem, &config),
        _ => None,
    };
    let beside = Beside { others, blocking };
    let subject = (&mission, &problem, &reading);
    let exit = finish(point, &beside, subject, &objectives, &preparation, (arguments, common))?;
    Ok(certified_or(certified, exit, common))
}

/// How the program ends: the plan is there, but what was asked for besides may not be.
fn certified_or(certified: Result<(), Message>, exit: Exit, common: &Common) -> Exit {
    match certified {
        Ok(()) => exit,
        Err(message) => {
            output::warnings(common, [&message]);
            Exit::BadInput
        }
    }
}

/// Shows the answer, or writes it to a file.
fn finish(
    mut point: Point,
    beside: &Beside,
    (mission, problem, reading): (&Mission, &Problem, &Reading),
    objectives: &Objectives,
    preparation: &Preparation,
    (arguments, common): (&Arguments, &Common),
) -> Result<Exit, Failure> {
    if arguments.plan_format == Some(PlanFormat::Plansys2) {
        point.solution.plan = point.solution.plan.take().map(|plan| spaced(mission, problem, plan, reading));
    }
    let drawn = arguments.drawing.draw(mission, &point.solution, arguments.is_text(common))?;
    // What `validate` executes has the designs, what the user's own domain has no place for them has not.
    if arguments.plan_format != Some(PlanFormat::Ipc) {
        point.solution.plan = point.solution.plan.take().map(|plan| mission.written(plan));
    }
    let status = point.solution.status;
    match (show(&point, beside, mission, objectives, preparation, (arguments, common)), &arguments.output) {
        (Some(text), Some(file)) => {
            output::write_file(file, &text)?;
            output::note(&format!("{}\n", point.solution.verdict()));
        }
        (Some(text), None) => output::answer(&(drawn + &text)),
        // There is nothing to write, and readers of plans would stumble over anything else.
        (None, _) => output::note(&format!("{}\n", point.solution.verdict())),
    }
    Ok(exit(status))
}

/// What is known besides the plan.
#[derive(Default)]
struct Beside {
    others: Option<Alternatives>,
    blocking: Option<Blocking>,
}

/// The answer in the form that the user asks for; none if that is a plan, and there is none.
fn show(
    point: &Point,
    beside: &Beside,
    mission: &Mission,
    objectives: &Objectives,
    preparation: &Preparation,
    (arguments, common): (&Arguments, &Common),
) -> Option<String> {
    let (solution, name) = (&point.solution, mission.name.as_str());
    match (arguments.plan_format, common.format) {
        (Some(PlanFormat::Json), _) | (None, Format::Json) => {
            let overlaps = arguments.overlap.separation().and(solution.plan.as_ref());
            let answer = PlanAnswer::new(name, solution, preparation)
                .with_objectives(objectives.values(point))
                .with_alternatives(beside.others.as_ref())
                .with_makespan(overlaps.map(Plan::makespan).as_ref())
                .with_blocking(beside.blocking.as_ref());
            Some(output::pretty(&answer))
        }
        (None, _) => {
            let plan = answer_text(name, solution, common.verbose, preparation);
            let others = beside.others.as_ref().map(|others| alternatives::text(others, solution));
            let blocking = beside.blocking.as_ref().map(|blocking| format!("{blocking}\n"));
            let overlaps = arguments.overlap.separation().and(solution.plan.as_ref());
            let makespan = concurrent::makespan_text(overlaps);
            Some(plan + &objectives.values_text(point) + &makespan + &others.or(blocking).unwrap_or_default())
        }
        (Some(PlanFormat::Btcpp), _) => solution.plan.as_ref().map(|plan| btcpp_text(mission, plan)),
        (Some(format), _) => solution.plan.as_ref().map(|plan| plan_text(plan, format)),
    }
}

/// Writes why nothing is better than the solution, if that is asked for.
fn certify(
    arguments: &Arguments,
    (mission, problem, task): (&Mission, &Problem, Ground<'_>),
    objectives: &Objectives,
    solution: &Solution,
    limits: &Limits,
) -> Result<(), Message> {
    let Some(directory) = &arguments.certificate else { return Ok(()) };
    let plan = solution.plan.as_ref().map_or_else(String::new, |plan| plan_text(plan, PlanFormat::Ipc));
    let mut problem = problem.clone();
    if let [metric] = &objectives.metrics[..] {
        problem.metric = Some(metric.clone());
    }
    let certificate = certificate::Contents { mission, problem: &problem, task, solution, plan: &plan };
    certificate::write(directory, &certificate, limits)
}

/// Shows a Pareto front whose every plan the validator has executed.
fn show_front(
    mut front: Front,
    (seen, task): (Seen<'_>, &Task),
    objectives: &Objectives,
    preparation: &Preparation,
    (arguments, common): (&Arguments, &Common),
) -> Result<Exit, Failure> {
    let Seen { mission, problem, .. } = seen;
    for point in &front.points {
        objectives.confirm(mission, problem, point, &Reading::sequential(task.is_timed()))?;
    }
    if arguments.report.is_some() || arguments.drawing.is_file_wanted() {
        let sheet = front_sheet(seen, objectives.texts(), &front);
        arguments.drawing.draw_front(&sheet)?;
        if let Some(file) = &arguments.report {
            output::write_file(file, &visible(&sheet.html()))?;
        }
    }
    for point in &mut front.points {
        point.solution.plan = point.solution.plan.take().map(|plan| mission.written(plan));
    }
    let text = match common.format {
        Format::Json => output::pretty(&objectives.front_answer(&mission.name, &front, preparation)),
        _ => objectives.front_text(&mission.name, &front),
    };
    match &arguments.output {
        Some(file) => output::write_file(file, &text)?,
        None => output::answer(&text),
    }
    Ok(exit(front.status))
}

/// How the program ends with a solution of this status.
pub(super) fn exit(status: Status) -> Exit {
    match status {
        Status::Optimal => Exit::Done,
        Status::Feasible => Exit::NotProved,
        Status::Unsolvable => Exit::Unsolvable,
        Status::UnsolvableWithinHorizon => Exit::UnsolvableWithinHorizon,
        Status::Unknown => Exit::NothingFound,
    }
}
