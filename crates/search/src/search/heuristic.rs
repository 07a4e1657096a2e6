//! The interface between A\* and admissible heuristics.

use task::context::Context;
use task::number::Int;
use task::task::{State, Task};

use crate::bounds::{Bounds, LandmarkCut};
use crate::search::symmetry::Orbits;

/// A lower bound on the cost from a state to the goal.
pub trait Heuristic<N> {
    /// None if the goal cannot be reached.
    fn estimate(&self, state: &State<N>) -> Option<N>;

    /// A sharper one that takes longer, if there is one.
    fn sharper(&self, _: &Task<N>) -> Option<Box<dyn LazyHeuristic<N>>> {
        None
    }

    /// What is known of objects that are interchangeable.
    fn orbits(&self, _: Context<'_, N>) -> Option<Orbits> {
        None
    }
}

/// A lower bound that takes long, and is looked at only where a state is to be expanded.
pub trait LazyHeuristic<N> {
    /// None if the goal cannot be reached.
    fn estimate(&mut self, state: &State<N>) -> Option<N>;

    /// What it took so far, in steps of a computer.
    fn work(&self) -> u64;
}

impl LazyHeuristic<Int> for LandmarkCut {
    fn estimate(&mut self, state: &State) -> Option<Int> {
        self.lm_cut_value(&state.values).map(Int::from)
    }

    fn work(&self) -> u64 {
        self.work()
    }
}

impl Heuristic<Int> for Bounds {
    fn estimate(&self, state: &State) -> Option<Int> {
        self.estimate(state)
    }

    fn sharper(&self, task: &Task) -> Option<Box<dyn LazyHeuristic<Int>>> {
        LandmarkCut::new(task).map(|cut| Box::new(cut) as Box<dyn LazyHeuristic<Int>>)
    }

    fn orbits(&self, context: Context<'_>) -> Option<Orbits> {
        Orbits::new(context).ok().flatten()
    }
}
