//! `metaplan explain`.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use encodings::Limits;
use metaplan::answers::{ChangesAnswer, CodeAnswer, DesignAnswer};
use metaplan::codes::{self, Code};
use metaplan::explain::{BestPlan, Change, DesignExplanation, Target, best, design, smallest_changes};
use metaplan::message::{Message, did_you_mean};

use crate::cli::common::{Common, Exit, Failure, Format};
use crate::cli::output::{self, decimal};
use crate::cli::progress::during;
use crate::cli::situation::Situation;

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A mission's manifest; or the code of a message, such as M118: what it means, what causes it, what to do.
    #[arg(value_name = "MISSION | CODE")]
    mission: PathBuf,
    /// A function design; without one, what would change the plan.
    #[arg(value_name = "DESIGN")]
    query: Option<String>,
    #[command(flatten)]
    situation: Situation,
}

/// Runs the command.
pub fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    if let Some(name) = arguments.mission.to_str().filter(|name| codes::is_code(name))
        && !arguments.mission.exists()
    {
        return code(name, common);
    }
    let mission = arguments.situation.mission(std::slice::from_ref(&arguments.mission), common)?;
    output::warnings(common, mission.warnings());
    let limits = Limits::none();
    let answer = during("planning", common, || best(&mission, &limits))?;
    let name = mission.name.as_str();
    if let Some(query) = &arguments.query {
        let found = during("planning", common, || design(&mission, query, &limits)).map_err(|messages| {
            let exit = if messages.iter().any(|m| m.code == "M112") { Exit::Usage } else { Exit::BadInput };
            Failure { exit, messages }
        })?;
        match common.format {
            Format::Json => output::json_answer(&DesignAnswer::new(name, &answer, &found)),
            _ => output::answer(&design_text(&answer, &found)),
        }
    } else {
        let changes = during("planning", common, || smallest_changes(&mission, &limits))?;
        match common.format {
            Format::Json => output::json_answer(&ChangesAnswer::new(name, &answer, &changes)),
            _ => output::answer(&changes_text(&answer, &changes)),
        }
    }
    Ok(Exit::Done)
}

/// What a code means.
fn code(name: &str, common: &Common) -> Result<Exit, Failure> {
    let Some(found) = codes::find(name) else {
        let all = codes::all();
        let meant = did_you_mean(name, all.iter().map(|code| code.code));
        let text = format!("there is no code `{name}`, and no file of that name{meant}");
        return Err(Failure::usage(Message::error("M138", text)));
    };
    if common.format == Format::Json {
        output::json_answer(&CodeAnswer::from(found));
    } else {
        let Code { code, meaning, cause, remedy } = found;
        output::answer(&format!("{code}: {meaning}\ncause: {cause}\nremedy: {remedy}\n"));
    }
    Ok(Exit::Done)
}

/// The steps of a plan, each on a line.
fn plan_text(answer: &BestPlan) -> String {
    answer.steps.iter().fold(String::new(), |text, step| text + "    " + &step.summary() + "\n")
}

/// A metric, and how it differs from that of the best plan.
fn cost_text(answer: &BestPlan, best: &BestPlan) -> String {
    match (&answer.cost, &best.cost) {
        (None, _) => "there is no plan".to_owned(),
        (Some(cost), Some(base)) if cost == base => format!("the best plan costs {}, no more", decimal(cost)),
        (Some(cost), Some(base)) if cost > base => {
            format!("the best plan costs {}, {} more", decimal(cost), decimal(&(cost - base)))
        }
        (Some(cost), Some(base)) => {
            format!("the best plan costs {}, {} less", decimal(cost), decimal(&(base - cost)))
        }
        (Some(cost), None) => format!("there is a plan, and the best costs {}", decimal(cost)),
    }
}

fn target_text(change: &Change) -> String {
    let now = change.from.as_ref().map(|from| format!(" (now {})", decimal(from))).unwrap_or_default();
    let name = &change.name;
    match &change.to {
        Target::AtLeast(bound) => format!("{name} at least {}{now}", decimal(bound)),
        Target::AtMost(bound) => format!("{name} at most {}{now}", decimal(bound)),
        Target::Above(bound) => format!("{name} above {}{now}", decimal(bound)),
        Target::Below(bound) => format!("{name} below {}{now}", decimal(bound)),
        Target::Recovered => format!("{name} works again"),
        Target::Failed => format!("{name} fails"),
    }
}

fn design_text(best: &BestPlan, found: &DesignExplanation) -> String {
    let mut text = String::new();
    let functions = found.functions.join(", ");
    let state = if found.available { "is available" } else { "is not available" };
    // Writing to a string does not fail.
    let _ = writeln!(text, "{} ({functions}) {state}", found.design);
    for line in &found.because {
        let _ = writeln!(text, "    {line}");
    }
    let used: Vec<String> = found.used.iter().map(ToString::to_string).collect();
    match (&best.cost, used.is_empty()) {
        (None, _) => text += "there is no plan\n",
        (Some(cost), true) => {
            let _ = writeln!(text, "the best plan costs {} and does not use it", decimal(cost));
        }
        (Some(cost), false) => {
            let _ = writeln!(
                text,
                "the best plan costs {} and uses it in steps {}",
                decimal(cost),
                used.join(", ")
            );
        }
    }
    text += &plan_text(best);
    let condition = if found.available { "" } else { "if it were available, and " };
    let _ = writeln!(text, "{condition}as the only design of {functions}: {}", cost_text(&found.alone, best));
    text += &plan_text(&found.alone);
    if !found.used.is_empty() {
        let _ = writeln!(text, "without it: {}", cost_text(&found.without, best));
        text += &plan_text(&found.without);
    }
    if !found.changes.is_empty() {
        let what =
            if found.available { "it is not available any more if" } else { "what rules it out goes if" };
        let _ = writeln!(text, "{what}");
        for change in &found.changes {
            let _ = writeln!(text, "    {}: {}", target_text(change), cost_text(&change.then, best));
        }
    }
    text
}

fn changes_text(best: &BestPlan, changes: &[Change]) -> String {
    let mut text = match &best.cost {
        None => "there is no plan\n".to_owned(),
        Some(cost) => format!("the best plan costs {}\n{}", decimal(cost), plan_text(best)),
    };
    if changes.is_empty() {
        return text + "no change of one measurement leads to another plan\n";
    }
    text += "the smallest changes that lead to another plan\n";
    for change in changes {
        let _ = writeln!(text, "{}: {}", target_text(change), cost_text(&change.then, best));
        text += &plan_text(&change.then);
    }
    text
}
