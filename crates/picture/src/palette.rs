//! Which colour a name has, so that it has the same one in all pictures of a page.

use std::collections::BTreeMap;

use crate::data::{Plan, Step};

/// How many colours there are; more names begin again.
pub(crate) const COLOURS: usize = 10;

/// Names to colours.
#[derive(Debug, Clone, Default)]
pub(crate) struct Palette {
    colours: BTreeMap<String, usize>,
}

impl Palette {
    /// The designs of all plans in the order in which they are used, and then the configurations of several designs.
    pub(crate) fn of(plans: &[&Plan]) -> Self {
        let mut palette = Self::default();
        let steps = || plans.iter().flat_map(|plan| &plan.steps);
        for (_, design) in steps().flat_map(|step| &step.configuration) {
            palette.add(design);
        }
        for step in steps() {
            palette.add(&configuration(step));
        }
        palette
    }

    fn add(&mut self, name: &str) {
        let next = self.colours.len();
        self.colours.entry(name.to_owned()).or_insert(next);
    }

    /// The class that gives shapes the colour of a name.
    pub(crate) fn class(&self, name: &str) -> String {
        match self.colours.get(name) {
            Some(colour) if !name.is_empty() => format!("c{}", colour % COLOURS),
            _ => "none".to_owned(),
        }
    }
}

/// The designs of a step as one name: `fd_a + fd_b`.
pub(crate) fn configuration(step: &Step) -> String {
    let designs: Vec<&str> = step.configuration.iter().map(|(_, design)| design.as_str()).collect();
    designs.join(" + ")
}
