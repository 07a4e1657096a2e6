//! Record of an execution, for the evaluation of trajectory constraints and preferences.

use num_rational::BigRational;
use num_traits::Zero;

use crate::ast::{Constraint, Name, Trajectory};

use super::world::{State, World};

#[derive(Debug, Clone)]
pub(super) struct Moment {
    pub(super) time: BigRational,
    pub(super) state: State,
    /// Whether the state results from timed initial literals only.
    is_event: bool,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Record {
    /// States of the trajectory, in order; only the last state if all constraints concern the last state. Empty
    /// if the domain and the problem have no constraints.
    pub(super) moments: Vec<Moment>,
    keeps_all: bool,
    /// Violated preferences of actions, once per violation.
    pub(super) violated: Vec<Name>,
}

impl Record {
    pub(super) fn new(world: &World<'_>, state: &State) -> Self {
        let mut record = Self::default();
        if constraints(world).next().is_some() {
            record.moments.push(Moment { time: BigRational::zero(), state: state.clone(), is_event: false });
            record.keeps_all =
                !constraints(world).all(|constraint| concerns_last_state(&constraint.trajectory));
        }
        record
    }

    /// Appends the state after a happening, or replaces the last recorded state if that state results from
    /// events at the same time.
    pub(super) fn note(&mut self, time: &BigRational, state: &State, is_event: bool) {
        // Without constraints nothing is recorded, to save memory.
        let Some(last) = self.moments.last() else { return };
        if !self.keeps_all || last.is_event && last.time == *time {
            self.moments.pop();
        }
        self.moments.push(Moment { time: time.clone(), state: state.clone(), is_event });
    }
}

/// Returns `true` if a constraint concerns only the last state, such as a preference of the goal.
fn concerns_last_state(trajectory: &Trajectory) -> bool {
    match trajectory {
        Trajectory::AtEnd(_) => true,
        Trajectory::And(parts) => parts.iter().all(concerns_last_state),
        Trajectory::ForAll(_, body) => concerns_last_state(body),
        _ => false,
    }
}

pub(super) fn constraints<'p>(world: &World<'p>) -> impl Iterator<Item = &'p Constraint> + use<'p> {
    world.domain.constraints.iter().chain(&world.problem.constraints)
}
