//! The command `metaplan explain`, which explains a design, a plan or a message code.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::answers::{ChangesAnswer, CodeAnswer, DesignAnswer};
use crate::codes::{self, Code};
use crate::explain::{
    Alteration, Availability, BestPlan, DesignExplanation, SmallestChanges, Target, availability,
    smallest_changes,
};
use crate::file::{Kind, source};
use crate::message::{Errors, Message, did_you_mean};
use crate::mission::Mission;
use clap::Args;
use num_rational::BigRational;
use planner::Limits;

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::limits::TimeLimit;
use crate::cli::output::{self, decimal};
use crate::cli::progress::{Progress, during};
use crate::cli::situation::Situation;

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest, or a PDDL domain and a PDDL problem; then a function design. Without the design, explain
    /// which changes lead to another plan. Or a message code such as M118, which is explained with cause and remedy.
    #[arg(required = true, num_args = 1..=3, value_name = "MISSION [DESIGN] | DOMAIN PROBLEM [DESIGN] | CODE")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    #[command(flatten)]
    time: TimeLimit,
}

impl Arguments {
    /// Returns the files of the mission, and the design.
    fn files_and_design(&self) -> (&[PathBuf], Option<&Path>) {
        match &self.inputs[..] {
            [domain, problem] if is_pddl(domain, problem) => (&self.inputs, None),
            [files @ .., design] if !files.is_empty() => (files, Some(design)),
            _ => (&self.inputs, None),
        }
    }
}

/// Returns `true` if two arguments are a domain and a problem, not a manifest and a design.
fn is_pddl(first: &Path, second: &Path) -> bool {
    // Standard input can be read only once.
    if first == Path::new("-") {
        return is_pddl_file(second);
    }
    is_pddl_file(first)
}

fn is_pddl_file(path: &Path) -> bool {
    source(path).is_ok_and(|file| matches!(Kind::of(file.text()), Some(Kind::Domain | Kind::Problem)))
}

pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    if let Some(name) = arguments.inputs.first().filter(|name| !name.exists())
        && let Some(name) = name.to_str().filter(|name| codes::is_code(name))
    {
        return code(name, arguments, common);
    }
    let guard = arguments.time.guard(common)?;
    let (files, design) = arguments.files_and_design();
    let mission = arguments.situation.mission(files, common)?;
    output::warnings(common, mission.warnings());
    let complete = match design {
        Some(design) => {
            let design = design.to_string_lossy();
            let why = during("reasoning", common, || availability(&mission, &design));
            let why = why.map_err(|messages| {
                let exit =
                    if messages.iter().any(|m| m.code == "M112") { Exit::Usage } else { Exit::BadInput };
                Failure { exit, messages }
            })?;
            explain_design(&mission, why, &guard.plan(), common)?
        }
        None => explain_plan(&mission, &guard.plan(), common)?,
    };
    Ok(if complete { Exit::Done } else { Exit::NotProved })
}

/// Explains a design. Text output shows the reasons for its availability before planning, and the
/// plans after planning. Returns `true` if each plan is proved optimal, or proved not to exist.
fn explain_design(
    mission: &Mission,
    why: Availability,
    limits: &Limits,
    common: &Common,
) -> Result<bool, Failure> {
    let is_text = common.format != Format::Json;
    if is_text {
        output::answer(&why_text(&why));
    }
    let explanation = planning(common, limits, |hear| why.plan(mission, limits, hear))?;
    if is_text {
        output::answer(&design_text(&explanation));
    } else {
        output::json_answer(&DesignAnswer::new(&mission.name, &explanation));
    }
    Ok(explanation.complete)
}

fn explain_plan(mission: &Mission, limits: &Limits, common: &Common) -> Result<bool, Failure> {
    let changes = planning(common, limits, |hear| smallest_changes(mission, limits, hear))?;
    match common.format {
        Format::Json => output::json_answer(&ChangesAnswer::new(&mission.name, &changes)),
        _ => output::answer(&changes_text(&changes)),
    }
    Ok(changes.complete)
}

