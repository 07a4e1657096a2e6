//! Plan semantics: sequential or temporal.

use num_rational::BigRational;

/// How the states of a plan follow each other.
#[derive(Clone, Copy)]
pub enum PlanSemantics<'c> {
    /// Actions one after another.
    Sequence,
    /// Actions may overlap. What interferes lies so far apart.
    Overlapping(&'c BigRational),
}
