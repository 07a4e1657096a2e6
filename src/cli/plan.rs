//! The command `metaplan plan`, which computes an optimal plan, a Pareto front or alternative plans of a mission.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::certificate::unrepeatable;
use crate::message::Message;
use crate::mission::numbers::MissingValue;
use crate::mission::{Mission, btcpp_text, first_wait, plan_lines, popf_text};
use crate::planner::{Planned, PlannedFront, Planner};
use crate::report::Positions;
use crate::visible::visible;
use clap::{Args, ValueEnum};
use planner::{Backend, Config, Limits, Solution, Status, StepSemantics};

use crate::cli::alternatives;
use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::concurrent::Overlap;
use crate::cli::drawn::Drawing;
use crate::cli::limits::Guard;
use crate::cli::objectives;
use crate::cli::output;
use crate::cli::plan_answer::{answer_text, statistics_text};
use crate::cli::plan_text::PlanFormat;
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
    /// Consider only plans with at most this many steps.
    #[arg(long, value_name = "N", allow_negative_numbers = true, conflicts_with = "concurrent")]
    horizon: Option<usize>,
    /// Stop after this many seconds with the best plan so far.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
    /// Stop with the best plan so far if the program uses more than this many megabytes of memory.
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    memory_limit: Option<u64>,
    /// Method to find plans and prove optimality: search followed by the SAT solver, or one of them alone.
    #[arg(long, value_enum, default_value_t, conflicts_with = "concurrent")]
    engine: EngineName,
    /// Confirm results of search with the SAT solver, even if this is slow.
    #[arg(long, conflicts_with = "concurrent")]
    confirm: bool,
    /// SAT solver: `varisat`, `batsat`, or a program with arguments that reads DIMACS from standard input.
    #[arg(long, value_name = "NAME", default_value = Backend::BUILT_IN[0], conflicts_with = "concurrent")]
    solver: Backend,
    /// Method to find an optimal plan with the SAT solver: search for cheaper plans until none exists,
    /// or raise the lower bound until a plan has this cost. It does not change the cost of the answer.
    #[arg(long, value_enum, default_value_t, conflicts_with = "concurrent")]
    strategy: StrategyName,
    /// Number of actions per step of the SAT formulas. Default: several until there is a first plan, then one. With
    /// `--horizon`, always one. It does not change the cost of the answer.
    #[arg(long, value_enum, conflicts_with = "concurrent")]
    encoding: Option<Encoding>,
    /// Minimise an expression or a function instead of the problem's metric. If the option is repeated,
    /// later objectives break ties of earlier ones.
    #[arg(long, value_name = "EXPRESSION", allow_hyphen_values = true)]
    minimize: Vec<String>,
    /// Return the Pareto front of two objectives.
    #[arg(long, value_name = "EXPRESSION,EXPRESSION", conflicts_with_all = ["minimize", "plan_format", "concurrent"])]
    pareto: Option<String>,
    /// Write a certificate of optimality, of the absence of plans, or of a complete Pareto front to a new directory.
    /// `metaplan verify` checks it.
    #[arg(long, value_name = "DIR", conflicts_with = "concurrent")]
    certificate: Option<PathBuf>,
    /// Return up to this many additional optimal plans, and the choices that all optimal plans share.
    #[arg(long, value_name = "N", conflicts_with_all = ["minimize", "pareto", "plan_format", "concurrent"])]
    alternatives: Option<usize>,
    #[command(flatten)]
    overlap: Overlap,
    /// Format of the plan. Default: `table` on standard output, `ipc` in a file.
    #[arg(long, value_enum)]
    plan_format: Option<PlanFormat>,
    #[command(flatten)]
    drawing: Drawing,
    /// Also write the front as an HTML page. Its points can be expanded to plans.
    #[arg(long, value_name = "FILE", requires = "pareto")]
    report: Option<PathBuf>,
    /// Write the plan to a file that `metaplan validate` and other tools can read. With `--format
    /// json`, `--pareto` or `--alternatives` the file contains the whole answer. `-` is standard
    /// output.
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Encoding {
    /// One action.
    Sequential,
    /// Several actions that can be executed in any order.
    ForAllStep,
    /// Several actions that can be executed in at least one order.
    ExistsStep,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum StrategyName {
    /// The strategy that is faster in general.
    #[default]
    Auto,
    /// Search for cheaper plans.
    Tighten,
    /// Raise the lower bound.
    Cores,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum EngineName {
    /// Search, followed by the SAT solver.
    #[default]
    Auto,
    /// SAT solver only.
    Sat,
    /// Search. With `--horizon` and for a metric without a best value, SAT formulas as well.
    Search,
}

impl From<EngineName> for planner::Engine {
    fn from(engine: EngineName) -> Self {
        match engine {
            EngineName::Auto => Self::Auto,
            EngineName::Sat => Self::Sat,
            EngineName::Search => Self::Search,
        }
    }
}

impl From<StrategyName> for planner::Strategy {
    fn from(strategy: StrategyName) -> Self {
        match strategy {
            StrategyName::Auto => Self::Auto,
            StrategyName::Tighten => Self::Tighten,
            StrategyName::Cores => Self::Cores,
        }
    }
}

impl From<Encoding> for StepSemantics {
    fn from(encoding: Encoding) -> Self {
        match encoding {
            Encoding::Sequential => Self::Sequential,
            Encoding::ForAllStep => Self::ForAllStep,
            Encoding::ExistsStep => Self::ExistsStep,
        }
    }
}

fn configuration(arguments: &Arguments, limits: Limits) -> Config {
    Config::default()
        .with_horizon(arguments.horizon)
        .with_engine(arguments.engine.into())
        .with_confirmation(arguments.confirm)
        .with_semantics(arguments.encoding.map(StepSemantics::from))
        .with_strategy(arguments.strategy.into())
        .with_backend(arguments.solver.clone())
        .with_limits(limits)
}

impl Arguments {
    fn check(&self) -> Result<(), Failure> {
        let usage = |code: &str, text: String| Failure::usage(Message::error(code, text));
        self.solver.check().map_err(|error| usage("M113", error.to_string()))?;
        if self.plan_format == Some(PlanFormat::Btcpp) && self.overlap.separation().is_some() {
            let text =
                "`--plan-format btcpp` writes a sequence of actions, and with `--concurrent` they overlap";
            return Err(usage("M107", text.to_owned()));
        }
        if self.confirm && self.engine == EngineName::Search {
            let text = "`--confirm` uses the SAT solver, and `--engine search` excludes it";
            return Err(usage("M107", text.to_owned()));
        }
        if self.minimize.len() > 1 && self.overlap.separation().is_some() {
            let text = "`--concurrent` takes one objective; add several with weights";
            return Err(usage("M107", text.to_owned()));
        }
        Ok(())
    }

    fn file(&self) -> Option<&Path> {
        output::file_named(self.output.as_ref())
    }

    fn form(&self, common: &Common) -> PlanFormat {
        match (self.plan_format, common.format) {
            (Some(format), _) => format,
            (None, Format::Json) => PlanFormat::Json,
            // No plan format can hold several plans.
            (None, _) if self.file().is_some() && self.alternatives.is_none() => PlanFormat::Ipc,
            (None, _) => PlanFormat::Table,
        }
    }

    fn columns(&self) -> Option<u16> {
        if self.file().is_some() { None } else { output::columns() }
    }

    fn is_text(&self, common: &Common) -> bool {
        self.plan_format.is_none() && self.file().is_none() && common.format == Format::Text
    }
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let started = Instant::now();
    let guard = Guard::new(arguments.time_limit, arguments.memory_limit, common)?;
    arguments.check()?;
    arguments.certificate.as_deref().map_or(Ok(()), output::require_new_directory)?;

    let setup = arguments.situation.setup(&arguments.inputs, common)?;
    let is_drawn = arguments.report.is_some() || arguments.drawing.is_file_wanted();
    let positions = if is_drawn { setup.positions()? } else { Positions::Unknown };
    let mission = setup.mission;
    let knowledge = mission.knowledge();
    if arguments.certificate.is_some() && knowledge.is_some_and(|base| !base.sources().are_repeatable()) {
        return Err(unrepeatable().into());
    }
    let planner = Planner::new(&mission)?;
    output::warnings(common, mission.warnings().chain(planner.warnings()));
    let limits = guard.plan();
    let read = started.elapsed();
    let progress = Progress::new("planning", common);
    let planner = planner
        .config(configuration(arguments, limits.clone()))
        .minimize(&arguments.minimize)
        .concurrent(arguments.overlap.separation().cloned())
        .alternatives(arguments.alternatives)
        .on_improvement(|improvement| {
            progress.set_message(format!(
                "cost {}, lower bound {}, gap {:.1} %, up to {} steps",
                improvement.cost,
                improvement.lower_bound,
                100.0 * improvement.gap(),
                improvement.horizon
            ));
            ControlFlow::Continue(())
        })
        .on_stage(|what| progress.set_message(what.to_owned()));
    if let Some(pair) = &arguments.pareto {
        let front = planner.pareto(two(pair)?);
        progress.finish();
        let mut front = front.map_err(|messages| Failure::planning(messages, &limits))?;
        front.preparation.read = read;
        show_front(&front, &mission.name, &positions, (arguments, common))?;
        return Ok(certified((arguments, common), exit(front.front.status), |directory| {
            front.certify(directory)
        }));
    }
    let front = planner.plan();
    progress.finish();
    let mut planned = front.map_err(|messages| Failure::planning(messages, &limits))?;
    planned.preparation.read = read;
    if common.verbose {
        for message in &planned.too_large {
            output::note(&format!("planned by search alone, in exact numbers: {}\n", message.message));
        }
    }
    if let Some(reason) = &planned.solution.statistics.failure {
        let text = format!("the SAT solver gave up: {reason}");
        output::warnings(common, &[Message::warning("M114", text)]);
    }
    let not_minimised = planned.not_minimised();
    if !not_minimised.is_empty() {
        let text = format!(
            "the metric was not minimised: actions change {} by amounts that depend on the state",
            not_minimised.join(" and ")
        );
        let help = "to exclude expensive plans, add an upper bound on the fluent to the goal";
        output::warnings(common, &[Message::warning("M119", text).with_help(help)]);
    }
    if arguments.plan_format == Some(PlanFormat::Btcpp)
        && let Some(step) = planned.written().as_ref().and_then(first_wait)
    {
        let text = format!(
            "`--plan-format btcpp` writes actions without their times, and the plan waits until {} for `{}`",
            step.start,
            step.call()
        );
        let help = "use `--plan-format ipc` or `json`, which include the times";
        return Err(Failure::usage(Message::error("M107", text).with_help(help)));
    }
    finish(&planned, &mission, (arguments, common))?;
    // The plan is shown before the certificate is written, which may take long.
    Ok(certified((arguments, common), exit(planned.solution.status), |directory| planned.certify(directory)))
}

fn certified(
    (arguments, common): (&Arguments, &Common),
    exit: Exit,
    certify: impl FnOnce(&Path) -> Result<(), Message>,
) -> Exit {
    match arguments.certificate.as_deref().map_or(Ok(()), certify) {
        Ok(()) => exit,
        // The answer is written, but the requested certificate is not.
        Err(message) => {
            output::warnings(common, [&message]);
            Exit::BadInput
        }
    }
}

fn two(pair: &str) -> Result<[&str; 2], Failure> {
    let parts: Vec<_> = pair.split(',').map(str::trim).collect();
    <[&str; 2]>::try_from(parts).map_err(|parts| {
        let text =
            format!("`--pareto {pair}` names {} objectives; it takes two, with a comma between", parts.len());
        Failure::usage(Message::error("M107", text))
    })
}

fn finish(
    planned: &Planned<'_>,
    mission: &Mission,
    (arguments, common): (&Arguments, &Common),
) -> Result<(), Failure> {
    let is_text = arguments.is_text(common);
    let drawn = arguments.drawing.draw(mission, &planned.solution, is_text)?;
    match (show(planned, mission, (arguments, common)), arguments.file()) {
        (Some(text), Some(file)) => {
            output::write_file(file, &text)?;
            output::note(&beside(planned, arguments, common));
        }
        (Some(text), None) => output::answer(&(drawn + &text)),
        // Programs that read plans accept only plans. So without a plan, nothing is written to the file or to
        // standard output.
        (None, _) => output::note(&beside(planned, arguments, common)),
    }
    Ok(())
}

/// Returns the text for standard error if the plan goes to a file or does not exist: the verdict, and the parts of the
/// answer that the plan's format lacks.
fn beside(planned: &Planned<'_>, arguments: &Arguments, common: &Common) -> String {
    let verdict = format!("{}\n", planned.solution.verdict());
    match arguments.form(common) {
        PlanFormat::Json | PlanFormat::Table => verdict,
        PlanFormat::Ipc | PlanFormat::Plansys2 | PlanFormat::Btcpp => {
            verdict + &further(planned, &planned.solution, (arguments, common))
        }
    }
}

fn further(planned: &Planned<'_>, solution: &Solution, (arguments, common): (&Arguments, &Common)) -> String {
    let statistics =
        if common.verbose { statistics_text(solution, &planned.preparation) } else { String::new() };
    let overlaps = solution.plan.as_ref().filter(|_| planned.overlaps());
    let makespan = overlaps.map_or_else(String::new, |plan| format!("makespan {}\n", plan.makespan()));
    let columns = arguments.columns();
    let alternatives_text = arguments.alternatives.and(solution.plan.as_ref());
    let alternatives_text =
        alternatives_text.map(|_| alternatives::text(planned.alternatives.as_ref(), planned, columns));
    let blocking = planned.blocking.as_ref().map(|blocking| format!("{blocking}\n"));
    let blocking = blocking.map(|text| text + &missing_text(&planned.missing_values));
    let values = objectives::values_text(planned.objectives(), &planned.values);
    let overlap = if planned.may_need_overlap() { NO_OVERLAP } else { "" };
    overlap.to_owned()
        + &statistics
        + &values
        + &makespan
        + &alternatives_text.or(blocking).unwrap_or_default()
}

fn show(
    planned: &Planned<'_>,
    mission: &Mission,
    (arguments, common): (&Arguments, &Common),
) -> Option<String> {
    match arguments.form(common) {
        PlanFormat::Json => Some(output::pretty(&planned.answer())),
        PlanFormat::Table => {
            let mut solution = planned.solution.clone();
            solution.plan = planned.written();
            let text = answer_text(&mission.name, &solution, arguments.columns());
            Some(text + &further(planned, &solution, (arguments, common)))
        }
        PlanFormat::Btcpp => planned.written().map(|plan| btcpp_text(mission, &plan)),
        PlanFormat::Plansys2 => planned.spaced().map(|plan| popf_text(&plan_lines(&plan))),
        // In this format, which `validate` reads, designs that the knowledge base has added are arguments. The other
        // formats for plans are for the domain as the user wrote it, so `written` and `spaced` omit these arguments.
        PlanFormat::Ipc => planned.ipc_text(),
    }
}

const MISSING_SHOWN: usize = 10;

const NO_OVERLAP: &str =
    "only sequences of actions were considered; with `--concurrent`, actions may overlap\n";

fn missing_text(missing: &[MissingValue]) -> String {
    let line = |value: &MissingValue| {
        let (function, actions, file) = (&value.function, value.needed_by.join(", "), &value.file);
        match &value.estimation {
            Some((design, attribute)) => {
                format!("    the estimation of {attribute} of {design}, for {actions}, in {file}\n")
            }
            None => format!("    {function}, for {actions}, in {file}\n"),
        }
    };
    let omitted = missing.len().saturating_sub(MISSING_SHOWN);
    let omitted = if omitted > 0 {
        format!("    and {omitted} more; `--format json` lists all\n")
    } else {
        String::new()
    };
    let lines: String = missing.iter().take(MISSING_SHOWN).map(line).chain([omitted]).collect();
    if lines.is_empty() {
        lines
    } else {
        format!("actions are impossible because numbers are missing:\n{lines}")
    }
}

fn show_front(
    front: &PlannedFront<'_>,
    name: &str,
    positions: &Positions,
    (arguments, common): (&Arguments, &Common),
) -> Result<(), Failure> {
    if arguments.report.is_some() || arguments.drawing.is_file_wanted() {
        let sheet = front.sheet(positions);
        arguments.drawing.draw_front(&sheet)?;
        if let Some(file) = &arguments.report {
            output::write_file(file, &visible(&sheet.html()))?;
        }
    }
    let text = match common.format {
        Format::Json => output::pretty(&front.answer()),
        _ => objectives::front_text(name, front.objectives(), &front.written(), arguments.columns()),
    };
    match arguments.file() {
        Some(file) => output::write_file(file, &text)?,
        None => output::answer(&text),
    }
    Ok(())
}

pub(super) fn exit(status: Status) -> Exit {
    match status {
        Status::Optimal => Exit::Done,
        Status::Feasible => Exit::NotProved,
        Status::Unsolvable => Exit::Unsolvable,
        Status::UnsolvableWithinHorizon => Exit::UnsolvableWithinHorizon,
        Status::Unknown => Exit::NothingFound,
    }
}
