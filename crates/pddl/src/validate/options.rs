//! How a plan is to be read.

use num_bigint::BigInt;
use num_rational::BigRational;

/// How a plan is to be read. Each `with_` changes one thing.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Options {
    /// Whether actions may overlap, by the rules of PDDL 2.1; otherwise each begins when the one before
    /// it has ended.
    pub concurrent: bool,
    /// In the domain's time unit, not negative. In sequence it is for plans that were rounded: how far a stated
    /// duration may lie from the exact one, and how far a step may reach into the next. Concurrently it is the separation: how far
    /// apart happenings that interfere must be; a stated duration may then lie as far from the exact one, but at most a
    /// thousandth. Events are never forgiven for anything.
    pub tolerance: BigRational,
}

impl Options {
    /// Whether actions may overlap, by the rules of PDDL 2.1.
    #[must_use]
    pub fn with_concurrent(self, concurrent: bool) -> Self {
        Self { concurrent, ..self }
    }

    /// How far a stated duration may lie from the exact one, or, where actions may overlap, how far apart happenings that interfere
    /// must be; in the domain's time unit.
    #[must_use]
    pub fn with_tolerance(self, tolerance: BigRational) -> Self {
        Self { tolerance, ..self }
    }

    /// How far a stated duration may lie from the exact one.
    pub(super) fn slack(&self) -> BigRational {
        let own = self.tolerance.clone();
        if self.concurrent { own.min(Self::default().tolerance) } else { own }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { concurrent: false, tolerance: BigRational::new(BigInt::from(1), BigInt::from(1000)) }
    }
}
