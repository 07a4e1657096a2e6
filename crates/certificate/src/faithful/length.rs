//! The range of durations of an instance.

use num_rational::BigRational;
use num_traits::Signed;

use crate::faithful::verdict::Cause;

/// An interval of durations; either end may be excluded. Unbounded if `most` is `None`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Length {
    pub(super) least: BigRational,
    pub(super) most: Option<BigRational>,
}

impl Length {
    /// The only duration of the interval, if there is one.
    pub(super) fn fixed(&self) -> Option<&BigRational> {
        self.most.as_ref().filter(|most| **most == self.least)
    }

    /// Minimal value of the duration times `factor`.
    pub(super) fn least_times(&self, factor: &BigRational) -> Result<BigRational, Cause> {
        if !factor.is_negative() {
            return Ok(&self.least * factor);
        }
        let greatest =
            self.most.as_ref().ok_or_else(|| Cause::unsupported("a metric that rewards time without end"))?;
        Ok(greatest * factor)
    }
}
