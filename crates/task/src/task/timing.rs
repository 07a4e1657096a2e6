//! Earliest starts of operators relative to timed initial literals.

/// When an operator starts at the earliest, besides not before what is before it has ended.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Timing<N> {
    /// Not before this.
    pub(crate) start: Option<N>,
    /// So that it does not end before this.
    pub(crate) end: Option<N>,
}

impl<N> Timing<N> {
    /// As soon as what is before it has ended.
    pub fn free() -> Self {
        Self { start: None, end: None }
    }
}
