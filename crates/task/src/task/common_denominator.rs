//! Least common denominator of rationals of any size.

use std::collections::hash_map::Entry;
use std::sync::Arc;

use num_bigint::BigInt;
use num_integer::Integer as _;
use num_traits::One;
use rustc_hash::FxHashMap;

use crate::number::Rational;
use crate::task::quantity::Quantity;

/// Accumulates the least common denominator of numbers.
pub struct CommonDenominator {
    common: Option<BigInt>,
    most_bits: u64,
    /// Visited tables by address, because operators share tables.
    seen: FxHashMap<*const Rational, Arc<[Rational]>>,
}

impl CommonDenominator {
    pub fn of_at_most(most_bits: u64) -> Self {
        Self { common: Some(BigInt::one()), most_bits, seen: FxHashMap::default() }
    }

    pub fn number(&mut self, number: &Rational) {
        if number.is_integer() {
            return;
        }
        let next = self.common.take().map(|common| common.lcm(number.to_big().denom()));
        self.common = next.filter(|next| next.bits() <= self.most_bits);
    }

    pub fn quantity(&mut self, quantity: &Quantity<Rational>) {
        self.number(&quantity.constant);
        for table in &quantity.tables {
            if let Entry::Vacant(new) = self.seen.entry(table.values.as_ptr()) {
                let values = new.insert(table.values.clone()).clone();
                values.iter().for_each(|number| self.number(number));
            }
        }
    }

    /// Returns the least common denominator, or `None` if it exceeds the limit on its bits.
    pub fn get(self) -> Option<BigInt> {
        self.common
    }
}
