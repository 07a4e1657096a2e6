//! Assigns answers to keys of the current state. A key denotes a part of this state, for example the availability of
//! one design. The last line of each key is kept for clients that connect later.

use std::borrow::Cow;

use serde::Deserialize;

#[derive(Deserialize)]
struct About<'a> {
    #[serde(borrow, default)]
    answer: Cow<'a, str>,
    #[serde(borrow, default)]
    function: Option<Cow<'a, str>>,
    #[serde(default)]
    designs: Vec<Design>,
    #[serde(default)]
    objectives: Vec<Objective>,
}

#[derive(Deserialize)]
struct Design {
    design: String,
}

#[derive(Deserialize)]
struct Objective {
    objective: String,
}

pub(super) fn design_key(design: &str) -> String {
    format!("design {design}")
}

pub(super) fn keys(answer: &str) -> Vec<String> {
    let Ok(about) = serde_json::from_str::<About>(answer) else { return Vec::new() };
    match about.answer.as_ref() {
        "request_action" | "goal_reached" => vec!["action".to_owned()],
        "suspend_action" | "resume_action" | "cancel_action" => vec!["suspension".to_owned()],
        // Each of these kinds has its own key. For example, `plan_found` and `plan_kept` are both
        // needed, because the cost of a kept plan is in the line of the plan that was found.
        kind @ ("plan_found" | "plan_none" | "plan_kept" | "ready" | "contradicted" | "unconcluded"
        | "unrecorded") => {
            vec![kind.to_owned()]
        }
        "reconfigure" => about.function.map(|function| format!("function {function}")).into_iter().collect(),
        "inferred" => {
            let designs = about.designs.iter().map(|design| design_key(&design.design));
            designs
                .chain(about.objectives.into_iter().map(|change| format!("objective {}", change.objective)))
                .collect()
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::keys;

    #[test]
    fn answers_have_state_keys() {
        let check = |answer: &str, expected: &[&str]| assert_eq!(keys(answer), expected, "{answer}");
        check(r#"{"answer":"ready"}"#, &["ready"]);
        check(r#"{"answer":"unrecorded","message":"x"}"#, &["unrecorded"]);
        check(r#"{"answer":"plan_found","cost":1,"steps":[]}"#, &["plan_found"]);
        check(r#"{"answer":"plan_none","status":"unsolvable"}"#, &["plan_none"]);
        check(r#"{"answer":"plan_kept","because":"x"}"#, &["plan_kept"]);
        for kind in ["suspend_action", "resume_action", "cancel_action"] {
            check(&format!(r#"{{"answer":"{kind}","action":1}}"#), &["suspension"]);
        }
        check(r#"{"answer":"reconfigure","function":"f \"x\"","from":null,"to":"d"}"#, &["function f \"x\""]);
        check(
            r#"{"answer":"inferred","designs":[{"design":"a","available":true}],"objectives":[{"objective":"o"}]}"#,
            &["design a", "objective o"],
        );
        check(r#"{"answer":"handled"}"#, &[]);
        check("nonsense", &[]);
    }
}
