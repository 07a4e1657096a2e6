//! A mission in the situation that is looked at.

use pddl::ast::Problem;

use crate::mission::Mission;
use crate::report::positions::Positions;

/// What a plan is for.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The mission.
    pub mission: &'a Mission,
    /// Its problem, as [`Mission::filled`] has made it.
    pub problem: &'a Problem,
    /// Where its places lie.
    pub positions: &'a Positions,
}
