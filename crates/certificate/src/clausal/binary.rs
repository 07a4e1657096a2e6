//! Numbers in two's complement, bit by bit, the lowest bit first.

use crate::clausal::formula::Formula;
use crate::clausal::literal::Literal;
use crate::integer::Integer;

/// The bits of a number.
pub(super) type Bits = Vec<Literal>;

/// The bit that says that a number is negative.
pub(super) fn sign(number: &Bits) -> Literal {
    *number.last().expect("invariant: a number has a sign")
}

/// How many bits hold all numbers from one to another.
pub(super) fn width(least: &Integer, most: &Integer) -> usize {
    least.width().max(most.width())
}

impl Formula {
    /// New bits.
    pub(super) fn bits(&mut self, width: usize, name: &str) -> Bits {
        (0..width).map(|position| self.variable(|| format!("bit {position} of {name}"))).collect()
    }

    /// The bits of a constant.
    pub(super) fn constant(&self, number: &Integer, width: usize) -> Bits {
        (0..width).map(|position| if number.bit(position) { self.truth() } else { -self.truth() }).collect()
    }

    /// The sum of two numbers, where it does not overflow.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in a number whose bits are held in memory")]
    pub(super) fn add(&mut self, left: &Bits, right: &Bits, name: &str) -> Bits {
        let sum = self.bits(left.len(), name);
        let mut carry = -self.truth();
        for position in 0..left.len() {
            let (a, b, c, s) = (left[position], right[position], carry, sum[position]);
            for signs in 0..8 {
                let sign =
                    |literal: Literal, place: u32| if signs >> place & 1 == 1 { literal } else { -literal };
                let (a, b, c) = (sign(a, 0), sign(b, 1), sign(c, 2));
                // The literals are all false for one combination of values; so many of these are 1.
                let ones = 3 - u32::count_ones(signs);
                self.clause(&[a, b, c, if ones % 2 == 1 { s } else { -s }]);
            }
            if position + 1 < left.len() {
                let next = self.variable(|| format!("carry {position} of {name}"));
                for (x, y) in [(a, b), (a, c), (b, c)] {
                    self.clause(&[-x, -y, next]);
                    self.clause(&[x, y, -next]);
                }
                carry = next;
            }
        }
        sum
    }

    /// Where a condition holds (all its literals), a number is at least another one.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in a number whose bits are held in memory")]
    pub(super) fn at_least(&mut self, condition: &[Literal], number: &Bits, least: &Integer) {
        let ordered = ordered(number, least);
        for position in 0..ordered.len() {
            if ordered[position].1 {
                let higher =
                    ordered[position + 1..].iter().filter(|(_, one)| !one).map(|(literal, _)| *literal);
                let clause: Vec<Literal> = condition.iter().map(|literal| -*literal).chain(higher).collect();
                self.clause(&[&clause[..], &[ordered[position].0]].concat());
            }
        }
    }

    /// Where a condition holds, a number is at most another one.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in a number whose bits are held in memory")]
    pub(super) fn at_most(&mut self, condition: &[Literal], number: &Bits, most: &Integer) {
        let ordered = ordered(number, most);
        for position in 0..ordered.len() {
            if !ordered[position].1 {
                let higher =
                    ordered[position + 1..].iter().filter(|(_, one)| *one).map(|(literal, _)| -*literal);
                let clause: Vec<Literal> = condition.iter().map(|literal| -*literal).chain(higher).collect();
                self.clause(&[&clause[..], &[-ordered[position].0]].concat());
            }
        }
    }
}

/// Literals of a number and the bits of another one, with the sign turned so that larger numbers come later.
#[expect(clippy::arithmetic_side_effects, reason = "positions in a number whose bits are held in memory")]
fn ordered(number: &Bits, other: &Integer) -> Vec<(Literal, bool)> {
    let last = number.len() - 1;
    let turned = |(position, literal): (usize, &Literal)| {
        let is_sign = position == last;
        (if is_sign { -*literal } else { *literal }, other.bit(position) != is_sign)
    };
    number.iter().enumerate().map(turned).collect()
}
