//! Parses the conditions and numeric functions of a manifest against the declarations of the
//! mission's domain and problem.

use pddl::ast::{Atom, Condition, Expression};

use ::mission::Mission;

use crate::message::{Errors, Message};

/// A fault in the text of a condition or function, with its position.
#[derive(Debug, Clone)]
pub struct Fault {
    /// Byte offset of the fault in the text, if known.
    pub offset: Option<usize>,
    /// Message about the fault.
    pub message: Message,
}

/// Parses a condition, such as `(robot_at dock)` or `(< (battery) 20)`. The parentheses of a single
/// atom are optional.
///
/// # Errors
/// All syntax and type errors of the text.
pub fn condition(mission: &Mission, text: &str) -> Result<Condition, Vec<Fault>> {
    let is_bare = !text.trim_start().starts_with('(');
    let open = if is_bare { "(" } else { "" };
    let close = if is_bare { ")" } else { "" };
    let before = format!("(define (problem goal) (:domain {}) (:goal {open}", mission.domain().name.name);
    let closed = text.chars().try_fold(0_usize, |depth, c| match c {
        '(' => depth.checked_add(1),
        ')' => depth.checked_sub(1),
        _ => Some(depth),
    });
    if text.trim().is_empty() || closed != Some(0) {
        let text = format!(
            "`{text}` is not a condition; write one such as `(robot_at dock)`, with its parentheses in pairs"
        );
        return Err(vec![Fault { offset: None, message: Message::error("M135", text) }]);
    }
    mission
        .goal(&format!("{open}{text}{close}"))
        .map_err(|errors| faults(errors, text, before.chars().count()))
}

/// Parses a numeric function with its arguments, such as `(battery)`. The outer parentheses are
/// optional.
///
/// # Errors
/// The text has syntax or type errors, or is not a single function.
pub fn function(mission: &Mission, text: &str) -> Result<Atom, Vec<Fault>> {
    let mut problem = mission.problem().clone();
    mission.fill(&mut problem);
    let before = usize::from(!text.trim_start().starts_with('('));
    let objective = mission.objective(&problem, text).map_err(|errors| faults(errors, text, before))?;
    if let Expression::Fluent(atom) = objective.metric.expression {
        return Ok(atom);
    }
    let text = format!("`{text}` is not one numeric function with its arguments, such as `(battery)`");
    Err(vec![Fault { offset: None, message: Message::error("M135", text) }])
}

/// Checks a setting that [`Mission::set`] has accepted. Returns a message if the objects in its name or value do not
/// exist or have wrong types.
pub(super) fn setting(mission: &Mission, name: &str, value: &str) -> Option<Message> {
    if mission.knowledge().is_some_and(|knowledge| knowledge.uses_measurement(name.trim())) {
        return None;
    }
    let is_truth = ["true", "false"].iter().any(|truth| value.trim().eq_ignore_ascii_case(truth));
    let text = match (mission.is_function(name), is_truth) {
        (true, _) => format!("(>= ({name}) 0)"),
        (false, true) => format!("({name})"),
        (false, false) => format!("({name} {})", value.trim()),
    };
    condition(mission, &text).err()?.into_iter().next().map(|fault| fault.message)
}

/// Formats a ground atom as the validator does: `(distance a b)`.
pub fn written(atom: &Atom) -> String {
    let words = atom.arguments.iter().map(|term| term.name().as_str());
    let words: Vec<&str> = std::iter::once(atom.predicate.name.as_str()).chain(words).collect();
    format!("({})", words.join(" "))
}

/// Converts errors to faults with offsets in `text`. The text was parsed on the first line of an input, after a prefix of
/// `before` characters. A fault in the prefix gets the place of the text's first character.
fn faults(errors: Errors, text: &str, before: usize) -> Vec<Fault> {
    let fault = |error: Message| {
        let offset = error.column.filter(|_| error.line == Some(1)).and_then(|column| {
            let characters = column.saturating_sub(before + 1);
            text.char_indices().map(|(at, _)| at).nth(characters)
        });
        let message = Message::error(&error.code, &error.message);
        let message = match &error.help {
            Some(help) => message.with_help(help),
            None => message,
        };
        Fault { offset, message }
    };
    errors.into_iter().map(fault).collect()
}
