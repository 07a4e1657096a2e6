//! Names that co-adaptation adds to the user's domain: tells them apart from the user's names, and rewrites
//! conditions with them for display.

use std::collections::BTreeSet;

use pddl::ast::Name;

use super::{CoAdaptation, meets};

impl CoAdaptation {
    pub(crate) fn stands_for_designs(&self, function: &Name) -> bool {
        self.chosen.contains_key(function) || self.changed.contains_key(function)
    }

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

    pub(crate) fn is_added(&self, name: &Name) -> bool {
        self.added().contains(name)
    }

    /// Returns the predicates and functions that only the explicit form has.
    pub(super) fn added(&self) -> BTreeSet<Name> {
        let declarations = self.predicates().into_iter().chain(self.functions());
        declarations.map(|declaration| declaration.identifier.name).collect()
    }
}
