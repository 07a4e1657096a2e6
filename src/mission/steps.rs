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

/// Maximum absolute value of a decimal exponent. Covers all doubles; larger exponents would only consume memory.
const MAX_EXPONENT: u32 = 400;

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
            // The keys of a JSON object have no order.
            let configuration = step["configuration"].as_object();
            let design = |function: &str| {
                let mut pairs = configuration.into_iter().flatten();
                pairs.find(|(key, _)| key.eq_ignore_ascii_case(function)).and_then(|(_, design)| name(design))
            };
            arguments.extend(mission.added_functions(action.as_str()).into_iter().filter_map(design));
        }
        let number = |key: &str| match &step[key] {
            Value::Null => Ok(None),
            value => decimal(value).map(Some).ok_or_else(|| {
                let text = format!("`{key}` of step {} is {value}, but should be a number", index + 1);
                bad(None, &text)
            }),
        };
        let (start, duration) = (number("start")?, number("duration")?);
        plan.steps.push(PlanStep { action, arguments, start, duration, line: 0 });
    }
    Ok(plan)
}

/// Converts a JSON number to an exact number. Returns `None` for other values, and for exponents beyond
/// [`MAX_EXPONENT`].
fn decimal(value: &Value) -> Option<BigRational> {
    let text = value.as_number()?.to_string();
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().ok().filter(|power: &i32| power.unsigned_abs() <= MAX_EXPONENT)?;
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let ratio = format!("{whole}{fraction}/1{}", "0".repeat(fraction.len()));
    let number = BigRational::from_str_radix(&ratio, 10).ok()?;
    let power = num_traits::pow(BigRational::from_integer(10.into()), exponent.unsigned_abs() as usize);
    Some(if exponent < 0 { number / power } else { number * power })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use num_rational::BigRational;
    use pddl::Source;

    use super::read_plan;
    use crate::setup::Setup;

    fn read(fields: &str) -> Result<(Vec<String>, Option<BigRational>), String> {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/uuv_plain.toml");
        let mission = Setup::read(&manifest).expect("the mission is read").mission;
        let text =
            format!(r#"{{"steps": [{{"action": "search_pipeline", "arguments": ["pl1"], {fields}}}]}}"#);
        let plan = read_plan(&Source::new("plan", text), &mission).map_err(|errors| errors.to_string())?;
        let step = &plan.steps[0];
        Ok((step.arguments.iter().map(ToString::to_string).collect(), step.duration.clone()))
    }

    #[test]
    fn designs_are_found_by_their_functions() {
        let pairs =
            [r#""f_generate_search_path": "fd_search_high""#, r#""f_maintain_motion": "fd_speed_high""#];
        let read = |pairs: [&str; 2]| read(&format!(r#""configuration": {{{}}}"#, pairs.join(", ")));
        let plan = read(pairs).expect("a plan");
        assert_eq!(plan.0.len(), 3, "{plan:?}");
        assert_eq!(read([pairs[1], pairs[0]]), Ok(plan));
    }

    #[test]
    fn numbers_may_have_exponents() {
        let ratio = |numerator: i64, denominator: i64| BigRational::new(numerator.into(), denominator.into());
        for (text, expected) in [
            ("7", ratio(7, 1)),
            ("7e0", ratio(7, 1)),
            ("0.25", ratio(1, 4)),
            ("1.5E+1", ratio(15, 1)),
            ("1e-05", ratio(1, 100_000)),
        ] {
            let plan = read(&format!(r#""duration": {text}"#)).expect("a plan");
            assert_eq!(plan.1, Some(expected), "{text}");
        }
        assert_eq!(read(r#""duration": null"#).expect("a plan").1, None);
        for text in [r#""7""#, "[7]", "1e999999999"] {
            let message = read(&format!(r#""duration": {text}"#)).expect_err("no number");
            assert!(message.contains("`duration` of step 1"), "{message}");
        }
    }
}
