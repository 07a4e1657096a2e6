//! Lower bounds on the times of operators, caused by timed initial literals.

/// Earliest times of an operator, in addition to the end of the previous action.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Timing<N> {
    pub(crate) start: Option<N>,
    pub(crate) end: Option<N>,
}

impl<N> Timing<N> {
    /// Returns a timing without bounds.
    pub fn free() -> Self {
        Self { start: None, end: None }
    }
}
