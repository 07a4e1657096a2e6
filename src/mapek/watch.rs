//! Shared handle by which another thread reads the progress of a planning run. This module starts no thread and reads
//! no clock.

use std::sync::{Arc, Mutex, PoisonError};

use num_rational::BigRational;

/// Handle to the progress of the adaptation loop's planner. Clones refer to the same progress.
#[derive(Debug, Clone, Default)]
pub struct Watch(Arc<Mutex<WatchState>>);

#[derive(Debug, Default)]
struct WatchState {
    started_count: u64,
    planning: Option<Planning>,
}

/// Progress of a planning run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Planning {
    /// Serial number of the planning run; the first run has number 1.
    pub number: u64,
    /// Cost of the incumbent, if reported.
    pub cost: Option<BigRational>,
    /// Lower bound on the cost of every plan, if reported.
    pub lower_bound: Option<BigRational>,
}

impl Watch {
    /// Returns the progress of the current planning run, if any.
    pub fn look(&self) -> Option<Planning> {
        self.state(|state| state.planning.clone())
    }

    pub(super) fn begin(&self) {
        self.state(|state| {
            state.started_count += 1;
            state.planning = Some(Planning { number: state.started_count, ..Planning::default() });
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

    fn state<T>(&self, access: impl FnOnce(&mut WatchState) -> T) -> T {
        // A panic of the planner must not hide its state from observers.
        access(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
