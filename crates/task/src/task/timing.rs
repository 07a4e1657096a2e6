//! Lower bounds on the times of operators, caused by timed initial literals.

/// Lower bounds on the start and the end of an operator. In addition, the operator starts no earlier than the
/// previous action ends.
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
