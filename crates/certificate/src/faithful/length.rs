//! How long an instance may take.

use num_rational::BigRational;
use num_traits::Signed;

use crate::faithful::verdict::Cause;

/// The lengths that an instance may take: all between two, of which it need not reach either. Without end if there is no greatest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Length {
    pub(super) least: BigRational,
    pub(super) most: Option<BigRational>,
}

impl Length {
    /// The only length, if there is one.
    pub(super) fn fixed(&self) -> Option<&BigRational> {
        self.most.as_ref().filter(|most| **most == self.least)
    }

    /// The least that an instance adds to a sum that counts each unit of time so often.
    pub(super) fn least_times(&self, factor: &BigRational) -> Result<BigRational, Cause> {
        if !factor.is_negative() {
            return Ok(&self.least * factor);
        }
        let most =
            self.most.as_ref().ok_or_else(|| Cause::unsupported("a metric that rewards time without end"))?;
        Ok(most * factor)
    }
}
