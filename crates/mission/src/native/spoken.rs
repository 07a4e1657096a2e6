//! What the explicit form adds to a domain, as its author is told of it: not by names that stand in none of the files.

use pddl::ast::Name;

use super::{CoAdaptation, meets};

impl CoAdaptation {
    /// Whether a function stands for the chosen designs, or for those that a change has brought.
    pub(crate) fn stands_for_designs(&self, function: &Name) -> bool {
        self.chosen.contains_key(function) || self.changed.contains_key(function)
    }

    /// A condition with other words for the predicates that are added.
    pub(crate) fn spoken(&self, condition: &str) -> String {
        let mut text = condition.to_owned();
        for quality in self.quality() {
            let begin = format!("({} ", meets(quality));
            while let Some(at) = text.find(&begin) {
                let design = text[at + begin.len()..].split(')').next().unwrap_or_default().to_owned();
                let end = at + begin.len() + design.len();
                text.replace_range(at..end, &format!("(meets {design} {}", quality.individual.name));
            }
        }
        text
    }

    /// Whether the explicit form has a predicate or function that the domain of the author does not.
    pub(crate) fn is_added(&self, name: &Name) -> bool {
        self.predicates().into_iter().chain(self.functions()).any(|own| own.identifier.name == *name)
    }
}