fn planning<T>(
    common: &Common,
    limits: &Limits,
    plan: impl FnOnce(&mut dyn FnMut(&str)) -> Result<T, Errors>,
) -> Result<T, Failure> {
    let progress = Progress::new("planning", common);
    let outcome = plan(&mut |what| progress.set_message(what.to_owned()));
    progress.finish();
    outcome.map_err(|messages| Failure::planning(messages, limits))
}

fn code(name: &str, arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let Some(found) = codes::find(name) else {
        let catalogue = codes::all();
        let suggestion = did_you_mean(name, catalogue.iter().map(|code| code.code));
        let text = format!("there is no code `{name}`, and no file of that name{suggestion}");
        return Err(Failure::usage(Message::error("M138", text)));
    };
    if arguments.inputs.len() > 1 || !arguments.situation.is_empty() {
        let text = format!(
            "a code has neither a design nor a situation; use `metaplan explain {}` alone, or give a mission instead \
             of the code",
            found.code
        );
        return Err(Failure::usage(Message::error("M107", text)));
    }
    if common.format == Format::Json {
        output::json_answer(&CodeAnswer::from(found));
    } else {
        let Code { code, meaning, cause, remedy } = found;
        output::answer(&format!("{code}: {meaning}\ncause: {cause}\nremedy: {remedy}\n"));
    }
    Ok(Exit::Done)
}

/// Without a proof, the reason is not always a limit: reasoning may have failed, for example.
const NO_PLAN: &str = "no plan was found, and its absence is not proved\n";

fn plan_text(answer: &BestPlan) -> String {
    answer.steps.iter().fold(String::new(), |text, step| text + "    " + &step.summary() + "\n")
}

fn cost_text(answer: &BestPlan, best: &BestPlan) -> String {
    let cost = match (&answer.cost, answer.proved) {
        (None, true) => return "there is no plan".to_owned(),
        (None, false) => return "not known: no plan was found, and its absence is not proved".to_owned(),
        (Some(cost), false) => {
            return format!("a plan costs {}; it is not proved that no plan is better", decimal(cost));
        }
        (Some(cost), true) => cost,
    };
    match &best.cost {
        Some(base) if !best.proved => {
            format!(
                "the best plan costs {} (the best known plan of the current situation costs {})",
                decimal(cost),
                decimal(base)
            )
        }
        Some(base) if cost == base => format!("the best plan costs {}, the same", decimal(cost)),
        Some(base) if cost > base => {
            format!("the best plan costs {}, {} more", decimal(cost), decimal(&(cost - base)))
        }
        Some(base) => format!("the best plan costs {}, {} less", decimal(cost), decimal(&(base - cost))),
        None if best.proved => format!("there is a plan, and the best costs {}", decimal(cost)),
        None => format!("the best plan costs {}", decimal(cost)),
    }
}

fn alteration_text(alteration: &Alteration, about: bool) -> String {
    let Alteration { name, from, to } = alteration;
    let now = from.as_ref().map(|from| format!(" (now {})", decimal(from))).unwrap_or_default();
    let about = if about { "about " } else { "" };
    match to {
        Target::AtLeast(bound) => format!("{name} at least {about}{}{now}", decimal(bound)),
        Target::AtMost(bound) => format!("{name} at most {about}{}{now}", decimal(bound)),
        Target::Above(bound) => format!("{name} above {about}{}{now}", decimal(bound)),
        Target::Below(bound) => format!("{name} below {about}{}{now}", decimal(bound)),
        Target::Recovered => format!("{name} works again"),
        Target::Failed => format!("{name} fails"),
    }
}

fn why_text(why: &Availability) -> String {
    let functions = why.functions.join(", ");
    let state = if why.available { "is available" } else { "is not available" };
    let mut text = format!("{} ({functions}) {state}\n", why.design);
    for line in &why.because {
        // Writing to a string does not fail.
        let _ = writeln!(text, "    {line}");
    }
    if let ([way], false) = (&why.ways[..], why.available)
        && way.len() > 1
    {
        let names = way.iter().map(|alteration| alteration.name.as_str()).collect::<Vec<_>>().join(", ");
        let _ = writeln!(
            text,
            "{} causes; if all of them were removed, it would be available: {names}",
            way.len()
        );
    }
    text
}

