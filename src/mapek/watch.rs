//! How planning goes, to be looked at from outside while the loop plans: it has no clock and no thread of its own.

use std::sync::{Arc, Mutex, PoisonError};

use num_rational::BigRational;

/// A look at the planner of a loop; copies look at the same one.
#[derive(Debug, Clone, Default)]
pub struct Watch(Arc<Mutex<Looked>>);

#[derive(Debug, Default)]
struct Looked {
    begun: u64,
    planning: Option<Planning>,
}

/// A plan is being looked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Planning {
    /// Which one, from 1: another number is another plan.
    pub number: u64,
    /// What the steps of the best plan so far add to the metric, if the planner has said that it has one.
    pub cost: Option<BigRational>,
    /// No plan adds less, as far as the planner has said.
    pub lower_bound: Option<BigRational>,
}

impl Watch {
    /// What is being planned now.
    pub fn look(&self) -> Option<Planning> {
        self.state(|state| state.planning.clone())
    }

    pub(super) fn begin(&self) {
        self.state(|state| {
            state.begun += 1;
            state.planning = Some(Planning { number: state.begun, ..Planning::default() });
        });
    }

    pub(super) fn improve(&self, cost: Option<BigRational>, lower_bound: BigRational) {
        self.state(|state| {
            if let Some(planning) = &mut state.planning {
                (planning.cost, planning.lower_bound) = (cost, Some(lower_bound));
            }
        });
    }

    pub(super) fn end(&self) {
        self.state(|state| state.planning = None);
    }

    fn state<T>(&self, use_it: impl FnOnce(&mut Looked) -> T) -> T {
        use_it(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
