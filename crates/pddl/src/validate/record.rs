//! What is kept of an execution, so that its trajectory and its preferences can be judged.

use num_rational::BigRational;
use num_traits::Zero;

use crate::ast::{Constraint, Name};

use super::world::{State, World};

/// A state of a trajectory.
#[derive(Debug)]
pub(super) struct Moment {
    pub(super) time: BigRational,
    pub(super) state: State,
    /// Whether only timed initial literals have happened.
    is_event: bool,
}

/// What is kept of an execution where constraints or preferences ask for it.
#[derive(Debug, Default)]
pub(super) struct Record {
    /// The states so far; empty if no constraint asks for them.
    pub(super) moments: Vec<Moment>,
    /// The preferences of actions that were violated, each as often as it was.
    pub(super) violated: Vec<Name>,
}

impl Record {
    pub(super) fn new(world: &World<'_>, state: &State) -> Self {
        let mut record = Self::default();
        if constraints(world).next().is_some() {
            record.moments.push(Moment { time: BigRational::zero(), state: state.clone(), is_event: false });
        }
        record
    }

    /// Notes the state after something has happened; what happens at the time of an event is one happening with it.
    pub(super) fn note(&mut self, time: &BigRational, state: &State, is_event: bool) {
        let Some(last) = self.moments.last() else { return };
        if last.is_event && last.time == *time {
            self.moments.pop();
        }
        self.moments.push(Moment { time: time.clone(), state: state.clone(), is_event });
    }
}

/// All constraints of a domain and a problem.
pub(super) fn constraints<'p>(world: &World<'p>) -> impl Iterator<Item = &'p Constraint> + use<'p> {
    world.domain.constraints.iter().chain(&world.problem.constraints)
}
