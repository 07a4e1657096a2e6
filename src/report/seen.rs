//! Context of a plan's picture: domain, problem, coordinates of places, and designs.

use std::collections::BTreeMap;

use pddl::ast::{Domain, Problem};

use crate::mission::Mission;
use crate::report::positions::Positions;

/// Context of a plan's picture, as the caller supplies it.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The mission.
    pub mission: &'a Mission,
    /// The mission's problem, as [`Mission::filled`] has made it.
    pub problem: &'a Problem,
    /// Coordinates of the mission's places.
    pub positions: &'a Positions,
}

/// Designs of a knowledge base, with the first function that each of them solves.
pub(super) type Designs = BTreeMap<String, String>;

/// Context of a plan's picture, as the drawing functions need it: the domain and the problem, the
/// coordinates of places, and the designs.
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

/// Returns the designs of a mission's knowledge base.
pub(super) fn known_designs(mission: &Mission) -> Designs {
    let designs = mission.knowledge().into_iter().flat_map(|knowledge| knowledge.catalogue().designs());
    let solved = designs.filter_map(|design| {
        let function = design.solves.first()?;
        Some((design.individual.name.clone(), function.name.clone()))
    });
    solved.collect()
}
