//! Replacement of POPF for PlanSys2's plugin: `popf [ARGUMENTS] DOMAIN PROBLEM > plan`. The exit
//! status is always 0.
//!
//! The plugin searches for a line with `Solution Found`, and parses each later line that does not
//! begin with `;` as an action. To validate a domain, the plugin plans for a problem that has
//! neither an initial state nor a goal and names another domain. The output is then
//! `Solution Found` without any action.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use metaplan::file;
use metaplan::message::{Errors, Message};
use metaplan::mission::popf_text;
use metaplan::pddl::Source;
use metaplan::setup::Setup;

use crate::planner::{self, DOMAIN, Manner, NoPlan, PROBLEM, Request};

/// Default time limit of planning; PlanSys2 waits for 15 s.
const TIME_LIMIT: Duration = Duration::from_secs(10);

/// Output of a run of `popf`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Said {
    /// Standard output, which the plugin parses.
    pub out: String,
    /// Standard error, for users.
    pub error: String,
}

impl Said {
    /// Output without a plan: the reason, in comments that the plugin ignores and on standard
    /// error.
    fn reason(text: &str) -> Self {
        let comment = text.lines().fold(String::new(), |comment, line| comment + "; " + line + "\n");
        Self { out: comment, error: text.to_owned() + "\n" }
    }
}

#[derive(Debug)]
struct Invocation {
    domain: PathBuf,
    problem: PathBuf,
    mission: Option<PathBuf>,
    manner: Manner,
    ignored: Vec<String>,
}

/// Runs the planner for the command-line arguments. Environment variables provide defaults:
/// `METAPLAN_METRIC`, `METAPLAN_MISSION`, `METAPLAN_TIME_LIMIT`, `METAPLAN_OVERLAP`.
pub fn run(
    arguments: impl IntoIterator<Item = String>,
    environment: impl Fn(&str) -> Option<String>,
) -> Said {
    let invocation = match parse_invocation(arguments, environment) {
        Ok(invocation) => invocation,
        Err(text) => return Said::reason(&text),
    };
    let mut output = match solve(&invocation) {
        Ok(out) => Said { out, error: String::new() },
        Err(text) => Said::reason(&text),
    };
    if !invocation.ignored.is_empty() {
        let _ = writeln!(output.error, "ignored arguments of POPF: {}", invocation.ignored.join(" "));
    }
    output
}

const USAGE: &str = "usage: popf [--metric EXPRESSION] [--mission MANIFEST] [--time-limit SECONDS] [--overlap yes|no] DOMAIN PROBLEM";

fn parse_invocation(
    arguments: impl IntoIterator<Item = String>,
    environment: impl Fn(&str) -> Option<String>,
) -> Result<Invocation, String> {
    let mut metric = environment("METAPLAN_METRIC");
    let mut mission = environment("METAPLAN_MISSION");
    let mut time_limit = environment("METAPLAN_TIME_LIMIT");
    let mut overlap = environment("METAPLAN_OVERLAP");
    let (mut files, mut ignored) = (Vec::new(), Vec::new());
    let mut arguments = arguments.into_iter();
    while let Some(argument) = arguments.next() {
        let (option, value) = argument.split_once('=').unwrap_or((&argument, ""));
        let target = match option {
            "--metric" => &mut metric,
            "--mission" => &mut mission,
            "--time-limit" => &mut time_limit,
            "--overlap" => &mut overlap,
            _ if argument.starts_with('-') => {
                ignored.push(argument);
                continue;
            }
            _ => {
                files.push(PathBuf::from(argument));
                continue;
            }
        };
        let value = if argument.contains('=') { Some(value.to_owned()) } else { arguments.next() };
        *target = Some(value.ok_or_else(|| format!("`{option}` lacks its value\n{USAGE}"))?);
    }
    let non_empty = |value: Option<String>| value.filter(|value| !value.is_empty());
    let overlap = match non_empty(overlap).as_deref() {
        None | Some("auto") => None,
        Some("yes" | "1" | "true") => Some(true),
        Some("no" | "0" | "false") => Some(false),
        Some(other) => return Err(format!("`--overlap {other}` is neither `yes` nor `no`")),
    };
    let time_limit = non_empty(time_limit).map_or(Ok(TIME_LIMIT), |text| seconds(&text))?;
    let manner = Manner { metric: non_empty(metric), time_limit, overlap, alternatives: 0 };
    let mission = non_empty(mission).map(PathBuf::from);
    // Positional arguments before the last two are values of POPF's own options.
    match files.len().checked_sub(2).map(|first| files.split_off(first)).as_deref() {
        Some([domain, problem]) => {
            ignored.extend(files.iter().map(|file| file.display().to_string()));
            Ok(Invocation { domain: domain.clone(), problem: problem.clone(), mission, manner, ignored })
        }
        _ => Err(USAGE.to_owned()),
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let invalid = || format!("`{text}` is not a time in seconds such as 10 or 0.5");
    let value: f64 = text.parse().map_err(|_| invalid())?;
    Duration::try_from_secs_f64(value).ok().filter(|time| !time.is_zero()).ok_or_else(invalid)
}

fn solve(invocation: &Invocation) -> Result<String, String> {
    let domain = read(&invocation.domain, DOMAIN)?;
    let problem = read(&invocation.problem, PROBLEM)?;
    if is_void(problem.text()) {
        let describe = |messages: Errors| NoPlan::Input(messages).text();
        return planner::check_domain(&domain).map(|()| popf_text(&[])).map_err(describe);
    }
    let setup =
        invocation.mission.as_deref().map(Setup::read).transpose().map_err(|messages| all(&messages))?;
    let joint = setup.as_ref().map(|setup| &setup.mission);
    let request = Request { domain, problem, joint };
    let solution = planner::solve(request, &invocation.manner).map_err(|reason| reason.text())?;
    let mut text = format!("; cost {}\n; {}\n", solution.cost, solution.verdict.replace('\n', "\n; "));
    let best = solution.plans.first().map(Vec::as_slice).unwrap_or_default();
    if best.is_empty() {
        // The plugin treats a plan without actions as a failure, also with POPF.
        text += "; nothing has to be done: the goal holds already\n";
    }
    for (line, configuration) in best.iter().zip(&solution.configuration) {
        let designs: Vec<_> = configuration.iter().map(|(f, design)| format!("{f} = {design}")).collect();
        if !designs.is_empty() {
            let _ = writeln!(text, "; {} with {}", line.action, designs.join(", "));
        }
    }
    Ok(text + &popf_text(best))
}

fn read(path: &Path, name: &str) -> Result<Source, String> {
    let source = file::source(path).map_err(|message| all(&[message]))?;
    Ok(Source::new(name, source.text()))
}

fn all(messages: &[Message]) -> String {
    messages.iter().map(Message::text).collect::<Vec<_>>().join("\n")
}

/// Returns `true` if a problem only serves to validate the domain: it has no initial state and no
/// goal, and contains `void`.
fn is_void(problem: &str) -> bool {
    let code: String = problem.lines().map(|line| line.split(';').next().unwrap_or_default()).collect();
    let code = code.to_ascii_lowercase();
    !code.contains(":init") && !code.contains(":goal") && code.contains("void")
}
