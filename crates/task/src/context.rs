//! The ground task with its limits, shared by all stages after grounding.

use crate::limits::Limits;
use crate::number::Int;
use crate::task::Task;

/// The ground task and the limits of planning.
#[derive(Debug)]
pub struct Context<'a, N = Int> {
    pub task: &'a Task<N>,
    pub limits: &'a Limits,
}

impl<'a, N> Context<'a, N> {
    pub fn new(task: &'a Task<N>, limits: &'a Limits) -> Self {
        Self { task, limits }
    }
}

impl<N> Clone for Context<'_, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<N> Copy for Context<'_, N> {}
