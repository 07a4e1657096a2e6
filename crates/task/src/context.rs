//! The ground task and the planning limits, which stages after grounding share.

use crate::limits::Limits;
use crate::number::Int;
use crate::task::Task;

/// Reference to the ground task and the planning limits.
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
