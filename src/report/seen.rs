//! Input for drawing a plan: domain, problem, coordinates of places, and designs.

use std::collections::BTreeMap;

use pddl::ast::{Domain, Problem};

use crate::mission::Mission;
use crate::report::positions::Positions;

/// Mission, problem and coordinates for the picture of a plan.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The mission.
    pub mission: &'a Mission,
    /// The planned problem, with facts and values from the knowledge base (see
    /// [`Mission::filled`]).
    pub problem: &'a Problem,
    /// Coordinates of the mission's places.
    pub positions: &'a Positions,
}

/// Maps each design of a knowledge base to the first function that it solves.
pub(super) type Designs = BTreeMap<String, String>;

#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub(super) domain: &'a Domain,
    pub(super) problem: &'a Problem,
    pub(super) positions: &'a Positions,
    pub(super) designs: &'a Designs,
}

impl<'a> Seen<'a> {
    pub(super) fn scene(self, designs: &'a Designs) -> Scene<'a> {
        let Self { mission, problem, positions } = self;
        Scene { domain: mission.domain(), problem, positions, designs }
    }
}

pub(super) fn known_designs(mission: &Mission) -> Designs {
    let designs = mission.knowledge().into_iter().flat_map(|knowledge| knowledge.catalogue().designs());
    let solved = designs.filter_map(|design| {
        let function = design.solves.first()?;
        Some((design.individual.name.clone(), function.name.clone()))
    });
    solved.collect()
}
