//! The command `metaplan export`, which writes a mission in PDDL, PRISM or JANI for other tools.

use std::path::{Path, PathBuf};

use crate::answers::{MissionExport, ModelExport};
use crate::comparison::{Coadaptation, Risk, Roles, Tasked, program, published_program};
use crate::message::{Errors, Message};
use crate::mission::Mission;
use crate::setup::Setup;
use crate::visible::visible_json;
use clap::{Args, ValueEnum};
use pddl::ast::Problem;
use pddl::{portable, print_domain, print_problem};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::limits::TimeLimit;
use crate::cli::output;
use crate::cli::progress::during;
use crate::cli::situation::Situation;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem.
    #[arg(required = true, num_args = 1..=2, value_name = "MISSION | DOMAIN PROBLEM")]
    inputs: Vec<PathBuf>,
    /// Output format.
    #[arg(long = "to", value_enum, value_name = "FORMAT")]
    target: Language,
    /// With `--to prism` or `--to jani`: variant of the probabilistic approach to export. Default: `corrected`.
    #[arg(long, value_enum)]
    setting: Option<Setting>,
    #[command(flatten)]
    situation: Situation,
    #[command(flatten)]
    time: TimeLimit,
    /// Directory for `domain.pddl` and `problem.pddl`, created if it does not exist, or output file for
    /// a model; with `--format json`, the file contains the JSON answer. Default: standard output.
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Format of the exported mission.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Language {
    /// Domain and problem for other planners, with availability and values from the knowledge base.
    Pddl,
    /// The co-adaptation process in the PRISM language, for PRISM and Storm.
    Prism,
    /// The co-adaptation process in JANI.
    Jani,
}

/// Variant of an exported model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Setting {
    /// All routes, reconfiguration in every place, collisions are part of the state, and the battery limits moves.
    Corrected,
    /// The five shortest routes, one reconfiguration before the first move, collision decided by the
    /// last risky move, and no limit by the battery.
    Published,
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let _guard = arguments.time.guard(common)?;
    if matches!(arguments.target, Language::Pddl) && arguments.setting.is_some() {
        let text = "`--setting` selects a variant of the probabilistic model, which `--to pddl` does not export; \
                    omit it, or use `--to prism` or `--to jani`";
        return Err(Failure::usage(Message::error("M107", text)));
    }
    let Setup { mission, roles, .. } = arguments.situation.setup(&arguments.inputs, common)?;
    let (problem, warnings) = mission.filled()?;
    output::warnings(common, mission.warnings().chain(&warnings));
    if !matches!(arguments.target, Language::Pddl) {
        return process(arguments, common, &mission, &problem, &roles);
    }
    let (domain, problem) = portable(mission.domain(), &problem);
    let (domain, problem) = (print_domain(&domain), print_problem(&problem));
    match output::file_named(arguments.output.as_ref()) {
        Some(directory) => {
            let files = [(directory.join("domain.pddl"), domain), (directory.join("problem.pddl"), problem)];
            let is_source = |path: &Path| {
                let sources = [mission.domain_source(), mission.problem_source()];
                sources.iter().any(|source| is_same(Path::new(source.name()), path))
            };
            let sources = files.iter().map(|(path, _)| path).filter(|path| is_source(path));
            Errors::unless_empty(sources.map(|path| output::exists(path)))?;
            output::make_directory(directory)?;
            for (path, text) in &files {
                output::write_file(path, text)?;
            }
        }
        None if common.format == Format::Json => {
            output::json_answer(&MissionExport::new(domain, problem));
        }
        None => output::document(&format!("{domain}\n{problem}")),
    }
    Ok(Exit::Done)
}

/// Returns `true` if both paths name the same existing file.
fn is_same(first: &Path, second: &Path) -> bool {
    first.canonicalize().is_ok_and(|first| second.canonicalize().is_ok_and(|second| first == second))
}

fn process(
    arguments: &Arguments,
    common: &Common,
    mission: &Mission,
    problem: &Problem,
    roles: &Roles,
) -> Result<Exit, Failure> {
    let coadaptation = during("exploring", common, || {
        if Coadaptation::is_spelt_out(problem, roles) {
            Coadaptation::new(mission, problem, roles)
        } else {
            Tasked::new(mission, problem, roles).map(|tasked| tasked.coadaptation)
        }
    })?;
    let model = match arguments.setting {
        None | Some(Setting::Corrected) => program(&coadaptation, Risk::all(&coadaptation)),
        Some(Setting::Published) => published_program(&coadaptation),
    };
    let text = match arguments.target {
        Language::Jani => match probabilistic::jani::write(&mission.name, &model) {
            // Indentation would triple the size of a file that only programs read.
            Ok(json) => format!("{json}\n"),
            Err(error) => {
                let message =
                    |problem: &probabilistic::Diagnostic| Message::error(problem.code, &problem.message);
                return Err(error.diagnostics().iter().map(message).collect::<Vec<_>>().into());
            }
        },
        _ => probabilistic::prism::write(&model),
    };
    let text = match common.format {
        Format::Json => visible_json(&output::pretty(&ModelExport::new(text))).into_owned(),
        _ => text,
    };
    match output::file_named(arguments.output.as_ref()) {
        Some(file) => output::write_file(file, &text)?,
        None => output::document(&text),
    }
    Ok(Exit::Done)
}
