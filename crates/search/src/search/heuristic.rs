//! Interface between A\* and admissible heuristics.

use task::context::Context;
use task::number::Int;
use task::task::{State, Task};

use crate::bounds::{Bounds, LandmarkCut, OnlineCostPartitioning};
use crate::search::symmetry::Orbits;

/// An admissible heuristic, i.e. a lower bound on the cost from a state to the goal.
pub trait Heuristic<N> {
    /// Returns the heuristic value of a state, or `None` if the goal is proved unreachable.
    fn estimate(&self, state: &State<N>) -> Option<N>;

    /// Returns a slower heuristic that is usually more accurate, if one is available.
    fn sharper(&self, _: &Task<N>) -> Option<Box<dyn LazyHeuristic<N>>> {
        None
    }

    /// Returns a heuristic that improves during the search, if one is available. `max_work` limits most of the
    /// effort for its computation, in work units.
    fn improving(&self, _: Context<'_, N>, _max_work: u64) -> Option<Box<dyn LazyHeuristic<N>>> {
        None
    }

    /// Returns symmetries of interchangeable objects, if they are available.
    fn orbits(&self, _: Context<'_, N>) -> Option<Orbits> {
        None
    }
}

/// An admissible heuristic that is evaluated only when a node is about to be expanded, because it is slow or may
/// improve until then.
pub trait LazyHeuristic<N> {
    /// Returns the heuristic value of a state, or `None` if the goal is proved unreachable.
    fn estimate(&mut self, state: &State<N>) -> Option<N>;

    /// Returns the work units already done.
    fn work(&self) -> u64;

    /// Returns the memory of the heuristic in bytes, if it is significant.
    fn bytes(&self) -> usize {
        0
    }
}

impl LazyHeuristic<Int> for LandmarkCut {
    fn estimate(&mut self, state: &State) -> Option<Int> {
        self.lm_cut_value(&state.values).map(Int::from)
    }

    fn work(&self) -> u64 {
        self.work()
    }
}

impl LazyHeuristic<Int> for OnlineCostPartitioning {
    fn estimate(&mut self, state: &State) -> Option<Int> {
        self.estimate(&state.values)
    }

    fn work(&self) -> u64 {
        self.work()
    }

    fn bytes(&self) -> usize {
        self.bytes()
    }
}

impl Heuristic<Int> for Bounds {
    fn estimate(&self, state: &State) -> Option<Int> {
        self.estimate(state)
    }

    fn sharper(&self, task: &Task) -> Option<Box<dyn LazyHeuristic<Int>>> {
        LandmarkCut::new(task).map(|cut| Box::new(cut) as Box<dyn LazyHeuristic<Int>>)
    }

    fn improving(&self, context: Context<'_>, max_work: u64) -> Option<Box<dyn LazyHeuristic<Int>>> {
        let partitioning = self.online_cost_partitioning(context, max_work).ok().flatten()?;
        Some(Box::new(partitioning))
    }

    fn orbits(&self, context: Context<'_>) -> Option<Orbits> {
        Orbits::new(context).ok().flatten()
    }
}
