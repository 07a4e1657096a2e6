//! Plan semantics: sequential or temporal.

use num_rational::BigRational;

/// Execution semantics of a plan.
#[derive(Clone, Copy)]
pub enum PlanSemantics<'c> {
    /// Sequential execution.
    Sequence,
    /// Actions may overlap. Interfering happenings are separated by this time.
    Overlapping(&'c BigRational),
}
