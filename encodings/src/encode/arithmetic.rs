//! Binary arithmetic as clauses: two's complement, ripple-carry addition, constant folding.

use task::number::{Int, dense};

use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::sat::Lit;

/// Bits of a number in two's complement, lowest first; the last bit is the sign.
pub type Bits = Vec<Lit>;

/// Returns the number of bits, including the sign, that every number from `low` to `high` fits
/// into.
#[expect(clippy::arithmetic_side_effects, reason = "a number has at most 128 leading zeros")]
pub fn width(low: Int, high: Int) -> usize {
    let bits = |number: Int| {
        129 - if number < 0 { (!number).leading_zeros() } else { number.leading_zeros() } as usize
    };
    bits(low).max(bits(high))
}

/// Adds arithmetic circuits to a formula, as clauses of one family.
pub struct Arithmetic<'f> {
    pub(crate) formula: &'f mut Formula,
    pub(crate) family: Family,
}

impl Arithmetic<'_> {
    fn bit(&mut self) -> Lit {
        let bit = dense(self.formula.variables());
        self.formula.fresh(VariableMeaning::Bit { bit })
    }

    pub(crate) fn constant(value: Int, width: usize) -> Bits {
        let bit = |index: usize| {
            if value >> index.min(127) & 1 == 1 { Formula::truth() } else { !Formula::truth() }
        };
        (0..width).map(bit).collect()
    }

    /// Sign-extends a number to at least `width` bits.
    pub(crate) fn extend(bits: &Bits, width: usize) -> Bits {
        let sign = bits.last().copied().unwrap_or(!Formula::truth());
        bits.iter().copied().chain(std::iter::repeat(sign)).take(width.max(bits.len())).collect()
    }

    pub(crate) fn and(&mut self, a: Lit, b: Lit) -> Lit {
        let (truth, falsum) = (Formula::truth(), !Formula::truth());
        match (a, b) {
            _ if a == falsum || b == falsum || a == !b => falsum,
            _ if a == truth || a == b => b,
            _ if b == truth => a,
            _ => {
                let and = self.bit();
                self.formula.add(self.family, [!and, a]);
                self.formula.add(self.family, [!and, b]);
                self.formula.add(self.family, [and, !a, !b]);
                and
            }
        }
    }

    fn or(&mut self, a: Lit, b: Lit) -> Lit {
        !self.and(!a, !b)
    }

    fn xor(&mut self, a: Lit, b: Lit) -> Lit {
        let (truth, falsum) = (Formula::truth(), !Formula::truth());
        match (a, b) {
            _ if a == falsum => b,
            _ if b == falsum => a,
            _ if a == truth => !b,
            _ if b == truth => !a,
            _ if a == b => falsum,
            _ if a == !b => truth,
            _ => {
                let xor = self.bit();
                self.formula.add(self.family, [!xor, a, b]);
                self.formula.add(self.family, [!xor, !a, !b]);
                self.formula.add(self.family, [xor, !a, b]);
                self.formula.add(self.family, [xor, a, !b]);
                xor
            }
        }
    }

    fn majority(&mut self, a: Lit, b: Lit, c: Lit) -> Lit {
        let (truth, falsum) = (Formula::truth(), !Formula::truth());
        let constants = [(a, b, c), (b, a, c), (c, a, b)];
        for (constant, x, y) in constants {
            if constant == falsum {
                return self.and(x, y);
            }
            if constant == truth {
                return self.or(x, y);
            }
            if x == y {
                return x;
            }
            if x == !y {
                return constant;
            }
        }
        let majority = self.bit();
        for (x, y) in [(a, b), (a, c), (b, c)] {
            self.formula.add(self.family, [!majority, x, y]);
            self.formula.add(self.family, [majority, !x, !y]);
        }
        majority
    }

    /// Returns the sum of two numbers as a number with `width` bits. The sum must fit into this width.
    pub(crate) fn add(&mut self, a: &Bits, b: &Bits, width: usize) -> Bits {
        let (a, b) = (Self::extend(a, width), Self::extend(b, width));
        let mut carry = !Formula::truth();
        let mut sum = Vec::with_capacity(width);
        for (a, b) in a.iter().zip(&b).take(width) {
            let half = self.xor(*a, *b);
            sum.push(self.xor(half, carry));
            carry = self.majority(*a, *b, carry);
        }
        sum
    }

    /// Returns the product of a number and a constant as a number with `width` bits, by shifts and additions.
    /// The product must fit into this width. For the factor 1, the result is at least as long as `bits`.
    pub(crate) fn multiple(&mut self, bits: &Bits, factor: Int, width: usize) -> Bits {
        if factor == 1 {
            return Self::extend(bits, width);
        }
        let mut sum = Self::constant(0, width);
        for shift in (0..127).filter(|shift| factor.unsigned_abs() >> shift & 1 == 1) {
            let shifted: Bits = std::iter::repeat_n(!Formula::truth(), shift)
                .chain(Self::extend(bits, width))
                .take(width)
                .collect();
            sum = self.add(&sum, &shifted, width);
        }
        if factor < 0 {
            let inverted: Bits = sum.iter().map(|bit| !*bit).collect();
            sum = self.add(&inverted, &Self::constant(1, width), width);
        }
        sum
    }

    /// Returns a number that depends on `premises`, which are pairs of a conjunction and a value. The number
    /// has the value whose conjunction is true, and is 0 if `active` is false. At most one conjunction may be
    /// true at a time, and none if `active` is false. If only `active` is true, the number is not determined.
    pub(crate) fn choose(&mut self, premises: &[(Vec<Lit>, Int)], active: Lit) -> Bits {
        let low = premises.iter().map(|(_, value)| *value).fold(0, Int::min);
        let high = premises.iter().map(|(_, value)| *value).fold(0, Int::max);
        (0..width(low, high))
            .map(|index| {
                let set = |value: Int| value >> index.min(127) & 1 == 1;
                if premises.iter().all(|(_, value)| !set(*value)) {
                    return !Formula::truth();
                }
                let bit = self.bit();
                self.formula.add(self.family, [active, !bit]);
                for (premise, value) in premises {
                    let conclusion = if set(*value) { bit } else { !bit };
                    self.formula.add(self.family, premise.iter().map(|l| !*l).chain([conclusion]));
                }
                bit
            })
            .collect()
    }

    pub(crate) fn equal_if(&mut self, premise: Lit, a: &Bits, b: &Bits) {
        let width = a.len().max(b.len());
        for (a, b) in Self::extend(a, width).into_iter().zip(Self::extend(b, width)) {
            self.formula.add(self.family, [!premise, !a, b]);
            self.formula.add(self.family, [!premise, a, !b]);
        }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub(crate) fn at_most(&mut self, bits: &Bits, limit: Int) {
        let width = bits.len().max(width(limit, limit));
        let bits = Self::extend(bits, width);
        let Some((sign, magnitude)) = bits.split_last() else { return };
        // In two's complement, numbers are ordered like unsigned numbers whose highest bit is the
        // inverted sign.
        let order: Vec<(Lit, bool)> = magnitude
            .iter()
            .enumerate()
            .map(|(i, bit)| (*bit, limit >> i.min(127) & 1 == 1))
            .chain([(!*sign, limit >= 0)])
            .collect();
        for (index, (bit, set)) in order.iter().enumerate() {
            if !set {
                let above = order[index + 1..].iter().filter(|(_, set)| *set).map(|(bit, _)| !*bit);
                let smaller_above = above.collect::<Vec<_>>();
                self.formula.add(self.family, smaller_above.into_iter().chain([!*bit]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sat::{Answer, Backend};
    use task::limits::Limits;

    fn can_be(formula: &Formula, bits: &Bits, value: Int) -> bool {
        let mut solver = Backend::default().start(&Limits::none(), u64::MAX);
        formula.clauses().for_each(|(_, clause)| solver.add_clause(clause));
        for (bit, expected) in bits.iter().zip(Arithmetic::constant(value, bits.len())) {
            solver.add_clause(&[if expected == Formula::truth() { *bit } else { !*bit }]);
        }
        solver.solve(&[]) == Answer::Satisfiable
    }

    fn free(formula: &mut Formula, bits: usize) -> Bits {
        (0..bits).map(|bit| formula.fresh(VariableMeaning::Bit { bit: bit as u32 })).collect()
    }

    fn fix(formula: &mut Formula, bits: &Bits, value: Int) {
        for (bit, expected) in bits.iter().zip(Arithmetic::constant(value, bits.len())) {
            formula.add(Family::Numeric, [if expected == Formula::truth() { *bit } else { !*bit }]);
        }
    }

    #[test]
    fn sums_and_multiples_are_exact() {
        for a in -4..4 {
            for b in -4..4 {
                let mut formula = Formula::new();
                let (x, y) = (free(&mut formula, 3), free(&mut formula, 3));
                fix(&mut formula, &x, a);
                fix(&mut formula, &y, b);
                let mut arithmetic = Arithmetic { formula: &mut formula, family: Family::Numeric };
                let sum = arithmetic.add(&x, &y, 4);
                let multiple = arithmetic.multiple(&x, b, 7);
                for value in -8..8 {
                    assert_eq!(can_be(&formula, &sum, value), value == a + b, "{a} + {b} = {value}?");
                    assert_eq!(can_be(&formula, &multiple, value), value == a * b, "{a} * {b} = {value}?");
                }
            }
        }
    }

    #[test]
    fn at_most_admits_exactly_the_values_up_to_the_limit() {
        for limit in -9..9 {
            let mut formula = Formula::new();
            let x = free(&mut formula, 4);
            Arithmetic { formula: &mut formula, family: Family::Numeric }.at_most(&x, limit);
            for value in -8..8 {
                assert_eq!(can_be(&formula, &x, value), value <= limit, "{value} <= {limit}?");
            }
        }
    }

    #[test]
    fn widths_hold_their_numbers() {
        for (low, high, expected) in
            [(0, 0, 1), (0, 1, 2), (-1, 0, 1), (-2, 1, 2), (0, 7, 4), (-8, 7, 4), (-9, 7, 5)]
        {
            assert_eq!(width(low, high), expected, "{low}..={high}");
        }
    }
}
