//! Reads plans from files, which other programs may have written.

use num_rational::BigRational;
use num_traits::Num as _;
use pddl::Source;
use pddl::ast::Name;
use pddl::validate::{PlanStep, PlanText};
use serde_json::Value;

use ::mission::Mission;

use crate::message::{Errors, Message};

/// Reads the steps of a plan: text with a step on each line, or a `metaplan-plan/1` document.
///
/// # Errors
/// All lines that are not steps; M111 if the document is faulty, or if the text is a table.
pub fn read_plan(source: &Source, mission: &Mission) -> Result<PlanText, Errors> {
    if source.text().trim_start().starts_with('{') {
        return json_plan(source, mission);
    }
    if let Some(line) = table_heading(source.text()) {
        let text = "this is a table for people; write the plan with `metaplan plan … -o FILE`, or with `--plan-format ipc`";
        return Err(Message::at("M111", source.name(), Some((line, 1)), text)
            .with_source(source.text())
            .into());
    }
    PlanText::parse(source).map_err(|diagnostics| Message::from_pddl(&diagnostics, &[source]).into())
}

fn table_heading(text: &str) -> Option<usize> {
    let heading = ["step", "start", "duration", "action"];
    let is_heading = |line: &str| line.split_whitespace().take(heading.len()).eq(heading);
    text.lines().position(is_heading).map(|index| index + 1)
}

/// Reads the steps of a `metaplan-plan/1` document. For an action of a plain domain, the designs in
/// the step's configuration are appended to its arguments.
fn json_plan(source: &Source, mission: &Mission) -> Result<PlanText, Errors> {
    let bad = |place, text: &str| {
        Message::at("M111", source.name(), place, text.to_owned()).with_source(source.text())
    };
    let document: Value = serde_json::from_str(source.text())
        .map_err(|error| bad(Some((error.line(), error.column())), &format!("not JSON: {error}")))?;
    let steps =
        document["steps"].as_array().ok_or_else(|| bad(None, "no `steps`: not a plan of `metaplan plan`"))?;
    let mut plan = PlanText::default();
    for (index, step) in steps.iter().enumerate() {
        let name = |value: &Value| value.as_str().map(Name::new);
        let arguments =
            step["arguments"].as_array().map(|all| all.iter().map(name).collect::<Option<Vec<_>>>());
        let (Some(action), Some(Some(mut arguments))) = (name(&step["action"]), arguments) else {
            let text = format!("step {} has no `action` with `arguments`", index + 1);
            return Err(bad(None, &text).into());
        };
        if mission.written_arguments(action.as_str()) == Some(arguments.len()) {
            let configuration = step["configuration"].as_object();
            arguments.extend(configuration.into_iter().flat_map(|all| all.values()).filter_map(name));
        }
        let (start, duration) = (decimal(&step["start"]), decimal(&step["duration"]));
        plan.steps.push(PlanStep { action, arguments, start, duration, line: 0 });
    }
    Ok(plan)
}

/// Converts a JSON decimal to an exact number. Returns `None` for other values and for numbers with an exponent.
fn decimal(value: &Value) -> Option<BigRational> {
    let text = value.as_number()?.to_string();
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    BigRational::from_str_radix(&format!("{whole}{fraction}/1{}", "0".repeat(fraction.len())), 10).ok()
}
