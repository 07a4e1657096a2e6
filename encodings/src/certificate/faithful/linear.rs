//! Linear expressions over numeric fluents, with exact rationals.

use std::collections::BTreeMap;

use num_rational::BigRational;
use num_traits::Zero;

use crate::certificate::faithful::world::Key;

/// Fluents times factors (none of them 0), plus a constant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Linear {
    pub(super) factors: BTreeMap<Key, BigRational>,
    pub(super) constant: BigRational,
}

impl Linear {
    pub(super) fn constant(constant: BigRational) -> Self {
        Self { factors: BTreeMap::new(), constant }
    }

    pub(super) fn fluent(key: Key) -> Self {
        let one = BigRational::from_integer(1.into());
        Self { factors: BTreeMap::from([(key, one)]), constant: BigRational::zero() }
    }

    /// This plus another one times a factor.
    pub(super) fn plus(mut self, other: &Self, factor: &BigRational) -> Self {
        self.constant += &other.constant * factor;
        for (key, own) in &other.factors {
            let sum = self.factors.remove(key).unwrap_or_else(BigRational::zero) + own * factor;
            if !sum.is_zero() {
                self.factors.insert(key.clone(), sum);
            }
        }
        self
    }

    pub(super) fn times(&self, factor: &BigRational) -> Self {
        Self::constant(BigRational::zero()).plus(self, factor)
    }

    /// The number that it is, if it depends on no fluent.
    pub(super) fn value(&self) -> Option<&BigRational> {
        self.factors.is_empty().then_some(&self.constant)
    }
}
