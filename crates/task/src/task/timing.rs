//! Earliest starts of operators relative to timed initial literals.

/// Earliest start of an operator, in addition to the end of its predecessor.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Timing<N> {
    /// Lower bound on the start.
    pub(crate) start: Option<N>,
    /// Lower bound on the end.
    pub(crate) end: Option<N>,
}

impl<N> Timing<N> {
    /// Returns a timing without bounds.
    pub fn free() -> Self {
        Self { start: None, end: None }
    }
}
