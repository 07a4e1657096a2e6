//! Plan semantics: sequential or temporal.

use num_rational::BigRational;

/// Execution semantics of plans.
#[derive(Clone, Copy)]
pub enum PlanSemantics<'c> {
    /// Actions are executed one after another.
    Sequence,
    /// Actions may overlap. The number is the minimum time between interfering happenings.
    Overlapping(&'c BigRational),
}