fn design_text(found: &DesignExplanation) -> String {
    let DesignExplanation { availability, best, .. } = found;
    let mut text = String::new();
    let functions = availability.functions.join(", ");
    let used: Vec<String> = found.used.iter().map(ToString::to_string).collect();
    let plan = if best.proved { "the best plan" } else { "the best plan so far (not proved best)" };
    match (&best.cost, &used[..]) {
        (None, _) if best.proved => text += "there is no plan\n",
        (None, _) => text += NO_PLAN,
        (Some(cost), []) => {
            let _ = writeln!(text, "{plan} costs {} and does not use it", decimal(cost));
        }
        (Some(cost), [step]) => {
            let _ = writeln!(text, "{plan} costs {} and uses it in step {step}", decimal(cost));
        }
        (Some(cost), steps) => {
            let _ =
                writeln!(text, "{plan} costs {} and uses it in steps {}", decimal(cost), steps.join(", "));
        }
    }
    text += &plan_text(best);
    let condition = if availability.available { "" } else { "if it were available, and " };
    let _ = writeln!(text, "{condition}as the only design of {functions}: {}", cost_text(&found.alone, best));
    text += &plan_text(&found.alone);
    if !found.used.is_empty() {
        let _ = writeln!(text, "without it: {}", cost_text(&found.without, best));
        text += &plan_text(&found.without);
    }
    text + &repairs_text(found)
}

fn repairs_text(found: &DesignExplanation) -> String {
    let DesignExplanation { availability, best, repairs, .. } = found;
    let mut text = String::new();
    if repairs.is_empty() && !availability.available {
        let tried = if availability.unexamined.is_empty() { "" } else { " that was tried" };
        text += "no recovery of components and no change of measurements";
        text += tried;
        text += " makes it available\n";
    }
    let (singles, groups): (Vec<_>, Vec<_>) =
        repairs.iter().partition(|repair| repair.alterations.len() == 1);
    if !singles.is_empty() {
        text += if availability.available {
            "it is not available any more if\n"
        } else {
            "it is available again if\n"
        };
    }
    for repair in singles {
        for alteration in &repair.alterations {
            let cost = cost_text(&repair.then, best);
            let _ = writeln!(text, "    {}: {cost}", alteration_text(alteration, false));
        }
    }
    for repair in groups {
        text += "it is available again if all of these hold together\n";
        for alteration in &repair.alterations {
            let _ = writeln!(text, "    {}", alteration_text(alteration, false));
        }
        let _ = writeln!(text, "then {}", cost_text(&repair.then, best));
        text += &plan_text(&repair.then);
    }
    text + &unexamined_text(&availability.unexamined)
}

fn unexamined_text(unexamined: &[String]) -> String {
    unexamined.iter().fold(String::new(), |text, line| text + "not examined: " + line + "\n")
}

fn changes_text(found: &SmallestChanges) -> String {
    let SmallestChanges { best, changes, complete, unexamined, .. } = found;
    let mut text = match (&best.cost, best.proved) {
        (None, true) => "there is no plan\n".to_owned(),
        (None, false) => NO_PLAN.to_owned(),
        (Some(cost), true) => format!("the best plan costs {}\n{}", decimal(cost), plan_text(best)),
        (Some(cost), false) => {
            let plan = plan_text(best);
            format!("the best plan so far (not proved best) costs {}\n{plan}", decimal(cost))
        }
    };
    match (changes.is_empty(), complete) {
        (true, true) if unexamined.is_empty() => {
            return text + "no change of one measurement leads to another plan\n";
        }
        (true, true) => text += "no change of one measurement that was tried leads to another plan\n",
        (true, false) => {}
        (false, _) => text += "the smallest changes that lead to another plan\n",
    }
    for change in changes {
        // A bound that is exact to a millionth is not marked as approximate.
        let about = change.within.as_ref().is_some_and(|within| *within > millionth());
        let cost = cost_text(&change.then, best);
        let _ = writeln!(text, "{}: {cost}", alteration_text(&change.alteration, about));
        text += &plan_text(&change.then);
    }
    if !complete {
        text += "a result is not proved: other changes were not examined\n";
    }
    text + &unexamined_text(unexamined)
}

fn millionth() -> BigRational {
    BigRational::new(1.into(), 1_000_000.into())
}
