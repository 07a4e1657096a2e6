//! Assigns colours to names, identically in all pictures of a page.

use std::collections::BTreeMap;

use crate::data::{Plan, Step};

/// Number of colours; further names reuse the colours.
pub(crate) const COLOURS: usize = 10;

#[derive(Debug, Clone, Default)]
pub(crate) struct Palette {
    colours: BTreeMap<String, usize>,
}

impl Palette {
    /// Assigns colours to the designs of all plans in the order of their use, then to the other
    /// configurations.
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

    pub(crate) fn class(&self, name: &str) -> String {
        match self.colours.get(name) {
            Some(colour) if !name.is_empty() => format!("c{}", colour % COLOURS),
            _ => "none".to_owned(),
        }
    }
}

pub(crate) fn configuration(step: &Step) -> String {
    let designs: Vec<&str> = step.configuration.iter().map(|(_, design)| design.as_str()).collect();
    designs.join(" + ")
}
