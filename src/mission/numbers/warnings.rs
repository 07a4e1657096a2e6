//! Warnings about missing numbers and negative durations, each with the position at which it can be
//! corrected.

use std::collections::BTreeSet;

use pddl::ast::Span;
use pddl::{Diagnostic, Severity, Source};

use super::analysis::{MissingValue, NegativeDuration, Numbers};
use crate::message::{Message, did_you_mean};

const MAX_NAMED: usize = 3;

impl Numbers<'_> {
    pub(super) fn no_estimation(
        &self,
        missing_value: &MissingValue,
        design: &str,
        attribute: &str,
    ) -> Message {
        let individual = self.design(design);
        let estimated = individual.iter().flat_map(|design| design.estimations.keys().map(String::as_str));
        let text = format!(
            "the design `{design}` has no estimation of `{attribute}`, which {} needs, so the design cannot be \
             used there{}",
            quoted(&missing_value.needed_by),
            did_you_mean(attribute, estimated)
        );
        self.about(design, "M230", text)
    }

    pub(super) fn no_value(&self, missing: &[&MissingValue]) -> Message {
        let names: Vec<String> =
            missing.iter().take(MAX_NAMED).map(|value| format!("`{}`", value.function)).collect();
        let omitted = missing.len().saturating_sub(MAX_NAMED);
        let omitted = if omitted > 0 { format!(" and {omitted} more") } else { String::new() };
        let actions: BTreeSet<&String> = missing.iter().flat_map(|value| &value.needed_by).collect();
        let actions: Vec<String> = actions.into_iter().cloned().collect();
        let have = if missing.len() == 1 { "has" } else { "have" };
        let text = format!(
            "{}{omitted} {have} no value, so {} is impossible where it is needed",
            names.join(", "),
            quoted(&actions)
        );
        let help = format!("state it in `:init`: `(= {} NUMBER)`", missing[0].function);
        let source = self.mission.problem_source();
        let start = source.text().find("(:init").map_or(0, |at| u32::try_from(at).unwrap_or_default());
        at(source, Span { start, end: start + "(:init".len() as u32 }, "M231", text).with_help(help)
    }

    pub(super) fn negative(&self, negative_duration: &NegativeDuration) -> Message {
        let because = if negative_duration.causes.is_empty() {
            String::new()
        } else {
            format!(" ({})", negative_duration.causes.join(", "))
        };
        let text = format!(
            "the duration of `{}` would be {}, which is negative{because}, so the action is impossible with \
             these arguments",
            negative_duration.action, negative_duration.duration
        );
        if let Some(design) = &negative_duration.design {
            return self.about(design, "M232", text);
        }
        let mut actions = self.domain.actions.iter().map(|action| &action.identifier);
        let span =
            actions.find(|action| action.name.as_str() == negative_duration.action).map(|action| action.span);
        at(self.mission.domain_source(), span.unwrap_or_default(), "M232", text)
    }
}

fn at(source: &Source, span: Span, code: &'static str, text: String) -> Message {
    let diagnostic = Diagnostic::new(source, span, Severity::Warning, code, text);
    Message::from_pddl(&[diagnostic], &[source]).swap_remove(0)
}

fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
